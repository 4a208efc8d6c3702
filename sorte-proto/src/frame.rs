//! What all long-header frames have in common; these are all frames but those of the IO exchange.

use crate::crc::fcs;
use crate::error::Error;
use crate::frame_type::FrameType;
use crate::status::Status;

/// DA of every start-up frame.
pub(crate) const MULTICAST: u8 = 255;

/// A long-header frame with the right FCS and length: from DA to FCS, without preamble.
///
/// ```text
///  byte 0    1    2     3       4 ...........  last four
///       DA   SA   TYPE  STATUS  payload        FCS (LSB first)
///       255  0
/// ```
///
/// Frames of the types [`Out`](FrameType::Out) to [`Recon`](FrameType::Recon) have an opaque payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct LongFrame<'a> {
    source: u8,
    frame_type: FrameType,
    status: Status,
    payload: &'a [u8],
    fcs: u32,
}

impl<'a> LongFrame<'a> {
    /// Number of bytes in header and FCS.
    pub const OVERHEAD: usize = 8;

    /// Checks, in this order: at least 8 bytes, FCS, DA, TYPE, length. The bytes must be exactly one frame.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::BadFcs`], [`Error::WrongDestination`], [`Error::UnknownType`],
    /// [`Error::Truncated`] or [`Error::TooLong`] for the type
    pub fn parse(bytes: &'a [u8]) -> Result<Self, Error> {
        let (Some((body, trailer)), &[da, source, code, status, ..]) = (bytes.split_last_chunk(), bytes) else {
            return Err(truncated(bytes.len()));
        };
        let (got, want) = (u32::from_le_bytes(*trailer), fcs(body));
        let frame_type = check(bytes.len(), [da, source, code, status], got, want)?;
        let payload = body.get(4..).unwrap_or_default();
        Ok(Self { source, frame_type, status: Status::from_bits_retain(status), payload, fcs: got })
    }

    /// Rebuilds a frame whose FCS was removed; for tools.
    pub(crate) fn without_fcs(body: &'a [u8]) -> Option<Self> {
        let &[_, source, code, status, ref payload @ ..] = body else { return None };
        let frame_type = FrameType::from_code(code)?;
        Some(Self { source, frame_type, status: Status::from_bits_retain(status), payload, fcs: fcs(body) })
    }

    /// SA: 0 in everything that the published firmware sends.
    pub const fn source(self) -> u8 {
        self.source
    }

    /// TYPE.
    pub const fn frame_type(self) -> FrameType {
        self.frame_type
    }

    /// STATUS.
    pub const fn status(self) -> Status {
        self.status
    }

    /// The bytes between header and FCS.
    pub const fn payload(self) -> &'a [u8] {
        self.payload
    }

    /// The FCS.
    pub const fn fcs(self) -> u32 {
        self.fcs
    }

    /// Returns the payload, if the frame is of this type; `N` is the type's payload length.
    pub(crate) fn of_type<const N: usize>(self, want: FrameType) -> Result<&'a [u8; N], Error> {
        match self.payload.first_chunk() {
            Some(payload) if self.frame_type == want => Ok(payload),
            _ => Err(Error::UnexpectedType { got: self.frame_type.code(), want: want.code() }),
        }
    }
}

/// Makes the checks of a long-header frame in their order, for a frame in a buffer and for one that has passed byte by byte.
/// `got` is the FCS in the frame, `want` that of the bytes before it.
pub(crate) fn check(len: usize, [da, _, code, _]: [u8; 4], got: u32, want: u32) -> Result<FrameType, Error> {
    if len < LongFrame::OVERHEAD {
        return Err(truncated(len));
    }
    if got != want {
        return Err(Error::BadFcs { got, want });
    }
    if da != MULTICAST {
        return Err(Error::WrongDestination { got: da });
    }
    let frame_type = FrameType::from_code(code).ok_or(Error::UnknownType { got: code })?;
    match frame_type.frame_len() {
        Some(want) if want != len => Err(wrong_length(len, want)),
        _ => Ok(frame_type),
    }
}

#[cold]
fn truncated(len: usize) -> Error {
    Error::Truncated { got: count(len), want: count(LongFrame::OVERHEAD) }
}

/// Returns the error for `got` bytes in place of a frame of `want`.
#[cold]
pub(crate) fn wrong_length(got: usize, want: usize) -> Error {
    let (got, want) = (count(got), count(want));
    if got < want { Error::Truncated { got, want } } else { Error::TooLong { got, want } }
}

/// Returns header, payload and FCS as one array, for the frames of known length; `N` is the payload length plus 8.
pub(crate) fn emit<const N: usize>(source: u8, frame_type: FrameType, status: Status, payload: &[u8]) -> [u8; N] {
    let mut bytes = [0; N];
    if let [da, sa, code, flags, rest @ ..] = bytes.as_mut_slice() {
        (*da, *sa, *code, *flags) = (MULTICAST, source, frame_type.code(), status.bits());
        rest.iter_mut().zip(payload).for_each(|(to, from)| *to = *from);
    }
    refresh_fcs(&mut bytes);
    bytes
}

/// Writes the FCS of the bytes before it into the last four.
pub(crate) fn refresh_fcs(frame: &mut [u8]) {
    if let Some((body, trailer)) = frame.split_last_chunk_mut() {
        *trailer = fcs(body).to_le_bytes();
    }
}

/// Converts a length to the type used in errors.
pub(crate) fn count(len: usize) -> u16 {
    u16::try_from(len).unwrap_or(u16::MAX)
}

servowire_core::one_line!(LongFrame<'_> {
    Self { frame_type, payload, status, .. } => "{}, {} bytes of payload, STATUS {}", frame_type, payload.len(), status;
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_without_layout_has_an_opaque_payload() {
        let bytes: [u8; 13] = emit(7, FrameType::Alarm, Status::from_bits_retain(0x85), &[1, 2, 3, 4, 5]);
        let frame = LongFrame::parse(&bytes).unwrap();
        assert_eq!(
            (frame.source(), frame.frame_type(), frame.status()),
            (7, FrameType::Alarm, Status::from_bits_retain(0x85))
        );
        assert_eq!((frame.payload(), frame.fcs()), (&[1, 2, 3, 4, 5][..], fcs(&bytes[..9])));
        assert!(std::format!("{frame}").contains(", 5 bytes of payload, "), "{frame}");
    }

    #[test]
    fn the_checks_come_in_their_order() {
        let mut bytes: [u8; 9] = emit(0, FrameType::DelayReq, Status::DELAY_REQ, &[0]);
        assert_eq!(LongFrame::parse(&bytes), Err(Error::TooLong { got: 9, want: 8 }));
        bytes[2] = 11;
        refresh_fcs(&mut bytes);
        assert_eq!(LongFrame::parse(&bytes), Err(Error::UnknownType { got: 11 }));
        bytes[0] = 1;
        refresh_fcs(&mut bytes);
        assert_eq!(LongFrame::parse(&bytes), Err(Error::WrongDestination { got: 1 }));
        bytes[8] ^= 1;
        assert!(matches!(LongFrame::parse(&bytes), Err(Error::BadFcs { .. })));
        for len in 0..8 {
            assert_eq!(LongFrame::parse(&bytes[..len]), Err(Error::Truncated { got: len as u16, want: 8 }));
        }
    }
}
