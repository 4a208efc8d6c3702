//! Procedures of several requests: texts, parameters, alarms, homing, latch.
//!
//! Call `receive` of a procedure once in every update period, after the exchange, until it is done. It asks through its axis,
//! so nothing else may ask meanwhile. Type codes that no document at hand confirms are the caller's.

mod alarms;
mod homing;
mod latch;
mod parameters;

pub use alarms::{AlarmAttributes, AlarmHistory, Attributes, ClearAlarm, ClearableIf, Clearing};
pub use homing::{Home, SetPosition};
pub use latch::{Caught, Latch};
pub use parameters::{Backup, ParameterValue, Restore};

use super::axis::Axis;
use super::progress::{Failure, Progress};
use super::state::AskError;
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::NonCyclicResponse;
use crate::type_code::{TypeCode, system_id};

/// One request of a procedure: sent as soon as the axis takes it, then awaited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Ask {
    asked: bool,
}

impl Ask {
    /// The answer to `request`, when it is there.
    fn receive(&mut self, axis: &mut Axis, request: NonCyclicCommand) -> Progress<NonCyclicResponse> {
        self.receive_with(axis, |axis| axis.ask(request))
    }

    /// The answer to what `send` asks for, when it is there.
    fn receive_with(
        &mut self,
        axis: &mut Axis,
        send: impl FnOnce(&mut Axis) -> Result<(), AskError>,
    ) -> Progress<NonCyclicResponse> {
        let pending = Progress::Pending { left: axis.answer_left() };
        if self.asked {
            let outcome = axis.take_outcome();
            self.asked = outcome.is_none();
            return outcome.unwrap_or(pending);
        }
        if axis.can_ask() {
            match send(axis) {
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
