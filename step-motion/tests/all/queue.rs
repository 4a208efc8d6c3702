//! A background and an interrupt: every step at its tick, a stop after whatever is out, no step after a halt.

use proptest::prelude::*;
use step_motion::{Axis, Clock, Direction, Limits, Mover, Queue, StepTimer, Work};

use crate::laws::limits;
use crate::machine;

const SLOTS: usize = 129;

fn queue() -> &'static Queue<SLOTS> {
    Box::leak(Box::default())
}

type Machine = machine::Machine<StepTimer<'static, SLOTS>, 1>;

fn run(axis: &mut Axis<'static, SLOTS>, machine: &mut Machine, every: u64, until: u64) -> Work {
    machine.run(axis, every, until)
}

/// The steps of one move beside the exact times, which an axis with a finer clock has.
fn compare(hz: u32, limits: Limits, target: i64, reach: u32) -> Result<(), TestCaseError> {
    let finer = (1_u32 << 29).checked_div(hz).map_or(1, |by| 1 << by.max(1).ilog2());
    let mut exact = Mover::new(Clock::new(hz * finer).unwrap(), limits).unwrap();
    exact.move_to(target, 0).unwrap();
    let (mut axis, timer) = Axis::new(queue(), Clock::new(hz).unwrap(), limits).unwrap();
    axis = axis.with_reach(reach);
    let mut machine = Machine::new(timer);
    axis.move_to(target).unwrap();
    prop_assert_eq!(run(&mut axis, &mut machine, u64::from(reach) / 16 + 1, u64::MAX), Work::Rest);
    prop_assert_eq!((machine.position[0], axis.commanded()), (target, target));
    prop_assert!(axis.is_at_rest());
    let most = (0.75 + 1.5 / f64::from(finer)).max(25e-9 * f64::from(hz));
    for (step, (tick, ..)) in machine.steps.iter().enumerate() {
        let want = exact.pulse().unwrap().tick as f64 / f64::from(finer);
        prop_assert!((*tick as f64 - want).abs() <= most, "step {step} at {tick}, {want} is right");
    }
    Ok(())
}

fn spread(low: f64, high: f64) -> impl Strategy<Value = u64> {
    (low.ln()..high.ln()).prop_map(|x| x.exp() as u64)
}

#[test]
fn a_turn_at_1_mhz_and_at_200() {
    for hz in [1_000_000, 8_000_000, 168_000_000, 200_000_000] {
        for jerk in [0, 40_000_000] {
            compare(hz, limits(250_000, 2_000_000, jerk), 51_200, hz / 200).unwrap();
            compare(hz, limits(20_000, 100_000, jerk), -64, hz / 200).unwrap();
            compare(hz, limits(50_000, 100_000, jerk / 40), 5000, hz / 200).unwrap();
        }
    }
}

/// Moves of few steps, with a step where a piece of the jerk ends, or few of them in a piece.
#[test]
fn segments_of_pieces_of_few_steps() {
    for (hz, limits, target) in [
        (200_000_000, limits(285_392, 3_187_009, 1_099_701_122), -13),
        (72_000_000, limits(108_080, 9_851_652, 15_353_617_130), 23),
        (200_000_000, limits(43_714, 23_822_135, 194_861_935_563), 15),
        (200_000_000, limits(230_797, 3_185_880, 11_771_609_240), 21),
    ] {
        compare(hz, limits, target, hz / 20).unwrap();
    }
}

#[derive(Debug, Clone, Copy)]
enum Request {
    MoveTo(i64),
    Run(bool, u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
    Quick(u32),
    Halt,
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        4 => (-2000..2000_i64).prop_map(Request::MoveTo),
        2 => (any::<bool>(), 0..60_000_u32).prop_map(|(back, speed)| Request::Run(back, speed)),
        2 => (0..=100_u16).prop_map(Request::Override),
        1 => Just(Request::Hold),
        2 => Just(Request::Resume),
        1 => Just(Request::Stop),
        1 => (1000..10_000_000_u32).prop_map(Request::Quick),
        1 => Just(Request::Halt),
    ]
}

