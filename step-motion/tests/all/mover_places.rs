//! `Mover::at` for a cyclic master: a place that does not jump, whatever is asked for.

use proptest::prelude::*;
use step_motion::{Clock, Direction, Limits, Mover, Setpoint};

use crate::looks::Watched;

const ONE: f64 = 4_294_967_296.0;

/// An axis whose user looks where it is, and where it was when the user last looked.
struct Seen {
    mover: Mover,
    hz: f64,
    speed: f64,
    /// The greatest acceleration so far, of a quick stop too.
    acceleration: f64,
    now: u64,
    last: (u64, i64),
    /// Where its places are counted from.
    from: i64,
}

impl Watched for Seen {
    fn due(&self) -> Option<u64> {
        self.mover.due()
    }

    fn pulse(&mut self) {
        self.mover.pulse();
    }

    fn now(&mut self) -> &mut u64 {
        &mut self.now
    }

    /// The axis has gone no further since then than its speed allows: half of a tick of rounding, and 2^-13 steps. And it is within half
    /// a step of what was made.
    fn look(&mut self) {
        let there = self.mover.at(self.now);
        let (then, before) = self.last;
        let way = there.position.wrapping_sub(before).abs() as f64 / ONE;
        let most = self.speed * ((self.now - then) as f64 + 0.5) / self.hz + 1.0 / 8192.0;
        assert!(way <= most, "it goes {way} from {then} to {}, {most} at the most", self.now);
        let speed = there.speed.abs() as f64 / 65_536.0;
        assert!(speed <= self.speed * 1.0001 + 0.01, "{speed} steps/s at {}", self.now);
        let off = there.position.wrapping_sub(self.mover.commanded() << 32).abs() as f64 / ONE;
        let most = 0.5 + self.speed / self.hz + 1.0 / 8192.0;
        assert!(off <= most, "it is {off} off at {}, {most} at the most", self.now);
        self.last = (self.now, there.position);
    }
}

impl Seen {
    fn new(hz: u32, limits: Limits) -> Self {
        let mover = Mover::new(Clock::new(hz).unwrap(), limits).unwrap();
        let (speed, acceleration) = (limits.speed().into(), limits.acceleration().into());
        Self { mover, hz: hz.into(), speed, acceleration, now: 0, last: (0, 0), from: 0 }
    }

    /// At a request position and speed are those before it, unless it is a halt or the axis comes to rest within a tick.
    fn ask(&mut self, ask: Request) {
        let before = self.mover.at(self.now);
        let (mover, now) = (&mut self.mover, self.now);
        match ask {
            Request::MoveTo(to) => _ = mover.move_to(self.from + to, now),
            Request::Run(direction, speed) => _ = mover.run(direction, speed, now),
            Request::Override(percent) => mover.set_override(percent, now),
            Request::Hold => mover.hold(now),
            Request::Resume => mover.resume(now),
            Request::Stop => mover.stop(now),
            Request::Quick(a) => {
                mover.quick_stop(Limits::new(1, a).unwrap(), now);
                self.acceleration = self.acceleration.max(a.into());
            }
            Request::Halt => mover.halt(now),
            Request::Number(steps) => {
                let (steps, before) = (self.from + steps, mover.commanded());
                if mover.set_commanded(steps, now).is_ok() {
                    self.last.1 = self.last.1.wrapping_add((steps - before) << 32);
                }
            }
            Request::Slower => _ = mover.set_limits(mover.limits().with_speed(1).unwrap(), now),
        }
        self.look();
        let after = self.mover.at(self.now);
        let off = (after.speed - before.speed).abs() as f64 / 65_536.0;
        let over = before.speed.abs() as f64 / 65_536.0 <= self.acceleration / self.hz;
        assert!(
            over || matches!(ask, Request::Halt) || off <= self.speed / 1000.0 + 0.01,
            "{before} to {after} at {now} by {ask:?}"
        );
    }
}

#[derive(Debug, Clone, Copy)]
enum Request {
    MoveTo(i64),
    Run(Direction, u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
    Quick(u32),
    Halt,
    Number(i64),
    Slower,
}

fn ask() -> impl Strategy<Value = Request> {
    let way = prop_oneof![Just(Direction::Forward), Just(Direction::Reverse)];
    prop_oneof![
        6 => prop_oneof![-60..60_i64, -3..3_i64].prop_map(Request::MoveTo),
        4 => (way, prop_oneof![0..4_u32, 1..20_000_u32]).prop_map(|(way, speed)| Request::Run(way, speed)),
        3 => (0..150_u16).prop_map(Request::Override),
        3 => Just(Request::Hold),
        4 => Just(Request::Resume),
        2 => Just(Request::Stop),
        2 => prop_oneof![1..200_000_u32, 1_000_000..2_000_000_u32].prop_map(Request::Quick),
        1 => Just(Request::Halt),
        1 => (-50..50_i64).prop_map(Request::Number),
        1 => Just(Request::Slower),
    ]
}

fn limits() -> impl Strategy<Value = Limits> {
    let jerk = prop_oneof![Just(None), (1000..100_000_000_u64).prop_map(Some)];
    let speed = prop_oneof![1..20_000_u32, 1..4_u32];
    (speed, 1..400_000_u32, jerk).prop_map(|(v, a, j)| {
        let limits = Limits::new(v, a).unwrap();
        j.map_or(limits, |j| limits.with_jerk(j).unwrap())
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 4 * ProptestConfig::default().cases, ..ProptestConfig::default() })]

