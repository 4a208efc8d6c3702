//! A-format encoders: Nikon, 2.5 to 16 Mbit/s, up to eight on a line.
//!
//! Frames have 18 bits, which hardly any UART can do: what sends and receives them is a `FramePort`, made of a PIO, an SPI
//! that samples ([`spi`](crate::spi)), or a FIFO in an FPGA.
//!
//! [`blocking`] spins while it waits, some tens of microseconds a call; [`asynch`] gives the time back. Both have the same
//! `Master` with the same calls.

#[cfg(feature = "async")]
pub mod asynch;
pub mod blocking;

use nikon_aformat::master::{BusTransaction, Line, Progress, Transaction};
use nikon_aformat::{Error, FRAME_BITS, Request, Resolution};

/// A frame as it came from the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Frame {
    /// The 16 bits between start bit and delimiter, the first of the line in bit 0.
    pub content: u16,
    /// Whether the delimiter was 1.
    pub framed: bool,
    /// When the delimiter ended, by the clock of the driver. `None` is the time at which the frame is taken: the port has to be
    /// asked soon enough then.
    pub end_ns: Option<u64>,
}

/// A transaction, with one encoder or with all on a line.
trait Receiver {
    /// What it is made for.
    type Value;

    fn frame(&mut self, content: u16, end_ns: u64) -> Progress<Self::Value>;
    fn framing_error(&mut self, end_ns: u64) -> Progress<Self::Value>;
    fn poll(&mut self, now_ns: u64) -> Progress<Self::Value>;
    fn progress(&self) -> Progress<Self::Value>;

    /// Takes a frame that came from the port at `now_ns`.
    fn take(&mut self, frame: Frame, now_ns: u64) -> Progress<Self::Value> {
        let end_ns = frame.end_ns.unwrap_or(now_ns);
        if frame.framed { self.frame(frame.content, end_ns) } else { self.framing_error(end_ns) }
    }
}

macro_rules! receiver {
    ($transaction:ty => $value:ty) => {
        impl Receiver for $transaction {
            type Value = $value;

            fn frame(&mut self, content: u16, end_ns: u64) -> Progress<$value> {
                self.frame(content, end_ns)
            }

            fn framing_error(&mut self, end_ns: u64) -> Progress<$value> {
                self.framing_error(end_ns)
            }

            fn poll(&mut self, now_ns: u64) -> Progress<$value> {
                self.poll(now_ns)
            }

            fn progress(&self) -> Progress<$value> {
                self.progress()
            }
        }
    };
}
receiver!(Transaction => nikon_aformat::master::Exchange);
receiver!(BusTransaction => ());

/// How long this request and the longest answer to it take.
fn longest_ns(line: Line, request: Request, resolution: Resolution) -> u64 {
    line.longest_ns(request, &request.expected(resolution)).into()
}

/// The line has to be silent for two frames after something that nobody has asked for.
const fn silence_ns(line: Line) -> u32 {
    line.rate.bits_ns(FRAME_BITS).saturating_mul(2)
}

/// What a lost answer is to a procedure.
const LOST: Error = Error::NoResponse;
