use servowire_core::U24;

use crate::layout::Layout;
use crate::number::{EncoderId, U19, U40};
use crate::status::{Alm, PmAlm};
use crate::temperature::Temperature;

/// The data of a response, by its layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[allow(missing_docs, reason = "the fields that need words have them")]
#[non_exhaustive]
pub enum Data {
    /// The whole position.
    Abs40 { abs: U40 },
    /// Position bits 0..=23.
    Abs24 { abs: U24 },
    /// Position bits 16..=39.
    Abs24High { abs: U24 },
    /// Alarms.
    Status { alm: Alm, pm_alm: PmAlm },
    /// An EEPROM word and its address. Meaningless while ES0 is set.
    Eeprom { data: u16, address: u8 },
    /// An EEPROM word of a bank. If `bank_error` is set, the encoder has no such bank.
    EepromBank { data: u16, bank: u8, address: u8, bank_error: bool },
    /// Temperature.
    Temperature { temperature: Temperature },
    /// Identification code.
    Id { id: EncoderId },
    /// Velocity coefficient; its unit and use are not documented.
    Coefficient { coefficient: U19 },
    /// Position bits 0..=23 and alarms.
    Abs24Status { abs: U24, alm: Alm },
    /// Position bits 0..=23 and temperature.
    Abs24Temp { abs: U24, temperature: Temperature },
    /// Position bits 0..=23 and velocity, two's complement; its unit is not documented.
    Abs24Vel { abs: U24, velocity: i32 },
    /// Position bits 0..=23, velocity and acceleration, two's complement; their units are not documented.
    Abs24VelAcc { abs: U24, velocity: i32, acceleration: i16 },
    /// The whole position and velocity.
    Abs40Vel { abs: U40, velocity: i32 },
}

impl Data {
    /// The layout that carries this data.
    pub const fn layout(self) -> Layout {
        match self {
            Self::Abs40 { .. } => Layout::Abs40,
            Self::Abs24 { .. } => Layout::Abs24,
            Self::Abs24High { .. } => Layout::Abs24High,
            Self::Status { .. } => Layout::Status,
            Self::Eeprom { .. } => Layout::Eeprom,
            Self::EepromBank { .. } => Layout::EepromBank,
            Self::Temperature { .. } => Layout::Temperature,
            Self::Id { .. } => Layout::Id,
            Self::Coefficient { .. } => Layout::Coefficient,
            Self::Abs24Status { .. } => Layout::Abs24Status,
            Self::Abs24Temp { .. } => Layout::Abs24Temp,
            Self::Abs24Vel { .. } => Layout::Abs24Vel,
            Self::Abs24VelAcc { .. } => Layout::Abs24VelAcc,
            Self::Abs40Vel { .. } => Layout::Abs40Vel,
        }
    }

    /// The data bits, the first on the line in bit 0; unused ones are 0.
    #[expect(clippy::cast_sign_loss, reason = "two's complement on the line")]
    pub(crate) const fn bits(self) -> u128 {
        match self {
            Self::Abs40 { abs } => abs.get() as u128,
            Self::Abs24 { abs } | Self::Abs24High { abs } => abs.get() as u128,
            Self::Id { id } => id.get() as u128,
            Self::Status { alm, pm_alm } => alm.bits() as u128 | (pm_alm.bits() as u128) << 16,
            Self::Eeprom { data, address } => data as u128 | (address as u128) << 16,
            Self::EepromBank { data, bank, address, bank_error } => {
                data as u128 | (bank as u128) << 16 | (address as u128) << 24 | (bank_error as u128) << 32
            }
            Self::Temperature { temperature } => temperature.raw() as u128,
            Self::Coefficient { coefficient } => coefficient.get() as u128,
            Self::Abs24Status { abs, alm } => abs.get() as u128 | (alm.bits() as u128) << 24,
            Self::Abs24Temp { abs, temperature } => abs.get() as u128 | (temperature.raw() as u128) << 24,
            Self::Abs24Vel { abs, velocity } => abs.get() as u128 | (velocity as u32 as u128) << 24,
            Self::Abs24VelAcc { abs, velocity, acceleration } => {
                abs.get() as u128 | (velocity as u32 as u128) << 24 | (acceleration as u16 as u128) << 56
            }
            Self::Abs40Vel { abs, velocity } => abs.get() as u128 | (velocity as u32 as u128) << 40,
        }
    }
}

servowire_core::one_line!(Data {
    Self::Abs40 { abs } => "ABS {:#012x}", abs.get();
    Self::Abs24 { abs } => "ABS {:#08x}", abs.get();
    Self::Abs24High { abs } => "ABS high {:#08x}", abs.get();
    Self::Status { alm, pm_alm } if pm_alm.is_empty() => "ALM {}", alm;
    Self::Status { alm, pm_alm } => "ALM {} PM-ALM {}", alm, pm_alm;
    Self::Eeprom { data, address } => "address {:#04x} data {:#06x}", *address, *data;
    Self::EepromBank { bank_error: true, bank, .. } => "no bank {:#04x}", *bank;
    Self::EepromBank { data, bank, address, .. } => "bank {:#04x} address {:#04x} data {:#06x}", *bank, *address, *data;
    Self::Temperature { temperature } => "temperature {}", temperature;
    Self::Id { id } => "ID {:#08x}", id.get();
    Self::Coefficient { coefficient } => "coefficient {}", coefficient;
    Self::Abs24Status { abs, alm } => "ABS {:#08x} ALM {}", abs.get(), alm;
    Self::Abs24Temp { abs, temperature } => "ABS {:#08x} temperature {}", abs.get(), temperature;
    Self::Abs24Vel { abs, velocity } => "ABS {:#08x} velocity {}", abs.get(), velocity;
    Self::Abs24VelAcc { abs, velocity, acceleration } =>
        "ABS {:#08x} velocity {} acceleration {}", abs.get(), velocity, acceleration;
    Self::Abs40Vel { abs, velocity } => "ABS {:#012x} velocity {}", abs.get(), velocity;
});
