//! The registers of a receiver for the fast position, and its quality monitor: plain numbers, valid or not.
//! Take usable positions from `sw_hdsl_position()`.

use core::mem::MaybeUninit;

use hdsl::{DeltaDelta, PositionBits, PositionTracker, QualityEvent, QualityMonitor};

use super::names::dialect as dialect_of;
use crate::border::{OK, border, in_range, state, there};
use crate::result::sw_result_t;

/// The arithmetic of the fast position. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_tracker_t {
    pub(crate) _private: [MaybeUninit<u64>; 14],
}
state!(sw_hdsl_tracker_t, PositionTracker, 0x33);

/// A quality monitor. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_quality_t {
    pub(crate) _private: [MaybeUninit<u64>; 2],
}
state!(sw_hdsl_quality_t, QualityMonitor, 0x34);

/// Registers of the fast position.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_position_registers_t {
    /// POS, 40 bits.
    pub pos: u64,
    /// VEL, steps an H-frame.
    pub vel: i32,
    /// Words in a row that could not be used.
    pub acc_err_cnt: u32,
    /// The event POS: the fast position is not the safe one.
    pub pos_flag: u8,
    /// sw_hdsl_stage_t.
    pub stage: u8,
}

/// Creates a tracker for an encoder with this many position bits, 8..40, by the rules of a dialect
/// (sw_hdsl_dialect_t).
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_tracker_start(
    tracker: Option<&mut MaybeUninit<sw_hdsl_tracker_t>>,
    position_bits: u8,
    dialect: u8,
) -> sw_result_t {
    border(|| {
        let (bits, rule) = (in_range(PositionBits::new(position_bits))?, dialect_of(dialect)?.position);
        sw_hdsl_tracker_t::start(tracker, PositionTracker::with_rule(bits, rule))?;
        OK
    })
}

/// Takes an H-frame with this change of speed, -1024..1023 steps.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_tracker_step(tracker: Option<&mut sw_hdsl_tracker_t>, delta_delta: i16) -> sw_result_t {
    border(|| {
        let it = sw_hdsl_tracker_t::get(tracker)?;
        it.step(Some(in_range(DeltaDelta::new(delta_delta))?));
        OK
    })
}

/// Takes an H-frame whose acceleration must not be used.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_tracker_miss(tracker: Option<&mut sw_hdsl_tracker_t>) -> sw_result_t {
    border(|| {
        sw_hdsl_tracker_t::get(tracker)?.step(None);
        OK
    })
}

/// Takes the safe position at the end of a V-frame.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_tracker_align(tracker: Option<&mut sw_hdsl_tracker_t>, vpos: u64) -> sw_result_t {
    border(|| {
        sw_hdsl_tracker_t::get(tracker)?.align(vpos);
        OK
    })
}

/// Takes a V-frame without a safe position.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_tracker_no_safe_position(tracker: Option<&mut sw_hdsl_tracker_t>) -> sw_result_t {
    border(|| {
        sw_hdsl_tracker_t::get(tracker)?.no_safe_position();
        OK
    })
}

/// The registers.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_tracker_registers(
    tracker: Option<&sw_hdsl_tracker_t>,
    registers: Option<&mut MaybeUninit<sw_hdsl_position_registers_t>>,
) -> sw_result_t {
    border(|| {
        let (it, out) = (sw_hdsl_tracker_t::look(tracker)?, there(registers)?);
        let registers = it.registers();
        out.write(sw_hdsl_position_registers_t {
            pos: registers.pos,
            vel: registers.vel,
            acc_err_cnt: registers.acc_err_cnt,
            pos_flag: registers.pos_flag.into(),
            stage: it.stage() as u8,
        });
        OK
    })
}

/// Creates a monitor at its initial value, 8, with the penalties of a dialect (sw_hdsl_dialect_t).
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_quality_start(
    quality: Option<&mut MaybeUninit<sw_hdsl_quality_t>>,
    dialect: u8,
) -> sw_result_t {
    border(|| {
        let rule = dialect_of(dialect)?.quality;
        sw_hdsl_quality_t::start(quality, QualityMonitor::new(rule))?;
        OK
    })
}

/// Counts an event, sw_hdsl_quality_event_t.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_quality_count(quality: Option<&mut sw_hdsl_quality_t>, event: u8) -> sw_result_t {
    border(|| {
        let it = sw_hdsl_quality_t::get(quality)?;
        it.count(in_range(match event {
            0 => Some(QualityEvent::VsyncOk),
            1 => Some(QualityEvent::VsyncMissing),
            2 => Some(QualityEvent::VsyncEarly),
            3 => Some(QualityEvent::Safe1Ok),
            4 => Some(QualityEvent::Safe1Error),
            5 => Some(QualityEvent::Safe2Error),
            6 => Some(QualityEvent::ParameterOrPipeWord),
            7 => Some(QualityEvent::AccelerationWord),
            8 => Some(QualityEvent::UnknownSpecial),
            9 => Some(QualityEvent::LowRssi),
            10 => Some(QualityEvent::Test2),
            _ => None,
        })?);
        OK
    })
}

/// The value of the monitor, 0..15, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_quality_value(quality: Option<&sw_hdsl_quality_t>) -> sw_result_t {
    border(|| Ok(sw_hdsl_quality_t::look(quality)?.value().into()))
}

/// Whether the link is lost; true for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_quality_is_lost(quality: Option<&sw_hdsl_quality_t>) -> bool {
    sw_hdsl_quality_t::look(quality).map_or(true, |it| it.is_lost())
}
