/* SORTE frames and PTO words, and the step time sequence. */
#include "rows.h"

/* OUTPUT_LEN FRAME: the frame built again from what was parsed, and its time stamp. */
static void master(char **a, int n)
{
    block_t frame = hex(a[1]);
    size_t output = (size_t)number(a[0]), len = 0;
    sw_sorte_master_frame_t it;
    uint8_t back[2048];
    sw_result_t r = sw_sorte_parse_master_frame(frame.at, frame.len, output, &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        r = sw_sorte_build_master_frame(frame.at + SW_SORTE_DATA_AT, output, it.time_stamp, back, sizeof back, &len);
        say(" %u status %02x %s", it.time_stamp, it.status, sw_text(r));
        say_hex(back, len);
        say_hex(frame.at + SW_SORTE_DATA_AT, output);
    }
}

static void device(char **a, int n)
{
    block_t frame = hex(a[1]);
    sw_sorte_device_frame_t it;
    uint8_t back[6];
    sw_result_t r = sw_sorte_parse_device_frame(frame.at, frame.len, (size_t)number(a[0]), &it);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" address %u status %u %s", it.address, it.status,
            sw_text(sw_sorte_build_device_frame(&it, frame.at + SW_SORTE_DATA_AT, back, sizeof back)));
        say_hex(back, sizeof back);
        say_hex(frame.at + SW_SORTE_DATA_AT, 3);
    }
}

static void pto(char **a, int n)
{
    static const char *const kinds[] = {"no_pulse", "pulse", "driver_off", "reserved"};
    sw_sorte_pto_t it = {0, 0, 0};
    (void)n;
    say("%s", sw_text(sw_sorte_parse_pto((uint16_t)strtoul(a[0], NULL, 16), &it)));
    say(" %s start %u direction %u", kinds[it.kind], it.start_ns, it.direction);
}

static void pto_of_step(char **a, int n)
{
    uint16_t word = 0;
    sw_result_t r = sw_sorte_pto_of_step(U32(a[0]), U8(a[1]), &word);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %04x", word);
    }
}

/* ENTRY SPEED PREV: as the PRU, and corrected. */
static void step(char **a, int n)
{
    uint32_t entry = U32(a[0]), speed = U32(a[1]), prev = U32(a[2]);
    sw_step_time_t pru = {0, 0}, right = {0, 0};
    (void)n;
    (void)sw_step_next_as_pru(entry, speed, prev, &pru);
    (void)sw_step_next(sw_step_time_ns(entry, speed), prev, &right);
    say("%u pru %u %u right %u %u", sw_step_time_ns(entry, speed), pru.cnt, pru.sync, right.cnt, right.sync);
}

static void ramp(char **a, int n)
{
    (void)n;
    say("%u", sw_step_ramp(U8(a[0])));
}

static void speed(char **a, int n)
{
    uint32_t it = 0;
    (void)n;
    say("%s", sw_text(sw_step_speed(U32(a[0]), &it)));
    say(" %u %s", it, sw_text(sw_step_check(it, 1, 0, NULL)));
}

static uint64_t fnv1a64(uint64_t hash, uint64_t value, int bytes)
{
    while (bytes-- > 0) {
        hash = (hash ^ (value & 0xff)) * 0x100000001b3u;
        value >>= 8;
    }
    return hash;
}

static sw_step_move_t move_of(char **a)
{
    sw_step_move_t it;
    it.steps = U32(a[0]);
    it.speed = U32(a[1]);
    it.k = U32(a[2]);
    it.init_sync = U32(a[3]);
    it.as_pru = U8(a[4]);
    return it;
}

/* All steps of a move, in blocks of an odd size. */
static sw_step_step_t *steps_of(const uint32_t *table, const sw_step_move_t *it)
{
    sw_step_step_t *all = malloc(((size_t)it->steps + 1) * sizeof *all);
    size_t count = 1, at = 0;
    while (all != NULL && count > 0) {
        size_t room = it->steps + 1 - at;
        if (sw_step_steps(table, 32, it, (uint32_t)at, all + at, room < 100003 ? room : 100003, &count) != SW_OK) {
            break;
        }
        at += count;
    }
    if (all == NULL || at != it->steps) {
        say("no steps");
        exit(2);
    }
    return all;
}

