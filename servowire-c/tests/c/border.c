/* What C may do wrong, and what it may do at all: NULL, short buffers, a state that was not started, one of another kind,
 * a copy; and one exchange from the request to the angle. */
#include "check.h"
#include "servowire.h"

/* ID 3: turn 0, 3915817 counts of 23 bits, no alarms. */
static const uint8_t answer[11] = {0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0x00, 0xdf};

static sw_tformat_t zeroed;

static void pointers(void)
{
    sw_tformat_all_t all;
    sw_tformat_response_t response;
    sw_tformat_request_t request = {SW_TFORMAT_READ_EEPROM, 5, 0};
    uint8_t bytes[4];
    size_t len = 99;

    CHECK(sw_tformat_parse_all(NULL, 11, &all) == SW_E_NULL);
    CHECK(sw_tformat_parse_all(answer, 11, NULL) == SW_E_NULL);
    CHECK(sw_tformat_parse_all(answer, 0, &all) == SW_E_TFORMAT_TRUNCATED);
    CHECK(sw_tformat_parse_all(answer, SIZE_MAX, &all) == SW_E_ARGUMENT);
    CHECK(sw_tformat_parse(NULL, answer, 11, &response) == SW_E_NULL);
    CHECK(sw_tformat_build(&request, bytes, 2, &len) == SW_E_SHORT_BUFFER && len == 99);
    CHECK(sw_tformat_build(&request, bytes, 4, NULL) == SW_E_NULL);
    CHECK(sw_tformat_build(&request, NULL, 4, &len) == SW_E_NULL);
    CHECK(sw_tformat_build(&request, bytes, 3, &len) == SW_OK && len == 3 && bytes[2] == (0xea ^ 5));
    request.id = 4;
    CHECK(sw_tformat_build(&request, bytes, 4, &len) == SW_E_ARGUMENT);
}

static void states(void)
{
    sw_tformat_t m;
    sw_tformat_t other;
    sw_tformat_procedure_t p;
    sw_tformat_transmission_t tx;
    sw_tformat_line_t line;
    uint32_t angle = 7;

    memset(&m, 0xff, sizeof m);
    CHECK(sw_tformat_hear(&zeroed, answer, 11, 1) == SW_E_STATE);
    CHECK(sw_tformat_hear(&m, answer, 11, 1) == SW_E_STATE);
    CHECK(sw_tformat_hear(NULL, answer, 11, 1) == SW_E_NULL);
    CHECK(sw_tformat_read(&zeroed, SW_TFORMAT_READ_ALL, 0, &tx) == SW_E_STATE);
    CHECK(!sw_tformat_angle(&zeroed, 0, 1000, &angle) && !sw_tformat_angle(NULL, 0, 1000, &angle) && angle == 7);
    CHECK(sw_tformat_until_ns(&zeroed) == SW_NO_TIME);
    CHECK(sw_tformat_init(&m, 3000000, 23, 16) == SW_E_ARGUMENT && sw_tformat_poll(&m, 0) == SW_E_STATE);
    CHECK(sw_tformat_init(&m, 2500000, 25, 16) == SW_E_ARGUMENT);
    CHECK(sw_tformat_init(NULL, 2500000, 23, 16) == SW_E_NULL);

    /* A state of another kind is none. */
    CHECK(sw_tformat_clear_errors(&p, 0) == SW_OK);
    memcpy(&m, &p, sizeof p);
    CHECK(sw_tformat_poll(&m, 0) == SW_E_STATE);

    CHECK(sw_tformat_init(&m, 2500000, 23, 16) == SW_OK);
    CHECK(sw_tformat_poll(&m, 0) == SW_E_NO_VALUE);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_SET_SINGLE_TURN_ZERO, 0, &tx) == SW_E_ARGUMENT);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, SW_NO_TIME, &tx) == SW_E_CLOCK);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 0, NULL) == SW_E_NULL);
    CHECK(sw_tformat_get_line(&m, &line) == SW_OK && line.bits_per_second == 2500000 && line.turn_around_ns == 1600);
    line.response_timeout_ns = 1000;
    CHECK(sw_tformat_set_line(&m, &line) == SW_OK);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 0, &tx) == SW_E_TFORMAT_LINE);
    line.response_timeout_ns = 10000;
    line.echo = 2;
    CHECK(sw_tformat_set_line(&m, &line) == SW_E_ARGUMENT);

    /* A copy is a state of its own. */
    CHECK(sw_tformat_init(&m, 2500000, 23, 16) == SW_OK);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 0, &tx) == SW_SEND);
    other = m;
    CHECK(sw_tformat_hear(&other, answer, 11, 51000) == SW_OK);
    CHECK(sw_tformat_poll(&m, 1000) == SW_PENDING);
    CHECK(sw_tformat_angle(&other, 60000, 100000, &angle) && !sw_tformat_angle(&m, 60000, 100000, &angle));
}

