//! Procedures of several requests: texts, parameters, alarms, homing, latch.
//!
//! Call `receive` of a procedure once in every update period, after the exchange, until it is done. It asks through its axis,
//! so nothing else may ask meanwhile. Type codes that no document at hand confirms are the caller's.

mod parameters;

pub use parameters::{Backup, Restore};

use super::axis::Axis;
use super::progress::{Failure, Progress};
use super::servo_off::ActiveCode;
use crate::error_code::Alarm;
use crate::execution::LatchFlags;
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::NonCyclicResponse;
use crate::status::StatusFlags;
use crate::type_code::{Nibble, TypeCode, homing, system_id};

/// One request of a procedure: sent as soon as the axis takes it, then awaited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Ask {
    asked: bool,
}

impl Ask {
    /// The answer to `request`, when it is there.
    fn receive(&mut self, axis: &mut Axis, request: NonCyclicCommand) -> Progress<NonCyclicResponse> {
        let pending = Progress::Pending { left: axis.answer_left() };
        if self.asked {
            let outcome = axis.take_outcome();
            self.asked = outcome.is_none();
            return outcome.unwrap_or(pending);
        }
        if axis.can_ask() {
            match axis.ask(request) {
                Ok(()) => self.asked = true,
                Err(error) => return Progress::Failed { error: Failure::NotSent(error) },
            }
        }
        pending
    }
}

/// Reads a text of the drive, group by group: vendor, model, serial number ([`system_id`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReadText {
    ask: Ask,
    type_code: TypeCode,
    text: Text,
}

/// A text of a drive, at most 32 characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Text {
    bytes: [u8; 32],
    len: u8,
}

impl Text {
    /// The characters, as the drive sent them.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&[])
    }

    /// Whether nothing can follow: the group had a NUL, or there is no room.
    fn append(&mut self, group: [u8; 4]) -> bool {
        let text = system_id::text(&group);
        let free = self.bytes.iter_mut().skip(self.len.into());
        let added = free.zip(text).map(|(to, from)| *to = *from).count();
        self.len = self.len.saturating_add(u8::try_from(added).unwrap_or(0));
        text.len() < group.len() || usize::from(self.len) == self.bytes.len()
    }
}

impl ReadText {
    /// Reads the text with this type code, one of [`system_id`].
    pub const fn new(type_code: TypeCode) -> Self {
        Self { ask: Ask { asked: false }, type_code, text: Text { bytes: [0; 32], len: 0 } }
    }

    /// To be called once in every update period.
    pub fn receive(&mut self, axis: &mut Axis) -> Progress<Text> {
        let index = u16::from(self.text.len / 4);
        let request = NonCyclicCommand::SystemId(Arguments { type_code: self.type_code, index, data: 0 });
        match self.ask.receive(axis, request) {
            Progress::Done { value: NonCyclicResponse::SystemId(results) } => {
                if self.text.append(results.characters()) {
                    return Progress::Done { value: self.text };
                }
                Progress::Pending { left: axis.answer_left() }
            }
            // Never: a system ID request is done with a system ID response.
            Progress::Done { .. } => Progress::Failed { error: Failure::TimedOut },
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}

/// Reads the alarm history, from the latest entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AlarmHistory {
    ask: Ask,
    type_code: TypeCode,
    index: u16,
}

impl AlarmHistory {
    /// With the type code of the history as the drive's manual gives it; the index counts from 1.
    pub const fn new(type_code: TypeCode) -> Self {
        Self { ask: Ask { asked: false }, type_code, index: 1 }
    }

