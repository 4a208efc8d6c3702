//! Waits by spinning.

use nikon_aformat::RequestFrame;
use servowire_core::run;

use super::Frame;
use crate::Clock;
use crate::quiet::spin;

/// A port that sends and receives frames.
pub trait FramePort {
    /// Why the port failed.
    type Error;
    /// Sends these frames with `gap_bits` idle bits between them, beginning at once. The port itself switches the line driver on
    /// before and off after them; the encoder answers some microseconds later.
    ///
    /// # Errors
    /// The errors of the port.
    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error>;
    /// Returns the next received frame, if there is one. Between two calls the port must keep at least the frames of a response.
    ///
    /// # Errors
    /// The errors of the port; the exchange is lost.
    fn take(&mut self) -> Result<Option<Frame>, Self::Error>;
}

driver!(spun, Clock);

/// Waits for a frame until a given time; returns the frame or an error of the port.
#[inline(always)]
fn take<F: FramePort>(
    port: &mut F,
    line: &mut quiet::Line,
    clock: &mut impl Clock,
    until_ns: u64,
) -> Result<Heard<Result<Frame, F::Error>>, ClockError> {
    spin(line, clock, until_ns, || port.take().transpose())
}

fn sleep(line: &mut quiet::Line, clock: &mut impl Clock, until_ns: u64) -> Result<(), ClockError> {
    line.wait_until(clock, until_ns)
}
