//! The master's side of one drive.

mod service;
mod setpoint;

use service::{Service, SubService};

use super::config::{AxisConfig, StopPolicy};
use super::counter::Turn;
use super::counters::Counters;
use super::echo::EchoWatch;
use super::heard::Heard;
use super::profile_move::ProfileMove;
use super::progress::{Failure, Progress};
use super::servo_off::{ActiveCode, ServoOff};
use super::state::{AxisState, StopReason, SwitchOnError};
use crate::command::Command;
use crate::control::ControlBits;
use crate::error::Error;
use crate::evidence::Evidence;
use crate::header::{MacId, UpdateCounter};
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::position::{max_step, max_step_at, step};
use crate::response::Response;
use crate::status::StatusFlags;
use crate::sub::{Command32, SubResponse};

/// The master's side of one drive: start-up, servo-on, set-points, requests, servo-off.
///
/// ```text
///  Starting ──Servo_Ready──► Off ──switch_on──► SwitchingOn ──Servo_Active──► On
///     ▲ not ready             │▲                                              │ switch_off
///     └───────────────────────┘└─────Servo_Active = 0──── SwitchingOff ◄──────┘
///  any ──alarm, time-out, not ready──► Stopped ──clear──► Starting
///  On ──another axis fails, policy Decelerate──► Stopping ──stands──► Stopped
/// ```
/// Call [`hear`](Self::hear) and then [`transmission`](Self::transmission) once in every update period. While the servo is off the
/// command position follows the actual position, so switching on makes no jump. In every state but SwitchingOn, On and
/// Stopping the command is a [`ServoOff`]: Servo_On = 0 with a code at which the drive looks, whatever the caller does.
/// SX-DSV02310, "Servo_On"; the extra waiting times of the vendor are not known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis {
    config: AxisConfig,
    /// Largest step of the command position.
    max_step: u32,
    mode: ActiveCode,
    state: AxisState,
    /// Update periods left in the present state.
    left: u32,
    /// Position, speed or torque, by the mode.
    setpoint: i32,
    /// The set-point before, and the step between them.
    before: i32,
    last_step: i32,
    /// Of the last good block, with the instant of the last new counter echo: a drive whose processing stands still goes on to
    /// send its last block.
    evidence: Evidence,
    echo: Option<UpdateCounter>,
    /// This update period brought a new counter echo.
    is_fresh: bool,
    control: ControlBits,
    /// Command_Data3, Sub_Command_Data2 and 3.
    feed_forward: [i32; 3],
    watch: EchoWatch,
    counters: Counters,
    /// Why the last block was refused; `None` after a good one.
    last_refusal: Option<Error>,
    /// Consecutive responses with CMD_Error.
    refused: u16,
    /// Responses with Servo_Active = 1 since the servo was commanded off.
    active_off: u32,
    disobeys: bool,
    service: Service,
    /// The drive has not echoed the normal command since the last request: what it says may still be the answer to that.
    unreleased: bool,
    outcome: Option<Progress<NonCyclicResponse>>,
    sub: SubService,
    sub_outcome: Option<Progress<SubResponse>>,
    sub_unreleased: bool,
    profile: Option<ProfileMove>,
}

