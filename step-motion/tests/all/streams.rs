//! Requests that follow each other faster than a block is made, with slices of 25 us: 4,200 instructions at 168 MHz.

use servowire_core::Direction;
use step_motion::{Axes, AxesQueue, Axis, AxisSetup, Clock, Limits, Mover, Path, Queue, Work};

fn limits() -> Limits {
    Limits::new(20_000, 200_000).unwrap().with_jerk(4_000_000).unwrap()
}

/// Two seconds of slices, with a request to an axis at 5000 steps/s in each ms from `from` us on. Returns where it is after each of the
/// two, and when it made its last step, in us.
fn jog(from: u64, again: impl Fn(&mut Axis<'_, 129>, u64)) -> ([i64; 2], u64) {
    jog_each(from, 1000, |axis, now| again(axis, now / 1000))
}

/// The same with a request every so many us.
fn jog_each(from: u64, every: u64, again: impl Fn(&mut Axis<'_, 129>, u64)) -> ([i64; 2], u64) {
    let queue = Queue::<129>::new();
    let (mut axis, mut timer) = Axis::new(&queue, Clock::MICROSECONDS, limits()).unwrap();
    let (mut next, mut places, mut last) = (None, [0; 2], 0);
    axis.run(Direction::Forward, 5000).unwrap();
    for now in (0..2_000_000_u64).step_by(25) {
        while let Some(tick) = next.filter(|tick| *tick <= now) {
            let fired = timer.fire();
            last = if fired.is_step() { tick } else { last };
            next = Some(tick + u64::from(fired.wait())).filter(|_| fired.wait() > 0);
        }
        if now % every == 0 && now >= from {
            again(&mut axis, now);
        }
        if axis.poll() == Work::Start {
            next = Some(now + u64::from(timer.fire().wait()));
        }
        places[usize::from(now >= 1_000_000)] = axis.commanded();
    }
    (places, last)
}

/// At 5000 steps/s: 5000 steps in the second second.
#[test]
fn an_axis_goes_on_under_a_stream_of_requests() {
    let steps = |[one, two]: [i64; 2]| two - one;
    for from in [0, 500_000] {
        let same = jog(from, |axis, _| axis.run(Direction::Forward, 5000).unwrap()).0;
        assert!(steps(same).abs_diff(5000) <= 1, "the same speed: {same:?}");
        let knob = jog(from, |axis, ms| axis.run(Direction::Forward, 5000 + (ms % 50) as u32).unwrap()).0;
        assert!(steps(knob).abs_diff(5025) < 30, "other speeds: {knob:?}");
        let feed = jog(from, |axis, ms| axis.set_override(90 + (ms % 3) as u16)).0;
        assert!(steps(feed).abs_diff(4550) < 60, "overrides: {feed:?}");
        let held = jog(from, |axis, ms| if ms % 2 == 0 { axis.hold() } else { axis.resume() }).0;
        assert!(steps(held) < 5010 && held[0] >= 0, "holds: {held:?}");
        let there = jog(from, |axis, ms| axis.move_to(200_000 + i64::from(ms % 2 == 0)).unwrap()).0;
        assert!(steps(there) > 10_000, "targets: {there:?}");
    }
}

/// What counts only after a stop does not put it off; nor does another stop, a quicker one included, but for the rounding of a new plan.
#[test]
fn a_stop_is_no_later_whatever_follows_it() {
    let stop = |quick: bool, then: fn(&mut Axis<'_, 129>, u64)| {
        jog(500_000, |axis, ms| match ms {
            500 if quick => axis.quick_stop(limits().without_jerk()),
            500 => axis.stop(),
            _ => then(axis, ms),
        })
    };
    for quick in [false, true] {
        let ([_, alone], at) = stop(quick, |_, _| ());
        let others: [fn(&mut Axis<'_, 129>, u64); 4] = [
            |axis, ms| axis.set_override(90 + (ms % 2) as u16),
            |axis, ms| if ms % 2 == 0 { axis.hold() } else { axis.resume() },
            |axis, _| axis.stop(),
            |axis, ms| axis.quick_stop(Limits::new(20_000, 200_000 + (ms % 7) as u32).unwrap()),
        ];
        for (other, then) in others.into_iter().enumerate() {
            let ([_, place], rest) = stop(quick, then);
            assert!(
                place <= alone && rest <= at + 5,
                "{other}, quick {quick}: {place} at {rest} us, alone {alone} at {at} us"
            );
        }
    }
}

/// From the request on, not only once the interrupt has seen it.
#[test]
fn an_axis_is_halted_at_once() {
    let queue = Queue::<129>::new();
    let (mut axis, mut timer) = Axis::new(&queue, Clock::MICROSECONDS, limits()).unwrap();
    let mut work = |axis: &mut Axis<'_, 129>| {
        while axis.poll() == Work::More {}
        timer.fire();
    };
    axis.halt();
    assert!(!axis.is_halted(), "at rest");
    work(&mut axis);
    work(&mut axis);
    axis.run(Direction::Forward, 5000).unwrap();
    (0..50).for_each(|_| work(&mut axis));
    axis.halt();
    assert!(axis.is_halted());
    work(&mut axis);
    assert!(axis.is_halted());
    work(&mut axis);
    assert!(axis.is_halted() && axis.is_at_rest());
}

/// What is so already changes no step: not even by rounding.
#[test]
fn a_request_again_changes_no_step() {
    let steps = |again: &dyn Fn(&mut Mover, u64)| {
        let mut mover = Mover::new(Clock::MICROSECONDS, limits()).unwrap();
        mover.move_to(3001, 0).unwrap();
        let ticks: Vec<_> = core::iter::from_fn(|| {
            let tick = mover.pulse()?.tick;
            again(&mut mover, tick);
            Some(tick)
        })
        .collect();
        ticks
    };
    let alone = steps(&|_, _| ());
    let others: [fn(&mut Mover, u64); 4] = [
        |mover, now| mover.move_to(3001, now).unwrap(),
        |mover, now| mover.resume(now),
        |mover, now| mover.set_override(100, now),
        |mover, now| mover.set_override(200, now),
    ];
    for (other, again) in others.iter().enumerate() {
        assert!(steps(again) == alone, "{other}");
    }
}

/// The same for a path: 20,000 steps at 5 mm/s of 1000 steps/mm, in slices of 100 us, 16,800 instructions.
fn follow(from: u64, again: impl Fn(&mut Axes<'_, 1, 4, 129>, u64)) -> ([i64; 2], u64) {
    follow_each(from, 1000, |axes, now| again(axes, now / 1000))
}

fn follow_each(from: u64, every: u64, again: impl Fn(&mut Axes<'_, 1, 4, 129>, u64)) -> ([i64; 2], u64) {
    let queue = AxesQueue::<1, 129>::new();
    let axis = AxisSetup::new(limits(), 1_000_000);
    let (mut axes, mut timer) = Axes::new(&queue, Path::new(Clock::MICROSECONDS, [axis], 20).unwrap());
    let (mut next, mut places, mut last) = (None, [0; 2], 0);
    axes.push([20_000], 5_000).unwrap();
    for now in (0..2_000_000_u64).step_by(100) {
        while let Some(tick) = next.filter(|tick| *tick <= now) {
            let fired = timer.fire();
            last = if fired.steps() > 0 { tick } else { last };
            next = Some(tick + u64::from(fired.wait())).filter(|_| fired.wait() > 0);
        }
        if now % every == 0 && now >= from {
            again(&mut axes, now);
        }
        if axes.poll() == Work::Start {
            next = Some(now + u64::from(timer.fire().wait()));
        }
        places[usize::from(now >= 1_000_000)] = axes.commanded()[0];
    }
    (places, last)
}

#[test]
fn a_path_goes_on_under_a_stream_of_requests() {
    let steps = |[one, two]: [i64; 2]| two - one;
    for from in [0, 500_000] {
        let feed = follow(from, |axes, ms| axes.set_override(90 + (ms % 3) as u16)).0;
        assert!(steps(feed).abs_diff(4550) < 60, "overrides: {feed:?}");
        let held = follow(from, |axes, ms| if ms % 2 == 0 { axes.hold() } else { axes.resume() }).0;
        assert!(steps(held) < 5010 && held[0] >= 0, "holds: {held:?}");
    }
}

#[test]
fn a_stop_of_a_path_is_no_later_whatever_follows_it() {
    let stop = |quick: bool, then: fn(&mut Axes<'_, 1, 4, 129>, u64)| {
        follow(500_000, |axes, ms| match ms {
            500 if quick => axes.quick_stop([limits().without_jerk()]),
            500 => axes.stop(),
            _ => then(axes, ms),
        })
    };
    for quick in [false, true] {
        let ([_, alone], at) = stop(quick, |_, _| ());
        let others: [fn(&mut Axes<'_, 1, 4, 129>, u64); 3] = [
            |axes, ms| axes.set_override(90 + (ms % 2) as u16),
            |axes, ms| if ms % 2 == 0 { axes.hold() } else { axes.resume() },
            |axes, _| axes.stop(),
        ];
        for (other, then) in others.into_iter().enumerate() {
            let ([_, place], rest) = stop(quick, then);
            assert!(
                place <= alone && rest <= at,
                "{other}, quick {quick}: {place} at {rest} us, alone {alone} at {at} us"
            );
        }
    }
}

/// Chords of 40 steps are pushed while they run, under a feed that changes: at the limit of 11,763 steps/s a step of an axis comes 85 us after
/// the one before. A feed that is planned at a joint goes on from the last step of both axes; it went on from that of the slow one.
#[test]
fn a_feed_that_changes_on_short_lines_brings_no_step_forward() {
    let axis = AxisSetup::new(Limits::new(11_763, 91_231).unwrap().with_jerk(1_599_932).unwrap(), 400_000);
    let mut shortest = u64::MAX;
    for case in 0..50_u64 {
        let mut random = case;
        let mut below = |n: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) % n
        };
        let queue = AxesQueue::<2, 257>::new();
        let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], 100).unwrap();
        let (mut axes, mut timer) = Axes::new(&queue, path);
        let (mut now, mut next, mut last, mut lines, mut target, mut held) = (0_u64, None, [None; 2], 0, [0; 2], 0_i32);
        while lines < 400 || held > 0 || !axes.is_at_rest() {
            while lines < 400 && !axes.is_full() {
                let (angle, length) = (f64::from(lines) / 40.0, (1 + below(60)) as f64);
                target = [target[0] + (length * angle.cos()) as i64, target[1] + (length * angle.sin()) as i64];
                lines += 1;
                axes.push(target, 63_000).unwrap();
            }
            while let Some(tick) = next.filter(|tick| *tick <= now) {
                let fired = timer.fire();
                for (axis, last) in last.iter_mut().enumerate().filter(|(axis, _)| fired.steps() >> axis & 1 == 1) {
                    if let Some(before) = last.replace(tick) {
                        assert!(tick - before >= 82, "axis {axis}, case {case}: {before}, {tick}");
                        shortest = shortest.min(tick - before);
                    }
                }
                next = Some(tick + u64::from(fired.wait())).filter(|_| fired.wait() > 0);
            }
            held -= i32::from(held > 0);
            if held == 1 {
                axes.set_override(100);
            } else if held == 0 && below(50) == 0 {
                let holds = below(2) == 0;
                axes.set_override(if holds { 0 } else { 5 + (below(300) * below(300) / 300) as u16 });
                held = if holds { 2 + below(30) as i32 } else { 0 };
            }
            while axes.poll() == Work::More {}
            if axes.poll() == Work::Start {
                next = Some(now + u64::from(timer.fire().wait()));
            }
            now += 1 + below(2500);
        }
        assert_eq!(axes.commanded(), target);
    }
    assert!(shortest < 400, "{shortest}");
}

/// A motion gives way to a stop while its block is being made, after whichever slice: the stop comes at most a segment of 2.5 ms later than
/// without the motion.
#[test]
fn a_stop_comes_before_a_motion() {
    let mut worst = [0; 2];
    for slices in 1..60 {
        let at = 500_000 + slices * 25;
        let axis = |faster: bool| {
            let rest = jog_each(500_000, 25, |axis, now| match now {
                500_000 if faster => axis.run(Direction::Forward, 5600).unwrap(),
                _ if now == at => axis.stop(),
                _ => {}
            });
            rest.1
        };
        worst[0] = worst[0].max(axis(true).saturating_sub(axis(false)));
        let at = 500_000 + slices * 100;
        let path = |slower: bool| {
            let rest = follow_each(500_000, 100, |axes, now| match now {
                500_000 if slower => axes.set_override(90),
                _ if now == at => axes.hold(),
                _ => {}
            });
            rest.1
        };
        worst[1] = worst[1].max(path(true).saturating_sub(path(false)));
    }
    assert!(worst[0] <= 2600 && worst[1] == 0, "{worst:?}");
}
