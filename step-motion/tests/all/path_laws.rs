//! The laws of a stop over all requests to a path, at any moment, any clock and any limits. What is looked at are the steps.

mod cases;

use proptest::prelude::*;
use step_motion::{AxisSetup, Clock, Direction, Error, Limits, Path, PathMover};

const N: usize = 2;
type Machine = PathMover<N, 5>;

#[derive(Debug, Clone, Copy)]
enum Request {
    Push([i64; N], u32),
    /// On from the target, by so many steps.
    On([i64; N], u32),
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
        6 => (20..300_i64, prop_oneof![Just(0), -9..9_i64], prop_oneof![3 => Just(300_000), 1 => feed()])
            .prop_map(|(x, y, feed)| Request::On([x, y], feed)),
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
    /// Ticks between the last two steps of each axis since a rest, in one direction.
    gaps: [Option<u64>; N],
    /// A quick stop was asked for since then.
    harder: bool,
    /// In µm.
    deviation: u32,
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
            for (i, gap) in self.gaps.into_iter().enumerate() {
                if let Some(gap) = gap.filter(|_| !self.harder) {
                    self.came_to_rest(i, gap)?;
                }
            }
            (self.gaps, self.harder) = ([None; N], false);
        }
        Ok(())
    }

    /// The last step is half a step before the rest, the one before it no more than twice that farther off; and at a corner an axis's
    /// speed changes at once by no more than the deviation allows: (8 a d)^(1/2). Less than 1.4 mrad is no corner; a path has 0.75 m/s at
    /// most.
    fn came_to_rest(&self, i: usize, gap: u64) -> Result<(), TestCaseError> {
        let axis = &self.axes[i];
        let a = f64::from(axis.limits.acceleration());
        let deviation = f64::from(self.deviation) * 1e-6 * f64::from(axis.steps_per_m);
        let straight = 1.4e-3 * 0.75 * f64::from(axis.steps_per_m);
        let fastest = (3.0 * a).sqrt() + (8.0 * a * deviation).sqrt() + straight;
        let speed = f64::from(self.hz) / (gap + 1) as f64;
        prop_assert!(speed <= fastest * 1.01, "axis {i} at rest from {speed} steps/s, {fastest} at most");
        Ok(())
    }

    fn step(&mut self) -> Result<(), TestCaseError> {
        let pulse = self.machine.pulse().unwrap();
        let i = usize::from(pulse.axis);
        self.position[i] = pulse.direction.advance(self.position[i]);
        prop_assert_eq!(self.machine.commanded(), self.position);
        prop_assert!(pulse.tick >= self.now || self.last.iter().flatten().all(|(last, _)| pulse.tick >= *last));
        prop_assert!(self.position[i].abs() <= SOFT, "axis {i} at {}", self.position[i]);
        self.gaps[i] = None;
        if let Some((last, before)) = self.last[i] {
            self.gaps[i] = (before == pulse.direction).then(|| pulse.tick - last);
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
            Request::On(by, feed) => {
                let target = self.machine.target();
                goes_on = self.machine.push([target[0] + by[0], target[1] + by[1]], feed, now).is_ok();
            }
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
                self.harder = true;
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
                (self.stop, self.held, self.gaps) = (None, false, [None; N]);
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
        let mut watched = Watched { machine, hz, axes, rounding, now: 0, last: [None; N], gaps: [None; N], harder: false, deviation, position: [0; N], stop: None, held: false, slowed: false, hurried: false };
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
