//! The published step time sequence of TI's CNC router.

use core::mem::MaybeUninit;

use step_profile::{
    Arithmetic, Error, Microstep, Parameters, Profile, RampStep, RampTable, Speed, Tone, Turn, corrected, pru_exact,
    step_time_ns,
};

use crate::border::{OK, Refused, border, in_range, read, room, there};
use crate::result::{Protocol, refused, sw_result_t};

/// Refusals of step-profile, in the order of their numbers.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_step_error_t {
    /// 0 steps per entry.
    SW_E_STEP_ZERO_SEGMENT_LENGTH = -0x701,
    /// Too many steps per entry.
    SW_E_STEP_SEGMENT_TOO_LONG = -0x702,
    /// Two steps could fall into one cycle.
    SW_E_STEP_STEP_RATE_TOO_HIGH = -0x703,
    /// The first step takes longer than 32 bits can count.
    SW_E_STEP_STEP_TIME_OVERFLOW = -0x704,
    /// The sync time is not within a cycle.
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

/// Entry `i` of the published ramp, 0..31: 1000 / sin² of the step time at full speed; 0 for any other
/// index.
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

/// Computes the next step, `t_step` ns after one that came `prev` ns into its cycle.
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

/// Whether a move with the published ramp is possible: `k` steps per entry, the first step `init_sync` ns
/// into its cycle. `pru_is_exact` (may be NULL) tells whether the PRU computes it without error.
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

/// A step of a move with a ramp.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_step_step_t {
    /// Cycle of 4 us in which it comes, from the first of the move.
    pub cycle: u64,
    /// Time since the previous step, ns.
    pub t_step: u32,
    /// Time in its cycle, ns.
    pub sync_time: u32,
    /// Entry of the ramp.
    pub entry: u8,
}

/// A move with a ramp.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_step_move_t {
    /// Steps of the move.
    pub steps: u32,
    /// Speed constant: sw_step_speed().
    pub speed: u32,
    /// Steps per entry.
    pub k: u32,
    /// Where the first step comes in its cycle, ns.
    pub init_sync: u32,
    /// 1: as the PRU computes it, its errors included; 0: without them.
    pub as_pru: u8,
}

/// The last step with which sw_step_steps() begins.
pub const SW_STEP_FIRST: u32 = 1 << 20;

/// The course of a move.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_step_shape_t {
    /// How long it takes, ns.
    pub duration_ns: u64,
    /// Steps of the ramp up.
    pub accelerating: u32,
    /// Steps at full speed.
    pub constant: u32,
    /// Steps of the ramp down.
    pub decelerating: u32,
    /// 1: the PRU computes it without error.
    pub pru_is_exact: u8,
}

/// Acts on a move with a ramp of 32 entries, or with the published one for NULL.
///
/// # Safety As for [`read`].
unsafe fn with_profile(
    table: *const u32,
    len: usize,
    it: Option<&sw_step_move_t>,
    act: impl FnOnce(Profile<'_>, u32) -> Result<sw_result_t, Refused>,
) -> sw_result_t {
    border(|| {
        let own;
        let it = there(it)?;
        let arithmetic = in_range((it.as_pru < 2).then_some(it.as_pru == 1))?;
        let arithmetic = if arithmetic { Arithmetic::PruExact } else { Arithmetic::Corrected };
        let parameters =
            Parameters::at(Speed::from_raw(it.speed)).with_steps_per_entry(it.k).with_init_sync(it.init_sync);
        let parameters = parameters.with_arithmetic(arithmetic);
        let profile = if table.is_null() {
            Profile::new(parameters)
        } else {
            // SAFETY: the caller vouches for it.
            let entries: [u32; RampTable::LEN] = in_range(unsafe { read(table, len)? }.try_into().ok())?;
            own = RampTable::new(entries).map_err(error)?;
            Profile::new(parameters.with_table(&own))
        };
        act(profile.map_err(error)?, it.steps)
    })
}

/// Tells the shape of a move, with your own ramp of 32 entries, or with the published one if `table` is NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_step_shape(
    table: *const u32,
    len: usize,
    it: Option<&sw_step_move_t>,
    shape: Option<&mut MaybeUninit<sw_step_shape_t>>,
) -> sw_result_t {
    let act = |profile: Profile<'_>, steps| {
        let (out, shape) = (there(shape)?, profile.shape(steps));
        out.write(sw_step_shape_t {
            duration_ns: profile.duration_ns(steps),
            accelerating: shape.accelerating,
            constant: shape.constant,
            decelerating: shape.decelerating,
            pru_is_exact: profile.pru_is_exact().into(),
        });
        OK
    };
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { with_profile(table, len, it, act) }
}

