//! step-profile: single step times, whole moves, axes by the cycle, tables and parameters.

use step_profile::{
    Arithmetic, Axes, Axis, Command, Dance, Direction, Error, Frequency, Group, Microstep, Motors, MoveState, Note,
    OperatingMode, Parameters, PositionMode, PositionState, Profile, RampTable, Shape, Speed, Step, StepTime, Tone,
    Turn, corrected, pru_exact, step_time_ns,
};

use super::kernels;
use crate::self_test::step_profile::{STEPS, Traced};

/// Arithmetic, speed constant, steps a ramp entry, initial sync_time.
type Given = (Arithmetic, u32, u32, u32);

const GIVEN: [Given; 4] = [
    (Arithmetic::Corrected, 262_144, 1, 1000),
    (Arithmetic::PruExact, 692_989, 1, 0),
    (Arithmetic::Carried, 580_294, 1, 17),
    (Arithmetic::Corrected, 5, 0, 4000),
];

/// All that is right: the ramps of 32 steps each and nothing between.
const RAMPS: u32 = 64;

fn profile((arithmetic, speed, steps_per_entry, init_sync): &Given) -> Result<Profile<'static>, Error> {
    let (arithmetic, steps_per_entry, init_sync) = (*arithmetic, *steps_per_entry, *init_sync);
    Profile::new(Parameters { arithmetic, steps_per_entry, init_sync, ..Parameters::at(Speed::from_raw(*speed)) })
}

fn started(given: &Given) -> Axis<'static> {
    let mut axis = Axis::new();
    if let Ok(profile) = profile(given) {
        let _ = axis.start(profile, RAMPS, Direction::Reverse);
    }
    axis
}

kernels! {
    /// One step of one axis with the arithmetic of the PRU.
    fn step_profile_pru_exact(row: &Traced) -> StepTime {
        let [entry, speed, prev] = row.given;
        pru_exact::step(entry, speed, prev)
    } over *STEPS.first_chunk::<16>().unwrap();

    /// One step of one axis by true division.
    fn step_profile_corrected([entry, speed, prev]: &[u32; 3]) -> StepTime {
        corrected(step_time_ns(*entry, *speed), *prev)
    } over GIVEN_STEPS;
}
