//! Names for the numbers of RTEX.

/// Cyclic codes, which are the control modes.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_mode_t {
    /// Nothing.
    SW_RTEX_NOP = 0,
    /// Profile position.
    SW_RTEX_PP = 1,
    /// Cyclic position.
    SW_RTEX_CP = 2,
    /// Cyclic velocity.
    SW_RTEX_CV = 3,
    /// Cyclic torque.
    SW_RTEX_CT = 4,
}

/// Control bits of a command, bytes 2 and 3.
#[repr(u16)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_control_t {
    /// Homing_Ctrl.
    SW_RTEX_HOMING_CTRL = 1 << 2,
    /// TL_SW: first or second torque limit.
    SW_RTEX_TL_SW = 1 << 3,
    /// Gain_SW: first or second gain.
    SW_RTEX_GAIN_SW = 1 << 4,
    /// Servo_On. An axis sets it by itself.
    SW_RTEX_SERVO_ON = 1 << 7,
    /// EX-OUT1.
    SW_RTEX_EX_OUT1 = 1 << 8,
    /// EX-OUT2.
    SW_RTEX_EX_OUT2 = 1 << 9,
    /// SL_SW.
    SW_RTEX_SL_SW = 1 << 11,
    /// Pause.
    SW_RTEX_PAUSE = 1 << 13,
    /// Smooth_Stop.
    SW_RTEX_SMOOTH_STOP = 1 << 14,
    /// Hard_Stop.
    SW_RTEX_HARD_STOP = 1 << 15,
}

/// Status flags of a response, bytes 2 and 3.
#[repr(u16)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_status_t {
    /// In_Position.
    SW_RTEX_IN_POSITION = 1 << 0,
    /// In_Progress.
    SW_RTEX_IN_PROGRESS = 1 << 1,
    /// Homing_Complete.
    SW_RTEX_HOMING_COMPLETE = 1 << 2,
    /// Torque_Limited.
    SW_RTEX_TORQUE_LIMITED = 1 << 3,
    /// Warning.
    SW_RTEX_WARNING = 1 << 4,
    /// Alarm.
    SW_RTEX_ALARM_FLAG = 1 << 5,
    /// Servo_Ready.
    SW_RTEX_SERVO_READY = 1 << 6,
    /// Servo_Active: the motor is energised.
    SW_RTEX_SERVO_ACTIVE = 1 << 7,
    /// NOT.
    SW_RTEX_NOT = 1 << 8,
    /// POT.
    SW_RTEX_POT = 1 << 9,
    /// HOME.
    SW_RTEX_HOME = 1 << 10,
    /// SI-MON1.
    SW_RTEX_SI_MON1 = 1 << 11,
    /// SI-MON2.
    SW_RTEX_SI_MON2 = 1 << 12,
    /// SI-MON3.
    SW_RTEX_SI_MON3 = 1 << 13,
    /// SI-MON4.
    SW_RTEX_SI_MON4 = 1 << 14,
    /// SI-MON5.
    SW_RTEX_SI_MON5 = 1 << 15,
}

/// The states of an axis.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_axis_code_t {
    /// Its drive has not answered yet.
    SW_RTEX_STARTING = 0,
    /// Servo off.
    SW_RTEX_OFF = 1,
    /// Servo_On is 1, and Servo_Active is not 1 yet.
    SW_RTEX_SWITCHING_ON = 2,
    /// Servo on.
    SW_RTEX_ON = 3,
    /// Slows down, for a reason.
    SW_RTEX_STOPPING = 4,
    /// At rest with the servo on, for a reason.
    SW_RTEX_HELD = 5,
    /// Servo_On is 0, and Servo_Active is not 0 yet.
    SW_RTEX_SWITCHING_OFF = 6,
    /// Servo off for a reason.
    SW_RTEX_STOPPED = 7,
}

/// Why an axis stops.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_reason_t {
    /// It does not.
    SW_RTEX_NO_REASON = 0,
    /// No new echo.
    SW_RTEX_ECHO_TIMEOUT = 1,
    /// Another drive answers; the detail is its MAC-ID.
    SW_RTEX_WRONG_MAC_ID = 2,
    /// Blocks were refused; the detail is the number of the class.
    SW_RTEX_REFUSED = 3,
    /// No block.
    SW_RTEX_RECEIVE_TIMEOUT = 4,
    /// The drive reports an alarm.
    SW_RTEX_ALARM = 5,
    /// Servo_Ready went to 0.
    SW_RTEX_NOT_READY = 6,
    /// Servo_Active went to 0.
    SW_RTEX_NOT_ACTIVE = 7,
    /// Servo_Ready did not go to 1 in time.
    SW_RTEX_READY_TIMEOUT = 8,
    /// Servo_Active did not go to 1 in time.
    SW_RTEX_ACTIVE_TIMEOUT = 9,
    /// Servo_Active did not go to 0 in time.
    SW_RTEX_INACTIVE_TIMEOUT = 10,
    /// The drive does not accept the command; the detail is its error code.
    SW_RTEX_COMMAND_ERROR = 11,
    /// Another axis has failed; the detail is its place.
    SW_RTEX_OTHER_AXIS = 12,
    /// It was requested.
    SW_RTEX_REQUESTED = 13,
    /// Homing did not end in time.
    SW_RTEX_HOMING_TIMEOUT = 14,
    /// Another reason, added in a later release.
    SW_RTEX_OTHER_REASON = 255,
}

