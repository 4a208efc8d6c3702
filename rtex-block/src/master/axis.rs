use core::num::NonZeroU16;

use super::counter::Turn;
use super::echo::EchoWatch;
use super::handshake::Handshake;
use super::profile_move::{CommandEnded, ProfileMove};
use super::progress::Progress;
use super::servo_off::{ActiveCode, ServoOff};
use crate::builder::builder;
use crate::command::Command;
use crate::control::ControlBits;
use crate::error_code::ErrorCode;
use crate::header::MacId;
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::position::{Gear, max_step, step};
use crate::response::Response;
use crate::status::StatusFlags;

/// Time limits, in update periods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Limits {
    /// Unchanged echoes of the counter that count as a time-out.
    pub echo: NonZeroU16,
    /// From the first valid command, or from [`Axis::clear`], to Servo_Ready.
    pub ready: u32,
    /// From Servo_On to Servo_Active.
    pub active: u32,
    /// From Servo_On = 0 to Servo_Active = 0.
    pub inactive: u32,
    /// For the answer to a request, and for the start of a profile motion.
    pub answer: u32,
    /// Consecutive responses with CMD_Error, while nothing is asked, that stop the axis. One may come from a single
    /// damaged frame; the drive holds the command before it then.
    pub command_errors: NonZeroU16,
}

impl Limits {
    /// `echo` for the echo of the counter and for command errors, `wait` for everything that is waited for. The vendor's
    /// times are not known, so there is no default.
    pub const fn new(echo: NonZeroU16, wait: u32) -> Self {
        Self { echo, ready: wait, active: wait, inactive: wait, answer: wait, command_errors: echo }
    }

    builder! {
        with_ready: ready, u32;
        with_active: active, u32;
        with_inactive: inactive, u32;
        with_answer: answer, u32;
        with_command_errors: command_errors, NonZeroU16;
    }
}

/// What an axis is set up with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct AxisConfig {
    /// The drive's address.
    pub mac_id: MacId,
    /// What it does when it is switched on.
    pub mode: ActiveCode,
    /// Update period, ns: for the limit of the position step.
    pub update_ns: u32,
    /// Electronic gear, for the same limit.
    pub gear: Gear,
    /// Time limits.
    pub limits: Limits,
}

impl AxisConfig {
    /// With electronic gear 1/1.
    pub const fn new(mac_id: MacId, mode: ActiveCode, update_ns: u32, limits: Limits) -> Self {
        Self { mac_id, mode, update_ns, gear: Gear::UNITY, limits }
    }

    builder! {
        with_gear: gear, Gear;
    }
}

/// Why an axis was stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum StopReason {
    /// The echo of the counter stood still for the limit.
    EchoTimeout,
    /// Alarm = 1.
    Alarm,
    /// Servo_Ready went to 0 while the servo was wanted on.
    NotReady,
    /// Servo_Active went to 0 by itself.
    NotActive,
    /// Servo_Ready did not come in time.
    ReadyTimeout,
    /// Servo_Active did not come in time.
    ActiveTimeout,
    /// Servo_Active did not go in time: the drive does not obey.
    InactiveTimeout,
    /// The command was not accepted for the limit; the last Error_Code.
    CommandError(ErrorCode),
    /// The axis at this place of the ring failed, and all are stopped.
    OtherAxis(u8),
    /// The caller stopped it.
    Requested,
}

/// State of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum AxisState {
    /// Waiting for Servo_Ready, Servo_On = 0.
    Starting,
    /// Ready, Servo_On = 0.
    Off,
    /// Servo_On = 1, waiting for Servo_Active.
    SwitchingOn,
    /// Energised: the set-point counts.
    On,
    /// Servo_On = 0, waiting for Servo_Active = 0.
    SwitchingOff,
    /// Servo_On = 0 until [`Axis::clear`].
    Stopped(StopReason),
}

/// A set-point that an axis does not take; it keeps the one before.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum SetpointError {
    /// The axis is not on.
    #[error("the axis is not on")]
    NotOn,
    /// The axis was set up for another mode.
    #[error("the axis is set up for another mode")]
    Mode,
    /// The step exceeds 400 M pulses per second behind the electronic gear: the drive would raise Err27.4.
    #[error("a step of {step} command units exceeds 400 M pulses per second")]
    Step {
        /// Wrapping difference to the command position before.
        step: i32,
    },
    /// A profile motion is under way.
    #[error("a profile motion is under way")]
    Moving,
}

