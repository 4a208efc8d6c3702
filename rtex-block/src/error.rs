/// Why a block was refused.
///
/// Checks are made in the order of the variants; the first that fails is reported, and nothing is decoded then.
/// `strict` decoding goes through all of them, lenient decoding stops before [`CodePair`](Self::CodePair).
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Error {
    /// The slice is not one whole block.
    #[error("block of {got} bytes, must have {want}")]
    Length {
        /// Bytes that were there.
        got: usize,
        /// Bytes that a block has: 16 or 32.
        want: u8,
    },
    /// C/R (bit 7 of byte 0) says command where a response was due, or the other way round.
    #[error("byte 0 is {byte0:#04x}: the C/R bit tells the wrong direction")]
    Direction {
        /// Byte 0 as received.
        byte0: u8,
    },
    /// The block belongs to another drive.
    #[error("MAC-ID {got}, expected {want}")]
    MacId {
        /// The MAC-ID in the block.
        got: u8,
        /// The MAC-ID that was expected.
        want: u8,
    },
    /// Bits 6-4 of byte 1 are 5, 6 or 7. A drive answers 0021h.
    #[error("cyclic code {code} is not defined")]
    CyclicCode {
        /// The code, 5..=7.
        code: u8,
    },
    /// Bits 3-0 of byte 1 are 3, 8, 9 or Bh to Fh. A drive answers 0022h.
    #[error("non-cyclic code {code:x}h is not defined")]
    NonCyclicCode {
        /// The code, 0..=15.
        code: u8,
    },
    /// Sub_Chk (bit 7 of byte 16) is 0. A drive answers 0012h in the sub block and executes nothing.
    #[error("byte 16 is {byte16:#04x}: Sub_Chk is not set")]
    SubChk {
        /// Byte 16 as received.
        byte16: u8,
    },
    /// Bits 3-0 of byte 16 of a command are not 0, 2 or Ah. A drive answers 0022h in the sub block.
    #[error("sub-command code {code:x}h is not defined")]
    SubCommandCode {
        /// The code, 0..=15.
        code: u8,
    },
    /// Both codes are defined but not for use together (strict decoding only).
    #[error("cyclic and non-cyclic code of {code:02x}h do not go together")]
    CodePair {
        /// Bits 6-0 of byte 1.
        code: u8,
    },
    /// A bit is 1 that the layout defines as 0 (strict decoding only).
    #[error("byte {byte} has reserved bits {bits:#04x} set")]
    Reserved {
        /// Number of the byte in the block, 0..=31; the first one at fault.
        byte: u8,
        /// Those of its reserved bits that are 1.
        bits: u8,
    },
    /// A `nom` combinator of the caller refused the input.
    #[error("a parser combinator refused the input")]
    Combinator,
}

/// The kind of an [`Error`], for counters and statistics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
#[allow(missing_docs, reason = "each stands for the error of the same name")]
pub enum ErrorClass {
    Length,
    Direction,
    MacId,
    CyclicCode,
    NonCyclicCode,
    SubChk,
    SubCommandCode,
    CodePair,
    Reserved,
    Combinator,
}

impl ErrorClass {
    /// All classes, in the order of the checks.
    pub const ALL: [Self; 10] = [
        Self::Length,
        Self::Direction,
        Self::MacId,
        Self::CyclicCode,
        Self::NonCyclicCode,
        Self::SubChk,
        Self::SubCommandCode,
        Self::CodePair,
        Self::Reserved,
        Self::Combinator,
    ];
}

impl Error {
    /// The kind of this error.
    pub const fn class(self) -> ErrorClass {
        match self {
            Self::Length { .. } => ErrorClass::Length,
            Self::Direction { .. } => ErrorClass::Direction,
            Self::MacId { .. } => ErrorClass::MacId,
            Self::CyclicCode { .. } => ErrorClass::CyclicCode,
            Self::NonCyclicCode { .. } => ErrorClass::NonCyclicCode,
            Self::SubChk { .. } => ErrorClass::SubChk,
            Self::SubCommandCode { .. } => ErrorClass::SubCommandCode,
            Self::CodePair { .. } => ErrorClass::CodePair,
            Self::Reserved { .. } => ErrorClass::Reserved,
            Self::Combinator => ErrorClass::Combinator,
        }
    }
}

/// Out of the way of the good path: otherwise its stores are executed, without effect, for every good block.
#[cold]
#[inline(never)]
pub(crate) const fn wrong_direction(byte0: u8) -> Error {
    Error::Direction { byte0 }
}

impl<I> nom::error::ParseError<I> for Error {
    fn from_error_kind(_: I, _: nom::error::ErrorKind) -> Self {
        Self::Combinator
    }

    fn append(_: I, _: nom::error::ErrorKind, other: Self) -> Self {
        other
    }
}

impl<I> nom::error::FromExternalError<I, Self> for Error {
    fn from_external_error(_: I, _: nom::error::ErrorKind, error: Self) -> Self {
        error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stays_within_two_machine_words() {
        assert!(size_of::<Error>() <= 2 * size_of::<usize>());
    }
}
