//! Waits by giving the time back. Every future may be dropped at any point: the next call waits until the line is free. Whether
//! a request that changes the encoder has had its effect is not known then.

use nikon_aformat::RequestFrame;
use servowire_core::run_async as run;

use super::Frame;
use crate::Timer;
use crate::race::{self, race};

/// What sends and receives frames.
#[allow(async_fn_in_trait, reason = "drivers are used by one executor; Send is left to the implementation")]
pub trait FramePort {
    /// Why it cannot.
    type Error;
    /// Sends these frames with `gap_bits` idle bits between two, and begins at once. It switches the line driver on
    /// before and off after by itself: the encoder answers some microseconds later. A request that has begun goes out whole, also when
    /// the future is dropped.
    ///
    /// # Errors
    /// Those of the port.
    async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error>;
    /// Ends when a frame has been received, and gives it. Dropped before that it should lose none: a lost frame costs the
    /// exchange in which it happens. Between two calls the port keeps at least the frames of a response.
    ///
    /// # Errors
    /// Those of the port: the exchange is lost.
    async fn take(&mut self) -> Result<Frame, Self::Error>;
}

driver!(awaited, Timer, async);

/// The frame that comes until a time, or an error of the port.
async fn take<F: FramePort>(
    port: &mut F,
    line: &mut quiet::Line,
    timer: &mut impl Timer,
    until_ns: u64,
) -> Result<Heard<Result<Frame, F::Error>>, ClockError> {
    let what = race(port.take(), sleep(line, timer, until_ns)).await?;
    Ok(Heard { what, now_ns: line.now_ns(timer)? })
}

async fn sleep(line: &mut quiet::Line, timer: &mut impl Timer, until_ns: u64) -> Result<(), ClockError> {
    race::sleep(timer, |timer| line.after_ns(timer, until_ns), until_ns).await
}
