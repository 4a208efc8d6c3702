use rtex_block::master::{Asic, Slave};
pub use rtex_block::pack::Word;

/// The communication ASIC as the driver uses it.
///
/// The memory must not be cached, and a write has to have reached the ASIC when its call returns, so drain the write buffer.
/// Volatile access belongs in the firmware. A bus whose addresses count 16-bit units needs half of the vendor's addresses.
///
/// A block that could not be read or written is tried once more at once, so a port need not repeat an access. Every access has to
/// return in a bounded time, because the exchange waits for it and goes on to the other places whatever fails. After a failure
/// the next access has to work as if nothing had been: a bridge that was interrupted in the middle of a transfer begins a new one.
pub trait Port {
    /// The word type of the bus.
    type Word: Word;
    /// Why an access failed; `Infallible` for memory, the error of the SPI for a bridge.
    type Error;

    /// Returns the state of the ASIC.
    ///
    /// # Errors
    /// The errors of the port; the phase stays as it is, and the state is asked for again in the next turn of the main loop.
    fn state(&mut self) -> Result<Asic, Self::Error>;

    /// Writes the slaves that the ring configuration has found to `found`, in the order of the ring, and returns their number,
    /// or `None` if they are not known yet. The driver calls this in READY.
    ///
    /// # Errors
    /// The errors of the port; what was written to `found` is not used, and the slaves are asked for again.
    fn slaves(&mut self, found: &mut [Slave]) -> Result<Option<usize>, Self::Error>;

    /// Reads the block of the drive at `place` in the ring from the reception bank that the host sees.
    ///
    /// # Errors
    /// The errors of the port; what was written to `words` is not used. A block of which one word could not be read is a failure: there
    /// is no check sum that would show it.
    fn read(&mut self, place: usize, words: &mut [Self::Word]) -> Result<(), Self::Error>;

    /// Writes the block of the drive at `place` in the ring into the transmission bank that the host sees.
    ///
    /// # Errors
    /// The errors of the port. A call that fails has to leave the block that was there, whole, or the ring may send half of a command: a
    /// block has no check sum, so the drive would carry it out. A port that can fail between two words (a bridge) collects the
    /// block on its far side and hands it over in one step. The driver takes a failure to mean that the drive gets the old
    /// block again ([`Axis::not_sent`](rtex_block::master::Axis::not_sent)); if the new block was handed over all the same, the next step
    /// of the position is too large or too small by the one that was not counted.
    fn write(&mut self, place: usize, words: &[Self::Word]) -> Result<(), Self::Error>;
}