/// Writes the steps of a move from step `first` on, as many as there is room for: `count` is 0 after the last one. All steps before
/// `first` are computed again, so it may be at most SW_STEP_FIRST.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_step_steps(
    table: *const u32,
    len: usize,
    it: Option<&sw_step_move_t>,
    first: u32,
    steps: *mut sw_step_step_t,
    size: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> sw_result_t {
    let act = |profile: Profile<'_>, all| {
        in_range((first <= SW_STEP_FIRST).then_some(()))?;
        // SAFETY: the caller of the C function vouches for his memory.
        let (room, count) = (unsafe { room(steps, size)? }, there(count)?);
        let mut written = 0_usize;
        let first = usize::try_from(first).unwrap_or(usize::MAX);
        for (to, step) in room.iter_mut().zip(profile.steps(all).skip(first)) {
            let RampStep { entry, t_step, cycle, sync_time, .. } = step;
            to.write(sw_step_step_t { cycle, t_step, sync_time, entry });
            written = written.saturating_add(1);
        }
        count.write(written);
        OK
    };
    // SAFETY: as above.
    unsafe { with_profile(table, len, it, act) }
}

/// A ramp has as many entries as the functions above say.
const _: () = assert!(RampTable::LEN == 32);

/// What a micro-step profile of the published application does with a motor of 200 full steps a turn.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_step_microstep_t {
    /// Micro-steps a full step.
    pub microsteps: u32,
    /// Steps of a quarter turn.
    pub quarter_turn: u32,
    /// Steps of a turn.
    pub turn: u32,
    /// Steps of ten turns.
    pub ten_turns: u32,
    /// The mode bits of the DRV8711's CTRL register, in their place.
    pub ctrl_field: u16,
}

/// Micro-step profile 0 (full steps) to 8 (256 micro-steps).
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_microstep(code: u8, profile: Option<&mut MaybeUninit<sw_step_microstep_t>>) -> sw_result_t {
    border(|| {
        let (it, out) = (in_range(Microstep::from_code(code))?, there(profile)?);
        out.write(sw_step_microstep_t {
            microsteps: it.microsteps(),
            quarter_turn: it.steps(Turn::Quarter),
            turn: it.steps(Turn::Full),
            ten_turns: it.steps(Turn::Ten),
            ctrl_field: it.ctrl_field(),
        });
        OK
    })
}

/// Tones of the published application.
pub const SW_STEP_TONES: u8 = 10;
const _: () = assert!(SW_STEP_TONES as usize == Tone::ALL.len());

/// A tone that the motors play.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_step_tone_t {
    /// Speed constant: sw_step_speed().
    pub speed: u32,
    /// Steps of 125 ms.
    pub p125: u32,
    /// Steps of 250 ms.
    pub p250: u32,
    /// Step frequency in Hz, exactly: this by `denominator`.
    pub numerator: u32,
    /// See `numerator`.
    pub denominator: u16,
    /// The tone in 0.1 Hz, cut.
    pub tenths_hz: u16,
}

/// Tone 0 to SW_STEP_TONES - 1: cis, E, fis, G, gis, A, H, cis2, D2, fis2.
#[unsafe(no_mangle)]
pub extern "C" fn sw_step_tone(number: u8, tone: Option<&mut MaybeUninit<sw_step_tone_t>>) -> sw_result_t {
    border(|| {
        let (it, out) = (*in_range(Tone::ALL.get(usize::from(number)))?, there(tone)?);
        let frequency = it.frequency();
        out.write(sw_step_tone_t {
            speed: it.speed().raw(),
            p125: it.p125(),
            p250: it.p250(),
            numerator: frequency.numerator(),
            denominator: frequency.denominator(),
            tenths_hz: it.tenths_hz(),
        });
        OK
    })
}
