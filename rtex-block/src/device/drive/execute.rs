//! Execution of non-cyclic commands.

use super::Drive;
use super::job::{Job, Outcome};
use crate::device::behaviour::Quirks;
use crate::device::literals::{
    ALARM, APOS, ASPD, HOMING, HOMING_ACTUAL, HOMING_COMMAND, HOMING_LATCH, IPOS, LATCH_COMP1, LATCH_COMP2, LPOS1,
    LPOS2, MONITOR, MPOS, MSPD, NEAR, NORMAL, OVERLOAD, PARAMETER, PARAMETER_WRITE, PERR, PROFILE, PROFILE_RELATIVE,
    REGENERATIVE_LOAD, RESET, RESET_ATTRIBUTE_C, RESET_SOFTWARE, SHOWN_IN_PROGRESS, SYSTEM_ID, TEXTS, TRQ,
    WRONG_ARGUMENT, WRONG_FEED_FORWARD, WRONG_TYPE,
};
use crate::device::motion::MAX_TORQUE;
use crate::device::parameters::{FEED_FORWARD, Parameters};
use crate::device::profile::Generator;
use crate::device::wire::{Execution, Request, error, pair};
use crate::error_code::Alarm;

type Outcomes = Result<Outcome, u16>;

impl Drive {
    /// Takes the non-cyclic half of an accepted command; `from_idle` if the code before was 10h.
    pub(super) fn serve(&mut self, request: Request, from_idle: bool) -> Result<(), u16> {
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
        let (type_code, index) = (request.type_code(), request.index());
        let outcome = match request.code {
            NORMAL => return Ok(()),
            RESET => self.reset(type_code, index)?,
            SYSTEM_ID => Outcome::Value(text(type_code, index)?),
            HOMING => self.home(&request)?,
            ALARM => self.alarms(type_code, index)?,
            PARAMETER => self.parameter(type_code, index, request.data())?,
            PROFILE => self.start(type_code, from_idle)?,
            _ => {
                self.monitor(type_code, index)?;
                Outcome::Live(type_code)
            }
        };
        let behaviour = self.behaviour;
        let slow = matches!(request.code, RESET | PARAMETER);
        let busy = if slow || behaviour.does(Quirks::ALWAYS_BUSY) { self.config.busy_exchanges } else { 0 };
        self.job = Some(Job { request, busy, outcome });
        // What a forgetful drive answers to before it has understood.
        let old = old.unwrap_or_else(|| request.other(matches!(request.code, SYSTEM_ID | PARAMETER)));
        self.stale = (behaviour.stale_answers > 0).then_some((old, behaviour.stale_answers));
        Ok(())
    }

    /// Returns bytes 8-15 of the response; `shown` is its byte 2.
    pub(super) fn noncyclic(&self, shown: u8) -> [u8; 8] {
        if let Some(code) = self.error {
            return error(code);
        }
        let Some(job) = &self.job else {
            let [_, response_data2, response_data3] = self.response_data();
            return pair(response_data2, response_data3);
        };
        // The echoes of a request of another kind would have another layout under this code.
        let stale = self.stale.map(|(old, _)| old).filter(|old| old.code == job.request.code);
        let request = stale.unwrap_or(job.request);
        let mut index = request.index();
        let (err, data) = match job.outcome {
            Outcome::Failed => (job.busy == 0 || self.behaviour.does(Quirks::ERR_WHILE_BUSY), 0),
            _ if job.busy > 0 => (false, 0),
            Outcome::Value(data) => (false, data),
            Outcome::Live(code) => (false, self.monitor(code, 0).unwrap_or(0)),
            Outcome::Attributes(Alarm { main, sub }) => {
                index = if stale.is_none() { u16::from_be_bytes([main, sub]) } else { index };
                (false, self.config.alarm_attributes)
            }
        };
        let busy = match request.code {
            PROFILE => shown & SHOWN_IN_PROGRESS != 0,
            HOMING if request.type_code() == u16::from(self.config.codes.homing) => job.busy > 0 || self.homes_busily(),
            _ => job.busy > 0,
        };
        let new = stale.is_none();
        let execution = Execution { err: err && new, wng: self.behaviour.does(Quirks::WARNS), busy: busy && new };
        match request.code {
            HOMING | PROFILE => {
                let flags = if request.code == HOMING { self.latched } else { self.profile_flags() };
                let data = self.monitor(request.monitor_sel().into(), 0).unwrap_or(0);
                request.answer(execution, index, flags, data)
            }
            _ => request.answer(execution, index, 0, data),
        }
    }

    /// Whether a homing is under way, in a drive that shows it as Busy.
    const fn homes_busily(&self) -> bool {
        self.homing && self.behaviour.does(Quirks::BUSY_WHILE_HOMING)
    }

    /// Latch_Comp1 and 2 as they are now; the answers may show them later.
    pub(super) const fn latch_flags(&self) -> u8 {
        let [one, two] = self.latches;
        (if one.is_some() { LATCH_COMP1 } else { 0 }) | (if two.is_some() { LATCH_COMP2 } else { 0 })
    }

    fn profile_flags(&self) -> u8 {
        let to_go = self.motion.profile.map_or(0, |generator| generator.distance_to_go());
        let near = to_go.unsigned_abs() <= self.config.near.into();
        self.latched & LATCH_COMP1 | if near { NEAR } else { 0 }
    }

