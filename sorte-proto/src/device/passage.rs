//! A start-up frame on its way through a device.

use super::heard::Path;
use super::port::State;
use crate::cut_through::Rewriter;
use crate::frame_type::FrameType;

/// A start-up frame on its way through a device: a byte in, a byte out, a hundred bytes of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Passage {
    pub(super) rewriter: Rewriter,
    path: Path,
    /// State of the port when the frame began.
    pub(super) began_in: State,
    /// The last device, in IDLE: it sends back DISCOVERY and nothing else.
    only_discovery: bool,
}

impl Passage {
    pub(super) const fn new(rewriter: Rewriter, path: Path, began_in: State, only_discovery: bool) -> Self {
        Self { rewriter, path, began_in, only_discovery }
    }

    /// Takes the byte received and returns the byte to send.
    #[inline]
    pub fn byte(&mut self, byte: u8) -> u8 {
        self.rewriter.byte(byte)
    }

    /// Where the frame is sent. This is known before the first byte, except in a last device in IDLE, which sends back only
    /// DISCOVERY: there it is `None` until the third byte has come. The published device begins to send four bytes after it
    /// begins to receive, so its FIFO leaves time for that.
    pub const fn path(&self) -> Option<Path> {
        if !self.only_discovery {
            return Some(self.path);
        }
        match self.rewriter.transit() {
            transit if transit.len() < 3 => None,
            transit if transit.is_for_all(FrameType::Discovery) => Some(self.path),
            _ => Some(Path::Absorb),
        }
    }
}
