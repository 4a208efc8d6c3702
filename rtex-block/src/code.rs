use core::fmt;

use crate::error::Error;
use crate::error_code::ErrorCode;

servowire_core::codes! {
    /// Cyclic command code, bits 6-4 of byte 1: what bytes 4-7 of a command mean.
    ///
    /// SX-DSV02310, "Command code list". Codes 5 to 7 are not defined.
    pub enum CyclicCode: u8 {
        /// 0: no operation. The drive keeps acting on the previous command and **ignores Control_Bits**, so a NOP
        /// switches a servo neither on nor off.
        Nop = 0 => "NOP",
        /// 1: profile position (PP); bytes 4-7 are Target_Position, command units.
        ProfilePosition = 1 => "PP",
        /// 2: cyclic position (CP); bytes 4-7 are Command_Position, command units, absolute.
        CyclicPosition = 2 => "CP",
        /// 3: cyclic velocity (CV); bytes 4-7 are Command_Speed, unit by Pr7.25.
        CyclicVelocity = 3 => "CV",
        /// 4: cyclic torque or thrust (CT); bytes 4-7 are Command_Torque, 0.1 % of rated.
        CyclicTorque = 4 => "CT",
    }
}

servowire_core::codes! {
    /// Non-cyclic command code, bits 3-0 of byte 1: what bytes 8-15 mean. The names are the vendor's, in lower case.
    ///
    /// SX-DSV02310, "Command code list". Codes 3, 8, 9 and Bh to Fh are not defined.
    pub enum NonCyclicCode: u8 {
        /// 0h: normal.
        Normal = 0 => "normal",
        /// 1h: reset.
        Reset = 1 => "reset",
        /// 2h: system ID.
        SystemId = 2 => "system ID",
        /// 4h: homing, position setting, latch.
        Homing = 4 => "homing",
        /// 5h: alarm.
        Alarm = 5 => "alarm",
        /// 6h: parameter.
        Parameter = 6 => "parameter",
        /// 7h: profile; only with [`CyclicCode::ProfilePosition`].
        Profile = 7 => "profile",
        /// Ah: monitor.
        Monitor = 10 => "monitor",
    }
}

/// Both codes of a byte 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Codes {
    /// The meaning of bytes 4-7.
    pub cyclic: CyclicCode,
    /// The meaning of bytes 8-15.
    pub noncyclic: NonCyclicCode,
}

servowire_core::one_line!(Codes { Self { cyclic, noncyclic } => "{} {}", cyclic.name(), noncyclic.name(); });

servowire_core::number! {
    /// Bits 6-0 of byte 1, defined or not: a drive echoes an undefined code unchanged.
    ///
    /// ```text
    ///    7      6    5    4    3    2    1    0
    /// ┌──────┬──────────────┬───────────────────┐
    /// │  *   │    cyclic    │    non-cyclic     │   * TMG_CNT in a command, CMD_Error in a response
    /// └──────┴──────────────┴───────────────────┘
    /// ```
    pub struct Code(u8, 7);
}

impl Code {
    /// 00h, the NOP command.
    pub const NOP: Self = Self::truncate(0x00);
    /// 10h, profile position, idle.
    pub const PROFILE_IDLE: Self = Self::truncate(0x10);
    /// 17h, profile position, start.
    pub const PROFILE_START: Self = Self::truncate(0x17);
    /// 20h, cyclic position.
    pub const CYCLIC_POSITION: Self = Self::truncate(0x20);

    /// Creates the code of a pair.
    pub const fn of(cyclic: CyclicCode, noncyclic: NonCyclicCode) -> Self {
        Self::truncate((cyclic as u8) << 4 | noncyclic as u8)
    }

    /// Bits 6-4, 0..=7.
    pub const fn cyclic_bits(self) -> u8 {
        self.get() >> 4
    }

    /// Bits 3-0, 0..=15.
    pub const fn noncyclic_bits(self) -> u8 {
        self.get() & 15
    }

