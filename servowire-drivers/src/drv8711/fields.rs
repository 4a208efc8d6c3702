//! The fields of all registers by name, for tools that show or set raw codes.

use super::word::Register;

/// A field of a register: the raw code, reserved values included.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Field {
    /// The data sheet's name.
    pub name: &'static str,
    /// Its lowest bit.
    pub shift: u8,
    /// Its width in bits.
    pub width: u8,
}

impl Field {
    const fn mask(self) -> u16 {
        // Widths are 1 to 8.
        (1u16 << self.width).wrapping_sub(1)
    }

    /// Extracts the raw code from a register's value.
    pub const fn get(self, value: u16) -> u16 {
        value >> self.shift & self.mask()
    }

    /// Returns the register's value with this raw code; bits above the field's width are cut off.
    pub const fn set(self, value: u16, code: u16) -> u16 {
        value & !(self.mask() << self.shift) | (code & self.mask()) << self.shift
    }
}

const fn field(name: &'static str, shift: u8, width: u8) -> Field {
    Field { name, shift, width }
}

const CTRL: [Field; 7] = [
    field("ENBL", 0, 1),
    field("RDIR", 1, 1),
    field("RSTEP", 2, 1),
    field("MODE", 3, 4),
    field("EXSTALL", 7, 1),
    field("ISGAIN", 8, 2),
    field("DTIME", 10, 2),
];
const TORQUE: [Field; 2] = [field("TORQUE", 0, 8), field("SMPLTH", 8, 3)];
const OFF: [Field; 2] = [field("TOFF", 0, 8), field("PWMMODE", 8, 1)];
const BLANK: [Field; 2] = [field("TBLANK", 0, 8), field("ABT", 8, 1)];
const DECAY: [Field; 2] = [field("TDECAY", 0, 8), field("DECMOD", 8, 3)];
const STALL: [Field; 3] = [field("SDTHR", 0, 8), field("SDCNT", 8, 2), field("VDIV", 10, 2)];
const DRIVE: [Field; 6] = [
    field("OCPTH", 0, 2),
    field("OCPDEG", 2, 2),
    field("TDRIVEN", 4, 2),
    field("TDRIVEP", 6, 2),
    field("IDRIVEN", 8, 2),
    field("IDRIVEP", 10, 2),
];
const STATUS: [Field; 8] = [
    field("OTS", 0, 1),
    field("AOCP", 1, 1),
    field("BOCP", 2, 1),
    field("APDF", 3, 1),
    field("BPDF", 4, 1),
    field("UVLO", 5, 1),
    field("STD", 6, 1),
    field("STDLAT", 7, 1),
];

impl Register {
    /// The fields of the register, lowest bit first.
    pub const fn fields(self) -> &'static [Field] {
        match self {
            Self::Ctrl => &CTRL,
            Self::Torque => &TORQUE,
            Self::Off => &OFF,
            Self::Blank => &BLANK,
            Self::Decay => &DECAY,
            Self::Stall => &STALL,
            Self::Drive => &DRIVE,
            Self::Status => &STATUS,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_follow_each_other_without_overlap() {
        for register in Register::ALL {
            let mut next = 0;
            for field in register.fields() {
                assert_eq!(field.shift, next, "{}", field.name);
                next += field.width;
                assert_eq!(field.set(0, u16::MAX), field.mask() << field.shift);
                assert_eq!(field.get(field.set(0xfff, 0)), 0);
            }
            assert!(next <= 12);
        }
    }
}
