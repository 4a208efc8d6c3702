//! The configuration of an axis.

use core::num::NonZeroU16;

use super::servo_off::ActiveCode;
use crate::header::MacId;
use crate::position::Gear;

/// Time limits, in update periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Limits {
    /// Number of update periods without a block on time that counts as a time-out.
    pub echo: NonZeroU16,
    /// From the first valid command, or from [`Axis::clear`](super::Axis::clear), to Servo_Ready. `None` unless changed,
    /// because the main power may be switched on at any time.
    pub ready: Option<u32>,
    /// From Servo_On to Servo_Active.
    pub active: u32,
    /// From Servo_On = 0 to Servo_Active = 0.
    pub inactive: u32,
    /// For the answer to a request, and for the start of a profile motion.
    pub answer: u32,
    /// For a controlled deceleration ([`StopCategory::One`] and [`Two`](StopCategory::Two)).
    pub stop: u32,
    /// Number of consecutive responses with CMD_Error, other than the answer to a request, that stop the axis. A single one
    /// may come from a damaged frame, in which case the drive keeps the previous command.
    pub command_errors: NonZeroU16,
}

impl Limits {
    /// Creates the limits: `echo` for the echo of the counter and for command errors, `wait` for every other wait. The
    /// vendor's times are not known, so there is no default.
    pub const fn new(echo: NonZeroU16, wait: u32) -> Self {
        Self { echo, ready: None, active: wait, inactive: wait, answer: wait, stop: wait, command_errors: echo }
    }

    servowire_core::builder! {
        with_ready: ready, Option<u32>;
        with_active: active, u32;
        with_inactive: inactive, u32;
        with_answer: answer, u32;
        with_stop: stop, u32;
        with_command_errors: command_errors, NonZeroU16;
    }
}

/// How an axis is stopped; the categories are those of IEC 60204-1. None of this is a safety function: if this program
/// fails to stop a motor, hardware has to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StopCategory {
    /// Servo-off in the same update period.
    Zero,
    /// Slows down, then servo-off; servo-off in any case when [`Limits::stop`] has passed. A profile motion is ended with
    /// Smooth_Stop, a torque command is removed at once, and an axis without a [deceleration](AxisConfig::deceleration) is
    /// switched off at once.
    One,
    /// Slows down as in category 1, and stays energised at rest ([`AxisState::Held`](super::AxisState::Held)).
    Two,
}

/// The configuration of an axis.
///
/// Response_Data1 must be the actual position, so Pr7.29 of the drive must be 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct AxisConfig {
    /// The drive's address.
    pub mac_id: MacId,
    /// Its mode when it is switched on; [`Axis::set_mode`](super::Axis::set_mode) changes it.
    pub mode: ActiveCode,
    /// Update period in ns, for the limit of the position step.
    pub update_ns: u32,
    /// Time limits.
    pub limits: Limits,
    /// Electronic gear, for the limit of 400 M pulse/s; 1/1 unless changed.
    pub gear: Gear,
    /// Over-speed level of the drive, command units per second; `None` leaves it to the drive.
    pub over_speed: Option<u32>,
    /// Largest speed command in CV and PP, unit by Pr7.25; `None` leaves it to the drive.
    pub max_speed: Option<u32>,
    /// Largest torque command in CT, 0.1 % of rated; `None` leaves it to the drive.
    pub max_torque: Option<u32>,
    /// How it stops when another axis fails; `None` if it continues. Category 0 unless changed. Regardless of this setting,
    /// a communication failure puts every axis into servo-off in the same update period, as the System Design Guide for
    /// Master requires, and an axis that itself fails is switched off at once.
    pub stop: Option<StopCategory>,
    /// Change of the step (CP, command units) or of the speed (CV, unit by Pr7.25) in each update period of a stop of category 1 or
    /// 2; 0 unless changed, which leaves category 0.
    pub deceleration: u32,
}

impl AxisConfig {
    /// Creates a configuration with electronic gear 1/1, without limits of speed and torque, and with an immediate stop
    /// when another axis fails.
    pub const fn new(mac_id: MacId, mode: ActiveCode, update_ns: u32, limits: Limits) -> Self {
        Self {
            mac_id,
            mode,
            update_ns,
            limits,
            gear: Gear::UNITY,
            over_speed: None,
            max_speed: None,
            max_torque: None,
            stop: Some(StopCategory::Zero),
            deceleration: 0,
        }
    }

    servowire_core::builder! {
        with_gear: gear, Gear;
        with_over_speed: over_speed, Option<u32>;
        with_max_speed: max_speed, Option<u32>;
        with_max_torque: max_torque, Option<u32>;
        with_stop: stop, Option<StopCategory>;
        with_deceleration: deceleration, u32;
    }
}
