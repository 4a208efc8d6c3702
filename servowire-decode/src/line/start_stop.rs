//! What a start-stop protocol takes and gives.

use std::io;

use crate::sink::Sink;
use crate::time::Time;

/// A field of a start-stop line with its place in the capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineField {
    /// The content bits, the first of the line in bit 0.
    pub content: u16,
    /// Whether the delimiter was read as 1.
    pub delimiter: bool,
    /// The edge of the start bit, in picoseconds.
    pub start: Time,
    /// The end of the delimiter at the speaker's rate.
    pub end: Time,
    /// Spikes that were dropped before it or in it.
    pub spikes: u32,
    /// For the first field of a speaker: the bits of the line from its start bit on, as long as it speaks, the first in
    /// bit 0; those after it are 1. Otherwise 0.
    pub bits: u128,
}

/// A protocol on a start-stop line: takes fields, returns events.
pub trait StartStop {
    /// Content bits of a field: 8 or 16.
    const CONTENT_BITS: u32;

    /// The capture begins, at `start`.
    fn begin(&mut self, start: Time);

    /// Bits for which a line is low at the beginning of a request, and of an answer: the start bit and what is 0 behind it in
    /// each of them.
    const FIRST_LOW: [u32; 2];

    /// The next field of the line.
    fn field(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()>;

    /// The line has rested until `now`: a frame that nothing can follow any more is over.
    fn rest(&mut self, now: Time, out: &mut dyn Sink) -> io::Result<()>;

    /// Whether no frame is begun and not over.
    fn is_between(&self) -> bool;

    /// The recording ends, at `end`.
    fn finish(&mut self, end: Time, out: &mut dyn Sink) -> io::Result<()>;
}