/* TIDM-1011: ID 3 is 0x1a; a field takes 4 us, the answer begins 3 us after the request. */
static void exchange(void)
{
    sw_tformat_t m;
    sw_tformat_transmission_t tx;
    sw_tformat_response_t response;
    sw_position_t position;
    uint32_t angle = 0;
    uint8_t damaged[11];

    CHECK(sw_tformat_init(&m, 2500000, 23, 16) == SW_OK);
    CHECK(sw_tformat_doubt(&m, 0, 1000) == SW_TFORMAT_DOUBT_NEVER);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 1000000, &tx) == SW_SEND);
    CHECK(tx.len == 1 && tx.bytes[0] == 0x1a && tx.start_ns == 1000000 && tx.end_ns == 1004000);
    CHECK(tx.driver_on_ns == 999000 && tx.driver_off_ns == 1005600);
    CHECK(sw_tformat_hear(&m, answer, 4, 1023000) == SW_PENDING);
    CHECK(sw_tformat_response(&m, &response) == SW_E_NO_VALUE);
    CHECK(sw_tformat_hear(&m, answer + 4, 7, 1051000) == SW_OK);
    CHECK(sw_tformat_response(&m, &response) == SW_OK && response.id == 3 && response.abs == 3915817);
    CHECK(response.enid == 0x17 && response.almc == 0 && response.abm == 0);
    CHECK(sw_tformat_until_ns(&m) == 1051000);

    /* Sampled at 1004480: 62.5 us later it is good, and not a nanosecond longer. */
    CHECK(sw_tformat_angle(&m, 1066980, 62500, &angle) && angle == 3915817u << 9);
    CHECK(sw_tformat_position(&m, 1066980, 62500, &position));
    CHECK(position.single_turn == 3915817 && position.turns == 0 && position.counts == 3915817);
    CHECK(position.sampled_ns == 1004480);
    angle = 5;
    CHECK(!sw_tformat_angle(&m, 1066981, 62500, &angle) && angle == 5);
    CHECK(sw_tformat_doubt(&m, 1066981, 62500) == SW_TFORMAT_DOUBT_OLD);
    CHECK(!sw_tformat_angle(&m, SW_NO_TIME, UINT64_MAX, &angle) && !sw_tformat_angle(&m, SW_NO_TIME - 4000, UINT64_MAX, &angle));
    CHECK(sw_tformat_hear(&m, answer, 11, SW_NO_TIME - 4000) == SW_E_CLOCK && angle == 5);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 1050999, &tx) == SW_E_NOT_FREE);

    /* A damaged answer is refused, and the position grows old. */
    memcpy(damaged, answer, sizeof damaged);
    damaged[3] ^= 1;
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 1100000, &tx) == SW_SEND);
    CHECK(sw_tformat_hear(&m, damaged, 11, 1151000) == SW_E_TFORMAT_CRC);
    CHECK(strcmp(sw_text(SW_E_TFORMAT_CRC), "crc") == 0 && strcmp(sw_text(-9999), "unknown") == 0);
    CHECK(!sw_tformat_angle(&m, 1155000, 62500, &angle));

    /* A late answer may still come: asked at 1104 us, 10 us for its start, eleven fields. */
    CHECK(sw_tformat_until_ns(&m) == 1158000 && sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 1157999, &tx) == SW_E_NOT_FREE);

    /* Nobody answers: 10 us, a field and the time to hand it over, then it is over. */
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 1200000, &tx) == SW_SEND);
    CHECK(sw_tformat_poll(&m, sw_tformat_until_ns(&m) - 1) == SW_PENDING);
    CHECK(sw_tformat_read(&m, SW_TFORMAT_READ_ALL, 9000000, &tx) == SW_E_NOT_FREE);
    CHECK(sw_tformat_poll(&m, sw_tformat_until_ns(&m)) == SW_E_TFORMAT_NO_RESPONSE);
}