static uint64_t hash_of(const sw_step_step_t *all, uint32_t steps)
{
    uint64_t hash = 0xcbf29ce484222325u;
    uint32_t k;
    for (k = 0; k < steps; k++) {
        hash = fnv1a64(hash, all[k].cycle & 0xffffffffu, 4);
        hash = fnv1a64(hash, all[k].sync_time & 0xffffu, 2);
    }
    return hash;
}

static void say_steps(const sw_step_step_t *all, uint32_t from, uint32_t to)
{
    for (; from < to; from++) {
        say(" %u,%u,%llu,%u", all[from].entry, all[from].t_step, (unsigned long long)all[from].cycle, all[from].sync_time);
    }
}

static void say_last(const sw_step_step_t *all, uint32_t steps)
{
    if (steps > 0) {
        say(" last %llu,%u", (unsigned long long)all[steps - 1].cycle, all[steps - 1].sync_time);
    }
}

/* STEPS SPEED K SYNC AS_PRU HEAD TAIL */
static void whole_move(char **a, int n)
{
    sw_step_move_t it = move_of(a);
    sw_step_shape_t shape;
    uint32_t tail = U32(a[6]), k, zero = 0, above = 0;
    sw_step_step_t *all;
    (void)n;
    say("%s", sw_text(sw_step_shape(NULL, 0, &it, &shape)));
    say(" %u %u %u total %llu head", shape.accelerating, shape.constant, shape.decelerating, (unsigned long long)shape.duration_ns);
    all = steps_of(NULL, &it);
    for (k = 0; k < it.steps; k++) {
        zero += all[k].sync_time == 0;
        above += all[k].sync_time > 3990;
    }
    say_steps(all, 0, U32(a[5]) < it.steps ? U32(a[5]) : it.steps);
    say(" tail");
    say_steps(all, it.steps > tail ? it.steps - tail : 0, it.steps);
    say_last(all, it.steps);
    say(" zero %u above %u hash %016llx", zero, above, (unsigned long long)hash_of(all, it.steps));
    free(all);
}

/* STEPS SPEED K SYNC AS_PRU HEAD and the 32 entries of a ramp */
static void own_ramp(char **a, int n)
{
    sw_step_move_t it = move_of(a);
    sw_step_shape_t shape;
    sw_step_step_t *all;
    uint32_t own[32], k;
    (void)n;
    for (k = 0; k < 32; k++) {
        own[k] = U32(a[6 + k]);
    }
    if (sw_step_shape(own, 32, &it, &shape) != SW_OK) {
        say("refused");
        return;
    }
    all = steps_of(own, &it);
    say("%llu", (unsigned long long)shape.duration_ns);
    say_steps(all, 0, U32(a[5]));
    say_last(all, it.steps);
    say(" %016llx", (unsigned long long)hash_of(all, it.steps));
    free(all);
}

/* STEPS SPEED K SYNC AS_PRU COUNT: every step. */
static void listed(char **a, int n)
{
    sw_step_move_t it = move_of(a);
    sw_step_step_t *all = steps_of(NULL, &it);
    (void)n;
    say_steps(all, 0, U32(a[5]));
    free(all);
}

/* STEPS SPEED K SYNC AS_PRU DIRECTION CYCLES GUARD: the words of all cycles. */
static void stream(char **a, int n)
{
    sw_step_move_t it = move_of(a);
    uint8_t direction = U8(a[5]);
    uint64_t cycles = number(a[6]), cycle, hash = 0xcbf29ce484222325u;
    uint16_t idle = (uint16_t)(direction << 15), word;
    sw_step_step_t *all = steps_of(NULL, &it);
    uint32_t k = 0;
    sw_sorte_pto_t pto = {0, 0, 0};
    (void)n;
    say("%04x", idle);
    say(" %s", sw_text(sw_sorte_parse_pto(idle, &pto)));
    say(" %d", pto.kind == SW_SORTE_NO_PULSE && pto.direction == direction);
    for (cycle = 0; cycle < cycles; cycle++) {
        word = idle;
        if (k < it.steps && all[k].cycle == cycle) {
            word = (uint16_t)(idle | all[k].sync_time);
            if (U8(a[7])) {
                (void)sw_sorte_pto_of_step(all[k].sync_time, direction, &word);
            }
            k++;
        }
        if (word != idle) {
            say(" %llu:%04x", (unsigned long long)cycle, word);
        }
        hash = fnv1a64(hash, word, 2);
    }
    say(" hash %016llx", (unsigned long long)hash);
    free(all);
}

