//! What all long-header frames share: everything but the IO exchange.

use crate::{Error, Status, fcs};

/// DA of every start-up frame.
pub const MULTICAST: u8 = 255;

/// Address of a device, 1..=254: its place in the line, given by DISCOVERY.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
pub struct DeviceAddress(u8);

impl DeviceAddress {
    /// The device next to the master.
    pub const FIRST: Self = Self(1);
    /// The last that can exist.
    pub const MAX: Self = Self(254);

    /// `address`: 1..=254.
    pub const fn new(address: u8) -> Option<Self> {
        if address == 0 || address > Self::MAX.0 { None } else { Some(Self(address)) }
    }

    /// The number.
    pub const fn get(self) -> u8 {
        self.0
    }

    /// Devices between the master and this one, 0..=253.
    pub const fn hops_before(self) -> u8 {
        self.0.saturating_sub(1)
    }
}

impl TryFrom<u8> for DeviceAddress {
    type Error = Error;

    fn try_from(address: u8) -> Result<Self, Error> {
        Self::new(address).ok_or(Error::WrongSource { got: address })
    }
}

impl From<DeviceAddress> for u8 {
    fn from(address: DeviceAddress) -> Self {
        address.0
    }
}

/// TYPE of a long-header frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum FrameType {
    /// DISCOV_MC
    Discovery = 1,
    /// PARAM_MC
    Param = 2,
    /// LD_REQ_P2P
    DelayReq = 3,
    /// LD_RESP_P2P: defined by the vendor; the request itself comes back instead.
    DelayResp = 4,
    /// SYNC_MC
    Sync = 5,
    /// OUT_MC: only the code is known.
    Out = 6,
    /// IN_UC: only the code is known.
    In = 7,
    /// ALARM_UC: only the code is known.
    Alarm = 8,
    /// DIAG_UC: only the code is known.
    Diag = 9,
    /// RECON_UC: only the code is known.
    Recon = 10,
}

impl FrameType {
    /// The type of this code, 1..=10.
    pub const fn from_code(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Discovery,
            2 => Self::Param,
            3 => Self::DelayReq,
            4 => Self::DelayResp,
            5 => Self::Sync,
            6 => Self::Out,
            7 => Self::In,
            8 => Self::Alarm,
            9 => Self::Diag,
            10 => Self::Recon,
            _ => return None,
        })
    }

    /// The code.
    pub const fn code(self) -> u8 {
        self as u8
    }

    /// Bytes from DA to FCS; `None` where no layout is published.
    pub const fn frame_len(self) -> Option<usize> {
        match self {
            Self::Discovery => Some(1030),
            Self::Param => Some(40),
            Self::DelayReq | Self::DelayResp => Some(8),
            Self::Sync => Some(14),
            Self::Out | Self::In | Self::Alarm | Self::Diag | Self::Recon => None,
        }
    }
}

/// A long-header frame whose FCS and length are right: from DA to FCS, without preamble.
///
/// ```text
///  byte 0    1    2     3       4 ...........  last four
///       DA   SA   TYPE  STATUS  payload        FCS (LSB first)
///       255  0
/// ```
///
/// Frames of the types [`Out`](FrameType::Out) to [`Recon`](FrameType::Recon) have an opaque payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LongFrame<'a> {
    source: u8,
    frame_type: FrameType,
    status: Status,
    payload: &'a [u8],
    fcs: u32,
}

impl<'a> LongFrame<'a> {
    /// Bytes of header and FCS.
    pub const OVERHEAD: usize = 8;

    /// Checks, in this order: at least 8 bytes, FCS, DA, TYPE, length.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::BadFcs`], [`Error::WrongDestination`], [`Error::UnknownType`],
    /// [`Error::LengthMismatch`]
    pub fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        let truncated = Error::Truncated { got: count(bytes.len()), need: count(Self::OVERHEAD) };
        let (body, trailer) = bytes.split_last_chunk().ok_or(truncated)?;
        let &[da, source, code, status, ref payload @ ..] = body else { return Err(truncated) };
        let (got, want) = (u32::from_le_bytes(*trailer), fcs(body));
        if got != want {
            return Err(Error::BadFcs { got, want });
        }
        if da != MULTICAST {
            return Err(Error::WrongDestination { got: da });
        }
        let frame_type = FrameType::from_code(code).ok_or(Error::UnknownType { got: code })?;
        match frame_type.frame_len() {
            Some(want) if want != bytes.len() => {
                Err(Error::LengthMismatch { got: count(bytes.len()), want: count(want) })
            }
            _ => Ok(Self { source, frame_type, status: Status(status), payload, fcs: got }),
        }
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

    /// The payload, if the frame is of this type; `N` is the type's payload length.
    pub(crate) fn of_type<const N: usize>(self, want: FrameType) -> Result<&'a [u8; N], Error> {
        match self.payload.first_chunk() {
            Some(payload) if self.frame_type == want => Ok(payload),
            _ => Err(Error::UnexpectedType { got: self.frame_type.code(), want: want.code() }),
        }
    }
}

/// Header, payload and FCS as one array; `N` = payload + 8, written by the frames of known length.
pub(crate) fn emit<const N: usize>(source: u8, frame_type: FrameType, status: Status, payload: &[u8]) -> [u8; N] {
    let mut bytes = [0; N];
    if let [da, sa, code, flags, rest @ ..] = bytes.as_mut_slice() {
        (*da, *sa, *code, *flags) = (MULTICAST, source, frame_type.code(), status.0);
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

/// A length as the errors carry it.
pub(crate) fn count(len: usize) -> u16 {
    u16::try_from(len).unwrap_or(u16::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_1_to_254() {
        for address in 0..=u8::MAX {
            assert_eq!(DeviceAddress::new(address).is_some(), (1..=254).contains(&address));
        }
    }

    #[test]
    fn ten_type_codes_are_known() {
        for code in 0..=u8::MAX {
            assert_eq!(FrameType::from_code(code).map(FrameType::code), (1..=10).contains(&code).then_some(code));
        }
    }

    #[test]
    fn a_type_without_layout_has_an_opaque_payload() {
        let bytes: [u8; 13] = emit(7, FrameType::Alarm, Status(0x85), &[1, 2, 3, 4, 5]);
        let frame = LongFrame::new(&bytes).unwrap();
        assert_eq!((frame.source(), frame.frame_type(), frame.status()), (7, FrameType::Alarm, Status(0x85)));
        assert_eq!((frame.payload(), frame.fcs()), (&[1, 2, 3, 4, 5][..], fcs(&bytes[..9])));
    }

    #[test]
    fn the_checks_come_in_their_order() {
        let mut bytes: [u8; 9] = emit(0, FrameType::DelayReq, Status::DELAY_REQ, &[0]);
        assert_eq!(LongFrame::new(&bytes), Err(Error::LengthMismatch { got: 9, want: 8 }));
        bytes[2] = 11;
        refresh_fcs(&mut bytes);
        assert_eq!(LongFrame::new(&bytes), Err(Error::UnknownType { got: 11 }));
        bytes[0] = 1;
        refresh_fcs(&mut bytes);
        assert_eq!(LongFrame::new(&bytes), Err(Error::WrongDestination { got: 1 }));
        bytes[8] ^= 1;
        assert!(matches!(LongFrame::new(&bytes), Err(Error::BadFcs { .. })));
        for len in 0..8 {
            assert_eq!(LongFrame::new(&bytes[..len]), Err(Error::Truncated { got: len as u16, need: 8 }));
        }
    }
}
