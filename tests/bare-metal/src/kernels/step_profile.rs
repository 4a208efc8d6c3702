//! step-profile: single step times, whole moves, axes by the cycle, tables and parameters.

use step_profile::{
    Arithmetic, Axes, Axis, Command, Dance, Direction, Error, Frequency, Group, Microstep, Motors, MoveState, Note,
    OperatingMode, Parameters, PositionMode, PositionState, Profile, RampStep, RampTable, Shape, Speed, StepTime, Tone,
    Turn, corrected, pru_exact, step_time_ns,
};

use super::kernels;

/// Ramp entry, speed constant, previous sync_time: slow and fast, with and without a cycle more.
const STEPS: [[u32; 3]; 4] =
    [[415_345, 262_144, 0], [1000, 692_989, 3999], [1000, 262_144, 1000], [4500, 932_886, 2131]];

/// Arithmetic, speed constant, steps per ramp entry, initial sync_time.
type Given = (Arithmetic, u32, u32, u32);

const GIVEN: [Given; 3] = [
    (Arithmetic::Corrected, 262_144, 1, 1000),
    (Arithmetic::PruExact, 262_144, 1, 0),
    (Arithmetic::Carried, 300_000, 1, 17),
];

/// The same, and what is refused.
const CHECKED: [Given; 4] =
    [GIVEN[0], (Arithmetic::Corrected, 5, 1, 0), (Arithmetic::Corrected, 1 << 30, 1, 0), GIVEN[2]];

/// A tone's name in Table 3.
type Name = &'static str;

/// Both ramps and nothing between.
const RAMPS: u32 = 64;

fn profile((arithmetic, speed, steps_per_entry, init_sync): &Given) -> Result<Profile<'static>, Error> {
    let (arithmetic, steps_per_entry, init_sync) = (*arithmetic, *steps_per_entry, *init_sync);
    Profile::new(
        Parameters::at(Speed::from_raw(*speed))
            .with_steps_per_entry(steps_per_entry)
            .with_init_sync(init_sync)
            .with_arithmetic(arithmetic),
    )
}

/// Takes from a step what a sender needs.
fn mix(sum: u32, step: RampStep) -> u32 {
    sum ^ step.cnt ^ step.sync_time
}