impl Axis {
    /// An axis whose drive has not answered yet.
    pub const fn new(config: AxisConfig) -> Self {
        let by_gear = max_step(config.update_ns, config.gear);
        let max_step = match config.over_speed {
            Some(level) => {
                let by_speed = max_step_at(level, config.update_ns);
                if by_speed < by_gear { by_speed } else { by_gear }
            }
            None => by_gear,
        };
        Self {
            config,
            max_step,
            mode: config.mode,
            state: AxisState::Starting,
            left: config.limits.ready,
            setpoint: 0,
            before: 0,
            last_step: 0,
            evidence: Evidence::NEVER,
            echo: None,
            is_fresh: false,
            control: ControlBits::empty(),
            feed_forward: [0; 3],
            watch: EchoWatch::new(config.limits.echo),
            counters: Counters::new(),
            last_refusal: None,
            refused: 0,
            active_off: 0,
            disobeys: false,
            service: Service::Idle,
            outcome: None,
            unreleased: true,
            sub: SubService::Idle,
            sub_outcome: None,
            sub_unreleased: true,
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

    /// What is known of the actual position (Response_Data1), speed and torque. Its instant is that of the block that brought
    /// the last new counter echo, as [`hear`](Self::hear) was told.
    pub const fn evidence(&self) -> Evidence {
        let refused = match self.last_refusal {
            Some(error) => Some(error.class()),
            None => None,
        };
        self.evidence.refused(refused)
    }

    /// Status_Flags of the last good response.
    pub const fn status(&self) -> StatusFlags {
        self.evidence.status()
    }

    /// Blocks of the drive that were sound, and those that were refused, by class.
    pub const fn counters(&self) -> &Counters {
        &self.counters
    }

    /// Servo_Active was still 1 when [`Limits::inactive`](super::Limits::inactive) was over, with Servo_On = 0: take the
    /// power away by other means. Stays until [`clear`](Self::clear).
    pub const fn disobeys(&self) -> bool {
        self.disobeys
    }

    /// Whether the servo can be switched on: it is off, the drive ready by a new block of this update period, and no request is
    /// under way that would change its position or its state. The command position is the actual one then.
    ///
    /// # Errors
    /// [`SwitchOnError`]: the first reason why not.
    pub const fn can_switch_on(&self) -> Result<(), SwitchOnError> {
        let status = self.evidence.status();
        if !matches!(self.state, AxisState::Off) {
            Err(SwitchOnError::State(self.state))
        } else if !self.is_fresh {
            Err(SwitchOnError::OldPosition)
        } else if status.contains(StatusFlags::ALARM) {
            Err(SwitchOnError::Alarm)
        } else if !status.contains(StatusFlags::SERVO_READY) {
            Err(SwitchOnError::NotReady)
        } else if self.service.needs_servo_off() {
            Err(SwitchOnError::Busy)
        } else {
            Ok(())
        }
    }

    /// Switches the servo on, from `Off`.
    ///
    /// # Errors
    /// [`SwitchOnError`]; nothing has changed then.
    pub fn switch_on(&mut self) -> Result<(), SwitchOnError> {
        self.can_switch_on()?;
        self.enter(AxisState::SwitchingOn, self.config.limits.active);
        Ok(())
    }

    /// Switches the servo off. A stopped axis stays stopped.
    pub fn switch_off(&mut self) {
        match self.state {
            AxisState::Stopping(reason) => self.stop(reason),
            AxisState::SwitchingOn | AxisState::On => {
                self.enter(AxisState::SwitchingOff, self.config.limits.inactive);
            }
            _ => {}
        }
    }

    /// Stops the axis at once: servo off until [`clear`](Self::clear). The first reason stays.
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
            self.active_off = 0;
            self.disobeys = false;
            self.last_refusal = None;
            self.enter(AxisState::Starting, self.config.limits.ready);
        }
    }

    /// Takes what an update period brought, heard until `end_ns`: the drive's response to what was `sent`. While invalid data
    /// go out no limit runs.
    pub fn hear(&mut self, sent: Turn, heard: &Heard, end_ns: u64) {
        let response = self.sound(heard);
        let echo = response.map(|r| r.update_counter_echo);
        self.is_fresh = echo.is_some() && echo != self.echo;
        if self.state == AxisState::On {
            self.last_step = step(self.before, self.setpoint);
            self.before = self.setpoint;
        }
        if sent != Turn::Invalid {
            if self.watch.sample(echo) {
                self.stop(self.silence());
            }
            self.count_refusals(response);
            self.serve(response);
            self.serve_sub(response.and(heard.sub()));
            if let Some(response) = response {
                self.supervise(response.status);
            }
            self.wait();
        }
        if let Some(response) = response {
            self.echo = echo;
            let sampled_ns = if self.is_fresh { end_ns } else { self.evidence.last().sampled_ns() };
            self.evidence = Evidence::of(response, sampled_ns);
        }
        match self.state {
            AxisState::On => {}
            AxisState::Stopping(reason) => self.slow_down(reason),
            _ => self.rest(),
        }
    }

