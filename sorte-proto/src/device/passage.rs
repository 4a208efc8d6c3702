//! A start-up frame on its way through a device.

use crate::crc::RunningFcs;
use crate::cut_through::{DiscoveryRewriter, SyncRewriter};
use crate::{Assignment, Error, FrameType, LongFrame, MULTICAST, Parameters, Sync};

/// A start-up frame on its way through a device: a byte in, a byte out, some hundred bytes of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Passage {
    pub(super) kind: Kind,
    at: u16,
    /// DA, SA, TYPE and STATUS as received.
    pub(super) head: [u8; 4],
    /// Bytes 4 to 35 as sent: the parameters, if it is a PARAM frame.
    stored: [u8; Parameters::LEN],
    /// FCS of all but the last four bytes, which are held back.
    check: RunningFcs,
    held: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Kind {
    Plain,
    Discovery(DiscoveryRewriter),
    Sync(SyncRewriter),
}

/// What a good frame has told.
#[derive(Debug, Clone, Copy)]
pub(super) enum Learnt {
    Nothing,
    Place(Assignment),
    Parameters([u8; Parameters::LEN]),
    Sync(Sync),
}

impl Passage {
    pub(super) const fn new(kind: Kind) -> Self {
        Self { kind, at: 0, head: [0; 4], stored: [0; Parameters::LEN], check: RunningFcs::START, held: 0 }
    }

    /// The byte to send for the byte received.
    pub fn byte(&mut self, byte: u8) -> u8 {
        let out = match &mut self.kind {
            Kind::Plain => byte,
            Kind::Discovery(rewriter) => rewriter.byte(byte),
            Kind::Sync(rewriter) => rewriter.byte(byte),
        };
        let at = usize::from(self.at);
        if let Some(place) = self.head.get_mut(at) {
            *place = byte;
        } else if let Some(place) = at.checked_sub(4).and_then(|at| self.stored.get_mut(at)) {
            *place = out;
        }
        if at >= 4 {
            let [oldest, ..] = self.held.to_le_bytes();
            self.check.push(oldest);
        }
        self.held = self.held >> 8 | u32::from(byte) << 24;
        self.at = self.at.saturating_add(1);
        out
    }

    pub(super) fn is_discovery(&self) -> bool {
        self.head[2] == FrameType::Discovery.code()
    }

    /// Output bytes of the line so far, in a DISCOVERY frame.
    pub(super) fn output_total(&self) -> u16 {
        let [_, _, _, _, low, high, ..] = self.stored;
        u16::from_le_bytes([low, high])
    }

    /// The checks of [`LongFrame::new`] in their order, then what the frame says.
    pub(super) fn learnt(&self) -> Result<Learnt, Error> {
        match self.kind {
            Kind::Discovery(rewriter) => rewriter.finish().map(|(_, assignment)| Learnt::Place(assignment)),
            Kind::Sync(rewriter) => rewriter.finish().map(Learnt::Sync),
            Kind::Plain => self.plain(),
        }
    }

    fn plain(&self) -> Result<Learnt, Error> {
        const { assert!(LongFrame::OVERHEAD == 8) };
        let [da, _, code, _] = self.head;
        if self.at < 8 {
            return Err(Error::Truncated { got: self.at, need: 8 });
        }
        let (got, want) = (self.held, self.check.value());
        if got != want {
            return Err(Error::BadFcs { got, want });
        }
        if da != MULTICAST {
            return Err(Error::WrongDestination { got: da });
        }
        let frame_type = FrameType::from_code(code).ok_or(Error::UnknownType { got: code })?;
        match frame_type.frame_len() {
            Some(len) if len != usize::from(self.at) => {
                Err(Error::LengthMismatch { got: self.at, want: u16::try_from(len).unwrap_or(u16::MAX) })
            }
            _ if frame_type == FrameType::Param => Ok(Learnt::Parameters(self.stored)),
            _ => Ok(Learnt::Nothing),
        }
    }
}