static void params(char **a, int n)
{
    bool exact = false;
    sw_result_t r = sw_step_check(U32(a[0]), U32(a[1]), U32(a[2]), &exact);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %d", exact);
    }
}

static void duration(char **a, int n)
{
    uint64_t ns = 0;
    (void)n;
    say("%s", sw_text(sw_step_duration_ns(U32(a[0]), U32(a[1]), U32(a[2]), U32(a[3]), &ns)));
    say(" %llu", (unsigned long long)ns);
}

/* crc8 of HEX, HEX ...: what it is after each. */
static void crc8(char **a, int n)
{
    uint8_t crc = 0;
    int k;
    for (k = 0; k < n; k++) {
        block_t bytes = hex(a[k]);
        if (sw_sorte_crc8(bytes.at, bytes.len, &crc) == SW_OK) {
            say("%s%02x", k > 0 ? " " : "", crc);
        }
    }
}

/* The CRC-8 of every byte alone. */
static void lut(char **a, int n)
{
    unsigned byte;
    (void)a;
    (void)n;
    for (byte = 0; byte < 256; byte++) {
        uint8_t crc = 0, it = (uint8_t)byte;
        (void)sw_sorte_crc8(&it, 1, &crc);
        say("%02x", crc);
    }
}

/* TYPE HEX: the header, and the frame through the call of its type, built again. */
static void startup(char **a, int n)
{
    block_t frame = hex(a[1]);
    sw_sorte_header_t header;
    sw_sorte_param_t param;
    sw_sorte_sync_t sync;
    sw_sorte_discovery_t discovery;
    static uint8_t back[SW_SORTE_DISCOVERY];
    size_t size = frame.len;
    sw_result_t r = sw_sorte_parse_header(frame.at, frame.len, &header), typed = r;
    (void)n;
    memset(back, 0, sizeof back);
    if (strcmp(a[0], "PARAM") == 0 && (typed = sw_sorte_parse_param(frame.at, frame.len, &param)) == SW_OK) {
        (void)sw_sorte_build_param(&param, back, sizeof back);
    } else if (strcmp(a[0], "SYNC") == 0 && (typed = sw_sorte_parse_sync(frame.at, frame.len, &sync)) == SW_OK) {
        (void)sw_sorte_build_sync(&sync, back, sizeof back);
    } else if (strcmp(a[0], "DELAY_REQ") == 0 && r == SW_OK) {
        (void)sw_sorte_build_delay_req(header.source, header.status, back, sizeof back);
    } else if (strcmp(a[0], "DISCOVERY") == 0 && (typed = sw_sorte_parse_discovery(frame.at, frame.len, &discovery)) == SW_OK) {
        /* Only that of a master is built in C. */
        memcpy(back, frame.at, frame.len);
    }
    say("%s", sw_text(r));
    if (typed != r) {
        say(" by its type %s", sw_text(typed));
    }
    if (r == SW_OK) {
        say(" same %d", size <= sizeof back && memcmp(back, frame.at, size) == 0);
    }
}

/* HEX with its preamble. */
static void preamble(char **a, int n)
{
    block_t wire = hex(a[0]);
    size_t at = 0;
    sw_result_t r = sw_sorte_strip_preamble(wire.at, wire.len, &at);
    (void)n;
    say("%s", sw_text(r));
    if (r == SW_OK) {
        say(" %u", (unsigned)at);
    }
}

