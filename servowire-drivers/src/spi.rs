//! An SPI as transmitter and sampler, if no UART is suitable: [`SpiUart`] for T-Format, `SpiFrames` for A-format.
//!
//! Connect MISO to the receiver's output and MOSI to the driver's input, leave SCK open, and set it to 4 to 80 times the bit
//! rate. [`Order`] says where each sample lies in memory. A request is one transfer, in which every bit becomes several
//! equal samples; then the line driver is switched off, and a second transfer, the window, samples the line until the buffer
//! is full. It begins after the request has left the line, so nothing in it can be older than the request.
//!
//! ```text
//!  MOSI  1111 | request | 1111          1111111111111111111111111111111111 ...
//!  DE    ______/‾‾‾‾‾‾‾‾‾‾‾\________________________________________________
//!  MISO                         window: idle | answer                | idle
//! ```
//!
//! * The window has to begin before the answer does: a T-Format encoder answers after 3 us, so use DMA or a HAL that starts a
//!   transfer quickly.
//! * The clock must run through a transfer without gaps. The RP2040's SPI pauses between words with CPHA = 0; use CPHA = 1.
//! * The window has to hold the wait for the answer and the longest answer: at 2.5 Mbit/s and 8 samples per bit, T-Format needs
//!   10 us and 110 bits, 135 bytes; [`Sampling::bytes`] counts them.
//! * Futures need an SPI that supports both blocking and async transfers, as those of embassy do: a request is sent without
//!   yielding (4 to 16 us for T-Format and up to 45 us for A-format at 2.5 Mbit/s), so that no dropped future cuts it off.
//! * While nothing is expected, the line is sampled only for one field or frame at a time, so each call takes that much longer.

#[cfg(feature = "nikon")]
mod frames;
mod uart;

#[cfg(feature = "async")]
use core::{future::poll_fn, task::Poll};
use embedded_hal::spi::SpiBus;
#[cfg(feature = "async")]
use embedded_hal_async::spi::SpiBus as AsyncSpiBus;

use embedded_io::ErrorKind;
use nrz_line::{Field, Format, FormatError, Receiver, Samples};
use servowire_core::ClockError;

use crate::Direction;
use crate::direction::Switch;
use crate::samples::{Order, TooShort, reorder, write};

#[cfg(feature = "nikon")]
pub use frames::SpiFrames;
pub use uart::SpiUart;

/// How an SPI samples the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sampling {
    order: Order,
    format: Format,
    bits_per_second: u32,
}

impl Sampling {
    /// Creates the setting. `per_bit` is the number of SPI clocks per bit, 4 to 80; 8 is a good choice. `content_bits` is 8 for
    /// T-Format, 16 for A-format.
    ///
    /// # Errors
    /// [`FormatError`] for other numbers.
    pub const fn new(order: Order, per_bit: u8, content_bits: u8, bits_per_second: u32) -> Result<Self, FormatError> {
        match Format::new(per_bit as u32, content_bits as u32) {
            Ok(format) => Ok(Self { order, format, bits_per_second }),
            Err(error) => Err(error),
        }
    }

    /// Returns the bytes of memory that hold `ns` nanoseconds of line.
    pub fn bytes(&self, ns: u32) -> usize {
        let samples = u64::from(ns).saturating_mul(self.samples_per_second()).div_ceil(8_000_000_000);
        usize::try_from(samples).unwrap_or(usize::MAX)
    }

    /// Returns when sample `index` was taken, in ns from the first.
    #[cfg(any(test, feature = "nikon"))]
    fn ns(&self, index: u64) -> u64 {
        index.saturating_mul(1_000_000_000).checked_div(self.samples_per_second()).unwrap_or(0)
    }

    const fn samples_per_second(&self) -> u64 {
        (self.bits_per_second as u64).saturating_mul(self.format.samples_per_bit() as u64)
    }

    /// Number of bytes of samples in one field.
    fn look(&self) -> usize {
        let samples = self.format.field_bits().saturating_mul(self.format.samples_per_bit());
        usize::try_from(samples.div_ceil(8)).unwrap_or(usize::MAX)
    }
}

/// The parts from which a [`SpiUart`] was created.
#[derive(Debug, Clone, Copy)]
pub struct Released<S, D> {
    /// The SPI.
    pub bus: S,
    /// The direction, which switches the line driver.
    pub direction: D,
}

/// The parts from which a [`SpiFrames`] was created.
#[cfg(feature = "nikon")]
#[derive(Debug, Clone, Copy)]
pub struct ReleasedFrames<S, D, C> {
    /// The SPI.
    pub bus: S,
    /// The direction, which switches the line driver.
    pub direction: D,
    /// The clock.
    pub clock: C,
}

