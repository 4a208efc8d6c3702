//! step-profile: single steps against wider integers, an axis against the steps of its moves.

use step_profile::{
    Arithmetic, Axis, Command, Direction, Error, MoveState, Parameters, Profile, RampStep, RampSteps, RampTable, Speed,
    corrected, pru_exact, step_time_ns,
};

use crate::{byte, word};

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
/// 0..3  speed constant above 250 kHz's     4  steps per ramp entry     5, 6  initial sync_time     7  arithmetic
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
