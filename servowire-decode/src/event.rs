//! Events on a line: the common form into which every protocol decodes and from which every output prints.

use std::borrow::Cow;
use std::fmt::{Display, Write as _};

use bitflags::Flags;

use crate::time::Time;

/// A frame, or the absence of an expected one.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Its place in the capture.
    pub place: Place,
    /// Who spoke.
    pub direction: Option<Direction>,
    /// The kind of frame in the protocol's own words, such as "ID 3".
    pub kind: Cow<'static, str>,
    /// The fields in the order of the line.
    pub fields: Vec<Field>,
    /// The position that the frame carries.
    pub position: Option<Position>,
    /// Address of the encoder, drive or device that sends or is addressed, if the protocol has addresses and this one is
    /// known.
    pub address: Option<u32>,
    /// What happened in this frame and belongs in a list of events, such as an alarm or a servo being switched on.
    pub happened: Vec<String>,
    /// For an answer: time since the end of its request, in picoseconds.
    pub delay: Option<i64>,
    /// Whether the frame is good.
    pub verdict: Verdict,
    /// Whether the times of its place are counted rather than measured, for instance by the update counter of a drive.
    pub counted: bool,
    /// Whether this is a remark about the recording instead of a frame; remarks are not counted.
    pub remark: bool,
    /// For a remark with an address: whether everything before it with this address was misread, so that nobody may be there.
    pub misread: bool,
}

impl Event {
    /// Creates an event without position and delay.
    pub fn new(
        place: Place,
        direction: Option<Direction>,
        kind: impl Into<Cow<'static, str>>,
        fields: Vec<Field>,
        verdict: Verdict,
    ) -> Self {
        Self {
            place,
            direction,
            kind: kind.into(),
            fields,
            position: None,
            address: None,
            happened: Vec::new(),
            delay: None,
            verdict,
            counted: false,
            remark: false,
            misread: false,
        }
    }

    /// Sets the places of fields, by their names.
    #[must_use]
    pub(crate) fn locate(mut self, span: impl Fn(&str) -> Option<Span>) -> Self {
        self.fields.iter_mut().for_each(|field| field.span = span(field.name));
        self
    }

    /// Creates the event of a frame whose beginning is not in the capture, which is not a fault of the line.
    pub fn cut(place: Place) -> Self {
        Self::remark(place, "cut", "the capture begins inside a frame")
    }

    /// Creates a remark about the recording at `place`.
    pub fn remark(place: Place, kind: &'static str, note: impl Display) -> Self {
        Self { remark: true, ..Self::new(place, None, kind, vec![Field::text("note", note)], Verdict::Ok) }
    }

    /// Marks part of a frame at the end of the capture: the rest is not known, so the frame is not sound.
    pub(crate) fn cut_off(place: Place) -> Self {
        Self::new(place, None, "cut", Vec::new(), Verdict::cut_off())
    }
}

/// Where in a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// In picoseconds of the capture's time.
    Time {
        /// The first edge.
        start: Time,
        /// The end of the last bit.
        end: Time,
    },
    /// A line of a log without times.
    Line(u64),
}

impl Place {
    /// When the place ends; `None` in a log without times.
    pub fn end(self) -> Option<Time> {
        match self {
            Self::Time { end, .. } => Some(end),
            Self::Line(_) => None,
        }
    }
}

/// The sender on a line with two ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The controller.
    Request,
    /// The encoder or drive.
    Answer,
}

/// A field of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Its name, spelt as in the protocol's documents.
    pub name: &'static str,
    /// Its value.
    pub value: Value,
    /// Its place; `None` if it describes the whole frame, whose place is that of the event.
    pub span: Option<Span>,
}

/// Where a field is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Span {
    /// Its first bit on the line, counted from 0 at the beginning of the frame.
    pub first: u32,
    /// Its last bit.
    pub last: u32,
    /// The time during which these bits were on the line.
    pub place: Place,
}

impl Span {
    /// Returns the place of bits `first` to `last` of a frame of `count` consecutive bits at `place`.
    pub(crate) fn even(place: Place, count: u32, first: u32, last: u32) -> Self {
        let place = match place {
            Place::Time { start, end } => {
                let at = |bit: u32| start + (end - start) / i64::from(count.max(1)) * i64::from(bit);
                Place::Time { start: at(first), end: if last + 1 == count { end } else { at(last + 1) } }
            }
            line @ Place::Line(_) => line,
        };
        Self { first, last, place }
    }
}

impl Field {
    /// Creates a field that describes the frame as a whole.
    pub fn new(name: &'static str, value: Value) -> Self {
        Self { name, value, span: None }
    }

    /// Creates a field with a number without a unit.
    pub fn number(name: &'static str, value: impl Into<i64>) -> Self {
        Self::measured(name, value, "")
    }

    /// Creates a field with a number and its unit.
    pub fn measured(name: &'static str, value: impl Into<i64>, unit: &'static str) -> Self {
        Self::new(name, Value::Number { value: value.into(), unit })
    }

    /// Creates a field with a code or check value of this many hex digits.
    pub fn hex(name: &'static str, value: impl Into<u64>, digits: usize) -> Self {
        Self::new(name, Value::Hex { value: value.into(), digits })
    }