/// Refusals of RTEX, in the order of their numbers; from -0x4f0 onwards, those of axes and procedures.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_error_t {
    /// The block is too short.
    SW_E_RTEX_TRUNCATED = -0x401,
    /// The block is too long.
    SW_E_RTEX_TOO_LONG = -0x402,
    /// A command in place of a response, or the other way round.
    SW_E_RTEX_DIRECTION = -0x403,
    /// Another MAC-ID.
    SW_E_RTEX_MAC_ID = -0x404,
    /// The cyclic code is not defined.
    SW_E_RTEX_CYCLIC_CODE = -0x405,
    /// The non-cyclic code is not defined.
    SW_E_RTEX_NON_CYCLIC_CODE = -0x406,
    /// Sub_Chk is wrong.
    SW_E_RTEX_SUB_CHK = -0x407,
    /// The sub-command is not defined.
    SW_E_RTEX_SUB_COMMAND_CODE = -0x408,
    /// The two codes must not be used together.
    SW_E_RTEX_CODE_PAIR = -0x409,
    /// A reserved bit is set.
    SW_E_RTEX_RESERVED = -0x40a,
    /// The axis is in another state or mode, or its drive is not ready.
    SW_E_RTEX_NOT_NOW = -0x4f0,
    /// The step or the rate is beyond the limits of the axis; nothing has changed.
    SW_E_RTEX_TOO_FAR = -0x4f1,
    /// ERR: the command was accepted but failed during execution.
    SW_E_RTEX_EXECUTION = -0x4f2,
    /// CMD_Error: the drive did not accept the command; its code is passed along.
    SW_E_RTEX_COMMAND_ERROR = -0x4f3,
    /// No answer within the limit. It is not known whether the drive has executed the command.
    SW_E_RTEX_TIMED_OUT = -0x4f4,
    /// The motion did not start within the limit. It may still start.
    SW_E_RTEX_NOT_STARTED = -0x4f5,
    /// The procedure was aborted by a stop, by servo off, or by another mode.
    SW_E_RTEX_BROKEN_OFF = -0x4f6,
}

/// Non-cyclic codes.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_noncyclic_t {
    /// Normal.
    SW_RTEX_NORMAL = 0,
    /// Reset.
    SW_RTEX_RESET = 1,
    /// System ID.
    SW_RTEX_SYSTEM_ID = 2,
    /// Homing.
    SW_RTEX_HOMING = 4,
    /// Alarm.
    SW_RTEX_ALARM_COMMAND = 5,
    /// Parameter.
    SW_RTEX_PARAMETER = 6,
    /// Profile.
    SW_RTEX_PROFILE = 7,
    /// Monitor.
    SW_RTEX_MONITOR = 10,
}

/// Execution flags of a response.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_execution_t {
    /// Still executing.
    SW_RTEX_BUSY = 1 << 4,
    /// Executed with a restriction.
    SW_RTEX_WNG = 1 << 6,
    /// Accepted, but failed during execution.
    SW_RTEX_ERR = 1 << 7,
}

/// How a response answers the previous command.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_acknowledgement_t {
    /// The drive has taken the command.
    SW_RTEX_ACCEPTED = 0,
    /// The Update_Counter is not echoed.
    SW_RTEX_COUNTER_NOT_ECHOED = 1,
    /// The code is not echoed yet.
    SW_RTEX_CODE_NOT_YET_ECHOED = 2,
    /// CMD_Error.
    SW_RTEX_NOT_ACCEPTED = 3,
}

/// The phases of the control of a ring.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_phase_t {
    /// PH_INIT.
    SW_RTEX_PH_INIT = 0,
    /// PH_WAITING.
    SW_RTEX_PH_WAITING = 1,
    /// PH_PREPARE.
    SW_RTEX_PH_PREPARE = 2,
    /// PH_START.
    SW_RTEX_PH_START = 3,
    /// PH_RUNNING.
    SW_RTEX_PH_RUNNING = 4,
}

/// The state of the communication ASIC.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_asic_t {
    /// INITIAL.
    SW_RTEX_ASIC_INITIAL = 0,
    /// RING_CONFIG.
    SW_RTEX_ASIC_RING_CONFIG = 1,
    /// READY.
    SW_RTEX_ASIC_READY = 2,
    /// RUNNING.
    SW_RTEX_ASIC_RUNNING = 3,
}

/// Why the control of a ring has stopped.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_fault_t {
    /// It has not.
    SW_RTEX_NO_FAULT = 0,
    /// The slaves differ from the table; this stays until the system is reset.
    SW_RTEX_SLAVE_INFO_MISMATCH = 1,
    /// The communication has timed out.
    SW_RTEX_TIMEOUT = 2,
}

