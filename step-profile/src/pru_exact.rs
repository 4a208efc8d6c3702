//! The step time arithmetic of the PRU, register by register.
//!
//! TIDEP0061, section 2.3.2, Equations 1 to 4 and Table 2. All arithmetic is that of 32-bit registers:
//! sums, differences and products wrap, conversions truncate.
//!
//! ```text
//! R28 = ramp entry, R29 = speed      R27:R26 = R28 * R29            t_step    = product bits 47..16   ns
//! R28 = t_step,     R29 = 1073742    R27:R26 = R28 * R29            4us_cnt   = R27, product / 2^32   cycles
//! R28 = 4000,       R29 = 4us_cnt    R27:R26 = R28 * R29            t_4us_cnt = R26                   ns
//! R23 = previous sync_time + t_step  R29     = R23 - R26            sync_time                         ns in the cycle
//! if R29 >= 4000 { R29 -= 4000; 4us_cnt += 1 }
//! ```
//!
//! # Where it is exact
//!
//! The reciprocal is a little too large: 1073742 · 4000 = 2^32 + 704. With t_step = 4000 m + r and d = 4000 - r, the
//! time left to the next whole cycle,
//!
//! ```text
//! t_step · 1073742 / 2^32  =  m + 1 + (704 (m + 1) - 1073742 d) / 2^32
//! ```
//!
//! For 32-bit step times the last term lies in -1..1, so the quotient is m, or m + 1 if 1073742 d <= 704 (m + 1). That
//! is so for d = 1 from m = 1525 on, which makes the quotient exact for t_step < [`EXACT_BELOW`], and never for d above
//! 703.
//!
//! A quotient that is one too large makes the difference -d instead of r. If the previous sync_time is d or more, the sum
//! is right again: the carry only came earlier. If it is less, the sum wraps, the unsigned comparison takes it for a late
//! one, and 4us_cnt ends two above the true one with a sync_time near 2^32: the move never recovers.
//! [`corrected`](crate::corrected) does not have this limit.

use crate::interval::{CYCLE_NS, Interval, StepTime, step_time_ns};

/// 2^32 / 4000 rounded up: `FOUR_US_P32_CONST` of TI's `sorte_master_cfg.inc`.
pub(crate) const RECIPROCAL: u32 = 1_073_742;

/// The quotient by TI's reciprocal, 1073742 / 2^32, is exact for every step time below this one, in ns.
pub const EXACT_BELOW: u32 = 6_103_999;

/// What the sequence leaves in its registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Registers {
    /// Time of the step in ns (first product, bits 47..16).
    pub t_step: u32,
    /// 4us_cnt before the adjustment (second product, bits 63..32).
    pub cnt_raw: u32,
    /// 4us_cnt in ns (third product, bits 31..0).
    pub t_4us_cnt: u32,
    /// sync_time before the adjustment.
    pub sync_raw: u32,
    /// 4us_cnt: cycles from the cycle of the previous pulse to the cycle of this one.
    pub cnt: u32,
    /// sync_time: start of the pulse in its cycle, in ns; 0..=3999 as long as the sequence is exact.
    pub sync: u32,
}

/// Runs the sequence: ramp entry (1000 / sin²), speed constant (2^16 / f\[MHz\]) and the previous sync_time in ns.
///
/// ```
/// let step = step_profile::pru_exact::run(415_345, 262_144, 0);
/// assert_eq!((step.t_step, step.cnt, step.sync), (1_661_380, 415, 1_380));
/// ```
pub const fn run(entry: u32, speed: u32, prev: u32) -> Registers {
    let t_step = step_time_ns(entry, speed);
    let Interval { cnt: cnt_raw, rest, .. } = interval(t_step);
    let StepTime { cnt, sync } = step(entry, speed, prev);
    Registers { t_step, cnt_raw, t_4us_cnt: t_step.wrapping_sub(rest), sync_raw: prev.wrapping_add(rest), cnt, sync }
}

/// Returns only the two results.
#[inline]
pub const fn step(entry: u32, speed: u32, prev: u32) -> StepTime {
    interval(step_time_ns(entry, speed)).after(prev)
}

/// Splits a step time into whole cycles and the rest; the rest wraps below zero if the quotient is one too large.
#[inline]
pub const fn interval(t_step: u32) -> Interval {
    let cnt = ((t_step as u64).wrapping_mul(RECIPROCAL as u64) >> 32) as u32;
    Interval { cnt, rest: t_step.wrapping_sub(cnt.wrapping_mul(CYCLE_NS)), fraction: 0 }
}
