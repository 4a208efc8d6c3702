//! Execution of non-cyclic commands.

use super::Drive;
use crate::device::literals::{
    APOS, ASPD, HOMING_ACTUAL, HOMING_COMMAND, HOMING_LATCH, IPOS, LPOS1, LPOS2, MPOS, MSPD, OVERLOAD, PARAMETER_WRITE,
    PERR, PROFILE_RELATIVE, REGENERATIVE_LOAD, RESET_ATTRIBUTE_C, RESET_SOFTWARE, TEXTS, TRQ, WRONG_ARGUMENT,
    WRONG_FEED_FORWARD, WRONG_TYPE,
};
use crate::device::motion::MAX_TORQUE;
use crate::device::parameters::{FEED_FORWARD, Parameters};
use crate::device::profile::Generator;
use crate::error_code::Alarm;
use crate::execution::{Execution, LatchFlags, ProfileFlags};
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::{NonCyclicResponse, Results};
use crate::type_code::{Pr, TypeCode};

/// A command that is being executed, or was and is still held by the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Job {
    request: NonCyclicCommand,
    busy: u16,
    outcome: Outcome,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Outcome {
    Value(i32),
    /// A monitor value, read anew for every response.
    Live(u16),
    /// Attributes of the alarm that is being issued, which is the index echo.
    Attributes(Alarm),
    Failed,
}

type Outcomes = Result<Outcome, u16>;

impl Drive {
    /// Takes the non-cyclic half of an accepted command; `from_idle` if the code before was 10h.
    pub(super) fn serve(&mut self, request: NonCyclicCommand, from_idle: bool) -> Result<(), u16> {
        self.feed(&request)?;
        if let Some(job) = &mut self.job {
            if is_same(&job.request, &request) {
                job.busy = job.busy.saturating_sub(1);
                job.request = request;
                self.stale = self.stale.filter(|(_, left)| *left > 1).map(|(old, left)| (old, left.saturating_sub(1)));
                return Ok(());
            }
        }
        let old = self.job.take().map(|job| job.request);
        let outcome = match request {
            NonCyclicCommand::Normal { .. } => return Ok(()),
            NonCyclicCommand::Reset(a) => self.reset(a)?,
            NonCyclicCommand::SystemId(a) => Outcome::Value(text(a.type_code.get(), a.index)?),
            NonCyclicCommand::Homing { type_code, setting_data, .. } => self.home(type_code, setting_data)?,
            NonCyclicCommand::Alarm(a) => self.alarms(a)?,
            NonCyclicCommand::Parameter(a) => self.parameter(a)?,
            NonCyclicCommand::Profile { type_code, .. } => self.start(type_code, from_idle)?,
            NonCyclicCommand::Monitor(a) => {
                self.monitor(a.type_code.get(), a.index)?;
                Outcome::Live(a.type_code.get())
            }
        };
        let manners = self.config.manners;
        let slow = matches!(request, NonCyclicCommand::Reset(_) | NonCyclicCommand::Parameter(_));
        let busy = if slow || manners.always_busy { self.config.busy_exchanges } else { 0 };
        self.job = Some(Job { request, busy, outcome });
        let old = old.unwrap_or_else(|| other(&request));
        self.stale = (manners.stale_answers > 0).then_some((old, manners.stale_answers));
        Ok(())
    }

