//! Names for the numbers of HIPERFACE DSL.

use hdsl::{Dialect, Rule};

use crate::border::{Refused, in_range};

/// Refusals of HIPERFACE DSL.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_error_t {
    /// Fewer bits, samples or bytes than the unit has.
    SW_E_HDSL_TRUNCATED = -0x301,
    /// A 10-bit word is in neither column of the 8b/10b tables.
    SW_E_HDSL_INVALID_WORD = -0x302,
    /// A special character where only data may be, or data where a special character must be.
    SW_E_HDSL_WRONG_KIND = -0x303,
    /// The encoder has no value for this frame.
    SW_E_HDSL_ENCODER_ERROR = -0x304,
    /// The CRC-5 of the acceleration word is wrong.
    SW_E_HDSL_ACCELERATION_CRC = -0x305,
    /// The CRC-16 of a safe position or of a message is wrong.
    SW_E_HDSL_CRC = -0x306,
    /// The block is sound, but the encoder cannot deliver a position.
    SW_E_HDSL_POSITION_INVALID = -0x307,
    /// The symbol of a parameter byte has no meaning in this direction.
    SW_E_HDSL_UNDEFINED_SYMBOL = -0x308,
    /// The line stayed high: nobody answered.
    SW_E_HDSL_NO_EDGE = -0x309,
    /// The test pattern of the start-up is at none of the delays.
    SW_E_HDSL_PATTERN_NOT_FOUND = -0x30a,
    /// The answer is not the test pattern.
    SW_E_HDSL_PATTERN = -0x30b,
    /// The bits are not the beginning of an H-frame.
    SW_E_HDSL_FRAMING = -0x30c,
    /// The two copies of the encoder identifier differ.
    SW_E_HDSL_ENCODER_ID_MISMATCH = -0x30d,
    /// The identifier asks for something that this receiver does not do.
    SW_E_HDSL_UNSUPPORTED_ENCODER = -0x30e,
    /// The answer to a short message begins like a long one.
    SW_E_HDSL_LONG_MESSAGE_START = -0x30f,
    /// The answer to a long message begins like a short one.
    SW_E_HDSL_SHORT_MESSAGE_START = -0x310,
    /// A sound message concerns something else.
    SW_E_HDSL_HEADER = -0x311,
    /// The encoder answered a long message with an error: its code is in the data.
    SW_E_HDSL_RESOURCE = -0x312,
    /// The encoder did not accept the message in any of the tries.
    SW_E_HDSL_NOT_ACCEPTED = -0x313,
    /// No sound answer in time in any of the tries.
    SW_E_HDSL_NO_ANSWER = -0x314,
    /// The message was dropped by a reset or a restart of the link.
    SW_E_HDSL_DROPPED = -0x315,
    /// A message of this kind is in progress.
    SW_E_HDSL_BUSY = -0x316,
    /// The link is not up.
    SW_E_HDSL_NOT_LOCKED = -0x317,
    /// A long message carries 0, 2, 4 or 8 bytes.
    SW_E_HDSL_DATA_LENGTH = -0x318,
    /// The period is shorter than the frames that have to fit into it.
    SW_E_HDSL_PERIOD_TOO_SHORT = -0x319,
    /// No pulse period is known.
    SW_E_HDSL_NO_PULSE = -0x31b,
    /// No register has this address.
    SW_E_HDSL_NO_REGISTER = -0x31c,
    /// The EXTRA window is outside its range.
    SW_E_HDSL_EXTRA_OUT_OF_RANGE = -0x31d,
}

/// Whose rules are followed if sources differ.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_dialect_t {
    /// The manual of the link: every word of an answer has to stand in the 8b/10b tables.
    SW_HDSL_SICK = 0,
    /// The receiver of TI's Motor Control SDK: its reduced tables, its marks, its arithmetic.
    SW_HDSL_TI = 1,
}

