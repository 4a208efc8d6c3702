use crate::{Command, Version};

/// Why a frame was refused, a transaction failed, or a number does not fit.
///
/// A reply is checked in this order, and the first check that fails is the one reported:
///
/// 1. its length: [`Truncated`](Self::Truncated);
/// 2. framing, frame by frame: [`StartBit`](Self::StartBit), then [`Delimiter`](Self::Delimiter);
/// 3. the check field: [`Crc`](Self::Crc);
/// 4. the information field: [`SyncCode`](Self::SyncCode), [`FixedBit`](Self::FixedBit),
///    [`AddressMismatch`](Self::AddressMismatch), [`CommandMismatch`](Self::CommandMismatch);
/// 5. the memory: [`BankError`](Self::BankError), [`EchoMismatch`](Self::EchoMismatch).
///
/// A request frame: [`Truncated`](Self::Truncated), [`StartBit`](Self::StartBit), [`Delimiter`](Self::Delimiter),
/// [`Crc3`](Self::Crc3), [`SyncCode`](Self::SyncCode); a whole request then [`FrameCode`](Self::FrameCode),
/// [`UnknownCommand`](Self::UnknownCommand), [`AddressRange`](Self::AddressRange), [`DataRange`](Self::DataRange).
///
/// Frames count from 0, the first of the request or of the reply.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Error {
    /// The line ends too early, or the next frame did not come in time.
    #[error("the line ends after {got} of {want} bits")]
    Truncated {
        /// Line bits that were there.
        got: u16,
        /// Line bits of the whole.
        want: u16,
    },
    /// A start bit reads 1.
    #[error("frame {frame}: the start bit is 1")]
    StartBit {
        /// First frame with this fault.
        frame: u8,
    },
    /// A delimiter reads 0.
    #[error("frame {frame}: the delimiter is 0")]
    Delimiter {
        /// First frame with this fault.
        frame: u8,
    },
    /// The CRC-8 of a reply is wrong.
    #[error("the CRC-8 is {got:#04x}, computed {want:#04x}")]
    Crc {
        /// Received.
        got: u8,
        /// Computed over the received bits.
        want: u8,
    },
    /// The CRC-3 of a request frame is wrong.
    #[error("the CRC-3 is {got:03b}, computed {want:03b}")]
    Crc3 {
        /// Received.
        got: u8,
        /// Computed over the received bits.
        want: u8,
    },
    /// The sync code is neither that of a request (2) nor that of a reply (4), whichever was due.
    #[error("the sync code is {got}: 2 begins a request, 4 a reply")]
    SyncCode {
        /// Its three bits, the first of the line in bit 0.
        got: u8,
    },
    /// The bit between command code and encoder status is not 0.
    #[error("the fixed bit of the information field is 1")]
    FixedBit,
    /// Another encoder answered.
    #[error("encoder {got} answered, asked was encoder {want}")]
    AddressMismatch {
        /// Address in the reply.
        got: u8,
        /// Address in the request.
        want: u8,
    },
    /// The reply answers another command.
    #[error("the reply answers command {got}, asked was {want}")]
    CommandMismatch {
        /// Command code in the reply.
        got: u8,
        /// Command code in the request.
        want: u8,
    },
    /// The encoder has no such EEPROM bank.
    #[error("the encoder reports a wrong EEPROM bank")]
    BankError,
    /// The reply repeats another argument than was sent.
    #[error("the reply repeats {field} {got:#x}, sent was {want:#x}")]
    EchoMismatch {
        /// Which argument.
        field: EchoField,
        /// In the reply.
        got: u32,
        /// In the request.
        want: u32,
    },
    /// A request frame has another frame code than its place in the request demands.
    #[error("frame {frame} of the request has frame code {got}, due was {want}")]
    FrameCode {
        /// Index of the frame.
        frame: u8,
        /// Frame code received.
        got: u8,
        /// Frame code that belongs here; 0 for a command data frame.
        want: u8,
    },
    /// Command code 31, or a number that is no command code.
    #[error("{code} is no command code")]
    UnknownCommand {
        /// The number.
        code: u8,
    },
    /// The command belongs to a later version of the protocol than the encoder speaks.
    #[error("{command} is not in version {version}")]
    UnsupportedInVersion {
        /// The command.
        command: Command,
        /// Version of the encoder.
        version: Version,
    },
    /// An encoder address above 7, or an EEPROM address that cannot be written.
    #[error("address {got:#x} is out of range")]
    AddressRange {
        /// The number.
        got: u32,
    },
    /// A number is too wide for its field.
    #[error("{got:#x} does not fit its field")]
    DataRange {
        /// The number.
        got: u32,
    },
    /// No reply within the time-out.
    #[error("no response")]
    NoResponse,
    /// The memory stayed busy after all tries.
    #[error("the encoder was still busy after {tries} requests")]
    Busy {
        /// Requests made.
        tries: u16,
    },
    /// A reset was interrupted: a reply did not come, and the eight requests have to be sent anew.
    #[error("no reply to the reset after {done} good replies of 8")]
    Interrupted {
        /// Good replies in succession so far.
        done: u8,
    },
    /// A position has bits set above the width of the encoder: the wrong profile.
    #[error("the position has bits set above bit {width} that this encoder leaves 0")]
    UpperBits {
        /// Single-turn and turn bits of the profile together.
        width: u8,
    },
    /// The reply does not carry what the profile was asked to make of it.
    #[error("the reply carries no such value")]
    NotCarried,
    /// A `nom` combinator of the caller refused the input.
    #[error("a parser combinator refused the input")]
    Combinator,
}

