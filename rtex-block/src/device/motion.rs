use super::config::DriveConfig;
use super::profile::{Generator, Ramp};

/// Largest torque, 0.1 % of rated.
pub(super) const MAX_TORQUE: i32 = 3_000;
/// The torque that changes the speed by one unit per update period in each update period; a constant of the model.
const TORQUE_PER_STEP: i32 = 2;

/// What the motor is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Power {
    /// Not energised, at rest.
    Off,
    /// Servo_On was received; not yet energised.
    SwitchingOn { left: u16 },
    /// Energised.
    On,
    /// Not energised, slowing down on the dynamic brake. Servo_Active may still be 1.
    Braking,
}

/// What the motor has to do in an update period.
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
    /// The step made in the last update period.
    pub(super) actual_step: i32,
    pub(super) command_step: i32,
    /// TRQ, 0.1 %.
    pub(super) torque: i32,
    pub(super) torque_limited: bool,
    pub(super) profile: Option<Generator>,
    /// Number of update periods before the motion starts and In_Progress rises.
    start_in: u16,
    /// Number of update periods for which Servo_Active is still 1.
    says_active: u16,
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
            start_in: 0,
            says_active: 0,
        }
    }

    pub(super) const fn is_active(&self) -> bool {
        matches!(self.power, Power::On)
    }

    /// Servo_Active.
    pub(super) const fn says_active(&self) -> bool {
        self.is_active() || self.says_active > 0
    }

    /// In_Progress.
    pub(super) const fn in_progress(&self) -> bool {
        self.profile.is_some() && self.start_in == 0
    }

    pub(super) const fn start(&mut self, generator: Generator, late: u16) {
        self.profile = Some(generator);
        self.start_in = late;
    }

    /// Makes the homing move, which the drive controls by itself; the model starts without delay.
    pub(super) const fn home(&mut self, distance: i32) {
        self.start(Generator::new(distance), 0);
    }

    /// PERR.
    pub(super) const fn deviation(&self) -> i32 {
        self.command.wrapping_sub(self.actual)
    }

    /// De-energises the motor; Servo_Active stays 1 for `late` update periods.
    pub(super) fn release(&mut self, late: u16) {
        if self.is_active() {
            self.power = Power::Braking;
            self.says_active = late;
        } else if matches!(self.power, Power::SwitchingOn { .. }) {
            self.power = Power::Off;
        }
        self.profile = None;
    }

    /// Takes Servo_On as the drive sees it.
    pub(super) fn request(&mut self, servo_on: bool, config: &DriveConfig, off_late: u16) {
        match (servo_on, self.power) {
            (false, _) => self.release(off_late),
            (true, Power::Off) => self.power = Power::SwitchingOn { left: config.servo_on_updates },
            (true, _) => {}
        }
    }

    /// Sets the coordinates.
    pub(super) const fn shift(&mut self, by: i32) {
        self.command = self.command.wrapping_add(by);
        self.actual = self.actual.wrapping_add(by);
    }

    /// Runs one update period; returns `false` if the position command makes too large a step.
    pub(super) fn update(&mut self, mode: Drivemode, ramp: Ramp, profile_speed: i64, config: &DriveConfig) -> bool {
        self.says_active = self.says_active.saturating_sub(1);
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
                self.command_step = target.wrapping_sub(self.command);
                if is_too_large(self.command_step, config) {
                    return false;
                }
                self.command = target;
                self.follow(config);
            }
            Drivemode::Profile => {
                let advance = match &mut self.profile {
                    Some(_) if self.start_in > 0 => {
                        self.start_in = self.start_in.saturating_sub(1);
                        (0, false)
                    }
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
        let torque = self.actual_step.wrapping_sub(last).saturating_mul(TORQUE_PER_STEP);
        self.torque = torque.clamp(MAX_TORQUE.saturating_neg(), MAX_TORQUE);
        self.torque_limited = torque != self.torque;
        true
    }

    /// Runs one update period of a profile motion that is being stopped.
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

/// Whether a step amounts to more than 400 000 000 pulses per second after the electronic gear.
fn is_too_large(step: i32, config: &DriveConfig) -> bool {
    let (pulses, units) = config.gear.into();
    let rate = u128::from(step.unsigned_abs()).saturating_mul(pulses.into()).saturating_mul(1_000_000_000);
    rate > 400_000_000_u128.saturating_mul(units.into()).saturating_mul(config.update_ns.into())
}
