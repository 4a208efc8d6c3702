//! Stops, quick stops and clocks that are wrong, case by case.

use step_motion::{Clock, Direction, Error, Limits, Mover};

use crate::laws::limits;

fn fast() -> Mover {
    let limits = Limits::new(20_000, 200_000).unwrap().with_jerk(2_000_000).unwrap();
    Mover::new(Clock::MICROSECONDS, limits).unwrap().with_soft_limits(-1000, 40_000)
}

/// Takes steps up to a time; gives the least ticks between two of them.
fn take(mover: &mut Mover, until: u64) -> u64 {
    let (mut last, mut least) = (None, u64::MAX);
    while mover.due().is_some_and(|due| due <= until) {
        let tick = mover.pulse().unwrap().tick;
        least = last.map_or(least, |last| least.min(tick - last));
        last = Some(tick);
    }
    least
}

/// Until the axis is at rest after a quick stop, half a step after the last one, a new target is refused; it would begin with the
/// deceleration of the quick stop, and keep that for all that follows.
#[test]
fn a_quick_stop_is_over_at_rest_not_at_its_last_step() {
    let mut mover = fast();
    mover.run(Direction::Forward, 20_000, 0).unwrap();
    take(&mut mover, 500_000);
    let hard = Limits::new(20_000, 1_000_000).unwrap();
    mover.quick_stop(hard, 500_000);
    let mut last = 0;
    while let Some(pulse) = mover.pulse() {
        last = pulse.tick;
    }
    assert_eq!(mover.move_to(20_000, last), Err(Error::Moving));
    assert_eq!(mover.run(Direction::Forward, 1, last), Err(Error::Moving));
    let rest = (last..=last + 10_000).find(|now| mover.is_at_rest(*now)).unwrap();
    // sqrt(1 / a) for half a step.
    assert!((900..=1100).contains(&(rest - last)), "{last} {rest}");
    mover.move_to(20_000, rest).unwrap();
    for _ in 0..3 {
        last = mover.pulse().unwrap().tick;
    }
    mover.hold(last);
    assert!(take(&mut mover, u64::MAX) >= 49);
    assert!(mover.commanded() < 10_000, "{}", mover.commanded());
}

/// A second one with a clock that is ahead finds it over, and the clock goes back: it is not over yet.
#[test]
fn a_quick_stop_is_not_over_for_a_clock_that_goes_back() {
    let mut mover = Mover::new(Clock::new(25_000).unwrap(), limits(222, 21_286, 21_264_184_813)).unwrap();
    mover.move_to(-1, 0).unwrap();
    mover.quick_stop(limits(222, 3_957_658, 0), 171);
    mover.quick_stop(limits(222, 999, 0), 172);
    assert_eq!((mover.due(), mover.move_to(1, 0)), (None, Err(Error::Moving)));
    mover.move_to(1, 172).unwrap();
    assert!(mover.due().is_some());
}

/// At 20,000 steps/s, and told to stop with a tenth of what it can do.
#[test]
fn a_quick_stop_with_lower_limits_is_no_longer_than_a_stop() {
    let ways = [0, 1, 2].map(|which| {
        let mut mover = fast();
        mover.run(Direction::Forward, 20_000, 0).unwrap();
        // Also while it still speeds up.
        take(&mut mover, 90_000);
        match which {
            0 => mover.stop(90_000),
            1 => mover.quick_stop(Limits::new(20_000, 20_000).unwrap().with_jerk(200_000).unwrap(), 90_000),
            _ => mover.quick_stop(Limits::new(20_000, 20_000).unwrap(), 90_000),
        }
        take(&mut mover, u64::MAX);
        mover.commanded()
    });
    assert_eq!(ways[0], ways[1]);
    // Without a jerk limit, and with the 200,000 steps/s² of the axis.
    assert!(ways[2] < ways[0], "{ways:?}");
}

