use super::*;
use crate::curve::Curve;
use crate::limits::{Clock, Limits};
use crate::path::{AxisSetup, End, Path};

type Lines = PathMover<2, 8>;

/// Limits in steps/s² and steps/s³, and a feed in steps/s; a step is a micrometre.
fn mover(limits: [(u32, u64); 2], feed: u32, lines: &[[i64; 2]]) -> Lines {
    let axes = limits.map(|(a, j)| AxisSetup::new(Limits::new(1000, a).unwrap().with_jerk(j).unwrap(), 1_000_000));
    let (mut mover, mut at) = (Lines::new(Path::new(Clock::MICROSECONDS, axes, 1000).unwrap()), [0; 2]);
    for by in lines {
        at = [at[0] + by[0], at[1] + by[1]];
        mover.push(at, feed, 0).unwrap();
    }
    mover
}

/// Takes steps; returns the tick of the last one.
fn take(mover: &mut Lines, steps: usize) -> u64 {
    (0..steps).map(|_| mover.pulse().unwrap().tick).last().unwrap()
}

/// It takes 150 steps and 0.3 s to full speed: while it speeds up, at full speed, and before the end.
#[test]
fn a_stop_is_at_rest_when_it_says() {
    for steps in (1..1000).step_by(13) {
        let mut mover = mover([(5000, 50_000); 2], 1000, &[[1000, 0]]);
        let now = take(&mut mover, steps);
        let stop = mover.stop_from(now).unwrap();
        let rest = mover.rest_of(&stop);
        mover.stop(now);
        assert_eq!(mover.line.as_ref().map(LinePulses::over), Some(rest), "{steps}");
    }
}

/// At full speed a stop takes 150 steps from where the motion is, half a step before the step that has just been made: also where the
/// second line has begun with that step. A hold under way ends where it did, whichever line is the first one.
#[test]
#[expect(clippy::cast_precision_loss, reason = "numbers of few digits")]
fn the_place_where_a_stop_ends() {
    let float = |x: Real| x.to_fixed(16) as f64 / 65536.0;
    let place = |mover: &Lines, now| {
        let (at, place) = mover.stop_from(now).unwrap().end;
        let lengths = [0, 1].map(|at| mover.path.line(at).map_or(0.0, |line| float(line.length)));
        900.0 - lengths[0] - lengths[1] + if at > 0 { lengths[0] } else { 0.0 } + float(place)
    };
    for steps in 390..410 {
        let mut mover = mover([(5000, 50_000); 2], 1000, &[[400, 0], [500, 0]]);
        let now = take(&mut mover, steps);
        let (end, want) = (place(&mover, now), steps as f64 + 149.5);
        assert!((end - want).abs() < 0.02, "{steps}: {end}");
        mover.hold(now);
        for _ in 0..100 {
            let now = take(&mut mover, 1);
            assert!((place(&mover, now) - end).abs() < 0.001, "{steps}: {}", place(&mover, now));
        }
    }
}

/// A stop under way has the steps that its curve has, whatever rounding makes of the place; any other may end anywhere.
#[test]
fn the_steps_of_a_stop_under_way() {
    let ends = |mover: &Lines, now| {
        let End { at, least, most } = mover.end_of(&mover.stop_from(now).unwrap());
        let before = if at.0 == 1 || mover.path.len() == 1 { 400 } else { 0 };
        (least, most.map(|most| i64::from(most) + before))
    };
    for steps in 300..410 {
        let mut mover = mover([(5000, 50_000); 2], 1000, &[[400, 0], [500, 0]]);
        let now = take(&mut mover, steps);
        assert!(ends(&mover, now).1[0] > 1 << 31, "{steps}");
        mover.hold(now);
        let mut alone = mover.clone();
        while alone.pulse().is_some() {}
        let rest = alone.commanded()[0];
        for _ in 0..90 {
            let now = take(&mut mover, 1);
            let (least, most) = ends(&mover, now);
            assert!(least[0] > 0 && most[0] == rest, "{steps}: {least:?} {most:?} for {rest}");
        }
        let now = take(&mut mover, 1);
        mover.stop(now);
        assert!(ends(&mover, now).1[0] > 1 << 31, "{steps}");
    }
}

