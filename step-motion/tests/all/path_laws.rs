//! The laws of a stop over all requests to a path, at any moment, any clock and any limits. What is looked at are the steps.

use proptest::prelude::*;
use step_motion::{AxisSetup, Clock, Direction, Error, Limits, Path, PathMover};

const N: usize = 2;
type Machine = PathMover<N, 5>;

#[derive(Debug, Clone, Copy)]
enum Request {
    Push([i64; N], u32),
    MoveTo([i64; N], u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
    Quick([(u32, u64); N]),
    Halt,
}

fn place() -> impl Strategy<Value = [i64; N]> {
    prop_oneof![3 => [-900..900_i64, -900..900_i64], 1 => [-1300..1300_i64, -1300..1300_i64], 1 => [-6..6_i64, -6..6_i64], 1 => (-900..900_i64).prop_map(|x| [x, 0])]
}

fn request() -> impl Strategy<Value = Request> {
    let feed = || spread(10.0, 3e5).prop_map(|feed| feed as u32);
    prop_oneof![
        6 => (place(), feed()).prop_map(|(to, feed)| Request::Push(to, feed)),
        2 => (place(), feed()).prop_map(|(to, feed)| Request::MoveTo(to, feed)),
        3 => (0..250_u16).prop_map(Request::Override),
        3 => Just(Request::Hold),
        3 => Just(Request::Resume),
        2 => Just(Request::Stop),
        2 => [harder(), harder()].prop_map(Request::Quick),
        1 => Just(Request::Halt),
    ]
}

/// Spread over the decades.
fn spread(low: f64, high: f64) -> impl Strategy<Value = u64> {
    (low.ln()..high.ln()).prop_map(|x| x.exp() as u64)
}

/// Acceleration and jerk of a quick stop, maybe less than those of the axis.
fn harder() -> impl Strategy<Value = (u32, u64)> {
    (spread(1e3, 1e8).prop_map(|a| a as u32), prop_oneof![1 => Just(0), 1 => spread(1e4, 1e12)])
}

/// In us.
fn pause() -> impl Strategy<Value = u64> {
    prop_oneof![1 => Just(0), 1 => spread(1.0, 3e4)]
}

/// How far the axes may go.
const SOFT: i64 = 1100;

fn axis() -> impl Strategy<Value = (u64, u64, u64, u64)> {
    (spread(50.0, 1e5), spread(1e3, 1e7), prop_oneof![2 => Just(0), 5 => spread(1e4, 1e11)], spread(1e3, 1e6))
}

/// How the steps that are left end, if nothing else is asked for.
#[derive(Debug, Clone, Copy)]
struct Ending {
    /// Steps to come of each axis, and the first tick at rest.
    steps: [u64; N],
    rest: u64,
}

fn ending(machine: &Machine, now: u64) -> Ending {
    let mut machine = machine.clone();
    let (mut steps, mut last) = ([0; N], now);
    while let Some(pulse) = machine.pulse() {
        steps[usize::from(pulse.axis)] += 1;
        assert!(steps[0] + steps[1] < 100_000, "the stop does not end");
        last = pulse.tick;
    }
    let (mut low, mut high) = (last, (last.max(1) << 20).max(1 << 40));
    while low < high {
        let middle = low.midpoint(high);
        if machine.is_at_rest(middle) { high = middle } else { low = middle + 1 }
    }
    Ending { steps, rest: low }
}

impl Ending {
    /// Not longer and not later, but for what rounding to a step of the path, and to a tick, may cost.
    fn is_within(self, other: Self, step: u64, ticks: u64) -> bool {
        self.steps.iter().zip(other.steps).all(|(own, other)| *own <= other + step) && self.rest <= other.rest + ticks
    }
}

struct Watched {
    machine: Machine,
    hz: u32,
    axes: [AxisSetup; N],
    /// Ticks that a place on the line that is 2^-16 steps off costs right before rest, and two.
    rounding: u64,
    now: u64,
    last: [Option<(u64, Direction)>; N],
    position: [i64; N],
    stop: Option<Ending>,
    /// It is held: lines that come do not move it.
    held: bool,
    slowed: bool,
    /// In a quick stop, which may be within less than half a step of a corner.
    hurried: bool,
}

impl Watched {
    fn until(&mut self, time: u64) -> Result<(), TestCaseError> {
        while self.machine.due().is_some_and(|due| due <= time) {
            self.step()?;
        }
        self.now = self.now.max(time);
        if self.machine.is_at_rest(self.now) {
            (self.stop, self.hurried) = (None, false);
        }
        Ok(())
    }