    /// What to send in this update period; in the 16-byte mode its `main` half alone.
    pub fn transmission(&self, turn: Turn) -> Command32 {
        let mac_id = self.config.mac_id;
        let counter = match turn {
            Turn::Invalid => return Command32 { main: Command::nop(mac_id), sub: self.sub_command([0; 2]) },
            Turn::Valid(counter) => counter,
        };
        let off = *ServoOff::new(mac_id, counter, self.mode).command();
        let [data3, sub2, sub3] = self.feed_forward;
        let noncyclic = self.noncyclic(data3);
        let command_data1 = match self.profile {
            Some(profile) if profile.progress().is_pending() => profile.target_position(),
            _ => self.setpoint,
        };
        let control = match self.state {
            AxisState::SwitchingOn | AxisState::On => self.control.union(ControlBits::SERVO_ON),
            AxisState::Stopping(_) => self.control.union(ControlBits::SERVO_ON).union(self.smooth_stop()),
            _ => self.control,
        };
        let main = Command { control, command_data1, noncyclic, ..off };
        Command32 { main, sub: self.sub_command([sub2, sub3]) }
    }

    /// The axis at `place` has failed; `at_once` where the communication has.
    pub(super) fn share_failure(&mut self, place: u8, at_once: bool) {
        let reason = StopReason::OtherAxis { place };
        match (self.state, self.config.stop) {
            _ if at_once => self.stop(reason),
            (AxisState::Stopping(_), _) | (_, StopPolicy::None) => {}
            (AxisState::On, StopPolicy::Decelerate { .. }) => {
                self.enter(AxisState::Stopping(reason), self.config.limits.stop);
                self.slow_down(reason);
            }
            _ => self.stop(reason),
        }
    }

