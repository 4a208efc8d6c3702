//! Fast position and quality monitor.

use hdsl::{DeltaDelta, PositionBits, PositionRule, PositionTracker, QualityEvent, QualityMonitor, QualityRule};
use serde::Deserialize;

use crate::hex::Hex;
use crate::row::{Fault, Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FastPosition {
    pos_bits: u8,
    quirk: bool,
    frames: Vec<Frame>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Frame {
    acc: Hex,
    byte_error: bool,
    usable: bool,
    pos: Hex,
    vel: Hex,
    vpos: Option<Hex>,
    vpos_valid: Option<bool>,
    after: Option<After>,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct After {
    pos: Hex,
    vel: Hex,
    phase: u8,
    pos_flag: bool,
}

/// VEL, 24 bits.
fn vel(tracker: &PositionTracker) -> Hex {
    Hex(i64::from(tracker.registers().vel).rem_euclid(1 << 24).unsigned_abs())
}

/// All frames by one rule.
fn run(row: &FastPosition, rule: PositionRule) -> Verdict {
    let bits = PositionBits::new(row.pos_bits).ok_or_else(|| Fault::Unreadable("pos_bits".to_owned()))?;
    let mut tracker = PositionTracker::with_rule(bits, rule);
    for frame in &row.frames {
        let word = DeltaDelta::from_word(frame.acc.0 as u16);
        let value = if frame.byte_error { None } else { word.ok() };
        same("usable", &frame.usable, &value.is_some())?;
        tracker.step(value);
        same("pos", &frame.pos, &Hex(tracker.registers().pos))?;
        same("vel", &frame.vel, &vel(&tracker))?;
        match (frame.vpos, frame.vpos_valid) {
            (Some(vpos), Some(true)) => tracker.align(vpos.0),
            (_, Some(false)) => tracker.no_safe_position(),
            _ => {}
        }
        let after = After {
            pos: Hex(tracker.registers().pos),
            vel: vel(&tracker),
            phase: tracker.stage() as u8,
            pos_flag: tracker.registers().pos_flag,
        };
        if let Some(want) = &frame.after {
            same("after", want, &after)?;
        }
    }
    Ok(())
}

pub(super) fn fast_position(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FastPosition| {
        run(&row, PositionRule::Ti)?;
        if row.quirk { Ok(()) } else { run(&row, PositionRule::Sick) }
    })
}

/// `quirk` names the rule: the vendor's, or the default.
pub(super) fn fast_position_wrap(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FastPosition| run(&row, if row.quirk { PositionRule::Ti } else { PositionRule::Sick }))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Quality {
    columns: Vec<String>,
    start: u8,
    trace: Vec<(String, u8, bool, u8, bool)>,
}

fn event(name: &str) -> Option<QualityEvent> {
    Some(match name {
        "vsync_ok" => QualityEvent::VsyncOk,
        "vsync_missing_in_last" => QualityEvent::VsyncMissing,
        "vsync_in_first_seven" => QualityEvent::VsyncEarly,
        "safe1_crc_ok" => QualityEvent::Safe1Ok,
        "safe1_error" => QualityEvent::Safe1Error,
        "safe2_error" => QualityEvent::Safe2Error,
        "parameter_or_pipe_code" => QualityEvent::ParameterOrPipeWord,
        "process_data_code" => QualityEvent::AccelerationWord,
        "unknown_special" => QualityEvent::UnknownSpecial,
        "rssi_below_2" => QualityEvent::LowRssi,
        _ => return None,
    })
}

pub(super) fn quality_monitor(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Quality| {
        let columns = ["event", "qm_ti", "lost_ti", "qm_manual", "lost_manual"];
        same("columns", &row.columns.iter().map(String::as_str).collect(), &columns.to_vec())?;
        same("start", &row.start, &QualityMonitor::START)?;
        let mut ti = QualityMonitor::new(QualityRule::Ti);
        let mut manual = QualityMonitor::new(QualityRule::Sick);
        for (name, qm_ti, lost_ti, qm_manual, lost_manual) in row.trace {
            let event = event(&name).ok_or_else(|| Fault::Unreadable(format!("unknown event {name:?}")))?;
            ti.count(event);
            manual.count(event);
            same("qm_ti, lost_ti", &(qm_ti, lost_ti), &(ti.value(), ti.is_lost()))?;
            same("qm_manual, lost_manual", &(qm_manual, lost_manual), &(manual.value(), manual.is_lost()))?;
        }
        Ok(())
    })
}
