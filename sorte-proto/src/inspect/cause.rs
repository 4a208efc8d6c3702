use super::frame::{During, Frame};
use crate::crc::RunningFcs;
use crate::error::Error;
use crate::exchange::{DeviceFrameView, MasterFrameView};
use crate::frame::{LongFrame, MULTICAST};
use crate::frame_type::FrameType;
use crate::preamble::strip_preamble;
use crate::status::Status;

/// Length of the shortest frame that a network card sends or delivers, without FCS.
const CARD_LEN: usize = 60;

/// What most likely went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// Preamble and start delimiter still precede the frame.
    PreambleLeft,
    /// The FCS is missing: most network cards check it and remove it.
    FcsMissing,
    /// Zeros follow the frame: a network card or a switch has padded it.
    Padded {
        /// So many.
        bytes: u16,
    },
    /// The FCS is missing, and zeros follow up to the 60 bytes that a network card makes of any shorter frame.
    FcsMissingAndPadded,
    /// The end is missing.
    Cut {
        /// Number of missing bytes.
        missing: u16,
    },
    /// Every bit is inverted.
    Inverted,
    /// This is a sound frame of the start-up.
    StartUpFrame,
    /// This is a sound frame of the IO exchange.
    ExchangeFrame,
    /// This is not a SORTE frame, but for example an ordinary Ethernet frame.
    NotSorte,
    /// Everything except the check is right: single bits are wrong.
    Disturbed,
}

servowire_core::one_line!(Cause {
    Self::PreambleLeft => "the preamble is still in front of the frame";
    Self::FcsMissing => "the FCS is missing";
    Self::Padded { bytes } => "padded with {} zeros", bytes;
    Self::FcsMissingAndPadded => "the FCS is missing and the frame is padded to 60 bytes";
    Self::Cut { missing } => "the last {} bytes are missing", missing;
    Self::Inverted => "every bit is inverted";
    Self::StartUpFrame => "this is a sound frame of the start-up";
    Self::ExchangeFrame => "this is a sound frame of the IO exchange";
    Self::NotSorte => "this is not a frame of SORTE";
    Self::Disturbed => "single bits were disturbed";
});

type Diagnosis<'a> = (Option<Cause>, Option<Frame<'a>>);

/// Undoes the usual mistakes one by one; the first one whose removal yields a sound frame is the cause.
pub(super) fn of(during: During, bytes: &[u8], error: Error) -> Diagnosis<'_> {
    if let Ok(frame) = strip_preamble(bytes).and_then(|frame| Frame::parse(during, frame)) {
        return (Some(Cause::PreambleLeft), Some(frame));
    }
    match during {
        During::StartUp => of_start_up(bytes, error),
        During::Exchange => of_exchange(bytes, error),
    }
}

fn of_start_up(bytes: &[u8], error: Error) -> Diagnosis<'_> {
    let head = match bytes {
        [MULTICAST, _, code, _, ..] => FrameType::from_code(*code),
        _ => None,
    };
    if is_inverted(bytes) {
        return (Some(Cause::Inverted), None);
    }
    if let Some(frame) = exchange_frame(bytes) {
        return (Some(Cause::ExchangeFrame), Some(frame));
    }
    let Some(len) = head.map(FrameType::frame_len) else { return (Some(Cause::NotSorte), None) };
    // A type without a published layout has no length that could be compared.
    let Some(len) = len else { return (None, None) };
    if let Some(guess) = of_length(bytes, len) {
        return guess;
    }
    (matches!(error, Error::BadFcs { .. }).then_some(Cause::Disturbed), None)
}

/// Diagnoses the length of a frame whose type has `len` bytes.
fn of_length(bytes: &[u8], len: usize) -> Option<Diagnosis<'_>> {
    let (got, body) = (bytes.len(), len.saturating_sub(4));
    if got == body {
        return Some((Some(Cause::FcsMissing), without_fcs(bytes)));
    }
    if got < len {
        let missing = u16::try_from(len.saturating_sub(got)).unwrap_or(u16::MAX);
        return Some((Some(Cause::Cut { missing }), None));
    }
    let (frame, rest) = bytes.split_at_checked(len)?;
    let zeros = |bytes: &[u8]| bytes.iter().all(|byte| *byte == 0);
    if let (false, true, Ok(frame)) = (rest.is_empty(), zeros(rest), Frame::parse(During::StartUp, frame)) {
        return Some((Some(Cause::Padded { bytes: u16::try_from(rest.len()).unwrap_or(u16::MAX) }), Some(frame)));
    }
    let (frame, rest) = bytes.split_at_checked(body)?;
    (got == CARD_LEN && zeros(rest)).then(|| (Some(Cause::FcsMissingAndPadded), without_fcs(frame)))
}

/// Returns the values of a frame whose FCS was removed.
fn without_fcs(body: &[u8]) -> Option<Frame<'_>> {
    LongFrame::without_fcs(body).and_then(|frame| Frame::of_long(frame).ok())
}

/// Whether the inverted bytes end with the FCS of the bytes before it, and begin as a frame does.
fn is_inverted(bytes: &[u8]) -> bool {
    let mut running = RunningFcs::START;
    for byte in bytes {
        running.push(!byte);
    }
    running.is_whole() && matches!(bytes, [0, ..]) && bytes.len() >= LongFrame::OVERHEAD
}

/// A CRC-8 alone matches by chance too often, so STATUS must also be one that a master or a device sends.
fn exchange_frame(bytes: &[u8]) -> Option<Frame<'_>> {
    let frame = Frame::parse(During::Exchange, bytes).ok()?;
    let usual = match frame {
        Frame::Master(frame) => frame.status() == Status::EXCHANGE,
        Frame::Device(frame) => Status::LAST.union(Status::ERROR).contains(frame.status()),
        _ => false,
    };
    usual.then_some(frame)
}

fn of_exchange(bytes: &[u8], error: Error) -> Diagnosis<'_> {
    if let Ok(frame) = Frame::parse(During::StartUp, bytes) {
        return (Some(Cause::StartUpFrame), Some(frame));
    }
    // SA 0 and STATUS 30h, or an address and STATUS without further bits: the head of a frame of the exchange.
    let usual = match bytes {
        [0, status, ..] => *status == Status::EXCHANGE.bits() && bytes.len() > MasterFrameView::OVERHEAD,
        [_, status, ..] => *status & !5 == 0 && bytes.len() > DeviceFrameView::OVERHEAD,
        _ => false,
    };
    (matches!(error, Error::BadCrc8 { .. } if usual).then_some(Cause::Disturbed), None)
}
