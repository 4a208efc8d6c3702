use rtex_block::master::{Asic, Slave};
pub use rtex_block::pack::Word;

/// The communication ASIC as the driver needs it.
///
/// The memory must not be cached, and a write has to be in the ASIC when its call returns: empty the write buffer. Volatile
/// access belongs in the firmware. A bus whose addresses count 16-bit units needs half of the vendor's addresses.
pub trait Port {
    /// A word of the bus.
    type Word: Word;
    /// Why it cannot; `Infallible` for memory, the error of the SPI for a bridge.
    type Error;

    /// The state of the ASIC.
    ///
    /// # Errors
    /// Those of the port.
    fn state(&mut self) -> Result<Asic, Self::Error>;

    /// The slaves that the ring configuration has found, in the order of the ring: how many were written to `found`, or `None` if they
    /// are not known yet. It is asked for in READY.
    ///
    /// # Errors
    /// Those of the port.
    fn slaves(&mut self, found: &mut [Slave]) -> Result<Option<usize>, Self::Error>;

    /// Reads the block of the drive at `place` of the ring from the reception bank that the host sees.
    ///
    /// # Errors
    /// Those of the port.
    fn read(&mut self, place: usize, words: &mut [Self::Word]) -> Result<(), Self::Error>;

    /// Writes the block of the drive at `place` of the ring into the transmission bank that the host sees.
    ///
    /// # Errors
    /// Those of the port.
    fn write(&mut self, place: usize, words: &[Self::Word]) -> Result<(), Self::Error>;
}
