//! Execution of non-cyclic commands.

use super::Drive;
use crate::code::Code;
use crate::device::motion::MAX_TORQUE;
use crate::device::parameters::FEED_FORWARD;
use crate::device::profile::Generator;
use crate::error_code::{Alarm, ErrorCode};
use crate::execution::{Execution, LatchFlags, ProfileFlags};
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::{NonCyclicResponse, Results};
use crate::position::step;
use crate::type_code::{Pr, TypeCode, homing, monitor, parameter, profile, reset, system_id};

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
    Live(TypeCode),
    Failed,
}

type Outcomes = Result<Outcome, ErrorCode>;

const TEXTS: [(TypeCode, &[u8]); 6] = [
    (system_id::VENDOR_NAME, b"Panasonic"),
    (system_id::DEVICE_TYPE, b"1"),
    (system_id::MODEL, b"DRIVE MODEL"),
    (system_id::SERIAL_NUMBER, b"00000000"),
    (system_id::SOFTWARE_VERSION, b"0.1"),
    (system_id::DRIVER_TYPE, b"A"),
];

impl Drive {
    /// Takes the non-cyclic half of an accepted command; `before` is the code of the command before it.
    pub(super) fn serve(&mut self, request: NonCyclicCommand, before: Code) -> Result<(), ErrorCode> {
        self.check_feed_forward(&request)?;
        if let Some(job) = &mut self.job {
            if is_same(&job.request, &request) {
                job.busy = job.busy.saturating_sub(1);
                job.request = request;
                return Ok(());
            }
        }
        self.job = None;
        let outcome = match request {
            NonCyclicCommand::Normal { .. } => return Ok(()),
            NonCyclicCommand::Reset(a) => self.reset(a)?,
            NonCyclicCommand::SystemId(a) => Outcome::Value(text(a.type_code, a.index)?),
            NonCyclicCommand::Homing { type_code, setting_data, .. } => self.home(type_code, setting_data)?,
            NonCyclicCommand::Alarm(a) => self.alarms(a)?,
            NonCyclicCommand::Parameter(a) => self.parameter(a)?,
            NonCyclicCommand::Profile { type_code, .. } => self.start(type_code, before)?,
            NonCyclicCommand::Monitor(a) => {
                self.monitor(a.type_code, a.index)?;
                Outcome::Live(a.type_code)
            }
        };
        let slow = matches!(request, NonCyclicCommand::Reset(_) | NonCyclicCommand::Parameter(_));
        self.job = Some(Job { request, busy: if slow { self.config.busy_exchanges } else { 0 }, outcome });
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
        let busy = job.busy > 0;
        let (err, data) = match job.outcome {
            _ if busy => (false, 0),
            Outcome::Value(data) => (false, data),
            Outcome::Live(code) => (false, self.monitor(code, 0).unwrap_or(0)),
            Outcome::Failed => (true, 0),
        };
        let flags = |on: bool, flag| if on { flag } else { Execution::empty() };
        let execution = flags(err, Execution::ERR) | flags(busy, Execution::BUSY);
        let results = |a: Arguments| Results { execution, type_code: a.type_code, index: a.index, data };
        let selected = |code: u8| self.monitor(TypeCode::short(code), 0).unwrap_or(0);
        match job.request {
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
            NonCyclicCommand::Profile { type_code, latch_sel1, monitor_sel, .. } => NonCyclicResponse::Profile {
                execution: flags(err, Execution::ERR) | flags(self.motion.profile.is_some(), Execution::BUSY),
                type_code,
                flags: self.profile_flags(),
                latch_sel1,
                monitor_sel,
                monitor_data: selected(monitor_sel),
            },
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
        let mut flags = ProfileFlags::empty();
        flags.set(ProfileFlags::NEAR, self.is_near());
        flags.set(ProfileFlags::LATCH_COMP1, self.latches[0].is_some());
        flags
    }

    fn check_feed_forward(&self, request: &NonCyclicCommand) -> Result<(), ErrorCode> {
        let data3 = match request {
            NonCyclicCommand::Normal { command_data3, .. } => *command_data3,
            NonCyclicCommand::Reset(a)
            | NonCyclicCommand::SystemId(a)
            | NonCyclicCommand::Alarm(a)
            | NonCyclicCommand::Monitor(a) => a.data,
            // These use bytes 12-15 themselves, or may.
            NonCyclicCommand::Parameter(_) | NonCyclicCommand::Homing { .. } | NonCyclicCommand::Profile { .. } => {
                return Ok(());
            }
        };
        match self.parameters.value(FEED_FORWARD) {
            0 if data3 != 0 => Err(ErrorCode::ARGUMENT),
            2 if data3.saturating_abs() > MAX_TORQUE => Err(ErrorCode::FEED_FORWARD),
            _ => Ok(()),
        }
    }

    fn reset(&mut self, a: Arguments) -> Outcomes {
        if a.index != 0 {
            return Err(ErrorCode::ARGUMENT);
        }
        match a.type_code {
            reset::SOFTWARE | reset::ATTRIBUTE_C if self.motion.is_active() => Ok(Outcome::Failed),
            reset::SOFTWARE => {
                self.clear_alarm();
                Ok(Outcome::Value(0))
            }
            reset::ATTRIBUTE_C => Ok(Outcome::Value(0)),
            _ => Err(ErrorCode::TYPE_CODE),
        }
    }

    fn home(&mut self, type_code: u8, position: i32) -> Outcomes {
        match type_code {
            homing::SET_ACTUAL_POSITION | homing::SET_COMMAND_POSITION if self.motion.is_active() => {
                Ok(Outcome::Failed)
            }
            // With the servo off the command position is the actual position, so both set the same.
            homing::SET_ACTUAL_POSITION | homing::SET_COMMAND_POSITION => {
                self.motion.set_actual(position);
                self.homed = true;
                Ok(Outcome::Value(0))
            }
            homing::LATCH_STATE => Ok(Outcome::Value(0)),
            _ => Err(ErrorCode::TYPE_CODE),
        }
    }

    fn alarms(&mut self, a: Arguments) -> Outcomes {
        let codes = self.config.codes;
        let none = Alarm { main: 0, sub: 0 };
        if a.type_code == codes.alarm_active {
            return Ok(Outcome::Value(Results::alarm_data(self.alarm.unwrap_or(none), self.warning)));
        }
        if a.type_code == codes.alarm_history {
            let entry = usize::from(a.index).checked_sub(1).and_then(|k| self.history.get(k));
            let alarm = entry.ok_or(ErrorCode::ARGUMENT)?;
            return Ok(Outcome::Value(Results::alarm_data(alarm.unwrap_or(none), 0)));
        }
        if a.type_code == codes.alarm_clear {
            self.clear_alarm();
            return Ok(Outcome::Value(0));
        }
        Err(ErrorCode::TYPE_CODE)
    }

    fn parameter(&mut self, a: Arguments) -> Outcomes {
        let pr = Pr::from_index(a.index);
        let codes = self.config.codes;
        let value = self.parameters.get(pr).ok_or(ErrorCode::ARGUMENT);
        if a.type_code == parameter::WRITE {
            return if self.parameters.set(pr, a.data) { Ok(Outcome::Value(a.data)) } else { Err(ErrorCode::ARGUMENT) };
        }
        if a.type_code == codes.parameter_read {
            return value.map(Outcome::Value);
        }
        if a.type_code == codes.parameter_store { Ok(Outcome::Value(0)) } else { Err(ErrorCode::TYPE_CODE) }
    }

    /// Starts profile motion: on the change from 10h to 17h, with the axis at rest.
    fn start(&mut self, type_code: u8, before: Code) -> Outcomes {
        let distance = if type_code == profile::RELATIVE {
            self.data1
        } else if type_code == self.config.codes.profile_absolute {
            step(self.motion.command, self.data1)
        } else {
            return Err(ErrorCode::TYPE_CODE);
        };
        if before != Code::PROFILE_IDLE || self.motion.profile.is_some() || !self.motion.is_active() {
            return Ok(Outcome::Failed);
        }
        self.motion.profile = Some(Generator::new(distance));
        Ok(Outcome::Value(0))
    }

    /// A monitor value; index 0, for the position deviation also 1 and 2.
    pub(super) fn monitor(&self, code: TypeCode, index: u16) -> Result<i32, ErrorCode> {
        let motion = &self.motion;
        let value = match code {
            monitor::PERR => motion.deviation(),
            monitor::MPOS | monitor::IPOS => motion.command,
            monitor::ASPD => self.speed(motion.actual_step),
            monitor::TRQ => motion.torque,
            monitor::APOS => motion.actual,
            monitor::LPOS1 => self.latches[0].unwrap_or(0),
            monitor::LPOS2 => self.latches[1].unwrap_or(0),
            monitor::MSPD => self.speed(motion.command_step),
            monitor::REGENERATIVE_LOAD | monitor::OVERLOAD => 0,
            _ => return Err(ErrorCode::TYPE_CODE),
        };
        let last = if code == monitor::PERR { 2 } else { 0 };
        if index > last { Err(ErrorCode::ARGUMENT) } else { Ok(value) }
    }
}

/// Four characters of a system ID text.
pub(super) fn text(code: TypeCode, index: u16) -> Result<i32, ErrorCode> {
    let found = TEXTS.iter().find(|(known, _)| *known == code || system_id::conventional(*known) == Some(code));
    let (_, text) = found.ok_or(ErrorCode::TYPE_CODE)?;
    if usize::from(index).saturating_mul(4) > text.len() {
        return Err(ErrorCode::ARGUMENT);
    }
    Ok(i32::from_le_bytes(system_id::group(text, index)))
}

/// Whether the master holds a command rather than asks for another. Target speed and feed-forward may change meanwhile.
fn is_same(old: &NonCyclicCommand, new: &NonCyclicCommand) -> bool {
    match (old, new) {
        (NonCyclicCommand::Profile { type_code: a, .. }, NonCyclicCommand::Profile { type_code: b, .. }) => a == b,
        (NonCyclicCommand::Monitor(a), NonCyclicCommand::Monitor(b)) => {
            a.type_code == b.type_code && a.index == b.index
        }
        _ => old == new,
    }
}
