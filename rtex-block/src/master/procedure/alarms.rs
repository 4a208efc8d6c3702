//! What a drive tells about its alarms.

use super::Ask;
use crate::error_code::Alarm;
use crate::master::axis::Axis;
use crate::master::progress::{Failure, Progress};
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::NonCyclicResponse;
use crate::type_code::TypeCode;

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
                Progress::Pending { left: axis.answer_left() }
            }
            // Never: an alarm request is done with an alarm response.
            Progress::Done { .. } => Progress::Failed { error: Failure::TimedOut },
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}

/// The attributes of the alarm that is being issued, as the drive sent them.
///
/// Whether the alarm can be cleared is one of them. Which bit says so is in the drive's manual; the pages of SX-DSV02310
/// at hand do not give it, and neither do they say how the number of an alarm is packed into an index.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Attributes {
    /// Index_Echo: the alarm they belong to.
    pub alarm: u16,
    /// Bytes 12-15, byte 12 in bits 7-0.
    pub bits: u32,
}

/// Reads the attributes of the alarm that is being issued (Index 0).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct AlarmAttributes {
    ask: Ask,
    type_code: TypeCode,
}

impl AlarmAttributes {
    /// With the type code of the attributes as the drive's manual gives it.
    pub const fn new(type_code: TypeCode) -> Self {
        Self { ask: Ask { asked: false }, type_code }
    }

    /// To be called once in every update period. A drive without an alarm refuses, or answers as its manual says.
    pub fn receive(&mut self, axis: &mut Axis) -> Progress<Attributes> {
        match self.ask.receive_with(axis, |axis| axis.ask_alarm_attributes(self.type_code)) {
            Progress::Done { value: NonCyclicResponse::Alarm(results) } => Progress::Done {
                value: Attributes { alarm: results.index, bits: u32::from_le_bytes(results.data.to_le_bytes()) },
            },
            // Never: an alarm request is done with an alarm response.
            Progress::Done { .. } => Progress::Failed { error: Failure::TimedOut },
            Progress::Pending { left } => Progress::Pending { left },
            Progress::Failed { error } => Progress::Failed { error },
        }
    }
}
