//! What a drive reports about its alarms.

use super::ask::{Ask, procedure};
use crate::error_code::Alarm;
use crate::master::axis::Axis;
use crate::master::echo::Arrival;
use crate::master::progress::{Failure, Progress};
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::NonCyclicResponse;
use crate::status::StatusFlags;
use crate::type_code::TypeCode;

/// Reads the alarm history, from the latest entry.
#[derive(Debug)]
pub struct AlarmHistory<'a> {
    ask: Ask,
    type_code: TypeCode,
    entries: &'a mut [Alarm],
    place: u16,
    end: Option<Progress<()>>,
}

procedure!(AlarmHistory<'a>, ());

impl<'a> AlarmHistory<'a> {
    /// Creates the procedure. `type_code` is that of the history in the drive's manual, with an index that counts from 1;
    /// `entries` is filled from the latest alarm. Main and sub code 0 mean an empty entry.
    pub const fn new(type_code: TypeCode, entries: &'a mut [Alarm]) -> Self {
        Self { ask: Ask::NEW, type_code, entries, place: 0, end: None }
    }

    const fn reset(&mut self) {
        (self.ask, self.place) = (Ask::NEW, 0);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<()> {
        let Some(entry) = self.entries.get_mut(usize::from(self.place)) else {
            return Progress::Done { value: () };
        };
        let index = self.place.saturating_add(1);
        let request = NonCyclicCommand::Alarm(Arguments { type_code: self.type_code, index, data: 0 });
        self.ask.receive(axis, request).and_then(|response| {
            // An alarm request is done with an alarm response.
            if let NonCyclicResponse::Alarm(results) = response {
                *entry = results.alarm().alarm;
            }
            self.place = index;
            Progress::Pending { left: axis.answer_left() }
        })
    }
}

/// The attributes of the present alarm, as the drive sent them.
///
/// One of them says whether the alarm can be cleared. The drive's manual says which bit; the available pages of SX-DSV02310
/// state neither the bit nor the packing of an alarm number into an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Attributes {
    /// Index_Echo: the alarm to which they belong.
    pub alarm: u16,
    /// Bytes 12-15, byte 12 in bits 7-0.
    pub bits: u32,
}

impl Attributes {
    /// Returns whether the alarm can be cleared, according to the bits named in the drive's manual.
    ///
    /// ```
    /// use rtex_block::master::procedure::{Attributes, ClearableIf};
    /// let attributes = Attributes { alarm: 0x2601, bits: 0x0000_0004 };
    /// assert!(attributes.is_clearable(ClearableIf::Set(0x04)));
    /// assert!(!attributes.is_clearable(ClearableIf::Unset(0x04)));
    /// ```
    pub const fn is_clearable(&self, rule: ClearableIf) -> bool {
        match rule {
            ClearableIf::Set(mask) => mask != 0 && self.bits & mask == mask,
            ClearableIf::Unset(mask) => mask != 0 && self.bits & mask == 0,
        }
    }
}

/// How the attributes of an alarm say that it can be cleared. The available documents do not say, so take it from the
/// drive's manual. An empty mask says nothing, so no alarm counts as clearable with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum ClearableIf {
    /// All of these bits are 1 in the attributes of an alarm that can be cleared.
    Set(u32),
    /// All of these bits are 0 in the attributes of an alarm that can be cleared.
    Unset(u32),
}

/// Reads the attributes of the present alarm (Index 0). A drive without an alarm refuses the request or answers as described in
/// its manual.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AlarmAttributes {
    ask: Ask,
    type_code: TypeCode,
    end: Option<Progress<Attributes>>,
}

procedure!(AlarmAttributes, Attributes);

impl AlarmAttributes {
    /// Creates the procedure with the type code of the attributes given in the drive's manual.
    pub const fn new(type_code: TypeCode) -> Self {
        Self { ask: Ask::NEW, type_code, end: None }
    }

