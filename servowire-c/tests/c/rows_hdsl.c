/* HIPERFACE DSL: the codec. Words and answers are text of 0 and 1, the first of the line first. */
#include "rows.h"

uint64_t line_bits(const char *text)
{
    uint64_t bits = 0;
    size_t k, len = strcmp(text, "-") == 0 ? 0 : strlen(text);
    for (k = 0; k < len && k < 64; k++) {
        bits |= (uint64_t)(text[k] == '1') << k;
    }
    return bits;
}

void say_line(uint64_t bits, unsigned len)
{
    unsigned k;
    say(" ");
    for (k = 0; k < len; k++) {
        say("%d", (int)(bits >> k & 1));
    }
}

static int8_t sign_of(const char *text) { return (int8_t)signed_number(text); }

static sw_hdsl_character_t character(const char *text)
{
    sw_hdsl_character_t it;
    it.byte = (uint8_t)strtoul(text, NULL, 16);
    it.special = text[strlen(text) - 1] == 'k';
    return it;
}

/* BYTE[k] RD */
static void encode(char **a, int n)
{
    sw_hdsl_character_t it = character(a[0]);
    int8_t rd = sign_of(a[1]);
    uint16_t word = 0;
    (void)n;
    say("%s", sw_text(sw_hdsl_build_word(&it, &rd, &word)));
    say_line(word, 10);
    say(" %d", rd);
}

/* WORD */
static void decode(char **a, int n)
{
    uint16_t word = (uint16_t)line_bits(a[0]);
    sw_hdsl_reading_t strict, reduced;
    sw_hdsl_answer_t answer;
    int8_t rd;
    (void)n;
    say("%s", sw_text(sw_hdsl_read_word(word, SW_HDSL_SICK, &strict)));
    say(" %s", sw_text(sw_hdsl_read_word(word, SW_HDSL_TI, &reduced)));
    say(" %s", sw_text(sw_hdsl_parse_answer((uint64_t)word << 51, SW_HDSL_ANSWER_BITS, SW_HDSL_TI, &answer)));
    if (strict.byte_error) {
        say(" no word");
    } else {
        say(" %02x%s", strict.byte, strict.special ? "k" : "");
    }
    for (rd = -1; rd <= 1; rd = (int8_t)(rd + 2)) {
        int8_t at = rd;
        if (sw_hdsl_check_disparity(word, &at) == SW_HDSL_DISPARITY_OK) {
            say(" column %d", rd);
        }
    }
    say(" disparity %d reduced %02x %d %d %02x", sw_hdsl_disparity(word), reduced.byte, reduced.byte_error, reduced.special,
        answer.words[5].byte);
}

/* RD FLIPS CHARACTERS... */
static void stream(char **a, int n)
{
    static const char *const names[] = {"ok", "disparity", "invalid"};
    uint16_t words[128];
    int8_t rd = sign_of(a[0]), check = rd;
    char *flips = a[1];
    int k, count = n - 2;
    for (k = 0; k < count; k++) {
        sw_hdsl_character_t it = character(a[2 + k]);
        if (sw_hdsl_build_word(&it, &rd, &words[k]) != SW_OK) {
            say("no character");
            return;
        }
    }
    while (*flips != '-' && *flips != 0) {
        unsigned long flip = strtoul(flips, &flips, 10);
        words[flip / 10] = (uint16_t)(words[flip / 10] ^ 1u << flip % 10);
        flips += *flips == ',';
    }
    for (k = 0; k < count; k++) {
        sw_hdsl_reading_t it;
        (void)sw_hdsl_read_word(words[k], SW_HDSL_SICK, &it);
        say_line(words[k], 10);
        say(" %s", names[sw_hdsl_check_disparity(words[k], &check)]);
        say(it.byte_error ? " -" : it.special ? " %02xk" : " %02x", it.byte);
    }
    say(" %d", check);
}