    /// Takes Command_Data3 as feed-forward, unless the command uses it itself. In that case, and if the new value is
    /// refused, the old feed-forward stays.
    fn feed(&mut self, request: &Request) -> Result<(), u16> {
        let own = match (request.code, request.type_code()) {
            (HOMING, HOMING_ACTUAL | HOMING_COMMAND) | (PARAMETER, PARAMETER_WRITE) => true,
            (code, _) => code == PROFILE,
        };
        if own {
            return Ok(());
        }
        let data3 = request.data();
        match self.parameters.value(FEED_FORWARD) {
            0 if data3 != 0 => Err(WRONG_ARGUMENT),
            2 if data3.saturating_abs() > MAX_TORQUE => Err(WRONG_FEED_FORWARD),
            _ => {
                self.feed_forward = data3;
                Ok(())
            }
        }
    }

    fn reset(&mut self, type_code: u16, index: u16) -> Outcomes {
        if index != 0 {
            return Err(WRONG_ARGUMENT);
        }
        match type_code {
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

    fn home(&mut self, request: &Request) -> Outcomes {
        let active = self.motion.is_active();
        let (arm, homing) = (u16::from(self.config.codes.latch_arm), u16::from(self.config.codes.homing));
        match request.type_code() {
            HOMING_ACTUAL | HOMING_COMMAND if active && !self.behaviour.does(Quirks::SETS_POSITION_WHILE_ON) => {
                return Ok(Outcome::Failed);
            }
            kind @ (HOMING_ACTUAL | HOMING_COMMAND) => {
                let now = if kind == HOMING_ACTUAL { self.motion.actual } else { self.motion.command };
                self.motion.shift(request.data().wrapping_sub(now));
                self.homed = true;
            }
            HOMING_LATCH => {}
            kind if kind == arm => {
                self.armed = [true; 2];
                self.latches = [None; 2];
            }
            kind if kind == homing && active => {
                self.homed &= self.behaviour.does(Quirks::HOMED_THROUGH_HOMING);
                self.homing = true;
                self.motion.home(self.config.homing_distance);
            }
            kind if kind == homing => return Ok(Outcome::Failed),
            _ => return Err(WRONG_TYPE),
        }
        Ok(Outcome::Value(0))
    }

    fn alarms(&mut self, type_code: u16, index: u16) -> Outcomes {
        let codes = self.config.codes;
        let none = Alarm { main: 0, sub: 0 };
        if type_code == codes.alarm_active.get() {
            return Ok(Outcome::Value(words(self.alarm.unwrap_or(none), self.warning)));
        }
        if type_code == codes.alarm_attributes.get() {
            let alarm = if index == 0 { self.alarm } else { None };
            return alarm.map(Outcome::Attributes).ok_or(WRONG_ARGUMENT);
        }
        if type_code == codes.alarm_history.get() {
            let entry = usize::from(index).checked_sub(1).and_then(|k| self.history.get(k));
            let alarm = entry.ok_or(WRONG_ARGUMENT)?;
            return Ok(Outcome::Value(words(alarm.unwrap_or(none), 0)));
        }
        if type_code == codes.alarm_clear.get() {
            if self.behaviour.does(Quirks::REFUSES_TO_CLEAR) && self.alarm.is_some() {
                return Ok(Outcome::Failed);
            }
            if !self.behaviour.does(Quirks::ALARM_STAYS) {
                self.clear_alarm();
            }
            return Ok(Outcome::Value(0));
        }
        Err(WRONG_TYPE)
    }

    fn parameter(&mut self, type_code: u16, index: u16, data: i32) -> Outcomes {
        let codes = self.config.codes;
        let value = if type_code == PARAMETER_WRITE {
            let at_once = !self.behaviour.does(Quirks::PARAMETERS_AFTER_RESET);
            self.parameters.set(index, data, at_once).then_some(data)
        } else if type_code == codes.parameter_read.get() {
            self.parameters.written(index)
        } else if type_code == codes.parameter_initial.get() {
            Parameters::DEFAULT.written(index)
        } else if type_code == codes.parameter_count.get() {
            Parameters::count(index)
        } else if type_code == codes.parameter_store.get() {
            Some(0)
        } else {
            return Err(WRONG_TYPE);
        };
        value.map(Outcome::Value).ok_or(WRONG_ARGUMENT)
    }

    /// Starts profile motion: on the change from 10h to 17h, with the axis at rest.
    fn start(&mut self, type_code: u16, from_idle: bool) -> Outcomes {
        let distance = if type_code == PROFILE_RELATIVE {
            self.data1
        } else if type_code == u16::from(self.config.codes.profile_absolute) {
            self.data1.wrapping_sub(self.motion.command)
        } else {
            return Err(WRONG_TYPE);
        };
        if !from_idle || self.motion.profile.is_some() || !self.motion.is_active() {
            return Ok(Outcome::Failed);
        }
        self.motion.start(Generator::new(distance), self.behaviour.in_progress_late);
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

/// Value of a latch position before the latch is complete.
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

/// Whether the master still holds the same command rather than making a new request. Target speed and feed-forward may change
/// meanwhile.
fn is_same(old: &Request, new: &Request) -> bool {
    let same = old.code == new.code && old.type_code() == new.type_code();
    same && match old.code {
        PROFILE => true,
        MONITOR | SYSTEM_ID | ALARM => old.index() == new.index(),
        _ => old.bytes == new.bytes,
    }
}
