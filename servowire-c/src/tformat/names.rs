//! Names for the numbers of T-Format.

/// Data IDs (TIDM-1011, table 2-4).
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_id_t {
    /// ABS.
    SW_TFORMAT_READ_SINGLE_TURN = 0x0,
    /// ABM.
    SW_TFORMAT_READ_MULTI_TURN = 0x1,
    /// ENID.
    SW_TFORMAT_READ_ENCODER_ID = 0x2,
    /// ABS, ENID, ABM and ALMC.
    SW_TFORMAT_READ_ALL = 0x3,
    /// Writes a byte to the EEPROM.
    SW_TFORMAT_WRITE_EEPROM = 0x6,
    /// Clears errors; has to be sent ten times.
    SW_TFORMAT_RESET_ERRORS = 0x7,
    /// Makes this position the zero of the turn; has to be sent ten times. Shifts the commutation angle.
    SW_TFORMAT_SET_SINGLE_TURN_ZERO = 0x8,
    /// Clears turns and errors; has to be sent ten times. The machine loses its multi-turn reference.
    SW_TFORMAT_RESET_TURNS_AND_ERRORS = 0xc,
    /// Reads a byte of the EEPROM.
    SW_TFORMAT_READ_EEPROM = 0xd,
}

/// Bits of the status field SF.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_sf_t {
    /// Counting error.
    SW_TFORMAT_SF_EA0 = 0x10,
    /// Over-heat, multi-turn error, battery error or battery alarm.
    SW_TFORMAT_SF_EA1 = 0x20,
    /// The request had a parity error.
    SW_TFORMAT_SF_CA0 = 0x40,
    /// The request had a delimiter error.
    SW_TFORMAT_SF_CA1 = 0x80,
}

/// Bits of the error byte ALMC.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_almc_t {
    /// Over-speed.
    SW_TFORMAT_ALMC_OS = 0x01,
    /// Full absolute status: the single-turn accuracy is not yet guaranteed.
    SW_TFORMAT_ALMC_FS = 0x02,
    /// Counting error.
    SW_TFORMAT_ALMC_CE = 0x04,
    /// Overflow of the multi-turn counter.
    SW_TFORMAT_ALMC_OF = 0x08,
    /// Over-heat.
    SW_TFORMAT_ALMC_OH = 0x10,
    /// Multi-turn error.
    SW_TFORMAT_ALMC_ME = 0x20,
    /// Battery error; the turns cannot be trusted.
    SW_TFORMAT_ALMC_BE = 0x40,
    /// Battery alarm: the voltage is low.
    SW_TFORMAT_ALMC_BA = 0x80,
}

/// Bits of the address field ADF.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_adf_t {
    /// The address, 0..126; 127 is the page register.
    SW_TFORMAT_ADF_ADDRESS = 0x7f,
    /// The memory is busy.
    SW_TFORMAT_ADF_BUSY = 0x80,
}

/// Properties that the widths of an encoder leave open, for sw_tformat_set_resolution(); may be added.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_turns_t {
    /// Turns count from 0 up; otherwise they are two's complement.
    SW_TFORMAT_UNSIGNED_TURNS = 1,
    /// Bits above the widths are cut off; otherwise a position that has such bits is in doubt.
    SW_TFORMAT_UPPER_BITS_IGNORED = 2,
}

/// The bit of a byte that holds the first bit of the line.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_bit_order_t {
    /// In bit 0.
    SW_LSB_FIRST = 0,
    /// In bit 7.
    SW_MSB_FIRST = 1,
}

/// Why a position must not be used.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_doubt_t {
    /// It may be used.
    SW_TFORMAT_NO_DOUBT = 0,
    /// Nothing has been heard yet.
    SW_TFORMAT_DOUBT_NEVER = 1,
    /// It is too old.
    SW_TFORMAT_DOUBT_OLD = 2,
    /// The response carries no such position.
    SW_TFORMAT_DOUBT_ABSENT = 3,
    /// Information bits of SF are set: the fields are not where they should be.
    SW_TFORMAT_DOUBT_SHIFTED = 4,
    /// CA0 or CA1: the request was damaged.
    SW_TFORMAT_DOUBT_REQUEST_DAMAGED = 5,
    /// ENID names an encoder with other widths.
    SW_TFORMAT_DOUBT_OTHER_ENCODER = 6,
    /// Bits above the width are set.
    SW_TFORMAT_DOUBT_UPPER_BITS = 7,
    /// ALMC reports something that is not tolerated.
    SW_TFORMAT_DOUBT_ALARMS = 8,
    /// SF reports something that is not tolerated.
    SW_TFORMAT_DOUBT_STATUS = 9,
    /// Another reason, added in a later release.
    SW_TFORMAT_DOUBT_OTHER = 255,
}

/// Refusals of T-Format, in the order of their numbers. Fields count from 0, the control field.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_tformat_error_t {
    /// A start bit reads 1.
    SW_E_TFORMAT_START_BIT = -0x101,
    /// A delimiter reads 0.
    SW_E_TFORMAT_DELIMITER = -0x102,
    /// The frame is too short.
    SW_E_TFORMAT_TRUNCATED = -0x103,
    /// The sink code is not 0, 1, 0.
    SW_E_TFORMAT_SINK_CODE = -0x104,
    /// The parity of the control field is odd.
    SW_E_TFORMAT_PARITY = -0x105,
    /// The data ID is not one of the nine documented ones.
    SW_E_TFORMAT_UNKNOWN_DATA_ID = -0x106,
    /// The response answers another data ID.
    SW_E_TFORMAT_CF_MISMATCH = -0x107,
    /// The encoder refused the request.
    SW_E_TFORMAT_REJECTED = -0x108,
    /// The check field is wrong.
    SW_E_TFORMAT_CRC = -0x109,
    /// The response is for another EEPROM address.
    SW_E_TFORMAT_ADDRESS_MISMATCH = -0x10a,
    /// The data byte differs from the one written.
    SW_E_TFORMAT_DATA_MISMATCH = -0x10b,
    /// The request did not come back as sent.
    SW_E_TFORMAT_ECHO_MISMATCH = -0x10c,
    /// No response came in time.
    SW_E_TFORMAT_NO_RESPONSE = -0x10d,
    /// The EEPROM stayed busy.
    SW_E_TFORMAT_BUSY = -0x10e,
    /// The act was not done: reading back shows it.
    SW_E_TFORMAT_NOT_DONE = -0x10f,
    /// Whether the act was done is not known: read back before trying again.
    SW_E_TFORMAT_EFFECT_UNKNOWN = -0x110,
    /// A data field has bits above the width of the encoder.
    SW_E_TFORMAT_UPPER_BITS = -0x111,
    /// Two sound responses in one block.
    SW_E_TFORMAT_TWO_RESPONSES = -0x113,
    /// The settings of the line leave no time for a response.
    SW_E_TFORMAT_LINE = -0x114,
}