    /// What bytes 8-15 of the response say.
    pub(super) fn noncyclic(&self) -> NonCyclicResponse {
        if let Some(code) = self.error {
            return NonCyclicResponse::CommandError(code);
        }
        let Some(job) = &self.job else {
            let [_, response_data2, response_data3] = self.response_data();
            return NonCyclicResponse::Normal { response_data2, response_data3 };
        };
        // The echoes of a request of another kind would have another layout under this code.
        let stale = self.stale.map(|(old, _)| old).filter(|old| old.code() == job.request.code());
        let mut index_echo = None;
        let (err, data) = match job.outcome {
            Outcome::Failed => (job.busy == 0 || self.config.manners.err_while_busy, 0),
            _ if job.busy > 0 => (false, 0),
            Outcome::Value(data) => (false, data),
            Outcome::Live(code) => (false, self.monitor(code, 0).unwrap_or(0)),
            Outcome::Attributes(Alarm { main, sub }) => {
                index_echo = Some(u16::from_be_bytes([main, sub]));
                (false, self.config.alarm_attributes)
            }
        };
        let mut execution = Execution::empty();
        execution.set(Execution::ERR, err && stale.is_none());
        execution.set(Execution::BUSY, job.busy > 0 && stale.is_none());
        execution.set(Execution::WNG, self.config.manners.warns);
        let results = |a: Arguments| {
            let index = if stale.is_none() { index_echo.unwrap_or(a.index) } else { a.index };
            Results { execution, type_code: a.type_code, index, data }
        };
        let selected = |code: u8| self.monitor(code.into(), 0).unwrap_or(0);
        match stale.unwrap_or(job.request) {
            NonCyclicCommand::Normal { command_data2, command_data3 } => {
                NonCyclicResponse::Normal { response_data2: command_data2, response_data3: command_data3 }
            }
            NonCyclicCommand::Reset(a) => NonCyclicResponse::Reset(results(a)),
            NonCyclicCommand::SystemId(a) => NonCyclicResponse::SystemId(results(a)),
            NonCyclicCommand::Alarm(a) => NonCyclicResponse::Alarm(results(a)),
            NonCyclicCommand::Parameter(a) => NonCyclicResponse::Parameter(results(a)),
            NonCyclicCommand::Monitor(a) => NonCyclicResponse::Monitor(results(a)),
            NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, .. } => {
                NonCyclicResponse::Homing {
                    execution,
                    type_code,
                    latch: self.latch_flags(),
                    latch_sel1,
                    latch_sel2,
                    monitor_sel,
                    monitor_data: selected(monitor_sel),
                }
            }
            NonCyclicCommand::Profile { type_code, latch_sel1, monitor_sel, .. } => {
                execution.set(Execution::BUSY, self.motion.in_progress() && stale.is_none());
                NonCyclicResponse::Profile {
                    execution,
                    type_code,
                    flags: self.profile_flags(),
                    latch_sel1,
                    monitor_sel,
                    monitor_data: selected(monitor_sel),
                }
            }
        }
    }

    fn latch_flags(&self) -> LatchFlags {
        let [one, two] = self.latches.map(|latch| latch.is_some());
        let mut flags = LatchFlags::empty();
        flags.set(LatchFlags::LATCH_COMP1, one);
        flags.set(LatchFlags::LATCH_COMP2, two);
        flags
    }

    fn profile_flags(&self) -> ProfileFlags {
        let to_go = self.motion.profile.map_or(0, |generator| generator.distance_to_go());
        let mut flags = ProfileFlags::empty();
        flags.set(ProfileFlags::NEAR, to_go.unsigned_abs() <= self.config.near.into());
        flags.set(ProfileFlags::LATCH_COMP1, self.latches[0].is_some());
        flags
    }

    /// Command_Data3, where the command does not need it itself; the old feed-forward stays otherwise, and where the new one
    /// is refused.
    fn feed(&mut self, request: &NonCyclicCommand) -> Result<(), u16> {
        let data3 = match request {
            NonCyclicCommand::Normal { command_data3, .. } => *command_data3,
            NonCyclicCommand::Homing { type_code: HOMING_ACTUAL | HOMING_COMMAND, .. }
            | NonCyclicCommand::Profile { .. } => return Ok(()),
            NonCyclicCommand::Parameter(a) if a.type_code.get() == PARAMETER_WRITE => return Ok(()),
            NonCyclicCommand::Homing { setting_data, .. } => *setting_data,
            NonCyclicCommand::Reset(a)
            | NonCyclicCommand::SystemId(a)
            | NonCyclicCommand::Alarm(a)
            | NonCyclicCommand::Parameter(a)
            | NonCyclicCommand::Monitor(a) => a.data,
        };
        match self.parameters.value(FEED_FORWARD) {
            0 if data3 != 0 => Err(WRONG_ARGUMENT),
            2 if data3.saturating_abs() > MAX_TORQUE => Err(WRONG_FEED_FORWARD),
            0 => Ok(()),
            _ => {
                self.feed_forward = data3;
                Ok(())
            }
        }
    }

    fn reset(&mut self, a: Arguments) -> Outcomes {
        if a.index != 0 {
            return Err(WRONG_ARGUMENT);
        }
        match a.type_code.get() {
            RESET_SOFTWARE | RESET_ATTRIBUTE_C if self.motion.is_active() => Ok(Outcome::Failed),
            RESET_SOFTWARE => {
                self.clear_alarm();
                self.parameters.take_over();
                self.feed_forward = 0;
                Ok(Outcome::Value(0))
            }
            RESET_ATTRIBUTE_C => {
                self.parameters.take_over();
                Ok(Outcome::Value(0))
            }
            _ => Err(WRONG_TYPE),
        }
    }

    fn home(&mut self, type_code: u8, position: i32) -> Outcomes {
        match type_code {
            HOMING_ACTUAL | HOMING_COMMAND
                if self.motion.is_active() && !self.config.manners.sets_position_while_on =>
            {
                Ok(Outcome::Failed)
            }
            HOMING_ACTUAL | HOMING_COMMAND => {
                let now = if type_code == HOMING_ACTUAL { self.motion.actual } else { self.motion.command };
                self.motion.shift(position.wrapping_sub(now));
                self.homed = true;
                Ok(Outcome::Value(0))
            }
            HOMING_LATCH => Ok(Outcome::Value(0)),
            _ if type_code == self.config.codes.latch_arm => {
                self.armed = [true; 2];
                self.latches = [None; 2];
                Ok(Outcome::Value(0))
            }
            _ if type_code == self.config.codes.homing && self.motion.is_active() => {
                self.homed = false;
                self.homing = true;
                self.motion.home(self.config.homing_distance);
                Ok(Outcome::Value(0))
            }
            _ if type_code == self.config.codes.homing => Ok(Outcome::Failed),
            _ => Err(WRONG_TYPE),
        }
    }

    fn alarms(&mut self, a: Arguments) -> Outcomes {
        let codes = self.config.codes;
        let none = Alarm { main: 0, sub: 0 };
        if a.type_code == codes.alarm_active {
            return Ok(Outcome::Value(words(self.alarm.unwrap_or(none), self.warning)));
        }
        if a.type_code == codes.alarm_attributes {
            let alarm = if a.index == 0 { self.alarm } else { None };
            return alarm.map(Outcome::Attributes).ok_or(WRONG_ARGUMENT);
        }
        if a.type_code == codes.alarm_history {
            let entry = usize::from(a.index).checked_sub(1).and_then(|k| self.history.get(k));
            let alarm = entry.ok_or(WRONG_ARGUMENT)?;
            return Ok(Outcome::Value(words(alarm.unwrap_or(none), 0)));
        }
        if a.type_code == codes.alarm_clear {
            self.clear_alarm();
            return Ok(Outcome::Value(0));
        }
        Err(WRONG_TYPE)
    }

    fn parameter(&mut self, a: Arguments) -> Outcomes {
        let pr = Pr::from_index(a.index);
        let codes = self.config.codes;
        if a.type_code.get() == PARAMETER_WRITE {
            let at_once = !self.config.manners.parameters_after_reset;
            return if self.parameters.set(pr, a.data, at_once) {
                Ok(Outcome::Value(a.data))
            } else {
                Err(WRONG_ARGUMENT)
            };
        }
        if a.type_code == codes.parameter_read {
            return self.parameters.written(pr).map(Outcome::Value).ok_or(WRONG_ARGUMENT);
        }
        if a.type_code == codes.parameter_initial {
            return Parameters::DEFAULT.written(pr).map(Outcome::Value).ok_or(WRONG_ARGUMENT);
        }
        if a.type_code == codes.parameter_store { Ok(Outcome::Value(0)) } else { Err(WRONG_TYPE) }
    }

    /// Starts profile motion: on the change from 10h to 17h, with the axis at rest.
    fn start(&mut self, type_code: u8, from_idle: bool) -> Outcomes {
        let distance = if type_code == PROFILE_RELATIVE {
            self.data1
        } else if type_code == self.config.codes.profile_absolute {
            self.data1.wrapping_sub(self.motion.command)
        } else {
            return Err(WRONG_TYPE);
        };
        if !from_idle || self.motion.profile.is_some() || !self.motion.is_active() {
            return Ok(Outcome::Failed);
        }
        self.motion.start(Generator::new(distance), self.config.manners.in_progress_late);
        Ok(Outcome::Value(0))
    }

    /// A monitor value; index 0, for the position deviation also 1 and 2.
    pub(super) fn monitor(&self, code: u16, index: u16) -> Result<i32, u16> {
        let motion = &self.motion;
        let value = match code {
            PERR => motion.deviation(),
            MPOS | IPOS => motion.command,
            ASPD => self.speed(motion.actual_step),
            TRQ => motion.torque,
            APOS => motion.actual,
            LPOS1 => self.latches[0].unwrap_or(UNDEFINED),
            LPOS2 => self.latches[1].unwrap_or(UNDEFINED),
            MSPD => self.speed(motion.command_step),
            REGENERATIVE_LOAD | OVERLOAD => 0,
            _ => return Err(WRONG_TYPE),
        };
        let last = if code == PERR { 2 } else { 0 };
        if index > last { Err(WRONG_ARGUMENT) } else { Ok(value) }
    }
}