static void crc16(char **a, int n)
{
    block_t bytes = hex(a[0]);
    uint16_t crc = 0;
    (void)n;
    say("%s", sw_text(sw_hdsl_crc16(bytes.at, bytes.len, &crc)));
    say(" %04x", crc);
}

/* A frame whose last two bytes are its CRC. */
static void crc16_frame(char **a, int n)
{
    block_t bytes = hex(a[0]);
    uint16_t crc = 0;
    (void)n;
    if (bytes.len >= 2 && sw_hdsl_crc16(bytes.at, bytes.len - 2, &crc) == SW_OK) {
        say("%d", crc == (bytes.at[bytes.len - 2] << 8 | bytes.at[bytes.len - 1]));
    }
}

static void acceleration(char **a, int n)
{
    int16_t delta = 0;
    sw_result_t r = sw_hdsl_parse_acceleration((uint16_t)strtoul(a[0], NULL, 16), &delta);
    uint16_t word = 0;
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %d %s", delta, sw_text(sw_hdsl_build_acceleration(delta, &word)));
        say(" %04x", word);
    }
}

/* PARAMETER DISPARITY */
static void parameter(char **a, int n)
{
    int8_t disparity = sign_of(a[1]);
    uint16_t word = 0;
    uint8_t back = 0;
    (void)n;
    say("%s", sw_text(sw_hdsl_build_parameter((uint8_t)strtoul(a[0], NULL, 16), &disparity, &word)));
    say_line(word, 10);
    say(" %d %s", disparity, sw_text(sw_hdsl_parse_parameter(word, &back)));
    say(" %02x", back);
}

static void equalisation(char **a, int n)
{
    int8_t disparity = sign_of(a[0]);
    uint8_t bits = 0;
    (void)n;
    say("%s", sw_text(sw_hdsl_equalisation(&disparity, &bits)));
    say_line(bits, 4);
    say(" %d", disparity);
}

/* PARAMETER EDGE DISPARITY */
static void head(char **a, int n)
{
    uint8_t back = 0, extra = 0;
    sw_hdsl_head_t it;
    (void)n;
    say("%s", sw_text(sw_hdsl_build_head((uint8_t)strtoul(a[0], NULL, 16), U8(a[1]), sign_of(a[2]), &it)));
    say_bits(it.bits, it.len);
    say_line(it.equalisation, 4);
    say_line(it.para, 10);
    say(" %d %s", it.disparity, sw_text(sw_hdsl_parse_head(&it, &back, &extra)));
    say(" %02x %u", back, extra);
}

/* The same as samples, and read back. */
static void head_samples(char **a, int n)
{
    uint8_t edge = U8(a[1]), parameter = (uint8_t)strtoul(a[0], NULL, 16), back = 0, extra = 0, samples[64];
    sw_hdsl_head_t it;
    size_t len = 0;
    (void)n;
    say("%s", sw_text(sw_hdsl_build_head(parameter, edge, sign_of(a[2]), &it)));
    say(" %s", sw_text(sw_hdsl_parse_head(&it, &back, &extra)));
    say(" %02x %u", back, extra);
    say(" %s", sw_text(sw_hdsl_head_samples(parameter, edge, sign_of(a[2]), samples, it.len, &len)));
    say_hex(samples, len);
}

/* PARA NOMINAL EDGE: the parameter byte, what levels a window of so many ones, and the bits of a window with its edge there. */
static void sync_frame(char **a, int n)
{
    uint8_t parameter = 0, equalisation = 0, extra = 0;
    int8_t disparity = sign_of(a[1]);
    sw_hdsl_head_t it;
    (void)n;
    say("%s", sw_text(sw_hdsl_parse_parameter((uint16_t)line_bits(a[0]), &parameter)));
    say(" %02x %s", parameter, sw_text(sw_hdsl_equalisation(&disparity, &equalisation)));
    say_line(equalisation, 4);
    (void)sw_hdsl_build_head(parameter, U8(a[2]), 0, &it);
    say(" %s", sw_text(sw_hdsl_parse_head(&it, &parameter, &extra)));
    say(" %u", extra);
}

