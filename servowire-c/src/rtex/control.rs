//! Phases of the control, its LED, periods, timers and positions.

use core::mem::MaybeUninit;

use rtex_block::master::{Asic, ControlError, ControlPhase, Inputs, Led, PhaseControl, SlaveInfo, led};
use rtex_block::position::{Gear, is_within_limit, step};
use rtex_block::timing::{FrameTime, Periods, timer_reload};
use rtex_block::type_code::{self, Pr, TypeCode};

use super::names::{sw_rtex_fault_t, sw_rtex_led_t, sw_rtex_phase_t};
use crate::border::{OK, Refused, border, in_range, state, there};
use crate::result::{sw_code_t, sw_result_t};

/// The phases of the control. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_rtex_phases_t {
    pub(crate) _private: [MaybeUninit<u64>; 2],
}
state!(sw_rtex_phases_t, PhaseControl, 0x46);

/// What the phases depend on.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_inputs_t {
    /// sw_rtex_asic_t.
    pub asic: u8,
    /// The slaves that were found are those of the table: 1, they are not: 0; not compared yet: 2.
    pub slave_info: u8,
    /// 1: the first commands are prepared.
    pub tx_ready: u8,
    /// 1: the communication has timed out.
    pub timeout: u8,
}

/// Periods of the communication.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_rtex_periods_t {
    /// Communication period, ns.
    pub com_ns: u32,
    /// Update period, ns.
    pub update_ns: u32,
    /// 1: the internal-timer system may be used.
    pub internal_timer: u8,
}

const fn phase(it: ControlPhase) -> sw_rtex_phase_t {
    match it {
        ControlPhase::Init => sw_rtex_phase_t::SW_RTEX_PH_INIT,
        ControlPhase::Waiting => sw_rtex_phase_t::SW_RTEX_PH_WAITING,
        ControlPhase::Prepare => sw_rtex_phase_t::SW_RTEX_PH_PREPARE,
        ControlPhase::Start => sw_rtex_phase_t::SW_RTEX_PH_START,
        ControlPhase::Running => sw_rtex_phase_t::SW_RTEX_PH_RUNNING,
    }
}

const fn fault(it: Option<ControlError>) -> sw_rtex_fault_t {
    match it {
        None => sw_rtex_fault_t::SW_RTEX_NO_FAULT,
        Some(ControlError::SlaveInfoMismatch) => sw_rtex_fault_t::SW_RTEX_SLAVE_INFO_MISMATCH,
        Some(ControlError::Timeout) => sw_rtex_fault_t::SW_RTEX_TIMEOUT,
    }
}

fn bit(it: u8) -> Result<bool, Refused> {
    in_range((it < 2).then_some(it == 1))
}

/// Prepares a control in PH_INIT.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_phases_start(phases: Option<&mut MaybeUninit<sw_rtex_phases_t>>) -> sw_result_t {
    border(|| {
        sw_rtex_phases_t::start(phases, PhaseControl::new())?;
        OK
    })
}

/// Makes a step of the control; returns the new phase (sw_rtex_phase_t), or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_phases_step(
    phases: Option<&mut sw_rtex_phases_t>,
    inputs: Option<&sw_rtex_inputs_t>,
) -> sw_result_t {
    border(|| {
        let (it, inputs) = (sw_rtex_phases_t::get(phases)?, there(inputs)?);
        let asic = in_range(match inputs.asic {
            0 => Some(Asic::Initial),
            1 => Some(Asic::RingConfig),
            2 => Some(Asic::Ready),
            3 => Some(Asic::Running),
            _ => None,
        })?;
        let slave_info = in_range(match inputs.slave_info {
            0 => Some(Some(SlaveInfo::Mismatch)),
            1 => Some(Some(SlaveInfo::Match)),
            2 => Some(None),
            _ => None,
        })?;
        it.step(Inputs { asic, slave_info, tx_ready: bit(inputs.tx_ready)?, timeout: bit(inputs.timeout)? });
        Ok(phase(it.phase()) as sw_result_t)
    })
}

