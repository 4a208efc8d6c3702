//! States of an axis, reasons for a stop, and refusals.

use crate::error::ErrorClass;
use crate::error_code::ErrorCode;
use crate::header::MacId;

/// Why an axis was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum StopReason {
    /// No block has come on time for the limit: the counter echo does not change, or is that of other periods.
    EchoTimeout,
    /// No block came on time because the blocks in this place come from the drive with this address: the axes are not
    /// listed in the order of the ring, or the drive's switches are set wrong.
    WrongMacId(MacId),
    /// No block came on time because every block was refused; carries the class of the last refusal.
    Refused(ErrorClass),
    /// The receive watchdog has tripped.
    ReceiveTimeout,
    /// Alarm = 1.
    Alarm,
    /// Servo_Ready went to 0 while the servo was commanded on.
    NotReady,
    /// Servo_Active went to 0 by itself.
    NotActive,
    /// Servo_Ready did not go to 1 in time.
    ReadyTimeout,
    /// Servo_Active did not go to 1 in time.
    ActiveTimeout,
    /// Servo_Active did not go to 0 in time, or went to 1 by itself: the drive does not obey.
    InactiveTimeout,
    /// The command was not accepted for as long as the limit; carries the last Error_Code.
    CommandError(ErrorCode),
    /// Another axis failed.
    OtherAxis {
        /// The place of that axis in the ring.
        place: u8,
    },
    /// The caller stopped the axis.
    Requested,
    /// A homing did not end in time, so the axis was stopped.
    HomingTimeout,
}

impl StopReason {
    /// Returns whether commands or responses do not get through, in which case every axis must be switched off.
    pub(super) const fn is_communication(self) -> bool {
        matches!(self, Self::EchoTimeout | Self::WrongMacId(_) | Self::Refused(_) | Self::ReceiveTimeout)
    }
}

servowire_core::one_line!(StopReason {
    Self::EchoTimeout => "no block comes on time";
    Self::WrongMacId(other) => "the blocks come from drive {}", other;
    Self::Refused(class) => "every block was refused: {}", class.name();
    Self::ReceiveTimeout => "nothing is received";
    Self::Alarm => "alarm";
    Self::NotReady => "Servo_Ready went to 0";
    Self::NotActive => "Servo_Active went to 0";
    Self::ReadyTimeout => "Servo_Ready did not come";
    Self::ActiveTimeout => "Servo_Active did not come";
    Self::InactiveTimeout => "Servo_Active did not go";
    Self::CommandError(code) => "command not accepted: {}", code;
    Self::OtherAxis { place } => "axis {} has failed", place;
    Self::Requested => "stopped by the caller";
    Self::HomingTimeout => "homing did not end in time";
});

impl core::error::Error for StopReason {}

/// State of an axis. Servo_On is 1 only in `SwitchingOn` (from the first update period that brings a position), `On`,
/// `Stopping` and `Held`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AxisState {
    /// Waiting for Servo_Ready, Servo_On = 0.
    Starting,
    /// Ready, Servo_On = 0.
    Off,
    /// Servo_On = 1, waiting for Servo_Active.
    SwitchingOn,
    /// Energised: the axis follows the set-point.
    On,
    /// Slowing down; set-points are not accepted.
    Stopping(StopReason),
    /// Energised and at rest after a stop of category 2, until [`Axis::clear`](super::Axis::clear); set-points are not
    /// accepted.
    Held(StopReason),
    /// Servo_On = 0, waiting for Servo_Active = 0.
    SwitchingOff,
    /// Servo_On = 0 until [`Axis::clear`](super::Axis::clear).
    Stopped(StopReason),
}

impl AxisState {
    /// Returns whether the axis commands Servo_On = 1.
    pub const fn is_servo_on(self) -> bool {
        matches!(self, Self::SwitchingOn | Self::On | Self::Stopping(_) | Self::Held(_))
    }
}

servowire_core::one_line!(AxisState {
    Self::Starting => "starting";
    Self::Off => "off";
    Self::SwitchingOn => "switching on";
    Self::On => "on";
    Self::Stopping(reason) => "stopping: {}", reason;
    Self::Held(reason) => "held: {}", reason;
    Self::SwitchingOff => "switching off";
    Self::Stopped(reason) => "stopped: {}", reason;
});

/// Why an axis cannot be switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SwitchOnError {
    /// The servo of the axis is not off; carries the present state.
    State(AxisState),
    /// This update period brought no position: there was no good block, or it was not on time.
    OldPosition,
    /// The drive reports an alarm.
    Alarm,
    /// Servo_Ready is 0.
    NotReady,
    /// A request is pending that changes the position or the state of the drive, or positions from before such a request may
    /// still come; or Servo_Active has not been 0 for more than a turn of the counter since the servo was last on, so that
    /// activity from before may still be reported.
    Busy,
}

servowire_core::one_line!(SwitchOnError {
    Self::State(state) => "the axis is {}", state;
    Self::OldPosition => "no new position was received in this update period";
    Self::Alarm => "the drive reports an alarm";
    Self::NotReady => "the drive is not ready";
    Self::Busy => "a request is under way that needs the servo off";
});

impl core::error::Error for SwitchOnError {}

/// An axis of a ring cannot be switched on, so no axis is switched on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RingSwitchOnError {
    /// The place of that axis in the ring.
    pub place: u8,
    /// Why.
    pub error: SwitchOnError,
}

servowire_core::one_line!(RingSwitchOnError { Self { place, error } => "axis {}: {}", place, error; });

impl core::error::Error for RingSwitchOnError {}

/// Why an axis does not accept a set-point or a mode; it keeps the previous one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum SetpointError {
    /// The axis is not on.
    #[error("the axis is not on")]
    NotOn,
    /// The axis is in another mode.
    #[error("the axis is in another mode")]
    Mode,
    /// The step exceeds 400 M pulses per second after the electronic gear, or the over-speed level: the drive would raise
    /// Err27.4.
    #[error("a step of {step} command units is too large")]
    Step {
        /// Wrapping difference from the previous command position.
        step: i32,
    },
    /// The speed or torque exceeds the limit of the configuration.
    #[error("{rate} exceeds the limit of the axis")]
    Rate {
        /// The value requested.
        rate: i32,
    },
    /// A profile motion or a request is in progress.
    #[error("a profile motion or a request is under way")]
    Busy,
    /// The axis is not at rest, or its position is not known: its mode is not changed with the servo on.
    #[error("the axis does not stand")]
    NotStanding,
}

/// Why an axis does not send a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum AskError {
    /// Another request or a profile motion is in progress, or its last echoes are still due.
    #[error("another request or a profile motion is under way")]
    Busy,
    /// This is not a request: the normal command has no answer, and a profile motion must be started with
    /// [`Axis::start_move`](super::Axis::start_move).
    #[error("no request that is answered")]
    NotARequest,
    /// The request is a reset or sets a position, and the servo is on: the drive would lose its state, or the set-point would
    /// stay in the old coordinates and jump. In CP this includes any homing type whose meaning is not known.
    #[error("not while the servo is on")]
    ServoOn,
}