/// What a latch position is before the latch is complete.
const UNDEFINED: i32 = 0x5a5a_5a5a;

/// Bytes 12-15 of an alarm answer.
fn words(Alarm { main, sub }: Alarm, warning: u16) -> i32 {
    let [low, high] = warning.to_le_bytes();
    i32::from_le_bytes([main, sub, low, high])
}

/// Four characters of a system ID text.
pub(super) fn text(code: u16, index: u16) -> Result<i32, u16> {
    let found = TEXTS.iter().find(|(new, conventional, _)| *new == code || *conventional == code);
    let (.., text) = found.ok_or(WRONG_TYPE)?;
    let at = usize::from(index).saturating_mul(4);
    let group = text.get(at..).ok_or(WRONG_ARGUMENT)?;
    Ok(group.iter().take(4).rev().fold(0, |word, character| word << 8 | i32::from(*character)))
}

/// A request of the same kind about something else: what a forgetful drive answers to before it has understood.
fn other(request: &NonCyclicCommand) -> NonCyclicCommand {
    let about = |a: Arguments| Arguments { type_code: TypeCode::truncate(a.type_code.get() ^ 1), ..a };
    match *request {
        NonCyclicCommand::Reset(a) => NonCyclicCommand::Reset(about(a)),
        NonCyclicCommand::SystemId(a) => NonCyclicCommand::SystemId(Arguments { index: a.index ^ 1, ..a }),
        NonCyclicCommand::Alarm(a) => NonCyclicCommand::Alarm(about(a)),
        NonCyclicCommand::Parameter(a) => NonCyclicCommand::Parameter(Arguments { index: a.index ^ 1, ..a }),
        NonCyclicCommand::Monitor(a) => NonCyclicCommand::Monitor(about(a)),
        NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data } => {
            let type_code = type_code ^ 1;
            NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data }
        }
        NonCyclicCommand::Profile { type_code, latch_sel1, monitor_sel, target_speed } => {
            NonCyclicCommand::Profile { type_code: type_code ^ 1, latch_sel1, monitor_sel, target_speed }
        }
        normal @ NonCyclicCommand::Normal { .. } => normal,
    }
}

/// Whether the master holds a command rather than asks for another. Target speed and feed-forward may change meanwhile.
fn is_same(old: &NonCyclicCommand, new: &NonCyclicCommand) -> bool {
    let same = |a: &Arguments, b: &Arguments| a.type_code == b.type_code && a.index == b.index;
    match (old, new) {
        (NonCyclicCommand::Profile { type_code: a, .. }, NonCyclicCommand::Profile { type_code: b, .. }) => a == b,
        (NonCyclicCommand::Monitor(a), NonCyclicCommand::Monitor(b))
        | (NonCyclicCommand::SystemId(a), NonCyclicCommand::SystemId(b))
        | (NonCyclicCommand::Alarm(a), NonCyclicCommand::Alarm(b)) => same(a, b),
        _ => old == new,
    }
}
