use crate::FrameType;

/// Why bytes, a number or an event were refused.
///
/// The checks are made in the order given with each parser; the first that fails is reported. A refusal leaves
/// every state machine as it was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Error {
    /// Fewer bytes than the frame needs.
    #[error("frame of {got} bytes, at least {need} are needed")]
    Truncated {
        /// Bytes given.
        got: u16,
        /// Bytes needed.
        need: u16,
    },
    /// The frame check sequence does not fit the bytes before it.
    #[error("FCS is {got:#010x}, the bytes before it give {want:#010x}")]
    BadFcs {
        /// FCS in the frame.
        got: u32,
        /// FCS computed.
        want: u32,
    },
    /// DA of a long-header frame is not 255.
    #[error("destination address {got}, only 255 (all) is in use")]
    WrongDestination {
        /// DA in the frame.
        got: u8,
    },
    /// TYPE is not one of 1 to 10.
    #[error("frame type {got} is not known")]
    UnknownType {
        /// TYPE in the frame.
        got: u8,
    },
    /// TYPE is known, but not the one asked for.
    #[error("frame type {got} instead of {want}")]
    UnexpectedType {
        /// TYPE in the frame.
        got: u8,
        /// TYPE asked for.
        want: u8,
    },
    /// The frame has not the length of its kind.
    #[error("frame of {got} bytes, its kind has {want}")]
    LengthMismatch {
        /// Bytes given.
        got: u16,
        /// Bytes of this kind.
        want: u16,
    },
    /// The CRC-8 of an IO-exchange frame does not fit.
    #[error("CRC-8 is {got:#04x}, the bytes before it give {want:#04x}")]
    BadCrc8 {
        /// CRC-8 in the frame.
        got: u8,
        /// CRC-8 computed.
        want: u8,
    },
    /// SA is not 0 in a master frame, or not 1 to 254 in a device frame.
    #[error("source address {got} does not belong to this kind of frame")]
    WrongSource {
        /// SA in the frame.
        got: u8,
    },
    /// The preamble is not 1 to 7 bytes 0x55 followed by 0xD5.
    #[error("preamble is wrong at byte {at}")]
    BadPreamble {
        /// Index of the first byte that does not fit.
        at: u8,
    },
    /// A network of more than 254 devices.
    #[error("device count {count}, 254 is the maximum")]
    TooManyDevices {
        /// Count in the frame.
        count: u16,
    },
    /// The totals of a discovery frame are not the sums of its entries.
    #[error("total of {got} bytes, the entries sum to {want}")]
    TableMismatch {
        /// Total in the frame.
        got: u16,
        /// Sum of the entries, saturated.
        want: u16,
    },
    /// A slice of process data lies outside the output bytes.
    #[error("bytes {offset}..{offset}+{len} are not among the output bytes")]
    OutsideOutput {
        /// First byte of the slice.
        offset: u16,
        /// Its length.
        len: u16,
    },
    /// The buffer to write a frame into is too small.
    #[error("buffer of {got} bytes, {need} are needed")]
    BufferTooSmall {
        /// Bytes of the buffer.
        got: u16,
        /// Bytes of the frame.
        need: u16,
    },
    /// A step's time does not lie in the 4 us cycle.
    #[error("sync time {ns} ns does not lie in 0..=3999")]
    SyncTimeOutOfRange {
        /// The time handed over.
        ns: u32,
    },
    /// A PTO word between 3991 and 0x7FFE, with or without bit 15, or 0xFFFF.
    #[error("PTO word {raw:#06x} has no meaning")]
    ReservedPtoValue {
        /// The word.
        raw: u16,
    },
    /// A motor mask above 15.
    #[error("motor mask {got:#04x}, four motors exist")]
    InvalidMotorMask {
        /// The mask.
        got: u8,
    },
    /// A round trip is shorter than the forwarding time, or too long for the 16-bit sum.
    #[error("round trip of {rtt_ns} ns cannot be")]
    ImplausibleRoundTrip {
        /// The round trip, or the mean of 16.
        rtt_ns: u32,
    },
    /// The time stamp of an IO-exchange frame lies outside the window.
    #[error("time stamp {got} is not within the window around {want}")]
    ImplausibleTimeStamp {
        /// Time stamp in the frame.
        got: u16,
        /// Time stamp expected.
        want: u16,
    },
    /// A register field holds a code that the data sheet reserves.
    #[error("code {code} of DRV8711 register {register} is reserved")]
    ReservedCode {
        /// Address of the register.
        register: u8,
        /// The code.
        code: u8,
    },
    /// A register reads back other than written.
    #[error("DRV8711 register {register} reads {got:#05x}, {want:#05x} was written")]
    ReadBack {
        /// Address of the register.
        register: u8,
        /// Value read, bits that always read 0 left out.
        got: u16,
        /// Value written, the same bits left out.
        want: u16,
    },
    /// A start-up frame was not answered in time.
    #[error("no answer to {sent:?} frame {frame}")]
    NoAnswer {
        /// TYPE of the frame sent.
        sent: FrameType,
        /// Its number in this phase, from 0.
        frame: u16,
    },
    /// DISCOVERY found fewer devices than asked for.
    #[error("{got} devices answered, {want} are needed")]
    TooFewDevices {
        /// Devices in the line.
        got: u8,
        /// Devices asked for.
        want: u8,
    },
    /// Device frames were missing in too many cycles one after the other.
    #[error("{count} devices have not answered for {cycles} cycles, the first of them is device {first}")]
    DevicesMissing {
        /// Address of the first that is missing.
        first: u8,
        /// How many are.
        count: u8,
        /// For so many cycles.
        cycles: u8,
    },
    /// Device frames were damaged in too many cycles one after the other.
    #[error("damaged device frames in {cycles} cycles one after the other")]
    TooManyCrcErrors {
        /// For so many cycles.
        cycles: u8,
    },
    /// A device frame comes from beyond the line, or LAST is set or missing where it was not before.
    #[error("the line has changed: device {address} does not fit what DISCOVERY found")]
    TopologyChanged {
        /// Who sent the frame.
        address: u8,
    },
    /// The link of the master is down.
    #[error("the link is down")]
    LinkDown,
    /// The frame does not belong to the present state.
    #[error("the frame does not belong to the present state")]
    WrongState,
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
    Truncated,
    BadFcs,
    WrongDestination,
    UnknownType,
    UnexpectedType,
    LengthMismatch,
    BadCrc8,
    WrongSource,
    BadPreamble,
    TooManyDevices,
    TableMismatch,
    OutsideOutput,
    BufferTooSmall,
    SyncTimeOutOfRange,
    ReservedPtoValue,
    InvalidMotorMask,
    ImplausibleRoundTrip,
    ImplausibleTimeStamp,
    ReservedCode,
    ReadBack,
    NoAnswer,
    TooFewDevices,
    DevicesMissing,
    TooManyCrcErrors,
    TopologyChanged,
    LinkDown,
    WrongState,
    Combinator,
}