kernels! {
    /// The next step of one axis with the arithmetic of the PRU.
    fn step_profile_pru_exact([entry, speed, prev]: &[u32; 3]) -> StepTime {
        pru_exact::step(*entry, *speed, *prev)
    } over STEPS;

    /// The next step of one axis by true division.
    fn step_profile_corrected([entry, speed, prev]: &[u32; 3]) -> StepTime {
        corrected(step_time_ns(*entry, *speed), *prev)
    } over STEPS;

    /// All registers of the PRU's sequence.
    fn step_profile_registers([entry, speed, prev]: &[u32; 3]) -> pru_exact::Registers {
        pru_exact::run(*entry, *speed, *prev)
    } over STEPS;

    /// A time split at the cycle, and the step after another.
    fn step_profile_interval(given: &Given) -> StepTime {
        given.0.interval(4500, given.1).after(given.3)
    } over GIVEN;

    /// The parameters of a profile.
    fn step_profile_parameters(given: &Given) -> Option<(Shape, bool)> {
        profile(given).ok().map(|profile| (profile.shape(given.1), profile.pru_is_exact()))
    } over CHECKED;

    /// How long a full turn takes.
    fn step_profile_duration(given: &Given) -> u64 {
        profile(given).map_or(0, |profile| profile.duration_ns(51_200))
    } over GIVEN;

    /// A move of 64 steps, all of them on the ramps, step by step.
    fn step_profile_move_64(given: &Given) -> u32 {
        profile(given).map_or(0, |profile| profile.steps(RAMPS).fold(0, mix))
    } over GIVEN;

    /// A move of 1024 steps: the ramps and 960 steps at full speed.
    fn step_profile_move_1024(given: &Given) -> u32 {
        profile(given).map_or(0, |profile| profile.steps(1024).fold(0, mix))
    } over GIVEN;

    /// A move that is given up after 40 steps: 31 more.
    fn step_profile_abort_move(given: &Given) -> Result<u32, Error> {
        let mut steps = profile(given)?.steps(1024);
        let sum = steps.by_ref().take(40).fold(0, mix);
        steps.abort();
        Ok(steps.fold(sum, mix))
    } over GIVEN;

    /// One axis for 1000 cycles: 317 pulses at 250 kHz.
    fn step_profile_tick_1000(given: &Given) -> Result<(i64, MoveState), Error> {
        let mut axis = Axis::new();
        axis.start(profile(given)?, 1024, Direction::Reverse)?;
        for _ in 0..1000 {
            axis.tick();
        }
        axis.abort();
        Ok((axis.commanded(), axis.state()))
    } over GIVEN;

    /// Four independent axes for 1000 cycles.
    fn step_profile_four_axes_1000(given: &Given) -> Result<i64, Error> {
        let mut axes = Axes::default();
        for axis in &mut axes.0 {
            axis.start(profile(given)?, 1024, Direction::Forward)?;
        }
        let mut pulses = 0;
        for _ in 0..1000 {
            for command in axes.tick() {
                pulses += i64::from(matches!(command, Command::Pulse { .. }));
            }
        }
        Ok(pulses)
    } over GIVEN;

    /// A cycle of four motors that share a sequence, its start and its end.
    fn step_profile_group(given: &Given) -> Result<([Command; 4], [i64; 4]), Error> {
        let mut group = Group::new(Motors::NONE);
        group.select(Motors::new(given.2.to_le_bytes()[0]).ok_or(Error::NoMotor)?)?;
        group.start(profile(given)?, RAMPS, Direction::Forward)?;
        let commands = group.tick();
        group.abort();
        Ok((commands, group.commanded()))
    } over GIVEN;

    /// A turn of position mode, given up.
    fn step_profile_position_mode(given: &Given) -> Result<([Command; 4], PositionState), Error> {
        let mut mode = PositionMode::new(Motors::ALL, Microstep::from_code(given.2.to_le_bytes()[0]).ok_or(Error::NoMotor)?);
        mode.select(Motors::M2)?;
        mode.start(profile(given)?, Turn::Ten, Direction::Reverse)?;
        mode.abort();
        Ok((mode.tick(), mode.state()))
    } over GIVEN;

    /// The first and the last cycle of a song.
    fn step_profile_dance(notes: &[Note; 2]) -> Result<([Command; 4], bool), Error> {
        let mut dance = Dance::new(Motors::ALL, Parameters::at(Speed::KHZ_100), Direction::Forward, notes)?;
        let commands = dance.tick();
        dance.abort();
        dance.tick();
        Ok((commands, dance.is_over()))
    } over [[Note::p125(Tone::Cis, 5), Note::p250(Tone::Fis2, 0)]];

    /// A ramp table of one's own.
    fn step_profile_ramp_table((entries, index): &([u32; 32], u8)) -> Result<u32, Error> {
        RampTable::new(*entries).map(|table| table.entry(*index))
    } over [([1000; 32], 31), ([5000; 32], 255), ([999; 32], 0)];

    /// The speed constant of a frequency in hertz.
    fn step_profile_speed_hz(hz: &u32) -> Result<Speed, Error> {
        Speed::from_hz(*hz)
    } over [94_570, 250_000, 15];

    /// The speed constant of a fraction, and its steps in 125 ms.
    fn step_profile_speed_ratio((numerator, denominator): &(u32, u16)) -> Option<(Speed, u32)> {
        let frequency = Frequency::from_ratio(*numerator, *denominator)?;
        Some((Speed::from_frequency(frequency).ok()?, frequency.steps_in(125)))
    } over [(13_136_900, 187), (94_570, 1), (1, 0)];

    /// A tone by its name, and by Equation 5.
    fn step_profile_tone(name: &Name) -> Option<(Speed, u32, Option<Frequency>)> {
        Tone::from_name(name).map(|tone| (tone.speed(), tone.p250(), Frequency::of_tone(tone.tenths_hz().into())))
    } over ["cis", "fis2", "B"];

    /// Micro-step profile and operating mode from their codes.
    fn step_profile_codes(code: &u8) -> Option<(u16, u32, OperatingMode)> {
        let profile = Microstep::from_code(*code)?;
        Some((profile.ctrl_field(), profile.steps(Turn::Quarter), OperatingMode::from_code(*code)?))
    } over [0, 4, 8, 9];
}