    /// The cyclic code; `None` if it is not defined.
    pub const fn cyclic(self) -> Option<CyclicCode> {
        CyclicCode::from_code(self.cyclic_bits())
    }

    /// The non-cyclic code; `None` if it is not defined.
    pub const fn noncyclic(self) -> Option<NonCyclicCode> {
        NonCyclicCode::from_code(self.noncyclic_bits())
    }

    /// Both codes.
    ///
    /// # Errors
    /// [`Error::CyclicCode`] before [`Error::NonCyclicCode`].
    pub const fn codes(self) -> Result<Codes, Error> {
        let Some(cyclic) = self.cyclic() else { return Err(Error::CyclicCode { code: self.cyclic_bits() }) };
        let Some(noncyclic) = self.noncyclic() else {
            return Err(Error::NonCyclicCode { code: self.noncyclic_bits() });
        };
        Ok(Codes { cyclic, noncyclic })
    }

    /// Shows the names of both codes with the number, `CP monitor (2Ah)`.
    pub(crate) fn write(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cyclic = self.cyclic().map_or("undefined", CyclicCode::name);
        let noncyclic = self.noncyclic().map_or("undefined", NonCyclicCode::name);
        write!(f, "{cyclic} {noncyclic} ({:02X}h)", self.get())
    }

    /// Returns what a drive reports for an undefined code: 0021h before 0022h; `None` if both are defined.
    pub const fn error_code(self) -> Option<ErrorCode> {
        match self.codes() {
            Err(Error::CyclicCode { .. }) => Some(ErrorCode::CYCLIC_CODE),
            Err(_) => Some(ErrorCode::NON_CYCLIC_CODE),
            Ok(_) => None,
        }
    }

    /// Returns whether both codes are defined and may be combined.
    ///
    /// It is certain that alarm cannot be combined with NOP, and profile only with PP. For the rest, the marks in the vendor's
    /// mode tables were unreadable, so this is a working rule: with NOP only 00h is allowed, with the other cyclic codes every
    /// defined code.
    pub const fn is_allowed(self) -> bool {
        match self.codes() {
            Ok(Codes { cyclic: CyclicCode::Nop, noncyclic }) => matches!(noncyclic, NonCyclicCode::Normal),
            Ok(Codes { cyclic, noncyclic: NonCyclicCode::Profile }) => matches!(cyclic, CyclicCode::ProfilePosition),
            Ok(_) => true,
            Err(_) => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The code table of SX-DSV02310: defined cyclic codes 0-4, non-cyclic 0-2, 4-7, Ah.
    #[test]
    fn every_byte_1() {
        for byte in 0..=255u8 {
            let code = Code::truncate(byte);
            let (high, low) = (byte >> 4 & 7, byte & 15);
            assert_eq!(code.cyclic().is_some(), high <= 4);
            assert_eq!(code.noncyclic().is_some(), [0, 1, 2, 4, 5, 6, 7, 10].contains(&low));
            match code.codes() {
                Ok(Codes { cyclic, noncyclic }) => assert_eq!(Code::of(cyclic, noncyclic).get(), byte & 0x7f),
                Err(Error::CyclicCode { code }) => assert_eq!((code, high > 4), (high, true)),
                Err(e) => assert_eq!((e, high <= 4), (Error::NonCyclicCode { code: low }, true)),
            }
        }
    }

    #[test]
    fn allowed_pairs() {
        let allowed: std::vec::Vec<u8> = (0..0x80).filter(|&c| Code::truncate(c).is_allowed()).collect();
        // NOP alone; eight codes with PP; seven with each of CP, CV, CT.
        assert_eq!(allowed.len(), 1 + 8 + 3 * 7);
        for code in [0x00, 0x10, 0x17, 0x20, 0x25, 0x2a, 0x30, 0x40] {
            assert!(allowed.contains(&code), "{code:02x}");
        }
        for code in [0x05, 0x07, 0x27, 0x37, 0x47] {
            assert!(!allowed.contains(&code), "{code:02x}");
        }
    }
}