    #[test]
    fn a_place_does_not_jump(
        hz in prop_oneof![Just(1_000_000_u32), 100_000..72_000_000_u32], limits in limits(),
        pause in prop_oneof![Just(0_u32), 0..10_000_u32],
        asks in prop::collection::vec((ask(), prop_oneof![0..3_000_u64, 0..300_000_u64]), 1..20),
        from in prop_oneof![2 => Just(0), 1 => Just(1 << 31), 1 => Just(-(1 << 31)), 1 => Just(5 << 32), 1 => Just(1 << 62)],
    ) {
        let mut seen = Seen::new(hz, limits);
        seen.mover = seen.mover.with_reversal_pause(pause);
        seen.from = from;
        seen.ask(Request::Number(0));
        for (ask, micros) in asks {
            seen.ask(ask);
            seen.until(seen.now + micros * u64::from(hz) / 1_000_000);
        }
    }
}

/// 20,000 steps/s and 200,000 steps/s², in ticks of 1 µs.
fn mover() -> Mover {
    Mover::new(Clock::MICROSECONDS, Limits::new(20_000, 200_000).unwrap()).unwrap()
}

/// Takes a number of steps; returns the tick of the last one.
fn take(mover: &mut Mover, steps: u32) -> u64 {
    (0..steps).map(|_| mover.pulse().unwrap().tick).last().unwrap()
}

/// A stop in each twentieth of an interval comes to rest between two steps, up to half a step from the last one, and goes on to that in
/// 25 µs: 0.02 steps each.
#[test]
fn a_stop_between_two_steps_goes_on_to_the_last_one() {
    let mut most = 0.0_f64;
    for wait in 0..20 {
        let mut mover = mover();
        mover.move_to(5000, 0).unwrap();
        let mut now = take(&mut mover, 300);
        mover.stop(now + 5 * wait);
        while let Some(pulse) = mover.pulse() {
            now = pulse.tick;
        }
        let rest = (now..now + 5000).find(|now| mover.is_at_rest(*now)).unwrap();
        let off = |now| (mover.at(now).position as f64 / ONE - mover.commanded() as f64).abs();
        most = most.max(off(rest));
        for now in rest - 100..rest + 30 {
            let way = (mover.at(now + 1).position - mover.at(now).position).abs() as f64 / ONE;
            assert!(way < 0.0201, "{way} at {now} after {wait}");
        }
        assert!(off(rest + 26) == 0.0 && mover.at(rest + 26).speed == 0, "after {wait}");
    }
    assert!((0.3..0.51).contains(&most), "{most}");
}

/// At 300 steps/s, 200 µs after a step, and told to go back: it comes to rest without another step.
#[test]
fn a_turn_without_a_step_begins_as_it_goes() {
    let turns: [fn(&mut Mover, u64); 2] =
        [|mover, now| mover.run(Direction::Reverse, 300, now).unwrap(), |mover, now| mover.move_to(-5, now).unwrap()];
    for (jerk, ask) in [None, Some(1_000_000_000)].into_iter().flat_map(|jerk| turns.map(|ask| (jerk, ask))) {
        let mut mover = mover();
        if let Some(jerk) = jerk {
            mover.set_limits(mover.limits().with_jerk(jerk).unwrap(), 0).unwrap();
        }
        mover.run(Direction::Forward, 300, 0).unwrap();
        let now = take(&mut mover, 20) + 200;
        ask(&mut mover, now);
        let Setpoint { position, speed, .. } = mover.at(now);
        // 19.5 steps and 200 µs of 300 steps/s, each within 1/500.
        assert!((position as f64 / ONE - 19.56).abs() < 0.002, "{position}");
        assert!((speed as f64 / 65_536.0 - 300.0).abs() < 0.6, "{speed}");
        let mut last = position;
        for now in now..mover.due().unwrap() {
            let there = mover.at(now);
            assert!((there.position - last).abs() as f64 / ONE < 0.0201, "{there} at {now}");
            last = there.position;
        }
        take(&mut mover, 1);
        assert_eq!(mover.commanded(), 19);
    }
}