    fn step(&mut self) -> Result<(), TestCaseError> {
        let pulse = self.machine.pulse().unwrap();
        let i = usize::from(pulse.axis);
        self.position[i] = pulse.direction.advance(self.position[i]);
        prop_assert_eq!(self.machine.commanded(), self.position);
        prop_assert!(pulse.tick >= self.now || self.last.iter().flatten().all(|(last, _)| pulse.tick >= *last));
        prop_assert!(self.position[i].abs() <= SOFT, "axis {i} at {}", self.position[i]);
        if let Some((last, before)) = self.last[i] {
            prop_assert!(pulse.tick > last, "two steps in a tick");
            let least = u64::from(self.hz) / u64::from(self.axes[i].limits.speed());
            let gap = pulse.tick - last;
            prop_assert!(gap + 2 >= least, "axis {i}: {gap} ticks, {least} are the fastest");
            let pause = u64::from(self.axes[i].reversal_pause);
            // A tick of rounding at either end.
            prop_assert!(
                before == pulse.direction || self.hurried || gap + 2 >= pause,
                "axis {i} turns round within {gap} ticks, {pause} are asked for"
            );
        }
        self.last[i] = Some((pulse.tick, pulse.direction));
        self.now = self.now.max(pulse.tick);
        Ok(())
    }