/// An ordinary stop, a hold or an override in a quick stop change nothing; a harder quick stop makes it shorter.
#[test]
fn a_stop_during_a_quick_stop_does_not_soften_it() {
    let end = |then: fn(&mut Mover)| {
        let mut mover = fast();
        mover.run(Direction::Forward, 20_000, 0).unwrap();
        take(&mut mover, 500_000);
        mover.quick_stop(Limits::new(20_000, 1_000_000).unwrap(), 500_000);
        take(&mut mover, 505_000);
        then(&mut mover);
        take(&mut mover, u64::MAX);
        mover.commanded()
    };
    let alone = end(|_| {});
    assert_eq!(end(|mover| mover.stop(505_000)), alone);
    assert_eq!(end(|mover| mover.hold(505_000)), alone);
    assert_eq!(end(|mover| mover.resume(505_000)), alone);
    assert_eq!(end(|mover| mover.set_override(1, 505_000)), alone);
    assert_eq!(end(|mover| mover.quick_stop(Limits::new(20_000, 1000).unwrap(), 505_000)), alone);
    let harder = end(|mover| mover.quick_stop(Limits::new(20_000, 10_000_000).unwrap(), 505_000));
    // 15,000 steps/s are left: 112 steps at 1,000,000 steps/s², 11 at ten times that.
    assert!((95..=105).contains(&(alone - harder)), "{alone} {harder}");
}

/// A request with a time that is long over, or far ahead of steps that nobody has taken yet.
#[test]
fn a_wrong_time_makes_no_burst() {
    for wrong in [-90_000_i64, -5000, 5000, 90_000] {
        let mut mover = fast();
        mover.run(Direction::Forward, 1000, 0).unwrap();
        take(&mut mover, 500_000);
        mover.run(Direction::Forward, 1200, 500_000_u64.saturating_add_signed(wrong)).unwrap();
        let least = take(&mut mover, 1_000_000);
        assert!(least >= 832, "{wrong}: {least}");
        assert!((1060..1110).contains(&mover.commanded()), "{wrong}: {}", mover.commanded());
    }
}

/// The pause is for the driver and the mechanics; a halt does not make it shorter.
#[test]
fn the_reversal_pause_is_kept_after_a_halt() {
    let mut mover = fast().with_reversal_pause(7000);
    assert_eq!(mover.turn(), None);
    mover.move_to(300, 0).unwrap();
    assert_eq!(mover.turn(), None, "DIR is right at first");
    take(&mut mover, 60_000);
    mover.halt(60_000);
    mover.move_to(-100, 60_000).unwrap();
    let due = mover.due().unwrap();
    assert!(due > 67_000);
    assert!(mover.turn().is_some_and(|turn| turn >= 63_500 && turn + 3500 <= due));
    // Halted in the pause, when DIR may have changed already.
    mover.halt(61_000);
    mover.move_to(-100, 62_000).unwrap();
    assert!(mover.due().unwrap() > 69_000 && mover.turn().is_some(), "nobody knows whether it has");
    mover.halt(63_000);
    mover.move_to(200, 64_000).unwrap();
    assert!(mover.due().unwrap() > 71_000 && mover.turn().is_some(), "and back");
    take(&mut mover, u64::MAX);
    assert_eq!(mover.commanded(), 200);
    // By a plain way back.
    let last = 10_000_000;
    mover.run(Direction::Forward, 5000, last).unwrap();
    take(&mut mover, last + 100_000);
    mover.move_to(0, last + 100_000).unwrap();
    let (mut before, mut turned) = (0, false);
    while let Some(turn) = mover.due().map(|_| mover.turn()) {
        let pulse = mover.pulse().unwrap();
        if let Some(turn) = turn {
            assert!(turn >= before + 3500 && turn + 3500 <= pulse.tick, "{before} {turn} {}", pulse.tick);
            turned = true;
        }
        before = pulse.tick;
    }
    assert!(turned && mover.commanded() == 0);
}

