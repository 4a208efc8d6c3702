//! The laws of a stop over all requests to an axis, at any moment, any clock and any limits. What is looked at are the steps.

use proptest::prelude::*;
use step_motion::{Clock, Direction, Limits, Mover};

#[derive(Debug, Clone, Copy)]
enum Request {
    MoveTo(i64),
    Run(Direction, u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
    Quick { acceleration: u32, jerk: u64 },
    Halt,
    SetCommanded(i64),
}

fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        4 => (LOW..=HIGH).prop_map(Request::MoveTo),
        3 => (any::<bool>(), 0..300_000_u32).prop_map(|(back, speed)| Request::Run(way(back), speed)),
        2 => (0..=120_u16).prop_map(Request::Override),
        2 => Just(Request::Hold),
        2 => Just(Request::Resume),
        2 => Just(Request::Stop),
        3 => (acceleration(), jerk()).prop_map(|(acceleration, jerk)| Request::Quick { acceleration, jerk }),
        1 => Just(Request::Halt),
        1 => (LOW..=HIGH).prop_map(Request::SetCommanded),
    ]
}

fn way(back: bool) -> Direction {
    if back { Direction::Reverse } else { Direction::Forward }
}

/// Spread over the decades.
fn spread(low: f64, high: f64) -> impl Strategy<Value = u64> {
    (low.ln()..high.ln()).prop_map(|x| x.exp() as u64)
}

fn acceleration() -> impl Strategy<Value = u32> {
    spread(1e3, 1e8).prop_map(|a| a as u32)
}

/// 0: not limited.
fn jerk() -> impl Strategy<Value = u64> {
    prop_oneof![2 => Just(0), 5 => spread(1e4, 1e12)]
}

pub(crate) fn limits(speed: u32, acceleration: u32, jerk: u64) -> Limits {
    let limits = Limits::new(speed, acceleration).unwrap();
    if jerk == 0 { limits } else { limits.with_jerk(jerk).unwrap() }
}

const LOW: i64 = -2000;
const HIGH: i64 = 3000;

/// How the steps that are left end, if nothing else is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ending {
    /// Steps to come, the first tick at rest, and the least ticks between two steps.
    steps: u64,
    rest: u64,
    least: u64,
}

fn ending(mover: &Mover, before: u64) -> Ending {
    let (mut mover, mut last) = (mover.clone(), before);
    let mut end = Ending { steps: 0, rest: 0, least: u64::MAX };
    while let Some(pulse) = mover.pulse() {
        end.steps += 1;
        assert!(end.steps < 100_000, "the stop does not end");
        end.least = end.least.min(pulse.tick.saturating_sub(last));
        last = pulse.tick;
    }
    let (mut low, mut high) = (last, 1 << 42);
    while low < high {
        let middle = low.midpoint(high);
        if mover.is_at_rest(middle) { high = middle } else { low = middle + 1 }
    }
    Ending { rest: low, ..end }
}

impl Ending {
    /// Not longer, not later, not faster; a tick is what rounding may cost.
    fn is_within(self, other: Self) -> bool {
        self.steps <= other.steps && self.rest <= other.rest + 1 && self.least.saturating_add(1) >= other.least
    }
}

struct Watched {
    mover: Mover,
    hz: u32,
    limits: Limits,
    pause: u32,
    now: u64,
    /// The last step: when and which way.
    last: Option<(u64, Direction)>,
    position: i64,
    /// The stop that is under way, and whether it is a quick one, with what it may use.
    stop: Option<Ending>,
    quick: Option<Limits>,
}

impl Watched {
    fn new(hz: u32, limits: Limits, pause: u32) -> Self {
        let mover = Mover::new(Clock::new(hz).unwrap(), limits).unwrap();
        let mover = mover.with_soft_limits(LOW, HIGH).with_reversal_pause(pause);
        Self { mover, hz, limits, pause, now: 0, last: None, position: 0, stop: None, quick: None }
    }

    fn last_tick(&self) -> u64 {
        self.last.map_or(0, |(tick, _)| tick)
    }

    fn until(&mut self, time: u64) -> Result<(), TestCaseError> {
        while self.mover.due().is_some_and(|due| due <= time) {
            self.step()?;
        }
        self.now = self.now.max(time);
        if self.mover.is_at_rest(self.now) {
            (self.stop, self.quick) = (None, None);
        }
        Ok(())
    }