    fn tell(&mut self, request: Request, skew: i64) -> Result<(), TestCaseError> {
        let now = self.now.saturating_add_signed(skew);
        if self.machine.is_at_rest(now) {
            self.stop = None;
        }
        let rest = self.machine.is_at_rest(now);
        let plain = {
            let mut plain = self.machine.clone();
            plain.hold(now);
            ending(&plain, self.now)
        };
        let (mut stops, mut goes_on) = (false, false);
        match request {
            Request::Push(to, feed) => goes_on = self.machine.push(to, feed, now).is_ok(),
            Request::MoveTo(to, feed) => {
                // A stop, and on from there.
                let under_way = self.machine.due().is_some();
                goes_on = self.machine.move_to(to, feed, now).is_ok();
                if goes_on && under_way && !rest {
                    let mut alone = self.machine.clone();
                    alone.hold(now);
                    // The line to there may have begun, without a step.
                    let end = Ending { rest: 0, ..ending(&alone, self.now) };
                    prop_assert!(
                        end.is_within(plain, 1, self.rounding),
                        "{end:?} of a stop on the way to {to:?}, {plain:?} of a hold"
                    );
                }
            }
            Request::Override(percent) => {
                self.machine.set_override(percent, now);
                self.slowed = percent == 0;
                (stops, goes_on) = (percent == 0, percent > 0);
            }
            Request::Hold => {
                self.machine.hold(now);
                self.held = true;
                stops = true;
            }
            Request::Resume => {
                self.machine.resume(now);
                self.held = false;
                goes_on = true;
            }
            Request::Stop => {
                self.machine.stop(now);
                let end = ending(&self.machine, self.now);
                prop_assert!(rest || end.is_within(plain, 1, self.rounding), "{end:?} of a stop, {plain:?} of a hold");
                stops = true;
            }
            Request::Quick(limits) => {
                let limits = limits.map(|(a, j)| {
                    let limits = Limits::new(1, a).unwrap();
                    if j == 0 { limits } else { limits.with_jerk(j).unwrap() }
                });
                self.machine.quick_stop(limits, now);
                let end = ending(&self.machine, self.now);
                prop_assert!(
                    rest || end.is_within(plain, 1, self.rounding),
                    "{end:?} of a quick stop, {plain:?} of a hold"
                );
                prop_assert!(
                    self.machine.due().is_none() || self.machine.clone().push([0; N], 1000, now).is_err(),
                    "a line in a quick stop"
                );
                stops = true;
                self.hurried = !self.machine.is_at_rest(now);
            }
            Request::Halt => {
                self.machine.halt(now);
                prop_assert!(self.machine.due().is_none() && self.machine.is_empty());
                prop_assert_eq!(self.machine.target(), self.position);
                (self.stop, self.held) = (None, false);
            }
        }
        let goes_on = goes_on && !self.held && !self.slowed;
        if let (Some(stop), true, false) = (self.stop, stops, rest) {
            let end = ending(&self.machine, self.now);
            prop_assert!(end.is_within(stop, 0, self.rounding), "{request:?}: {end:?} after {stop:?}");
        }
        if stops && !rest {
            self.stop = Some(ending(&self.machine, self.now));
        } else if goes_on {
            self.stop = None;
        }
        Ok(())
    }
}

fn clocks() -> impl Strategy<Value = u32> {
    prop_oneof![Just(1000_u32), Just(25_000), Just(1_000_000), Just(72_000_000), Just(200_000_000)]
}

/// How many sequences, and how many in the nightly run.
fn cases() -> u32 {
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(1000)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    #[test]
    fn a_stop_wins_whatever_is_asked(
        hz in clocks(), axes in [axis(), axis()], pauses in [pause(), pause()], deviation in prop_oneof![Just(0), 1..2000_u32],
        requests in prop::collection::vec(
            (request(), spread(1e-6, 0.3e6), prop_oneof![3 => Just(0_i64), 1 => -20_000..20_000_i64]), 1..16),
        target in [-900..900_i64, -900..900_i64],
    ) {
        let mut pauses = pauses.into_iter().map(|us| (us * u64::from(hz) / 1_000_000) as u32);
        let axes = axes.map(|(v, a, j, scale)| {
            let limits = Limits::new((v as u32).min(hz / 2), a as u32).unwrap();
            let limits = if j == 0 { limits } else { limits.with_jerk(j).unwrap() };
            AxisSetup::new(limits, scale as u32)
                .with_soft_limits(-SOFT, SOFT)
                .with_reversal_pause(pauses.next().unwrap())
        });
        let machine = PathMover::new(Path::new(Clock::new(hz).unwrap(), axes, deviation).unwrap());
        let slowest = axes.iter().map(|axis| axis.limits.acceleration()).min().map_or(1.0, f64::from);
        let rounding = 2 + ((2.0 / 65536.0 / slowest).sqrt() * f64::from(hz)) as u64;
        let mut watched = Watched { machine, hz, axes, rounding, now: 0, last: [None; N], position: [0; N], stop: None, held: false, slowed: false, hurried: false };
        for (request, wait_us, skew) in requests {
            watched.tell(request, skew)?;
            // 20 s at most, else a slow path takes for ever.
            let wait = (wait_us * u64::from(hz) / 1_000_000).min(20 * u64::from(hz));
            watched.until(watched.now + wait)?;
        }
        // Afterwards it can be started again, and goes where it is told.
        watched.machine.stop(watched.now);
        let over = 1 << 42;
        watched.until(over)?;
        prop_assert!(watched.machine.is_at_rest(over) && watched.machine.is_empty());
        prop_assert_eq!(watched.machine.target(), watched.position);
        watched.machine.set_override(100, over);
        watched.machine.resume(over);
        watched.machine.push(target, 300_000, over).unwrap();
        while watched.machine.due().is_some() {
            watched.step()?;
        }
        prop_assert_eq!(watched.position, target);
    }
}

/// A step that is due in this tick, at the begin of a ramp: there is no speed to stop from, and the line is not run to its end.
#[test]
fn a_stop_without_speed_and_with_a_step_that_is_due() {
    let [a, b] = [(1860, 2782), (999, 14_826)].map(|(a, scale)| AxisSetup::new(Limits::new(49, a).unwrap(), scale));
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(1000).unwrap(), [a, b], 0).unwrap());
    machine.push([-4, 1], 504, 0).unwrap();
    machine.set_override(1, 357);
    machine.hold(0);
    machine.resume(358);
    assert_eq!((machine.due(), machine.at(358)[0].speed), (Some(358), 0));
    machine.stop(358);
    assert_eq!((machine.due(), machine.is_empty(), machine.target()), (None, true, machine.commanded()));
}