/* WINDOW, edge and stuffing at the start, then steps: each is an adjustment. */
static void extra_steps(char **a, int n)
{
    sw_hdsl_extra_t it;
    int k;
    it.window = (int16_t)signed_number(a[0]);
    it.edge = U8(a[1]);
    it.stuffing = U8(a[2]);
    it.edge_register = sw_hdsl_edge_register(it.edge);
    say("%u", it.edge_register);
    for (k = 3; k < n; k++) {
        say(" %s", sw_text(sw_hdsl_extra_step(&it, (int16_t)signed_number(a[k]))));
        say(" %u %u %u %d %u", it.edge / 8, it.edge % 8, it.stuffing, it.window, it.edge_register);
    }
}

static void say_answer(const sw_hdsl_answer_t *strict, const sw_hdsl_answer_t *reduced)
{
    int k;
    for (k = 0; k < 6; k++) {
        if (strict->words[k].byte_error) {
            say(" -");
        } else {
            say(" %02x%s", strict->words[k].byte, strict->words[k].special ? "k" : "");
        }
        say(" %02x %d %d", reduced->words[k].byte, reduced->words[k].byte_error, reduced->words[k].special);
    }
    say(" switch %d", strict->switch_ok);
}

/* BITS [RD VERTICAL PARAMETER PIPE ACCELERATION SECONDARY]: as both dialects read it; what the content is sent as. */
static void answer(char **a, int n)
{
    uint32_t len = strcmp(a[0], "-") == 0 ? 0 : (uint32_t)strlen(a[0]);
    sw_hdsl_answer_t strict, reduced;
    sw_result_t r = sw_hdsl_parse_answer(line_bits(a[0]), len, SW_HDSL_SICK, &strict);
    say("%s", sw_text(r));
    if (r != SW_OK) {
        return;
    }
    (void)sw_hdsl_parse_answer(line_bits(a[0]), len, SW_HDSL_TI, &reduced);
    say_answer(&strict, &reduced);
    say(" %s", sw_text(reduced.acceleration));
    say(" %d", reduced.delta_delta);
    if (n > 1) {
        sw_hdsl_content_t content;
        int8_t rd = sign_of(a[1]);
        uint64_t bits = 0;
        content.vertical = (uint8_t)strtoul(a[2], NULL, 16);
        content.parameter = (uint8_t)strtoul(a[3], NULL, 16);
        content.pipe = character(a[4]);
        content.delta_delta = 0;
        content.accelerated = strcmp(a[5], "-") != 0 && sw_hdsl_parse_acceleration((uint16_t)strtoul(a[5], NULL, 16), &content.delta_delta) == SW_OK;
        content.secondary = character(a[6]);
        say(" %s", sw_text(sw_hdsl_build_answer(&content, &rd, &bits)));
        say_line(bits, SW_HDSL_ANSWER_BITS);
        say(" %d", rd);
    }
}

static void answer_strict(char **a, int n)
{
    sw_hdsl_answer_t it;
    (void)n;
    say("%s", sw_text(sw_hdsl_parse_answer(line_bits(a[0]), (uint32_t)strlen(a[0]), SW_HDSL_SICK, &it)));
    say(" %s", sw_text(it.acceleration));
    say(" %d", it.delta_delta);
}

static void say_safe(const char *name, const sw_hdsl_safe_t *it, unsigned bad)
{
    say(" %s %s", name, sw_text(it->result));
    say(bad & 1 ? " -" : " %02x", it->status);
    say(bad & 0x3e ? " -" : " %010llx", (unsigned long long)it->vpos);
    say(bad & 0xc0 ? " -" : " %04x", it->crc);
}