    fn step(&mut self) -> Result<(), TestCaseError> {
        let turn = self.mover.turn();
        let pulse = self.mover.pulse().unwrap();
        self.position = if pulse.direction.dir() { self.position - 1 } else { self.position + 1 };
        prop_assert_eq!(self.mover.commanded(), self.position);
        prop_assert!((LOW..=HIGH).contains(&self.position), "soft limits");
        if let Some((last, direction)) = self.last {
            prop_assert!(pulse.tick > last, "{} after {last}", pulse.tick);
            let gap = pulse.tick - last;
            if direction == pulse.direction {
                let least = u64::from(self.hz) / u64::from(self.limits.speed());
                prop_assert!(gap + 1 >= least, "{gap} ticks, {least} are the fastest: {:?}", self.mover.at(pulse.tick));
            } else {
                prop_assert!(gap >= u64::from(self.pause), "{gap} ticks of rest");
                let turn = turn.unwrap();
                let half = (gap.min(u64::from(self.pause)) / 2).max(u64::from(gap > 1));
                prop_assert!(turn >= last + half && turn + half <= pulse.tick, "{last} {turn} {}", pulse.tick);
            }
        } else if pulse.direction.dir() {
            prop_assert!(turn.is_some(), "DIR is low at first");
        }
        let state = self.mover.at(pulse.tick);
        let (mut a, mut j) = (self.limits.acceleration(), self.limits.jerk());
        if let Some(quick) = self.quick {
            a = a.max(quick.acceleration());
            j = j.zip(quick.jerk()).map(|(j, quick)| j.max(quick));
        }
        // Per mille, and what a tick changes.
        let most = |limit: f64, per: f64| limit * 1.005 + per / f64::from(self.hz) + 2.0;
        let size = |x: i64| x.abs() as f64 / 65536.0;
        prop_assert!(size(state.acceleration) <= most(a.into(), 0.0), "{state} of {a}");
        if let Some(j) = j {
            prop_assert!(size(state.jerk) <= most(j as f64, 0.0), "{} of {j}", size(state.jerk));
        }
        self.last = Some((pulse.tick, pulse.direction));
        self.now = self.now.max(pulse.tick);
        Ok(())
    }

    /// `skew`: how wrong the caller's clock is.
    fn tell(&mut self, request: Request, skew: i64) -> Result<(), TestCaseError> {
        let now = self.now.saturating_add_signed(skew);
        let rest = self.mover.is_at_rest(now);
        if rest {
            (self.stop, self.quick) = (None, None);
        }
        let plain = {
            let mut plain = self.mover.clone();
            plain.stop(now);
            ending(&plain, self.last_tick())
        };
        let mut goes_on = false;
        let mut stops = false;
        match request {
            Request::MoveTo(target) => goes_on = self.mover.move_to(target, now).is_ok(),
            Request::Run(direction, speed) => {
                let done = self.mover.run(direction, speed, now).is_ok();
                (goes_on, stops) = (done && speed > 0, done && speed == 0);
            }
            Request::Override(percent) => {
                self.mover.set_override(percent, now);
                (goes_on, stops) = (percent > 0, percent == 0);
            }
            Request::Hold => {
                self.mover.hold(now);
                stops = true;
            }
            Request::Resume => {
                self.mover.resume(now);
                goes_on = true;
            }
            Request::Stop => {
                self.mover.stop(now);
                stops = true;
            }
            Request::Quick { acceleration, jerk } => {
                let quick = limits(self.limits.speed(), acceleration, jerk);
                self.mover.quick_stop(quick, now);
                let end = ending(&self.mover, self.last_tick());
                prop_assert!(end.is_within(plain), "{request:?}: {end:?}, a plain stop {plain:?}");
                stops = true;
                if !rest {
                    self.quick = Some(self.quick.map_or(quick, |old| {
                        let a = old.acceleration().max(acceleration);
                        limits(quick.speed(), a, old.jerk().zip(quick.jerk()).map_or(0, |(a, b)| a.max(b)))
                    }));
                }
            }
            Request::Halt => {
                self.mover.halt(now);
                prop_assert_eq!(self.mover.due(), None);
                (self.stop, self.quick) = (None, None);
            }
            Request::SetCommanded(steps) => {
                let done = self.mover.set_commanded(steps, now);
                prop_assert_eq!(done.is_ok(), self.mover.is_at_rest(now));
                if done.is_ok() {
                    self.position = steps;
                }
            }
        }
        if let (Some(stop), false) = (self.stop, rest) {
            if self.quick.is_some() || stops {
                let end = ending(&self.mover, self.last_tick());
                prop_assert!(end.is_within(stop), "{request:?}: {end:?} after {stop:?}");
            }
        }
        if stops && !rest {
            self.stop = Some(ending(&self.mover, self.last_tick()));
        } else if goes_on && self.quick.is_none() {
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
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(1500)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    #[test]
    fn a_stop_wins_whatever_is_asked(
        hz in clocks(),
        speed in spread(20.0, 2e5),
        a in acceleration(),
        j in jerk(),
        pause in 0..2000_u32,
        requests in prop::collection::vec((request(), spread(1e-6, 0.3e6), prop_oneof![3 => Just(0_i64), 1 => -20_000..20_000_i64]), 1..14),
        target in LOW..=HIGH,
    ) {
        let speed = (speed as u32).min(hz / 2);
        let pause = u32::try_from(u64::from(pause) * u64::from(hz) / 1_000_000).unwrap();
        let mut watched = Watched::new(hz, limits(speed, a, j), pause);
        for (request, wait_us, skew) in requests {
            watched.tell(request, skew)?;
            // 20 s at most, else a slow axis takes for ever.
            let wait = (wait_us * u64::from(hz) / 1_000_000).min(20 * u64::from(hz));
            watched.until(watched.now + wait)?;
        }
        // Afterwards it can be started again, and goes where it is told.
        watched.mover.stop(watched.now);
        let over = 1 << 40;
        watched.until(over)?;
        prop_assert!(watched.mover.is_at_rest(over));
        watched.mover.set_override(100, over);
        watched.mover.resume(over);
        watched.mover.move_to(target, over).unwrap();
        while watched.mover.due().is_some() {
            watched.step()?;
        }
        prop_assert_eq!(watched.position, target);
    }
}