/// What went wrong at the SPI or in the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SpiError<S, P> {
    /// The SPI reports a fault.
    #[error("the SPI reports a fault")]
    Spi(S),
    /// The direction pin reports a fault.
    #[error("the direction pin reports a fault")]
    Pin(P),
    /// A stop bit was 0.
    #[error("a stop bit is 0")]
    Framing,
    /// There was activity on the line outside the window.
    #[error("something is on the line outside the window")]
    Noise,
    /// The clock has stopped or was set back.
    #[error(transparent)]
    Clock(#[from] ClockError),
    /// The request does not fit the buffer.
    #[error(transparent)]
    TooShort(#[from] TooShort),
}

impl<S: core::fmt::Debug, P: core::fmt::Debug> embedded_io::Error for SpiError<S, P> {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Framing | Self::Noise => ErrorKind::InvalidData,
            Self::TooShort(_) => ErrorKind::OutOfMemory,
            Self::Spi(_) | Self::Pin(_) | Self::Clock(_) => ErrorKind::Other,
        }
    }
}

/// The result of a look at the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Heard {
    Field(Field),
    /// There were samples of 0 outside the window.
    Noise,
}

/// The common core of both: the buffers, and the samples of the last transfer.
#[derive(Debug)]
struct Sampler<'b, S, D> {
    bus: S,
    direction: Switch<D>,
    sampling: Sampling,
    tx: &'b mut [u8],
    rx: &'b mut [u8],
    receiver: Receiver,
    /// Number of bytes of `rx` that were sampled, and how many of them the receiver has taken.
    len: usize,
    at: usize,
    /// The remaining samples of the byte before `at`.
    samples: Samples,
}

type Fault<S, D> = SpiError<<S as embedded_hal::spi::ErrorType>::Error, <D as Direction>::Error>;

impl<'b, S, D> Sampler<'b, S, D> {
    const fn new(bus: S, direction: D, sampling: Sampling, tx: &'b mut [u8], rx: &'b mut [u8]) -> Self {
        let receiver = Receiver::new(sampling.format);
        Self {
            bus,
            direction: Switch::new(direction),
            sampling,
            tx,
            rx,
            receiver,
            len: 0,
            at: 0,
            samples: Samples::partial(0, 0),
        }
    }

    fn release(self) -> Released<S, D> {
        Released { bus: self.bus, direction: self.direction.release() }
    }

    /// Returns the next field of the samples.
    fn field(&mut self) -> Option<Field> {
        loop {
            if let Some(field) = self.receiver.feed(&mut self.samples) {
                return Some(field);
            }
            let byte = self.rx.get(..self.len)?.get(self.at)?;
            self.samples = Samples::partial(u64::from(*byte), 8);
            self.at = self.at.saturating_add(1);
        }
    }

    /// Writes the request as samples; returns the number of bytes of `tx`.
    fn prepare(&mut self, bits: impl IntoIterator<Item = bool>) -> Result<usize, TooShort> {
        self.forget();
        let per_bit = u8::try_from(self.sampling.format.samples_per_bit()).unwrap_or(u8::MAX);
        write(bits, per_bit, self.sampling.order, self.tx)
    }

    /// Returns `len` bytes to sample into, preset so that MOSI stays 1 meanwhile.
    fn idle(&mut self, len: usize) -> &mut [u8] {
        self.forget();
        let len = len.min(self.rx.len());
        let (window, _) = self.rx.split_at_mut_checked(len).unwrap_or_default();
        window.fill(0xff);
        window
    }

    /// Notes that these bytes have been sampled.
    fn sampled(&mut self, len: usize) {
        self.len = len.min(self.rx.len());
        if let Some(window) = self.rx.get_mut(..self.len) {
            reorder(window, self.sampling.order);
        }
    }

    /// Discards what was sampled before.
    fn forget(&mut self) {
        self.receiver = Receiver::new(self.sampling.format);
        self.samples = Samples::partial(0, 0);
        (self.len, self.at) = (0, 0);
    }

    /// Returns whether any sample was 0.
    fn is_busy(&self) -> bool {
        self.rx.get(..self.len).is_some_and(|window| window.iter().any(|byte| *byte != 0xff))
    }
}

impl<S: SpiBus, D: Direction> Sampler<'_, S, D> {
    /// Sends `bits`. The line driver is off afterwards.
    fn send(&mut self, bits: impl IntoIterator<Item = bool>) -> Result<(), Fault<S, D>> {
        let len = self.prepare(bits)?;
        let guard = self.direction.transmit().map_err(SpiError::Pin)?;
        self.bus.write(self.tx.get(..len).unwrap_or_default()).map_err(SpiError::Spi)?;
        self.bus.flush().map_err(SpiError::Spi)?;
        guard.receive().map_err(SpiError::Pin)
    }

    /// Samples `len` bytes.
    fn sample(&mut self, len: usize) -> Result<(), Fault<S, D>> {
        self.direction.off().map_err(SpiError::Pin)?;
        self.idle(len);
        let len = len.min(self.rx.len());
        let window = self.rx.get_mut(..len).unwrap_or_default();
        self.bus.transfer_in_place(window).map_err(SpiError::Spi)?;
        self.bus.flush().map_err(SpiError::Spi)?;
        self.sampled(len);
        Ok(())
    }

    /// Sends a request and samples the window.
    fn ask(&mut self, bits: impl IntoIterator<Item = bool>) -> Result<(), Fault<S, D>> {
        self.send(bits)?;
        self.sample(usize::MAX)
    }

    /// Returns what has been received; if nothing has, looks at the line.
    fn hear(&mut self) -> Result<Option<Heard>, Fault<S, D>> {
        if let Some(field) = self.field() {
            return Ok(Some(Heard::Field(field)));
        }
        self.sample(self.sampling.look())?;
        Ok(self.is_busy().then_some(Heard::Noise))
    }
}