/* Master and modelled encoder: ID 7 ten times, an EEPROM byte written and read back. */
static uint64_t now;

static sw_result_t run(sw_tformat_procedure_t *p, sw_tformat_device_t *encoder, uint32_t *value)
{
    sw_tformat_t m;
    sw_tformat_transmission_t tx;
    sw_tformat_answer_t reply;
    sw_result_t r;
    unsigned sent = 0;

    CHECK(sw_tformat_init(&m, 2500000, 17, 16) == SW_OK);
    while ((r = sw_tformat_next(p, &m, now, &tx)) == SW_SEND) {
        CHECK(++sent < 100);
        CHECK(sw_tformat_next(p, &m, now, &tx) == SW_PENDING);
        CHECK(sw_tformat_device_hear(encoder, tx.bytes, tx.len, tx.end_ns, &reply) == SW_SEND);
        CHECK(sw_tformat_hear(&m, reply.bytes, reply.len, reply.end_ns) == SW_OK);
        now = sw_tformat_until_ns(&m);
    }
    CHECK(sw_tformat_value(p, value, &now) == r);
    return r;
}

static void procedures(void)
{
    sw_tformat_procedure_t p;
    sw_tformat_device_t encoder;
    uint32_t value = 0;

    CHECK(sw_tformat_device_start(&encoder, 0x11, 2500000) == SW_OK);
    CHECK(sw_tformat_device_set_position(&encoder, 1000, 3) == SW_OK);
    CHECK(sw_tformat_eeprom_write(&p, 2, 127, 1, now) == SW_E_ARGUMENT);
    CHECK(sw_tformat_eeprom_write(&p, 2, 17, 0x5a, now) == SW_OK);
    CHECK(run(&p, &encoder, &value) == SW_OK && value == 0x5a && sw_tformat_device_page(&encoder) == 2);
    CHECK(sw_tformat_eeprom_read(&p, 2, 17, now) == SW_OK);
    CHECK(run(&p, &encoder, &value) == SW_OK && value == 0x5a);
    CHECK(sw_tformat_clear_errors(&p, now) == SW_OK);
    CHECK(run(&p, &encoder, &value) == SW_OK && value == 1000);
    CHECK(sw_tformat_zero_single_turn_and_shift_commutation_angle(&p, 17, 4, now) == SW_OK);
    CHECK(run(&p, &encoder, &value) == SW_OK && value == 0);
    CHECK(sw_tformat_clear_turns_and_lose_multi_turn_reference(&p, 17, 16, 0, now) == SW_OK);
    CHECK(run(&p, &encoder, &value) == SW_OK && value == 0);
    CHECK(sw_tformat_device_start(&encoder, 0x11, 5000000) == SW_OK);
    CHECK(sw_tformat_detect(&p, now) == SW_OK);
    CHECK(run(&p, &encoder, &value) == SW_OK && value == 0x11);
}