/// There, back and there with a pause, at a clock of 1 MHz.
#[test]
fn an_axis_has_its_pause_where_it_turns_round() {
    let limits = Limits::new(20_000, 2_000_000).unwrap();
    let axis = AxisSetup::new(limits, 80_000);
    for pause in [0, 40, 900, 20_000] {
        let axis = axis.with_reversal_pause(pause);
        let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 2000).unwrap());
        for to in [[800, 0], [400, 300], [800, 600]] {
            machine.push(to, 250_000, 0).unwrap();
        }
        let (mut last, mut turns) = (None::<(u64, Direction)>, 0);
        while let Some(pulse) = machine.pulse() {
            if pulse.axis == 0 {
                if let Some((tick, _)) = last.filter(|(_, way)| *way != pulse.direction) {
                    assert!(pulse.tick - tick + 1 >= u64::from(pause), "{} of {pause}", pulse.tick - tick);
                    turns += 1;
                }
                last = Some((pulse.tick, pulse.direction));
            }
        }
        assert_eq!((machine.commanded(), turns), ([800, 600], 2));
    }
}

/// A corner is as slow as a pause takes, not slower: one of 40 us costs no rest.
#[test]
fn a_short_pause_does_not_stop_at_a_corner() {
    let limits = Limits::new(20_000, 200_000).unwrap();
    let over = |pause| {
        let axis = AxisSetup::new(limits, 80_000).with_reversal_pause(pause);
        let mut path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
        for to in [[40, 800], [0, 1600]] {
            path.push(to, 100_000).unwrap();
        }
        let mut end = 0;
        while let Some(line) = path.next_line() {
            end = line.end();
        }
        end
    };
    let [none, short, long] = [0, 40, 20_000].map(over);
    assert!(none <= short && short < none + none / 100 && long >= none + 20_000, "{none} {short} {long}");
}

/// From 8000 steps/s a stop at 20,000 steps/s² takes 1600 steps, a quick one at 400,000 takes 80; also from within the stop.
#[test]
fn a_quick_stop_of_a_path_is_quick() {
    let axis = AxisSetup::new(Limits::new(8000, 20_000).unwrap(), 80_000);
    let quick = [Limits::new(1, 400_000).unwrap(); 2];
    for stops_before in [false, true] {
        let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 2000).unwrap());
        machine.push([8000, 0], 100_000, 0).unwrap();
        machine.push([8000, 4000], 100_000, 0).unwrap();
        let mut now = 0;
        while machine.commanded() != [4000, 0] {
            now = machine.pulse().unwrap().tick;
        }
        if stops_before {
            machine.stop(now);
        }
        machine.quick_stop(quick, now);
        assert_eq!(machine.push([0, 0], 1000, now), Err(Error::Moving));
        while machine.pulse().is_some() {}
        let [x, y] = machine.commanded();
        assert!((4078..=4083).contains(&x) && y == 0, "{x} {y}");
        machine.push([0, 0], 100_000, now + 10_000_000).unwrap();
        while machine.pulse().is_some() {}
        assert_eq!(machine.commanded(), [0, 0]);
    }
}

#[test]
fn soft_limits_of_a_path_refuse_and_change_nothing() {
    let axis = AxisSetup::new(Limits::new(8000, 20_000).unwrap(), 80_000);
    let axes = [axis.with_soft_limits(-10, 500), axis];
    let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, axes, 20).unwrap());
    machine.push([500, 9000], 100_000, 0).unwrap();
    assert_eq!(machine.push([501, 0], 100_000, 0), Err(Error::SoftLimit { target: 501 }));
    let due = machine.due();
    assert_eq!(machine.move_to([-11, 0], 100_000, 0), Err(Error::SoftLimit { target: -11 }));
    assert_eq!((machine.due(), machine.target(), machine.len()), (due, [500, 9000], 1));
    machine.push([-10, 0], 100_000, 0).unwrap();
}
/// A stop while the acceleration fades, with a line behind that allows less jerk: with that the speed would rise above the limit.
#[test]
fn a_stop_takes_no_jerk_of_lines_that_it_does_not_reach() {
    let first = Limits::new(4256, 9321).unwrap().with_jerk(46_714).unwrap();
    let axes = [AxisSetup::new(first, 20_466), AxisSetup::new(Limits::new(49, 1_351_593).unwrap(), 19_416)];
    let mut machine = PathMover::new(Path::<2, 4>::new(Clock::MICROSECONDS, axes, 134).unwrap());
    machine.push([501, -427], 77_725, 4921).unwrap();
    machine.push([-651, 0], 10, 4921).unwrap();
    while machine.due().is_some_and(|due| due <= 63_376) {
        machine.pulse();
    }
    machine.stop(63_376);
    let mut last = 0;
    while let Some(pulse) = machine.pulse() {
        if pulse.axis == 1 {
            assert!(last == 0 || pulse.tick - last >= 20_407, "{} ticks at {last}", pulse.tick - last);
            last = pulse.tick;
        }
    }
    assert!(last > 90_000);
}

