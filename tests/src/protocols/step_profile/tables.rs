//! Ramp table, speeds, tones, micro-step profiles, parameters.

use serde::Deserialize;
use step_profile::{Error, Frequency, Microstep, NamedSpeed, Parameters, Profile, RampTable, Speed, Tone, Turn};
use step_profile::{pru_exact, step_time_ns};

use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RampRow {
    i: u8,
    x: String,
    exact: String,
    entry: u32,
    truncated: u32,
    alt_midpoint_x: String,
    alt_midpoint: u32,
}

pub(super) fn ramp_table(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: RampRow| {
        same("entry", &row.entry, &RampTable::SIN2.entry(row.i))?;
        same("x", &row.x, &format!("{}*pi/64", row.i + 1))?;
        let exact = number(&row.exact)?;
        same("entry, from the exact value", &f64::from(row.entry), &exact.round())?;
        same("truncated", &f64::from(row.truncated), &exact.floor())?;
        let ends = 1000.0 / (f64::from(row.i + 1) * std::f64::consts::PI / 64.0).sin().powi(2);
        same("exact", &true, &((ends - exact).abs() < 1e-6))?;
        same("alt_midpoint_x", &row.alt_midpoint_x, &format!("{}*pi/128", 2 * row.i + 1))?;
        let middle = 1000.0 / (f64::from(2 * row.i + 1) * std::f64::consts::PI / 128.0).sin().powi(2);
        same("alt_midpoint", &f64::from(row.alt_midpoint), &middle.round())
    })
}

