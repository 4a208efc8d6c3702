//! `PathMover::at` for a cyclic master: a place that does not jump, whatever is asked for.

use proptest::prelude::*;
use step_motion::{AxisSetup, Clock, Limits, Path, PathMover};

use crate::looks::Watched;
use crate::path_queue::Request;

const N: usize = 2;

/// A machine whose user looks where it is, and where it was when the user last looked.
struct Seen {
    machine: PathMover<N, 6>,
    hz: f64,
    speeds: [f64; N],
    now: u64,
    last: (u64, [i64; N]),
    looks: u32,
    /// Where its places are counted from.
    from: i64,
}

impl Watched for Seen {
    fn due(&self) -> Option<u64> {
        self.machine.due()
    }

    fn pulse(&mut self) {
        self.machine.pulse();
    }

    fn now(&mut self) -> &mut u64 {
        &mut self.now
    }

    /// No axis has gone further since then than its speed allows: half of a tick of rounding, and 2^-13 steps. And it is within half
    /// a step of what was made.
    fn look(&mut self) {
        let there = self.machine.at(self.now).map(|state| state.position);
        let (then, before) = self.last;
        for axis in 0..N {
            let way = there[axis].wrapping_sub(before[axis]).abs() as f64 / 2_f64.powi(32);
            let most = self.speeds[axis] * ((self.now - then) as f64 + 0.5) / self.hz + 1.0 / 8192.0;
            assert!(way <= most, "axis {axis} goes {way} from {then} to {}, {most} at the most", self.now);
            let off = there[axis].wrapping_sub(self.machine.commanded()[axis] << 32).abs() as f64 / 2_f64.powi(32);
            let most = 0.5 + self.speeds[axis] / self.hz + 1.0 / 8192.0;
            assert!(off <= most, "axis {axis} is {off} off at {}, {most} at the most", self.now);
        }
        (self.last, self.looks) = ((self.now, there), self.looks + 1);
    }
}

impl Seen {
    fn new(hz: u32, limits: [Limits; N]) -> Self {
        let axes = [AxisSetup::new(limits[0], 80_000), AxisSetup::new(limits[1], 50_000)];
        let machine = PathMover::new(Path::new(Clock::new(hz).unwrap(), axes, 50).unwrap());
        let speeds = limits.map(|limits| limits.speed().into());
        Self { machine, hz: hz.into(), speeds, now: 0, last: (0, [0; N]), looks: 0, from: 0 }
    }

    fn ask(&mut self, ask: Request<N>) {
        let (machine, now) = (&mut self.machine, self.now);
        let there = |to: [i64; N]| to.map(|to| self.from + to);
        match ask {
            Request::Push(to, feed) => _ = machine.push(there(to), feed, now),
            Request::MoveTo(to, feed) => _ = machine.move_to(there(to), feed, now),
            Request::Override(percent) => machine.set_override(percent, now),
            Request::Hold => machine.hold(now),
            Request::Resume => machine.resume(now),
            Request::Stop => machine.stop(now),
            Request::Quick(a) => machine.quick_stop([Limits::new(1, a).unwrap(); N], now),
            Request::Halt => machine.halt(now),
        }
        self.look();
    }
}

fn place() -> impl Strategy<Value = [i64; N]> {
    prop_oneof![[-60..60_i64, -60..60_i64], [-3..3_i64, -3..3_i64]]
}

fn ask() -> impl Strategy<Value = Request<N>> {
    let feed = prop_oneof![1000..300_000_u32, 10..1000_u32];
    prop_oneof![
        6 => (place(), feed.clone()).prop_map(|(to, feed)| Request::Push(to, feed)),
        2 => (place(), feed).prop_map(|(to, feed)| Request::MoveTo(to, feed)),
        3 => (0..150_u16).prop_map(Request::Override),
        3 => Just(Request::Hold),
        4 => Just(Request::Resume),
        2 => Just(Request::Stop),
        2 => prop_oneof![1..200_000_u32, 1_000_000..2_000_000_u32].prop_map(Request::Quick),
        1 => Just(Request::Halt),
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
        hz in prop_oneof![Just(1_000_000_u32), 100_000..72_000_000_u32], limits in [limits(), limits()],
        asks in prop::collection::vec((ask(), prop_oneof![0..3_000_u64, 0..300_000_u64]), 1..20),
        from in prop_oneof![2 => Just(0), 1 => Just(1 << 31), 1 => Just(-(1 << 31)), 1 => Just(5 << 32), 1 => Just(1 << 62)],
    ) {
        let mut seen = Seen::new(hz, limits);
        seen.machine.set_commanded([from; N], 0).unwrap();
        (seen.from, seen.last.1) = (from, [from << 32; N]);
        for (ask, micros) in asks {
            seen.ask(ask);
            seen.until(seen.now + micros * u64::from(hz) / 1_000_000);
        }
    }
}

