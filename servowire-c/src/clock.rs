//! Time from the timer of the firmware.

use core::mem::MaybeUninit;

use servowire_core::{TickRate, TimeBase};

use crate::border::{OK, Refused, border, state};
use crate::result::{sw_code_t, sw_result_t};

/// No time: what `sw_clock_ns()` gives for a clock that cannot be trusted. Every function refuses it, and
/// all times from 2^63 ns onwards, with `SW_E_CLOCK`, so that a little less or more than it is refused too.
pub const SW_NO_TIME: u64 = u64::MAX;

/// Nanoseconds from a free-running 32-bit timer that wraps. Only one context at a time may use it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_clock_t {
    pub(crate) _private: [MaybeUninit<u64>; 6],
}
state!(sw_clock_t, TimeBase<32>, 0x81);

/// Sets the rate of the timer, once: at least 1 MHz (a coarser timer cannot tell one field from the next:
/// SW_E_ARGUMENT). The time is 0 ns now, when the timer reads `ticks`.
#[unsafe(no_mangle)]
pub extern "C" fn sw_clock_start(
    clock: Option<&mut MaybeUninit<sw_clock_t>>,
    timer_hz: u32,
    ticks: u32,
) -> sw_result_t {
    border(|| {
        let rate = TickRate::new(timer_hz).map_err(|_| sw_code_t::SW_E_ARGUMENT as sw_result_t)?;
        sw_clock_t::start(clock, TimeBase::new(rate, ticks))?;
        OK
    })
}

/// Returns the time in ns since the start, from a reading of the timer. It never goes back and wraps after
/// 584 years.
///
/// The timer has to be read within half of its range, 12.6 s at 170 MHz. A timer that went back or was not read for too long gives
/// SW_NO_TIME, once, which all other functions refuse; after that, time continues from where it was.
/// If several priorities do this, read the timer and make this call within one critical section.
#[unsafe(no_mangle)]
pub extern "C" fn sw_clock_ns(clock: Option<&mut sw_clock_t>, ticks: u32) -> u64 {
    sw_clock_t::get(clock).ok().and_then(|time| time.now_ns(ticks).ok()).unwrap_or(SW_NO_TIME)
}

/// A time that can be trusted.
#[inline(always)]
pub(crate) fn time(ns: u64) -> Result<u64, Refused> {
    if ns >> 63 != 0 { Err(sw_code_t::SW_E_CLOCK as sw_result_t) } else { Ok(ns) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 170 MHz is 1000 ns every 170 ticks.
    #[test]
    fn the_timer_wraps_and_its_faults_give_no_time() {
        let mut place = MaybeUninit::zeroed();
        assert_eq!(sw_clock_start(Some(&mut place), 32_768, 0), -2);
        assert_eq!(sw_clock_start(None, 170_000_000, 0), -1);
        assert_eq!(sw_clock_start(Some(&mut place), 170_000_000, u32::MAX - 295), 0);
        // SAFETY: it was started.
        let clock = unsafe { place.assume_init_mut() };
        let read: [u64; 4] = [u32::MAX - 125, 44, 27, 197].map(|ticks| sw_clock_ns(Some(clock), ticks));
        assert_eq!(read, [1_000, 2_000, SW_NO_TIME, 3_000]);
        assert_eq!(sw_clock_ns(None, 0), SW_NO_TIME);
        let mut zeroed = sw_clock_t { _private: [MaybeUninit::zeroed(); 6] };
        assert_eq!(sw_clock_ns(Some(&mut zeroed), 0), SW_NO_TIME);
    }
}
