//! Waits by yielding to the executor. Every future may be dropped at any point: the next call waits until the line is free.
//! After a drop it is not known whether a request that changes the encoder took effect.

use nikon_aformat::RequestFrame;
use servowire_core::run_async as run;

use super::Frame;
use crate::Timer;
use crate::race::{self, race};

/// A port that sends and receives frames.
#[allow(async_fn_in_trait, reason = "drivers are used by one executor; Send is left to the implementation")]
pub trait FramePort {
    /// Why the port failed.
    type Error;
    /// Sends these frames with `gap_bits` idle bits between them, beginning at once. The port itself switches the line driver on
    /// before and off after them; the encoder answers some microseconds later. A request that has begun is sent completely, even
    /// if the future is dropped.
    ///
    /// # Errors
    /// The errors of the port.
    async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error>;
    /// Waits for a frame and returns it. If the future is dropped earlier, it should lose no frame: a lost frame costs the
    /// exchange in which it happens. Between two calls the port must keep at least the frames of a response.
    ///
    /// # Errors
    /// The errors of the port; the exchange is lost.
    async fn take(&mut self) -> Result<Frame, Self::Error>;
}

driver!(awaited, Timer, async);

/// Waits for a frame until a given time; returns the frame or an error of the port.
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
