//! Blocks on a 16- or 32-bit bus.
//!
//! The words are numbers: the byte that goes out first is in bits 7-0 of the first word, on every host. Only the
//! picture of a word in the host's memory depends on its byte order, so packing is done with shifts and never by
//! looking at the same memory as bytes and as words. System Design Guide for Master, figure of the byte order.
//!
//! ```text
//! 32-bit word k   byte 4k+3 | byte 4k+2 | byte 4k+1 | byte 4k
//! 16-bit word k                           byte 2k+1 | byte 2k
//! ```
//!
//! Three things that a host has to see to itself: the memory of the ASIC must not be cached, and a write buffer must be
//! emptied before the ASIC is told to go on; on a host whose addresses count 16-bit units (TMS320F28388) every address of the
//! ASIC, which the vendor gives in bytes, is halved. System Design Guide for Master, notes on the host.
//!
//! The words are written to where the caller wants them, for one block or for the memory of a whole ring. Where
//! the bytes already lie in that memory ([`image_to_words32`]), they are turned in place.

/// The two sides do not have the same size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("{bytes} bytes do not fill {words} words exactly")]
pub struct SizeMismatch {
    /// Bytes given.
    pub bytes: usize,
    /// Words given.
    pub words: usize,
}

/// Packs bytes into 32-bit words.
///
/// ```
/// let mut words = [0; 4];
/// let block = [0xc5, 0x20, 0xc1, 0, 0xe8, 0x03, 0, 0, 0, 0, 0, 0, 0x9c, 0xff, 0xff, 0xff];
/// rtex_block::pack::to_words32(&block, &mut words).unwrap();
/// assert_eq!(words, [0x00c1_20c5, 1_000, 0, 0xffff_ff9c]);
/// ```
///
/// # Errors
/// [`SizeMismatch`] unless there are four bytes a word; nothing is written then.
pub fn to_words32(bytes: &[u8], words: &mut [u32]) -> Result<(), SizeMismatch> {
    check(bytes.len(), words.len(), 4)?;
    for (word, chunk) in words.iter_mut().zip(bytes.chunks_exact(4)) {
        if let Ok(four) = chunk.try_into() {
            *word = u32::from_le_bytes(four);
        }
    }
    Ok(())
}

/// Packs bytes into 16-bit words.
///
/// # Errors
/// [`SizeMismatch`] unless there are two bytes a word; nothing is written then.
pub fn to_words16(bytes: &[u8], words: &mut [u16]) -> Result<(), SizeMismatch> {
    check(bytes.len(), words.len(), 2)?;
    for (word, chunk) in words.iter_mut().zip(bytes.chunks_exact(2)) {
        if let Ok(two) = chunk.try_into() {
            *word = u16::from_le_bytes(two);
        }
    }
    Ok(())
}

/// Unpacks 32-bit words into bytes.
///
/// # Errors
/// [`SizeMismatch`] unless there are four bytes a word; nothing is written then.
pub fn from_words32(words: &[u32], bytes: &mut [u8]) -> Result<(), SizeMismatch> {
    check(bytes.len(), words.len(), 4)?;
    for (chunk, word) in bytes.chunks_exact_mut(4).zip(words) {
        if let Ok(four) = chunk.try_into() {
            let four: &mut [u8; 4] = four;
            *four = word.to_le_bytes();
        }
    }
    Ok(())
}

/// Unpacks 16-bit words into bytes.
///
/// # Errors
/// [`SizeMismatch`] unless there are two bytes a word; nothing is written then.
pub fn from_words16(words: &[u16], bytes: &mut [u8]) -> Result<(), SizeMismatch> {
    check(bytes.len(), words.len(), 2)?;
    for (chunk, word) in bytes.chunks_exact_mut(2).zip(words) {
        if let Ok(two) = chunk.try_into() {
            let two: &mut [u8; 2] = two;
            *two = word.to_le_bytes();
        }
    }
    Ok(())
}

/// Turns words whose memory was filled byte by byte into numbers, in place; nothing to do on a little-endian host.
pub fn image_to_words32(words: &mut [u32]) {
    for word in words {
        *word = u32::from_le(*word);
    }
}

/// Turns words whose memory was filled byte by byte into numbers, in place; nothing to do on a little-endian host.
pub fn image_to_words16(words: &mut [u16]) {
    for word in words {
        *word = u16::from_le(*word);
    }
}

fn check(bytes: usize, words: usize, width: usize) -> Result<(), SizeMismatch> {
    if words.checked_mul(width) == Some(bytes) { Ok(()) } else { Err(SizeMismatch { bytes, words }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn there_and_back(bytes: [u8; 32]) {
            let (mut wide, mut narrow, mut back) = ([0; 8], [0; 16], [0; 32]);
            to_words32(&bytes, &mut wide).unwrap();
            from_words32(&wide, &mut back).unwrap();
            prop_assert_eq!(back, bytes);
            to_words16(&bytes, &mut narrow).unwrap();
            from_words16(&narrow, &mut back).unwrap();
            prop_assert_eq!(back, bytes);
            for (k, word) in wide.iter().enumerate() {
                prop_assert_eq!(word & 0xff, u32::from(bytes[4 * k]));
                prop_assert_eq!(u32::from(narrow[2 * k + 1]) << 16 | u32::from(narrow[2 * k]), *word);
            }
            let mut image = bytes.chunks(4).map(|c| u32::from_ne_bytes(c.try_into().unwrap())).collect::<std::vec::Vec<_>>();
            image_to_words32(&mut image);
            prop_assert_eq!(image, wide);
        }
    }

    #[test]
    fn sizes_must_agree() {
        let mut words = [7; 4];
        for size in (0..=32).filter(|&n| n != 16) {
            let refused = to_words32(&[0; 32][..size], &mut words);
            assert_eq!(refused, Err(SizeMismatch { bytes: size, words: 4 }));
        }
        assert_eq!(words, [7; 4]);
    }
}
