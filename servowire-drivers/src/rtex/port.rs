use rtex_block::master::{Asic, Slave};
use rtex_block::pack;

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

mod sealed {
    pub trait Sealed {}
    impl Sealed for u8 {}
    impl Sealed for u16 {}
    impl Sealed for u32 {}
}

/// A word of the ASIC's bus: `u8`, `u16` or `u32`. The byte that goes out first is in its lowest bits, on every host.
pub trait Word: Copy + Default + sealed::Sealed {
    /// Bytes of a word.
    const BYTES: usize;
    /// Words to bytes; nothing happens unless the sizes agree.
    #[doc(hidden)]
    fn unpack(words: &[Self], bytes: &mut [u8]);
    /// Bytes to words; nothing happens unless the sizes agree.
    #[doc(hidden)]
    fn pack(bytes: &[u8], words: &mut [Self]);
}

impl Word for u8 {
    const BYTES: usize = 1;

    fn unpack(words: &[Self], bytes: &mut [u8]) {
        for (byte, word) in bytes.iter_mut().zip(words) {
            *byte = *word;
        }
    }

    fn pack(bytes: &[u8], words: &mut [Self]) {
        Self::unpack(bytes, words);
    }
}

impl Word for u16 {
    const BYTES: usize = 2;

    fn unpack(words: &[Self], bytes: &mut [u8]) {
        pack::from_words16(words, bytes).unwrap_or(());
    }

    fn pack(bytes: &[u8], words: &mut [Self]) {
        pack::to_words16(bytes, words).unwrap_or(());
    }
}

impl Word for u32 {
    const BYTES: usize = 4;

    fn unpack(words: &[Self], bytes: &mut [u8]) {
        pack::from_words32(words, bytes).unwrap_or(());
    }

    fn pack(bytes: &[u8], words: &mut [Self]) {
        pack::to_words32(bytes, words).unwrap_or(());
    }
}
