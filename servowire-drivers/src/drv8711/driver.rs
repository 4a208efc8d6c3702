//! A DRV8711 behind an SPI.

use core::convert::Infallible;

use embedded_hal::spi::SpiDevice;
use sorte_proto::drv8711::Status;

use super::apply::Apply;
use super::error::Error;
use super::registers::{Configuration, Ctrl};
use super::word::{Register, Word};

/// Why a call failed: [`Io`](crate::Error::Io) is a fault of the bus, [`Protocol`](crate::Error::Protocol) a fault in the chip's
/// answer.
pub type Failure<E> = crate::Error<E, Infallible, Error, Infallible>;

/// A DRV8711 behind an `embedded_hal` SPI. Its chip select is active **high**, and a write takes effect when it falls.
///
/// ```
/// use embedded_hal::spi::SpiDevice;
/// use servowire_drivers::drv8711::{Configuration, Driver, Failure, StepMode};
///
/// /// 1 ms after waking the chip ([`WAKE_NS`](super::WAKE_NS)).
/// fn start<S: SpiDevice>(spi: S) -> Result<Driver<S>, Failure<S::Error>> {
///     let mut setup = Configuration::default();
///     setup.ctrl.enable = true;
///     setup.ctrl.mode = StepMode::Div256;
///     let mut motor = Driver::new(spi);
///     motor.apply(setup)?;
///     let faults = motor.status()?;
///     motor.clear(faults)?;
///     Ok(motor)
/// }
/// ```
#[derive(Debug)]
pub struct Driver<S> {
    spi: S,
    /// What was written, because bit 10 of TORQUE cannot be read back.
    written: Configuration,
}

impl<S: SpiDevice> Driver<S> {
    /// Creates a driver for a chip in its state after power-up; sends nothing.
    pub fn new(spi: S) -> Self {
        Self { spi, written: Configuration::default() }
    }

    /// Returns the bus; the chip stays as it is.
    pub fn release(self) -> S {
        self.spi
    }

    fn transfer(&mut self, word: Word) -> Result<[u8; 2], Failure<S::Error>> {
        let mut bytes = word.to_bytes();
        self.spi.transfer_in_place(&mut bytes).map_err(Failure::Io)?;
        Ok(bytes)
    }

    /// Writes all registers and reads them back, CTRL with ENBL last: the motor is driven only if all others read back correctly.
    ///
    /// # Errors
    /// [`Failure::Io`], or [`Failure::Protocol`] with [`Error::ReadBack`].
    pub fn apply(&mut self, configuration: Configuration) -> Result<(), Failure<S::Error>> {
        let mut apply = Apply::new(configuration);
        while let Some(word) = apply.transmission() {
            let miso = self.transfer(word)?;
            apply.hear(miso).map_err(Failure::Protocol)?;
        }
        self.written = configuration;
        Ok(())
    }

    /// Switches the motor current off and keeps all other settings. Sends one word, which is not read back.
    ///
    /// # Errors
    /// [`Failure::Io`]
    pub fn disable(&mut self) -> Result<(), Failure<S::Error>> {
        self.written.ctrl = Ctrl { enable: false, ..self.written.ctrl };
        self.transfer(Register::Ctrl.write(self.written.value(Register::Ctrl))).map(|_| ())
    }

    /// The faults. All bits set may also mean that the chip is dead, so in that case OFF is read too.
    ///
    /// # Errors
    /// [`Failure::Io`], or [`Failure::Protocol`] with [`Error::NoChip`].
    pub fn status(&mut self) -> Result<Status, Failure<S::Error>> {
        let status = Status::of_register(Word::answer(self.transfer(Register::Status.read())?));
        if status.looks_unpowered() {
            let off = Word::answer(self.transfer(Register::Off.read())?);
            let want = self.written.value(Register::Off);
            Register::Off.verify(want, off).map_err(|_| Failure::Protocol(Error::NoChip))?;
        }
        Ok(status)
    }