    /// The response, if it is sound and the drive's own; every block is counted.
    fn sound<'a>(&mut self, heard: &'a Heard) -> Option<&'a Response> {
        let outcome = match (heard, heard.response()) {
            (Heard::Refused(error), _) => Err(*error),
            (_, Some(response)) if response.mac_id == self.config.mac_id => Ok(response),
            (_, Some(response)) => Err(Error::MacId { got: response.mac_id.get(), want: self.config.mac_id.get() }),
            (_, None) => return None,
        };
        self.counters.record(&outcome);
        self.last_refusal = outcome.err();
        outcome.ok()
    }

    /// Why the echo stands still.
    fn silence(&self) -> StopReason {
        match self.last_refusal {
            Some(Error::MacId { got, .. }) => StopReason::WrongMacId(MacId::truncate(got)),
            Some(error) => StopReason::Refused(error.class()),
            None => StopReason::EchoTimeout,
        }
    }

    /// Counts CMD_Error, but for the refusal of a request or of the start of a motion.
    fn count_refusals(&mut self, response: Option<&Response>) {
        let Some(response) = response else { return };
        let NonCyclicResponse::CommandError(code) = response.noncyclic() else {
            self.refused = 0;
            return;
        };
        let asked = self.service != Service::Idle || self.profile.is_some_and(|profile| !profile.is_moving());
        if response.code.noncyclic_bits() == 0 || !asked || code.discards_block() {
            self.refused = self.refused.saturating_add(1);
            if self.refused >= self.config.limits.command_errors.get() {
                self.stop(StopReason::CommandError(code));
            }
        }
    }

    /// Alarm, readiness and activity by the state.
    fn supervise(&mut self, status: StatusFlags) {
        let [alarm, ready, active] =
            [StatusFlags::ALARM, StatusFlags::SERVO_READY, StatusFlags::SERVO_ACTIVE].map(|flag| status.contains(flag));
        match self.state {
            AxisState::Starting if ready && !active && !alarm => self.enter(AxisState::Off, 0),
            AxisState::Starting | AxisState::Stopped(_) => {}
            _ if alarm => self.stop(StopReason::Alarm),
            AxisState::Off if !ready => self.enter(AxisState::Starting, self.config.limits.ready),
            AxisState::SwitchingOff if !active => self.enter(AxisState::Off, 0),
            AxisState::SwitchingOn | AxisState::On | AxisState::Stopping(_) if !ready => {
                self.stop(StopReason::NotReady);
            }
            AxisState::SwitchingOn if active => self.enter(AxisState::On, 0),
            AxisState::On | AxisState::Stopping(_) if !active => self.stop(StopReason::NotActive),
            _ => {}
        }
        if self.state.is_servo_on() || !active {
            self.active_off = 0;
            return;
        }
        self.active_off = self.active_off.saturating_add(1);
        if self.active_off > self.config.limits.inactive {
            self.disobeys = true;
            self.stop(StopReason::InactiveTimeout);
        }
    }

    /// The limit of the present state.
    fn wait(&mut self) {
        let reason = match self.state {
            AxisState::Starting if self.status().contains(StatusFlags::ALARM) => StopReason::Alarm,
            AxisState::Starting => StopReason::ReadyTimeout,
            AxisState::SwitchingOn => StopReason::ActiveTimeout,
            AxisState::SwitchingOff => StopReason::InactiveTimeout,
            AxisState::Stopping(reason) => reason,
            AxisState::Off | AxisState::On | AxisState::Stopped(_) => return,
        };
        match self.left.checked_sub(1) {
            Some(left) => self.left = left,
            None => self.stop(reason),
        }
    }

    /// The set-point of an axis that does not move by command.
    fn rest(&mut self) {
        self.setpoint = if self.mode == ActiveCode::CyclicPosition { self.evidence.last().position() } else { 0 };
        self.before = self.setpoint;
        self.last_step = 0;
    }

    /// One update period of a controlled deceleration.
    fn slow_down(&mut self, reason: StopReason) {
        let StopPolicy::Decelerate { per_update } = self.config.stop else { return self.stop(reason) };
        let less = |value: i32| {
            let magnitude = value.unsigned_abs().saturating_sub(per_update.max(1));
            // Smaller than an i32 in magnitude, so it is one.
            i32::try_from(magnitude).unwrap_or(i32::MAX).saturating_mul(value.signum())
        };
        let stands = match self.mode {
            ActiveCode::CyclicPosition => {
                self.last_step = less(self.last_step);
                self.setpoint = self.setpoint.wrapping_add(self.last_step);
                self.last_step == 0
            }
            ActiveCode::CyclicVelocity => {
                self.setpoint = less(self.setpoint);
                self.setpoint == 0
            }
            ActiveCode::ProfilePosition => !self.status().contains(StatusFlags::IN_PROGRESS),
            ActiveCode::CyclicTorque => true,
        };
        if stands {
            self.stop(reason);
        }
    }

    /// The bit that ends a profile motion.
    fn smooth_stop(&self) -> ControlBits {
        match self.mode {
            ActiveCode::ProfilePosition => ControlBits::SMOOTH_STOP,
            _ => ControlBits::empty(),
        }
    }

    /// Bytes 8-15: the request, the motion, or the normal command with its feed-forward.
    fn noncyclic(&self, feed_forward: i32) -> NonCyclicCommand {
        match (self.service.request(), &self.profile) {
            (Some(request), _) => request.with_feed_forward(feed_forward),
            (None, Some(profile)) => profile.request().with_feed_forward(feed_forward),
            (None, None) => NonCyclicCommand::IDLE.with_feed_forward(feed_forward),
        }
    }

    fn enter(&mut self, state: AxisState, limit: u32) {
        self.state = state;
        self.left = limit;
        if state != AxisState::On {
            self.feed_forward = [0; 3];
        }
        if !state.is_servo_on() {
            if let Some(profile) = &mut self.profile {
                profile.abandon(Failure::ServoOff);
            }
            self.rest();
        }
    }
}
