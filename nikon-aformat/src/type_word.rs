use crate::resolution::Resolution;

/// EEPROM word 0xf6: the kind of encoder.
///
/// ```text
///  bit  15 ... 7 | 6   5      | 4   3       | 2 1 0
///       unknown  | battery    | turns       | resolution
///                | 0 none     | 0 none      | 0  17 bits
///                | 1 separate | 1 magnetic  | 1  20 bits
///                | 2 common   | 2 optical   | 2  22 bits
///                |            |             | 3  24 bits
/// ```
///
/// Known only from one drive maker's firmware; other codes have no known meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct TypeWord(pub u16);

/// How an encoder counts turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Multiturn {
    /// Not at all.
    None,
    /// Magnetically, 16 bits.
    Magnetic,
    /// Optically, 16 bits.
    Optical,
    /// A code without a known meaning.
    Unknown(u8),
}

/// How the battery is connected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Battery {
    /// There is no battery.
    None,
    /// By a line of its own.
    Separate,
    /// By a line shared by several encoders.
    Common,
    /// A code without a known meaning.
    Unknown(u8),
}

impl TypeWord {
    /// Its EEPROM address.
    pub const EEPROM_ADDRESS: u8 = 0xf6;

    /// Returns the type word of an encoder with these widths; for widths that have no code, an unknown type word.
    pub(crate) const fn of(resolution: Resolution) -> Self {
        let code = match resolution.st_bits() {
            17 => 0,
            20 => 1,
            22 => 2,
            24 => 3,
            _ => 7,
        };
        let multiturn = match resolution.mt_bits() {
            0 => 0,
            16 => 2,
            _ => 3,
        };
        Self(code | multiturn << 3)
    }

    /// Code of the resolution, 0..=7.
    pub const fn resolution_code(self) -> u8 {
        (self.0 & 7) as u8
    }

    /// Single-turn bits; `None` for a code without a known meaning.
    pub const fn st_bits(self) -> Option<u8> {
        match self.resolution_code() {
            0 => Some(17),
            1 => Some(20),
            2 => Some(22),
            3 => Some(24),
            _ => None,
        }
    }

    /// How turns are counted.
    pub const fn multiturn(self) -> Multiturn {
        match (self.0 >> 3 & 3) as u8 {
            0 => Multiturn::None,
            1 => Multiturn::Magnetic,
            2 => Multiturn::Optical,
            code => Multiturn::Unknown(code),
        }
    }

    /// Number of bits of the turns; `None` for a code without a known meaning.
    pub const fn mt_bits(self) -> Option<u8> {
        match self.multiturn() {
            Multiturn::None => Some(0),
            Multiturn::Magnetic | Multiturn::Optical => Some(16),
            Multiturn::Unknown(_) => None,
        }
    }

    /// How the battery is connected.
    pub const fn battery(self) -> Battery {
        match (self.0 >> 5 & 3) as u8 {
            0 => Battery::None,
            1 => Battery::Separate,
            2 => Battery::Common,
            code => Battery::Unknown(code),
        }
    }

    /// The widths as a resolution of version 2.1; `None` for codes without a known meaning. The word does not contain the version.
    pub const fn resolution(self) -> Option<Resolution> {
        match (self.st_bits(), self.mt_bits()) {
            (Some(st_bits), Some(mt_bits)) => match Resolution::new(st_bits, mt_bits) {
                Ok(resolution) => Some(resolution),
                Err(_) => None,
            },
            _ => None,
        }
    }
}

servowire_core::one_line!(TypeWord {
    word if word.resolution().is_some() => "{} + {} bits", word.st_bits().unwrap_or(0), word.mt_bits().unwrap_or(0);
    word => "type word {:04x}h of unknown meaning", word.0;
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_type_words() {
        for raw in (0..=u16::MAX).step_by(crate::STRIDE) {
            let word = TypeWord(raw);
            let known = raw & 7 < 4 && raw >> 3 & 3 < 3;
            assert_eq!(word.resolution().is_some(), known);
        }
        let word = TypeWord(0b011_0001);
        assert_eq!(word.resolution(), Some(Resolution::new(20, 16).unwrap()));
        assert_eq!((word.multiturn(), word.battery()), (Multiturn::Optical, Battery::Separate));
    }
}
