use core::fmt;

use crate::command::{Command, Version};

servowire_core::errors! {
    /// Why a frame was refused, a transaction failed, or a number does not fit.
    ///
    /// A response is checked in this order, and the first check that fails is the one reported:
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
    /// Frames count from 0, the first of the request or of the response.
    pub enum Error {
        /// The line ends too early, or the next frame did not arrive in time.
        #[error("the line ends after {got} of {want} bits")]
        Truncated = 1 {
            /// Number of line bits received.
            got: u16,
            /// Number of line bits of the whole response or frame.
            want: u16,
        },
        /// A start bit reads 1.
        #[error("frame {frame}: the start bit is 1")]
        StartBit = 2 {
            /// The first frame with this fault.
            frame: u8,
        },
        /// A delimiter reads 0.
        #[error("frame {frame}: the delimiter is 0")]
        Delimiter = 3 {
            /// The first frame with this fault.
            frame: u8,
        },
        /// The CRC-8 of a response is wrong.
        #[error("the CRC-8 is {got:#04x}, computed {want:#04x}")]
        Crc = 4 {
            /// Received.
            got: u8,
            /// The check value computed over the received bits.
            want: u8,
        },
        /// The CRC-3 of a request frame is wrong.
        #[error("the CRC-3 is {got:03b}, computed {want:03b}")]
        Crc3 = 5 {
            /// Received.
            got: u8,
            /// The check value computed over the received bits.
            want: u8,
        },
        /// The sync code is neither that of a request (2) nor that of a response (4), whichever was expected.
        #[error("the sync code is {got}: 2 begins a request, 4 a response")]
        SyncCode = 6 {
            /// Its three bits, the first on the line in bit 0.
            got: u8,
        },
        /// The bit between command code and encoder status is not 0.
        #[error("the fixed bit of the information field is 1")]
        FixedBit = 7,
        /// Another encoder answered.
        #[error("encoder {got} answered, expected encoder {want}")]
        AddressMismatch = 8 {
            /// Address in the response.
            got: u8,
            /// Address in the request.
            want: u8,
        },
        /// The response answers another command.
        #[error("the response answers command {got}, expected {want}")]
        CommandMismatch = 9 {
            /// Command code in the response.
            got: u8,
            /// Command code in the request.
            want: u8,
        },
        /// The encoder has no such EEPROM bank.
        #[error("the encoder reports a wrong EEPROM bank")]
        BankError = 10,
        /// The response repeats a different argument from the one sent.
        #[error("the response repeats {field} {got:#x}, {want:#x} was sent")]
        EchoMismatch = 11 {
            /// Which argument.
            field: EchoField,
            /// The value in the response.
            got: u32,
            /// The value in the request.
            want: u32,
        },
        /// A request frame has a frame code that does not fit its place in the request.
        #[error("frame {frame} of the request has frame code {got}, expected {want}")]
        FrameCode = 12 {
            /// Index of the frame.
            frame: u8,
            /// Frame code received.
            got: u8,
            /// Frame code that belongs here; 0 for a command data frame.
            want: u8,
        },
        /// Command code 31, or a number that is not a command code.
        #[error("{code} is no command code")]
        UnknownCommand = 13 {
            /// The number.
            code: u8,
        },
        /// The command belongs to a later version of the protocol than the encoder supports.
        #[error("{command} is not in version {version}")]
        UnsupportedInVersion = 14 {
            /// The command.
            command: Command,
            /// Version of the encoder.
            version: Version,
        },
        /// A request writes to an EEPROM address that cannot be written.
        #[error("address {got:#x} is out of range")]
        AddressRange = 15 {
            /// The number.
            got: u32,
        },
        /// A request carries a number that is too wide for its field.
        #[error("{got:#x} does not fit its field")]
        DataRange = 16 {
            /// The number.
            got: u32,
        },
        /// No response within the time-out.
        #[error("no response")]
        NoResponse = 17,
        /// The memory stayed busy after all tries.
        #[error("the encoder was still busy after {tries} requests")]
        Busy = 18 {
            /// Number of requests sent.
            tries: u16,
        },
        /// A plain reset was interrupted before the eighth response. It is not known whether it was done: requests that the
        /// encoder had counted before may have completed the eight. All eight requests have to be sent again.
        #[error("no response to the reset after {done} good responses of 8: it is not known whether it was done")]
        Interrupted = 19 {
            /// Good responses in succession so far.
            done: u8,
        },
        /// It is not known whether a command that cannot be undone took effect: the response to its last request did not come,
        /// or the encoder reports that it could not be stored. Find out before repeating it.
        #[error("whether a command that cannot be undone was done is not known")]
        EffectUnknown = 20,
        /// The operation was not done: reading back shows it, or fewer than eight requests of a reset were sent after the
        /// encoder had been made to restart its count.
        #[error("not done")]
        NotDone = 21,
        /// MEMERR is set: an access to the EEPROM failed.
        #[error("the encoder reports a failed access to its EEPROM")]
        MemoryFault = 22,
        /// The response is sound but answers something other than the procedure's request.
        #[error("the response carries no such value")]
        NotCarried = 24,
        /// A `nom` combinator of the caller refused the input.
        #[error("a parser combinator refused the input")]
        Combinator = 25,
        /// Two sound responses came to a request that one encoder answers, and it is not known which one is the answer.
        #[error("two responses came to one request")]
        TwoResponses = 26,
        /// The settings of the line leave no time for a response: nothing may be sent.
        #[error("the settings of the line leave no time for a response")]
        Line = 27,
    }
}