/* Two encoders of 17 and 16 bits answer command 4 at 4 Mbit/s: EA 0 with published words that show an error, EA 1 without one. */
static void bus(void)
{
    static const uint16_t words[8] = {0x2085, 0xf64a, 0x8009, 0x80a1, 0x3080, 0x599f, 0xdd68, 0x009a};
    static const sw_aformat_encoder_t encoder = {17, 16, 0};
    static const sw_aformat_request_t asked = {0, 4, 0, 0, 0, 0};
    static sw_aformat_t zeroed_bus;
    static sw_aformat_bus_t light;
    sw_aformat_t m;
    sw_aformat_transmission_t tx;
    sw_aformat_response_t response;
    sw_position_t position;
    uint16_t contents[8];
    uint8_t framed[4] = {1, 1, 1, 1};
    uint32_t angle = 1;
    int k, bit;

    CHECK(sw_aformat_parse(&asked, &encoder, words, 4, SW_MSB_FIRST, &response) == SW_OK && response.abs == (51200ull << 17 | 86639));
    CHECK(sw_aformat_parse(&asked, &encoder, words, 3, SW_MSB_FIRST, &response) == SW_E_AFORMAT_TRUNCATED);
    CHECK(sw_aformat_parse(&asked, &encoder, words, 4, 2, &response) == SW_E_ARGUMENT);
    CHECK(sw_aformat_parse(&asked, NULL, words, 4, SW_MSB_FIRST, &response) == SW_E_NULL);
    CHECK(sw_aformat_bus_push(&light, words, 4, SW_MSB_FIRST, &response) == SW_E_STATE && sw_aformat_bus_missing(&light) == 0xff);
    CHECK(sw_aformat_bus_start(&light, &asked, &encoder, 0) == SW_E_ARGUMENT);
    CHECK(sw_aformat_bus_start(&light, &asked, &encoder, 6) == SW_OK && sw_aformat_bus_missing(&light) == 6);
    CHECK(sw_aformat_bus_push(&light, words + 4, 4, SW_MSB_FIRST, &response) == SW_OK && response.ea == 1);
    CHECK(sw_aformat_bus_missing(&light) == 4);
    CHECK(sw_aformat_bus_push(&light, words + 4, 4, SW_MSB_FIRST, &response) == SW_E_AFORMAT_TWO_RESPONSES);
    CHECK(sw_aformat_bus_push(&light, words, 4, SW_MSB_FIRST, &response) == SW_E_AFORMAT_ADDRESS_MISMATCH);
    for (k = 0; k < 8; k++) {
        for (contents[k] = 0, bit = 0; bit < 16; bit++) {
            contents[k] = (uint16_t)(contents[k] | (words[k] >> bit & 1) << (15 - bit));
        }
    }
    CHECK(sw_aformat_poll(&zeroed_bus, 0) == SW_E_STATE && sw_aformat_missing(&zeroed_bus) == 0xff);
    CHECK(sw_aformat_init(&m, 5000000, &encoder) == SW_E_ARGUMENT && sw_aformat_init(&m, 4000000, NULL) == SW_E_NULL);
    CHECK(sw_aformat_init(&m, 4000000, &encoder) == SW_OK);
    CHECK(sw_aformat_read(&m, 12, 3, 0, &tx) == SW_E_ARGUMENT && sw_aformat_read(&m, 0, 3, 0, &tx) == SW_E_ARGUMENT);
    CHECK(sw_aformat_read(&m, 4, 0, 0, &tx) == SW_E_ARGUMENT);
    CHECK(sw_aformat_read(&m, 4, 3, 0, &tx) == SW_SEND && tx.len == 1 && tx.end_ns == 4500);
    CHECK(sw_aformat_read(&m, 4, 3, 9000000, &tx) == SW_E_NOT_FREE);
    CHECK(sw_aformat_hear(&m, contents, framed, 49, 25500) == SW_E_ARGUMENT);
    CHECK(sw_aformat_hear(&m, contents, framed, 4, 25500) == SW_PENDING && sw_aformat_missing(&m) == 2);
    CHECK(sw_aformat_response(&m, 0, &response) == SW_OK && response.abs == (51200ull << 17 | 86639));
    CHECK(response.es == (SW_AFORMAT_ES_BATT | SW_AFORMAT_ES_ERROR) && !sw_aformat_angle(&m, 0, 60000, 60000, &angle));
    CHECK(sw_aformat_response(&m, 1, &response) == SW_E_NO_VALUE && sw_aformat_response(&m, 8, &response) == SW_E_ARGUMENT);
    CHECK(sw_aformat_hear(&m, contents + 4, NULL, 4, 49000) == SW_OK && sw_aformat_missing(&m) == 0);
    CHECK(sw_aformat_angle(&m, 1, 100000, 95500, &angle) && angle == 129434u << 15);
    CHECK(!sw_aformat_angle(&m, 1, 100001, 95500, &angle) && !sw_aformat_angle(&m, 8, 100000, 95500, &angle));
    CHECK(sw_aformat_position(&m, 1, 100000, 95500, &position) && position.turns == 2909 && position.sampled_ns == 4500);
    CHECK(sw_aformat_read(&m, 4, 2, 1000000, &tx) == SW_SEND);
    framed[3] = 0;
    CHECK(sw_aformat_hear(&m, contents + 4, framed, 4, 1025500) == SW_PENDING && sw_aformat_missing(&m) == 2);
    CHECK(!sw_aformat_angle(&m, 1, 1100000, 95500, &angle));
    CHECK(sw_aformat_poll(&m, sw_aformat_until_ns(&m)) == SW_OK && sw_aformat_missing(&m) == 2);
}

