//! When lines of a path begin and end: after a rest, a pause or a halt, or at once.

use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

/// 1000 steps/s, 5000 steps/s², a step is 1 µm: full speed takes 100 steps and 0.2 s.
fn path() -> Path<2, 8> {
    Path::new(Clock::MICROSECONDS, [setup(); 2], 20).unwrap()
}

fn setup() -> AxisSetup {
    AxisSetup::new(Limits::new(1000, 5000).unwrap(), 1_000_000)
}

fn ticks(path: &mut Path<2, 8>) -> Vec<u64> {
    path.next_line().unwrap().map(|pulse| pulse.tick).collect()
}

fn rest(machine: &mut PathMover<2, 8>) -> Vec<u64> {
    core::iter::from_fn(|| machine.pulse()).map(|pulse| pulse.tick).collect()
}

/// 2.5 s at a step/s, but for the ramps.
#[test]
fn the_lowest_feed_is_a_micrometre_in_a_second() {
    let last = |feed| {
        let mut path = path();
        path.push([3, 0], feed).unwrap();
        *ticks(&mut path).last().unwrap()
    };
    assert!((2_499_000..2_501_000).contains(&last(1)), "{}", last(1));
    assert_eq!(last(0), last(1));
}

#[test]
fn a_rest_lasts_as_long_as_is_asked() {
    let second = |tick| {
        let mut path = path();
        path.push([100, 0], 1000).unwrap();
        let last = *ticks(&mut path).last().unwrap();
        path.not_before(tick);
        path.push([200, 0], 1000).unwrap();
        (last, ticks(&mut path)[0])
    };
    let (last, first) = second(0);
    assert!(first > last + 20_000, "{last} {first}");
    // The first step falls half a step after the start: (2 / 2 / 5000)^1/2 s.
    let (_, first) = second(5_000_000);
    assert!(first.abs_diff(5_014_142) <= 1, "{first}");
}

/// 500 steps/s after 1000: at the joint the machine moves.
#[test]
fn motion_does_not_wait() {
    let all = |tick| {
        let mut path = path();
        path.push([300, 0], 1000).unwrap();
        path.push([600, 0], 500).unwrap();
        let mut all = ticks(&mut path);
        path.not_before(tick);
        all.extend(ticks(&mut path));
        all
    };
    assert_eq!(all(0), all(100_000_000));
}

/// On the second of two lines, which has begun in motion.
#[test]
fn what_follows_a_halt_begins_at_rest() {
    let mut machine = PathMover::new(path());
    machine.push([300, 0], 1000, 0).unwrap();
    machine.push([900, 0], 500, 0).unwrap();
    let mut now = 0;
    while machine.commanded()[0] < 500 {
        now = machine.pulse().unwrap().tick;
    }
    machine.halt(now + 10);
    machine.push([800, 0], 1000, now + 10).unwrap();
    let mut fresh = PathMover::new(path());
    fresh.push([300, 0], 1000, 0).unwrap();
    let (halted, fresh) = (rest(&mut machine), rest(&mut fresh));
    let begin = halted[0] - fresh[0];
    assert!(begin > now, "{begin} {now}");
    for (halted, fresh) in halted.iter().zip(&fresh) {
        assert!((halted - fresh).abs_diff(begin) <= 1, "{halted} {fresh} {begin}");
    }
    assert_eq!(halted.len(), 300);
}

/// An axis of one step turns round, too; one that does not move does not, whichever way it has gone before.
#[test]
fn a_pause_is_for_the_axes_that_turn() {
    let pause = |to: [[i64; 2]; 2]| {
        let setups = [setup(), setup().with_reversal_pause(1_000_000)];
        let mut path = Path::new(Clock::MICROSECONDS, setups, 0).unwrap();
        for to in to {
            path.push(to, 1000).unwrap();
        }
        let last = *ticks(&mut path).last().unwrap();
        ticks(&mut path)[0] - last
    };
    assert!(pause([[10, 10], [10, 9]]) > 1_000_000);
    assert!(pause([[10, 10], [10, 0]]) > 1_000_000);
    assert!(pause([[10, -10], [10, -9]]) > 1_000_000);
    assert!(pause([[10, -10], [20, -10]]) < 1_000_000);
    assert!(pause([[-10, 10], [-20, 10]]) < 1_000_000);
}

