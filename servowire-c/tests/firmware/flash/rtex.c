/* An axis of the ring. */
#include "servowire.h"
int main(void);
static volatile uint8_t heard[16];
static uint8_t sent[16];
static const sw_rtex_config_t config = {500000, 10, 1000, 0, 0, 1, 1, 3, 3, 5, SW_RTEX_CP};
static sw_rtex_axis_t axis;
static sw_rtex_feedback_t feedback;
int main(void)
{
    (void)sw_rtex_axis_start(&axis, &config);
    (void)sw_rtex_axis_hear(&axis, (const uint8_t *)heard, 16, 500000);
    (void)sw_rtex_axis_switch_on(&axis);
    (void)sw_rtex_axis_set_position(&axis, 1);
    (void)sw_rtex_axis_transmit(&axis, sent, 16);
    return sw_rtex_feedback(&axis, 600000, 1000000, &feedback);
}
