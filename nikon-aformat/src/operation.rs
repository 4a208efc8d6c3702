use crate::command::{Command, Version};
use crate::frame::FrameCode;
use crate::number::{EncoderId, U19, UserAddress};

/// A command with its arguments. See [`Command`] for what each does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[allow(missing_docs, reason = "those without a comment are the commands of the same name")]
#[non_exhaustive]
pub enum Operation {
    Abs40,
    Abs24Low,
    Abs24High,
    Status,
    Abs40Mt,
    Abs24LowMt,
    Abs24HighMt,
    StatusMt,
    ClearStatus,
    ClearMultiturn,
    ClearStatusMultiturn,
    SetAddress1,
    ZeroPreset,
    /// Reads an EEPROM word.
    EepromRead {
        /// Any address.
        address: u8,
    },
    /// Writes an EEPROM word.
    EepromWrite {
        /// 0x00..=0xef.
        address: UserAddress,
        /// The word.
        data: u16,
    },
    Temperature,
    IdRead1,
    IdRead2,
    /// Writes the identification code of the encoder with this address.
    IdWrite1 {
        /// The new code.
        id: EncoderId,
    },
    /// Writes the identification code of the only encoder on the line.
    IdWrite2 {
        /// The new code.
        id: EncoderId,
    },
    /// Gives the encoder with this identification code the address in EA.
    SetAddress2 {
        /// Whom it concerns.
        id: EncoderId,
    },
    Abs17,
    Abs17Mt,
    Abs24Vel,
    Abs24VelMt,
    Abs24VelAcc,
    Abs24VelAccMt,
    Abs24Status,
    Abs24StatusMt,
    Abs24Temp,
    Abs24TempMt,
    /// Reads an EEPROM word of a bank. Version 3.0.
    EepromReadBank {
        /// Bank.
        bank: u8,
        /// Any address.
        address: u8,
    },
    /// Writes an EEPROM word of a bank. Version 3.0.
    EepromWriteBank {
        /// Bank.
        bank: u8,
        /// Any address.
        address: u8,
        /// The word.
        data: u16,
    },
    /// Reads the velocity coefficient. Version 3.0.
    CoefficientRead,
    /// Writes the velocity coefficient. Version 3.0.
    CoefficientWrite {
        /// 19 bits; unit and meaning are not documented.
        coefficient: U19,
    },
}

impl Operation {
    /// The command.
    pub const fn command(self) -> Command {
        match self {
            Self::Abs40 => Command::Abs40,
            Self::Abs24Low => Command::Abs24Low,
            Self::Abs24High => Command::Abs24High,
            Self::Status => Command::Status,
            Self::Abs40Mt => Command::Abs40Mt,
            Self::Abs24LowMt => Command::Abs24LowMt,
            Self::Abs24HighMt => Command::Abs24HighMt,
            Self::StatusMt => Command::StatusMt,
            Self::ClearStatus => Command::ClearStatus,
            Self::ClearMultiturn => Command::ClearMultiturn,
            Self::ClearStatusMultiturn => Command::ClearStatusMultiturn,
            Self::SetAddress1 => Command::SetAddress1,
            Self::ZeroPreset => Command::ZeroPreset,
            Self::EepromRead { .. } | Self::EepromReadBank { .. } => Command::EepromRead,
            Self::EepromWrite { .. } | Self::EepromWriteBank { .. } => Command::EepromWrite,
            Self::Temperature => Command::Temperature,
            Self::IdRead1 | Self::CoefficientRead => Command::IdRead1,
            Self::IdRead2 => Command::IdRead2,
            Self::IdWrite1 { .. } | Self::CoefficientWrite { .. } => Command::IdWrite1,
            Self::IdWrite2 { .. } => Command::IdWrite2,
            Self::SetAddress2 { .. } => Command::SetAddress2,
            Self::Abs17 => Command::Abs17,
            Self::Abs17Mt => Command::Abs17Mt,
            Self::Abs24Vel => Command::Abs24Vel,
            Self::Abs24VelMt => Command::Abs24VelMt,
            Self::Abs24VelAcc => Command::Abs24VelAcc,
            Self::Abs24VelAccMt => Command::Abs24VelAccMt,
            Self::Abs24Status => Command::Abs24Status,
            Self::Abs24StatusMt => Command::Abs24StatusMt,
            Self::Abs24Temp => Command::Abs24Temp,
            Self::Abs24TempMt => Command::Abs24TempMt,
        }
    }

