//! A start-up frame on its way through a device.

use super::heard::Path;
use super::port::State;
use crate::cut_through::{DiscoveryRewriter, SyncRewriter, Transit};
use crate::discovery::Assignment;
use crate::error::Error;
use crate::frame_type::FrameType;
use crate::param::Parameters;
use crate::sync::Sync;

/// A start-up frame on its way through a device: a byte in, a byte out, some hundred bytes of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Passage {
    kind: Kind,
    path: Path,
    /// State of the port when the frame began.
    began_in: State,
    /// A last device in IDLE sends back DISCOVERY and nothing else.
    only_discovery: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Kind {
    Plain(Plain),
    Discovery(DiscoveryRewriter),
    Sync(SyncRewriter),
    /// A DISCOVERY that is sent again, or PARAM.
    Either(DiscoveryRewriter, Plain),
}

/// A frame that passes unchanged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Plain {
    transit: Transit,
    /// Bytes 4 to 35: the parameters, if it is a PARAM frame.
    stored: [u8; Parameters::LEN],
}

impl Plain {
    pub(super) const NEW: Self = Self { transit: Transit::START, stored: [0; Parameters::LEN] };

    #[inline]
    fn take(&mut self, byte: u8) {
        if !self.transit.passes(byte) {
            self.look(byte);
        }
    }

    #[inline(never)]
    fn look(&mut self, byte: u8) {
        let at = self.transit.take(byte);
        match self.stored.get_mut(usize::from(at.wrapping_sub(4))) {
            Some(place) => *place = byte,
            // The head, or what comes after the parameters.
            None if at > 3 => self.transit.quiet_until(u16::MAX),
            None => {}
        }
    }
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
    pub(super) const fn new(kind: Kind, path: Path, began_in: State, only_discovery: bool) -> Self {
        Self { kind, path, began_in, only_discovery }
    }

    pub(super) const fn began_in(&self) -> State {
        self.began_in
    }

    /// The byte to send for the byte received.
    #[inline]
    pub fn byte(&mut self, byte: u8) -> u8 {
        // The longest of all frames.
        match &mut self.kind {
            Kind::Discovery(rewriter) => rewriter.byte(byte),
            _ => self.short(byte),
        }
    }

    #[inline(never)]
    fn short(&mut self, byte: u8) -> u8 {
        match &mut self.kind {
            Kind::Discovery(rewriter) => rewriter.byte(byte),
            Kind::Sync(rewriter) => rewriter.byte(byte),
            Kind::Either(rewriter, plain) => {
                plain.take(byte);
                rewriter.byte(byte)
            }
            Kind::Plain(plain) => {
                plain.take(byte);
                byte
            }
        }
    }

    /// Where the frame goes. It is known before the first byte, but for a last device in IDLE, which sends back
    /// DISCOVERY only: `None` there until the third byte has come. The published device begins to send four bytes after
    /// it begins to receive, so its FIFO bears that.
    pub const fn path(&self) -> Option<Path> {
        if !self.only_discovery {
            return Some(self.path);
        }
        match self.transit() {
            transit if transit.len() < 3 => None,
            transit if transit.is_for_all(FrameType::Discovery) => Some(self.path),
            _ => Some(Path::Absorb),
        }
    }

    pub(super) const fn transit(&self) -> &Transit {
        match &self.kind {
            Kind::Plain(plain) => &plain.transit,
            Kind::Discovery(rewriter) | Kind::Either(rewriter, _) => rewriter.transit(),
            Kind::Sync(rewriter) => rewriter.transit(),
        }
    }

    /// Whether the device has put its own bits into the STATUS byte that went out.
    pub(super) const fn has_written_status(&self) -> bool {
        let frame_type = match self.kind {
            Kind::Plain(_) => return false,
            Kind::Discovery(_) | Kind::Either(..) => FrameType::Discovery,
            Kind::Sync(_) => FrameType::Sync,
        };
        self.transit().len() > 3 && self.transit().is_for_all(frame_type)
    }

    /// Output bytes of the line so far, in a DISCOVERY frame.
    pub(super) fn output_total(&self) -> Option<u16> {
        match &self.kind {
            Kind::Discovery(rewriter) => Some(rewriter.output_total()),
            Kind::Either(rewriter, _) if rewriter.transit().is_for_all(FrameType::Discovery) => {
                Some(rewriter.output_total())
            }
            Kind::Plain(Plain { transit, stored }) if transit.is_for_all(FrameType::Discovery) => {
                let [_, _, _, _, low, high, ..] = *stored;
                Some(u16::from_le_bytes([low, high]))
            }
            _ => None,
        }
    }

    /// The checks of [`LongFrame::parse`](crate::LongFrame::parse), then what the frame says. A good frame of another type
    /// than the one that is rewritten says nothing.
    pub(super) fn learnt(&self) -> Result<Learnt, Error> {
        let plain = |plain: &Plain| {
            plain.transit.check().map(|frame_type| match frame_type {
                FrameType::Param => Learnt::Parameters(plain.stored),
                _ => Learnt::Nothing,
            })
        };
        let learnt = match &self.kind {
            Kind::Discovery(rewriter) => rewriter.finish().map(|passed| Learnt::Place(passed.assignment)),
            Kind::Sync(rewriter) => rewriter.finish().map(Learnt::Sync),
            Kind::Either(rewriter, other) => match rewriter.finish() {
                Err(Error::UnexpectedType { .. }) => plain(other),
                passed => passed.map(|passed| Learnt::Place(passed.assignment)),
            },
            Kind::Plain(other) => plain(other),
        };
        match learnt {
            Err(Error::UnexpectedType { .. }) => Ok(Learnt::Nothing),
            learnt => learnt,
        }
    }
}