/// A request on its way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Service {
    Idle,
    Asking(Handshake),
    /// The outcome is known; the normal command is out until its echo is seen.
    Releasing {
        left: u32,
    },
}

/// The master's side of one drive: start-up, servo-on, set-points, requests, servo-off.
///
/// ```text
///  Starting ──Servo_Ready──► Off ──switch_on──► SwitchingOn ──Servo_Active──► On
///                             ▲                                                │ switch_off
///                             └──────Servo_Active = 0──── SwitchingOff ◄───────┘
///  any ──alarm, time-out, not ready──► Stopped ──clear──► Starting
/// ```
/// Call [`receive`](Self::receive) and then [`send`](Self::send) once in every update period. While Servo_Active is 0 the
/// command position follows the actual position, so switching on makes no jump. In every state but SwitchingOn
/// and On the command is a [`ServoOff`]: Servo_On = 0 with a code at which the drive looks. SX-DSV02310, "Servo_On";
/// the extra waiting times of the vendor are not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis {
    config: AxisConfig,
    /// Largest step of the command position.
    max_step: u32,
    state: AxisState,
    /// Update periods left in the present state.
    left: u32,
    /// Position, speed or torque, by the mode.
    setpoint: i32,
    actual: i32,
    status: StatusFlags,
    control: ControlBits,
    feed_forward: i32,
    watch: EchoWatch,
    /// Consecutive responses with CMD_Error.
    refused: u16,
    service: Service,
    outcome: Option<Progress<NonCyclicResponse>>,
    profile: Option<ProfileMove>,
}

impl Axis {
    /// An axis whose drive has not answered yet.
    pub const fn new(config: AxisConfig) -> Self {
        Self {
            config,
            max_step: max_step(config.update_ns, config.gear),
            state: AxisState::Starting,
            left: config.limits.ready,
            setpoint: 0,
            actual: 0,
            status: StatusFlags::empty(),
            control: ControlBits::empty(),
            feed_forward: 0,
            watch: EchoWatch::new(config.limits.echo),
            refused: 0,
            service: Service::Idle,
            outcome: None,
            profile: None,
        }
    }

    /// How it was set up.
    pub const fn config(&self) -> &AxisConfig {
        &self.config
    }

    /// The present state.
    pub const fn state(&self) -> AxisState {
        self.state
    }

    /// Response_Data1 of the last response, command units.
    pub const fn actual_position(&self) -> i32 {
        self.actual
    }

    /// Status_Flags of the last response.
    pub const fn status(&self) -> StatusFlags {
        self.status
    }

    /// The set-point: command position in CP, otherwise speed or torque.
    pub const fn setpoint(&self) -> i32 {
        self.setpoint
    }

    /// Whether the servo is off, and the drive ready to switch it on.
    pub const fn can_switch_on(&self) -> bool {
        matches!(self.state, AxisState::Off) && self.status.contains(StatusFlags::SERVO_READY)
    }

    /// Switches the servo on, from `Off`; gives whether it did anything.
    pub fn switch_on(&mut self) -> bool {
        let able = self.can_switch_on();
        if able {
            self.enter(AxisState::SwitchingOn, self.config.limits.active);
        }
        able
    }

    /// Switches the servo off. A stopped axis stays stopped.
    pub fn switch_off(&mut self) {
        if matches!(self.state, AxisState::SwitchingOn | AxisState::On) {
            self.enter(AxisState::SwitchingOff, self.config.limits.inactive);
        }
    }

    /// Stops the axis: servo off until [`clear`](Self::clear). The first reason stays.
    pub fn stop(&mut self, reason: StopReason) {
        if !matches!(self.state, AxisState::Stopped(_)) {
            self.enter(AxisState::Stopped(reason), 0);
        }
    }

    /// Leaves `Stopped`: the axis waits for Servo_Ready again, with the servo off.
    pub fn clear(&mut self) {
        if matches!(self.state, AxisState::Stopped(_)) {
            self.watch.reset();
            self.refused = 0;
            self.enter(AxisState::Starting, self.config.limits.ready);
        }
    }

