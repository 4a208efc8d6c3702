//! Events of the link, and the reasons for a refusal.

use hdsl::{EncoderId, Error, PositionBits};

use crate::event::{Direction, Event, Field, Place, Position, Refusal, Verdict};

/// The class of a check, and what the check found.
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

/// Creates a 40-bit position under its name in the register map, and with the value at which it wraps if the encoder is known.
pub(super) fn position(name: &'static str, raw: u64, id: Option<EncoderId>) -> Position {
    let bits = id.and_then(|id| id.check().ok()).map_or(40, PositionBits::get);
    let counts = id.map_or_else(|| i64::try_from(raw).unwrap_or(i64::MAX), |id| id.position(raw));
    Position { name, counts, span: Some(1 << bits), per_turn: None }
}
