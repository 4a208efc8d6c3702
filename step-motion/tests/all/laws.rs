//! The laws of a stop over all requests to an axis, at any moment, any clock and any limits. What is looked at are the steps.

use proptest::prelude::*;
use step_motion::{Clock, Direction, Error, Limits, Mover};

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

fn limits(speed: u32, acceleration: u32, jerk: u64) -> Limits {
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
    assert_eq!(mover.turn(), Some(60_000_u64.midpoint(due)));
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
