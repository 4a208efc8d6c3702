/* Masters and the modelled devices of this library at one line: a ring of RTEX, and messages of HIPERFACE DSL. */
#include "check.h"
#include "servowire.h"

enum { AXES = 3, UPDATE_NS = 500000 };

static sw_rtex_ring_t ring;
static sw_rtex_axis_t axes[AXES];
static sw_rtex_drive_t drives[AXES];
static uint8_t tx[AXES * 32], rx[AXES * 32];
static uint64_t now;

static uint8_t code(int at)
{
    sw_rtex_state_of_t state;
    CHECK(sw_rtex_axis_state(&axes[at], &state) == SW_OK);
    return state.code;
}

/* An update period; the drive at `silent` gives no block, and its memory holds the last one. */
static void period(size_t size, int silent)
{
    size_t at;
    for (at = 0; at < AXES; at++) {
        if ((int)at != silent) {
            (void)sw_rtex_drive_hear(&drives[at], tx + at * size, size, rx + at * size, size);
        }
    }
    now += UPDATE_NS;
    CHECK(sw_rtex_ring_update(&ring, axes, AXES, rx, AXES * size, tx, AXES * size, now) == SW_OK);
}

static void ring_of(uint8_t size)
{
    sw_rtex_config_t config;
    sw_rtex_state_of_t state;
    sw_rtex_feedback_t feedback;
    int32_t target[AXES] = {0}, position = 0;
    int at, k;
    memset(&config, 0, sizeof config);
    config.mode = SW_RTEX_CP;
    config.update_ns = UPDATE_NS;
    config.invalid = 4;
    config.echo = config.command_errors = 3;
    config.wait = 1000;
    config.gear_numerator = config.gear_denominator = 1;
    memset(rx, 0, sizeof rx);
    memset(tx, 0, sizeof tx);
    CHECK(sw_rtex_ring_start(&ring, size, 4) == SW_OK);
    CHECK(sw_rtex_ring_start(&ring, 24, 4) == SW_E_ARGUMENT);
    for (at = 0; at < AXES; at++) {
        config.mac_id = (uint8_t)(2 * at);
        CHECK(sw_rtex_axis_start(&axes[at], &config) == SW_OK && sw_rtex_drive_start(&drives[at], config.mac_id) == SW_OK);
    }
    /* What does not fit is refused before a block is written. */
    CHECK(sw_rtex_ring_update(&ring, axes, AXES, NULL, 0, tx, AXES * (size_t)size - 1, now) == SW_E_SHORT_BUFFER);
    CHECK(sw_rtex_ring_update(&ring, axes, AXES, rx, AXES * (size_t)size + 1, tx, sizeof tx, now) == SW_E_ARGUMENT);
    CHECK(sw_rtex_ring_update(&ring, axes, 0, NULL, 0, tx, sizeof tx, now) == SW_E_ARGUMENT);
    CHECK(sw_rtex_ring_update(&ring, axes, 33, NULL, 0, tx, sizeof tx, now) == SW_E_ARGUMENT);
    {
        sw_rtex_axis_t twins[2];
        twins[0] = twins[1] = axes[0];
        CHECK(sw_rtex_ring_update(&ring, twins, 2, NULL, 0, tx, sizeof tx, now) == SW_E_ARGUMENT);
        memset(&twins[1], 0, sizeof twins[1]);
        CHECK(sw_rtex_ring_update(&ring, twins, 2, NULL, 0, tx, sizeof tx, now) == SW_E_STATE);
    }
    for (k = 0; k < 40; k++) {
        period(size, -1);
    }
    for (at = 0; at < AXES; at++) {
        CHECK(code(at) == SW_RTEX_OFF && sw_rtex_axis_switch_on(&axes[at]) == SW_OK);
    }
    for (k = 0; k < 40; k++) {
        period(size, -1);
    }
    for (at = 0; at < AXES; at++) {
        CHECK(code(at) == SW_RTEX_ON);
        target[at] = sw_rtex_axis_setpoint(&axes[at]);
    }
    for (k = 0; k < 100; k++) {
        for (at = 0; at < AXES; at++) {
            target[at] += 100 * (at + 1);
            CHECK(sw_rtex_axis_set_position(&axes[at], target[at]) == SW_OK);
        }
        period(size, -1);
    }
    for (k = 0; k < 100; k++) {
        period(size, -1);
    }
    for (at = 0; at < AXES; at++) {
        CHECK(sw_rtex_feedback(&axes[at], now, 2 * UPDATE_NS, &feedback) && labs((long)feedback.position - target[at]) < 20);
        CHECK(sw_rtex_drive_position(&drives[at], &position) == SW_OK && labs((long)position - target[at]) < 20);
    }
    CHECK(sw_rtex_ring_failed(&ring) == SW_E_NO_VALUE);
    /* One drive falls silent: all are off in the period in which that is known, and the place is told. */
    for (k = 0; k < 10 && sw_rtex_ring_failed(&ring) < 0; k++) {
        period(size, 1);
    }
    CHECK(k < 10 && sw_rtex_ring_failed(&ring) == 1);
    for (at = 0; at < AXES; at++) {
        CHECK(sw_rtex_axis_state(&axes[at], &state) == SW_OK && state.code == SW_RTEX_STOPPED);
        CHECK(at == 1 ? state.reason != SW_RTEX_OTHER_AXIS : state.reason == SW_RTEX_OTHER_AXIS && state.detail == 1);
        CHECK(sw_rtex_is_servo_off(tx + (size_t)at * size, 16) == 1);
    }
    /* It comes back: everything begins anew. */
    CHECK(sw_rtex_ring_clear(&ring) == SW_OK);
    for (at = 0; at < AXES; at++) {
        CHECK(sw_rtex_axis_clear(&axes[at]) == SW_OK);
    }
    for (k = 0; k < 40; k++) {
        period(size, -1);
    }
    CHECK(code(0) == SW_RTEX_OFF && code(2) == SW_RTEX_OFF && sw_rtex_ring_failed(&ring) == SW_E_NO_VALUE);
}