/// From the halt on, which comes half a second after the start.
#[test]
fn a_pause_behind_a_halt_is_whole() {
    let setups = [setup(), setup().with_reversal_pause(1_000_000)];
    let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, setups, 0).unwrap());
    machine.push([0, 800], 1000, 0).unwrap();
    let mut now = 0;
    while now < 500_000 {
        now = machine.pulse().unwrap().tick;
    }
    machine.halt(now);
    machine.push([0, 0], 1000, now).unwrap();
    let first = machine.due().unwrap();
    assert!(first > now + 1_000_000, "{first} {now}");
}

/// The line back has been cut off by a stop: the axis has not turned there, but does on the line after the next one.
#[test]
fn a_line_that_was_cut_off_turns_no_axis() {
    let setups = [setup(), setup().with_reversal_pause(200_000)];
    let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, setups, 1000).unwrap());
    for to in [[300, 300], [600, 0]] {
        machine.push(to, 1000, 0).unwrap();
    }
    let (mut now, mut last) = (0, 0);
    while machine.commanded() != [100, 100] {
        now = machine.pulse().unwrap().tick;
    }
    machine.stop(now);
    let [x, y] = machine.target();
    assert!(y < 300);
    machine.push([x + 10, y], 1000, now).unwrap();
    machine.push([x + 200, y - 20], 1000, now).unwrap();
    let mut up = true;
    while let Some(pulse) = machine.pulse() {
        if pulse.axis == 1 {
            if pulse.direction.dir() && up {
                assert!(pulse.tick - last >= 200_000, "{}", pulse.tick - last);
                up = false;
            }
            last = pulse.tick;
        }
    }
    assert!(!up && machine.commanded() == [x + 200, y - 20]);
}

/// 1000 steps/s: the line ends half a step after its last step, which a halt does not wait for.
#[test]
fn a_halt_behind_the_last_step_is_a_rest() {
    for after in [1, 100, 400] {
        let limits = Limits::new(1000, 1_000_000_000).unwrap();
        let mut machine =
            PathMover::new(Path::<1, 4>::new(Clock::MICROSECONDS, [AxisSetup::new(limits, 80_000)], 20).unwrap());
        machine.push([10], 1_000_000, 0).unwrap();
        let last = core::iter::from_fn(|| machine.pulse()).last().unwrap().tick;
        let now = last + after;
        assert!(!machine.is_at_rest(now));
        machine.halt(now);
        assert!(machine.is_at_rest(now) && machine.is_halted(), "{after}");
        machine.set_commanded([0], now).unwrap();
        machine.push([1], 1_000_000, now).unwrap();
        // After the last step as soon as speed allows.
        let next = machine.due().unwrap();
        assert!((last + 1000..last + 502 + after.max(500)).contains(&next), "{after}: {}", next - last);
    }
}

/// A line that is pushed while the last one runs, the one before it being over, continues it.
#[test]
fn the_last_line_is_remembered_until_it_ends() {
    let all = |late: bool| {
        let mut machine = PathMover::new(path());
        machine.push([300, 0], 1000, 0).unwrap();
        machine.push([900, 0], 500, 0).unwrap();
        if !late {
            machine.push([1500, 0], 500, 0).unwrap();
        }
        let mut all = Vec::new();
        while let Some(pulse) = machine.pulse() {
            all.push(pulse.tick);
            if late && all.len() == 400 {
                assert_eq!(machine.len(), 1);
                machine.push([1500, 0], 500, pulse.tick).unwrap();
            }
        }
        all
    };
    let (late, early) = (all(true), all(false));
    assert_eq!((late.len(), early.len()), (1500, 1500));
    for (late, early) in late.iter().zip(&early) {
        assert!(late.abs_diff(*early) <= 1, "{late} {early}");
    }
}