    const fn reset(&mut self) {
        self.ask = Ask::NEW;
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<Attributes> {
        let progress = self.ask.receive_with(axis, |axis| axis.ask_alarm_attributes(self.type_code));
        progress.and_then(|response| match response {
            NonCyclicResponse::Alarm(results) => Progress::Done {
                value: Attributes { alarm: results.index, bits: u32::from_le_bytes(results.data.to_le_bytes()) },
            },
            // Never: an alarm request is done with an alarm response.
            _ => Progress::Failed { error: Failure::TimedOut },
        })
    }
}

/// How an attempt to clear an alarm ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Clearing {
    /// Alarm is 0. If Alarm was 0 from the beginning, nothing was sent.
    Cleared,
    /// The drive failed to clear it (ERR), or reported success while Alarm stayed 1: the cause persists, or only switching
    /// off the control power clears the alarm.
    NotClearable,
}

/// Clears the alarm and checks whether it is gone, which shows whether the alarm can be cleared without any knowledge of
/// attributes.
///
/// The command is sent once. The outcome depends on the Alarm flag in the blocks received after the answer, not on the answer
/// alone.
/// [`Failure::CommandError`]: the drive does not know the type code, which says nothing about the alarm.
/// [`Failure::TimedOut`]: no answer came and Alarm is still 1, or no block came at all.
///
/// An axis with an alarm is stopped; once the alarm is gone, [`Axis::clear`](Axis::clear) restarts it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ClearAlarm {
    ask: Ask,
    type_code: TypeCode,
    limit: u32,
    left: u32,
    /// Number of good blocks up to the last call.
    good: Option<u64>,
    /// The answer to the command, once it is known.
    answer: Option<Result<(), Failure>>,
    end: Option<Progress<Clearing>>,
}

procedure!(ClearAlarm, Clearing);

impl ClearAlarm {
    /// Creates the procedure with the type code, given in the drive's manual, that clears the present alarm (Index 0);
    /// Alarm has `limit` update periods to go to 0 after the answer.
    pub const fn new(type_code: TypeCode, limit: u32) -> Self {
        Self { ask: Ask::NEW, type_code, limit, left: limit, good: None, answer: None, end: None }
    }

    const fn reset(&mut self) {
        (self.ask, self.left, self.good, self.answer) = (Ask::NEW, self.limit, None, None);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<Clearing> {
        let good = axis.counters().good();
        // Status_Flags are those of the last block on time, which may be old.
        let is_fresh = self.good.replace(good).is_some_and(|last| last != good) && axis.arrival() == Arrival::OnTime;
        let alarm = axis.status().contains(StatusFlags::ALARM);
        if is_fresh && !alarm && !self.ask.asked {
            return Progress::Done { value: Clearing::Cleared };
        }
        match self.answer {
            None if self.ask.asked || is_fresh => self.send(axis),
            Some(Err(Failure::Execution)) if is_fresh => Progress::Done { value: Clearing::NotClearable },
            answer => self.wait(answer == Some(Ok(())) && is_fresh),
        }
    }

    fn send(&mut self, axis: &mut Axis) -> Progress<Clearing> {
        let request = NonCyclicCommand::Alarm(Arguments { type_code: self.type_code, index: 0, data: 0 });
        match self.ask.receive(axis, request) {
            Progress::Done { .. } => self.answer = Some(Ok(())),
            Progress::Failed { error: error @ (Failure::Execution | Failure::TimedOut) } => {
                self.answer = Some(Err(error));
            }
            Progress::Failed { error } => return Progress::Failed { error },
            Progress::Pending { left } => return Progress::Pending { left },
        }
        Progress::Pending { left: self.left }
    }

    /// Alarm is 1, or nothing is known about it; `accepted` if the drive nevertheless says that it has cleared the alarm.
    const fn wait(&mut self, accepted: bool) -> Progress<Clearing> {
        match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Progress::Pending { left }
            }
            None if accepted => Progress::Done { value: Clearing::NotClearable },
            None => Progress::Failed { error: Failure::TimedOut },
        }
    }
}