static void h_frame(sw_hdsl_t *m, sw_hdsl_device_t *device)
{
    sw_hdsl_transmission_t to_send;
    uint64_t bits;
    CHECK(sw_hdsl_transmission(m, &to_send) == SW_OK);
    CHECK(sw_hdsl_device_hear(device, &to_send, &bits) == SW_OK);
    now += 11520;
    CHECK(sw_hdsl_hear_bits(m, to_send.answered ? bits : UINT64_MAX, now) >= 0);
}

static void messages(void)
{
    static sw_hdsl_t m;
    static sw_hdsl_device_t device;
    sw_hdsl_short_t ask = {0x46, 0, 0};
    sw_hdsl_long_t name;
    sw_hdsl_finished_t finished;
    sw_hdsl_frame_t frame;
    uint32_t id = 0;
    int k;
    memset(&name, 0, sizeof name);
    name.address = 0x081;
    name.offset = SW_HDSL_NO_OFFSET;
    name.len = 4;
    CHECK(sw_hdsl_start(&m, SW_HDSL_SICK, 1u << 20) == SW_OK && sw_hdsl_device_start(&device, 0x00153) == SW_OK);
    CHECK(sw_hdsl_encoder_id(&m, &id) == SW_E_NO_VALUE && sw_hdsl_state(&m) == SW_HDSL_RESET);
    CHECK(sw_hdsl_send_short(&m, &ask) == SW_E_HDSL_NOT_LOCKED);
    for (k = 0; k < 200; k++) {
        h_frame(&m, &device);
    }
    CHECK(sw_hdsl_state(&m) == SW_HDSL_RUNNING && sw_hdsl_encoder_id(&m, &id) == SW_OK && id == 0x00153);
    CHECK(sw_hdsl_frame(&m, &frame) == SW_OK && frame.quality == 15 && frame.restarted == SW_HDSL_NO_RESTART && frame.tail_bits == 6);
    CHECK(sw_hdsl_send_short(&m, &ask) == SW_OK && sw_hdsl_send_short(&m, &ask) == SW_E_HDSL_BUSY);
    for (k = 0; k < 200; k++) {
        h_frame(&m, &device);
        CHECK(sw_hdsl_finished(&m, &finished) == SW_OK);
        if (finished.short_result != SW_PENDING) {
            break;
        }
    }
    CHECK(finished.short_result == SW_OK && finished.register_address == 0x46);
    CHECK(sw_hdsl_send_long(&m, &name) == SW_OK);
    for (k = 0; k < 40000; k++) {
        h_frame(&m, &device);
        CHECK(sw_hdsl_finished(&m, &finished) == SW_OK);
        if (finished.long_result != SW_PENDING) {
            break;
        }
    }
    CHECK(finished.long_result == SW_OK && finished.data.len == 4);
    name.len = 3;
    CHECK(sw_hdsl_send_long(&m, &name) == SW_E_HDSL_DATA_LENGTH);
    name.len = 9;
    CHECK(sw_hdsl_send_long(&m, &name) == SW_E_ARGUMENT);
    CHECK(sw_hdsl_restart(&m) == SW_OK);
    h_frame(&m, &device);
    CHECK(sw_hdsl_frame(&m, &frame) == SW_OK && frame.restarted == SW_HDSL_RESTART_REQUESTED);
}

int main(void)
{
    ring_of(16);
    ring_of(32);
    messages();
    puts("both ends: good");
    return 0;
}