/// A request is sent in blocking mode, in 4 to 20 us, because a dropped transfer is cut off, and ID 0 without its end is
/// ID 8. Only the window yields to the executor.
#[cfg(feature = "async")]
impl<S: SpiBus + AsyncSpiBus, D: Direction> Sampler<'_, S, D> {
    /// Samples `len` bytes.
    async fn sample_asynch(&mut self, len: usize) -> Result<(), Fault<S, D>> {
        self.direction.off().map_err(SpiError::Pin)?;
        self.idle(len);
        let len = len.min(self.rx.len());
        let window = self.rx.get_mut(..len).unwrap_or_default();
        AsyncSpiBus::transfer_in_place(&mut self.bus, window).await.map_err(SpiError::Spi)?;
        AsyncSpiBus::flush(&mut self.bus).await.map_err(SpiError::Spi)?;
        self.sampled(len);
        Ok(())
    }

    /// Sends a request and samples the window.
    async fn ask_asynch(&mut self, bits: impl IntoIterator<Item = bool>) -> Result<(), Fault<S, D>> {
        self.send(bits)?;
        self.sample_asynch(usize::MAX).await
    }

    /// Returns what has been received, or waits for it.
    async fn hear_asynch(&mut self) -> Result<Heard, Fault<S, D>> {
        loop {
            if let Some(field) = self.field() {
                return Ok(Heard::Field(field));
            }
            self.sample_asynch(self.sampling.look()).await?;
            if self.is_busy() {
                return Ok(Heard::Noise);
            }
            // An SPI that never waits must not keep the clock from being asked.
            let mut asked = false;
            poll_fn(|context| {
                if core::mem::replace(&mut asked, true) {
                    return Poll::Ready(());
                }
                context.waker().wake_by_ref();
                Poll::Pending
            })
            .await;
        }
    }
}

/// Returns start bit, content and stop bit of each unit, with idle bits between units.
fn line_bits(units: impl IntoIterator<Item = (u16, u32)>, gap_bits: u32) -> impl Iterator<Item = bool> {
    units.into_iter().enumerate().flat_map(move |(at, (content, width))| {
        let idle = if at == 0 { 0 } else { gap_bits };
        let bits = (0..width).map(move |bit| content.checked_shr(bit).unwrap_or(0) & 1 == 1);
        let idle = core::iter::repeat_n(true, usize::try_from(idle).unwrap_or(0));
        idle.chain(core::iter::once(false)).chain(bits).chain(core::iter::once(true))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn a_buffer_for_the_wait_and_the_longest_answer() {
        let sampling = Sampling::new(Order::MsbFirst8, 8, 8, 2_500_000).unwrap();
        assert_eq!(sampling.bytes(10_000 + 44_000), 135);
        assert_eq!(sampling.look(), 10);
        assert_eq!(sampling.ns(8), 400);
        assert_eq!(sampling.bytes(u32::MAX), 10_737_419);
        assert!(Sampling::new(Order::MsbFirst8, 3, 8, 1).is_err());
    }

    /// What one window leaves does not shift the times of the next one.
    #[test]
    fn a_window_begins_with_its_first_sample() {
        let sampling = Sampling::new(Order::LsbFirst8, 8, 8, 2_500_000).unwrap();
        let (mut tx, mut rx) = ([0; 48], [0; 48]);
        let mut sampler = Sampler::new((), crate::Automatic, sampling, &mut tx, &mut rx);
        for skipped in 0..8 {
            // So many ones, and a field.
            sampler.idle(48);
            let bits = core::iter::repeat_n(true, skipped).chain(line_bits([(0x1a, 8)], 0));
            let len = write(bits, 8, Order::LsbFirst8, sampler.rx).unwrap();
            sampler.sampled(len);
            let field = sampler.field().unwrap();
            assert_eq!((field.content, field.start), (0x1a, 8 + 8 * skipped as u64));
        }
        // Nor is anything of it left when the next request goes out, should that fail.
        sampler.sampled(48);
        assert!(sampler.prepare([true]).is_ok());
        assert_eq!((sampler.field(), sampler.is_busy()), (None, false));
    }

    #[test]
    fn units_have_start_and_stop_bits_and_pauses() {
        let bits: Vec<_> = line_bits([(0b01, 2), (0b11, 2)], 3).map(u8::from).collect();
        assert_eq!(bits, [0, 1, 0, 1, 1, 1, 1, 0, 1, 1, 1]);
    }
}
