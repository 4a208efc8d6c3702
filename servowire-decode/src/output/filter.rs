//! Which frames to show.

use std::collections::BTreeMap;

use super::printer::Origin;
use crate::event::{Direction, Event, Place};
use crate::time::Time;

/// The frames that the user wants to see; an unset field lets everything through.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Choice {
    /// The whole name of a frame or its last word, in upper or lower case.
    pub kinds: Vec<String>,
    /// Name of an encoder, drive or device.
    pub address: Option<i64>,
    /// Only frames sent by or to this encoder, given by its name, channel or address.
    pub encoder: Option<String>,
    /// The first instant that is shown.
    pub from: Option<Time>,
    /// Nothing is shown from this instant onwards.
    pub to: Option<Time>,
    /// Only refused frames.
    pub errors: bool,
}

/// Passes the chosen frames.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Filter {
    choice: Choice,
    /// For each line, whether the last request passed by its address.
    passed: BTreeMap<usize, bool>,
}

/// Reading continues for this long after the last time requested, in picoseconds, so that frames which began before it can
/// end.
const REST: i64 = 10_000_000_000;

impl Filter {
    /// Creates a filter for the frames that the user chose.
    pub fn new(choice: Choice) -> Self {
        Self { choice, passed: BTreeMap::new() }
    }

    /// Returns whether times matter.
    pub fn has_times(&self) -> bool {
        self.choice.from.is_some() || self.choice.to.is_some()
    }

    /// The first instant that is shown.
    pub(super) fn from(&self) -> Option<Time> {
        self.choice.from
    }

    /// Returns whether only refused frames are shown.
    pub(super) fn wants_errors_only(&self) -> bool {
        self.choice.errors
    }

    /// Returns whether nothing of interest can follow once a recording was read up to `time`.
    pub(super) fn is_over(&self, time: Time) -> bool {
        self.choice.to.is_some_and(|to| time > to + REST)
    }

    /// Returns whether an event passes the user's choice, apart from [`wants_errors_only`](Self::wants_errors_only).
    pub(super) fn takes(&mut self, origin: &Origin, event: &Event) -> bool {
        let is_meant = |encoder: &String| origin.is_meant(origin.speaker(event), encoder);
        self.choice.encoder.as_ref().is_none_or(is_meant) && self.passes(origin.speaks, event)
    }

    fn passes(&mut self, lane: usize, event: &Event) -> bool {
        // The address first: it is remembered from the request for an answer that does not tell it.
        self.is_addressed(lane, event) && self.is_kind(event) && self.is_in_time(event)
    }

    fn is_kind(&self, event: &Event) -> bool {
        let same = |kind: &String| {
            event.kind.eq_ignore_ascii_case(kind)
                || event.kind.rsplit(' ').next().is_some_and(|last| last.eq_ignore_ascii_case(kind))
        };
        self.choice.kinds.is_empty() || self.choice.kinds.iter().any(same)
    }

    fn is_in_time(&self, event: &Event) -> bool {
        match event.place {
            Place::Time { start, end } => {
                self.choice.from.is_none_or(|from| end > from) && self.choice.to.is_none_or(|to| start < to)
            }
            Place::Line(_) => true,
        }
    }

    fn is_addressed(&mut self, lane: usize, event: &Event) -> bool {
        let Some(wanted) = self.choice.address else { return true };
        let passes = match event.address {
            Some(address) => i64::from(address) == wanted,
            None => event.direction == Some(Direction::Answer) && self.passed.get(&lane).copied().unwrap_or(false),
        };
        if event.direction == Some(Direction::Request) {
            self.passed.insert(lane, passes);
        }
        passes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::Verdict;

    fn event(direction: Direction, kind: &'static str, address: Option<u32>, start: i128) -> Event {
        let start = Time::from_ps(start);
        let place = Place::Time { start, end: start + 10 };
        Event { address, ..Event::new(place, Some(direction), kind, Vec::new(), Verdict::Ok) }
    }

    #[test]
    fn kinds_by_name_or_last_word() {
        let mut filter = Filter::new(Choice { kinds: vec!["3".to_owned(), "abs40".to_owned()], ..Choice::default() });
        assert!(filter.passes(0, &event(Direction::Answer, "ID 3", None, 0)));
        assert!(filter.passes(0, &event(Direction::Answer, "ABS40", None, 0)));
        assert!(!filter.passes(0, &event(Direction::Answer, "ID D", None, 0)));
        assert!(!filter.passes(0, &event(Direction::Answer, "ABS40_MT", None, 0)));
    }

    #[test]
    fn an_answer_without_address_goes_with_its_request() {
        let mut filter = Filter::new(Choice { address: Some(2), ..Choice::default() });
        assert!(!filter.passes(0, &event(Direction::Request, "ABS40", Some(1), 0)));
        assert!(!filter.passes(0, &event(Direction::Answer, "ABS40", None, 0)));
        assert!(filter.passes(0, &event(Direction::Request, "ABS40", Some(2), 0)));
        assert!(filter.passes(0, &event(Direction::Answer, "ABS40", None, 0)));
        // On another line nobody has asked.
        assert!(!filter.passes(1, &event(Direction::Answer, "ABS40", None, 0)));
        assert!(filter.passes(0, &event(Direction::Answer, "rsp 2", Some(2), 0)));
    }

    #[test]
    fn times_from_and_to() {
        let mut filter =
            Filter::new(Choice { from: Some(Time::from_ps(100)), to: Some(Time::from_ps(200)), ..Choice::default() });
        let takes = [85, 95, 150, 199, 200].map(|start| filter.passes(0, &event(Direction::Answer, "x", None, start)));
        assert_eq!(takes, [false, true, true, true, false]);
        assert!(!filter.is_over(Time::from_ps(200)) && filter.is_over(Time::from_ps(10_000_000_201)));
    }
}