    /// Control bits other than Servo_On, which the state decides.
    pub const fn set_control(&mut self, control: ControlBits) {
        self.control = control.difference(ControlBits::SERVO_ON);
    }

    /// Command_Data3 of the normal command: velocity or torque feed-forward by Pr7.35. With Pr7.35 = 0 it must stay 0,
    /// or the drive answers 0032h. A request carries its own data instead.
    pub const fn set_feed_forward(&mut self, value: i32) {
        self.feed_forward = value;
    }

    /// The next command position, in CP.
    ///
    /// # Errors
    /// [`SetpointError`]; the position before is kept then.
    pub const fn set_position(&mut self, position: i32) -> Result<(), SetpointError> {
        match (self.state, self.config.mode) {
            (AxisState::On, ActiveCode::CyclicPosition) => {}
            (AxisState::On, _) => return Err(SetpointError::Mode),
            _ => return Err(SetpointError::NotOn),
        }
        let step = step(self.setpoint, position);
        if step.unsigned_abs() > self.max_step {
            return Err(SetpointError::Step { step });
        }
        self.setpoint = position;
        Ok(())
    }

    /// The next speed in CV (unit by Pr7.25) or torque in CT (0.1 %).
    ///
    /// # Errors
    /// [`SetpointError`]; the value before is kept then.
    pub const fn set_rate(&mut self, rate: i32) -> Result<(), SetpointError> {
        match (self.state, self.config.mode) {
            (AxisState::On, ActiveCode::CyclicVelocity | ActiveCode::CyclicTorque) => {
                self.setpoint = rate;
                Ok(())
            }
            (AxisState::On, _) => Err(SetpointError::Mode),
            _ => Err(SetpointError::NotOn),
        }
    }

    /// Starts a profile motion, in PP.
    ///
    /// # Errors
    /// [`SetpointError`]; a motion under way goes on then.
    pub const fn start_move(&mut self, type_code: u8, target: i32, speed: i32) -> Result<(), SetpointError> {
        match (self.state, self.config.mode) {
            (AxisState::On, ActiveCode::ProfilePosition) => {}
            (AxisState::On, _) => return Err(SetpointError::Mode),
            _ => return Err(SetpointError::NotOn),
        }
        if self.profile.is_some() || !matches!(self.service, Service::Idle) {
            return Err(SetpointError::Moving);
        }
        let limit = self.config.limits.answer;
        self.profile = Some(ProfileMove::new(self.config.mac_id, type_code, target, speed, limit));
        Ok(())
    }

    /// Changes the speed of the motion under way, if there is one.
    pub const fn set_move_speed(&mut self, speed: i32) {
        if let Some(profile) = &mut self.profile {
            profile.set_speed(speed);
        }
    }

    /// The profile motion under way, or ended and not taken yet.
    pub const fn profile(&self) -> Option<&ProfileMove> {
        self.profile.as_ref()
    }

    /// How far the profile motion is; once it has ended this gives its end and forgets it.
    pub const fn take_move(&mut self) -> Option<Progress<CommandEnded>> {
        let Some(profile) = &self.profile else { return None };
        let progress = profile.progress();
        if !progress.is_pending() {
            self.profile = None;
        }
        Some(progress)
    }

    /// Sends a non-cyclic command; `false` if one is under way, or the request is none of the kind.
    pub const fn ask(&mut self, request: NonCyclicCommand) -> bool {
        let (cyclic, limit) = (self.config.mode.cyclic(), self.config.limits.answer);
        if !matches!(self.service, Service::Idle) || self.profile.is_some() {
            return false;
        }
        match Handshake::new(self.config.mac_id, cyclic, request, limit) {
            Some(handshake) => {
                self.service = Service::Asking(handshake);
                self.outcome = None;
                true
            }
            None => false,
        }
    }

    /// The outcome of the last request, once.
    pub const fn take_outcome(&mut self) -> Option<Progress<NonCyclicResponse>> {
        self.outcome.take()
    }

