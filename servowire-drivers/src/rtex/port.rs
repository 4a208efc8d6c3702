use rtex_block::master::{Asic, Slave};
pub use rtex_block::pack::Word;

/// The communication ASIC as the driver uses it.
///
/// The memory must not be cached, and a write has to have reached the ASIC when its call returns, so drain the write buffer.
/// Volatile access belongs in the firmware. A bus whose addresses count 16-bit units needs half of the vendor's addresses.
pub trait Port {
    /// The word type of the bus.
    type Word: Word;
    /// Why an access failed; `Infallible` for memory, the error of the SPI for a bridge.
    type Error;

    /// Returns the state of the ASIC.
    ///
    /// # Errors
    /// The errors of the port.
    fn state(&mut self) -> Result<Asic, Self::Error>;

    /// Writes the slaves that the ring configuration has found to `found`, in the order of the ring, and returns their number,
    /// or `None` if they are not known yet. The driver calls this in READY.
    ///
    /// # Errors
    /// The errors of the port.
    fn slaves(&mut self, found: &mut [Slave]) -> Result<Option<usize>, Self::Error>;

    /// Reads the block of the drive at `place` in the ring from the reception bank that the host sees.
    ///
    /// # Errors
    /// The errors of the port.
    fn read(&mut self, place: usize, words: &mut [Self::Word]) -> Result<(), Self::Error>;

    /// Writes the block of the drive at `place` in the ring into the transmission bank that the host sees.
    ///
    /// # Errors
    /// The errors of the port.
    fn write(&mut self, place: usize, words: &[Self::Word]) -> Result<(), Self::Error>;
}