/// A hold at 250 steps takes 150, and ends at a joint. Rounding may say that it is on the line after it, and later that its place is on
/// the one before. A stop ends there then, and a new line is not the one after it.
#[test]
fn a_stop_at_a_joint_but_for_rounding() {
    for (first, steps) in [(100, 1), (300, 1), (300, 100), (390, 1), (390, 149)] {
        let mut mover = mover([(5000, 50_000); 2], 1000, &[[first, 0], [400 - first, 0], [500, 0]]);
        let mut now = take(&mut mover, 250);
        mover.requests.hold();
        let (motion, start) = mover.here(400_000).unwrap();
        let how = (mover.bounds, false);
        let (course, bounds) = mover.path.brake(0, motion, (start.place, start.before), how).unwrap();
        let (end, more) = (course.more, course.more + 1);
        assert!(mover.adopt(&Course { more, whole: false, ..course }, start, bounds));
        mover.settle(now);
        now = now.max(take(&mut mover, steps));
        let stop = mover.stop_from(now).unwrap().end;
        assert!(stop.0 <= end && stop.0 + 1 == mover.more, "{stop:?} {end}");
        mover.move_to([0, 0], 1000, now).unwrap();
        mover.resume(now);
        take(&mut mover, 150 - steps);
        assert_eq!(mover.commanded(), [400, 0]);
        while mover.pulse().is_some() {}
        assert_eq!((mover.commanded(), mover.is_empty()), ([0, 0], true));
    }
}

/// Where a curve leads over a joint nothing is planned: it goes on as it began, which costs little. A request plans it anew.
#[test]
fn a_joint_on_a_curve_costs_no_plan() {
    let mut mover = mover([(5000, 50_000); 2], 1000, &[[200, 0], [150, 0], [300, 0]]);
    let began = |mover: &Lines| mover.line.as_ref().map(|line| (line.start.moment, mover.more));
    for (steps, more) in [(1, 2), (198, 2), (2, 1), (148, 1), (2, 0), (200, 0)] {
        take(&mut mover, steps);
        assert_eq!(began(&mover), Some((0, more)));
    }
    let now = take(&mut mover, 1);
    mover.set_override(90, now);
    assert_eq!(began(&mover), Some((mover.clock().moment(now), 0)));
}

#[test]
fn a_curve_without_the_steps_that_remain_is_not_begun() {
    let mut mover = mover([(5000, 50_000); 2], 1000, &[[100, 0]]);
    take(&mut mover, 10);
    let (start, bounds) = (mover.line.as_ref().unwrap().start, mover.bounds.unwrap());
    let course = Course { curve: Curve::new(), exit: Real::ZERO, wish: Real::ZERO, whole: true, more: 0, slow: false };
    assert!(!mover.adopt(&course, start, bounds));
    take(&mut mover, 90);
    assert_eq!((mover.commanded(), mover.due()), ([100, 0], None));
}

/// Over lines that differ in their limits: on one curve, or with acceleration 0 at each joint, whichever ends first. How long the second
/// one takes after its first curve is known with its end, so it need not be planned again for that.
#[test]
fn a_quick_stop_is_the_shorter_of_two() {
    let mut shorter = [0, 0];
    let limits = [(1 << 30, 1 << 43), (200, 2000)];
    for lines in [[[300, 1], [20, 8], [300, 1]], [[200, 40], [200, 66], [200, 40]]] {
        for steps in 150..300 {
            let mut mover = mover(limits, 300, &lines);
            let now = take(&mut mover, steps);
            let (Some((motion, start)), how) = (mover.here(now), (mover.bounds, false)) else { continue };
            let from = (start.place, start.before);
            let Some((course, _)) = mover.path.brake(0, motion, from, how) else { continue };
            let once = mover.path.stop(0, motion, from, how, Some(Bounds::NONE)).and_then(Result::ok);
            let (Some((once, _)), false) = (once, course.exit.is_zero()) else { continue };
            let (joints, time) = mover.path.end_of_stop(course.more + 1, course.exit);
            let once = mover.path.locate(0, (from.0 + once.curve.way()) - from.1, once.more);
            let Stop { end, after, .. } = mover.stop_anew(now, Some(Bounds::NONE)).unwrap();
            let want = if once < joints { (once, None) } else { (joints, Some(time)) };
            assert!((end, after) == want, "{steps}: {end:?} {after:?} of {once:?} and {joints:?}");
            shorter[usize::from(once < joints)] += 1;
        }
    }
    assert!(shorter.into_iter().all(|cases| cases > 2), "{shorter:?}");
}