    /// Creates a field of named bits, with the names used by the protocol's crate.
    pub fn flags<F: Flags<Bits: Into<u64>>>(name: &'static str, flags: &F, digits: usize) -> Self {
        let set = flags.iter_names().map(|(name, _)| name).collect();
        Self::new(name, Value::Flags { raw: flags.bits().into(), digits, set })
    }

    /// Creates a field from anything that implements `Display`.
    pub fn text(name: &'static str, what: impl Display) -> Self {
        Self::new(name, Value::Text(what.to_string()))
    }

    /// Creates a field of bytes or words in hex, with this many digits each, separated by spaces.
    pub fn digits(name: &'static str, values: impl IntoIterator<Item = impl Into<u64>>, digits: usize) -> Self {
        let mut text = String::new();
        for value in values {
            let space = if text.is_empty() { "" } else { " " };
            // A String takes everything.
            let _ = write!(text, "{space}{:0digits$X}", value.into());
        }
        Self::new(name, Value::Text(text))
    }
}

/// A value with the information needed to print it.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number; the unit may be empty.
    Number {
        /// The number.
        value: i64,
        /// Its unit.
        unit: &'static str,
    },
    /// A measured value with a fraction.
    Decimal {
        /// The number.
        value: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// A code or check value, printed in hex.
    Hex {
        /// The value.
        value: u64,
        /// Hex digits to print.
        digits: usize,
    },
    /// Named bits.
    Flags {
        /// All bits.
        raw: u64,
        /// Hex digits to print.
        digits: usize,
        /// Names of the bits that are set.
        set: Vec<&'static str>,
    },
    /// Anything else.
    Text(String),
}

/// A position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Position {
    /// Its name in the protocol's own words, such as `VPOS`. Positions with different names or addresses are different series.
    pub name: &'static str,
    /// The position in counts, including turns if the frame carries them.
    pub counts: i64,
    /// Number of counts after which the value wraps, if it does.
    pub span: Option<u64>,
    /// Counts per turn, if the resolution is known and the axis turns.
    pub per_turn: Option<u64>,
}

impl Position {
    /// Returns the position in turns, if the resolution is known.
    pub fn turns(&self) -> Option<f64> {
        self.per_turn.map(|counts| self.counts as f64 / counts as f64)
    }

    /// Returns the move from `before`, the shorter way if the value wraps.
    pub(crate) fn moved_from(&self, before: &Self) -> i64 {
        let moved = self.counts.wrapping_sub(before.counts);
        let Some(span) = self.span.and_then(|span| i64::try_from(span).ok()).filter(|span| *span > 0) else {
            return moved;
        };
        let moved = moved.rem_euclid(span);
        if moved > span / 2 { moved - span } else { moved }
    }
}

/// Whether a frame is good.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// All checks passed.
    Ok,
    /// A check failed.
    Refused(Box<Refusal>),
}

/// The class of an answer that was expected but did not come.
pub(crate) const NO_RESPONSE: &str = "no_response";

/// Why a frame was refused.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// The class of the check, for statistics: `crc`, `delimiter`, `no_response` ...
    pub class: &'static str,
    /// A sentence that says what arrived and what was expected.
    pub reason: String,
    /// The name of the field.
    pub field: Option<String>,
    /// The bit in that field, in the order of the line.
    pub bit: Option<u32>,
    /// When that bit was on the line, in picoseconds.
    pub time: Option<Time>,
    /// The probable cause.
    pub cause: Option<String>,
}

impl Refusal {
    /// Creates a refusal with a reason but without a place.
    pub fn new(class: &'static str, reason: impl Display) -> Self {
        Self { class, reason: reason.to_string(), field: None, bit: None, time: None, cause: None }
    }
}

impl From<Refusal> for Verdict {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(Box::new(refusal))
    }
}

impl Verdict {
    /// The capture ends inside a frame: the rest is not known, so the frame is not sound.
    pub(crate) fn cut_off() -> Self {
        let cause = Some("the file was cut off, or recording stopped there".to_owned());
        Refusal { cause, ..Refusal::new("truncated", "the capture ends inside a frame") }.into()
    }

    /// The recording has a hole that begins inside a frame.
    pub(crate) fn in_a_hole() -> Self {
        let cause = Some("recording stopped there for a while".to_owned());
        Refusal { cause, ..Refusal::new("truncated", "a hole in the recording begins inside the frame") }.into()
    }

    /// Returns whether all checks passed.
    pub fn is_ok(&self) -> bool {
        *self == Self::Ok
    }

    /// Returns whether this is the absence of a frame.
    pub fn is_silence(&self) -> bool {
        matches!(self, Self::Refused(refusal) if refusal.class == NO_RESPONSE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shorter_way_round() {
        let at = |counts| Position { name: "ABS", counts, span: Some(100), per_turn: None };
        assert_eq!(at(1).moved_from(&at(99)), 2);
        assert_eq!(at(99).moved_from(&at(1)), -2);
        assert_eq!(at(50).moved_from(&at(0)), 50);
        assert_eq!(at(-1).moved_from(&at(0)), -1);
        let linear = |counts| Position { name: "ABS", counts, span: None, per_turn: None };
        assert_eq!(linear(-70).moved_from(&linear(99)), -169);
    }
}