fn number(text: &str) -> Result<f64, Fault> {
    text.parse().map_err(|e| Fault::Unreadable(format!("{text:?}: {e}")))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SpeedConstant {
    f_hz: u32,
    speed_const: u32,
    named: bool,
    overflow_first_entry: Option<bool>,
    exact_first_entry: Option<bool>,
}

pub(super) fn speed_const(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: SpeedConstant| {
        let speed = Speed::from_hz(row.f_hz);
        same("speed_const", &Ok(row.speed_const), &speed.map(Speed::raw))?;
        let speed = Speed::from_raw(row.speed_const);
        if row.named {
            same("named", &true, &Speed::NAMED.contains(&NamedSpeed { hz: row.f_hz, speed }))?;
        }
        let profile = Profile::new(Parameters::at(speed));
        let overflow = matches!(profile, Err(Error::StepTimeOverflow { .. }));
        same("overflow_first_entry", &row.overflow_first_entry.unwrap_or(overflow), &overflow)?;
        let first = step_time_ns(RampTable::SIN2.first(), speed.raw());
        let exact = !overflow && first < pru_exact::EXACT_BELOW;
        same("exact_first_entry", &row.exact_first_entry.unwrap_or(exact), &exact)?;
        same("flag of the profile", &exact, &profile.map_or(exact, Profile::pru_is_exact))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ToneRow {
    tone_hz: String,
    fstep_khz_exact: String,
    fstep_khz_2dp: String,
    speed_const: u32,
    p125: u32,
    p250: u32,
    t_step_ns_full_speed: u32,
    ppm_fast_from_ns_truncation: f64,
    move_ns_p125_k1: u64,
    move_ns_p250_k1: u64,
}

pub(super) fn tones(rows: &[Row]) -> Vec<Verdict> {
    rows.iter().map(|row| tone(&row.name, &row.read()?)).collect()
}

fn tone(name: &str, row: &ToneRow) -> Verdict {
    let tone = Tone::from_name(name).ok_or_else(|| Fault::Unreadable(format!("Table 3 has no tone {name:?}")))?;
    same("tone_hz", &row.tone_hz, &format!("{}.{}", tone.tenths_hz() / 10, tone.tenths_hz() % 10))?;
    let frequency = tone.frequency();
    same("fstep_khz_exact", &row.fstep_khz_exact, &in_khz(frequency))?;
    same("fstep_khz_2dp", &row.fstep_khz_2dp, &rounded_khz(frequency))?;
    same("speed_const", &(row.speed_const, row.speed_const), &(tone.speed().raw(), speed_of(frequency)))?;
    same("p125", &(row.p125, row.p125), &(tone.p125(), frequency.steps_in(125)))?;
    same("p250", &(row.p250, row.p250), &(tone.p250(), frequency.steps_in(250)))?;

    let profile = profile(Parameters::at(tone.speed()).with_init_sync(0))?;
    let full = profile.step_time_ns(31);
    same("t_step_ns_full_speed", &row.t_step_ns_full_speed, &full)?;
    let exact = 1000.0 * f64::from(row.speed_const) / 65536.0;
    let ppm = (exact - f64::from(full)) / f64::from(full) * 1e6;
    same("ppm_fast_from_ns_truncation", &format!("{:.3}", row.ppm_fast_from_ns_truncation), &format!("{ppm:.3}"))?;
    same("move_ns_p125_k1", &row.move_ns_p125_k1, &profile.duration_ns(row.p125))?;
    same("move_ns_p250_k1", &row.move_ns_p250_k1, &profile.duration_ns(row.p250))
}

fn speed_of(frequency: Frequency) -> u32 {
    Speed::from_frequency(frequency).map_or(0, Speed::raw)
}

/// In lowest terms.
fn in_khz(frequency: Frequency) -> String {
    let (numerator, denominator) = (frequency.numerator(), frequency.denominator());
    let denominator = u32::from(denominator) * 1000;
    let (mut a, mut b) = (numerator, denominator);
    while b > 0 {
        (a, b) = (b, a % b);
    }
    format!("{}/{}", numerator / a, denominator / a)
}

/// Rounded to two decimals.
fn rounded_khz(frequency: Frequency) -> String {
    let (numerator, denominator) = (frequency.numerator(), frequency.denominator());
    let hundredths = (u64::from(numerator) + u64::from(denominator) * 5) / (u64::from(denominator) * 10);
    format!("{}.{:02}", hundredths / 100, hundredths % 100)
}

pub(super) fn profile(parameters: Parameters<'_>) -> Result<Profile<'_>, Fault> {
    Profile::new(parameters).map_err(|e| Fault::Unreadable(format!("the parameters are refused: {e}")))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MicrostepRow {
    profile_code: u8,
    microsteps: u32,
    steps_per_rev: u32,
    quarter_turn: u32,
    ten_turns: u32,
    drv8711_mode_bits: String,
    ctrl_field: u16,
}

pub(super) fn microstep(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: MicrostepRow| {
        let profile = Microstep::from_code(row.profile_code)
            .ok_or_else(|| Fault::Unreadable("the profile code is refused".to_owned()))?;
        same("microsteps", &row.microsteps, &profile.microsteps())?;
        same("steps_per_rev", &row.steps_per_rev, &profile.steps_per_turn())?;
        same("steps_per_rev", &row.steps_per_rev, &profile.steps(Turn::Full))?;
        same("quarter_turn", &row.quarter_turn, &profile.steps(Turn::Quarter))?;
        same("ten_turns", &row.ten_turns, &profile.steps(Turn::Ten))?;
        same("drv8711_mode_bits", &row.drv8711_mode_bits, &format!("{:04b}", profile.code()))?;
        same("ctrl_field", &row.ctrl_field, &profile.ctrl_field())
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ParametersRow {
    n: u32,
    k: u32,
    speed: u32,
    init_sync: u32,
    error: Option<String>,
    pru_exact: Option<bool>,
}

pub(super) fn params(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ParametersRow| {
        let profile = Profile::new(
            Parameters::at(Speed::from_raw(row.speed)).with_steps_per_entry(row.k).with_init_sync(row.init_sync),
        );
        same("error", &row.error, &profile.err().map(|e| format!("{:?}", e.class())))?;
        let Ok(profile) = profile else { return Ok(()) };
        let flag = profile.pru_is_exact();
        same("pru_exact", &row.pru_exact.unwrap_or(flag), &flag)?;
        same("steps", &(row.n as usize), &profile.steps(row.n).size_hint().0)
    })
}
