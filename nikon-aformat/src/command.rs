use crate::layout::Layout;

servowire_core::codes! {
    /// The command codes (CC) 0 to 30, which say what a request asks for. Code 31 is unassigned.
    ///
    /// MT in the names stands for "multiple transmission", where several encoders answer one request; it has nothing to do with
    /// turns.
    #[non_exhaustive]
    pub enum Command: u8 {
        /// Reads the whole position, single turn and turns.
        Abs40 = 0 => "ABS40",
        /// Reads the low 24 bits of the position.
        Abs24Low = 1 => "ABS24_LOW",
        /// Reads bits 16 to 39 of the position.
        Abs24High = 2 => "ABS24_HIGH",
        /// Reads the alarms.
        Status = 3 => "STATUS",
        /// [`Abs40`](Self::Abs40) of several encoders.
        Abs40Mt = 4 => "ABS40_MT",
        /// [`Abs24Low`](Self::Abs24Low) of several encoders.
        Abs24LowMt = 5 => "ABS24_LOW_MT",
        /// [`Abs24High`](Self::Abs24High) of several encoders.
        Abs24HighMt = 6 => "ABS24_HIGH_MT",
        /// [`Status`](Self::Status) of several encoders.
        StatusMt = 7 => "STATUS_MT",
        /// Clears the alarms. Takes effect after eight requests in succession.
        ClearStatus = 8 => "CLEAR_STATUS",
        /// Clears the turns. Takes effect after eight requests in succession.
        ClearMultiturn = 9 => "CLEAR_MULTITURN",
        /// Clears alarms and turns. Takes effect after eight requests in succession.
        ClearStatusMultiturn = 10 => "CLEAR_STATUS_MULTITURN",
        /// Assigns the address in EA to the only encoder on the line. Takes effect after eight requests in succession.
        SetAddress1 = 11 => "SET_ADDRESS_1",
        /// Makes the present position the single-turn zero. **Shifts the commutation angle of the motor.** Takes effect after
        /// eight requests in succession.
        ZeroPreset = 12 => "ZERO_PRESET",
        /// Reads an EEPROM word.
        EepromRead = 13 => "EEPROM_READ",
        /// Writes an EEPROM word.
        EepromWrite = 14 => "EEPROM_WRITE",
        /// Reads the temperature.
        Temperature = 15 => "TEMPERATURE",
        /// Reads the identification code; with frame code 3 (version 3.0) the velocity coefficient.
        IdRead1 = 16 => "ID_READ_1",
        /// Reads the identification code of the only encoder on the line, whatever its address.
        IdRead2 = 17 => "ID_READ_2",
        /// Writes the identification code; with frame code 3 (version 3.0) the velocity coefficient.
        IdWrite1 = 18 => "ID_WRITE_1",
        /// Writes the identification code of the only encoder on the line, whatever its address.
        IdWrite2 = 19 => "ID_WRITE_2",
        /// Assigns the address in EA to the encoder with a certain identification code; all others stay silent.
        SetAddress2 = 20 => "SET_ADDRESS_2",
        /// Reads the low 17 bits of the position, the shortest response.
        Abs17 = 21 => "ABS17",
        /// [`Abs17`](Self::Abs17) of several encoders.
        Abs17Mt = 22 => "ABS17_MT",
        /// Reads the low 24 bits of the position and the velocity. Version 3.0.
        Abs24Vel = 23 => "ABS24_VEL",
        /// [`Abs24Vel`](Self::Abs24Vel) of several encoders. Version 3.0.
        Abs24VelMt = 24 => "ABS24_VEL_MT",
        /// Reads the low 24 bits of the position, velocity and acceleration. Version 3.0.
        Abs24VelAcc = 25 => "ABS24_VEL_ACC",
        /// [`Abs24VelAcc`](Self::Abs24VelAcc) of several encoders. Version 3.0.
        Abs24VelAccMt = 26 => "ABS24_VEL_ACC_MT",
        /// Reads the low 24 bits of the position and the alarms.
        Abs24Status = 27 => "ABS24_STATUS",
        /// [`Abs24Status`](Self::Abs24Status) of several encoders.
        Abs24StatusMt = 28 => "ABS24_STATUS_MT",
        /// Reads the low 24 bits of the position and the temperature.
        Abs24Temp = 29 => "ABS24_TEMP",
        /// [`Abs24Temp`](Self::Abs24Temp) of several encoders.
        Abs24TempMt = 30 => "ABS24_TEMP_MT",
    }
}

impl Command {
    /// Returns whether encoders of `version` know the command.
    pub fn is_in(self, version: Version) -> bool {
        self.min_version() <= version
    }

    /// The first version that has this command.
    pub const fn min_version(self) -> Version {
        match self {
            Self::Abs24Vel | Self::Abs24VelMt | Self::Abs24VelAcc | Self::Abs24VelAccMt => Version::V3_0,
            _ => Version::V2_1,
        }
    }

