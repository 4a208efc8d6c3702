/* T-Format. */
#include "rows.h"

static sw_tformat_request_t asked_of(char **a)
{
    sw_tformat_request_t asked = {U8(a[0]), U8(a[1]), U8(a[2])};
    return asked;
}

static void say_flags(uint8_t sf, uint8_t almc)
{
    static const struct {
        uint8_t bit;
        const char *name;
    } of_sf[] = {{SW_TFORMAT_SF_EA0, "EA0"}, {SW_TFORMAT_SF_EA1, "EA1"}, {SW_TFORMAT_SF_CA0, "CA0"}, {SW_TFORMAT_SF_CA1, "CA1"}},
      of_almc[] = {{SW_TFORMAT_ALMC_OS, "OS"}, {SW_TFORMAT_ALMC_FS, "FS"}, {SW_TFORMAT_ALMC_CE, "CE"}, {SW_TFORMAT_ALMC_OF, "OF"},
                   {SW_TFORMAT_ALMC_OH, "OH"}, {SW_TFORMAT_ALMC_ME, "ME"}, {SW_TFORMAT_ALMC_BE, "BE"}, {SW_TFORMAT_ALMC_BA, "BA"}};
    size_t k;
    say(" sf %u", sf);
    for (k = 0; k < sizeof of_sf / sizeof *of_sf; k++) {
        if (sf & of_sf[k].bit) {
            say(" %s", of_sf[k].name);
        }
    }
    say(" almc %u", almc);
    for (k = 0; k < sizeof of_almc / sizeof *of_almc; k++) {
        if (almc & of_almc[k].bit) {
            say(" %s", of_almc[k].name);
        }
    }
}

static void say_response(sw_result_t r, const sw_tformat_response_t *it)
{
    uint8_t bytes[11], abs_bits, abm_bits;
    bool documented;
    size_t len = 0;
    say("%s", sw_text(r));
    if (r != SW_OK) {
        return;
    }
    say(" id %u abs %u abm %u enid %u adf %u busy %d edf %u", it->id, it->abs, it->abm, it->enid,
        it->adf & SW_TFORMAT_ADF_ADDRESS, (it->adf & SW_TFORMAT_ADF_BUSY) != 0, it->edf);
    say_flags(it->sf, it->almc);
    if (sw_tformat_widths(it->enid, &abs_bits, &abm_bits, &documented) == SW_OK) {
        say(" width %u %u %d", abs_bits, abm_bits, documented);
    }
    say(" bytes %s", sw_text(sw_tformat_build_response(it, bytes, sizeof bytes, &len)));
    say_hex(bytes, len);
}

/* The typed call says the same as the generic one. */
static void typed(const sw_tformat_request_t *asked, block_t bytes, sw_result_t r, const sw_tformat_response_t *it)
{
    sw_tformat_single_turn_t single = {0, 0};
    sw_tformat_multi_turn_t multi = {0, 0};
    sw_tformat_encoder_id_t id = {0, 0};
    sw_tformat_all_t all = {0, 0, 0, 0, 0};
    sw_result_t typed;
    bool same;
    switch (asked->id) {
    case SW_TFORMAT_READ_SINGLE_TURN:
        typed = sw_tformat_parse_single_turn(bytes.at, bytes.len, &single);
        same = single.abs == it->abs && single.sf == it->sf;
        break;
    case SW_TFORMAT_READ_MULTI_TURN:
        typed = sw_tformat_parse_multi_turn(bytes.at, bytes.len, &multi);
        same = multi.abm == it->abm && multi.sf == it->sf;
        break;
    case SW_TFORMAT_READ_ENCODER_ID:
        typed = sw_tformat_parse_encoder_id(bytes.at, bytes.len, &id);
        same = id.enid == it->enid && id.sf == it->sf;
        break;
    case SW_TFORMAT_READ_ALL:
        typed = sw_tformat_parse_all(bytes.at, bytes.len, &all);
        same = all.abs == it->abs && all.abm == it->abm && all.sf == it->sf && all.enid == it->enid && all.almc == it->almc;
        break;
    default:
        return;
    }
    if (typed != r || !same) {
        say(" typed differs: %s", sw_text(typed));
    }
}

