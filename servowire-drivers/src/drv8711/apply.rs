//! Writes a configuration and verifies it.

use super::error::Error;
use super::registers::Configuration;
use super::word::{Register, Word};

/// The order is TORQUE, OFF, BLANK, DECAY, DRIVE, STALL, and CTRL last because it holds ENBL.
const ORDER: [Register; 7] = [
    Register::Torque,
    Register::Off,
    Register::Blank,
    Register::Decay,
    Register::Drive,
    Register::Stall,
    Register::Ctrl,
];

/// Writes each register and reads it back before the next one. CTRL, which switches the motor on, is written only if all others
/// read back correctly.
///
/// ```
/// use servowire_drivers::drv8711::{Apply, Configuration};
/// let mut chip = [0u16; 8]; // stands for the SPI
/// let mut apply = Apply::new(Configuration::default());
/// while let Some(word) = apply.transmission() {
///     let register = usize::from(word.bits() >> 12 & 7);
///     if word.bits() & 0x8000 == 0 {
///         chip[register] = word.bits() & 0xfff;
///     }
///     apply.hear(chip[register].to_be_bytes())?;
/// }
/// assert_eq!(chip[0], 0xc10);
/// # Ok::<(), servowire_drivers::drv8711::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Apply {
    configuration: Configuration,
    /// Number of registers that have been written and checked.
    done: u8,
    /// Whether the current register has been written.
    written: bool,
}

impl Apply {
    /// Writes these registers. RSTEP is written unchanged, so it should be clear: it clears itself and would not read back.
    pub const fn new(configuration: Configuration) -> Self {
        Self { configuration, done: 0, written: false }
    }

    fn register(&self) -> Option<Register> {
        ORDER.get(usize::from(self.done)).copied()
    }

    /// Returns the word to send; pass the two bytes that come back to [`hear`](Self::hear). `None` when everything is written
    /// and reads back.
    pub fn transmission(&self) -> Option<Word> {
        let register = self.register()?;
        Some(if self.written { register.read() } else { register.write(self.configuration.value(register)) })
    }

    /// Takes the two bytes that came back while the word was sent.
    ///
    /// # Errors
    /// [`Error::ReadBack`]; the same register is then written again.
    pub fn hear(&mut self, miso: [u8; 2]) -> Result<(), Error> {
        let Some(register) = self.register() else { return Ok(()) };
        if !self.written {
            self.written = true;
            return Ok(());
        }
        self.written = false;
        register.verify(self.configuration.value(register), Word::answer(miso))?;
        self.done = self.done.saturating_add(1);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;
    use crate::drv8711::codes::SampleThreshold;
    use crate::drv8711::registers::{Blank, Ctrl, Decay, Drive, Off, Stall, Torque};

    /// A chip that loses writes to one register.
    fn run(configuration: Configuration, dead: Option<Register>) -> (Result<(), Error>, Vec<u16>) {
        let mut chip = Register::ALL.map(Register::reset_value);
        let (mut apply, mut written) = (Apply::new(configuration), Vec::new());
        while let Some(word) = apply.transmission() {
            let register = Register::from_code((word.bits() >> 12 & 7) as u8).unwrap();
            let place = &mut chip[usize::from(register.code())];
            if word.bits() & 0x8000 == 0 {
                written.push(word.bits());
                if dead != Some(register) {
                    *place = word.bits() & 0xfff;
                }
            }
            // The upper nibble is undefined.
            let answer = 0xa000 | *place & register.read_back_mask();
            if let Err(error) = apply.hear(answer.to_be_bytes()) {
                return (Err(error), written);
            }
        }
        (Ok(()), written)
    }

    fn other_everywhere() -> Configuration {
        let read = |register: Register| register.reset_value() ^ 1;
        Configuration {
            ctrl: Ctrl::parse(read(Register::Ctrl)).unwrap(),
            torque: Torque { torque: 1, sample_threshold: SampleThreshold::Us400 },
            off: Off::parse(read(Register::Off)).unwrap(),
            blank: Blank::parse(read(Register::Blank)).unwrap(),
            decay: Decay::parse(read(Register::Decay)).unwrap(),
            stall: Stall::parse(read(Register::Stall)).unwrap(),
            drive: Drive::parse(read(Register::Drive)).unwrap(),
        }
    }

    #[test]
    fn ctrl_is_written_last() {
        let (result, written) = run(other_everywhere(), None);
        assert_eq!(result, Ok(()));
        let addresses: Vec<_> = written.iter().map(|word| word >> 12).collect();
        assert_eq!(addresses, [1, 2, 3, 4, 6, 5, 0]);
    }

    #[test]
    fn a_register_that_does_not_take_its_value_stops_before_the_motor_is_on() {
        for dead in
            [Register::Torque, Register::Off, Register::Blank, Register::Decay, Register::Stall, Register::Drive]
        {
            let (result, written) = run(other_everywhere(), Some(dead));
            assert!(matches!(result, Err(Error::ReadBack { register, .. }) if register == dead.code()));
            assert!(written.iter().all(|word| word >> 12 != 0));
        }
    }

    /// After a read-back that differs, the same register is written again, not only read.
    #[test]
    fn a_register_that_did_not_take_its_value_is_written_again() {
        let mut apply = Apply::new(other_everywhere());
        for _ in 0..3 {
            let Some(word) = apply.transmission() else { panic!("done") };
            // TORQUE 1, SMPLTH code 4.
            assert_eq!(word.bits(), 0x1401);
            assert_eq!(apply.hear([0, 0]), Ok(()));
            let Some(word) = apply.transmission() else { panic!("done") };
            assert_eq!(word.bits(), 0x9000);
            assert!(apply.hear([0, 0]).is_err());
        }
        assert_eq!(apply.transmission(), Some(Register::Torque.write(0x401)));
        apply.hear([0, 0]).unwrap();
        assert_eq!(apply.hear([0xf0, 0x01]), Ok(()), "bit 10 reads 0");
        assert_eq!(apply.transmission(), Some(Register::Off.write(0x031)));
    }
}
