/* RTEX: one axis in cyclic position mode. The interrupt of the ASIC comes once an update period. */
#include "servowire.h"

enum { UPDATE_NS = 500000 };

/* Of the firmware around it. */
const uint8_t *asic_block(void);      /* the 16 bytes of this period, NULL if none came */
int asic_write(const uint8_t *block); /* hands the 16 bytes of the next one to the ASIC; 0 if that failed */
int32_t next_target(int32_t now);

static sw_rtex_axis_t axis;

void axis_init(void);
void axis_interrupt(uint64_t now);

void axis_init(void)
{
    sw_rtex_config_t config = {0};
    config.mac_id = 5;
    config.mode = SW_RTEX_CP;
    config.update_ns = UPDATE_NS;
    config.invalid = 10;
    config.echo = 3;
    config.command_errors = 3;
    config.wait = 1000;
    config.gear_numerator = config.gear_denominator = 1;
    (void)sw_rtex_axis_start(&axis, &config);
}

void axis_interrupt(uint64_t now)
{
    sw_rtex_state_of_t state;
    sw_rtex_feedback_t feedback;
    uint8_t block[16];

    (void)sw_rtex_axis_hear(&axis, asic_block(), 16, now);
    (void)sw_rtex_axis_state(&axis, &state);
    if (state.code == SW_RTEX_OFF) {
        (void)sw_rtex_axis_switch_on(&axis); /* refused until the drive is ready */
    } else if (state.code == SW_RTEX_ON) {
        if (!sw_rtex_feedback(&axis, now, 3 * UPDATE_NS, &feedback) ||
            sw_rtex_axis_set_position(&axis, next_target(sw_rtex_axis_setpoint(&axis))) < 0) {
            (void)sw_rtex_axis_stop(&axis, 0);
        }
    }
    (void)sw_rtex_axis_transmit(&axis, block, 16);
    if (!asic_write(block)) {
        (void)sw_rtex_axis_not_sent(&axis);
    }
}