static void parse(char **a, int n)
{
    sw_tformat_request_t asked = asked_of(a);
    sw_tformat_response_t it;
    sw_detail_t why;
    block_t bytes = hex(a[3]);
    sw_result_t r;
    (void)n;
    memset(&it, 0, sizeof it);
    r = sw_tformat_parse(&asked, bytes.at, bytes.len, &it);
    say_response(r, &it);
    typed(&asked, bytes, r, &it);
    if (sw_tformat_why(&asked, bytes.at, bytes.len, &why) != r) {
        say(" why differs");
    }
    if (r == SW_E_TFORMAT_REJECTED) {
        say_flags((uint8_t)why.got, 0);
    }
}

static void parse_line(char **a, int n)
{
    sw_tformat_request_t asked = asked_of(a);
    sw_tformat_response_t it;
    block_t bits = packed(a[3]);
    sw_result_t r;
    size_t len = strcmp(a[3], "-") == 0 ? 0 : strlen(a[3]), k;
    (void)n;
    r = sw_tformat_parse_line(&asked, bits.at, len, SW_LSB_FIRST, &it);
    say_response(r, &it);
    for (k = 0; k < bits.len; k++) {
        uint8_t turned = 0, bit;
        for (bit = 0; bit < 8; bit++) {
            turned = (uint8_t)(turned << 1 | (bits.at[k] >> bit & 1));
        }
        bits.at[k] = turned;
    }
    if (sw_tformat_parse_line(&asked, bits.at, len, SW_MSB_FIRST, &it) != r) {
        say(" MSB first differs");
    }
}

static void parse_echoed(char **a, int n)
{
    sw_tformat_request_t asked;
    sw_tformat_response_t it;
    block_t request = hex(a[0]), bytes = hex(a[1]);
    sw_result_t r;
    (void)n;
    r = sw_tformat_parse_request(request.at, request.len, &asked);
    if (r != SW_OK) {
        say("request %s", sw_text(r));
        return;
    }
    r = sw_tformat_parse_echoed(&asked, bytes.at, bytes.len, &it);
    say_response(r, &it);
}

static void parse_request(char **a, int n)
{
    sw_tformat_request_t it;
    block_t bytes = hex(a[0]);
    sw_result_t r = sw_tformat_parse_request(bytes.at, bytes.len, &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %u %u %d %u", it.id, it.adf & SW_TFORMAT_ADF_ADDRESS, (it.adf & SW_TFORMAT_ADF_BUSY) != 0, it.edf);
    }
}

static void control_field(char **a, int n)
{
    uint8_t id = U8(a[0]), found = 99, cf = sw_tformat_control_field(id);
    sw_result_t r = sw_tformat_parse_control_field(cf, &found);
    sw_tformat_request_t asked = {0, 0, 0};
    uint8_t bytes[5];
    size_t len;
    sw_detail_t why;
    (void)n;
    say("%02x %s", cf, sw_text(r));
    asked.id = id;
    if (r == SW_OK) {
        /* A frame of one field is how many short? */
        say(" %d", found == id);
        say(" %d", sw_tformat_build(&asked, bytes, sizeof bytes, &len) == SW_OK);
        (void)sw_tformat_why(&asked, &cf, 1, &why);
        say(" %u %u", (unsigned)len, why.want);
        say(" %s", sw_text(sw_tformat_build_line(&asked, SW_LSB_FIRST, bytes, sizeof bytes, &len)));
        say_bits(bytes, 10);
    }
}

static void classify(char **a, int n)
{
    uint8_t id = 0;
    sw_result_t r = sw_tformat_parse_control_field(U8(a[0]), &id);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %u", id);
    }
}

static void crc(char **a, int n)
{
    block_t bytes = hex(a[0]);
    (void)n;
    say("%02x", sw_tformat_crc(bytes.at, bytes.len));
}

static uint64_t lasts(const sw_tformat_request_t *asked, uint32_t rate)
{
    sw_tformat_t m;
    sw_tformat_transmission_t tx;
    if (sw_tformat_init(&m, rate, 23, 16) != SW_OK || sw_tformat_start(&m, asked, 1000000, &tx) != SW_SEND) {
        return 0;
    }
    return tx.end_ns - tx.start_ns;
}

