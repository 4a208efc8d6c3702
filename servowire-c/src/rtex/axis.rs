//! One axis of the ring, once an update period.

use core::mem::MaybeUninit;
use core::num::NonZeroU16;

use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, CommandCounter, Heard, Limits, Sent, SetpointError, StopCategory,
    StopReason, Turn,
};
use rtex_block::position::Gear;
use rtex_block::{Command32, ControlBits, ErrorCode, MacId, Policy, Response, UpdateCounter};

use super::names::{sw_rtex_axis_code_t, sw_rtex_error_t, sw_rtex_reason_t};
use crate::border::{OK, block, border, in_range, read, state, there};
use crate::clock::time;
use crate::result::sw_result_t;

/// One axis of the ring: its drive's state, echo, limits and set-point. Its content is private; it may be
/// copied. Only one context at a time may use it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_axis_t {
    pub(crate) _private: [MaybeUninit<u64>; 62],
}
state!(sw_rtex_axis_t, Master, 0x41);

#[derive(Clone, Copy)]
pub(crate) struct Master {
    pub(super) axis: Axis,
    counter: CommandCounter,
    pub(super) turn: Turn,
    /// What was sent before the last block.
    before: Sent,
}

impl Master {
    /// Returns the commands of the next update period, which count as sent.
    pub(super) fn send(&mut self, turn: Turn) -> Command32 {
        self.before = self.axis.sent();
        self.axis.transmission(turn)
    }
}

/// The configuration of an axis. Limits are counted in update periods.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_config_t {
    /// Update period, ns.
    pub update_ns: u32,
    /// Update periods of invalid data at the start; 0 if they were already sent elsewhere.
    pub invalid: u32,
    /// Waits for Servo_Active, for an answer, for a stop.
    pub wait: u32,
    /// Wait for Servo_Ready; 0 waits for ever.
    pub ready: u32,
    /// Wait for Servo_Active to go; 0 is `wait`.
    pub inactive: u32,
    /// Electronic gear of the drive, numerator.
    pub gear_numerator: u32,
    /// Electronic gear of the drive, denominator.
    pub gear_denominator: u32,
    /// Responses without a new echo after which the axis stops, 1 or more.
    pub echo: u16,
    /// Responses with CMD_Error after which it stops, 1 or more.
    pub command_errors: u16,
    /// MAC-ID, 0..31.
    pub mac_id: u8,
    /// sw_rtex_mode_t.
    pub mode: u8,
}

/// The state of an axis.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_state_of_t {
    /// MAC-ID that answered, class of the refusal, place of another axis, or error code of the drive, if
    /// the reason has one.
    pub detail: u16,
    /// sw_rtex_axis_code_t.
    pub code: u8,
    /// sw_rtex_reason_t.
    pub reason: u8,
}

/// Feedback that may be used.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_feedback_t {
    /// When the block was heard.
    pub sampled_ns: u64,
    /// Actual position in command units.
    pub position: i32,
}

/// Prepares an axis whose drive has not answered yet.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_start(
    axis: Option<&mut MaybeUninit<sw_rtex_axis_t>>,
    config: Option<&sw_rtex_config_t>,
) -> sw_result_t {
    border(|| {
        let it = there(config)?;
        let mut limits = Limits::new(in_range(NonZeroU16::new(it.echo))?, it.wait)
            .with_command_errors(in_range(NonZeroU16::new(it.command_errors))?)
            .with_ready((it.ready > 0).then_some(it.ready));
        if it.inactive > 0 {
            limits = limits.with_inactive(it.inactive);
        }
        let gear = in_range(Gear::new(it.gear_numerator, it.gear_denominator))?;
        let (mac_id, mode) = (in_range(MacId::new(it.mac_id))?, in_range(ActiveCode::from_code(it.mode))?);
        in_range((it.update_ns > 0).then_some(()))?;
        let config = AxisConfig::new(mac_id, mode, it.update_ns, limits).with_gear(gear);
        let turn = if it.invalid > 0 { Turn::Invalid } else { Turn::Valid(UpdateCounter::ZERO) };
        let new = Axis::new(config);
        let (before, counter) = (new.sent(), CommandCounter::new(it.invalid));
        let state = Master { axis: new, counter, turn, before };
        sw_rtex_axis_t::start(axis, state)?;
        OK
    })
}

