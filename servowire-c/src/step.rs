//! The published step time sequence of TI's CNC router.

use core::mem::MaybeUninit;

use step_profile::{Error, Parameters, Profile, RampTable, Speed, corrected, pru_exact, step_time_ns};

use crate::border::{OK, Refused, border, there};
use crate::result::{Protocol, refused, sw_result_t};

/// Refusals of step-profile, in the order of their numbers.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_step_error_t {
    /// No steps an entry.
    SW_E_STEP_ZERO_SEGMENT_LENGTH = -0x701,
    /// Too many steps an entry.
    SW_E_STEP_SEGMENT_TOO_LONG = -0x702,
    /// Two steps could fall into one cycle.
    SW_E_STEP_STEP_RATE_TOO_HIGH = -0x703,
    /// The first step takes longer than 32 bits count.
    SW_E_STEP_STEP_TIME_OVERFLOW = -0x704,
    /// The sync time does not lie in a cycle.
    SW_E_STEP_SYNC_TIME_OUT_OF_RANGE = -0x705,
    /// The frequency is too low.
    SW_E_STEP_FREQUENCY_TOO_LOW = -0x708,
}

/// When a step comes.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_step_time_t {
    /// Cycles of 4 us to wait.
    pub cnt: u32,
    /// Time in that cycle, ns.
    pub sync: u32,
}

fn error(error: Error) -> Refused {
    refused(Protocol::Step, error.class().number())
}

/// Entry `i` of the published ramp, 0..31: 1000 / sin² of the step time at full speed; 0 for another.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_ramp(i: u8) -> u32 {
    if i < 32 { RampTable::SIN2.entry(i) } else { 0 }
}

/// The speed constant for a step frequency in Hz.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_speed(hz: u32, speed: Option<&mut MaybeUninit<u32>>) -> sw_result_t {
    border(|| {
        there(speed)?.write(Speed::from_hz(hz).map_err(error)?.raw());
        OK
    })
}

/// The time of a step in ns: an entry of the ramp at a speed; modulo 2^32.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_time_ns(entry: u32, speed: u32) -> u32 {
    step_time_ns(entry, speed)
}

/// The next step, `t_step` ns after one that came `prev` ns into its cycle.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_next(t_step: u32, prev: u32, time: Option<&mut MaybeUninit<sw_step_time_t>>) -> sw_result_t {
    border(|| {
        let next = corrected(t_step, prev);
        there(time)?.write(sw_step_time_t { cnt: next.cnt, sync: next.sync });
        OK
    })
}

/// The same as the PRU computes it, its errors included, for an entry of the ramp at a speed.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_next_as_pru(
    entry: u32,
    speed: u32,
    prev: u32,
    time: Option<&mut MaybeUninit<sw_step_time_t>>,
) -> sw_result_t {
    border(|| {
        let next = pru_exact::step(entry, speed, prev);
        there(time)?.write(sw_step_time_t { cnt: next.cnt, sync: next.sync });
        OK
    })
}

/// Whether a move with the published ramp is possible: `k` steps an entry, the first step `init_sync` ns into its cycle. `pru_is_exact`
/// (may be NULL) tells whether the PRU computes it without error.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_check(
    speed: u32,
    k: u32,
    init_sync: u32,
    pru_is_exact: Option<&mut MaybeUninit<bool>>,
) -> sw_result_t {
    border(|| {
        let parameters = Parameters::at(Speed::from_raw(speed)).with_steps_per_entry(k).with_init_sync(init_sync);
        let profile = Profile::new(parameters).map_err(error)?;
        if let Some(exact) = pru_is_exact {
            exact.write(profile.pru_is_exact());
        }
        OK
    })
}

/// How long a move of `steps` with the published ramp takes, ns.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_duration_ns(
    speed: u32,
    k: u32,
    init_sync: u32,
    steps: u32,
    ns: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| {
        let ns = there(ns)?;
        let parameters = Parameters::at(Speed::from_raw(speed)).with_steps_per_entry(k).with_init_sync(init_sync);
        ns.write(Profile::new(parameters).map_err(error)?.duration_ns(steps));
        OK
    })
}

/// A ramp has as many entries as the functions above say.
const _: () = assert!(RampTable::LEN == 32);