/// Held, and told of a new target by a clock that is ahead: the rest has begun when it has.
#[test]
fn a_clock_that_is_ahead_does_not_make_a_rest_later() {
    let setup = |a, j, scale| AxisSetup::new(Limits::new(49, a).unwrap().with_jerk(j).unwrap(), scale);
    let axes = [setup(3_516_624, 13_436_394, 45_028), setup(999, 1_000_000, 115_549)];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(1000).unwrap(), axes, 0).unwrap());
    machine.push([-475, 0], 102, 0).unwrap();
    machine.set_override(66, 0);
    machine.set_override(0, 165);
    machine.hold(0);
    machine.move_to([0, 0], 10, 169).unwrap();
    machine.stop(0);
    assert!(machine.due().is_none() && machine.is_at_rest(168));
}

/// A line of a step, and one behind it that allows less where the axes use more: a stop that ends on the first one has nothing to do with that.
#[test]
fn a_quick_stop_is_no_later_for_a_line_that_it_does_not_reach() {
    let limits = |a, j| Limits::new(49, a).unwrap().with_jerk(j).unwrap();
    let axes =
        [AxisSetup::new(limits(115_833, 185_103), 4623), AxisSetup::new(Limits::new(49, 137_593).unwrap(), 147_013)];
    let rest = |quick: bool| {
        let mut machine = PathMover::new(Path::<2, 4>::new(Clock::MICROSECONDS, axes, 4).unwrap());
        machine.push([-1, 5], 3198, 0).unwrap();
        machine.push([136, 47], 10, 1).unwrap();
        while machine.due().is_some_and(|due| due <= 21_183) {
            machine.pulse();
        }
        if quick {
            machine.quick_stop([limits(999, 10_000), Limits::new(1, 8_187_864).unwrap()], 21_183);
        } else {
            machine.hold(21_183);
        }
        while machine.pulse().is_some() {}
        (21_183..100_000).find(|now| machine.is_at_rest(*now)).unwrap()
    };
    assert!(rest(true) <= rest(false) + 18, "{} {}", rest(true), rest(false));
}

/// A stop on the way to another target, six lines of which are short.
#[test]
fn a_stop_on_the_way_takes_no_more_steps_than_a_hold() {
    let limits = |v, a| Limits::new(v, a).unwrap();
    let axes = [
        AxisSetup::new(limits(140, 1_235_741).with_jerk(586_848).unwrap(), 93_704),
        AxisSetup::new(limits(1047, 5_637_619), 367_017),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(25_000).unwrap(), axes, 2).unwrap());
    machine.move_to([-3, 0], 8106, 0).unwrap();
    machine.push([89, -57], 96_641, 0).unwrap();
    machine.resume(0);
    machine.set_override(19, 431);
    let steps = |mut machine: Machine| {
        let mut steps = [0; 2];
        while let Some(pulse) = machine.pulse() {
            steps[usize::from(pulse.axis)] += 1;
        }
        steps
    };
    let mut held = machine.clone();
    held.hold(0);
    machine.move_to([-10, 0], 10, 0).unwrap();
    machine.hold(0);
    let (stop, hold) = (steps(machine), steps(held));
    assert!(stop[0] <= hold[0] + 1, "{stop:?} {hold:?}");
}