fn clocks() -> impl Strategy<Value = u32> {
    prop_oneof![Just(25_000_u32), Just(1_000_000), Just(72_000_000), Just(200_000_000)]
}

fn cases() -> u32 {
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(300)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    #[test]
    fn every_step_is_at_its_tick(
        hz in clocks(), speed in spread(10.0, 3e5), a in spread(1e3, 1e8), j in prop_oneof![Just(0), spread(1e4, 1e12)],
        target in prop_oneof![-30..30_i64, -3000..3000_i64], part in 20..2000_u32,
    ) {
        let limits = limits((speed as u32).min(hz / 2), a as u32, j);
        compare(hz, limits, target, (hz / part).max(2))?;
    }

    /// In time, late, or not at all for a while: what is out ends in a stop, nothing is faster than the limits, and it goes on.
    #[test]
    fn requests_and_a_background_that_stalls(
        hz in clocks(), speed in spread(200.0, 3e4), a in spread(1e4, 1e7), j in prop_oneof![Just(0), spread(1e6, 1e10)],
        requests in prop::collection::vec((request(), 0..300_000_u64, 0..40_u32), 1..12), target in -2000..2000_i64,
    ) {
        let limits = limits((speed as u32).min(hz / 2), a as u32, j);
        let (axis, timer) = Axis::new(queue(), Clock::new(hz).unwrap(), limits).unwrap();
        let (mut axis, mut machine) = (axis.with_soft_limits(-3000, 3000), Machine::new(timer));
        let reach = u64::from(hz / 200);
        for (request, wait_us, polls) in requests {
            let mut halted = None;
            match request {
                Request::MoveTo(target) => _ = axis.move_to(target),
                Request::Run(back, speed) => {
                    let direction = if back { Direction::Reverse } else { Direction::Forward };
                    _ = axis.run(direction, speed);
                }
                Request::Override(percent) => axis.set_override(percent),
                Request::Hold => axis.hold(),
                Request::Resume => axis.resume(),
                Request::Stop => axis.stop(),
                Request::Quick(acceleration) => axis.quick_stop(Limits::new(1, acceleration).unwrap()),
                Request::Halt => {
                    axis.halt();
                    halted = Some(machine.position[0]);
                }
            }
            // A background that is cut off after some slices.
            for _ in 0..polls {
                machine.slice(&mut axis);
            }
            let until = machine.now + wait_us * u64::from(hz) / 1_000_000;
            if wait_us % 3 == 0 {
                machine.until(until);
            } else {
                run(&mut axis, &mut machine, reach / 2, until);
            }
            if let Some(position) = halted {
                prop_assert_eq!(machine.position[0], position, "a step after a halt");
            }
            prop_assert_eq!(axis.commanded(), machine.position[0]);
            prop_assert!((-3000..=3000).contains(&machine.position[0]));
        }
        axis.stop();
        machine.drain();
        let until = machine.now + 20 * u64::from(hz);
        prop_assert_ne!(run(&mut axis, &mut machine, reach / 2, until), Work::TooFewSlots);
        axis.set_override(100);
        axis.resume();
        axis.move_to(target).unwrap();
        prop_assert_eq!(run(&mut axis, &mut machine, reach / 2, u64::MAX), Work::Rest);
        prop_assert_eq!((machine.position[0], axis.commanded()), (target, target));
        let least = u64::from(hz) / u64::from(limits.speed());
        for pair in machine.steps.windows(2) {
            if pair[0].2 == pair[1].2 {
                // A stop that nobody asked for is as exact as there are slots for it.
                prop_assert!(pair[1].0 - pair[0].0 + 2 + least / 32 >= least, "{pair:?}, {least} ticks are the fastest");
            }
        }
    }
}

