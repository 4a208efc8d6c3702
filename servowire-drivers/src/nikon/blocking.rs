//! Waits by spinning.

use nikon_aformat::RequestFrame;
use servowire_core::run;

use super::Frame;
use crate::Clock;
use crate::quiet::spin;

/// What sends and receives frames.
pub trait FramePort {
    /// Why it cannot.
    type Error;
    /// Sends these frames with `gap_bits` idle bits between two, and begins at once. It switches the line driver on
    /// before and off after by itself: the encoder answers some microseconds later.
    ///
    /// # Errors
    /// Those of the port.
    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error>;
    /// The next frame that was received, if there is one. Between two looks the port keeps at least the frames of a response.
    ///
    /// # Errors
    /// Those of the port: the exchange is lost.
    fn take(&mut self) -> Result<Option<Frame>, Self::Error>;
}

driver!(spun, Clock);

/// The frame that comes until a time, or an error of the port.
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
