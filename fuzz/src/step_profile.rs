//! step-profile: single steps against wider integers, an axis against the steps of its moves, plans and paths against their laws.

use step_profile::motion::{AxisSetup, Clock, Limits, Path, PathMover, Plan};
use step_profile::{
    Arithmetic, Axis, Command, Direction, Error, MoveState, Parameters, Profile, RampStep, RampSteps, RampTable, Speed,
    corrected, pru_exact, step_time_ns,
};

use crate::byte;

fn word(data: &mut &[u8]) -> u32 {
    u32::from_le_bytes([byte(data), byte(data), byte(data), byte(data)])
}

/// One step: ramp entry, speed constant and previous sync_time, four bytes each, low byte first.
pub fn step(mut data: &[u8]) {
    let (entry, speed, prev) = (word(&mut data), word(&mut data), word(&mut data));
    let product = u128::from(entry) * u128::from(speed);
    let t_step = u64::from((product >> 16) as u32);
    assert_eq!(u64::from(step_time_ns(entry, speed)), t_step);

    let (sum, t) = (u64::from(prev) + t_step, t_step as u32);
    let right = corrected(t, prev);
    assert_eq!((u64::from(right.cnt), u64::from(right.sync)), (sum / 4000, sum % 4000));

    let pru = pru_exact::run(entry, speed, prev);
    assert_eq!(pru_exact::step(entry, speed, prev), Arithmetic::PruExact.interval(entry, speed).after(prev));
    assert_eq!(u64::from(pru.t_step), t_step);
    assert_eq!(u128::from(pru.cnt_raw), (u128::from(t_step) * 1_073_742) >> 32);
    assert_eq!(u64::from(pru.t_4us_cnt), (u64::from(pru.cnt_raw) * 4000) & u64::from(u32::MAX));
    assert_eq!(pru.sync_raw, prev.wrapping_add(t).wrapping_sub(pru.t_4us_cnt));
    let late = pru.sync_raw >= 4000;
    assert_eq!((pru.cnt, pru.sync), (pru.cnt_raw + u32::from(late), pru.sync_raw - if late { 4000 } else { 0 }));
    if prev < 4000 && t < pru_exact::EXACT_BELOW {
        assert_eq!((pru.cnt, pru.sync), (right.cnt, right.sync));
    }
}

/// What an axis should do, from the steps of its move alone.
struct Model<'t> {
    steps: RampSteps<'t>,
    next: Option<RampStep>,
    cycle: u64,
    direction: Direction,
}

/// An axis and a series of commands to it.
///
/// ```text
/// 0..3  speed constant above 250 kHz's     4  steps a ramp entry     5, 6  initial sync_time     7  arithmetic
/// 8     ramp: 0 sin², else a flat one of that times 50     9..  commands of two bytes: start, ticks, abort, position
/// ```
pub fn axis(mut data: &[u8]) {
    let speed = 262_144_u32.saturating_sub(8).saturating_add(word(&mut data) >> 6);
    let (k, low, high) = (byte(&mut data), byte(&mut data), byte(&mut data));
    let arithmetic =
        [Arithmetic::Corrected, Arithmetic::PruExact, Arithmetic::Carried][usize::from(byte(&mut data)) % 3];
    let ramp = byte(&mut data);
    let flat = RampTable::new([1000 + u32::from(ramp) * 50; RampTable::LEN]).expect("no entry is below 1000");
    let parameters = Parameters::at(Speed::from_raw(speed))
        .with_steps_per_entry(k.into())
        .with_init_sync(u16::from_le_bytes([low, high]).into())
        .with_table(if ramp == 0 { RampTable::SIN2 } else { &flat })
        .with_arithmetic(arithmetic);
    let Some(profile) = checked(parameters) else { return };
    let mut axis = Axis::new();
    let mut position = 0;
    let mut model: Option<Model<'_>> = None;
    let mut held = Direction::Forward;
    while let [command, value, rest @ ..] = data {
        data = rest;
        let direction = if command & 4 == 0 { Direction::Forward } else { Direction::Reverse };
        match command & 3 {
            0 => {
                let outcome = axis.start(profile, u32::from(*value), direction);
                assert_eq!(outcome, if model.is_some() { Err(Error::Moving) } else { Ok(()) });
                if model.is_none() && *value > 0 {
                    let mut steps = profile.steps(u32::from(*value));
                    let next = steps.next();
                    (model, held) = (Some(Model { steps, next, cycle: 0, direction }), direction);
                }
            }
            1 => (0..u32::from(*value) * 16).for_each(|_| position += tick(&mut axis, &mut model, held)),
            2 => {
                axis.abort();
                match &mut model {
                    Some(Model { steps, next: Some(next), .. }) if next.index > 0 => steps.abort(),
                    _ => model = None,
                }
            }
            _ => {
                position = i64::from(*value);
                axis.set_commanded(position);
            }
        }
        let state = model.as_ref().and_then(|m| m.next).map_or(MoveState::Idle, |step| step.state);
        assert_eq!((axis.state(), axis.commanded(), axis.direction()), (state, position, held));
    }
}

