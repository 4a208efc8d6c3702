//! The registers by their addresses, and SPI words.

use super::error::Error;

servowire_core::codes! {
    /// The eight registers by their addresses.
    pub enum Register: u8 {
        /// Enable, direction, micro-steps, gain.
        Ctrl = 0 => "CTRL",
        /// Current and back-EMF sampling.
        Torque = 1 => "TORQUE",
        /// Fixed off time.
        Off = 2 => "OFF",
        /// Blanking of the current trip.
        Blank = 3 => "BLANK",
        /// Current decay.
        Decay = 4 => "DECAY",
        /// Stall detection.
        Stall = 5 => "STALL",
        /// Gate drive and over-current protection.
        Drive = 6 => "DRIVE",
        /// Faults.
        Status = 7 => "STATUS",
    }
}

impl Register {
    /// Value after power-up.
    pub const fn reset_value(self) -> u16 {
        match self {
            Self::Ctrl => 0xc10,
            Self::Torque => 0x1ff,
            Self::Off => 0x030,
            Self::Blank => 0x080,
            Self::Decay => 0x110,
            Self::Stall => 0x040,
            Self::Drive => 0xa59,
            Self::Status => 0x000,
        }
    }

    /// The bits that read back as written. Bit 10 of TORQUE, the top of SMPLTH, is accepted but always reads 0, so a driver has
    /// to remember what it wrote.
    pub const fn read_back_mask(self) -> u16 {
        match self {
            Self::Torque => 0xfff & !(1 << 10),
            _ => 0xfff,
        }
    }

    /// Returns the word that writes the low 12 bits of `value`.
    pub const fn write(self, value: u16) -> Word {
        Word((self.code() as u16) << 12 | value & 0xfff)
    }

    /// Returns the word that reads the register. The answer comes in the same transfer.
    pub const fn read(self) -> Word {
        Word(0x8000 | (self.code() as u16) << 12)
    }

    /// Checks that `read` is a value that a register holding `written` may return.
    ///
    /// # Errors
    /// [`Error::ReadBack`]
    pub const fn verify(self, written: u16, read: u16) -> Result<(), Error> {
        let mask = self.read_back_mask();
        let (got, want) = (read & mask, written & mask);
        if got == want { Ok(()) } else { Err(Error::ReadBack { register: self.code(), got, want }) }
    }
}

/// One SPI word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Word(u16);

impl Word {
    /// The 16 bits.
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// The bytes in the order in which they are sent.
    pub const fn to_bytes(self) -> [u8; 2] {
        self.0.to_be_bytes()
    }

    /// Returns the data in the answer to a read. Its upper four bits are undefined.
    pub const fn answer(miso: [u8; 2]) -> u16 {
        u16::from_be_bytes(miso) & 0xfff
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_carry_address_and_data() {
        for register in Register::ALL {
            assert_eq!(Register::from_code(register.code()), Some(register));
            assert_eq!(register.read().bits(), 0x8000 | u16::from(register.code()) << 12);
            for value in (0..=u16::MAX).step_by(if cfg!(miri) { 997 } else { 1 }) {
                let word = register.write(value).bits();
                assert_eq!(word, u16::from(register.code()) << 12 | value & 0xfff);
                assert_eq!(Word::answer(value.to_be_bytes()), value & 0xfff);
            }
        }
        assert_eq!(Register::from_code(8), None);
        assert_eq!(Register::Torque.write(0x1ff).to_bytes(), [0x11, 0xff]);
        let names = ["CTRL", "TORQUE", "OFF", "BLANK", "DECAY", "STALL", "DRIVE", "STATUS"];
        assert_eq!(Register::ALL.map(Register::name), names);
    }

    #[test]
    fn only_bit_10_of_torque_may_differ() {
        for register in Register::ALL {
            for bit in 0..12 {
                let good = register.verify(0xfff, 0xfff & !(1 << bit)).is_ok();
                assert_eq!(good, register == Register::Torque && bit == 10);
            }
        }
    }
}
