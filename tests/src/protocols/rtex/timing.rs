//! Phases, LED, periods, timers and positions.

use rtex_block::master::{Asic, ControlError, ControlPhase, Inputs, Led, PhaseControl, SlaveInfo, led as led_at};
use rtex_block::position::{Gear, is_within_limit, step};
use rtex_block::timing::{FrameTime, Periods, timer_reload as reload};
use serde::Deserialize;

use super::fields::unreadable;
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
enum PhaseName {
    #[serde(rename = "PH_INIT")]
    Init,
    #[serde(rename = "PH_WAITING")]
    Waiting,
    #[serde(rename = "PH_PREPARE")]
    Prepare,
    #[serde(rename = "PH_START")]
    Start,
    #[serde(rename = "PH_RUNNING")]
    Running,
}

impl From<PhaseName> for ControlPhase {
    fn from(name: PhaseName) -> Self {
        match name {
            PhaseName::Init => Self::Init,
            PhaseName::Waiting => Self::Waiting,
            PhaseName::Prepare => Self::Prepare,
            PhaseName::Start => Self::Start,
            PhaseName::Running => Self::Running,
        }
    }
}

#[derive(Deserialize, Clone, Copy, Debug, PartialEq)]
#[serde(rename_all = "snake_case")]
enum FaultName {
    SlaveInfoMismatch,
    Timeout,
}

impl From<FaultName> for ControlError {
    fn from(name: FaultName) -> Self {
        match name {
            FaultName::SlaveInfoMismatch => Self::SlaveInfoMismatch,
            FaultName::Timeout => Self::Timeout,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
enum AsicName {
    Initial,
    RingConfig,
    Ready,
    Running,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum SlaveInfoName {
    Match,
    Mismatch,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    asic: AsicName,
    slave_info: Option<SlaveInfoName>,
    #[serde(default)]
    tx_ready: bool,
    #[serde(default)]
    timeout: bool,
}

impl From<&Step> for Inputs {
    fn from(step: &Step) -> Self {
        Self {
            asic: match step.asic {
                AsicName::Initial => Asic::Initial,
                AsicName::RingConfig => Asic::RingConfig,
                AsicName::Ready => Asic::Ready,
                AsicName::Running => Asic::Running,
            },
            slave_info: step.slave_info.as_ref().map(|info| match info {
                SlaveInfoName::Match => SlaveInfo::Match,
                SlaveInfoName::Mismatch => SlaveInfo::Mismatch,
            }),
            tx_ready: step.tx_ready,
            timeout: step.timeout,
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct After {
    phase: PhaseName,
    fault: Option<FaultName>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PhaseTrace {
    steps: Vec<Step>,
    after: Vec<After>,
}

pub(super) fn phase_traces(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: PhaseTrace| {
        let mut control = PhaseControl::new();
        let seen: Vec<(ControlPhase, Option<ControlError>)> = row
            .steps
            .iter()
            .map(|step| {
                control.step(step.into());
                (control.phase(), control.error())
            })
            .collect();
        let want: Vec<_> = row.after.iter().map(|a| (a.phase.into(), a.fault.map(ControlError::from))).collect();
        same("after", &want, &seen)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LedRow {
    phase: PhaseName,
    fault: Option<FaultName>,
    t_ms: u64,
    led: String,
}

pub(super) fn led(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: LedRow| {
        let shown = match led_at(row.phase.into(), row.fault.map(ControlError::from), row.t_ms) {
            Led::Off => "off",
            Led::Green => "green",
            Led::Red => "red",
        };
        same("led", &row.led.as_str(), &shown)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PeriodRow {
    pr720: i32,
    pr721: i32,
    pr791: Option<i64>,
    com_ns: Option<u32>,
    update_ns: Option<u32>,
    listed: bool,
    internal_timer_ok: bool,
}

pub(super) fn periods_a6n(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: PeriodRow| {
        let periods = Periods::from_a6n(row.pr720, row.pr721, row.pr791);
        same("listed", &row.listed, &periods.is_some())?;
        same("com_ns", &row.com_ns, &periods.map(|p| p.com_ns))?;
        same("update_ns", &row.update_ns, &periods.map(|p| p.update_ns))?;
        same("internal_timer_ok", &row.internal_timer_ok, &periods.is_some_and(|p| p.internal_timer))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRow {
    axes: Option<u32>,
    tf_ns: Option<u64>,
    com_ns: Option<u32>,
    axes_max_by_line: Option<u32>,
}

pub(super) fn frame_time(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FrameRow| match row {
        FrameRow { axes: Some(axes), tf_ns: Some(want), com_ns: None, axes_max_by_line: None } => {
            same("tf_ns", &want, &FrameTime::GUIDE.estimate_ns(axes))
        }
        FrameRow { axes: None, tf_ns: None, com_ns: Some(com_ns), axes_max_by_line: Some(want) } => {
            same("axes_max_by_line", &want, &FrameTime::GUIDE.axes_within(com_ns))
        }
        _ => Err(unreadable("neither a frame time nor a number of axes")),
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReloadRow {
    timer_hz: u32,
    period_ns: u32,
    reload: Option<u32>,
    fits_16_bit: bool,
}

pub(super) fn timer_reload(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: ReloadRow| {
        let value = reload(row.timer_hz, row.period_ns);
        same("reload", &row.reload, &value)?;
        same("fits_16_bit", &row.fits_16_bit, &value.is_some_and(|v| u16::try_from(v).is_ok()))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StepRow {
    old: i32,
    new: i32,
    step: i32,
}

pub(super) fn position_step(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: StepRow| {
        same("step", &row.step, &step(row.old, row.new))?;
        same("new", &row.new, &row.old.wrapping_add(row.step))
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RateRow {
    update_ns: u32,
    gear_num: u32,
    gear_den: u32,
    step: i32,
    #[serde(rename = "within_400M_pulse_per_s")]
    within: bool,
}

pub(super) fn position_rate(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: RateRow| {
        let gear = Gear::new(row.gear_num, row.gear_den).ok_or_else(|| unreadable("gear with a 0"))?;
        same("within_400M_pulse_per_s", &row.within, &is_within_limit(row.step, row.update_ns, gear))
    })
}
