/* An axis in C: its moves, all requests to it, and the search for its switch, with the timer of each. */
#include "check.h"
#include "servowire.h"

/* An axis with its timer: where the motor is, and the ticks since it was switched on. */
struct machine {
    sw_motion_axis_t *axis;
    sw_motion_timer_t *timer;
    int64_t at;
    uint64_t ticks, last, shortest, pause;
    uint8_t reverse;
};

/* An event of the timer, and all that the background has to do before; returns what it said last. */
static sw_result_t machine_event(struct machine *m)
{
    sw_motion_fired_t fired;
    sw_result_t work;
    do {
        work = sw_motion_poll(m->axis);
    } while (work == SW_MOTION_MORE);
    CHECK(work >= 0 && sw_motion_fire(m->timer, &fired) == SW_OK);
    if (fired.step) {
        uint64_t since = m->ticks - m->last;
        if (m->last != 0 && fired.reverse == m->reverse && since < m->shortest) {
            m->shortest = since;
        }
        if (m->last != 0 && fired.reverse != m->reverse && since < m->pause) {
            m->pause = since;
        }
        m->at += fired.reverse ? -1 : 1;
        m->last = m->ticks;
        m->reverse = fired.reverse;
    }
    m->ticks += fired.wait;
    return work;
}

static void machine_rest(struct machine *m)
{
    unsigned events = 0;
    while (machine_event(m) != SW_MOTION_REST) {
        CHECK(++events < 100000);
    }
}

/* 3000 steps and back, made by a timer of 1 MHz. */
static void moves(void)
{
    static sw_motion_queue_t queue;
    static sw_motion_axis_t a;
    static sw_motion_timer_t timer;
    sw_motion_setup_t setup = {{4000000, 20000, 200000}, 0, 0, 1000000, 0, 0};
    struct machine m = {&a, &timer, 0, 0, 0, UINT64_MAX, UINT64_MAX, 0};
    sw_motion_fired_t fired;
    int64_t commanded = 99;
    int way;

    CHECK(sw_motion_poll(&a) == SW_E_STATE && sw_motion_fire(&timer, &fired) == SW_E_STATE && !sw_motion_is_at_rest(&a));
    CHECK(sw_motion_start(&a, &timer, NULL, &setup) == SW_E_NULL && sw_motion_start(&a, &timer, &queue, NULL) == SW_E_NULL);
    setup.clock_hz = 999;
    CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_E_ARGUMENT);
    setup.clock_hz = 1000000;
    setup.soft_low = 1;
    CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_E_ARGUMENT);
    setup.soft_low = 0;
    setup.limits.speed = 500001;
    CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_E_MOTION_SPEED_ABOVE_CLOCK);
    setup.limits.speed = 20000;
    CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_OK && sw_motion_is_at_rest(&a));
    CHECK(sw_motion_commanded(&a, NULL) == SW_E_NULL && sw_motion_run(&a, 2, 100) == SW_E_ARGUMENT);
    for (way = 0; way < 2; way++) {
        CHECK(sw_motion_move_to(&a, way == 0 ? 3000 : -500) == SW_OK);
        machine_event(&m);
        /* A refusal changes nothing: the axis goes on. */
        setup.limits.speed = 500001;
        CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_E_MOTION_SPEED_ABOVE_CLOCK);
        machine_rest(&m);
        CHECK(sw_motion_commanded(&a, &commanded) == SW_OK && commanded == m.at && m.at == (way == 0 ? 3000 : -500));
    }
    /* 20000 steps a second are 50 us. */
    CHECK(m.shortest >= 49 && m.shortest <= 51);
    CHECK(sw_motion_run(&a, 1, 10000) == SW_OK && sw_motion_halt(&a) == SW_OK);
    while (sw_motion_poll(&a) != SW_MOTION_REST) {
        CHECK(sw_motion_fire(&timer, &fired) == SW_OK && !fired.step);
    }
    CHECK(!sw_motion_is_halted(&a)); /* at rest nothing is lost */
}