static void build(char **a, int n)
{
    sw_tformat_request_t asked = asked_of(a), back;
    uint8_t bytes[4], line[5];
    uint16_t words[4];
    size_t len = 0, bits = 0, k;
    sw_detail_t why;
    (void)n;
    say("%s", sw_text(sw_tformat_build(&asked, bytes, sizeof bytes, &len)));
    say_hex(bytes, len);
    say(" %s", sw_text(sw_tformat_build_line(&asked, SW_LSB_FIRST, line, sizeof line, &bits)));
    say_bits(line, bits);
    say(" %s", sw_text(sw_tformat_build_line(&asked, SW_MSB_FIRST, line, sizeof line, &bits)));
    say_hex(line, (bits + 7) / 8);
    (void)sw_tformat_why(&asked, bytes, 1, &why);
    say(" %u %u %u", (unsigned)lasts(&asked, 2500000), (unsigned)lasts(&asked, 5000000), why.want);
    say(" %s", sw_text(sw_tformat_build_spi10(&asked, words, 4, &bits)));
    for (k = 0; k < bits; k++) {
        say(" %03x", words[k]);
    }
    say(" %d", sw_tformat_parse_request(bytes, len, &back) == SW_OK && memcmp(&back, &asked, sizeof back) == 0);
}

static void say_position(uint32_t abs, uint32_t abm, char **a, uint8_t flags)
{
    sw_tformat_response_t answer;
    sw_tformat_transmission_t tx;
    sw_tformat_t m;
    sw_position_t position;
    uint8_t bytes[11];
    uint32_t angle = 0;
    size_t len = 0;
    memset(&answer, 0, sizeof answer);
    answer.id = SW_TFORMAT_READ_ALL;
    answer.abs = abs;
    answer.abm = abm;
    (void)sw_tformat_build_response(&answer, bytes, sizeof bytes, &len);
    say("%s", sw_text(sw_tformat_init(&m, 2500000, U8(a[2]), U8(a[3]))));
    (void)sw_tformat_set_resolution(&m, U8(a[2]), U8(a[3]), flags);
    (void)sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 0, &tx);
    say(" %s", sw_text(sw_tformat_hear(&m, bytes, len, 51000)));
    if (sw_tformat_position(&m, 51000, 100000, &position) && sw_tformat_angle(&m, 51000, 100000, &angle)) {
        say(" %lld %d %u", (long long)position.counts, position.turns, angle);
    } else {
        say(" in doubt");
    }
    say(" ");
}

static void position(char **a, int n)
{
    (void)n;
    say_position(U32(a[0]), U32(a[1]), a, SW_TFORMAT_UNSIGNED_TURNS);
    say_position(U32(a[0]), U32(a[1]), a, 0);
}

static void oversampled(char **a, int n)
{
    static sw_nrz_t receiver;
    sw_nrz_field_t fields[64];
    uint8_t level = U8(a[1]);
    uint32_t spikes = 0;
    size_t count = 0, k;
    int at;
    bool framed = true;
    say("%s", sw_text(sw_nrz_start(&receiver, U32(a[0]), 8)));
    for (at = 2; at < n; at++, level ^= 1) {
        count += sw_nrz_run(&receiver, level, number(a[at]), &fields[count]) == SW_OK && count < 63;
    }
    for (k = 0; k < count; k++) {
        framed = framed && fields[k].delimiter == 1;
        spikes += fields[k].spikes;
    }
    say(" %s %u ", framed ? "ok" : "framing", spikes);
    for (k = 0; k < count; k++) {
        say("%02x", fields[k].content);
    }
    for (k = 0; k < count; k++) {
        say(" %u", (unsigned)fields[k].start);
    }
}

static sw_tformat_device_t encoder;

static void encoder_start(char **a, int n)
{
    (void)a;
    (void)n;
    say("%s", sw_text(sw_tformat_device_start(&encoder, 0x17, 2500000)));
}

