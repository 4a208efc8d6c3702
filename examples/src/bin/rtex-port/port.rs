//! The port of the driver over a memory window of 16-bit words.

use core::convert::Infallible;

use rtex_block::master::{Asic, Slave};
use servowire_drivers::rtex::Port;

use crate::{AXES, map};

/// Words of a block.
const WORDS: usize = rtex_block::LEN / 2;

/// The memory of the ASIC as the chip sees it. Each call is one access of the bus, which the compiler must neither drop nor reorder:
/// `read_volatile`, `write_volatile`, and a barrier where the chip has a write buffer.
pub(crate) trait Window {
    fn read(&mut self, address: usize) -> u16;
    fn write(&mut self, address: usize, word: u16);
}

/// The ASIC behind a window.
pub(crate) struct Mnm1221<W> {
    window: W,
}

impl<W> Mnm1221<W> {
    pub(crate) const fn new(window: W) -> Self {
        Self { window }
    }
}

impl<W: Window> Port for Mnm1221<W> {
    type Word = u16;
    /// Memory does not fail; a bridge over SPI would.
    type Error = Infallible;

    fn state(&mut self) -> Result<Asic, Infallible> {
        Ok(map::state(self.window.read(map::STATE)))
    }

    fn slaves(&mut self, found: &mut [Slave]) -> Result<Option<usize>, Infallible> {
        let count = usize::from(self.window.read(map::SLAVES));
        for (slave, address) in found.iter_mut().take(count).zip((map::SLAVES + 2..).step_by(2)) {
            *slave = map::slave(self.window.read(address));
        }
        Ok((count > 0).then_some(count))
    }

    fn read(&mut self, place: usize, words: &mut [u16]) -> Result<(), Infallible> {
        for (word, address) in words.iter_mut().zip((map::RX + place * 2 * WORDS..).step_by(2)) {
            *word = self.window.read(address);
        }
        Ok(())
    }

    fn write(&mut self, place: usize, words: &[u16]) -> Result<(), Infallible> {
        self.window.write(map::TX_BUSY, 1);
        for (word, address) in words.iter().zip((map::TX + place * 2 * WORDS..).step_by(2)) {
            self.window.write(address, *word);
        }
        // The commands of all drives go out in one frame.
        self.window.write(map::TX_BUSY, u16::from(place + 1 < AXES));
        Ok(())
    }
}