    /// Takes what an update period brought: the drive's response to what was `sent`, `None` if there was none or it
    /// was refused. While invalid data go out no limit runs.
    pub fn receive(&mut self, sent: Turn, response: Option<&Response>) {
        let response = response.filter(|response| response.mac_id == self.config.mac_id);
        if sent != Turn::Invalid {
            if self.watch.sample(response.map(|r| r.update_counter_echo)) {
                self.stop(StopReason::EchoTimeout);
            }
            if let Some(response) = response {
                self.look(response);
            }
            self.poll(response);
            self.wait();
        }
        if let Some(response) = response {
            self.status = response.status;
            self.actual = response.response_data1;
        }
        if self.state != AxisState::On {
            self.setpoint = if self.config.mode == ActiveCode::CyclicPosition { self.actual } else { 0 };
        }
    }

    /// What to send in this update period.
    pub const fn send(&self, turn: Turn) -> Command {
        let mac_id = self.config.mac_id;
        let counter = match turn {
            Turn::Invalid => return Command::nop(mac_id),
            Turn::Valid(counter) => counter,
        };
        let off = *ServoOff::new(mac_id, counter, self.config.mode).command();
        let request = match (&self.service, &self.profile) {
            (Service::Asking(handshake), _) => handshake.request(),
            (_, Some(profile)) => profile.request(),
            _ => NonCyclicCommand::Normal { command_data2: 0, command_data3: self.feed_forward },
        };
        let command_data1 = match &self.profile {
            Some(profile) => profile.target_position(),
            None => self.setpoint,
        };
        let control = match self.state {
            AxisState::SwitchingOn | AxisState::On => self.control.union(ControlBits::SERVO_ON),
            _ => self.control,
        };
        Command { control, command_data1, noncyclic: request, ..off }
    }

    /// Alarm, readiness and activity by the state.
    fn look(&mut self, response: &Response) {
        let status = response.status;
        match self.state {
            AxisState::Starting
                if status.contains(StatusFlags::SERVO_READY) && !status.contains(StatusFlags::SERVO_ACTIVE) =>
            {
                self.enter(AxisState::Off, 0);
            }
            AxisState::SwitchingOff if !status.contains(StatusFlags::SERVO_ACTIVE) => self.enter(AxisState::Off, 0),
            AxisState::SwitchingOn | AxisState::On if status.contains(StatusFlags::ALARM) => {
                self.stop(StopReason::Alarm);
            }
            AxisState::SwitchingOn | AxisState::On if !status.contains(StatusFlags::SERVO_READY) => {
                self.stop(StopReason::NotReady);
            }
            AxisState::SwitchingOn if status.contains(StatusFlags::SERVO_ACTIVE) => self.enter(AxisState::On, 0),
            AxisState::On if !status.contains(StatusFlags::SERVO_ACTIVE) => self.stop(StopReason::NotActive),
            _ => {}
        }
        let asked = matches!(self.service, Service::Asking(_)) || self.profile.is_some();
        match response.noncyclic() {
            NonCyclicResponse::CommandError(code) if !asked => {
                self.refused = self.refused.saturating_add(1);
                if self.refused >= self.config.limits.command_errors.get() {
                    self.stop(StopReason::CommandError(code));
                }
            }
            _ => self.refused = 0,
        }
    }

    /// Requests and profile motion.
    fn poll(&mut self, response: Option<&Response>) {
        if let Some(profile) = &mut self.profile {
            let _ = profile.receive(response);
        }
        let released = response.is_some_and(|r| r.code.noncyclic_bits() == 0);
        match &mut self.service {
            Service::Idle => {}
            Service::Asking(handshake) => {
                let progress = handshake.receive(response);
                if !progress.is_pending() {
                    self.outcome = Some(progress);
                    self.service = Service::Releasing { left: self.config.limits.answer };
                }
            }
            Service::Releasing { left } => match left.checked_sub(1) {
                Some(less) if !released => *left = less,
                _ => self.service = Service::Idle,
            },
        }
    }

    /// The limit of the present state.
    fn wait(&mut self) {
        let reason = match self.state {
            AxisState::Starting => StopReason::ReadyTimeout,
            AxisState::SwitchingOn => StopReason::ActiveTimeout,
            AxisState::SwitchingOff => StopReason::InactiveTimeout,
            AxisState::Off | AxisState::On | AxisState::Stopped(_) => return,
        };
        match self.left.checked_sub(1) {
            Some(left) => self.left = left,
            None => self.stop(reason),
        }
    }

    fn enter(&mut self, state: AxisState, limit: u32) {
        self.state = state;
        self.left = limit;
        if state != AxisState::On {
            self.profile = None;
        }
    }
}
