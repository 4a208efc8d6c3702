//! The time from a counter that wraps.

use core::hint::black_box;

use servowire_core::{TickRate, TimeBase};

use super::kernels;

/// 133 MHz: 7.5 ns and a fraction that never ends, as at 48 and 170 MHz.
static mut TIME: TimeBase<32> = TimeBase::new(TickRate::of::<133_000_000>(), 0);
static mut TIME_48: TimeBase<32> = TimeBase::new(TickRate::of::<48_000_000>(), 0);
static mut TIME_170: TimeBase<32> = TimeBase::new(TickRate::of::<170_000_000>(), 0);

/// Readings of the counter, all of them forward, over a wrap.
const READINGS: [u32; 4] = [0x1000_0001, 0x7fff_ffff, 0xf000_ffff, 0x0123_4567];

kernels! {
    /// A reading of the cycle counter as ns. One in four of them is over a wrap.
    fn core_time_base(counter: &u32) -> u64 {
        // SAFETY: nobody else has it, and no interrupt is enabled. What is in it is hidden from the optimiser.
        let time = unsafe { &mut *black_box(&raw mut TIME) };
        time.now_ns(*counter).unwrap_or(0)
    } over READINGS;

    /// The same at 48 MHz.
    fn core_time_base_48(counter: &u32) -> u64 {
        // SAFETY: as above.
        let time = unsafe { &mut *black_box(&raw mut TIME_48) };
        time.now_ns(*counter).unwrap_or(0)
    } over READINGS;

    /// The same at 170 MHz.
    fn core_time_base_170(counter: &u32) -> u64 {
        // SAFETY: as above.
        let time = unsafe { &mut *black_box(&raw mut TIME_170) };
        time.now_ns(*counter).unwrap_or(0)
    } over READINGS;
}
