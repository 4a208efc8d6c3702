//! A-format encoders: Nikon, 2.5 to 16 Mbit/s, up to eight on a line.
//!
//! Frames have 18 bits, which hardly any UART can handle. They are sent and received by a `FramePort`, for example over a PIO, a
//! sampling SPI ([`spi`](crate::spi)), or a FIFO in an FPGA.
//!
//! [`blocking`] spins while it waits, some tens of microseconds per call; `asynch` (feature `async`) yields to the executor.
//! Both have the same `Driver` with the same calls.

#[macro_use]
mod driver;

#[cfg(feature = "async")]
pub mod asynch;
pub mod blocking;

use nikon_aformat::master::Line;
use nikon_aformat::{EncoderAddress, Error, FRAME_BITS, Operation, Request, Resolution};
use servowire_core::{Machine, Progress};

/// A frame as received from the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Frame {
    /// The 16 bits between start bit and delimiter, the first on the line in bit 0.
    pub content: u16,
    /// Whether the delimiter was 1.
    pub framed: bool,
    /// When the delimiter ended, by the clock of the driver. `None` stands for the time at which the frame is taken; the port
    /// then has to be asked soon enough.
    pub end_ns: Option<u64>,
}

/// The parts from which a `Driver` was created.
#[derive(Debug, Clone, Copy)]
pub struct Released<F, C> {
    /// The port.
    pub port: F,
    /// The clock or timer.
    pub clock: C,
}

/// Passes a frame that came from the port at `now_ns` to a transaction, with one encoder or with all on a line.
fn hear<M: Machine<Unit = [Option<u16>]>>(machine: &mut M, frame: Frame, now_ns: u64) -> Progress<M::Value, M::Error> {
    machine.hear(&[frame.framed.then_some(frame.content)], frame.end_ns.unwrap_or(now_ns))
}

/// Returns how long this request and the longest answer to it take.
fn longest_ns(line: Line, request: Request, resolution: Resolution) -> u64 {
    line.longest_ns(request, &request.expected(resolution)).into()
}

/// Returns the same for an unknown request: the longest request and the longest answers of all encoders.
const fn unknown_ns(line: Line, resolution: Resolution) -> u64 {
    let write = Request::new(EncoderAddress::ZERO, Operation::EepromWriteBank { bank: 0, address: 0, data: 0 });
    let all = Request::new(EncoderAddress::MAX, Operation::Abs24VelAccMt);
    line.request_ns(write).saturating_add(line.answered_ns(&all.expected(resolution))) as u64
}

/// How long the line has to be silent after unexpected data: two frames.
const fn silence_ns(line: Line) -> u32 {
    line.rate.bits_ns(FRAME_BITS).saturating_mul(2)
}

/// The error that tells a procedure of a lost answer.
const LOST: Error = Error::NoResponse;
