use super::config::DriveConfig;
use super::profile::{Generator, Ramp};

use crate::position::{is_within_limit, step};

/// Largest torque, 0.1 % of rated.
pub(super) const MAX_TORQUE: i32 = 3_000;
/// Torque that changes the speed by one unit an update period, per update period; a model constant.
const TORQUE_PER_STEP: i32 = 2;

/// What the motor is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Power {
    /// Not energised, standing.
    Off,
    /// Servo_On was seen.
    SwitchingOn { left: u16 },
    /// Energised.
    On,
    /// Not energised, slowing down on the dynamic brake.
    Braking,
}

/// What the motor shall do in an update period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Drivemode {
    /// Follow this command position.
    Position(i32),
    /// Follow the generator of profile motion.
    Profile,
    /// Keep this speed, command units per update period.
    Velocity(i32),
    /// Apply this torque, 0.1 %.
    Torque(i32),
}

/// The axis: a motor that follows its command as a first-order lag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Motion {
    pub(super) power: Power,
    /// APOS.
    pub(super) actual: i32,
    /// IPOS.
    pub(super) command: i32,
    /// Steps of the last update period.
    pub(super) actual_step: i32,
    pub(super) command_step: i32,
    /// TRQ, 0.1 %.
    pub(super) torque: i32,
    pub(super) torque_limited: bool,
    pub(super) profile: Option<Generator>,
}

impl Motion {
    pub(super) const fn new() -> Self {
        Self {
            power: Power::Off,
            actual: 0,
            command: 0,
            actual_step: 0,
            command_step: 0,
            torque: 0,
            torque_limited: false,
            profile: None,
        }
    }

    pub(super) const fn is_active(&self) -> bool {
        matches!(self.power, Power::On)
    }

    /// PERR.
    pub(super) const fn deviation(&self) -> i32 {
        step(self.actual, self.command)
    }

    /// Takes the current off the motor.
    pub(super) fn release(&mut self) {
        if self.is_active() {
            self.power = Power::Braking;
        } else if matches!(self.power, Power::SwitchingOn { .. }) {
            self.power = Power::Off;
        }
        self.profile = None;
    }

    /// Servo_On as the drive sees it.
    pub(super) fn request(&mut self, servo_on: bool, config: &DriveConfig) {
        match (servo_on, self.power) {
            (false, _) => self.release(),
            (true, Power::Off) => self.power = Power::SwitchingOn { left: config.servo_on_updates },
            (true, _) => {}
        }
    }

    /// Puts the coordinates so that APOS becomes `actual`.
    pub(super) fn set_actual(&mut self, actual: i32) {
        self.command = self.command.wrapping_add(step(self.actual, actual));
        self.actual = actual;
    }

    /// One update period; `false` if the position command makes too large a step.
    pub(super) fn update(&mut self, mode: Drivemode, ramp: Ramp, profile_speed: i64, config: &DriveConfig) -> bool {
        match self.power {
            Power::Off => self.rest(),
            Power::SwitchingOn { left } => {
                self.rest();
                self.power = match left.checked_sub(1) {
                    Some(left) => Power::SwitchingOn { left },
                    None => Power::On,
                };
            }
            Power::Braking => {
                self.turn(self.actual_step / 2);
                self.command = self.actual;
                self.torque = 0;
                if self.actual_step == 0 {
                    self.power = Power::Off;
                }
            }
            Power::On => return self.drive(mode, ramp, profile_speed, config),
        }
        true
    }

    fn drive(&mut self, mode: Drivemode, ramp: Ramp, profile_speed: i64, config: &DriveConfig) -> bool {
        let last = self.actual_step;
        match mode {
            Drivemode::Position(target) => {
                self.profile = None;
                self.command_step = step(self.command, target);
                if !is_within_limit(self.command_step, config.update_ns, config.gear) {
                    return false;
                }
                self.command = target;
                self.follow(config);
            }
            Drivemode::Profile => {
                let advance = match &mut self.profile {
                    Some(generator) => generator.step(profile_speed, ramp, config.update_ns),
                    None => (0, true),
                };
                self.advance(advance);
                self.follow(config);
            }
            Drivemode::Velocity(speed) => {
                self.profile = None;
                self.command_step = speed;
                self.turn(speed);
                self.command = self.actual;
            }
            Drivemode::Torque(torque) => {
                self.profile = None;
                let torque = torque.clamp(MAX_TORQUE.saturating_neg(), MAX_TORQUE);
                self.turn(last.saturating_add(torque / TORQUE_PER_STEP));
                self.command_step = self.actual_step;
                self.command = self.actual;
            }
        }
        let torque = step(last, self.actual_step).saturating_mul(TORQUE_PER_STEP);
        self.torque = torque.clamp(MAX_TORQUE.saturating_neg(), MAX_TORQUE);
        self.torque_limited = torque != self.torque;
        true
    }

    /// One update period of a profile motion that is being stopped.
    pub(super) fn stop_profile(&mut self, smooth: bool, ramp: Ramp, config: &DriveConfig) {
        let advance = match &mut self.profile {
            Some(generator) if smooth => generator.brake(ramp, config.update_ns),
            _ => (0, true),
        };
        self.advance(advance);
        self.follow(config);
    }

    fn advance(&mut self, (by, done): (i32, bool)) {
        self.command_step = by;
        self.command = self.command.wrapping_add(by);
        if done {
            self.profile = None;
        }
    }

    fn follow(&mut self, config: &DriveConfig) {
        let deviation = self.deviation();
        let part = deviation >> config.follow.min(15);
        // A shift rounds down: the last units are made one by one from above.
        self.turn(if part == 0 { deviation.signum() } else { part });
    }

    fn turn(&mut self, by: i32) {
        self.actual_step = by;
        self.actual = self.actual.wrapping_add(by);
    }

    fn rest(&mut self) {
        self.actual_step = 0;
        self.command_step = 0;
        self.torque = 0;
        self.torque_limited = false;
        self.command = self.actual;
    }
}