/* All requests to an axis with soft limits from -100 to 3000 and a reversal pause of 5 ms. */
static void requests(void)
{
    static sw_motion_queue_t queue;
    static sw_motion_axis_t a;
    static sw_motion_timer_t timer;
    sw_motion_setup_t setup = {{0, 20000, 200000}, -100, 3000, 1000000, 5000, 2000};
    sw_motion_limits_t hard = {0, 20000, 400000}, other = {0, 5000, 50000};
    struct machine m = {&a, &timer, 0, 0, 0, UINT64_MAX, UINT64_MAX, 0};
    int64_t commanded = 0;

    CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_OK);
    CHECK(sw_motion_move_to(&a, 3001) == SW_E_MOTION_SOFT_LIMIT && sw_motion_move_to(&a, -101) == SW_E_MOTION_SOFT_LIMIT);
    CHECK(sw_motion_run(&a, 0, 10000) == SW_OK);
    machine_rest(&m);
    /* 10000 steps/s are 100 us. */
    CHECK(m.at == 3000 && m.shortest >= 99 && m.shortest <= 101);
    CHECK(sw_motion_move_to(&a, -100) == SW_OK);
    machine_rest(&m);
    CHECK(m.at == -100 && m.pause >= 5000 && m.pause < 20000);

    /* 10 %: 2000 steps/s. */
    CHECK(sw_motion_set_override(NULL, 10) == SW_E_NULL && sw_motion_set_override(&a, 10) == SW_OK);
    m.shortest = UINT64_MAX;
    CHECK(sw_motion_move_to(&a, 1000) == SW_OK);
    machine_rest(&m);
    CHECK(m.at == 1000 && m.shortest >= 499 && m.shortest <= 501);
    CHECK(sw_motion_set_override(&a, 100) == SW_OK);

    /* v^2 / 2a: 1000 steps from 20000 steps/s, 500 within the other limits; and what the reach of 2 ms lets through. */
    CHECK(sw_motion_set_commanded(&a, 0) == SW_OK && sw_motion_commanded(&a, &commanded) == SW_OK && commanded == 0);
    m.at = 0;
    CHECK(sw_motion_move_to(&a, 3000) == SW_OK);
    while (m.at < 1400) {
        machine_event(&m);
    }
    CHECK(sw_motion_set_commanded(&a, 0) == SW_E_MOTION_MOVING && sw_motion_set_limits(&a, &other) == SW_E_MOTION_MOVING);
    CHECK(sw_motion_quick_stop(&a, NULL) == SW_E_NULL && sw_motion_quick_stop(&a, &hard) == SW_OK);
    CHECK(sw_motion_move_to(&a, 0) == SW_E_MOTION_MOVING);
    machine_rest(&m);
    CHECK(m.at >= 1900 && m.at <= 1990 && sw_motion_commanded(&a, &commanded) == SW_OK && commanded == m.at);

    /* 5000 steps/s. */
    CHECK(sw_motion_set_limits(&a, NULL) == SW_E_NULL && sw_motion_set_limits(&a, &other) == SW_OK);
    m.shortest = UINT64_MAX;
    CHECK(sw_motion_move_to(&a, 0) == SW_OK);
    while (m.at > 500) {
        machine_event(&m);
    }
    CHECK(m.shortest >= 199 && m.shortest <= 201);
    CHECK(!sw_motion_is_halted(&a) && sw_motion_halt(&a) == SW_OK);
    machine_rest(&m);
    CHECK(sw_motion_is_halted(&a) && sw_motion_commanded(&a, &commanded) == SW_OK && commanded == m.at && m.at >= 499);
    CHECK(!sw_motion_is_halted(NULL));
}

/* The switch is 700 steps after where the axis is switched on, and beyond the soft limits as seen from there. */
static void homing(void)
{
    static sw_motion_queue_t queue;
    static sw_motion_axis_t a;
    static sw_motion_timer_t timer;
    static sw_motion_homing_t search;
    sw_motion_setup_t setup = {{0, 10000, 50000}, 0, 5000, 1000000, 0, 2000};
    sw_motion_homing_setup_t how = {{0, 10000, 200000}, 4000, 300, 200, 2000, 1};
    struct machine m = {&a, &timer, 0, 0, 0, UINT64_MAX, UINT64_MAX, 0};
    sw_result_t state = SW_MOTION_HOMING_SEEKING;
    unsigned events = 0, seen = 0;
    int64_t commanded = 0;

    CHECK(sw_motion_homing_poll(&search, &a, 0) == SW_E_STATE);
    CHECK(sw_motion_start(&a, &timer, &queue, &setup) == SW_OK);
    CHECK(sw_motion_home(&search, &a, &how, 2) == SW_E_ARGUMENT && sw_motion_home(&search, &a, NULL, 0) == SW_E_NULL);
    CHECK(sw_motion_home(&search, &a, &how, 0) == SW_OK);
    CHECK(sw_motion_homing_poll(&search, &a, 2) == SW_E_ARGUMENT && sw_motion_homing_poll(&search, NULL, 0) == SW_E_NULL);
    while (state != SW_MOTION_HOMING_DONE) {
        CHECK(++events < 100000);
        machine_event(&m);
        state = sw_motion_homing_poll(&search, &a, m.at <= -700);
        CHECK(state >= 0 && state < SW_MOTION_HOMING_FAILED);
        seen |= 1u << state;
    }
    CHECK(seen == 0x3f && sw_motion_commanded(&a, &commanded) == SW_OK);
    CHECK(m.at - commanded >= -701 && m.at - commanded <= -699);
    /* Somebody else has it now; and a search that finds nothing is given up. */
    CHECK(sw_motion_home(&search, &a, &how, 0) == SW_OK && sw_motion_stop(&a) == SW_OK);
    CHECK(sw_motion_homing_poll(&search, &a, 0) == SW_MOTION_HOMING_FAILED);
    machine_rest(&m);
    CHECK(sw_motion_home(&search, &a, &how, 0) == SW_OK);
    for (events = 0; (state = sw_motion_homing_poll(&search, &a, 0)) == SW_MOTION_HOMING_SEEKING; events++) {
        CHECK(events < 100000);
        machine_event(&m);
    }
    machine_rest(&m);
    CHECK(state == SW_MOTION_HOMING_FAILED && m.at < -2700 && m.at > -2950);
}

int main(void)
{
    moves();
    requests();
    homing();
    puts("motion: good");
    return 0;
}
