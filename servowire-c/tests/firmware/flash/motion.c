/* An axis and its step interrupt. */
#include "servowire.h"
int main(void);
static sw_motion_queue_t queue;
static sw_motion_axis_t axis;
static sw_motion_timer_t timer;
static const sw_motion_setup_t setup = {{4000000, 20000, 200000}, 0, 0, 1000000, 0, 0};
static sw_motion_fired_t fired;
int main(void)
{
    (void)sw_motion_start(&axis, &timer, &queue, &setup);
    (void)sw_motion_move_to(&axis, 3000);
    (void)sw_motion_halt(&axis);
    return sw_motion_poll(&axis) + sw_motion_fire(&timer, &fired);
}
