//! The motor driver of a device: a DRV8711 behind its SPI, and the task that sets it up and polls it.

use core::fmt;

use servowire_drivers::drv8711::{self, Apply, Configuration, Register, Status, StepMode};

/// Duration of a word on the 500 kHz SPI, in ns: the STATUS that a device reports can be this old.
const WORD_NS: u64 = 32_000;

/// The registers after power-up: CTRL, TORQUE, OFF, BLANK, DECAY, STALL, DRIVE, STATUS.
const RESET: [u16; 8] = [0xc10, 0x1ff, 0x030, 0x080, 0x110, 0x040, 0xa59, 0x000];
/// ENBL in CTRL.
const ENABLED: u16 = 1;

/// Something that happens to a driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    /// The driver sets bits of STATUS and stops driving the motor.
    Reports(Status),
    /// The driver has no supply: every register reads as all ones.
    Unpowered,
    /// A dip in its supply: all registers have their reset values, ENBL is 0, and STATUS reports nothing.
    Reset,
}

impl Fault {
    pub(super) fn parse(name: &str) -> Option<Self> {
        let name = name.to_ascii_uppercase();
        match name.as_str() {
            "UNPOWERED" => Some(Self::Unpowered),
            "RESET" => Some(Self::Reset),
            name => Status::from_name(name).map(Self::Reports),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Reports(status) => write!(f, "reports {status}"),
            Self::Unpowered => f.write_str("loses its supply"),
            Self::Reset => f.write_str("loses its settings"),
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Driver {
    registers: [u16; 8],
    powered: bool,
    /// What the device last read, and when it reads again.
    polled: Status,
    due_ns: u64,
}

impl Driver {
    /// Creates a driver after power-up.
    pub(super) fn new() -> Self {
        Self { registers: RESET, powered: true, polled: Status::empty(), due_ns: 0 }
    }

    pub(super) fn hit(&mut self, fault: Fault) {
        match fault {
            Fault::Unpowered => self.powered = false,
            Fault::Reset => self.registers = RESET,
            Fault::Reports(status) => {
                if let Some(register) = self.registers.last_mut() {
                    *register |= u16::from(status.bits());
                }
            }
        }
    }

    /// Returns the registers for the reference motor: 1/256 steps, with the motor driven.
    pub(super) fn set_up(&mut self) -> Result<(), drv8711::Error> {
        let mut configuration = Configuration::default();
        configuration.ctrl.enable = true;
        configuration.ctrl.mode = StepMode::Div256;
        let mut apply = Apply::new(configuration);
        while let Some(word) = apply.transmission() {
            apply.hear(self.transfer(word.bits()).to_be_bytes())?;
        }
        Ok(())
    }

    /// Transfers a word over the SPI.
    fn transfer(&mut self, word: u16) -> u16 {
        if !self.powered {
            return 0xffff;
        }
        let address = word >> 12 & 7;
        let Some(register) = self.registers.get_mut(usize::from(address)) else { return 0 };
        if word & 0x8000 == 0 {
            // Writing 0 to a bit of STATUS clears it.
            *register = if address == 7 { *register & word } else { word & 0xfff };
        }
        // Bit 10 of TORQUE always reads 0.
        if address == 1 { *register & 0xbff } else { *register }
    }

    /// Returns whether steps move the motor.
    pub(super) fn drives(&self) -> bool {
        let [ctrl, .., status] = self.registers;
        self.powered && ctrl & ENABLED != 0 && status == 0
    }

    /// Returns STATUS as the device knows it at `now_ns` of its time.
    pub(super) fn status(&mut self, now_ns: u64) -> Status {
        if now_ns >= self.due_ns {
            self.due_ns = now_ns + WORD_NS;
            self.polled = Status::of_register(self.transfer(Register::Status.read().bits()));
        }
        self.polled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chip_takes_its_registers_and_one_without_supply_does_not() {
        let mut driver = Driver::new();
        assert_eq!(driver.set_up(), Ok(()));
        assert_eq!(driver.registers[0], 0xc41);
        assert!(driver.drives());
        let mut dead = Driver::new();
        dead.hit(Fault::Unpowered);
        assert!(matches!(dead.set_up(), Err(drv8711::Error::ReadBack { register: 1, .. })));
        assert!(!dead.drives() && dead.status(0).looks_unpowered());
    }

    #[test]
    fn a_fault_is_told_with_the_next_word_of_the_spi() {
        let mut driver = Driver::new();
        assert_eq!(driver.status(0), Status::empty());
        driver.hit(Fault::parse("bpdf").unwrap());
        assert!(!driver.drives());
        assert_eq!(driver.status(31_999), Status::empty());
        assert_eq!(driver.status(32_000), Status::BPDF);
        assert_eq!(Fault::parse("XYZ"), None);
    }

    /// The one fault that STATUS does not tell.
    #[test]
    fn a_chip_that_has_lost_its_settings_drives_no_more_and_reports_nothing() {
        let mut driver = Driver::new();
        assert!(!driver.drives(), "ENBL is 0 after power-up");
        driver.set_up().unwrap();
        driver.hit(Fault::parse("reset").unwrap());
        assert!(!driver.drives());
        assert_eq!(driver.status(0), Status::empty());
    }
}
