use core::fmt;

/// Bits of one frame on the line, in both directions: start bit 0, 16 content bits, delimiter 1.
pub const FRAME_BITS: u32 = 18;

/// Mask of the start bits of the longest response.
pub(crate) const START: u128 = 1 | 1 << 18 | 1 << 36 | 1 << 54 | 1 << 72 | 1 << 90;
/// Mask of its delimiters.
pub(crate) const DELIMITER: u128 = START << 17;
const _: () = {
    let content = START * 0x1_fffe;
    assert!(
        START & DELIMITER == 0
            && (START | DELIMITER) & content == 0
            && START | DELIMITER | content == (1 << (18 * MAX_FRAMES)) - 1,
        "start bits, content bits and delimiters partition the longest response"
    );
};

/// Number of frames of the longest response.
pub(crate) const MAX_FRAMES: u32 = 6;

/// What a response carries between its information field and its CRC-8.
///
/// ```text
///  layout          frames  data, in the order of the line
///  ABS40              4    abs 40
///  ABS24              3    abs bits 0..=23
///  ABS24H             3    abs bits 16..=39
///  ABS17              2    abs bits 0..=16, of which 9 stand in the information field
///  STATUS             3    ALM 16, PM-ALM 8 (zero in version 2.1)
///  EEPROM             3    data 16, address 8
///  EEPROM_BANK        4    data 16, bank 8, address 8, bank error 1, 7 reserved
///  TEMP               3    temperature 10, 14 unused
///  ID                 3    identification code 24
///  VELCOEF            3    coefficient 19, 5 unused
///  ABS24_ALM          4    abs bits 0..=23, ALM 16
///  ABS24_TEMP         4    abs bits 0..=23, temperature 10, 6 unused
///  ABS24_VEL          5    abs bits 0..=23, velocity 32
///  ABS24_VEL_ACC      6    abs bits 0..=23, velocity 32, acceleration 16
///  ABS40_VEL          6    abs 40, velocity 32
/// ```
///
/// Which layout answers a request follows from the command, its frame code and, in version 3.0, the factory setting of
/// the encoder; the line does not say which. See [`Request::layout`](crate::Request::layout).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Layout {
    /// ABS40.
    Abs40,
    /// ABS24.
    Abs24,
    /// ABS24H.
    Abs24High,
    /// ABS17.
    Abs17,
    /// STATUS.
    Status,
    /// EEPROM.
    Eeprom,
    /// EEPROM_BANK. Version 3.0.
    EepromBank,
    /// TEMP.
    Temperature,
    /// ID.
    Id,
    /// VELCOEF. Version 3.0.
    Coefficient,
    /// ABS24_ALM.
    Abs24Status,
    /// ABS24_TEMP.
    Abs24Temp,
    /// ABS24_VEL. Version 3.0.
    Abs24Vel,
    /// ABS24_VEL_ACC. Version 3.0.
    Abs24VelAcc,
    /// ABS40_VEL. Version 3.0, factory option.
    Abs40Vel,
}

impl Layout {
    /// All fifteen.
    pub const ALL: [Self; 15] = [
        Self::Abs40,
        Self::Abs24,
        Self::Abs24High,
        Self::Abs17,
        Self::Status,
        Self::Eeprom,
        Self::EepromBank,
        Self::Temperature,
        Self::Id,
        Self::Coefficient,
        Self::Abs24Status,
        Self::Abs24Temp,
        Self::Abs24Vel,
        Self::Abs24VelAcc,
        Self::Abs40Vel,
    ];

    /// Number of frames of the response, 2..=6.
    pub const fn frames(self) -> u8 {
        match self {
            Self::Abs17 => 2,
            Self::Abs24
            | Self::Abs24High
            | Self::Status
            | Self::Eeprom
            | Self::Temperature
            | Self::Id
            | Self::Coefficient => 3,
            Self::Abs40 | Self::EepromBank | Self::Abs24Status | Self::Abs24Temp => 4,
            Self::Abs24Vel => 5,
            Self::Abs24VelAcc | Self::Abs40Vel => 6,
        }
    }

    /// Line bits of the response, 18 per frame.
    pub const fn line_bits(self) -> u32 {
        (self.frames() as u32).wrapping_mul(FRAME_BITS)
    }

    /// Number of position bits that the response carries from bit 0 up; 0 if it has none or only the upper ones.
    pub const fn abs_bits(self) -> u8 {
        match self {
            Self::Abs40 | Self::Abs40Vel => 40,
            Self::Abs24 | Self::Abs24Status | Self::Abs24Temp | Self::Abs24Vel | Self::Abs24VelAcc => 24,
            Self::Abs17 => 17,
            _ => 0,
        }
    }

    /// The name, as in the drawing above.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Abs40 => "ABS40",
            Self::Abs24 => "ABS24",
            Self::Abs24High => "ABS24H",
            Self::Abs17 => "ABS17",
            Self::Status => "STATUS",
            Self::Eeprom => "EEPROM",
            Self::EepromBank => "EEPROM_BANK",
            Self::Temperature => "TEMP",
            Self::Id => "ID",
            Self::Coefficient => "VELCOEF",
            Self::Abs24Status => "ABS24_ALM",
            Self::Abs24Temp => "ABS24_TEMP",
            Self::Abs24Vel => "ABS24_VEL",
            Self::Abs24VelAcc => "ABS24_VEL_ACC",
            Self::Abs40Vel => "ABS40_VEL",
        }
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
