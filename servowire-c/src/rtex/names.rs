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

/// Where an axis stands.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_axis_code_t {
    /// Its drive has not answered yet.
    SW_RTEX_STARTING = 0,
    /// Servo off.
    SW_RTEX_OFF = 1,
    /// Servo_On is sent, Servo_Active has not come yet.
    SW_RTEX_SWITCHING_ON = 2,
    /// Servo on.
    SW_RTEX_ON = 3,
    /// Slows down; there is a reason.
    SW_RTEX_STOPPING = 4,
    /// Stands with the servo on; there is a reason.
    SW_RTEX_HELD = 5,
    /// Servo_On is 0, Servo_Active has not gone yet.
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
    /// Servo_Ready did not come.
    SW_RTEX_READY_TIMEOUT = 8,
    /// Servo_Active did not come.
    SW_RTEX_ACTIVE_TIMEOUT = 9,
    /// Servo_Active did not go.
    SW_RTEX_INACTIVE_TIMEOUT = 10,
    /// The drive does not accept the command; the detail is its error code.
    SW_RTEX_COMMAND_ERROR = 11,
    /// Another axis has failed; the detail is its place.
    SW_RTEX_OTHER_AXIS = 12,
    /// It was asked to.
    SW_RTEX_REQUESTED = 13,
    /// Homing did not end in time.
    SW_RTEX_HOMING_TIMEOUT = 14,
    /// Another reason, of a later release.
    SW_RTEX_OTHER_REASON = 255,
}

/// Refusals of RTEX, in the order of their numbers; the last two are of axes.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_rtex_error_t {
    /// The block is too short.
    SW_E_RTEX_TRUNCATED = -0x401,
    /// The block is too long.
    SW_E_RTEX_TOO_LONG = -0x402,
    /// A command where a response is due, or the other way round.
    SW_E_RTEX_DIRECTION = -0x403,
    /// Another MAC-ID.
    SW_E_RTEX_MAC_ID = -0x404,
    /// There is no such cyclic code.
    SW_E_RTEX_CYCLIC_CODE = -0x405,
    /// There is no such non-cyclic code.
    SW_E_RTEX_NON_CYCLIC_CODE = -0x406,
    /// Sub_Chk is wrong.
    SW_E_RTEX_SUB_CHK = -0x407,
    /// There is no such sub-command.
    SW_E_RTEX_SUB_COMMAND_CODE = -0x408,
    /// The two codes do not go together.
    SW_E_RTEX_CODE_PAIR = -0x409,
    /// A reserved bit is set.
    SW_E_RTEX_RESERVED = -0x40a,
    /// The axis is in another state or mode, or its drive is not ready.
    SW_E_RTEX_NOT_NOW = -0x4f0,
    /// The step or the rate is beyond the limits of the axis; nothing has changed.
    SW_E_RTEX_TOO_FAR = -0x4f1,
}