/// At 1000 steps/s, half a step after the last one, though one curve leads over both lines.
#[test]
fn a_line_ends_where_the_next_one_begins() {
    let limits = Limits::new(1000, 5000).unwrap().with_jerk(50_000).unwrap();
    let mut path = Path::new(Clock::MICROSECONDS, [AxisSetup::new(limits, 1_000_000); 2], 20).unwrap();
    path.push([300, 0], 1000).unwrap();
    path.push([600, 0], 1000).unwrap();
    let line = path.next_line().unwrap();
    let (end, last) = (line.end(), line.last().unwrap().tick);
    let first = ticks(&mut path)[0];
    assert!((end - last).abs_diff(500) <= 1 && (first - end).abs_diff(500) <= 1, "{last} {end} {first}");
}

/// A hold that comes to rest after the last step of a line and before its end, half a step later: on from there, not from that end. At
/// 1000 steps/s at most a step takes 1 ms of motion, however it is held.
#[test]
fn a_rest_before_a_line_is_not_at_its_start() {
    let limits = Limits::new(1000, 10_000_000).unwrap().with_jerk(1_000_000_000_000).unwrap();
    let axis = AxisSetup::new(limits, 80_000);
    let mut rests = 0;
    for after in (0..1000).step_by(25) {
        let mut machine = PathMover::new(Path::<1, 4>::new(Clock::MICROSECONDS, [axis], 20).unwrap());
        machine.push([10], 1_000_000, 0).unwrap();
        machine.push([20], 1_000_000, 0).unwrap();
        let mut last = 0;
        while machine.commanded() != [10] {
            last = machine.pulse().unwrap().tick;
        }
        let held = last + after;
        machine.hold(held);
        if machine.due().is_none() {
            rests += 1;
            machine.resume(held + 5000);
            let next = machine.pulse().unwrap().tick - 5000;
            // Less the way of the brake, of a tenth of a millisecond.
            assert!(next >= last + 950, "{} us after {after}", next - last);
        }
    }
    assert!(rests > 10, "{rests}");
}

/// Time has 2^64 moments, 2^21 of them in a tick of a millisecond: 8.796 · 10^9 s. A step of x takes sqrt(5) / 2 · 10^8 s here, so 79 of
/// them and 39 of y are in time; no later one is ever due, and the machine stays on its line, whatever is asked for.
#[test]
fn time_ends_on_the_line() {
    let axis = AxisSetup::new(Limits::new(500, 5000).unwrap(), 1);
    let path = Path::<2, 8>::new(Clock::new(1000).unwrap(), [axis; 2], 20).unwrap();
    let mut machine = PathMover::new(path);
    machine.set_override(1, 0);
    machine.push([200, 100], 1, 0).unwrap();
    machine.push([0, 0], 1, 0).unwrap();
    let mut asked = machine.clone();
    let all = rest(&mut machine);
    assert!(all.is_sorted() && *all.last().unwrap() < 1 << 43);
    assert_eq!(machine.commanded(), [79, 39]);
    while let Some(pulse) = asked.pulse() {
        asked.hold(pulse.tick + 1_000_000);
        asked.resume(pulse.tick + 2_000_000);
        let [x, y] = asked.commanded();
        assert!((x - 2 * y).abs() <= 2, "{x} {y}");
    }
    assert!(asked.commanded()[0] <= 79);
    for now in [u64::MAX >> 22, u64::MAX >> 21, u64::MAX] {
        machine.hold(now);
        machine.resume(now);
        assert_eq!((machine.due(), machine.commanded()), (None, [79, 39]));
    }
}
