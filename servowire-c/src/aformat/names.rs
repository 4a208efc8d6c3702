//! Names for the numbers of A-format.

/// What a response carries.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_aformat_layout_t {
    /// 40 position bits.
    SW_AFORMAT_ABS40 = 0,
    /// Position bits 0 to 23.
    SW_AFORMAT_ABS24 = 1,
    /// Position bits 16 to 39.
    SW_AFORMAT_ABS24H = 2,
    /// Position bits 0 to 16.
    SW_AFORMAT_ABS17 = 3,
    /// ALM and PM-ALM.
    SW_AFORMAT_STATUS = 4,
    /// A word of the EEPROM.
    SW_AFORMAT_EEPROM = 5,
    /// A word of a bank of the EEPROM. Version 3.0.
    SW_AFORMAT_EEPROM_BANK = 6,
    /// Temperature.
    SW_AFORMAT_TEMP = 7,
    /// Identification code.
    SW_AFORMAT_ID = 8,
    /// Velocity coefficient. Version 3.0.
    SW_AFORMAT_VELCOEF = 9,
    /// ABS24 and ALM.
    SW_AFORMAT_ABS24_ALM = 10,
    /// ABS24 and temperature.
    SW_AFORMAT_ABS24_TEMP = 11,
    /// ABS24 and velocity. Version 3.0.
    SW_AFORMAT_ABS24_VEL = 12,
    /// ABS24, velocity and acceleration. Version 3.0.
    SW_AFORMAT_ABS24_VEL_ACC = 13,
    /// ABS40 and velocity. Version 3.0.
    SW_AFORMAT_ABS40_VEL = 14,
}

/// Bits of the encoder status ES.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_aformat_es_t {
    /// The encoder is busy.
    SW_AFORMAT_ES_BUSY = 1,
    /// Battery.
    SW_AFORMAT_ES_BATT = 2,
    /// Warning.
    SW_AFORMAT_ES_WARNING = 4,
    /// Error.
    SW_AFORMAT_ES_ERROR = 8,
}

/// Factory settings of an encoder that version 3.0 leaves open; may be added.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_aformat_option_t {
    /// The encoder speaks version 3.0, not 2.1.
    SW_AFORMAT_VERSION_3_0 = 1,
    /// Commands for the lower 24 bits are answered with velocity.
    SW_AFORMAT_VELOCITY_IN_LOW = 2,
    /// Resets are answered with the position.
    SW_AFORMAT_POSITION_IN_RESETS = 4,
}

/// Refusals of A-format, in the order of their numbers.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_aformat_error_t {
    /// The response is too short.
    SW_E_AFORMAT_TRUNCATED = -0x201,
    /// A start bit reads 1.
    SW_E_AFORMAT_START_BIT = -0x202,
    /// A delimiter reads 0.
    SW_E_AFORMAT_DELIMITER = -0x203,
    /// The CRC-8 of a response is wrong.
    SW_E_AFORMAT_CRC = -0x204,
    /// The CRC-3 of a request is wrong.
    SW_E_AFORMAT_CRC3 = -0x205,
    /// The sync code is wrong.
    SW_E_AFORMAT_SYNC_CODE = -0x206,
    /// The fixed bit reads 1.
    SW_E_AFORMAT_FIXED_BIT = -0x207,
    /// Another address answers.
    SW_E_AFORMAT_ADDRESS_MISMATCH = -0x208,
    /// Another command is answered.
    SW_E_AFORMAT_COMMAND_MISMATCH = -0x209,
    /// The bank does not exist.
    SW_E_AFORMAT_BANK_ERROR = -0x20a,
    /// An argument was returned with a different value.
    SW_E_AFORMAT_ECHO_MISMATCH = -0x20b,
    /// The frame code is wrong.
    SW_E_AFORMAT_FRAME_CODE = -0x20c,
    /// The command does not exist.
    SW_E_AFORMAT_UNKNOWN_COMMAND = -0x20d,
    /// The encoder's version does not have this.
    SW_E_AFORMAT_UNSUPPORTED_IN_VERSION = -0x20e,
    /// An address is out of its range.
    SW_E_AFORMAT_ADDRESS_RANGE = -0x20f,
    /// Data is out of its range.
    SW_E_AFORMAT_DATA_RANGE = -0x210,
    /// No response came in time.
    SW_E_AFORMAT_NO_RESPONSE = -0x211,
    /// The encoder stayed busy.
    SW_E_AFORMAT_BUSY = -0x212,
    /// Another request came in between.
    SW_E_AFORMAT_INTERRUPTED = -0x213,
    /// It is not known whether the act was done.
    SW_E_AFORMAT_EFFECT_UNKNOWN = -0x214,
    /// The act was not done.
    SW_E_AFORMAT_NOT_DONE = -0x215,
    /// The encoder reports a fault of its memory.
    SW_E_AFORMAT_MEMORY_FAULT = -0x216,
    /// A request does not carry this.
    SW_E_AFORMAT_NOT_CARRIED = -0x218,
    /// Two sound responses in one block.
    SW_E_AFORMAT_TWO_RESPONSES = -0x21a,
    /// The settings of the line leave no time for a response.
    SW_E_AFORMAT_LINE = -0x21b,
}

/// Alarms of ALM, bit by bit as the specification names them; sw_aformat_known_alarms() says which of them
/// a version has.
#[repr(u16)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_aformat_alm_t {
    /// BATT.
    SW_AFORMAT_ALM_BATT = 1 << 0,
    /// MTERR.
    SW_AFORMAT_ALM_MT_ERR = 1 << 1,
    /// OVFLOW.
    SW_AFORMAT_ALM_OV_FLOW = 1 << 2,
    /// OVSPD.
    SW_AFORMAT_ALM_OV_SPD = 1 << 3,
    /// MEMERR.
    SW_AFORMAT_ALM_MEM_ERR = 1 << 4,
    /// STERR.
    SW_AFORMAT_ALM_ST_ERR = 1 << 5,
    /// PSERR.
    SW_AFORMAT_ALM_PS_ERR = 1 << 6,
    /// BUSY.
    SW_AFORMAT_ALM_BUSY_ALARM = 1 << 7,
    /// MEMBUSY.
    SW_AFORMAT_ALM_MEM_BUSY = 1 << 8,
    /// OVTEMP.
    SW_AFORMAT_ALM_OV_TEMP = 1 << 9,
    /// INCERR.
    SW_AFORMAT_ALM_INC_ERR = 1 << 10,
    /// OVSPD_S.
    SW_AFORMAT_ALM_OV_SPD_S = 1 << 11,
    /// STERR_S.
    SW_AFORMAT_ALM_ST_ERR_S = 1 << 12,
    /// PSERR_S.
    SW_AFORMAT_ALM_PS_ERR_S = 1 << 13,
    /// BUSY_S.
    SW_AFORMAT_ALM_BUSY_S = 1 << 14,
    /// INCERR_S.
    SW_AFORMAT_ALM_INC_ERR_S = 1 << 15,
}
