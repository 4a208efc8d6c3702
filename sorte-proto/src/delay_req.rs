use crate::error::Error;
use crate::frame::{LongFrame, emit};
use crate::frame_type::FrameType;
use crate::place::Place;
use crate::status::Status;

/// A line-delay request. The neighbour's port sends it back after a fixed time; it has no separate answer.
///
/// ```text
///  byte 0    1   2   3       4
///       255  SA  3   STATUS  FCS
/// ```
///
/// The frame is only a header, so this type is both view and value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct DelayReq {
    /// SA, 0 in everything the published firmware sends.
    pub source: u8,
    /// STATUS.
    pub status: Status,
}

impl DelayReq {
    /// Number of bytes from DA to FCS.
    pub const LEN: usize = LongFrame::OVERHEAD;

    /// Creates the request that the master sends to the first device.
    pub const fn of_master(place: Place) -> Self {
        Self { source: 0, status: place.choose(Status::FINAL, Status::DELAY_REQ) }
    }

    /// Creates the request that a device sends to the next one.
    pub const fn of_device(place: Place) -> Self {
        Self { source: 0, status: place.choose(Status::FINAL_DEVICE_DELAY_REQ, Status::DELAY_REQ) }
    }

    /// Checks as [`LongFrame::parse`], then that TYPE is 3.
    ///
    /// # Errors
    /// As [`LongFrame::parse`]; [`Error::UnexpectedType`].
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        Self::of(LongFrame::parse(bytes)?)
    }

    /// Takes the frame if its TYPE is 3.
    ///
    /// # Errors
    /// [`Error::UnexpectedType`]
    pub fn of(frame: LongFrame<'_>) -> Result<Self, Error> {
        frame.of_type::<0>(FrameType::DelayReq)?;
        Ok(Self { source: frame.source(), status: frame.status() })
    }

    /// The frame from DA to FCS.
    pub fn emit(&self) -> [u8; Self::LEN] {
        emit(self.source, FrameType::DelayReq, self.status, &[])
    }
}

servowire_core::one_line!(DelayReq { Self { status, .. } => "DELAY_REQ, STATUS {}", status; });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_header_gives_itself_back() {
        for source in (0..=u8::MAX).step_by(crate::stride(51)) {
            for status in (0..=u8::MAX).step_by(crate::stride(15)).map(Status::from_bits_retain) {
                let frame = DelayReq { source, status };
                assert_eq!(DelayReq::parse(&frame.emit()), Ok(frame));
            }
        }
    }

    #[test]
    fn a_response_is_not_a_request() {
        let bytes: [u8; 8] = emit(0, FrameType::DelayResp, Status::DELAY_RESP, &[]);
        assert_eq!(DelayReq::parse(&bytes), Err(Error::UnexpectedType { got: 4, want: 3 }));
    }
}
