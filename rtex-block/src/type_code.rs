//! Type codes, parameter numbers and system ID texts.
//!
//! A type code names the object of a non-cyclic command. Every number can be sent and received; constants exist
//! for those that SX-DSV02310 confirms. The A5N and A6N families have more of them.

use core::fmt;

servowire_core::number! {
    /// Type_Code of the commands with the common layout, 12 bits.
    ///
    /// Codes up to FFh are the new ones and work in the sub block too; longer ones are the conventional (A4N-compatible) codes
    /// and work only in the main block. SX-DSV02310, "System ID command".
    pub struct TypeCode(u16, 12);
}

impl TypeCode {
    /// Creates a code of 8 bits.
    pub const fn short(value: u8) -> Self {
        Self::truncate(value as u16)
    }

    /// The code as it goes into a sub block; `None` for a conventional code.
    pub const fn sub(self) -> Option<u8> {
        match self.get().to_le_bytes() {
            [code, 0] => Some(code),
            _ => None,
        }
    }
}

servowire_core::number! {
    /// Four bits: a Latch_Sel field.
    pub struct Nibble(u8, 4);
}

impl Nibble {
    /// 0: outside latch mode.
    pub const ZERO: Self = Self::truncate(0);
}

/// Type codes of the reset command (1h). SX-DSV02310, "Reset command".
pub mod reset {
    use super::TypeCode;

    /// Software reset of the drive. Switch the servo off beforehand.
    pub const SOFTWARE: TypeCode = TypeCode::truncate(0x001);
    /// Makes parameters of attribute C valid without a reset.
    pub const ATTRIBUTE_C: TypeCode = TypeCode::truncate(0x011);
}

/// Type codes of the system ID command (2h). SX-DSV02310, "System ID command".
pub mod system_id {
    use super::TypeCode;

    /// Vendor name.
    pub const VENDOR_NAME: TypeCode = TypeCode::truncate(0x01);
    /// Kind of device, a character from a table: `1` servo, `2` stepping, ...
    pub const DEVICE_TYPE: TypeCode = TypeCode::truncate(0x05);
    /// Model name of the drive.
    pub const MODEL: TypeCode = TypeCode::truncate(0x12);
    /// Serial number of the drive.
    pub const SERIAL_NUMBER: TypeCode = TypeCode::truncate(0x13);
    /// Software version of the drive.
    pub const SOFTWARE_VERSION: TypeCode = TypeCode::truncate(0x14);
    /// Type of the drive.
    pub const DRIVER_TYPE: TypeCode = TypeCode::truncate(0x15);
    /// Vendor of the external scale.
    pub const SCALE_VENDOR_ID: TypeCode = TypeCode::truncate(0x31);
    /// Model of the external scale.
    pub const SCALE_MODEL_ID: TypeCode = TypeCode::truncate(0x32);

    /// Returns the conventional code for the same text: 10h times the new one. This holds only for the codes above.
    pub const fn conventional(code: TypeCode) -> Option<TypeCode> {
        match code.get() {
            0x01 | 0x05 | 0x12..=0x15 | 0x31 | 0x32 => Some(TypeCode::truncate(code.get() << 4)),
            _ => None,
        }
    }

    /// Returns group `index` of a text: four ASCII characters, filled with NUL after the end.
    ///
    /// ```
    /// use rtex_block::type_code::system_id::group;
    /// assert_eq!([group(b"Panasonic", 0), group(b"Panasonic", 1), group(b"Panasonic", 2)], [*b"Pana", *b"soni", *b"c\0\0\0"]);
    /// ```
    pub fn group(text: &[u8], index: u16) -> [u8; 4] {
        let mut group = [0; 4];
        let tail = text.get(usize::from(index).saturating_mul(4)..).unwrap_or(&[]);
        for (to, from) in group.iter_mut().zip(tail) {
            *to = *from;
        }
        group
    }

    /// Returns the characters of a group up to the first NUL; a group that is not full is the last of its text.
    pub fn text(group: &[u8; 4]) -> &[u8] {
        let end = group.iter().position(|&c| c == 0).unwrap_or(4);
        group.get(..end).unwrap_or(&[])
    }

    /// Returns the meaning of a device-type text; `None` if the table calls it reserved or does not list it.
    pub fn device_type(text: &[u8]) -> Option<&'static str> {
        Some(match text {
            b"1" => "servo",
            b"2" => "stepping",
            b"3" => "pulse output",
            b"4" => "digital input",
            b"5" => "digital output or input and output",
            b"6" => "analog input",
            b"7" => "analog output or input and output",
            b"9" => "gateway",
            _ => return None,
        })
    }
}

/// Type codes of the homing command (4h). SX-DSV02310, "Homing command".
pub mod homing {
    /// Sets the actual position to Setting_Data.
    pub const SET_ACTUAL_POSITION: u8 = 0x21;
    /// Sets the command position to Setting_Data.
    pub const SET_COMMAND_POSITION: u8 = 0x22;
    /// Reads the latch state again.
    pub const LATCH_STATE: u8 = 0x50;
}

