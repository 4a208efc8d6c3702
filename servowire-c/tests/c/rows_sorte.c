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

/* crc8 of HEX, HEX ...: what it is behind each. */
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

const entry_t sorte_commands[] = {
    {"sorte_crc8", crc8}, {"sorte_lut", lut}, {"sorte_startup", startup}, {"sorte_preamble", preamble}, {"sorte_param", param},
    {"sorte_master", master}, {"sorte_device", device}, {"sorte_pto", pto}, {"sorte_pto_of_step", pto_of_step}, {"step_next", step},
    {"step_ramp", ramp}, {"step_speed", speed}, {"step_params", params}, {"step_duration", duration}, {NULL, NULL},
};