/// The background is cut off after each slice of a move; the axis comes to rest within its limits, and goes on to its target.
#[test]
fn a_background_that_starves_ends_in_a_stop_at_every_segment() {
    let limits = limits(20_000, 200_000, 4_000_000);
    let mut stalls = 0;
    for slices in 1..400 {
        let (mut axis, timer) = Axis::new(queue(), Clock::MICROSECONDS, limits).unwrap();
        let mut machine = Machine::new(timer);
        axis.move_to(6000).unwrap();
        for _ in 0..slices {
            match axis.poll() {
                Work::Start if machine.compare.is_none() => machine.fire(),
                Work::Later => machine.until(machine.now + 1000),
                _ => {}
            }
        }
        machine.drain();
        stalls += u32::from(machine.position[0] < 6000 && machine.position[0] > 0);
        // From 20,000 steps/s rest takes 1500 steps; the last interval of a stop is longer than that at 1000 steps/s.
        if let [.., before, last] = machine.steps[..] {
            assert!(last.0 - before.0 > 1000, "{slices}: {} ticks before rest", last.0 - before.0);
        }
        for pair in machine.steps.windows(3) {
            let [first, second] = [pair[1].0 - pair[0].0, pair[2].0 - pair[1].0].map(|ticks| 1e6 / ticks as f64);
            let time = (pair[2].0 - pair[0].0) as f64 / 2e6;
            // A tick of rounding at either end of an interval.
            let noise = (first.powi(2) + second.powi(2)) * 1.5e-6;
            assert!((second - first).abs() <= 210_000.0 * time + noise, "{slices}: {first} to {second} steps/s");
        }
        assert_eq!(run(&mut axis, &mut machine, 2000, u64::MAX), Work::Rest);
        assert_eq!((machine.position[0], axis.commanded()), (6000, 6000));
    }
    assert!(stalls > 200, "{stalls}");
}

/// The stop after the queue as exact as all else: from interval to interval the speed changes by no more than the acceleration and 25 ns
/// at either end of an interval make of it.
#[test]
fn a_stop_that_nobody_asked_for_is_exact_if_that_is_asked_for() {
    let hz = 168_000_000;
    let limits = limits(20_000, 200_000, 0);
    let worst = |exact: bool| {
        let mut worst = 0.0;
        for (at, short) in (50..200).step_by(7).zip([false, true].into_iter().cycle()) {
            let queue: &'static Queue<513> = Box::leak(Box::default());
            let (axis, mut timer) = Axis::new(queue, Clock::new(hz).unwrap(), limits).unwrap();
            let mut axis = if exact { axis.with_exact_stops() } else { axis };
            if short {
                // The first stop has few slots.
                axis.run(Direction::Forward, 200).unwrap();
                while axis.poll() == Work::More {}
            }
            axis.run(Direction::Forward, 20_000).unwrap();
            let (mut now, mut steps) = (0_u64, Vec::new());
            loop {
                while now < at * u64::from(hz) / 1000 && axis.poll() == Work::More {}
                let fired = timer.fire();
                if fired.is_step() {
                    steps.push(now);
                }
                now += u64::from(fired.wait());
                if fired.wait() == 0 {
                    break;
                }
            }
            assert!(axis.commanded() > 20, "{at}");
            for step in steps.windows(3) {
                let [first, second] = [step[1] - step[0], step[2] - step[1]].map(|ticks| f64::from(hz) / ticks as f64);
                let time = (step[2] - step[0]) as f64 / 2.0 / f64::from(hz);
                let noise = (first.powi(2) + second.powi(2)) * 50e-9;
                worst = f64::max(worst, (second - first).abs() / (200_000.0 * time + noise));
            }
        }
        worst
    };
    let (exact, coarse) = (worst(true), worst(false));
    assert!(exact < 1.005 && coarse > 1.03, "{exact}, {coarse}");
}

#[test]
fn a_halt_acts_in_the_interrupt() {
    for at in (3000..400_000).step_by(1777) {
        let (mut axis, timer) = Axis::new(queue(), Clock::MICROSECONDS, limits(20_000, 200_000, 0)).unwrap();
        let mut machine = Machine::new(timer);
        axis.move_to(5000).unwrap();
        run(&mut axis, &mut machine, 1000, at);
        let position = machine.position[0];
        axis.halt();
        assert!(axis.move_to(0).is_err(), "not before the interrupt has seen it");
        machine.drain();
        assert_eq!((machine.position[0], axis.commanded()), (position, position));
        let until = machine.now + 10_000;
        run(&mut axis, &mut machine, 1000, until);
        assert_eq!((machine.position[0], axis.is_at_rest()), (position, true));
        assert_eq!(axis.is_halted(), position < 5000, "{at}");
        axis.move_to(-20).unwrap();
        run(&mut axis, &mut machine, 1000, u64::MAX);
        assert_eq!((machine.position[0], axis.commanded(), axis.is_halted()), (-20, -20, false));
    }
}

