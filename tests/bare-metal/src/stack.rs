//! Stack of a call: the memory below the stack pointer is painted before it, and looked at after it.

#[cfg(feature = "sorte-proto")]
mod sorte;

use core::hint::black_box;

use cortex_m::register::msp;

/// What is measured.
pub(crate) struct Stack {
    pub(crate) name: &'static str,
    /// Bytes at the deepest point; `u32::MAX` if what was to be measured did not happen.
    pub(crate) bytes: fn() -> u32,
}

pub(crate) const ALL: &[Stack] = &[
    // The measurement sees what is there.
    Stack { name: "known_1000", bytes: || of(known) },
    #[cfg(feature = "sorte-proto")]
    Stack { name: "sorte_master", bytes: sorte::master },
];

const PAINT: u32 = 0x5a5a_5a5a;
/// Words that are painted: 32 KiB, more than any call here takes.
const WORDS: u32 = 8192;

/// Bytes of stack that `call` takes, with its results and the return address, in whole words.
#[inline(never)]
#[expect(unsafe_code, reason = "free stack is memory of nobody")]
pub(crate) fn of(call: impl FnOnce()) -> u32 {
    let top = msp::read();
    let places = || (1..=WORDS).map(|word| (word, top.wrapping_sub(word * 4) as *mut u32));
    for (_, place) in places() {
        // SAFETY: below the stack pointer and in RAM, of which 4 MB are there; no interrupt is enabled.
        unsafe { place.write_volatile(PAINT) };
    }
    run(call);
    // SAFETY: as above.
    let touched = places().filter(|(_, place)| unsafe { place.read_volatile() } != PAINT);
    touched.map(|(word, _)| word).max().unwrap_or(0) * 4
}

/// 1000 bytes and little more.
fn known() {
    let mut array = [0_u8; 1000];
    black_box(&mut array);
}

/// Keeps the call out of the frame of its caller.
#[inline(never)]
fn run(call: impl FnOnce()) {
    call();
}