/// The profile, if the parameters are in range: `Profile::new` has to say the same.
fn checked(parameters: Parameters<'_>) -> Option<Profile<'_>> {
    let slowest = u64::from(parameters.table.first()) * u64::from(parameters.speed.raw());
    let in_range = parameters.steps_per_entry >= 1
        && parameters.speed.raw() >= 262_144
        && slowest < 1 << 48
        && parameters.init_sync < 4000;
    let profile = Profile::new(parameters);
    assert_eq!(profile.is_ok(), in_range);
    profile.ok()
}

/// A cycle; what it adds to the position.
fn tick(axis: &mut Axis<'_>, model: &mut Option<Model<'_>>, held: Direction) -> i64 {
    let command = axis.tick();
    let Some(Model { steps, next, cycle, direction }) = model else {
        assert_eq!(command, Command::Hold { direction: held });
        return 0;
    };
    let now = *cycle;
    *cycle += 1;
    let Some(step) = next.filter(|step| step.cycle == now) else {
        assert_eq!(command, Command::Hold { direction: held });
        return 0;
    };
    assert_eq!(command, Command::Pulse { direction: *direction, sync_time: step.sync_time });
    let moved = if direction.dir() { -1 } else { 1 };
    *next = steps.next();
    if next.is_none() {
        *model = None;
    }
    moved
}

/// Steps of a plan that are looked at.
const LOOKED_AT: u32 = 4000;

/// A plan of any limits: speed, acceleration, steps, entry speed, exit speed and clock, four bytes each, and eight of jerk,
/// low byte first; 0 is no jerk limit.
pub fn motion(mut data: &[u8]) {
    let [speed, acceleration, steps, entry, exit, hz, low, high] = core::array::from_fn(|_| word(&mut data));
    let jerk = u64::from(high) << 32 | u64::from(low);
    let Ok(limits) = Limits::new(speed, acceleration) else { return };
    let limits = if jerk == 0 { Ok(limits) } else { limits.with_jerk(jerk) };
    let (Ok(limits), Some(clock)) = (limits, Clock::new(hz)) else { return };
    let plan = match Plan::between(clock, limits, steps, entry, exit) {
        Ok(plan) => plan,
        Err(Error::SpeedAboveClock { .. }) => return assert!(speed > hz / 2),
        Err(Error::TooManySteps { .. }) => return assert!(steps > u32::MAX / 2),
        Err(Error::TooShort { needed, .. }) => {
            assert!(needed > steps);
            if needed <= u32::MAX / 2 {
                assert!(Plan::between(clock, limits, needed, entry, exit).is_ok(), "{needed} steps are not enough");
            }
            return;
        }
        Err(e) => panic!("{e}"),
    };
    assert_eq!(plan.steps(), steps);
    let mut last = None;
    let mut made = 0_i64;
    for tick in plan.pulses().take(LOOKED_AT as usize) {
        assert!(last.is_none_or(|last| tick > last) && tick <= plan.duration(), "step {made} at {tick} after {last:?}");
        (last, made) = (Some(tick), made + 1);
        let state = plan.at(tick);
        // Per mille of the limits, and the part of a tick that a corner may be off.
        let most = |limit: u64, part: u64| (i128::from(limit) + i128::from(limit / 1000 + part)) << 16;
        assert!(i128::from(state.speed) <= most(speed.into(), 1 + u64::from(acceleration >> 28)), "{state}");
        assert!(i128::from(state.acceleration.abs()) <= most(acceleration.into(), 1 + (jerk >> 28)), "{state}");
    }
    assert_eq!(made, i64::from(steps.min(LOOKED_AT)));
    assert_eq!(plan.at(plan.duration() + 1).position, i64::from(steps) << 32);
}

/// Two axes along a path, and requests to them: limits of the axes in four bytes, then commands of three.
///
/// ```text
/// 0     speed / 100     1     acceleration / 1000     2     jerk / 100000, 0 for none     3     deviation at corners in um
/// 4..   command, and two values: a line, a new target, time, an override, hold, resume, stop, halt
/// ```
pub fn path(mut data: &[u8]) {
    let [speed, acceleration, jerk, deviation] = core::array::from_fn(|_| u32::from(byte(&mut data)));
    let limits = Limits::new(speed * 100 + 50, acceleration * 1000 + 500).expect("in range");
    let limits = if jerk == 0 { limits } else { limits.with_jerk(u64::from(jerk) * 100_000).expect("in range") };
    let axis = AxisSetup::new(limits, 80_000);
    let path = Path::<2, 4>::new(Clock::MICROSECONDS, [axis; 2], deviation).expect("a speed below the clock's");
    let mut watched = Watched { machine: PathMover::new(path), position: [0; 2], now: 0 };
    while let [command, a, b, rest @ ..] = data {
        data = rest;
        let to = [a, b].map(|value| i64::from(i8::from_le_bytes([*value])) * 4);
        let (now, machine) = (watched.now, &mut watched.machine);
        match command & 7 {
            0 => {
                let full = machine.is_full();
                assert_eq!(machine.push(to, 200_000, now).is_err(), full);
            }
            1 => drop(machine.move_to(to, 50_000, now)),
            2 => watched.until(now + (u64::from(*a) << (b & 15))),
            3 => machine.set_override(u16::from(*a), now),
            4 => machine.hold(now),
            5 => machine.resume(now),
            6 => machine.stop(now),
            _ => machine.halt(now),
        }
    }
    let now = watched.now;
    watched.machine.set_override(100, now);
    watched.machine.resume(now);
    watched.until(u64::MAX);
    assert_eq!((watched.position, watched.machine.is_empty()), (watched.machine.target(), true));
    assert!(watched.machine.is_at_rest(u64::MAX >> 24));
}

struct Watched {
    machine: PathMover<2, 4>,
    position: [i64; 2],
    now: u64,
}

impl Watched {
    /// Takes all steps before a time: each later than the one before, and one at a time.
    fn until(&mut self, time: u64) {
        while let Some(due) = self.machine.due().filter(|due| *due < time) {
            let pulse = self.machine.pulse().expect("a step is due");
            assert!(pulse.tick == due && due >= self.now, "{pulse:?} before {}", self.now);
            self.position[usize::from(pulse.axis)] += if pulse.direction.dir() { -1 } else { 1 };
            assert_eq!(self.machine.commanded(), self.position);
            self.now = due;
        }
        if time < u64::MAX {
            self.now = self.now.max(time);
        }
    }
}
