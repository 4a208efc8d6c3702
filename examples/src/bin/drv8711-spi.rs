//! A DRV8711 is set up over `embedded_hal::spi::SpiDevice`, here with a simulated chip behind it.
//!
//! `cargo run -p servowire-examples --bin drv8711-spi`

use core::cell::Cell;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use servowire_drivers::drv8711::{
    Configuration, DecayMode, Driver, Failure, IsGain, Register, Status, StepMode, full_scale_microamps,
    torque_for_microamps,
};

/// A chip on a bus of its own.
struct Chip {
    registers: [Cell<u16>; 8],
    powered: Cell<bool>,
}

impl Chip {
    fn register(&self, register: Register) -> Result<&Cell<u16>, ErrorKind> {
        self.registers.get(usize::from(register.code())).ok_or(ErrorKind::Other)
    }
}

impl ErrorType for &Chip {
    type Error = ErrorKind;
}

impl SpiDevice for &Chip {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let [Operation::TransferInPlace(bytes)] = operations else { return Err(ErrorKind::Other) };
        let word = u16::from_be_bytes(bytes.first_chunk().copied().ok_or(ErrorKind::Other)?);
        let register = Register::from_code(word.to_be_bytes()[0] >> 4 & 7).ok_or(ErrorKind::Other)?;
        let held = self.register(register)?;
        if word & 0x8000 == 0 {
            // Writing 0 to a bit of STATUS clears it.
            held.set(if register == Register::Status { held.get() & word } else { word & 0xfff });
        }
        let answer = if self.powered.get() { held.get() & register.read_back_mask() } else { 0xffff };
        bytes.copy_from_slice(&answer.to_be_bytes());
        Ok(())
    }
}

fn main() -> Result<(), Failure<ErrorKind>> {
    // 1.5 A at full scale over 50 mOhm, 256 micro-steps.
    let (gain, sense) = (IsGain::X20, 50);
    let torque = torque_for_microamps(1_500_000, gain, sense).unwrap_or(0);
    let mut setup = Configuration::default();
    setup.ctrl.enable = true;
    setup.ctrl.mode = StepMode::Div256;
    setup.ctrl.gain = gain;
    setup.torque.torque = torque;
    setup.decay.mode = DecayMode::AutoMixed;
    let real = full_scale_microamps(torque, gain, sense).unwrap_or(0);
    println!("TORQUE {torque} gives {}.{:03} A", real / 1_000_000, real / 1000 % 1000);

    let chip = Chip { registers: Register::ALL.map(|register| register.reset_value().into()), powered: true.into() };
    let mut driver = Driver::new(&chip);
    driver.apply(setup)?;
    println!("written and verified, CTRL {:#05x}", chip.register(Register::Ctrl).map_err(Failure::Io)?.get());

    let faults = Status::AOCP | Status::BPDF;
    chip.register(Register::Status).map_err(Failure::Io)?.set(faults.bits().into());
    let status = driver.status()?;
    println!("status: {status}");
    driver.clear(status)?;
    println!("cleared: {:?}", driver.status()?.is_fault());
    driver.disable()?;

    chip.powered.set(false);
    match driver.status() {
        Err(Failure::Protocol(error)) => println!("without supply: {error}"),
        Err(error) => println!("without supply: {error}"),
        Ok(status) => println!("without supply: {status}?"),
    }
    Ok(())
}