impl Error {
    /// The frame in which the fault shows, 0 for the first. `None` if the fault is not in one frame, or if its frame depends on
    /// the length of the response, as for the CRC-8, which is in the last.
    pub const fn frame(self) -> Option<u8> {
        match self {
            Self::StartBit { frame } | Self::Delimiter { frame } | Self::FrameCode { frame, .. } => Some(frame),
            Self::SyncCode { .. }
            | Self::FixedBit
            | Self::AddressMismatch { .. }
            | Self::CommandMismatch { .. }
            | Self::UnknownCommand { .. } => Some(0),
            _ => None,
        }
    }

    /// The first bit of the wrong part of that [`frame`](Self::frame), in the order of the line: 0 is the start
    /// bit, 17 the delimiter.
    pub const fn bit(self) -> Option<u8> {
        match self {
            Self::StartBit { .. } => Some(0),
            Self::Delimiter { .. } => Some(17),
            Self::SyncCode { .. } => Some(1),
            Self::FrameCode { .. } | Self::AddressMismatch { .. } => Some(4),
            Self::CommandMismatch { .. } => Some(7),
            Self::FixedBit => Some(12),
            _ => None,
        }
    }
}

/// An argument that a response repeats.
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

impl EchoField {
    /// The name as used in a sentence.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Address => "EEPROM address",
            Self::Bank => "EEPROM bank",
            Self::Data => "EEPROM data",
            Self::Id => "identification code",
            Self::Coefficient => "velocity coefficient",
        }
    }
}

impl fmt::Display for EchoField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

servowire_core::nom_error!(Error);

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    /// A frame is a start bit, sixteen bits and a delimiter; the information field is the sync code, three bits of address,
    /// five of command, a fixed bit, and the status. Of a request the frame code stands where the address would.
    #[test]
    fn a_fault_is_where_it_shows_on_the_line() {
        let at = |error: Error| (error.frame(), error.bit());
        assert_eq!(at(Error::StartBit { frame: 2 }), (Some(2), Some(0)));
        assert_eq!(at(Error::Delimiter { frame: 5 }), (Some(5), Some(17)));
        assert_eq!(at(Error::SyncCode { got: 3 }), (Some(0), Some(1)));
        assert_eq!(at(Error::FrameCode { frame: 1, got: 0, want: 1 }), (Some(1), Some(4)));
        assert_eq!(at(Error::AddressMismatch { got: 1, want: 0 }), (Some(0), Some(4)));
        assert_eq!(at(Error::CommandMismatch { got: 1, want: 0 }), (Some(0), Some(7)));
        // In a request it stands elsewhere than in a response.
        assert_eq!(at(Error::UnknownCommand { code: 31 }), (Some(0), None));
        assert_eq!(at(Error::FixedBit), (Some(0), Some(12)));
        assert_eq!(at(Error::Crc { got: 1, want: 0 }), (None, None));
        assert_eq!(at(Error::NoResponse), (None, None));
    }

    #[test]
    fn messages_are_sentences_for_a_person() {
        let echo = Error::EchoMismatch { field: EchoField::Id, got: 1, want: 0xab };
        assert_eq!(echo.to_string(), "the response repeats identification code 0x1, 0xab was sent");
        assert_eq!(Error::Crc3 { got: 1, want: 6 }.to_string(), "the CRC-3 is 001, computed 110");
        let version = Error::UnsupportedInVersion { command: Command::Abs24Vel, version: Version::V2_1 };
        assert_eq!(version.to_string(), "ABS24_VEL is not in version 2.1");
    }
}
