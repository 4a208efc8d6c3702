//! An 8N1 UART over an SPI.

use embedded_hal::spi::SpiBus;
#[cfg(feature = "async")]
use embedded_hal_async::spi::SpiBus as AsyncSpiBus;
use embedded_io::{ErrorType, Read, ReadReady, Write};

use super::{Fault, Heard, Released, Sampler, Sampling, SpiError, line_bits};
use crate::Direction;

/// A UART over an SPI, for the T-Format drivers. Pass them [`Automatic`](crate::Automatic) as direction, because this UART
/// switches the line driver itself.
///
/// A write sends its bytes in one transfer and then samples the window, so it lasts as long as the whole exchange; what was
/// received is read afterwards. Requests have at most four bytes; with 8 samples per bit, `tx` needs 42 bytes. The window is all of
/// `rx`.
///
/// The async futures of the SPI have to stop the transfer when they are dropped. Only the window is an async transfer; a request
/// is sent through the blocking [`SpiBus`], so that none is cut off: ID 0 without its end is ID 8.
#[derive(Debug)]
pub struct SpiUart<'b, S, D> {
    sampler: Sampler<'b, S, D>,
    /// The result of a look at the line.
    next: Option<Heard>,
}

impl<'b, S, D> SpiUart<'b, S, D> {
    /// Creates a UART on this SPI, which has to be set to the clock and the order in `sampling`.
    pub const fn new(bus: S, direction: D, sampling: Sampling, tx: &'b mut [u8], rx: &'b mut [u8]) -> Self {
        Self { sampler: Sampler::new(bus, direction, sampling, tx, rx), next: None }
    }

    /// Returns SPI and direction.
    pub fn release(self) -> Released<S, D> {
        self.sampler.release()
    }

    /// Writes fields to `bytes`, beginning with `heard`; returns how many.
    fn take<E, P>(&mut self, heard: Heard, bytes: &mut [u8]) -> Result<usize, SpiError<E, P>> {
        let mut heard = Some(heard);
        let mut count = 0_usize;
        for place in bytes.iter_mut() {
            let Some(now) = heard.take().or_else(|| self.sampler.field().map(Heard::Field)) else { break };
            match now {
                Heard::Field(field) if field.delimiter => [*place, _] = field.content.to_le_bytes(),
                // The bytes before it come first.
                other if count > 0 => {
                    self.next = Some(other);
                    break;
                }
                Heard::Field(_) => return Err(SpiError::Framing),
                Heard::Noise => return Err(SpiError::Noise),
            }
            count = count.saturating_add(1);
        }
        Ok(count)
    }
}

/// Returns bytes as units of eight bits.
fn units(bytes: &[u8]) -> impl Iterator<Item = (u16, u32)> {
    bytes.iter().map(|byte| (u16::from(*byte), 8))
}

impl<S: embedded_hal::spi::ErrorType, D: Direction> ErrorType for SpiUart<'_, S, D>
where
    D::Error: core::fmt::Debug,
{
    type Error = Fault<S, D>;
}

impl<S: SpiBus, D: Direction> Write for SpiUart<'_, S, D>
where
    D::Error: core::fmt::Debug,
{
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.next = None;
        self.sampler.ask(line_bits(units(bytes), 0))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

impl<S: SpiBus, D: Direction> ReadReady for SpiUart<'_, S, D>
where
    D::Error: core::fmt::Debug,
{
    fn read_ready(&mut self) -> Result<bool, Self::Error> {
        if self.next.is_none() {
            self.next = self.sampler.hear()?;
        }
        Ok(self.next.is_some())
    }
}

impl<S: SpiBus, D: Direction> Read for SpiUart<'_, S, D>
where
    D::Error: core::fmt::Debug,
{
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Self::Error> {
        if bytes.is_empty() {
            return Ok(0);
        }
        loop {
            if let Some(heard) = self.next.take() {
                return self.take(heard, bytes);
            }
            self.next = self.sampler.hear()?;
        }
    }
}

#[cfg(feature = "async")]
impl<S: SpiBus + AsyncSpiBus, D: Direction> embedded_io_async::Write for SpiUart<'_, S, D>
where
    D::Error: core::fmt::Debug,
{
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.next = None;
        self.sampler.ask_asynch(line_bits(units(bytes), 0)).await?;
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}

#[cfg(feature = "async")]
impl<S: SpiBus + AsyncSpiBus, D: Direction> embedded_io_async::Read for SpiUart<'_, S, D>
where
    D::Error: core::fmt::Debug,
{
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Self::Error> {
        if bytes.is_empty() {
            return Ok(0);
        }
        let heard = match self.next.take() {
            Some(heard) => heard,
            None => self.sampler.hear_asynch().await?,
        };
        self.take(heard, bytes)
    }
}