/// An argument that a reply repeats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum EchoField {
    /// EEPROM address.
    Address,
    /// EEPROM bank.
    Bank,
    /// EEPROM data of a write.
    Data,
    /// Identification code.
    Id,
    /// Velocity coefficient.
    Coefficient,
}

impl core::fmt::Display for EchoField {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Address => "EEPROM address",
            Self::Bank => "EEPROM bank",
            Self::Data => "EEPROM data",
            Self::Id => "identification code",
            Self::Coefficient => "velocity coefficient",
        })
    }
}

/// The kind of an [`Error`], for counters and statistics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
#[allow(missing_docs, reason = "each stands for the error of the same name")]
pub enum ErrorClass {
    Truncated,
    StartBit,
    Delimiter,
    Crc,
    Crc3,
    SyncCode,
    FixedBit,
    AddressMismatch,
    CommandMismatch,
    BankError,
    EchoMismatch,
    FrameCode,
    UnknownCommand,
    UnsupportedInVersion,
    AddressRange,
    DataRange,
    NoResponse,
    Busy,
    Interrupted,
    UpperBits,
    NotCarried,
    Combinator,
}

impl ErrorClass {
    /// All classes, in the order of the checks.
    pub const ALL: [Self; 22] = [
        Self::Truncated,
        Self::StartBit,
        Self::Delimiter,
        Self::Crc,
        Self::Crc3,
        Self::SyncCode,
        Self::FixedBit,
        Self::AddressMismatch,
        Self::CommandMismatch,
        Self::BankError,
        Self::EchoMismatch,
        Self::FrameCode,
        Self::UnknownCommand,
        Self::UnsupportedInVersion,
        Self::AddressRange,
        Self::DataRange,
        Self::NoResponse,
        Self::Busy,
        Self::Interrupted,
        Self::UpperBits,
        Self::NotCarried,
        Self::Combinator,
    ];

    /// The name in lower case, as logs and test vectors spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truncated => "truncated",
            Self::StartBit => "start_bit",
            Self::Delimiter => "delimiter",
            Self::Crc => "crc",
            Self::Crc3 => "crc3",
            Self::SyncCode => "sync_code",
            Self::FixedBit => "fixed_bit",
            Self::AddressMismatch => "address_mismatch",
            Self::CommandMismatch => "command_mismatch",
            Self::BankError => "bank_error",
            Self::EchoMismatch => "echo_mismatch",
            Self::FrameCode => "frame_code",
            Self::UnknownCommand => "unknown_command",
            Self::UnsupportedInVersion => "unsupported_in_version",
            Self::AddressRange => "address_range",
            Self::DataRange => "data_range",
            Self::NoResponse => "no_response",
            Self::Busy => "busy",
            Self::Interrupted => "interrupted",
            Self::UpperBits => "upper_bits",
            Self::NotCarried => "not_carried",
            Self::Combinator => "combinator",
        }
    }
}

impl Error {
    /// The kind of this error.
    pub const fn class(self) -> ErrorClass {
        match self {
            Self::Truncated { .. } => ErrorClass::Truncated,
            Self::StartBit { .. } => ErrorClass::StartBit,
            Self::Delimiter { .. } => ErrorClass::Delimiter,
            Self::Crc { .. } => ErrorClass::Crc,
            Self::Crc3 { .. } => ErrorClass::Crc3,
            Self::SyncCode { .. } => ErrorClass::SyncCode,
            Self::FixedBit => ErrorClass::FixedBit,
            Self::AddressMismatch { .. } => ErrorClass::AddressMismatch,
            Self::CommandMismatch { .. } => ErrorClass::CommandMismatch,
            Self::BankError => ErrorClass::BankError,
            Self::EchoMismatch { .. } => ErrorClass::EchoMismatch,
            Self::FrameCode { .. } => ErrorClass::FrameCode,
            Self::UnknownCommand { .. } => ErrorClass::UnknownCommand,
            Self::UnsupportedInVersion { .. } => ErrorClass::UnsupportedInVersion,
            Self::AddressRange { .. } => ErrorClass::AddressRange,
            Self::DataRange { .. } => ErrorClass::DataRange,
            Self::NoResponse => ErrorClass::NoResponse,
            Self::Busy { .. } => ErrorClass::Busy,
            Self::Interrupted { .. } => ErrorClass::Interrupted,
            Self::UpperBits { .. } => ErrorClass::UpperBits,
            Self::NotCarried => ErrorClass::NotCarried,
            Self::Combinator => ErrorClass::Combinator,
        }
    }
}

impl nrz_line::Classified for ErrorClass {
    fn class_index(&self) -> usize {
        *self as usize
    }
}

impl nrz_line::Classified for Error {
    fn class_index(&self) -> usize {
        self.class().class_index()
    }
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
    use std::string::ToString;

    #[test]
    fn an_error_is_small() {
        assert!(size_of::<Error>() <= 2 * size_of::<u64>());
    }

    #[test]
    fn messages_are_sentences_for_a_person() {
        let echo = Error::EchoMismatch { field: EchoField::Id, got: 1, want: 0xab };
        assert_eq!(echo.to_string(), "the reply repeats identification code 0x1, sent was 0xab");
        assert_eq!(Error::Crc3 { got: 1, want: 6 }.to_string(), "the CRC-3 is 001, computed 110");
        let version = Error::UnsupportedInVersion { command: Command::Abs24Vel, version: Version::V2_1 };
        assert_eq!(version.to_string(), "ABS24_VEL is not in version 2.1");
    }
}
