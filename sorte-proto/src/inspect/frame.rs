use crate::delay_req::DelayReq;
use crate::discovery::DiscoveryView;
use crate::error::Error;
use crate::exchange::{DeviceFrameView, MasterFrameView};
use crate::frame::LongFrame;
use crate::frame_type::FrameType;
use crate::param::Param;
use crate::payload::Slice;
use crate::sync::Sync;

/// What the line was doing when the frame was captured. Only this says which kinds of frames are possible.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum During {
    /// The start-up: long-header frames with FCS.
    StartUp,
    /// The IO exchange: master and device frames with CRC-8, of any length.
    Exchange,
}

/// What a frame is, or was meant to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Kind {
    /// A long-header frame with this TYPE.
    Long(FrameType),
    /// A master frame of the IO exchange.
    Master,
    /// A device frame of the IO exchange.
    Device,
    /// TYPE is unknown or missing.
    Unknown,
}

impl Kind {
    /// Identifies a frame by TYPE in the start-up and by SA in the exchange, whether its check is right or not.
    pub(super) fn of(during: During, bytes: &[u8]) -> Self {
        match (during, bytes) {
            (During::StartUp, [_, _, code, ..]) => FrameType::from_code(*code).map_or(Self::Unknown, Self::Long),
            (During::StartUp, _) => Self::Unknown,
            (During::Exchange, [0, ..]) => Self::Master,
            (During::Exchange, _) => Self::Device,
        }
    }

    /// The vendor's name of the type, `master`, `device`, or `?`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Long(frame_type) => frame_type.name(),
            Self::Master => "master",
            Self::Device => "device",
            Self::Unknown => "?",
        }
    }
}

servowire_core::one_line!(Kind { kind => "{}", kind.name(); });

/// The values of a frame of any kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Frame<'a> {
    /// DISCOVERY
    Discovery(DiscoveryView<'a>),
    /// PARAM
    Param(Param),
    /// DELAY_REQ
    DelayReq(DelayReq),
    /// SYNC
    Sync(Sync),
    /// A type without a payload, or whose layout is not published.
    Other(LongFrame<'a>),
    /// The master frame of the exchange.
    Master(MasterFrameView<'a>),
    /// A device frame of the exchange.
    Device(DeviceFrameView<'a>),
}

impl<'a> Frame<'a> {
    /// A frame of the exchange may have any length; SA says who sent it.
    pub(super) fn parse(during: During, bytes: &'a [u8]) -> Result<Self, Error> {
        match (during, bytes) {
            (During::StartUp, _) => Self::of_long(LongFrame::parse(bytes)?),
            (During::Exchange, [0, ..]) => {
                let output_len = bytes.len().saturating_sub(MasterFrameView::OVERHEAD);
                MasterFrameView::parse(output_len, bytes).map(Self::Master)
            }
            (During::Exchange, _) => {
                let payload_len = bytes.len().saturating_sub(DeviceFrameView::OVERHEAD);
                DeviceFrameView::parse(payload_len, bytes).map(Self::Device)
            }
        }
    }

    pub(super) fn of_long(frame: LongFrame<'a>) -> Result<Self, Error> {
        Ok(match frame.frame_type() {
            FrameType::Discovery => Self::Discovery(DiscoveryView::of(frame)?),
            FrameType::Param => Self::Param(Param::of(frame)?),
            FrameType::DelayReq => Self::DelayReq(DelayReq::of(frame)?),
            FrameType::Sync => Self::Sync(Sync::of(frame)?),
            _ => Self::Other(frame),
        })
    }

    /// The slices of the four axes, if it is a master frame whose output bytes may be those of the CNC machine: four bytes for
    /// each of at most four devices. Nothing in the frame says whether they are.
    pub fn cnc_slices(&self) -> Option<impl Iterator<Item = Slice> + 'a> {
        match self {
            Self::Master(frame) if frame.output().len() % 4 == 0 && frame.output().len() <= 16 => {
                Some(cnc_slices(frame.output()))
            }
            _ => None,
        }
    }
}

servowire_core::one_line!(Frame<'_> {
    Self::Discovery(frame) => "{}", frame;
    Self::Param(frame) => "{}", frame;
    Self::DelayReq(frame) => "{}", frame;
    Self::Sync(frame) => "{}", frame;
    Self::Other(frame) => "{}", frame;
    Self::Master(frame) => "{}", frame;
    Self::Device(frame) => "{}", frame;
});

/// The slices of output bytes that may be those of the CNC machine: four bytes for each of at most four devices.
pub(super) fn cnc_slices(output: &[u8]) -> impl Iterator<Item = Slice> + '_ {
    let cnc = output.len() % 4 == 0 && output.len() <= 16;
    let output = if cnc { output } else { &[] };
    output.chunks_exact(4).filter_map(|bytes| bytes.first_chunk()).map(|bytes| Slice::parse(*bytes))
}
