//! The port as one of A-format frames, for the A-format driver: the PIO switches the line driver.

use core::convert::Infallible;

use nikon_aformat::{FRAME_BITS, RequestFrame};
use servowire_drivers::nikon::Frame;
use servowire_drivers::nikon::blocking::FramePort;

use crate::clock::Clock;
use crate::port::{Prepared, RingReceiver, Transmitter, Unit};

/// Bits of a unit.
pub const BITS: u8 = 16;
/// Frames of the longest response, and some noise.
const MOST: usize = 8;

/// Transmitter and receiver of units of [`BITS`] bits. Frames are returned when the line is quiet again, with the times at
/// which they ended: this processor takes longer per frame than the line.
pub struct Frames<'a> {
    transmitter: Transmitter,
    receiver: RingReceiver,
    clock: &'a Clock,
    frame_ns: u64,
    block: [Option<Unit>; MOST],
    len: usize,
    next: usize,
    /// When the last one of the block ended.
    end_ns: u64,
}

impl<'a> Frames<'a> {
    /// Creates a port from these. `clock` is that of the driver; a frame of its rate lasts `frame_ns`.
    pub fn new(transmitter: Transmitter, receiver: RingReceiver, clock: &'a Clock, frame_ns: u32) -> Self {
        let frame_ns = frame_ns.into();
        Self { transmitter, receiver, clock, frame_ns, block: [None; MOST], len: 0, next: 0, end_ns: 0 }
    }

    /// Takes a block, if one has begun; a line that is never quiet fills it.
    fn collect(&mut self) {
        (self.len, self.next) = (0, 0);
        loop {
            let unit = self.receiver.take();
            let now_ns = self.clock.latest_ns();
            if unit.is_some() {
                self.block[self.len] = unit;
                self.len += 1;
                self.end_ns = now_ns;
            } else if self.len == 0 || now_ns > self.end_ns + self.frame_ns * 3 / 2 {
                return;
            }
            if self.len == MOST {
                return;
            }
        }
    }
}

impl FramePort for Frames<'_> {
    type Error = Infallible;

    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Infallible> {
        self.transmitter.send(&prepared(frames.iter().map(|frame| frame.content()), gap_bits, 0));
        Ok(())
    }

    #[inline]
    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        if self.next == self.len {
            self.collect();
        }
        let Some(Unit { content, framed }) =
            self.block.get(self.next).copied().flatten().filter(|_| self.next < self.len)
        else {
            return Ok(None);
        };
        self.next += 1;
        let end_ns = self.end_ns - (self.len - self.next) as u64 * self.frame_ns;
        Ok(Some(Frame { content, framed, end_ns: Some(end_ns) }))
    }
}

/// Frames as a message, with pauses between them; it begins `wait_cycles` after its start.
pub fn prepared(contents: impl Iterator<Item = u16>, gap_bits: u32, wait_cycles: u32) -> Prepared {
    const _: () = assert!(FRAME_BITS == BITS as u32 + 2);
    Prepared::new(contents, BITS.into(), gap_bits, wait_cycles)
}
