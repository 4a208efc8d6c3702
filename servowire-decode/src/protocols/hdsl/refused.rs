//! Events of the link, and why one is refused.

use hdsl::Error;

use crate::event::{Direction, Event, Field, Place, Position, Refusal, Verdict};

/// The class of a check, and what it found.
pub(super) type Refused = (&'static str, String);

pub(super) fn refusal(error: Error) -> Refused {
    (error.class().name(), error.to_string())
}

pub(super) fn event(
    place: Place,
    direction: Direction,
    kind: &'static str,
    fields: Vec<Field>,
    verdict: Result<(), Refused>,
) -> Event {
    let verdict = match verdict {
        Ok(()) => Verdict::Ok,
        Err((class, reason)) => Refusal::new(class, reason).into(),
    };
    Event::new(place, Some(direction), kind, fields, verdict)
}

pub(super) fn position(name: &'static str, counts: u64) -> Position {
    Position { name, counts: i64::try_from(counts).unwrap_or(i64::MAX), span: Some(1 << 40), per_turn: None }
}