/* One axis: MAC-ID 11, CP; the drive answers with position 100. */
static void axis(void)
{
    static const uint8_t rsp[16] = {0x8b, 0x20, 0x40, 0x00, 100}, echo[16] = {0xab, 0x20, 0x40, 0x00, 100};
    static sw_rtex_axis_t zeroed_axis;
    sw_rtex_axis_t a;
    sw_rtex_config_t config = {500000, 0, 4, 9, 5, 1, 1, 3, 2, 11, SW_RTEX_CP};
    sw_rtex_state_of_t state;
    sw_rtex_feedback_t feedback;
    sw_rtex_response_t response;
    uint8_t block[16];

    CHECK(sw_rtex_parse_response(rsp, 15, &response) == SW_E_RTEX_TRUNCATED);
    CHECK(sw_rtex_parse_response(NULL, 16, &response) == SW_E_NULL);
    CHECK(sw_rtex_axis_hear(&zeroed_axis, rsp, 16, 0) == SW_E_STATE && sw_rtex_axis_stop(&zeroed_axis, 0) == SW_E_STATE);
    CHECK(!sw_rtex_feedback(&zeroed_axis, 0, 1, &feedback));
    config.echo = 0;
    CHECK(sw_rtex_axis_start(&a, &config) == SW_E_ARGUMENT);
    config.echo = 3;
    CHECK(sw_rtex_axis_start(&a, &config) == SW_OK && sw_rtex_axis_start(&a, NULL) == SW_E_NULL);
    CHECK(!sw_rtex_feedback(&a, 0, UINT64_MAX, &feedback));
    CHECK(sw_rtex_axis_switch_on(&a) == SW_E_RTEX_NOT_NOW && strcmp(sw_text(SW_E_RTEX_NOT_NOW), "not_now") == 0);
    CHECK(sw_rtex_axis_hear(&a, rsp, 16, SW_NO_TIME) == SW_E_CLOCK);
    CHECK(sw_rtex_axis_hear(&a, rsp, 16, 1000000) == SW_OK);
    /* A period that cannot be written is not begun: the counter of the next block is 1. */
    CHECK(sw_rtex_axis_transmit(&a, block, 15) == SW_E_SHORT_BUFFER);
    CHECK(sw_rtex_axis_transmit(&a, block, 16) == SW_OK && block[0] == 0x2b && block[1] == 0x20 && block[4] == 100);
    CHECK(sw_rtex_axis_state(&a, &state) == SW_OK && state.code == SW_RTEX_OFF && state.reason == SW_RTEX_NO_REASON);
    /* The first block may be as old as an update period; one that echoes the block before it is of its own. */
    CHECK(sw_rtex_feedback(&a, 1000000, 500000, &feedback) && feedback.sampled_ns == 500000);
    CHECK(!sw_rtex_feedback(&a, 1000001, 500000, &feedback));
    CHECK(sw_rtex_axis_hear(&a, echo, 16, 1500000) == SW_OK);
    CHECK(sw_rtex_feedback(&a, 2000000, 500000, &feedback) && feedback.position == 100 && feedback.sampled_ns == 1500000);
    CHECK(!sw_rtex_feedback(&a, 2000001, 500000, &feedback));
    CHECK(sw_rtex_axis_set_position(&a, 200) == SW_E_RTEX_NOT_NOW && sw_rtex_axis_setpoint(&a) == 100);
}

