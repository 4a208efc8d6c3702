//! A port for A-format frames over an SPI.

use embedded_hal::spi::SpiBus;
#[cfg(feature = "async")]
use embedded_hal_async::spi::SpiBus as AsyncSpiBus;
use nikon_aformat::RequestFrame;
use nrz_line::Field;

use super::{Fault, Heard, Released, ReleasedFrames, Sampler, Sampling, SpiError, line_bits};
#[cfg(feature = "async")]
use crate::nikon::asynch;
use crate::nikon::{Frame, blocking};
use crate::{Clock, Direction};

/// A port for A-format frames over an SPI. It knows when each frame ended from its place among the samples.
///
/// `send` sends the frames in one transfer and then samples the window, so it lasts as long as the whole exchange. A request has
/// at most five frames; with 8 samples per bit and no gaps, `tx` needs 93 bytes. The window is all of `rx`: it has to hold the
/// wait for the answer and 54 or 72 bits for each encoder that answers.
///
/// The async futures of the SPI have to stop the transfer when they are dropped. Only the window is an async transfer; a request
/// is sent through the blocking [`SpiBus`], so that none is cut off.
#[derive(Debug)]
pub struct SpiFrames<'b, S, D, C> {
    sampler: Sampler<'b, S, D>,
    clock: C,
    /// When the window began.
    began_ns: u64,
}

impl<'b, S, D, C> SpiFrames<'b, S, D, C> {
    /// Creates a port on this SPI, which has to be set to the clock and the order in `sampling`. `clock` is that of the driver.
    pub const fn new(bus: S, direction: D, clock: C, sampling: Sampling, tx: &'b mut [u8], rx: &'b mut [u8]) -> Self {
        Self { sampler: Sampler::new(bus, direction, sampling, tx, rx), clock, began_ns: 0 }
    }

    /// Returns SPI, direction and clock.
    pub fn release(self) -> ReleasedFrames<S, D, C> {
        let Released { bus, direction } = self.sampler.release();
        ReleasedFrames { bus, direction, clock: self.clock }
    }

    fn frame(&self, field: Field) -> Frame {
        let sampling = &self.sampler.sampling;
        let samples = sampling.format.field_bits().saturating_mul(sampling.format.samples_per_bit());
        let end = field.start.saturating_add(samples.into());
        let end_ns = self.began_ns.saturating_add(sampling.ns(end));
        Frame { content: field.content, framed: field.delimiter, end_ns: Some(end_ns) }
    }
}

/// Returns frames as units of sixteen bits.
fn units(frames: &[RequestFrame]) -> impl Iterator<Item = (u16, u32)> {
    frames.iter().map(|frame| (frame.content(), 16))
}

impl<S: SpiBus, D: Direction, C: Clock> blocking::FramePort for SpiFrames<'_, S, D, C> {
    type Error = Fault<S, D>;

    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error> {
        self.sampler.send(line_bits(units(frames), gap_bits))?;
        self.began_ns = self.clock.now_ns()?;
        self.sampler.sample(usize::MAX)
    }

    fn take(&mut self) -> Result<Option<Frame>, Self::Error> {
        match self.sampler.hear()? {
            Some(Heard::Field(field)) => Ok(Some(self.frame(field))),
            Some(Heard::Noise) => Err(SpiError::Noise),
            None => Ok(None),
        }
    }
}

#[cfg(feature = "async")]
impl<S: SpiBus + AsyncSpiBus, D: Direction, C: Clock> asynch::FramePort for SpiFrames<'_, S, D, C> {
    type Error = Fault<S, D>;

    async fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Self::Error> {
        self.sampler.send(line_bits(units(frames), gap_bits))?;
        self.began_ns = self.clock.now_ns()?;
        self.sampler.sample_asynch(usize::MAX).await
    }

    async fn take(&mut self) -> Result<Frame, Self::Error> {
        match self.sampler.hear_asynch().await? {
            Heard::Field(field) => Ok(self.frame(field)),
            Heard::Noise => Err(SpiError::Noise),
        }
    }
}