    /// The operation of a command that takes no argument; `None` for the five that do (13, 14, 18, 19, 20).
    pub const fn without_arguments(command: Command) -> Option<Self> {
        Some(match command {
            Command::Abs40 => Self::Abs40,
            Command::Abs24Low => Self::Abs24Low,
            Command::Abs24High => Self::Abs24High,
            Command::Status => Self::Status,
            Command::Abs40Mt => Self::Abs40Mt,
            Command::Abs24LowMt => Self::Abs24LowMt,
            Command::Abs24HighMt => Self::Abs24HighMt,
            Command::StatusMt => Self::StatusMt,
            Command::ClearStatus => Self::ClearStatus,
            Command::ClearMultiturn => Self::ClearMultiturn,
            Command::ClearStatusMultiturn => Self::ClearStatusMultiturn,
            Command::SetAddress1 => Self::SetAddress1,
            Command::ZeroPreset => Self::ZeroPreset,
            Command::Temperature => Self::Temperature,
            Command::IdRead1 => Self::IdRead1,
            Command::IdRead2 => Self::IdRead2,
            Command::Abs17 => Self::Abs17,
            Command::Abs17Mt => Self::Abs17Mt,
            Command::Abs24Vel => Self::Abs24Vel,
            Command::Abs24VelMt => Self::Abs24VelMt,
            Command::Abs24VelAcc => Self::Abs24VelAcc,
            Command::Abs24VelAccMt => Self::Abs24VelAccMt,
            Command::Abs24Status => Self::Abs24Status,
            Command::Abs24StatusMt => Self::Abs24StatusMt,
            Command::Abs24Temp => Self::Abs24Temp,
            Command::Abs24TempMt => Self::Abs24TempMt,
            Command::EepromRead
            | Command::EepromWrite
            | Command::IdWrite1
            | Command::IdWrite2
            | Command::SetAddress2 => return None,
        })
    }

    /// The frame code of the command data frame: 3 for banks and the velocity coefficient, else 0.
    pub const fn frame_code(self) -> FrameCode {
        match self {
            Self::EepromReadBank { .. }
            | Self::EepromWriteBank { .. }
            | Self::CoefficientRead
            | Self::CoefficientWrite { .. } => FrameCode::Fc3,
            _ => FrameCode::Fc0,
        }
    }

    /// Whether only encoders of version 3.0 understand it.
    pub const fn needs_version_3(self) -> bool {
        matches!(self.frame_code(), FrameCode::Fc3) || matches!(self.command().min_version(), Version::V3_0)
    }

    /// Whether the encoder changes something that outlives the request: EEPROM, identification code, address, zero
    /// point, turns, alarms.
    pub const fn writes(self) -> bool {
        self.command().is_reset()
            || matches!(
                self,
                Self::EepromWrite { .. }
                    | Self::EepromWriteBank { .. }
                    | Self::IdWrite1 { .. }
                    | Self::IdWrite2 { .. }
                    | Self::SetAddress2 { .. }
                    | Self::CoefficientWrite { .. }
            )
    }
}

impl Operation {
    /// The name in capitals: that of the command, but for the four of version 3.0 that share a code with another.
    pub const fn name(self) -> &'static str {
        match self {
            Self::EepromReadBank { .. } => "EEPROM_READ_BANK",
            Self::EepromWriteBank { .. } => "EEPROM_WRITE_BANK",
            Self::CoefficientRead => "VELCOEF_READ",
            Self::CoefficientWrite { .. } => "VELCOEF_WRITE",
            other => other.command().name(),
        }
    }
}

servowire_core::one_line!(Operation {
    Self::EepromRead { address } => "EEPROM_READ address {:#04x}", *address;
    Self::EepromWrite { address, data } => "EEPROM_WRITE address {:#04x} data {:#06x}", address.get(), *data;
    Self::EepromReadBank { bank, address } => "EEPROM_READ_BANK bank {:#04x} address {:#04x}", *bank, *address;
    Self::EepromWriteBank { bank, address, data } =>
        "EEPROM_WRITE_BANK bank {:#04x} address {:#04x} data {:#06x}", *bank, *address, *data;
    Self::IdWrite1 { id } => "ID_WRITE_1 ID {:#08x}", id.get();
    Self::IdWrite2 { id } => "ID_WRITE_2 ID {:#08x}", id.get();
    Self::SetAddress2 { id } => "SET_ADDRESS_2 ID {:#08x}", id.get();
    Self::CoefficientWrite { coefficient } => "VELCOEF_WRITE coefficient {}", coefficient;
    other => "{}", other.name();
});