    /// Clears exactly these faults.
    ///
    /// # Errors
    /// [`Failure::Io`]
    pub fn clear(&mut self, status: Status) -> Result<(), Failure<S::Error>> {
        self.transfer(Register::Status.write(status.clear_these())).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use embedded_hal::spi::{ErrorKind, ErrorType, Operation};

    use super::*;

    /// A chip on a bus of its own; after `words` words the bus fails.
    struct Chip {
        registers: [u16; 8],
        powered: bool,
        words: u32,
    }

    impl Chip {
        /// The values of the data sheet after power-up.
        fn new() -> Self {
            let registers = [0xc10, 0x1ff, 0x030, 0x080, 0x110, 0x040, 0xa59, 0x000];
            Self { registers, powered: true, words: u32::MAX }
        }
    }

    impl ErrorType for Chip {
        type Error = ErrorKind;
    }

    impl SpiDevice for Chip {
        fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
            let [Operation::TransferInPlace(bytes)] = operations else { return Err(ErrorKind::Other) };
            self.words = self.words.checked_sub(1).ok_or(ErrorKind::Overrun)?;
            let word = u16::from_be_bytes([bytes[0], bytes[1]]);
            let address = usize::from(word >> 12 & 7);
            let register = &mut self.registers[address];
            // Writing 0 to a bit of STATUS clears it; bit 10 of TORQUE reads 0.
            match (word & 0x8000, address) {
                (0, 7) => *register &= word,
                (0, _) => *register = word & 0xfff,
                _ => {}
            }
            let answer = if address == 1 { *register & 0xbff } else { *register };
            bytes.copy_from_slice(&if self.powered { answer } else { 0xffff }.to_be_bytes());
            Ok(())
        }
    }

    #[test]
    fn a_chip_is_set_up_read_cleared_and_switched_off() {
        let mut motor = Driver::new(Chip::new());
        let mut setup = Configuration::default();
        setup.ctrl.enable = true;
        motor.apply(setup).unwrap();
        assert_eq!(motor.spi.registers[0], 0xc11);
        motor.spi.registers[7] = 0x42;
        let status = motor.status().unwrap();
        assert_eq!(status, Status::AOCP | Status::STD);
        motor.spi.registers[7] = 0x46;
        motor.clear(status).unwrap();
        assert_eq!(motor.spi.registers[7], 0x04, "a fault that came later stays");
        motor.disable().unwrap();
        assert_eq!(motor.release().registers[0], 0xc10);
    }

    #[test]
    fn a_dead_chip_is_told_from_one_with_all_faults() {
        let mut motor = Driver::new(Chip::new());
        motor.spi.registers[7] = 0xff;
        assert_eq!(motor.status(), Ok(Status::all()));
        motor.spi.powered = false;
        assert_eq!(motor.status(), Err(Failure::Protocol(Error::NoChip)));
        let refused = Error::ReadBack { register: 1, got: 0xbff, want: 0x1ff };
        assert_eq!(motor.apply(Configuration::default()), Err(Failure::Protocol(refused)));
    }

    /// The bus fails at every word: the motor is not driven, and can be later.
    #[test]
    fn a_bus_that_fails_leaves_the_motor_off() {
        for words in 0..14 {
            let mut motor = Driver::new(Chip { words, ..Chip::new() });
            let mut setup = Configuration::default();
            setup.ctrl.enable = true;
            assert_eq!(motor.apply(setup), Err(Failure::Io(ErrorKind::Overrun)));
            // The word before the last is the one that writes CTRL.
            assert_eq!(motor.spi.registers[0] & 1, u16::from(words == 13), "{words}");
            motor.spi.words = 15;
            motor.apply(setup).unwrap();
            motor.disable().unwrap();
            assert_eq!(motor.spi.registers[0] & 1, 0);
        }
    }
}