static void param(char **a, int n)
{
    block_t frame = hex(a[0]);
    sw_sorte_param_t it;
    uint8_t back[40];
    (void)n;
    say("%s", sw_text(sw_sorte_parse_param(frame.at, frame.len, &it)));
    say(" %u %u %u %u %u %u %u", it.cycle_time_ns, it.sync_cycle, it.delay_period_ms, it.delay_burst, it.delay_gap_ms,
        it.delay_fwd_time_ns, it.ipg_5ns);
    say(" %u %u %u %u %u %u status %u", it.t_in_ns, it.t_out_ns, it.topology, it.diagnostics, it.alarm, it.crc_mode, it.status);
    say(" %s", sw_text(sw_sorte_build_param(&it, back, sizeof back)));
    say_hex(back, sizeof back);
}

/* WORD MASK for a shared word, or four words: the payload, and its words again. */
static void payload(char **a, int n)
{
    uint8_t bytes[SW_SORTE_PAYLOAD];
    uint16_t words[4] = {0, 0, 0, 0};
    int k;
    for (k = 0; n == 4 && k < 4; k++) {
        words[k] = (uint16_t)strtoul(a[k], NULL, 16);
    }
    say("%s", sw_text(n == 4 ? sw_sorte_build_payload(words, 4, bytes, sizeof bytes)
                             : sw_sorte_build_shared_payload((uint16_t)strtoul(a[0], NULL, 16), U8(a[1]), bytes, sizeof bytes)));
    say_hex(bytes, sizeof bytes);
    memset(words, 0, sizeof words);
    say(" %s", sw_text(sw_sorte_parse_payload(bytes, sizeof bytes, &words)));
    say(" %04x %04x %04x %04x", words[0], words[1], words[2], words[3]);
}

static void microstep(char **a, int n)
{
    sw_step_microstep_t it;
    (void)n;
    say("%s", sw_text(sw_step_microstep(U8(a[0]), &it)));
    say(" %u %u %u %u %u", it.microsteps, it.turn, it.quarter_turn, it.ten_turns, it.ctrl_field);
}

/* TENTHS_HZ: the tone, and what follows from it by the other calls. */
static void tone(char **a, int n)
{
    sw_step_tone_t it;
    uint32_t full, x, y;
    uint64_t p125 = 0, p250 = 0, hundredths;
    uint8_t at = 0;
    (void)n;
    while (sw_step_tone(at, &it) == SW_OK && it.tenths_hz != number(a[0])) {
        at++;
    }
    if (at == SW_STEP_TONES) {
        say("no such tone");
        return;
    }
    x = it.numerator;
    y = it.denominator * 1000u;
    while (y > 0) {
        uint32_t rest = x % y;
        x = y;
        y = rest;
    }
    hundredths = (it.numerator + it.denominator * 5ull) / (it.denominator * 10ull);
    say("%u/%u %u.%02u", it.numerator / x, it.denominator * 1000u / x, (unsigned)(hundredths / 100), (unsigned)(hundredths % 100));
    full = sw_step_time_ns(sw_step_ramp(31), it.speed);
    (void)sw_step_duration_ns(it.speed, 1, 0, it.p125, &p125);
    (void)sw_step_duration_ns(it.speed, 1, 0, it.p250, &p250);
    say(" %u %u %u %u ppm %.3f %llu %llu", it.speed, it.p125, it.p250, full, (1000.0 * it.speed / 65536.0 - full) / full * 1e6,
        (unsigned long long)p125, (unsigned long long)p250);
}

const entry_t sorte_commands[] = {
    {"sorte_payload", payload}, {"step_microstep", microstep}, {"step_tone", tone},
    {"sorte_crc8", crc8}, {"sorte_lut", lut}, {"sorte_startup", startup}, {"sorte_preamble", preamble}, {"sorte_param", param},
    {"sorte_master", master}, {"sorte_device", device}, {"sorte_pto", pto}, {"sorte_pto_of_step", pto_of_step}, {"step_next", step},
    {"step_ramp", ramp}, {"step_speed", speed}, {"step_params", params}, {"step_duration", duration}, {"step_move", whole_move}, {"step_own_ramp", own_ramp}, {"step_listed", listed},
    {"step_stream", stream}, {NULL, NULL},
};