/// Stopped just before the end of a line, and sent back: the axis that turns has its pause.
#[test]
fn a_line_behind_a_stop_has_the_pause_of_an_axis_that_turns() {
    let axes = [
        AxisSetup::new(Limits::new(35_951, 11_103).unwrap(), 453_393).with_reversal_pause(20_778),
        AxisSetup::new(Limits::new(13_234, 39_387).unwrap().with_jerk(18_677_251).unwrap(), 137_084),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::MICROSECONDS, axes, 0).unwrap());
    machine.set_override(176, 0);
    machine.move_to([168, 73], 5617, 1).unwrap();
    let (mut last, mut turned) = ([None::<(u64, Direction)>; 2], 0);
    let mut take = |machine: &mut Machine, until: u64| {
        while machine.due().is_some_and(|due| due <= until) {
            let pulse = machine.pulse().unwrap();
            let before = last[usize::from(pulse.axis)].replace((pulse.tick, pulse.direction));
            if let Some((tick, _)) = before.filter(|(_, way)| pulse.axis == 0 && *way != pulse.direction) {
                assert!(pulse.tick - tick + 2 >= 20_778, "{tick} {}", pulse.tick - tick);
                turned += 1;
            }
        }
    };
    take(&mut machine, 249_518);
    machine.push([0, 0], 10, 249_518).unwrap();
    take(&mut machine, 249_519);
    machine.stop(249_519);
    take(&mut machine, 249_520);
    machine.push([0, 0], 970, 249_520).unwrap();
    take(&mut machine, u64::MAX);
    assert_eq!((machine.commanded(), turned), ([0, 0], 1));
}

/// A quick stop ends on the step before the place where a hold ends.
#[test]
fn a_quick_stop_of_a_short_line_takes_no_more_steps_than_a_hold() {
    let axes = [
        AxisSetup::new(Limits::new(125, 17_614).unwrap().with_jerk(83_599).unwrap(), 6473).with_reversal_pause(11_904),
        AxisSetup::new(Limits::new(1349, 948_950).unwrap(), 55_765),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::MICROSECONDS, axes, 1).unwrap());
    machine.push([-3, 0], 41_268, 0).unwrap();
    machine.push([-51, 3], 40_102, 1).unwrap();
    while machine.due().is_some_and(|due| due <= 38_923) {
        machine.pulse();
    }
    let steps = |mut machine: Machine| {
        let mut steps = [0; 2];
        while let Some(pulse) = machine.pulse() {
            steps[usize::from(pulse.axis)] += 1;
        }
        (steps, (38_923..1_000_000).find(|now| machine.is_at_rest(*now)).unwrap())
    };
    let mut held = machine.clone();
    held.hold(38_923);
    let quick = Limits::new(1, 54_426_867).unwrap().with_jerk(10_000).unwrap();
    machine.quick_stop([quick, Limits::new(1, 999).unwrap()], 38_923);
    let (quick, hold) = (steps(machine), steps(held));
    assert!(quick.0[0] <= hold.0[0] && quick.1 <= hold.1 + 2, "{quick:?} {hold:?}");
}

/// A stop that crosses a corner is not later than a hold that does.
#[test]
fn a_stop_over_a_corner_is_not_later_than_a_hold() {
    let axes = [
        AxisSetup::new(Limits::new(49, 999).unwrap(), 999),
        AxisSetup::new(Limits::new(49, 999).unwrap().with_jerk(13_369).unwrap(), 58_577),
    ];
    let mut machine = PathMover::new(Path::<2, 5>::new(Clock::new(1000).unwrap(), axes, 5).unwrap());
    machine.push([1, -3], 50_188, 0).unwrap();
    machine.push([156, 0], 3745, 0).unwrap();
    machine.set_override(172, 0);
    while machine.due().is_some_and(|due| due <= 58) {
        machine.pulse();
    }
    let rest = |mut machine: Machine| {
        while machine.pulse().is_some() {}
        (machine.commanded(), (58..10_000).find(|now| machine.is_at_rest(*now)).unwrap())
    };
    let mut held = machine.clone();
    held.hold(58);
    machine.stop(58);
    let hold = rest(held);
    let stop = rest(machine);
    assert!(stop.0 == hold.0 && stop.1 <= hold.1 + 7, "{stop:?} {hold:?}");
}
