//! Texts of a drive.

use super::ask::{Ask, procedure};
use crate::master::axis::Axis;
use crate::master::progress::Progress;
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::type_code::{TypeCode, system_id};

/// Reads a text of the drive, group by group: vendor, model, serial number ([`system_id`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ReadText {
    ask: Ask,
    type_code: TypeCode,
    text: Text,
    end: Option<Progress<Text>>,
}

/// A text of a drive, at most 32 characters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Text {
    bytes: [u8; 32],
    len: u8,
}

impl Text {
    const EMPTY: Self = Self { bytes: [0; 32], len: 0 };

    /// The characters, as the drive sent them.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&[])
    }

    /// Whether nothing can follow, because the group had a NUL or there is no more room.
    fn append(&mut self, group: [u8; 4]) -> bool {
        let text = system_id::text(&group);
        let free = self.bytes.iter_mut().skip(self.len.into());
        let added = free.zip(text).map(|(to, from)| *to = *from).count();
        self.len = self.len.saturating_add(u8::try_from(added).unwrap_or(0));
        text.len() < group.len() || usize::from(self.len) == self.bytes.len()
    }
}

procedure!(ReadText, Text);

impl ReadText {
    /// Reads the text with this type code, one of [`system_id`].
    pub const fn new(type_code: TypeCode) -> Self {
        Self { ask: Ask::NEW, type_code, text: Text::EMPTY, end: None }
    }

    const fn reset(&mut self) {
        (self.ask, self.text) = (Ask::NEW, Text::EMPTY);
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<Text> {
        let index = u16::from(self.text.len / 4);
        let request = NonCyclicCommand::SystemId(Arguments { type_code: self.type_code, index, data: 0 });
        self.ask.receive(axis, request).and_then(|response| {
            // A system ID request is done with a system ID response, which has data.
            let group = response.data().unwrap_or(0).to_le_bytes();
            if self.text.append(group) {
                Progress::Done { value: self.text }
            } else {
                Progress::Pending { left: axis.answer_left() }
            }
        })
    }
}