static void sorte_and_steps(void)
{
    static const uint8_t output[4] = {1, 2, 3, 4};
    sw_sorte_master_frame_t frame;
    sw_sorte_device_frame_t from = {1, 0};
    sw_sorte_pto_t pto;
    sw_step_time_t time;
    uint8_t bytes[9];
    uint16_t word = 7;
    uint32_t speed = 7;
    size_t len = 7;

    CHECK(sw_sorte_build_master_frame(output, 4, 500, bytes, 8, &len) == SW_E_SHORT_BUFFER && len == 7);
    CHECK(sw_sorte_build_master_frame(output, SIZE_MAX, 500, bytes, 9, &len) == SW_E_ARGUMENT);
    CHECK(sw_sorte_build_master_frame(NULL, 4, 500, bytes, 9, &len) == SW_E_NULL);
    CHECK(sw_sorte_build_master_frame(output, 4, 500, bytes, 9, &len) == SW_OK && len == 9);
    CHECK(sw_sorte_parse_master_frame(bytes, 9, 4, &frame) == SW_OK && frame.time_stamp == 500);
    CHECK(memcmp(bytes + SW_SORTE_DATA_AT, output, 4) == 0);
    CHECK(sw_sorte_parse_master_frame(bytes, 9, SIZE_MAX, &frame) < 0 && sw_sorte_parse_master_frame(bytes, 0, 4, &frame) < 0);
    CHECK(sw_sorte_build_device_frame(&from, output, bytes, 5) == SW_E_SHORT_BUFFER);
    CHECK(sw_sorte_parse_device_frame(bytes, 9, 3, NULL) == SW_E_NULL);
    CHECK(sw_sorte_pto_of_step(4000, 0, &word) == SW_E_ARGUMENT && sw_sorte_pto_of_step(5, 2, &word) == SW_E_ARGUMENT && word == 7);
    CHECK(sw_sorte_parse_pto(3991, &pto) == SW_E_SORTE_RESERVED_PTO_VALUE && pto.kind == SW_SORTE_RESERVED);
    CHECK(strcmp(sw_text(SW_E_SORTE_RESERVED_PTO_VALUE), "reserved_pto_value") == 0);
    CHECK(sw_step_speed(0, &speed) < 0 && speed == 7 && sw_step_ramp(32) == 0 && sw_step_ramp(31) == 1000);
    CHECK(sw_step_next(1661380, 0, &time) == SW_OK && time.cnt == 415 && time.sync == 1380);
    CHECK(sw_step_next(1661380, 0, NULL) == SW_E_NULL && sw_step_check(262144, 0, 0, NULL) == SW_E_STEP_ZERO_SEGMENT_LENGTH);
}

/* The start-up against the modelled encoder by bits, 7 steps a frame: from 200 frames on the position is that of the shaft. */
static void hdsl(void)
{
    static sw_hdsl_t zeroed_hdsl;
    sw_hdsl_t m;
    sw_hdsl_device_t encoder;
    sw_hdsl_transmission_t tx;
    sw_hdsl_position_t position;
    uint8_t samples[SW_HDSL_WINDOW];
    int64_t safe = -1;
    uint64_t frame, bits;
    sw_result_t r = SW_OK;

    memset(samples, 0, sizeof samples);
    CHECK(sw_hdsl_hear(&zeroed_hdsl, samples, sizeof samples, 0) == SW_E_STATE && sw_hdsl_transmission(&zeroed_hdsl, &tx) == SW_E_STATE);
    CHECK(!sw_hdsl_position(&zeroed_hdsl, 0, 1, &position) && !sw_hdsl_position(NULL, 0, 1, &position));
    CHECK(sw_hdsl_start(&m, 2, 0) == SW_E_ARGUMENT && sw_hdsl_start(NULL, SW_HDSL_SICK, 0) == SW_E_NULL);
    CHECK(sw_hdsl_start(&m, SW_HDSL_SICK, 1u << 20) == SW_OK && sw_hdsl_device_start(&encoder, 0x153) == SW_OK);
    CHECK(sw_hdsl_hear(&m, NULL, 72, 0) == SW_E_NULL && sw_hdsl_hear_bits(&m, 0, SW_NO_TIME) == SW_E_CLOCK);
    for (frame = 0; frame < 200; frame++) {
        CHECK(sw_hdsl_device_set_position(&encoder, 7 * frame) == SW_OK);
        CHECK(sw_hdsl_transmission(&m, &tx) == SW_OK && tx.head_bits == 26);
        CHECK(sw_hdsl_device_hear(&encoder, &tx, &bits) == SW_OK);
        r = sw_hdsl_hear_bits(&m, bits, 11520 * frame + 10560);
        CHECK(r >= 0);
    }
    CHECK(r == SW_HDSL_RUNNING);
    CHECK(sw_hdsl_position(&m, 11520 * 200, 50000, &position) && position.position == 7 * 199 && position.velocity == 7);
    CHECK(position.angle == (uint32_t)(7 * 199) << 12);
    CHECK(!sw_hdsl_position(&m, 11520 * 200 + 100000, 50000, &position));
    CHECK(sw_hdsl_safe_position(&m, 11520 * 200, 1000000, &safe) && safe > 0 && safe <= 7 * 199);
    /* Where an encoder answers fewer samples than a window are refused, and nothing has changed. */
    CHECK(sw_hdsl_hear(&m, samples, sizeof samples - 1, 11520 * 201) == SW_E_HDSL_TRUNCATED);
    CHECK(sw_hdsl_position(&m, 11520 * 200, 50000, &position) && position.position == 7 * 199);
    for (frame = 200; frame < 500; frame++) {
        CHECK(sw_hdsl_hear(&m, samples, sizeof samples, 11520 * frame + 10560) >= 0);
    }
    CHECK(!sw_hdsl_position(&m, 11520 * 500, UINT64_MAX, &position));
    tx.head_bits = 129;
    CHECK(sw_hdsl_device_hear(&encoder, &tx, &bits) == SW_E_ARGUMENT);
}