/* Eight answers; if `strict`, a value with a word in no table is a dash. */
static void v_frame_of(char **a, uint8_t dialect, int strict)
{
    uint64_t bits[8];
    sw_hdsl_v_frame_t it;
    sw_hdsl_answer_t answers[8];
    unsigned bad1 = 0, bad2 = 0;
    int k;
    for (k = 0; k < 8; k++) {
        bits[k] = line_bits(a[k]);
        (void)sw_hdsl_parse_answer(bits[k], SW_HDSL_ANSWER_BITS, dialect, &answers[k]);
        bad1 |= (unsigned)(strict && answers[k].words[0].byte_error) << k;
        bad2 |= (unsigned)(strict && answers[k].words[5].byte_error) << k;
    }
    say("%s", sw_text(sw_hdsl_parse_v_frame(bits, 8, dialect, &it)));
    say_safe("safe1", &it.safe1, bad1);
    say_safe("safe2", &it.safe2, bad2);
    say(" vsync");
    for (k = 0; k < 8; k++) {
        say(answers[k].parameter < 0 ? " -" : " %d", answers[k].parameter >> 7);
    }
}

static void v_frame(char **a, int n)
{
    (void)n;
    v_frame_of(a, SW_HDSL_TI, 0);
}

static void v_frame_strict(char **a, int n)
{
    (void)n;
    v_frame_of(a, SW_HDSL_SICK, 1);
}

static void learn(char **a, int n)
{
    block_t samples = hex(a[1]);
    sw_hdsl_alignment_t it = {255, 255};
    (void)n;
    say("%s", sw_text(sw_hdsl_learn(samples.at, samples.len, U8(a[0]), &it)));
    say(" %u %u", it.index, it.delay);
}

/* INDEX DELAY SAMPLES */
static void sampled(char **a, int n)
{
    sw_hdsl_alignment_t it;
    block_t samples = hex(a[2]);
    uint64_t bits = 0;
    uint8_t rssi = 0;
    (void)n;
    it.index = U8(a[0]);
    it.delay = U8(a[1]);
    say("%s", sw_text(sw_hdsl_sampled(&it, samples.at, samples.len, &bits, &rssi)));
    say_line(bits, SW_HDSL_ANSWER_BITS);
    say(" %u", rssi);
}

static void rssi(char **a, int n)
{
    uint8_t edges = (uint8_t)strtoul(a[0], NULL, 16);
    (void)n;
    say("%u %u", sw_hdsl_longest_gap(edges), sw_hdsl_rssi(edges));
}

static void edges(char **a, int n)
{
    uint8_t it = sw_hdsl_edges(U8(a[0]) == 1, (uint8_t)strtoul(a[1], NULL, 16));
    (void)n;
    say("%02x %u", it, sw_hdsl_rssi(it));
}

static void sample_edge(char **a, int n)
{
    (void)n;
    say("%u", sw_hdsl_sample_index((uint8_t)strtoul(a[1], NULL, 16), strcmp(a[0], "falling") == 0));
}

/* DIALECT POS_BITS, then a frame each: ACC (or -), which ends with VPOS, or none at the end of a V-frame, after a comma */
static void tracker(char **a, int n)
{
    sw_hdsl_tracker_t it;
    sw_hdsl_position_registers_t registers;
    int k;
    say("%s", sw_text(sw_hdsl_tracker_start(&it, U8(a[1]), U8(a[0]))));
    for (k = 2; k < n; k++) {
        char *safe = strchr(a[k], ',');
        int16_t delta = 0;
        int usable = a[k][0] != '-' && sw_hdsl_parse_acceleration((uint16_t)strtoul(a[k], NULL, 16), &delta) == SW_OK;
        (void)(usable ? sw_hdsl_tracker_step(&it, delta) : sw_hdsl_tracker_miss(&it));
        (void)sw_hdsl_tracker_registers(&it, &registers);
        say(" %d %010llx %06x", usable, (unsigned long long)registers.pos, (unsigned)registers.vel & 0xffffffu);
        if (safe != NULL && strcmp(safe + 1, "none") == 0) {
            (void)sw_hdsl_tracker_no_safe_position(&it);
        } else if (safe != NULL && safe[1] != '-') {
            (void)sw_hdsl_tracker_align(&it, strtoull(safe + 1, NULL, 16));
        }
        (void)sw_hdsl_tracker_registers(&it, &registers);
        if (safe != NULL) {
            say(" after %010llx %06x %u %d", (unsigned long long)registers.pos, (unsigned)registers.vel & 0xffffffu, registers.stage,
                registers.pos_flag);
        }
    }
}