/// Why the control has stopped: sw_rtex_fault_t, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_phases_fault(phases: Option<&sw_rtex_phases_t>) -> sw_result_t {
    border(|| Ok(fault(sw_rtex_phases_t::look(phases)?.error()) as sw_result_t))
}

/// Returns what the LED shows `t_ms` after the beginning of a lit half period: sw_rtex_led_t, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_led(phase: u8, fault: u8, t_ms: u64) -> sw_result_t {
    border(|| {
        let phase = in_range(match phase {
            0 => Some(ControlPhase::Init),
            1 => Some(ControlPhase::Waiting),
            2 => Some(ControlPhase::Prepare),
            3 => Some(ControlPhase::Start),
            4 => Some(ControlPhase::Running),
            _ => None,
        })?;
        let fault = in_range(match fault {
            0 => Some(None),
            1 => Some(Some(ControlError::SlaveInfoMismatch)),
            2 => Some(Some(ControlError::Timeout)),
            _ => None,
        })?;
        Ok(match led(phase, fault, t_ms) {
            Led::Off => sw_rtex_led_t::SW_RTEX_LED_OFF,
            Led::Green => sw_rtex_led_t::SW_RTEX_LED_GREEN,
            Led::Red => sw_rtex_led_t::SW_RTEX_LED_RED,
        } as sw_result_t)
    })
}

/// The periods for Pr7.20, Pr7.21 and Pr7.91 (ns; below 0: not told) of an A6N drive. SW_E_NO_VALUE for a combination that is not listed.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_periods_a6n(
    pr7_20: i32,
    pr7_21: i32,
    pr7_91: i64,
    periods: Option<&mut MaybeUninit<sw_rtex_periods_t>>,
) -> sw_result_t {
    border(|| {
        let out = there(periods)?;
        let periods = Periods::from_a6n(pr7_20, pr7_21, (pr7_91 >= 0).then_some(pr7_91));
        let it = periods.ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?;
        let Periods { com_ns, update_ns, internal_timer, .. } = it;
        out.write(sw_rtex_periods_t { com_ns, update_ns, internal_timer: internal_timer.into() });
        OK
    })
}

/// Returns how long a frame for this number of axes takes, in ns (System Design Guide for Master).
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_frame_ns(axes: u32) -> u64 {
    FrameTime::GUIDE.estimate_ns(axes)
}

/// How many axes a communication period has room for, by the time on the line.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_axes_within(com_ns: u32) -> u32 {
    FrameTime::GUIDE.axes_within(com_ns)
}

/// The reload value of a timer for a period. SW_E_NO_VALUE if it is not a whole number of ticks.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_timer_reload(
    timer_hz: u32,
    period_ns: u32,
    reload: Option<&mut MaybeUninit<u32>>,
) -> sw_result_t {
    border(|| {
        let out = there(reload)?;
        out.write(timer_reload(timer_hz, period_ns).ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?);
        OK
    })
}

/// The step from one position to the next, through the end of 32 bits too.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_step(before: i32, after: i32) -> i32 {
    step(before, after)
}

/// Whether a step in an update period is within 400 million pulses per second after the electronic gear: 1
/// or 0, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_is_within_limit(
    step: i32,
    update_ns: u32,
    gear_numerator: u32,
    gear_denominator: u32,
) -> sw_result_t {
    border(|| {
        let gear = in_range(Gear::new(gear_numerator, gear_denominator))?;
        Ok(is_within_limit(step, update_ns, gear).into())
    })
}

/// The 12-bit type code of the older drives for one of monitor (sw_rtex_noncyclic_t 10) or system ID (2). SW_E_NO_VALUE if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_conventional(noncyclic: u8, code: u16) -> sw_result_t {
    border(|| {
        let code = in_range(TypeCode::new(code))?;
        let old = match noncyclic {
            2 => type_code::system_id::conventional(code),
            10 => type_code::monitor::conventional(code),
            _ => in_range(None)?,
        };
        Ok(old.ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?.get().into())
    })
}

/// The index of parameter Pr `class`.`number` in a parameter command.
#[unsafe(no_mangle)]
pub extern "C" fn sw_rtex_parameter_index(class: u8, number: u8) -> u16 {
    Pr { class, number }.index()
}