/// What the LED of a controller shows.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_led_t {
    /// Dark.
    SW_RTEX_LED_OFF = 0,
    /// Green.
    SW_RTEX_LED_GREEN = 1,
    /// Red.
    SW_RTEX_LED_RED = 2,
}

/// Error codes of a drive, with CMD_Error.
#[repr(u16)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_drive_error_t {
    /// Another MAC-ID.
    SW_RTEX_ERROR_MAC_ID = 0x11,
    /// C/R is that of a response.
    SW_RTEX_ERROR_DIRECTION = 0x12,
    /// The cyclic code is not defined.
    SW_RTEX_ERROR_CYCLIC_CODE = 0x21,
    /// The non-cyclic code is not defined.
    SW_RTEX_ERROR_NON_CYCLIC_CODE = 0x22,
    /// The cyclic mode is not allowed now.
    SW_RTEX_ERROR_CYCLIC_MODE = 0x2e,
    /// The Type_Code is not defined.
    SW_RTEX_ERROR_TYPE_CODE = 0x31,
    /// An argument is out of range.
    SW_RTEX_ERROR_ARGUMENT = 0x32,
    /// The feed-forward data are out of range.
    SW_RTEX_ERROR_FEED_FORWARD = 0x34,
}

/// Alarms of a drive that concern the communication: main number * 256 + sub number.
#[repr(u16)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_alarm_t {
    /// Err27.4: the step of the command position is too large.
    SW_RTEX_ALARM_COMMAND_STEP = 27 << 8 | 4,
    /// Err86.0: the cyclic data are wrong.
    SW_RTEX_ALARM_CYCLIC_DATA = 86 << 8,
    /// Err86.1: the cyclic code is wrong.
    SW_RTEX_ALARM_CYCLIC_CODE = 86 << 8 | 1,
    /// Err86.2: the Update_Counter is wrong.
    SW_RTEX_ALARM_UPDATE_COUNTER = 86 << 8 | 2,
    /// Err91.1: the command is wrong.
    SW_RTEX_ALARM_COMMAND_WRONG = 91 << 8 | 1,
}

/// Bits 3 to 0 of byte 9 of a homing or profile response.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_latch_t {
    /// Latch_Comp1.
    SW_RTEX_LATCH_COMP1 = 1 << 0,
    /// Homing: Latch_Comp2.
    SW_RTEX_LATCH_COMP2 = 1 << 1,
    /// Profile: PSL.
    SW_RTEX_PSL = 1 << 3,
    /// Profile: NSL.
    SW_RTEX_NSL = 1 << 2,
}

/// Bit 1 of byte 9 of a profile response: inside the near window.
pub const SW_RTEX_NEAR: u8 = 1 << 1;

/// Type codes that public documents give, by the command they belong to.
#[repr(u16)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_type_t {
    /// Reset: software reset; system ID: vendor name; monitor: position deviation.
    SW_RTEX_TYPE_1 = 0x01,
    /// Monitor: MPOS.
    SW_RTEX_TYPE_MPOS = 0x04,
    /// Monitor: ASPD; system ID: device type.
    SW_RTEX_TYPE_5 = 0x05,
    /// Monitor: TRQ.
    SW_RTEX_TYPE_TRQ = 0x06,
    /// Monitor: APOS.
    SW_RTEX_TYPE_APOS = 0x07,
    /// Monitor: IPOS.
    SW_RTEX_TYPE_IPOS = 0x08,
    /// Monitor: LPOS1.
    SW_RTEX_TYPE_LPOS1 = 0x09,
    /// Monitor: LPOS2.
    SW_RTEX_TYPE_LPOS2 = 0x0a,
    /// Monitor: MSPD.
    SW_RTEX_TYPE_MSPD = 0x0c,
    /// Reset: attribute C; parameter: write; profile: relative positioning; monitor: regenerative load.
    SW_RTEX_TYPE_11H = 0x11,
    /// System ID: model; monitor: overload.
    SW_RTEX_TYPE_12H = 0x12,
    /// System ID: serial number.
    SW_RTEX_TYPE_SERIAL_NUMBER = 0x13,
    /// System ID: software version.
    SW_RTEX_TYPE_SOFTWARE_VERSION = 0x14,
    /// System ID: driver type.
    SW_RTEX_TYPE_DRIVER_TYPE = 0x15,
    /// Homing: set the actual position.
    SW_RTEX_TYPE_SET_ACTUAL_POSITION = 0x21,
    /// Homing: set the command position.
    SW_RTEX_TYPE_SET_COMMAND_POSITION = 0x22,
    /// System ID: vendor of the scale.
    SW_RTEX_TYPE_SCALE_VENDOR_ID = 0x31,
    /// System ID: model of the scale.
    SW_RTEX_TYPE_SCALE_MODEL_ID = 0x32,
    /// Homing: state of the latches.
    SW_RTEX_TYPE_LATCH_STATE = 0x50,
}
