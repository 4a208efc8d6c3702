use crate::command::{Command, Version};
use crate::frame::FrameCode;
use crate::number::{EncoderId, U19, UserAddress};

/// Lists the commands that take no argument, each as an operation of the same name; the others carry their arguments.
macro_rules! operations {
    ($($plain:ident)+) => {
        /// A command with its arguments. See [`Command`] for what each does.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        #[allow(missing_docs, reason = "those without a comment are the commands of the same name")]
        #[non_exhaustive]
        pub enum Operation {
            $($plain,)+
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
            /// Assigns the address in EA to the encoder with this identification code.
            SetAddress2 {
                /// The identification code of the encoder concerned.
                id: EncoderId,
            },
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
                    $(Self::$plain => Command::$plain,)+
                    Self::EepromRead { .. } | Self::EepromReadBank { .. } => Command::EepromRead,
                    Self::EepromWrite { .. } | Self::EepromWriteBank { .. } => Command::EepromWrite,
                    Self::CoefficientRead => Command::IdRead1,
                    Self::IdWrite1 { .. } | Self::CoefficientWrite { .. } => Command::IdWrite1,
                    Self::IdWrite2 { .. } => Command::IdWrite2,
                    Self::SetAddress2 { .. } => Command::SetAddress2,
                }
            }

            /// Returns the operation of a command that takes no argument; `None` for the five that do (13, 14, 18, 19, 20).
            pub const fn without_arguments(command: Command) -> Option<Self> {
                match command {
                    $(Command::$plain => Some(Self::$plain),)+
                    _ => None,
                }
            }
        }
    };
}

operations! {
    Abs40 Abs24Low Abs24High Status Abs40Mt Abs24LowMt Abs24HighMt StatusMt ClearStatus ClearMultiturn ClearStatusMultiturn
    SetAddress1 ZeroPreset Temperature IdRead1 IdRead2 Abs17 Abs17Mt Abs24Vel Abs24VelMt Abs24VelAcc Abs24VelAccMt Abs24Status
    Abs24StatusMt Abs24Temp Abs24TempMt
}

impl Operation {
    /// The frame code of the command data frame: 3 for banks and the velocity coefficient, otherwise 0.
    pub const fn frame_code(self) -> FrameCode {
        match self {
            Self::EepromReadBank { .. }
            | Self::EepromWriteBank { .. }
            | Self::CoefficientRead
            | Self::CoefficientWrite { .. } => FrameCode::Fc3,
            _ => FrameCode::Fc0,
        }
    }

    /// Returns whether only encoders of version 3.0 understand it.
    pub const fn needs_version_3(self) -> bool {
        matches!(self.frame_code(), FrameCode::Fc3) || matches!(self.command().min_version(), Version::V3_0)
    }

    /// Returns whether the encoder changes something that outlives the request: EEPROM, identification code, address, zero
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

    /// The name in capitals. It is that of the command, except for the four operations of version 3.0 that share a code with
    /// another.
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