static void quality(char **a, int n)
{
    sw_hdsl_quality_t ti, sick;
    int k;
    say("%s", sw_text(sw_hdsl_quality_start(&ti, SW_HDSL_TI)));
    say(" %s", sw_text(sw_hdsl_quality_start(&sick, SW_HDSL_SICK)));
    say(" %d %d", sw_hdsl_quality_value(&ti), sw_hdsl_quality_value(&sick));
    for (k = 0; k < n; k++) {
        (void)sw_hdsl_quality_count(&ti, U8(a[k]));
        (void)sw_hdsl_quality_count(&sick, U8(a[k]));
        say(" %d %d %d %d", sw_hdsl_quality_value(&ti), sw_hdsl_quality_is_lost(&ti), sw_hdsl_quality_value(&sick),
            sw_hdsl_quality_is_lost(&sick));
    }
}

/* put,BYTE[k] or put,- (ten equal bits), take, or status, of which PIPE_S alone is told */
static void pipe_fifo(char **a, int n)
{
    sw_hdsl_pipe_t it;
    int k;
    say("%s", sw_text(sw_hdsl_pipe_start(&it)));
    for (k = 0; k < n; k++) {
        if (strncmp(a[k], "put,", 4) != 0) {
            uint8_t status = 0, data = 0;
            (void)sw_hdsl_pipe_take(&it, &status, &data);
            say(" %02x", status);
            if (strcmp(a[k], "take") == 0) {
                say(" %02x", data);
            }
        } else {
            uint16_t word = 0;
            int8_t rd = 1;
            sw_hdsl_character_t put = character(a[k] + 4);
            if (a[k][4] != '-') {
                (void)sw_hdsl_build_word(&put, &rd, &word);
            }
            (void)sw_hdsl_pipe_put(&it, word, SW_HDSL_SICK);
        }
    }
}

/* REGISTER WRITE VALUE ANSWER: the request, the request read back, the answer, and what it says. */
static void short_message(char **a, int n)
{
    sw_hdsl_short_t it, back;
    block_t answer = hex(a[3]);
    uint8_t bytes[SW_HDSL_MESSAGE], value = 0;
    size_t len = 0;
    sw_result_t r;
    (void)n;
    it.register_address = (uint8_t)strtoul(a[0], NULL, 16);
    it.write = U8(a[1]);
    it.value = (uint8_t)strtoul(a[2], NULL, 16);
    say("%s", sw_text(sw_hdsl_build_short(&it, bytes, sizeof bytes, &len)));
    say_hex(bytes, len);
    say(" %s", sw_text(sw_hdsl_parse_short(bytes, len, &back)));
    say(" %02x %u %02x", back.register_address, back.write, back.value);
    r = sw_hdsl_parse_short_answer(&it, answer.at, answer.len, &value);
    say(" %s", sw_text(r));
    if (r == SW_OK) {
        say(" %02x %s", value, sw_text(sw_hdsl_build_short_answer(&it, value, bytes, sizeof bytes, &len)));
        say_hex(bytes, len);
    }
}

/* REGISTER WRITE ANSWER */
static void short_answer(char **a, int n)
{
    sw_hdsl_short_t it;
    block_t answer = hex(a[2]);
    uint8_t value = 0;
    sw_result_t r;
    (void)n;
    it.register_address = (uint8_t)strtoul(a[0], NULL, 16);
    it.write = U8(a[1]);
    it.value = 0;
    r = sw_hdsl_parse_short_answer(&it, answer.at, answer.len, &value);
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %02x", value);
    }
}

