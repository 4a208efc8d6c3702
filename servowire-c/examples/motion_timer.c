/* Steps of one axis from a compare interrupt of a 1-MHz timer; the main loop plans ahead. */
#include "servowire.h"

/* Of the firmware around it. */
void timer_compare_in(uint32_t ticks); /* the next compare, counted from the last one */
void timer_stop(void);
void timer_interrupt_now(void); /* pends the interrupt */
void step_pulse(void);
void dir_level(uint8_t reverse);

static sw_motion_queue_t queue;
static sw_motion_axis_t axis;
static sw_motion_timer_t timer;

void motion_init(void);
void motion_main_loop(void);
void motion_interrupt(void);

void motion_init(void)
{
    static const sw_motion_setup_t setup = {
        .limits = {.jerk = 4000000, .speed = 20000, .acceleration = 200000}, /* steps/s3, steps/s, steps/s2 */
        .clock_hz = 1000000,
        .reversal_pause = 20, /* us */
    };
    (void)sw_motion_start(&axis, &timer, &queue, &setup);
    (void)sw_motion_move_to(&axis, 3000);
}

void motion_main_loop(void)
{
    sw_result_t work;
    do {
        work = sw_motion_poll(&axis);
    } while (work == SW_MOTION_MORE);
    if (work == SW_MOTION_START) {
        timer_interrupt_now();
    }
}

void motion_interrupt(void)
{
    sw_motion_fired_t fired;
    if (sw_motion_fire(&timer, &fired) != SW_OK) {
        timer_stop();
        return;
    }
    if (fired.step) {
        step_pulse();
    }
    dir_level(fired.reverse);
    if (fired.wait != 0) {
        timer_compare_in(fired.wait);
    } else {
        timer_stop();
    }
}