/// Takes the result of an update period: the block of this axis, or NULL if there was none, heard until
/// `end_ns`. A block of another length is a refused one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_axis_hear(
    axis: Option<&mut sw_rtex_axis_t>,
    bytes: *const u8,
    len: usize,
    end_ns: u64,
) -> sw_result_t {
    border(|| {
        let (it, end_ns) = (sw_rtex_axis_t::get(axis)?, time(end_ns)?);
        let heard = if bytes.is_null() {
            Heard::Nothing
        } else {
            // SAFETY: the caller of the C function vouches for his memory.
            Heard::from(Response::parse(unsafe { read(bytes, len)? }))
        };
        it.axis.hear(it.turn, &heard, end_ns);
        OK
    })
}

/// Writes the block of the next update period, 16 bytes, which counts as sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_axis_transmit(
    axis: Option<&mut sw_rtex_axis_t>,
    bytes: *mut u8,
    size: usize,
) -> sw_result_t {
    border(|| {
        let it = sw_rtex_axis_t::get(axis)?;
        // A period that cannot be written down is not begun.
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { block(bytes, size)? };
        it.turn = it.counter.next();
        bytes.write(it.send(it.turn).main.emit());
        OK
    })
}

/// Takes back that the last block counts as sent, because it could not be written to the ASIC: the drive still has the one
/// before, from which the next step, a stop and switching on go on. Once for each such block, before the next one.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_not_sent(axis: Option<&mut sw_rtex_axis_t>) -> sw_result_t {
    border(|| {
        let it = sw_rtex_axis_t::get(axis)?;
        it.axis.not_sent(it.before);
        OK
    })
}

/// Switches the servo on: SW_E_RTEX_NOT_NOW if the axis is not off, no new position has come, or the drive is not ready.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_switch_on(axis: Option<&mut sw_rtex_axis_t>) -> sw_result_t {
    border(|| {
        sw_rtex_axis_t::get(axis)?.axis.switch_on().map_err(|_| sw_rtex_error_t::SW_E_RTEX_NOT_NOW as sw_result_t)?;
        OK
    })
}

/// Switches the servo off.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_switch_off(axis: Option<&mut sw_rtex_axis_t>) -> sw_result_t {
    border(|| {
        sw_rtex_axis_t::get(axis)?.axis.switch_off();
        OK
    })
}

/// Stops by category 0 (servo off at once), 1 (slow down, then off) or 2 (slow down and hold), as far as the limits of the axis allow.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_stop(axis: Option<&mut sw_rtex_axis_t>, category: u8) -> sw_result_t {
    border(|| {
        let it = sw_rtex_axis_t::get(axis)?;
        let category = match category {
            1 => StopCategory::One,
            2 => StopCategory::Two,
            // A stop wins: whatever else is asked for is the shortest one.
            _ => StopCategory::Zero,
        };
        it.axis.stop(category);
        OK
    })
}

/// Leaves the stop: the axis may be switched on again when its drive allows.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_clear(axis: Option<&mut sw_rtex_axis_t>) -> sw_result_t {
    border(|| {
        sw_rtex_axis_t::get(axis)?.axis.clear();
        OK
    })
}

fn setpoint(result: Result<(), SetpointError>) -> Result<sw_result_t, sw_result_t> {
    match result {
        Ok(()) => OK,
        Err(SetpointError::Step { .. } | SetpointError::Rate { .. }) => {
            Err(sw_rtex_error_t::SW_E_RTEX_TOO_FAR as sw_result_t)
        }
        Err(_) => Err(sw_rtex_error_t::SW_E_RTEX_NOT_NOW as sw_result_t),
    }
}

/// Sets the target of CP in command units. SW_E_RTEX_TOO_FAR if the step from the last one is more than the
/// drive's gear and the limits allow, SW_E_RTEX_NOT_NOW if the axis is not on or in another mode; the
/// set-point then stays.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_set_position(axis: Option<&mut sw_rtex_axis_t>, position: i32) -> sw_result_t {
    border(|| setpoint(sw_rtex_axis_t::get(axis)?.axis.set_position(position)))
}

/// Sets the speed of CV or the torque of CT, in the units of the drive.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_set_rate(axis: Option<&mut sw_rtex_axis_t>, rate: i32) -> sw_result_t {
    border(|| setpoint(sw_rtex_axis_t::get(axis)?.axis.set_rate(rate)))
}

/// Sets the control bits other than Servo_On and the stops (sw_rtex_control_t, added), from the next block
/// onwards.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_set_control(axis: Option<&mut sw_rtex_axis_t>, control: u16) -> sw_result_t {
    border(|| {
        sw_rtex_axis_t::get(axis)?.axis.set_control(ControlBits::from_bits_retain(control));
        OK
    })
}