static sw_hdsl_long_t long_of(char **a)
{
    sw_hdsl_long_t it;
    block_t data = hex(a[5]);
    memset(&it, 0, sizeof it);
    it.address = (uint16_t)strtoul(a[0], NULL, 16);
    it.write = U8(a[1]);
    it.indirect = U8(a[2]);
    it.len = U8(a[3]);
    it.offset = strcmp(a[4], "-") == 0 ? SW_HDSL_NO_OFFSET : U16(a[4]);
    memcpy(it.data, data.at, data.len);
    return it;
}

/* ADDRESS WRITE INDIRECT LEN OFFSET DATA ANSWER */
static void long_message(char **a, int n)
{
    sw_hdsl_long_t it = long_of(a), back;
    sw_hdsl_data_t data;
    block_t answer = hex(a[6]);
    uint8_t bytes[SW_HDSL_MESSAGE];
    size_t len = 0;
    sw_result_t r;
    (void)n;
    say("%s", sw_text(sw_hdsl_build_long(&it, bytes, sizeof bytes, &len)));
    say_hex(bytes, len);
    memset(&back, 0, sizeof back);
    say(" %s", sw_text(sw_hdsl_parse_long(bytes, len, &back)));
    say(" %d", back.address == it.address && back.offset == it.offset && back.write == it.write && back.indirect == it.indirect &&
        back.len == it.len && memcmp(back.data, it.data, 8) == 0);
    r = sw_hdsl_parse_long_answer(&it, answer.at, answer.len, &data);
    say(" %s", sw_text(r));
    if (r == SW_OK || r == SW_E_HDSL_RESOURCE) {
        say_hex(data.data, data.len);
        say(" %s", sw_text(sw_hdsl_build_long_answer(&it, r != SW_OK, &data, bytes, sizeof bytes, &len)));
        say_hex(bytes, len);
    }
}

/* ADDRESS WRITE GOOD ANSWER: the request is the one that GOOD answers by its header. */
static void long_answer(char **a, int n)
{
    block_t good = hex(a[2]), answer = hex(a[3]);
    sw_hdsl_long_t it;
    sw_hdsl_data_t data;
    sw_result_t r;
    (void)n;
    memset(&it, 0, sizeof it);
    it.address = (uint16_t)strtoul(a[0], NULL, 16);
    it.write = U8(a[1]);
    it.offset = SW_HDSL_NO_OFFSET;
    it.indirect = good.at[0] >> 4 & 1 ? 1 : 0;
    it.len = (uint8_t)(good.len - 4);
    r = sw_hdsl_parse_long_answer(&it, answer.at, answer.len, &data);
    say("%s", sw_text(r));
}

const entry_t hdsl_commands[] = {
    {"hdsl_encode", encode}, {"hdsl_decode", decode}, {"hdsl_stream", stream}, {"hdsl_crc16", crc16}, {"hdsl_crc16_frame", crc16_frame},
    {"hdsl_acceleration", acceleration}, {"hdsl_parameter", parameter}, {"hdsl_equalisation", equalisation}, {"hdsl_head", head},
    {"hdsl_extra", extra_steps}, {"hdsl_answer", answer}, {"hdsl_answer_strict", answer_strict}, {"hdsl_v_frame", v_frame},
    {"hdsl_learn", learn}, {"hdsl_sampled", sampled}, {"hdsl_rssi", rssi}, {"hdsl_edges", edges}, {"hdsl_sample_edge", sample_edge},
    {"hdsl_tracker", tracker}, {"hdsl_quality", quality}, {"hdsl_pipe", pipe_fifo}, {"hdsl_short", short_message},
    {"hdsl_long", long_message},
    {"hdsl_head_samples", head_samples}, {"hdsl_sync_frame", sync_frame}, {"hdsl_v_frame_strict", v_frame_strict},
    {"hdsl_short_answer", short_answer}, {"hdsl_long_answer", long_answer}, {NULL, NULL},
};