static void clock_of_32_bits(void)
{
    sw_clock_t clock;

    CHECK(sw_clock_start(&clock, 32768, 0) == SW_E_ARGUMENT);
    CHECK(sw_clock_start(&clock, 170000000, UINT32_MAX - 295u) == SW_OK);
    CHECK(sw_clock_ns(&clock, UINT32_MAX - 125u) == 1000 && sw_clock_ns(&clock, 44) == 2000);
    CHECK(sw_clock_ns(&clock, 27) == SW_NO_TIME && sw_clock_ns(&clock, 197) == 3000);
}

/* Two encoders on a line, in words: ABS40 to command 4 from encoder 0 (a manual's answer), from a bus of positions. */
static void words_of_a_bus(void)
{
    static const uint16_t words[4] = {0x2085, 0xf64a, 0x8009, 0x80a1};
    uint16_t damaged[4] = {0x2085, 0xf64a, 0x8009, 0x80a0};
    sw_aformat_bus_t bus;
    sw_aformat_abs40_t data = {1, 9, 9};
    memset(&bus, 0, sizeof bus);
    CHECK(sw_aformat_bus_push_abs40(&bus, words, 4, SW_MSB_FIRST, &data) == SW_E_STATE);
    CHECK(sw_aformat_bus_start_abs40(&bus, 0) == SW_E_ARGUMENT && sw_aformat_bus_start_abs40(NULL, 3) == SW_E_NULL);
    CHECK(sw_aformat_bus_start_abs40(&bus, 3) == SW_OK && sw_aformat_bus_missing(&bus) == 3);
    CHECK(sw_aformat_bus_push_abs40(&bus, damaged, 4, SW_MSB_FIRST, &data) == SW_E_AFORMAT_CRC && data.abs == 1);
    CHECK(sw_aformat_bus_push_abs40(&bus, words, 3, SW_MSB_FIRST, &data) == SW_E_AFORMAT_TRUNCATED && data.abs == 1);
    CHECK(sw_aformat_bus_push_abs40(&bus, words, 4, SW_MSB_FIRST, &data) == SW_OK && sw_aformat_bus_missing(&bus) == 2);
    CHECK((data.abs & 0x1ffff) == 86639 && data.abs >> 17 == 51200 && data.ea == 0);
    CHECK(sw_aformat_bus_push_abs40(&bus, words, 4, SW_MSB_FIRST, &data) == SW_E_AFORMAT_TWO_RESPONSES);
    CHECK(sw_aformat_bus_start_abs40(&bus, 2) == SW_OK);
    CHECK(sw_aformat_bus_push_abs40(&bus, words, 4, SW_MSB_FIRST, &data) == SW_E_AFORMAT_ADDRESS_MISMATCH);
}

/* The header and the library are of one release. */
static void version(void)
{
    CHECK(sw_version() == SERVOWIRE_VERSION);
    CHECK(SERVOWIRE_VERSION == SERVOWIRE_VERSION_MAJOR * 65536u + SERVOWIRE_VERSION_MINOR * 256u + SERVOWIRE_VERSION_PATCH);
}

int main(void)
{
    version();
    words_of_a_bus();
    pointers();
    states();
    exchange();
    procedures();
    bus();
    axis();
    sorte_and_steps();
    hdsl();
    clock_of_32_bits();
    puts("border: good");
    return 0;
}
