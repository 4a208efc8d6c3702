//! Blocks on a bus of 16 or 32 bits.

use rtex_block::pack::{Word, from_words, to_words};

use crate::border::{OK, border, cleared, in_range, read};
use crate::result::sw_result_t;

/// Packs the caller's bytes into his words, which have to hold just these.
///
/// # Safety
/// As for [`read`] and [`crate::border::room`].
unsafe fn pack<W: Word>(bytes: *const u8, len: usize, words: *mut W, count: usize) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        let bytes = unsafe { read(bytes, len)? };
        in_range((count.checked_mul(W::BYTES) == Some(len)).then_some(()))?;
        // SAFETY: as above.
        let words = unsafe { cleared(words, count, count)? };
        in_range(to_words(bytes, words).ok())?;
        OK
    })
}

/// Unpacks them again.
///
/// # Safety
/// As for [`pack`].
unsafe fn unpack<W: Word>(words: *const W, count: usize, bytes: *mut u8, len: usize) -> sw_result_t {
    border(|| {
        // SAFETY: the caller vouches for it.
        let words = unsafe { read(words, count)? };
        in_range((count.checked_mul(W::BYTES) == Some(len)).then_some(()))?;
        // SAFETY: as above.
        let bytes = unsafe { cleared(bytes, len, len)? };
        in_range(from_words(words, bytes).ok())?;
        OK
    })
}

/// Packs a block into words for an ASIC on a 16-bit bus: the byte that is sent first is in the low bits, on every host. SW_E_ARGUMENT
/// unless `count` words hold exactly `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_to_words16(
    bytes: *const u8,
    len: usize,
    words: *mut u16,
    count: usize,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { pack(bytes, len, words, count) }
}

/// Packs a block into words for an ASIC on a 32-bit bus, as sw_rtex_to_words16().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_to_words32(
    bytes: *const u8,
    len: usize,
    words: *mut u32,
    count: usize,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { pack(bytes, len, words, count) }
}

/// Unpacks the words of a 16-bit bus into a block. SW_E_ARGUMENT unless `count` words hold exactly `len` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_from_words16(
    words: *const u16,
    count: usize,
    bytes: *mut u8,
    len: usize,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { unpack(words, count, bytes, len) }
}

/// Unpacks the words of a 32-bit bus into a block, as sw_rtex_from_words16().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_rtex_from_words32(
    words: *const u32,
    count: usize,
    bytes: *mut u8,
    len: usize,
) -> sw_result_t {
    // SAFETY: the caller of the C function vouches for his memory.
    unsafe { unpack(words, count, bytes, len) }
}