/// A new target a few steps after the place where a long brake under way would end: it brakes a little less. What it has to go beyond
/// that place is a very small part of the way, and is not made up for at the end: neither at once, nor at hardly any speed.
#[test]
fn a_target_right_behind_the_end_of_a_long_brake() {
    let limits = Limits::new(400_000, 200_000).unwrap().with_jerk(200_000).unwrap();
    let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap();
    mover.run(Direction::Forward, 400_000, 0).unwrap();
    take(&mut mover, 6_000_000);
    mover.hold(6_000_000);
    let now = 6_600_000;
    take(&mut mover, now);
    let end = |target: Option<i64>| {
        let mut mover = mover.clone();
        if let Some(target) = target {
            mover.resume(now);
            mover.move_to(target, now).unwrap();
        }
        let (mut last, mut least) = (mover.pulse().unwrap().tick, u64::MAX);
        while let Some(pulse) = mover.pulse() {
            (last, least) = (pulse.tick, least.min(pulse.tick - last));
        }
        (mover.commanded(), last, least)
    };
    let (stop, rest, _) = end(None);
    assert_eq!(stop, 2_400_000);
    for more in [0, 1, 2, 5, 10, 20, 40, 100] {
        let (place, last, least) = end(Some(stop + more));
        assert_eq!(place, stop + more);
        assert!(least >= 2, "{least} ticks between two of {more} steps more, at 2.5 for full speed");
        assert!(last < rest + 200_000, "{more} steps more take {} us", last - rest);
    }
}

#[test]
fn a_slow_jog_is_slow() {
    for speed in [1, 7, 50] {
        let mut mover = fast();
        mover.run(Direction::Forward, speed, 0).unwrap();
        take(&mut mover, 10_000_000);
        assert!(mover.commanded().abs_diff(10 * i64::from(speed)) <= 1, "{speed}: {}", mover.commanded());
    }
}

/// The position is another one; the old target has no meaning there.
#[test]
fn a_new_reference_forgets_the_aim() {
    let mut mover = fast();
    mover.move_to(500, 0).unwrap();
    take(&mut mover, 20_000);
    mover.hold(20_000);
    take(&mut mover, u64::MAX);
    assert!(mover.commanded() < 400);
    mover.set_commanded(0, 9_000_000).unwrap();
    mover.resume(9_000_000);
    assert_eq!(mover.due(), None);
}

/// A halt ends a hold and a quick stop, even in the tick of a step.
#[test]
fn a_halt_leaves_nothing_of_a_hold_or_a_quick_stop() {
    for quick in [false, true] {
        let mut mover = fast();
        mover.move_to(5000, 0).unwrap();
        take(&mut mover, 60_000);
        if quick {
            mover.quick_stop(limits(20_000, 300_000, 0), 60_000);
        } else {
            mover.hold(60_000);
        }
        let tick = mover.pulse().unwrap().tick;
        mover.halt(tick);
        assert!(mover.is_halted() && mover.due().is_none());
        mover.move_to(5000, tick).unwrap();
        take(&mut mover, u64::MAX);
        assert_eq!(mover.commanded(), 5000);
    }
}

/// DIR at rest is that of the last step, while nothing is to come: the axis is held, its override is 0, or it is there.
#[test]
fn a_rest_keeps_its_direction() {
    let mut mover = fast();
    mover.move_to(-500, 0).unwrap();
    take(&mut mover, u64::MAX);
    let now = 9_000_000;
    let rests = |mover: &Mover| {
        assert_eq!((mover.due(), mover.turn(), mover.direction()), (None, None, Direction::Reverse));
    };
    rests(&mover);
    mover.stop(now);
    rests(&mover);
    mover.hold(now);
    mover.move_to(500, now).unwrap();
    rests(&mover);
    mover.set_override(0, now);
    mover.resume(now);
    rests(&mover);
    mover.set_override(100, now);
    assert_eq!(mover.direction(), Direction::Forward);
    take(&mut mover, u64::MAX);
    assert_eq!(mover.commanded(), 500);
}

