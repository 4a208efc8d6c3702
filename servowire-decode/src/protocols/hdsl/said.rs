//! Holds events that later frames may still refuse.

use std::collections::VecDeque;
use std::io;

use super::refused::Refused;
use crate::event::{Event, Refusal, Verdict};
use crate::sink::Sink;

/// Events in their order, each with a number.
#[derive(Debug, Default)]
pub(super) struct Said {
    events: VecDeque<Event>,
    /// Number of the first.
    first: u64,
}

impl Said {
    /// Number of the next event.
    pub(super) fn next(&self) -> u64 {
        self.first + self.events.len() as u64
    }

    pub(super) fn push(&mut self, event: Event) {
        self.events.push_back(event);
    }

    /// Refuses an event that seemed good.
    pub(super) fn refuse(&mut self, number: u64, (class, reason): Refused) {
        let at = number.checked_sub(self.first).and_then(|at| usize::try_from(at).ok());
        if let Some(event) = at.and_then(|at| self.events.get_mut(at)).filter(|event| event.verdict.is_ok()) {
            event.verdict = Verdict::from(Refusal::new(class, reason));
        }
    }

    /// Marks the field `name` as uncertain in the good events from number `from` onwards.
    pub(super) fn withhold(&mut self, from: u64, name: &str) {
        let first = self.first;
        let events = (first..).zip(&mut self.events).filter(|(number, event)| *number >= from && event.verdict.is_ok());
        for (_, event) in events {
            event.fields.retain(|field| field.name != name);
        }
    }

    /// Returns all events before number `until`.
    pub(super) fn give(&mut self, until: u64, out: &mut dyn Sink) -> io::Result<()> {
        while self.first < until {
            let Some(event) = self.events.pop_front() else { break };
            self.first += 1;
            out.event(&event)?;
        }
        Ok(())
    }
}