    /// To be called once in every update period; fills `entries` from the latest alarm. Main and sub code 0 are an empty
    /// entry.
    pub fn receive(&mut self, axis: &mut Axis, entries: &mut [Alarm]) -> Progress<()> {
        let Some(place) = entries.get_mut(usize::from(self.index).saturating_sub(1)) else {
            return Progress::Done { value: () };
        };
        let request = NonCyclicCommand::Alarm(Arguments { type_code: self.type_code, index: self.index, data: 0 });
        match self.ask.receive(axis, request) {
            Progress::Done { value: NonCyclicResponse::Alarm(results) } => {
                (*place, _) = results.alarm();
                self.index = self.index.saturating_add(1);
                if usize::from(self.index) > entries.len() {
                    return Progress::Done { value: () };
                }
                Progress::Pending { left: axis.answer_left() }
            }
            // Never: an alarm request is done with an alarm response.
            Progress::Done { .. } => Progress::Failed { error: Failure::TimedOut },
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}

/// Homing by the drive: the command with the caller's type code, and then the end of the drive's motion.
///
/// Only in PP: in the other modes the set-point would know nothing of the motion, nor of the new coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Home {
    ask: Ask,
    type_code: u8,
    left: u32,
    accepted: bool,
    /// Homing_Complete was 0, or In_Progress 1: what it says now is not left from an earlier homing.
    fresh: bool,
}

impl Home {
    /// A homing of this type; the drive has `limit` update periods after it has accepted the command.
    pub const fn new(type_code: u8, limit: u32) -> Self {
        Self { ask: Ask { asked: false }, type_code, left: limit, accepted: false, fresh: false }
    }

    /// To be called once in every update period. `Done` when Homing_Complete is 1 and In_Progress is 0, and at least one of
    /// them was different since the command went out: Homing_Complete may be left from an earlier homing.
    pub fn receive(&mut self, axis: &mut Axis) -> Progress<()> {
        if axis.mode() != ActiveCode::ProfilePosition {
            return Progress::Failed { error: Failure::Mode };
        }
        let status = axis.status();
        let [complete, moves] =
            [StatusFlags::HOMING_COMPLETE, StatusFlags::IN_PROGRESS].map(|flag| status.contains(flag));
        self.fresh |= (self.ask.asked || self.accepted) && (moves || !complete);
        if !self.accepted {
            let request = NonCyclicCommand::Homing {
                type_code: self.type_code,
                latch_sel1: Nibble::ZERO,
                latch_sel2: Nibble::ZERO,
                monitor_sel: 0,
                setting_data: 0,
            };
            match self.ask.receive(axis, request) {
                Progress::Done { .. } => self.accepted = true,
                Progress::Pending { left } => return Progress::Pending { left },
                Progress::Failed { error } => return Progress::Failed { error },
            }
        }
        if self.fresh && complete && !moves {
            return Progress::Done { value: () };
        }
        match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Progress::Pending { left }
            }
            None => Progress::Failed { error: Failure::TimedOut },
        }
    }
}

/// Arms latch 1 and waits for its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Latch {
    ask: Ask,
    arm: u8,
    selection: Nibble,
    left: u32,
    armed: bool,
}

/// Monitor_Sel for LPOS1.
const LPOS1: u8 = 0x09;

impl Latch {
    /// Arms with the type code `arm` and the trigger `selection`, both as the drive's manual gives them; the trigger has
    /// `limit` update periods.
    pub const fn new(arm: u8, selection: Nibble, limit: u32) -> Self {
        Self { ask: Ask { asked: false }, arm, selection, left: limit, armed: false }
    }

    /// To be called once in every update period. The value is LPOS1, command units.
    ///
    /// After arming the state is read again and again (type 50h): the position counts only with Latch_Comp1.
    pub fn receive(&mut self, axis: &mut Axis) -> Progress<i32> {
        let Some(left) = self.left.checked_sub(1) else { return Progress::Failed { error: Failure::TimedOut } };
        self.left = left;
        let request = NonCyclicCommand::Homing {
            type_code: if self.armed { homing::LATCH_STATE } else { self.arm },
            latch_sel1: self.selection,
            latch_sel2: Nibble::ZERO,
            monitor_sel: LPOS1,
            setting_data: 0,
        };
        match self.ask.receive(axis, request) {
            Progress::Done { value: NonCyclicResponse::Homing { latch, monitor_data, .. } } => {
                // What was caught before arming is not the answer.
                if self.armed && latch.contains(LatchFlags::LATCH_COMP1) {
                    return Progress::Done { value: monitor_data };
                }
                self.armed = true;
                Progress::Pending { left }
            }
            Progress::Done { .. } | Progress::Pending { .. } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}
