//! Measures how much stack was used: the stack is filled with a pattern before `main` and searched later.

use core::ptr;

const PATTERN: u32 = 0x5eed_5eed;
/// What this function itself may be using below the stack pointer.
const IN_USE: u32 = 64;

unsafe extern "C" {
    static mut _stack_end: u32;
    static mut _stack_start: u32;
}

/// The lowest and the highest address of the stack, `_stack_end` and `_stack_start` of the linker script.
fn bounds() -> (*mut u32, *mut u32) {
    (&raw mut _stack_end, &raw mut _stack_start)
}

/// Fills the unused part.
#[inline(always)]
pub fn paint() {
    let (mut at, _) = bounds();
    let end = cortex_m::register::msp::read() - IN_USE;
    while (at as u32) < end {
        // SAFETY: below the stack pointer and above the static variables nothing lives.
        unsafe { ptr::write_volatile(at, PATTERN) };
        at = at.wrapping_add(1);
    }
}

/// Returns the largest use so far, in bytes.
pub fn used() -> usize {
    let (mut at, end) = bounds();
    // SAFETY: as above; reading what may be in use is harmless.
    while at < end && unsafe { ptr::read_volatile(at) } == PATTERN {
        at = at.wrapping_add(1);
    }
    end as usize - at as usize
}