/// Type codes of the parameter command (6h). SX-DSV02310, "Parameter command".
pub mod parameter {
    use super::TypeCode;

    /// Write.
    pub const WRITE: TypeCode = TypeCode::truncate(0x011);
}

/// Type codes of the profile command (7h). SX-DSV02310, "Profile command".
pub mod profile {
    /// Positioning relative to the command position.
    pub const RELATIVE: u8 = 0x11;
}

/// Type codes of the monitor command (Ah), also used by Monitor_Sel. SX-DSV02310, "Monitor command".
pub mod monitor {
    use super::TypeCode;

    /// PERR, position deviation, command units.
    pub const PERR: TypeCode = TypeCode::truncate(0x01);
    /// MPOS, command position after the filter, command units.
    pub const MPOS: TypeCode = TypeCode::truncate(0x04);
    /// ASPD, actual speed, unit by Pr7.25.
    pub const ASPD: TypeCode = TypeCode::truncate(0x05);
    /// TRQ, torque, 0.1 % of rated.
    pub const TRQ: TypeCode = TypeCode::truncate(0x06);
    /// APOS, actual position, command units.
    pub const APOS: TypeCode = TypeCode::truncate(0x07);
    /// IPOS, command position before the filter, command units.
    pub const IPOS: TypeCode = TypeCode::truncate(0x08);
    /// LPOS1, position caught by latch 1.
    pub const LPOS1: TypeCode = TypeCode::truncate(0x09);
    /// LPOS2, position caught by latch 2.
    pub const LPOS2: TypeCode = TypeCode::truncate(0x0a);
    /// MSPD, command speed after the filter, unit by Pr7.25.
    pub const MSPD: TypeCode = TypeCode::truncate(0x0c);
    /// Regenerative load ratio, 0.1 %.
    pub const REGENERATIVE_LOAD: TypeCode = TypeCode::truncate(0x11);
    /// Overload ratio, 0.1 %.
    pub const OVERLOAD: TypeCode = TypeCode::truncate(0x12);

    /// Returns the conventional code for the same value: 100h more. The codes 07h to 0Ch have no conventional code.
    pub const fn conventional(code: TypeCode) -> Option<TypeCode> {
        match code.get() {
            0x01 | 0x02 | 0x04..=0x06 | 0x11 | 0x12 => Some(TypeCode::truncate(code.get() | 0x100)),
            _ => None,
        }
    }

    /// Returns the abbreviation of a code; `None` if it is not confirmed.
    pub const fn name(code: TypeCode) -> Option<&'static str> {
        Some(match code {
            PERR => "PERR",
            MPOS => "MPOS",
            ASPD => "ASPD",
            TRQ => "TRQ",
            APOS => "APOS",
            IPOS => "IPOS",
            LPOS1 => "LPOS1",
            LPOS2 => "LPOS2",
            MSPD => "MSPD",
            REGENERATIVE_LOAD => "regenerative load ratio",
            OVERLOAD => "overload ratio",
            _ => return None,
        })
    }
}

/// A drive parameter, Pr`class`.`number`.
///
/// The Index of a parameter command holds both; that the class is the high byte is inferred, not confirmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Pr {
    /// The number before the point.
    pub class: u8,
    /// The number after the point.
    pub number: u8,
}

impl fmt::Display for Pr {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Pr{}.{:02}", self.class, self.number)
    }
}

impl Pr {
    /// Returns the parameter of an Index.
    pub(crate) const fn from_index(index: u16) -> Self {
        let [number, class] = index.to_le_bytes();
        Self { class, number }
    }

    /// The Index: Pr7.20 is 0714h.
    pub const fn index(self) -> u16 {
        u16::from_le_bytes([self.number, self.class])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_in_groups_of_four() {
        assert_eq!(system_id::group(b"Panasonic", 2), *b"c\0\0\0");
        assert_eq!(system_id::group(b"Panasonic", u16::MAX), [0; 4]);
        assert_eq!(system_id::text(b"c\0\0\0"), b"c");
        assert_eq!(system_id::text(b"soni"), b"soni");
        assert_eq!(system_id::device_type(b"1"), Some("servo"));
    }

    #[test]
    fn conventional_codes() {
        assert_eq!(system_id::conventional(system_id::SCALE_MODEL_ID).map(TypeCode::get), Some(0x320));
        assert_eq!(system_id::conventional(TypeCode::short(0x22)), None);
        assert_eq!(monitor::conventional(monitor::OVERLOAD).map(TypeCode::get), Some(0x112));
        assert_eq!(monitor::conventional(monitor::APOS), None);
        assert_eq!(TypeCode::new(0x112).and_then(TypeCode::sub), None);
        assert_eq!(monitor::APOS.sub(), Some(7));
    }

    #[test]
    fn parameter_index() {
        assert_eq!(Pr { class: 7, number: 20 }.index(), 0x0714);
        for index in (0..=u16::MAX).step_by(crate::STRIDE) {
            assert_eq!(Pr::from_index(index).index(), index);
        }
        assert!((0..=u16::MAX).filter_map(TypeCode::new).eq((0..0x1000).map(TypeCode::truncate)));
    }
}