    /// Returns whether several encoders answer one request, each with its own response.
    pub const fn is_multi_response(self) -> bool {
        matches!(
            self,
            Self::Abs40Mt
                | Self::Abs24LowMt
                | Self::Abs24HighMt
                | Self::StatusMt
                | Self::Abs17Mt
                | Self::Abs24VelMt
                | Self::Abs24VelAccMt
                | Self::Abs24StatusMt
                | Self::Abs24TempMt
        )
    }

    /// Returns whether the command takes effect only after eight requests in succession.
    pub const fn is_reset(self) -> bool {
        matches!(
            self,
            Self::ClearStatus
                | Self::ClearMultiturn
                | Self::ClearStatusMultiturn
                | Self::SetAddress1
                | Self::ZeroPreset
        )
    }

    /// How many times the request is sent: 8 for resets, otherwise 1.
    pub const fn repeats(self) -> u8 {
        if self.is_reset() { 8 } else { 1 }
    }

    /// Describes what a reset does to the encoder, for a log.
    pub const fn effect(self) -> Option<&'static str> {
        match self {
            Self::ClearStatus => Some("clears alarms"),
            Self::ClearMultiturn => Some("clears turns"),
            Self::ClearStatusMultiturn => Some("clears alarms and turns"),
            Self::SetAddress1 => Some("sets the address"),
            Self::ZeroPreset => Some("sets the single-turn zero"),
            _ => None,
        }
    }

    /// Returns whether the response comes from the encoder that the request addresses.
    ///
    /// This is not so for the multi-response commands, for those that any encoder on a one-to-one line answers (17, 19), or for
    /// those that change the address (11, 20): it is not documented whether their response shows the old or the new one.
    pub const fn answers_with_own_address(self) -> bool {
        !self.is_multi_response()
            && !matches!(self, Self::SetAddress1 | Self::IdRead2 | Self::IdWrite2 | Self::SetAddress2)
    }

    /// Returns whether the response carries neither the command code nor the four status bits, as for commands 21 and 22.
    pub const fn has_short_information(self) -> bool {
        matches!(self, Self::Abs17 | Self::Abs17Mt)
    }

    /// Returns the two layouts in which the command may be answered, that of version 2.1 first, for tools that know neither the
    /// request nor the resolution. Both are the same if there is only one.
    pub const fn layouts(self) -> [Layout; 2] {
        let only = match self {
            Self::Abs24Low | Self::Abs24LowMt => return [Layout::Abs24, Layout::Abs40Vel],
            Self::ClearStatus
            | Self::ClearMultiturn
            | Self::ClearStatusMultiturn
            | Self::SetAddress1
            | Self::ZeroPreset => return [Layout::Status, Layout::Abs24],
            Self::EepromRead | Self::EepromWrite => return [Layout::Eeprom, Layout::EepromBank],
            Self::IdRead1 | Self::IdWrite1 => return [Layout::Id, Layout::Coefficient],
            Self::Abs40 | Self::Abs40Mt => Layout::Abs40,
            Self::Abs24High | Self::Abs24HighMt => Layout::Abs24High,
            Self::Status | Self::StatusMt => Layout::Status,
            Self::Temperature => Layout::Temperature,
            Self::IdRead2 | Self::IdWrite2 | Self::SetAddress2 => Layout::Id,
            Self::Abs17 | Self::Abs17Mt => Layout::Abs17,
            Self::Abs24Vel | Self::Abs24VelMt => Layout::Abs24Vel,
            Self::Abs24VelAcc | Self::Abs24VelAccMt => Layout::Abs24VelAcc,
            Self::Abs24Status | Self::Abs24StatusMt => Layout::Abs24Status,
            Self::Abs24Temp | Self::Abs24TempMt => Layout::Abs24Temp,
        };
        [only, only]
    }
}

/// The protocol version of an encoder.
///
/// Version 3.0 adds velocity, acceleration, EEPROM banks, predictive maintenance and a second sensor unit. It is known only from
/// one vendor's driver sources; no capture of it has been published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Version {
    /// Version 2.1.
    V2_1,
    /// Version 3.0.
    V3_0,
}

impl Version {
    /// Both versions, the older one first.
    pub const ALL: [Self; 2] = [Self::V2_1, Self::V3_0];

    /// `2.1` or `3.0`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::V2_1 => "2.1",
            Self::V3_0 => "3.0",
        }
    }
}

servowire_core::one_line!(Version { version => "{}", version.name(); });

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_commands() {
        for code in 0..=255 {
            assert_eq!(Command::from_code(code).map(Command::code), (code < 31).then_some(code));
        }
        let multi = Command::ALL.into_iter().filter(|c| c.is_multi_response()).map(Command::code);
        assert!(multi.eq([4, 5, 6, 7, 22, 24, 26, 28, 30]));
        let new = Command::ALL.into_iter().filter(|c| !c.is_in(Version::V2_1)).map(Command::code);
        assert!(new.eq(23..=26));
        assert!(Command::ALL.into_iter().filter(|c| c.repeats() == 8).map(Command::code).eq(8..=12));
        assert!(Command::ALL.into_iter().filter(|c| c.effect().is_some()).map(Command::code).eq(8..=12));
        for command in Command::ALL {
            assert_eq!(command.name().ends_with("_MT"), command.is_multi_response());
        }
    }
}
