use core::fmt;

/// Error_Code of an error answer (bytes 8-9), or Sub_Error_Code (bytes 18-19).
///
/// The vendor's complete list (section 6-10-2) could not be read, so any number is accepted; the constants are the codes
/// whose meaning is confirmed by SX-DSV02310, "Command error".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(transparent))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct ErrorCode(pub u16);

impl ErrorCode {
    /// 0011h: MAC-ID of the command is not the drive's; Err86.0 if it lasts.
    pub const MAC_ID: Self = Self(0x0011);
    /// 0012h: C/R is 1 in a command, or (in the sub block) Sub_Chk is 0; Err86.0 if it lasts.
    pub const DIRECTION: Self = Self(0x0012);
    /// 0021h: cyclic code not defined; Err86.1 if it lasts.
    pub const CYCLIC_CODE: Self = Self(0x0021);
    /// 0022h: non-cyclic code (or sub-command code) not defined.
    pub const NON_CYCLIC_CODE: Self = Self(0x0022);
    /// 002Eh: cyclic command not possible in the drive's present mode (the number is inferred); Err91.1 if it lasts.
    pub const CYCLIC_MODE: Self = Self(0x002e);
    /// 0031h: type code not known.
    pub const TYPE_CODE: Self = Self(0x0031);
    /// 0032h: argument out of range: the index, or Command_Data3 not 0 while Pr7.35 is 0.
    pub const ARGUMENT: Self = Self(0x0032);
    /// 0034h: feed-forward value out of range; the drive keeps the old one.
    pub const FEED_FORWARD: Self = Self(0x0034);

    /// Returns whether the drive has discarded the whole block and continues with the previous one: this is so for 0011h, 0012h
    /// and 0021h. Then no request in the block was refused for its contents. SX-DSV02310, "Command error".
    pub const fn discards_block(self) -> bool {
        matches!(self, Self::MAC_ID | Self::DIRECTION | Self::CYCLIC_CODE)
    }

    /// Returns the meaning of the number; `None` if it is not confirmed.
    const fn meaning(self) -> Option<&'static str> {
        Some(match self {
            Self::MAC_ID => "MAC-ID is not the drive's",
            Self::DIRECTION => "C/R or Sub_Chk wrong",
            Self::CYCLIC_CODE => "cyclic code not defined",
            Self::NON_CYCLIC_CODE => "non-cyclic code not defined",
            Self::CYCLIC_MODE => "cyclic command not possible in this mode",
            Self::TYPE_CODE => "type code not known",
            Self::ARGUMENT => "index or data out of range",
            Self::FEED_FORWARD => "feed-forward out of range",
            _ => return None,
        })
    }
}

impl fmt::Display for ErrorCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04X}h", self.0)?;
        match self.meaning() {
            Some(meaning) => write!(f, " ({meaning})"),
            None => Ok(()),
        }
    }
}

/// An alarm number, displayed as on the drive: main code, point, sub code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Alarm {
    /// Main code, byte 12 of the answer to an alarm command.
    pub main: u8,
    /// Sub code, byte 13.
    pub sub: u8,
}

impl Alarm {
    /// Err27.4: the position command makes too large a step.
    pub const COMMAND_STEP: Self = Self { main: 27, sub: 4 };
    /// Err86.0: MAC-ID, C/R or Sub_Chk of the received data stay wrong.
    pub const CYCLIC_DATA: Self = Self { main: 86, sub: 0 };
    /// Err86.1: the cyclic code stays undefined.
    pub const CYCLIC_CODE: Self = Self { main: 86, sub: 1 };
    /// Err86.2: the Update_Counter does not count correctly.
    pub const UPDATE_COUNTER: Self = Self { main: 86, sub: 2 };
    /// Err91.1: cyclic command error other than an undefined code.
    pub const COMMAND: Self = Self { main: 91, sub: 1 };

    /// The meaning, if a public document confirms it.
    pub const fn meaning(self) -> Option<&'static str> {
        match self {
            Self::COMMAND_STEP => Some("too large a step of the position command"),
            Self::CYCLIC_DATA => Some("MAC-ID, C/R or Sub_Chk of the commands stayed wrong"),
            Self::CYCLIC_CODE => Some("the cyclic code stayed undefined"),
            Self::UPDATE_COUNTER => Some("the Update_Counter did not count"),
            Self::COMMAND => Some("cyclic command not possible in this mode"),
            _ => None,
        }
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Err{}.{}", self.main, self.sub)
    }
}
