/// Shape of a start-stop field and how densely the line is sampled.
///
/// ```text
///  idle ─┐     ┌─────┬─────┬─   ─┬─────┬─────
///        │  0  │ c0  │ c1  │ ... │ cK-1│  1      K = 8 or 16 content bits, LSB first
///        └─────┴─────┴─────┴─   ─┴─────┘
///        start                    delimiter       N samples a bit
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Format {
    samples_per_bit: u32,
    content_bits: u32,
}

/// A [`Format`] that the receiver does not support.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FormatError {
    /// 2 or 3 samples leave no room to find an edge; above 80, the limits below are not proved.
    #[error("{got} samples per bit: only 1 (a plain bit stream) or 4 to 80 are possible")]
    SamplesPerBit {
        /// The number that was requested.
        got: u32,
    },
    /// Only 8 and 16 content bits are supported, a byte or a 16-bit word.
    #[error("{got} content bits: only 8 or 16 are possible")]
    ContentBits {
        /// The number that was requested.
        got: u32,
    },
}

impl Format {
    /// Creates a format. `samples_per_bit` is 4..=80, or 1 for a plain bit stream; `content_bits` is 8 or 16.
    ///
    /// # Errors
    /// [`FormatError`] for any other number.
    pub const fn new(samples_per_bit: u32, content_bits: u32) -> Result<Self, FormatError> {
        if !matches!(samples_per_bit, 1 | 4..=80) {
            return Err(FormatError::SamplesPerBit { got: samples_per_bit });
        }
        if !matches!(content_bits, 8 | 16) {
            return Err(FormatError::ContentBits { got: content_bits });
        }
        Ok(Self { samples_per_bit, content_bits })
    }

    /// Number of samples in one bit.
    pub const fn samples_per_bit(self) -> u32 {
        self.samples_per_bit
    }

    /// Number of content bits in one field.
    pub const fn content_bits(self) -> u32 {
        self.content_bits
    }

    /// Bits of one field including start bit and delimiter: 10 or 18.
    pub const fn field_bits(self) -> u32 {
        self.content_bits.saturating_add(2)
    }

    /// Number of samples from the edge of a bit to the point where its level is taken.
    pub(crate) const fn middle(self) -> u32 {
        self.samples_per_bit >> 1
    }

    /// Initial value of a receiver's bits, before the first content bit: a mark that the content bits push to bit 0.
    pub(crate) const fn mark(self) -> u32 {
        1_u32.wrapping_shl(self.content_bits)
    }
}
