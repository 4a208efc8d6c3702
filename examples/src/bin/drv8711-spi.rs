//! A driver for the DRV8711 over `embedded_hal::spi::SpiDevice`, and a simulated chip to try it on.
//!
//! The crate has the registers, the words and the order of things; what is left to the driver is to move two bytes.
//! Mind the chip select of this chip: it is active **high**, and a write takes effect when it falls.
//!
//! `cargo run -p servowire-examples --bin drv8711-spi`

use core::fmt;

use embedded_hal::spi::{self, ErrorKind, ErrorType, Operation, SpiDevice};
use sorte_proto::drv8711::{
    Apply, Configuration, Ctrl, DecayMode, IsGain, Register, Status, StepMode, Torque, Word, full_scale_microamps,
    torque_for_microamps,
};

/// Why the driver gave up.
#[derive(Debug)]
enum Error<E> {
    /// The bus failed.
    Spi(E),
    /// A register does not hold what was written.
    Chip(sorte_proto::Error),
    /// Even OFF does not read back: no supply, or nobody on the bus.
    Dead,
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Spi(error) => write!(f, "SPI: {error:?}"),
            Self::Chip(error) => error.fmt(f),
            Self::Dead => f.write_str("no DRV8711 on the bus, or no supply"),
        }
    }
}

struct Drv8711<S> {
    spi: S,
    /// What was written: bit 10 of TORQUE cannot be read back.
    written: Configuration,
}

impl<S: SpiDevice> Drv8711<S> {
    fn new(spi: S) -> Self {
        Self { spi, written: Configuration::default() }
    }

    fn transfer(&mut self, word: Word) -> Result<[u8; 2], Error<S::Error>> {
        let mut bytes = word.to_bytes();
        self.spi.transfer_in_place(&mut bytes).map_err(Error::Spi)?;
        Ok(bytes)
    }

    /// Writes and verifies everything, CTRL with its enable bit last. Wait 1 ms after waking the chip.
    fn apply(&mut self, configuration: Configuration) -> Result<(), Error<S::Error>> {
        let mut apply = Apply::new(configuration);
        while let Some(word) = apply.transmission() {
            let answer = self.transfer(word)?;
            apply.hear(answer).map_err(Error::Chip)?;
        }
        self.written = configuration;
        Ok(())
    }

    /// Switches the motor current off; everything else stays.
    fn disable(&mut self) -> Result<(), Error<S::Error>> {
        self.written.ctrl = Ctrl { enable: false, ..self.written.ctrl };
        self.transfer(Register::Ctrl.write(self.written.value(Register::Ctrl))).map(|_| ())
    }

    /// The faults. All bits set may also mean that the chip is dead, so OFF is read then, which never is all ones here.
    fn status(&mut self) -> Result<Status, Error<S::Error>> {
        let [_, byte] = self.transfer(Register::Status.read())?;
        let status = Status::from_bits_retain(byte);
        if status.looks_unpowered() {
            let off = Word::answer(self.transfer(Register::Off.read())?);
            Register::Off.verify(self.written.value(Register::Off), off).map_err(|_| Error::Dead)?;
        }
        Ok(status)
    }

    /// Clears exactly the faults that were read.
    fn clear(&mut self, status: Status) -> Result<(), Error<S::Error>> {
        self.transfer(Register::Status.write(status.clear_these())).map(|_| ())
    }
}

/// A chip on a bus of its own.
struct Chip {
    registers: [u16; 8],
    powered: bool,
}

impl ErrorType for Chip {
    type Error = ErrorKind;
}

impl SpiDevice for Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let [Operation::TransferInPlace(bytes)] = operations else { return Err(spi::ErrorKind::Other) };
        let word = u16::from_be_bytes(bytes.first_chunk().copied().ok_or(ErrorKind::Other)?);
        let register = Register::from_code(word.to_be_bytes()[0] >> 4 & 7).ok_or(ErrorKind::Other)?;
        let held = self.registers.get_mut(usize::from(register.code())).ok_or(ErrorKind::Other)?;
        let answer = if !self.powered {
            0xffff
        } else if word & 0x8000 != 0 {
            *held & register.read_back_mask()
        } else if register == Register::Status {
            // Writing 0 clears.
            *held &= word;
            0
        } else {
            *held = word & 0xfff;
            0
        };
        bytes.copy_from_slice(&answer.to_be_bytes());
        Ok(())
    }
}

fn main() -> Result<(), Error<ErrorKind>> {
    // 1.5 A at full scale over 50 mOhm, 256 micro-steps.
    let (gain, sense) = (IsGain::X20, 50);
    let torque = torque_for_microamps(1_500_000, gain, sense).unwrap_or(0);
    let mut setup = Configuration::default();
    setup.ctrl = Ctrl { enable: true, mode: StepMode::Div256, gain, ..setup.ctrl };
    setup.torque = Torque { torque, ..setup.torque };
    setup.decay.mode = DecayMode::AutoMixed;
    let real = full_scale_microamps(torque, gain, sense).unwrap_or(0);
    println!("TORQUE {torque} gives {}.{:03} A", real / 1_000_000, real / 1000 % 1000);

    let chip = Chip { registers: Register::ALL.map(Register::reset_value), powered: true };
    let mut driver = Drv8711::new(chip);
    driver.apply(setup)?;
    println!("written and verified, CTRL {:#05x}", driver.spi.registers[0]);

    driver.spi.registers[7] = 0x12; // over-current in bridge A, predriver fault in bridge B
    let status = driver.status()?;
    println!("status: {status}");
    driver.clear(status)?;
    println!("cleared: {:?}", driver.status()?.is_fault());
    driver.disable()?;

    driver.spi.powered = false;
    match driver.status() {
        Err(error) => println!("without supply: {error}"),
        Ok(status) => println!("without supply: {status}?"),
    }
    Ok(())
}