/// Told the same again while it brakes: the brake goes on, down to the speed that was asked for and no lower.
#[test]
fn an_axis_above_its_speed_comes_down_at_once() {
    let slow = |again: u64| {
        let mut mover = fast();
        mover.run(Direction::Forward, 20_000, 0).unwrap();
        take(&mut mover, 400_000);
        mover.set_override(10, 400_000);
        for now in (401_000..900_000).step_by(again as usize) {
            take(&mut mover, now);
            mover.set_override(10, now);
            let state = mover.at(now);
            assert!(state.speed >= 1999 << 16 || state.acceleration >= 0, "{state}");
        }
        take(&mut mover, 900_000);
        (mover.commanded(), mover.at(900_000).speed >> 16)
    };
    let (alone, speed) = slow(499_000);
    assert!(speed.abs_diff(2000) <= 1, "{speed}");
    for again in [1000, 7000] {
        let (position, speed) = slow(again);
        assert!(position.abs_diff(alone) <= 1 && speed.abs_diff(2000) <= 1, "{position} {alone}, {speed}");
    }
}

mod paths {
    use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

    /// A line, slow beside the ticks of its clock; stopped at a tick. Gives the steps that come after that.
    fn stopped(feed: u32, percent: u16, at: u64) -> [u64; 2] {
        let axis = AxisSetup::new(Limits::new(10_000, 200_000).unwrap(), 80_000);
        let mut machine = PathMover::new(Path::<2, 4>::new(Clock::new(25_000).unwrap(), [axis; 2], 20).unwrap());
        machine.set_override(percent, 0);
        machine.push([40_000, 16_838], feed, 0).unwrap();
        while machine.due().is_some_and(|due| due <= at) {
            machine.pulse();
        }
        let before = machine.commanded();
        machine.stop(at);
        let mut last = at;
        while let Some(pulse) = machine.pulse() {
            last = pulse.tick;
        }
        let after = machine.commanded();
        assert_eq!(after, machine.target(), "{at}");
        let rest = last + 1000;
        assert!(machine.is_at_rest(rest) && machine.is_empty(), "{at}");
        // It can be started again.
        machine.set_override(100, rest);
        machine.push([after[0] + 10, after[1] - 20], 100_000, rest).unwrap();
        while machine.pulse().is_some() {}
        assert_eq!(machine.commanded(), [after[0] + 10, after[1] - 20], "{at}");
        [0, 1].map(|axis: usize| after[axis].abs_diff(before[axis]))
    }

    /// A step falls into the nearest tick, so at a stop more may have been made than the place says.
    #[test]
    fn a_stop_is_a_stop_however_slow_the_line() {
        for at in 0..400 {
            for (feed, percent) in [(20_000, 1), (10, 100), (100_000, 100), (1000, 150)] {
                let more = stopped(feed, percent, at * 137);
                let most = if feed == 100_000 { 170 } else { 1 };
                assert!(more.iter().all(|steps| *steps <= most), "{more:?} steps after a stop at {at}, {feed}");
            }
        }
    }

    /// A line at 20 mm/s and one at 100 mm/s straight on: at the joint it runs at 20.
    #[test]
    fn a_joint_is_no_faster_than_the_line_before() {
        let axis = AxisSetup::new(Limits::new(20_000, 200_000).unwrap(), 80_000);
        let mut path = Path::<1, 4>::new(Clock::MICROSECONDS, [axis], 20).unwrap();
        path.push([800], 20_000).unwrap();
        path.push([8000], 100_000).unwrap();
        let ticks: Vec<u64> = path.next_line().unwrap().map(|pulse| pulse.tick).collect();
        let least = ticks.windows(2).map(|pair| pair[1] - pair[0]).min();
        assert!(least >= Some(624), "{least:?}, 625 but for rounding");
    }
}