/// The set-point: in CP the target in command units; 0 for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_setpoint(axis: Option<&sw_rtex_axis_t>) -> i32 {
    sw_rtex_axis_t::look(axis).map_or(0, |it| it.axis.setpoint())
}

fn reason(reason: StopReason) -> (sw_rtex_reason_t, u16) {
    match reason {
        StopReason::EchoTimeout => (sw_rtex_reason_t::SW_RTEX_ECHO_TIMEOUT, 0),
        StopReason::WrongMacId(other) => (sw_rtex_reason_t::SW_RTEX_WRONG_MAC_ID, other.get().into()),
        StopReason::Refused(class) => (sw_rtex_reason_t::SW_RTEX_REFUSED, class.number().into()),
        StopReason::ReceiveTimeout => (sw_rtex_reason_t::SW_RTEX_RECEIVE_TIMEOUT, 0),
        StopReason::Alarm => (sw_rtex_reason_t::SW_RTEX_ALARM, 0),
        StopReason::NotReady => (sw_rtex_reason_t::SW_RTEX_NOT_READY, 0),
        StopReason::NotActive => (sw_rtex_reason_t::SW_RTEX_NOT_ACTIVE, 0),
        StopReason::ReadyTimeout => (sw_rtex_reason_t::SW_RTEX_READY_TIMEOUT, 0),
        StopReason::ActiveTimeout => (sw_rtex_reason_t::SW_RTEX_ACTIVE_TIMEOUT, 0),
        StopReason::InactiveTimeout => (sw_rtex_reason_t::SW_RTEX_INACTIVE_TIMEOUT, 0),
        StopReason::CommandError(ErrorCode(code)) => (sw_rtex_reason_t::SW_RTEX_COMMAND_ERROR, code),
        StopReason::OtherAxis { place } => (sw_rtex_reason_t::SW_RTEX_OTHER_AXIS, place.into()),
        StopReason::Requested => (sw_rtex_reason_t::SW_RTEX_REQUESTED, 0),
        StopReason::HomingTimeout => (sw_rtex_reason_t::SW_RTEX_HOMING_TIMEOUT, 0),
        _ => (sw_rtex_reason_t::SW_RTEX_OTHER_REASON, 0),
    }
}

/// The state of the axis, and the reason.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axis_state(
    axis: Option<&sw_rtex_axis_t>,
    state: Option<&mut MaybeUninit<sw_rtex_state_of_t>>,
) -> sw_result_t {
    border(|| {
        let (it, state) = (sw_rtex_axis_t::look(axis)?, there(state)?);
        let (code, why) = match it.axis.state() {
            AxisState::Starting => (sw_rtex_axis_code_t::SW_RTEX_STARTING, None),
            AxisState::Off => (sw_rtex_axis_code_t::SW_RTEX_OFF, None),
            AxisState::SwitchingOn => (sw_rtex_axis_code_t::SW_RTEX_SWITCHING_ON, None),
            AxisState::On => (sw_rtex_axis_code_t::SW_RTEX_ON, None),
            AxisState::Stopping(why) => (sw_rtex_axis_code_t::SW_RTEX_STOPPING, Some(why)),
            AxisState::Held(why) => (sw_rtex_axis_code_t::SW_RTEX_HELD, Some(why)),
            AxisState::SwitchingOff => (sw_rtex_axis_code_t::SW_RTEX_SWITCHING_OFF, None),
            AxisState::Stopped(why) => (sw_rtex_axis_code_t::SW_RTEX_STOPPED, Some(why)),
        };
        let (why, detail) = why.map_or((sw_rtex_reason_t::SW_RTEX_NO_REASON, 0), reason);
        state.write(sw_rtex_state_of_t { detail, code: code as u8, reason: why as u8 });
        OK
    })
}

/// The actual position, judged now: **false if it must not be used**: never heard, older than `max_age_ns`, an alarm of the drive.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_feedback(
    axis: Option<&sw_rtex_axis_t>,
    now_ns: u64,
    max_age_ns: u64,
    feedback: Option<&mut MaybeUninit<sw_rtex_feedback_t>>,
) -> bool {
    let (Ok(it), Some(feedback), Ok(now_ns)) = (sw_rtex_axis_t::look(axis), feedback, time(now_ns)) else {
        return false;
    };
    let Ok(sample) = it.axis.evidence().at(now_ns, Policy::new(max_age_ns)) else { return false };
    feedback.write(sw_rtex_feedback_t { sampled_ns: sample.sampled_ns(), position: sample.position() });
    true
}
