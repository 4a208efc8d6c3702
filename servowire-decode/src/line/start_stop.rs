//! Input and output of a start-stop protocol.

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
    /// For the first field of a speaker: the bits of the line from its start bit until the speaker stops, the first in bit
    /// 0; the bits after that are 1. Otherwise 0.
    pub bits: u128,
}

/// A protocol on a start-stop line: takes fields, returns events.
pub trait StartStop {
    /// Content bits of a field: 8 or 16.
    const CONTENT_BITS: u32;

    /// The capture begins, at `start`.
    fn begin(&mut self, start: Time);

    /// Number of bits for which the line is low at the beginning of a request, and of an answer: the start bit and the bits
    /// after it that are always 0.
    const FIRST_LOW: [u32; 2];

    /// Takes the next field of the line.
    fn field(&mut self, field: &LineField, out: &mut dyn Sink) -> io::Result<()>;

    /// The line has been idle until `now`: a frame that can no longer continue ends.
    fn rest(&mut self, now: Time, out: &mut dyn Sink) -> io::Result<()>;

    /// Returns whether the line is between two frames.
    fn is_between(&self) -> bool;

    /// The recording ends, at `end`.
    fn finish(&mut self, end: Time, out: &mut dyn Sink) -> io::Result<()>;
}