/// Where the receiver is in its start-up.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_state_t {
    /// RESET.
    SW_HDSL_RESET = 0,
    /// SYNC.
    SW_HDSL_SYNC = 1,
    /// START.
    SW_HDSL_START = 2,
    /// LEARN.
    SW_HDSL_LEARN = 3,
    /// CHECK.
    SW_HDSL_CHECK = 4,
    /// IDREQ.
    SW_HDSL_IDREQ = 5,
    /// WAIT VSYNC.
    SW_HDSL_WAIT_VSYNC = 6,
    /// RUNNING.
    SW_HDSL_RUNNING = 7,
}

/// Why the link was restarted.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_restart_t {
    /// It was not.
    SW_HDSL_NO_RESTART = 0,
    /// A restart was requested.
    SW_HDSL_RESTART_REQUESTED = 1,
    /// A START frame: no encoder, or the test pattern is not there.
    SW_HDSL_RESTART_LEARN = 2,
    /// The test pattern came with a wrong bit.
    SW_HDSL_RESTART_PATTERN = 3,
    /// The identifier was damaged, or is of an encoder that is not supported.
    SW_HDSL_RESTART_IDENTIFIER = 4,
    /// No VSYNC in time.
    SW_HDSL_RESTART_NO_VSYNC = 5,
    /// The quality monitor has run out.
    SW_HDSL_RESTART_QUALITY = 6,
    /// Too many consecutive acceleration words could not be used.
    SW_HDSL_RESTART_ACCELERATION = 7,
    /// A reason that has no name here.
    SW_HDSL_RESTART_OTHER = 255,
}

/// How well a 10-bit word fits the running disparity.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_disparity_t {
    /// It is in the expected column.
    SW_HDSL_DISPARITY_OK = 0,
    /// It is in the other column.
    SW_HDSL_DISPARITY_WRONG = 1,
    /// It is in neither.
    SW_HDSL_DISPARITY_INVALID = 2,
}

/// What the quality monitor counts.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_quality_event_t {
    /// VSYNC in the last frame of a V-frame.
    SW_HDSL_VSYNC_OK = 0,
    /// No VSYNC there.
    SW_HDSL_VSYNC_MISSING = 1,
    /// VSYNC in one of the first seven.
    SW_HDSL_VSYNC_EARLY = 2,
    /// A sound safe channel 1.
    SW_HDSL_SAFE1_OK = 3,
    /// A damaged safe channel 1.
    SW_HDSL_SAFE1_ERROR = 4,
    /// A damaged safe channel 2.
    SW_HDSL_SAFE2_ERROR = 5,
    /// A bad word in the parameters or the pipe channel.
    SW_HDSL_PARAMETER_OR_PIPE_WORD = 6,
    /// A bad word in the process data channel.
    SW_HDSL_ACCELERATION_WORD = 7,
    /// A special character that is not known.
    SW_HDSL_UNKNOWN_SPECIAL = 8,
    /// RSSI below 2.
    SW_HDSL_LOW_RSSI = 9,
    /// STATUS2 has TEST2 set, which only SW_HDSL_TI counts.
    SW_HDSL_TEST2 = 10,
}

/// How far a fast position is aligned with the safe one; it advances once a V-frame.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_stage_t {
    /// The position is not known; the next safe position is taken over.
    SW_HDSL_STAGE_POSITION = 0,
    /// The next safe position gives the error of the velocity.
    SW_HDSL_STAGE_VELOCITY = 1,
    /// One V-frame with correct values has to pass.
    SW_HDSL_STAGE_SETTLE = 2,
    /// Aligned; every safe position is compared.
    SW_HDSL_STAGE_CHECK = 3,
}

pub(super) fn dialect(code: u8) -> Result<Dialect, Refused> {
    in_range(match code {
        0 => Some(Dialect::SICK),
        1 => Some(Dialect::TI),
        _ => None,
    })
}

/// The 8b/10b rule of a dialect.
pub(super) fn rule(code: u8) -> Result<Rule, Refused> {
    Ok(dialect(code)?.rule)
}
