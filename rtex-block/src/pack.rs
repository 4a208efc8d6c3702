//! Blocks on a 16- or 32-bit bus.
//!
//! The words are numbers: the byte that goes out first is in bits 7-0 of the first word, on every host. Only the layout of
//! a word in the host's memory depends on its byte order, so packing uses shifts and never reads the same memory both as
//! bytes and as words. System Design Guide for Master, figure of the byte order.
//!
//! ```text
//! 32-bit word k   byte 4k+3 | byte 4k+2 | byte 4k+1 | byte 4k
//! 16-bit word k                           byte 2k+1 | byte 2k
//! ```
//!
//! A host has to ensure three things itself. The memory of the ASIC must not be cached; a write buffer must be emptied
//! before the ASIC is told to continue; and on a host whose addresses count 16-bit units (TMS320F28388), every address of the
//! ASIC, which the vendor states in bytes, has to be halved. System Design Guide for Master, notes on the host.
//!
//! The words are written to the caller's memory, for one block or for a whole ring.

/// The words and the bytes differ in size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[error("{bytes} bytes do not fill {words} words exactly")]
pub struct SizeMismatch {
    /// Bytes given.
    pub bytes: usize,
    /// Words given.
    pub words: usize,
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for u16 {}
    impl Sealed for u32 {}
}

/// A word of the bus: `u8`, `u16` or `u32`. The byte that goes out first is in its lowest bits, on every host.
pub trait Word: Copy + Default + sealed::Sealed {
    /// Number of bytes in a word.
    const BYTES: usize;
    /// Creates a word from exactly that many bytes; 0 for any other number of bytes.
    #[doc(hidden)]
    fn load(bytes: &[u8]) -> Self;
    /// Writes the word into exactly that many bytes; does nothing for any other number of bytes.
    #[doc(hidden)]
    fn store(self, bytes: &mut [u8]);
}

macro_rules! words {
    ($($word:ty),*) => {$(
        impl Word for $word {
            const BYTES: usize = size_of::<$word>();

            #[inline]
            fn load(bytes: &[u8]) -> Self {
                bytes.try_into().map_or(0, <$word>::from_le_bytes)
            }

            #[inline]
            fn store(self, bytes: &mut [u8]) {
                if let Ok(place) = bytes.try_into() {
                    let place: &mut [u8; size_of::<$word>()] = place;
                    *place = self.to_le_bytes();
                }
            }
        }
    )*};
}
words!(u8, u16, u32);

/// Packs bytes into words.
///
/// ```
/// let mut words = [0_u32; 4];
/// let block = [0xc5, 0x20, 0xc1, 0, 0xe8, 0x03, 0, 0, 0, 0, 0, 0, 0x9c, 0xff, 0xff, 0xff];
/// rtex_block::pack::to_words(&block, &mut words).unwrap();
/// assert_eq!(words, [0x00c1_20c5, 1_000, 0, 0xffff_ff9c]);
/// ```
///
/// # Errors
/// [`SizeMismatch`] unless the words hold exactly these bytes; nothing is written.
pub fn to_words<W: Word>(bytes: &[u8], words: &mut [W]) -> Result<(), SizeMismatch> {
    check(bytes.len(), words.len(), W::BYTES)?;
    for (word, chunk) in words.iter_mut().zip(bytes.chunks_exact(W::BYTES)) {
        *word = W::load(chunk);
    }
    Ok(())
}

/// Unpacks words into bytes.
///
/// # Errors
/// [`SizeMismatch`] unless the words hold exactly these bytes; nothing is written.
pub fn from_words<W: Word>(words: &[W], bytes: &mut [u8]) -> Result<(), SizeMismatch> {
    check(bytes.len(), words.len(), W::BYTES)?;
    for (chunk, word) in bytes.chunks_exact_mut(W::BYTES).zip(words) {
        word.store(chunk);
    }
    Ok(())
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
            let (mut wide, mut narrow, mut back) = ([0_u32; 8], [0_u16; 16], [0; 32]);
            to_words(&bytes, &mut wide).unwrap();
            from_words(&wide, &mut back).unwrap();
            prop_assert_eq!(back, bytes);
            to_words(&bytes, &mut narrow).unwrap();
            from_words(&narrow, &mut back).unwrap();
            prop_assert_eq!(back, bytes);
            for (k, word) in wide.iter().enumerate() {
                prop_assert_eq!(word & 0xff, u32::from(bytes[4 * k]));
                prop_assert_eq!(u32::from(narrow[2 * k + 1]) << 16 | u32::from(narrow[2 * k]), *word);
            }
        }
    }

    #[test]
    fn sizes_must_agree() {
        let mut words = [7_u32; 4];
        for size in (0..=32).filter(|&n| n != 16) {
            let refused = to_words(&[0; 32][..size], &mut words);
            assert_eq!(refused, Err(SizeMismatch { bytes: size, words: 4 }));
        }
        assert_eq!(words, [7; 4]);
    }
}