/// A step a second, told to be fast: it is so after twice the reach, not after the step.
#[test]
fn a_request_acts_within_twice_the_reach() {
    let (axis, timer) = Axis::new(queue(), Clock::MICROSECONDS, limits(20_000, 2_000_000, 0)).unwrap();
    let (mut axis, mut machine) = (axis.with_reach(5000), Machine::new(timer));
    axis.run(Direction::Forward, 1).unwrap();
    run(&mut axis, &mut machine, 1000, 3_200_000);
    assert_eq!(machine.position[0], 3);
    axis.run(Direction::Forward, 20_000).unwrap();
    run(&mut axis, &mut machine, 1000, 3_300_000);
    // 10 ms of reaction at most, 10 ms of ramp with 100 steps, and 80 ms; 90 ms without a reaction.
    assert!((1700..=1903).contains(&machine.position[0]), "{}", machine.position[0]);
    axis.stop();
    let before = machine.position[0];
    run(&mut axis, &mut machine, 1000, u64::MAX);
    // 200 steps in 10 ms, twice 5 ms, and the 100 of the stop.
    assert!(machine.position[0] - before <= 310, "{}", machine.position[0] - before);
}

/// At any instant of a long motion, with a background that is called as seldom as it may be, alone or soon after another request: a
/// hold acts within twice the reach.
#[test]
fn a_hold_acts_within_twice_the_reach_at_any_instant() {
    for (at, before) in (0..160).flat_map(|n| [(n, None), (n, Some(700)), (n, Some(2900))]) {
        let (axis, timer) = Axis::new(queue(), Clock::MICROSECONDS, limits(20_000, 2_000_000, 0)).unwrap();
        let (mut axis, mut machine) = (axis.with_reach(5000), Machine::new(timer));
        axis.run(Direction::Forward, 20_000).unwrap();
        run(&mut axis, &mut machine, 2500, 200_000 + at * 619);
        if let Some(before) = before {
            axis.set_override(99);
            let time = machine.now + before;
            run(&mut axis, &mut machine, 2500, time);
        }
        axis.hold();
        let made = machine.position[0];
        run(&mut axis, &mut machine, 2500, u64::MAX);
        // 10 ms, and the 100 steps from 20,000 steps/s to rest.
        assert!(machine.position[0] - made <= 302, "{at} {before:?}: {}", machine.position[0] - made);
    }
}

/// The least reach is 16 ticks: a step in ten of them, and a hold that brakes within a step.
#[test]
fn a_hold_acts_within_twice_the_least_reach() {
    for at in 2000..2200 {
        let (axis, timer) = Axis::new(queue(), Clock::MICROSECONDS, limits(100_000, i32::MAX as u32, 0)).unwrap();
        let (mut axis, mut machine) = (axis.with_reach(0), Machine::new(timer));
        axis.run(Direction::Forward, 100_000).unwrap();
        run(&mut axis, &mut machine, 1, at);
        let made = machine.position[0];
        axis.hold();
        run(&mut axis, &mut machine, 1, u64::MAX);
        assert!(machine.position[0] - made <= 4, "{at}: {}", machine.position[0] - made);
    }
}

/// Nine slots are four for each block, and one of these is for steps.
#[test]
fn the_smallest_queue() {
    let queue: &'static Queue<9> = Box::leak(Box::default());
    let (mut axis, timer) = Axis::new(queue, Clock::MICROSECONDS, limits(1000, i32::MAX as u32, 0)).unwrap();
    let mut machine = machine::Machine::<_, 1>::new(timer);
    for to in [200, -3] {
        axis.move_to(to).unwrap();
        assert_eq!(machine.run(&mut axis, 100, u64::MAX), Work::Rest);
        assert_eq!(machine.position[0], to);
    }
}