/* T_US REQUEST: what the encoder answers. */
static void eeprom(char **a, int n)
{
    block_t bytes = hex(a[1]);
    sw_tformat_request_t asked;
    sw_tformat_response_t it;
    uint8_t reply[11];
    size_t len = 0;
    sw_result_t r = sw_tformat_parse_request(bytes.at, bytes.len, &asked);
    (void)n;
    memset(&it, 0, sizeof it);
    if (r == SW_OK) {
        r = sw_tformat_device_answer(&encoder, &asked, number(a[0]) * 1000, &it);
    }
    (void)sw_tformat_build_response(&it, reply, sizeof reply, &len);
    say("%s", sw_text(r));
    say_hex(reply, len);
    say(" %u %d %u %u", it.adf & SW_TFORMAT_ADF_ADDRESS, (it.adf & SW_TFORMAT_ADF_BUSY) != 0, it.edf,
        sw_tformat_device_page(&encoder));
}

static bool at_encoder(uint8_t id, uint64_t now_ns, sw_tformat_response_t *it)
{
    sw_tformat_request_t asked = {0, 0, 0};
    asked.id = id;
    return sw_tformat_device_answer(&encoder, &asked, now_ns, it) == SW_OK;
}

/* ID DELAY_US: the starts of the requests with this ID in us from the first, the wait after the last one, and what it did. */
static void reset(char **a, int n)
{
    uint8_t id = U8(a[0]);
    /* A field takes 4 us; the answer has six. */
    uint64_t lasts_ns = (4 + number(a[1]) + 24) * 1000, now = 0, first = 0, end = 0;
    unsigned sent = 0;
    sw_tformat_procedure_t p;
    sw_tformat_t m;
    sw_tformat_transmission_t tx;
    sw_tformat_response_t it;
    uint64_t ready = 0, next = 0;
    uint32_t value;
    sw_result_t r;
    (void)n;
    say("%s", sw_text(sw_tformat_device_start(&encoder, 0x17, 2500000)));
    (void)sw_tformat_device_set_position(&encoder, 5, 7);
    (void)sw_tformat_device_set_alarms(&encoder, SW_TFORMAT_ALMC_CE);
    (void)sw_tformat_device_set_alarms(&encoder, 0);
    (void)sw_tformat_init(&m, 2500000, 23, 16);
    if (id == SW_TFORMAT_RESET_ERRORS) {
        r = sw_tformat_clear_errors(&p, 0);
    } else if (id == SW_TFORMAT_SET_SINGLE_TURN_ZERO) {
        r = sw_tformat_zero_single_turn_and_shift_commutation_angle(&p, 23, 0, 0);
    } else {
        r = sw_tformat_clear_turns_and_lose_multi_turn_reference(&p, 23, 16, 0, 0);
    }
    say(" %s", sw_text(r));
    while ((r = sw_tformat_next(&p, &m, now, &tx)) == SW_SEND) {
        uint8_t bytes[11];
        size_t len = 0;
        bool own = tx.bytes[0] == sw_tformat_control_field(id);
        uint64_t end_ns = tx.start_ns + lasts_ns;
        if (!at_encoder(own ? id : tx.bytes[0] >> 3 & 0xf, tx.end_ns, &it)) {
            break;
        }
        (void)sw_tformat_build_response(&it, bytes, sizeof bytes, &len);
        if (own) {
            first = sent++ == 0 ? tx.start_ns : first;
            say(" %u", (unsigned)((tx.start_ns - first) / 1000));
            end = end_ns;
        } else if (end > 0 && next == 0) {
            next = tx.start_ns;
        }
        if (sw_tformat_hear(&m, bytes, len, end_ns) != SW_OK) {
            break;
        }
        now = 0; /* the procedure alone says when */
    }
    (void)sw_tformat_value(&p, &value, &ready);
    say(" %s sent %u wait %u", sw_text(r), sent, (unsigned)(((next ? next : ready) - end) / 1000));
    (void)at_encoder(SW_TFORMAT_READ_ALL, ready + 100000000, &it);
    say(" abs %u abm %u almc %u", it.abs, it.abm, it.almc);
}

const entry_t tformat_commands[] = {
    {"tformat_parse", parse},
    {"tformat_line", parse_line},
    {"tformat_echoed", parse_echoed},
    {"tformat_request", parse_request},
    {"tformat_control_field", control_field},
    {"tformat_classify", classify},
    {"tformat_crc", crc},
    {"tformat_build", build},
    {"tformat_position", position},
    {"tformat_oversampled", oversampled},
    {"tformat_encoder", encoder_start},
    {"tformat_eeprom", eeprom},
    {"tformat_reset", reset},
    {NULL, NULL},
};