impl ErrorClass {
    /// All classes.
    pub const ALL: [Self; 28] = [
        Self::Truncated,
        Self::BadFcs,
        Self::WrongDestination,
        Self::UnknownType,
        Self::UnexpectedType,
        Self::LengthMismatch,
        Self::BadCrc8,
        Self::WrongSource,
        Self::BadPreamble,
        Self::TooManyDevices,
        Self::TableMismatch,
        Self::OutsideOutput,
        Self::BufferTooSmall,
        Self::SyncTimeOutOfRange,
        Self::ReservedPtoValue,
        Self::InvalidMotorMask,
        Self::ImplausibleRoundTrip,
        Self::ImplausibleTimeStamp,
        Self::ReservedCode,
        Self::ReadBack,
        Self::NoAnswer,
        Self::TooFewDevices,
        Self::DevicesMissing,
        Self::TooManyCrcErrors,
        Self::TopologyChanged,
        Self::LinkDown,
        Self::WrongState,
        Self::Combinator,
    ];
}

impl Error {
    /// The kind of this error.
    pub const fn class(self) -> ErrorClass {
        match self {
            Self::Truncated { .. } => ErrorClass::Truncated,
            Self::BadFcs { .. } => ErrorClass::BadFcs,
            Self::WrongDestination { .. } => ErrorClass::WrongDestination,
            Self::UnknownType { .. } => ErrorClass::UnknownType,
            Self::UnexpectedType { .. } => ErrorClass::UnexpectedType,
            Self::LengthMismatch { .. } => ErrorClass::LengthMismatch,
            Self::BadCrc8 { .. } => ErrorClass::BadCrc8,
            Self::WrongSource { .. } => ErrorClass::WrongSource,
            Self::BadPreamble { .. } => ErrorClass::BadPreamble,
            Self::TooManyDevices { .. } => ErrorClass::TooManyDevices,
            Self::TableMismatch { .. } => ErrorClass::TableMismatch,
            Self::OutsideOutput { .. } => ErrorClass::OutsideOutput,
            Self::BufferTooSmall { .. } => ErrorClass::BufferTooSmall,
            Self::SyncTimeOutOfRange { .. } => ErrorClass::SyncTimeOutOfRange,
            Self::ReservedPtoValue { .. } => ErrorClass::ReservedPtoValue,
            Self::InvalidMotorMask { .. } => ErrorClass::InvalidMotorMask,
            Self::ImplausibleRoundTrip { .. } => ErrorClass::ImplausibleRoundTrip,
            Self::ImplausibleTimeStamp { .. } => ErrorClass::ImplausibleTimeStamp,
            Self::ReservedCode { .. } => ErrorClass::ReservedCode,
            Self::ReadBack { .. } => ErrorClass::ReadBack,
            Self::NoAnswer { .. } => ErrorClass::NoAnswer,
            Self::TooFewDevices { .. } => ErrorClass::TooFewDevices,
            Self::DevicesMissing { .. } => ErrorClass::DevicesMissing,
            Self::TooManyCrcErrors { .. } => ErrorClass::TooManyCrcErrors,
            Self::TopologyChanged { .. } => ErrorClass::TopologyChanged,
            Self::LinkDown => ErrorClass::LinkDown,
            Self::WrongState => ErrorClass::WrongState,
            Self::Combinator => ErrorClass::Combinator,
        }
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
    use super::Error;

    #[test]
    fn an_error_is_at_most_two_machine_words() {
        assert!(size_of::<Error>() <= 16);
    }
}