/// Along two lines straight on, with a joint where it speeds up, at full speed and where it slows down, and with another override shortly
/// before that: in each tick as along a single line.
#[test]
fn a_joint_straight_on_is_not_seen() {
    let limits = Limits::new(1000, 5000).unwrap().with_jerk(50_000).unwrap();
    let machine = |lines: &[i64]| {
        let path = Path::<N, 6>::new(Clock::MICROSECONDS, [AxisSetup::new(limits, 1_000_000); N], 20).unwrap();
        let mut machine = PathMover::new(path);
        for half in lines {
            machine.push([2 * half, *half], 1000, 0).unwrap();
        }
        machine
    };
    for (joint, from, percent) in
        [(20, 0, 100), (200, 0, 100), (460, 0, 100), (20, 15, 50), (30, 29, 70), (200, 195, 50), (460, 455, 50)]
    {
        let mut both = [machine(&[joint, 500]), machine(&[500])];
        let (mut asked, mut seen, mut odd) = (false, 0, 0);
        for now in (0..3_000_000).step_by(83) {
            for machine in &mut both {
                while machine.due().is_some_and(|due| due <= now) {
                    machine.pulse();
                }
            }
            if !asked && both[1].commanded()[1] >= from {
                asked = true;
                for machine in &mut both {
                    machine.set_override(percent, now);
                }
            }
            let [states, want] = [0, 1].map(|of: usize| both[of].at(now));
            for (state, want) in states.into_iter().zip(want) {
                let off = (state.position - want.position).abs();
                assert!(off < 1 << 19, "{joint} {from}: {off} at {now}");
                assert!((state.speed - want.speed).abs() < 1 << 14, "{joint} {from}: {state:?} {want:?} at {now}");
                // Rounding may put the change of a jerk into the tick beside.
                let near = |a: i64, b: i64| (a - b).abs() <= 1 << 16;
                odd += u32::from(!near(state.acceleration, want.acceleration) || !near(state.jerk, want.jerk));
            }
            seen += u32::from(both[0].len() == 1 && both[0].commanded()[1] == joint);
        }
        assert_eq!(both.map(|machine| machine.commanded()), [[1000, 500]; 2]);
        assert!(seen > 5 && odd <= 4, "{joint} {from}: {seen} {odd}");
    }
}

/// At 16.7 steps/s the last step of a brake has been made, and 0.06 steps are left. What is asked for again in every tick is the same stop
/// to a cyclic master too.
#[test]
fn a_stop_without_a_step_is_the_same_stop() {
    type Ask = fn(&mut PathMover<1, 4>, u64);
    let limits = Limits::new(514, 1437).unwrap();
    let asks: [Ask; 4] = [
        |_, _| (),
        |machine, now| machine.stop(now),
        |machine, now| machine.quick_stop([Limits::new(514, 1437).unwrap()], now),
        |machine, now| machine.hold(now),
    ];
    let places = |ask: Ask| {
        let path = Path::new(Clock::new(32_768).unwrap(), [AxisSetup::new(limits, 4309)], 20).unwrap();
        let mut machine = PathMover::<1, 4>::new(path);
        machine.move_to([-4], 3885, 0).unwrap();
        machine.push([15], 29_573, 0).unwrap();
        while machine.due().is_some_and(|due| due <= 3526) {
            machine.pulse();
        }
        machine.stop(3528);
        (3528..4500)
            .map(|now| {
                ask(&mut machine, now);
                machine.at(now)[0]
            })
            .collect::<Vec<_>>()
    };
    let alone = places(asks[0]);
    assert!(alone[0].speed < 0 && alone[0].speed.abs() >> 16 < 20, "{:?}", alone[0]);
    for (other, ask) in asks.iter().enumerate() {
        assert!(places(*ask) == alone, "{other}");
    }
}

/// Nor does it put off the next line, which waits for the pause after the last step only.
#[test]
fn a_stop_at_rest_does_not_begin_the_pause_anew() {
    let begins = |again: bool| {
        let axis = AxisSetup::new(Limits::new(20_000, 200_000).unwrap(), 80_000).with_reversal_pause(5000);
        let mut machine = PathMover::<1, 4>::new(Path::new(Clock::MICROSECONDS, [axis], 20).unwrap());
        machine.push([10], 100_000, 0).unwrap();
        let mut now = 0;
        for _ in 0..6 {
            now = machine.pulse().unwrap().tick;
        }
        machine.stop(now);
        while let Some(pulse) = machine.pulse() {
            now = pulse.tick;
        }
        now += 4000;
        if again {
            machine.stop(now);
            machine.quick_stop([Limits::new(20_000, 200_000).unwrap()], now);
        }
        machine.push([0], 100_000, now).unwrap();
        machine.due()
    };
    assert_eq!(begins(true), begins(false));
}
