//! What start-stop protocols have in common: the fields that make up a frame, and remarks about them.

use std::fmt::Display;

use crate::event::{Direction, Event, Field, NO_RESPONSE, Place, Refusal, Span};
use crate::line::start_stop::LineField;
use crate::time::Time;

use super::plausible::{joined, two_masters};

/// Adds that the position does not fit the encoder, beside the values as they were on the line.
pub(super) fn too_wide(error: impl Display, single_turn: u8, multi_turn: u8) -> Field {
    Field::text("width", format_args!("{error}; taken as {single_turn} + {multi_turn} bits"))
}

/// Fields that belong together, at most `N`; further fields replace the last one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group<T, const N: usize> {
    contents: [T; N],
    starts: [Time; N],
    len: usize,
    pub(super) end: Time,
    /// The first field whose delimiter read 0.
    pub(super) broken: Option<u8>,
    spikes: u32,
    /// The bits of the line, the first in bit 0, if they are known.
    pub(super) raw: u128,
    /// The line of a log without times.
    pub(super) line: Option<u64>,
}

impl<T: Copy + Default, const N: usize> Default for Group<T, N> {
    fn default() -> Self {
        let (contents, starts) = ([T::default(); N], [Time::ZERO; N]);
        Self { contents, starts, len: 0, end: Time::ZERO, broken: None, spikes: 0, raw: 0, line: None }
    }
}

impl<T: Copy + Default, const N: usize> Group<T, N> {
    /// Takes a field that holds `content`. `bit`: its length in picoseconds, 0 in a log.
    pub(super) fn push(&mut self, content: T, field: &LineField, bit: i64) {
        let k = self.len.min(N - 1);
        if self.len == 0 {
            self.raw = field.bits;
        } else if field.bits != 0 && bit > 0 {
            // Somebody seems to begin anew: what he says comes after it.
            self.raw = joined(self.raw, field.bits, (field.start - self.start() + bit / 2) / bit);
        }
        if let (Some(place), Some(start)) = (self.contents.get_mut(k), self.starts.get_mut(k)) {
            *place = content;
            *start = field.start;
        }
        if !field.delimiter && self.broken.is_none() {
            self.broken = u8::try_from(k).ok();
        }
        self.spikes = self.spikes.saturating_add(field.spikes);
        self.end = field.end;
        self.len = k + 1;
    }

    /// Returns the fields and begins without any.
    pub(super) fn take(&mut self) -> Self {
        let whole = *self;
        // What is beyond the length means nothing, and stays as it is.
        (self.len, self.end, self.broken, self.spikes, self.raw, self.line) = (0, Time::ZERO, None, 0, 0, None);
        whole
    }

    /// The contents of the fields.
    pub(super) fn contents(&self) -> &[T] {
        self.contents.get(..self.len).unwrap_or_default()
    }

    /// Start of each field.
    pub(super) fn starts(&self) -> &[Time] {
        self.starts.get(..self.len).unwrap_or_default()
    }

    /// Returns the place of content bits `first` to `last`, counted from 0 across all fields.
    pub(super) fn span(&self, first: u32, last: u32) -> Option<Span> {
        self.spans()?.of(first, last)
    }

    /// Places of content bits.
    pub(super) fn spans(&self) -> Option<Spans<'_>> {
        let starts = self.starts();
        // A field as its speaker sent it, with start bit and delimiter.
        let field = self.end - *starts.last()?;
        Some(Spans { starts, field, width: 8 * size_of::<T>() as u32, line: self.line })
    }

    /// Number of fields.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    pub(super) fn start(&self) -> Time {
        self.starts().first().copied().unwrap_or_default()
    }

    pub(super) fn place(&self) -> Place {
        match self.line {
            Some(line) => Place::Line(line),
            None => Place::Time { start: self.start(), end: self.end },
        }
    }

    /// The number of dropped spikes.
    pub(super) fn spikes(&self) -> Option<Field> {
        (self.spikes > 0).then(|| Field::number("spikes", self.spikes))
    }

    /// Returns the refusal with its place: the index of a field, whose names are `names`, and a bit in it.
    pub(super) fn refused(
        &self,
        names: &[&'static str],
        field: Option<usize>,
        bit: Option<u8>,
        why: Refusal,
    ) -> Refusal {
        // A field that is missing should have begun where the frame ends.
        let start = field.map(|field| self.starts().get(field).copied().unwrap_or(self.end));
        let time = start.filter(|_| self.line.is_none());
        let field = field.and_then(|field| names.get(field)).map(|name| (*name).to_owned());
        Refusal { field, bit: bit.map(u32::from), time, ..why }
    }
}

/// The places of the content bits of fields.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spans<'a> {
    starts: &'a [Time],
    /// Picoseconds of a field, and its content bits.
    field: i64,
    width: u32,
    line: Option<u64>,
}

impl Spans<'_> {
    /// Returns the place of content bits `first` to `last`.
    pub(super) fn of(&self, first: u32, last: u32) -> Option<Span> {
        let Self { starts, field, width, line } = *self;
        let at = |bit: u32, after: u32| {
            let within = 1 + bit % width;
            let start = *starts.get((bit / width) as usize)?;
            Some((bit / width * (width + 2) + within, start + field * i64::from(within + after) / i64::from(width + 2)))
        };
        let ((first, start), (last, end)) = (at(first, 0)?, at(last, 1)?);
        let place = line.map_or(Place::Time { start, end }, Place::Line);
        Some(Span { first, last, place })
    }
}

/// No controller gives up on an encoder this soon, in picoseconds.
const BRIEF: i64 = 20_000_000;

/// Reports that no answer, called `what`, came to the request at `place` within `timeout`, or before `now`, when the next
/// request came (`asked`).
/// `nobody`: name of the party that may be missing.
pub(super) fn silence(
    place: Place,
    kind: &'static str,
    what: &str,
    timeout: i64,
    now: Time,
    asked: bool,
    nobody: &str,
) -> Event {
    let after = match place {
        Place::Time { end, .. } if asked => now - end,
        _ => timeout,
    };
    let cause = if after < BRIEF {
        two_masters(after)
    } else {
        format!("only the request is on the line: {nobody}, A and B exchanged, or not its bit rate")
    };
    let (place, reason) = match place {
        Place::Time { end: start, .. } => {
            let end = (start + timeout).min(now);
            let within = (end - start) as f64 / 1e6;
            (Place::Time { start, end }, format!("no {what} within {within:.1} us"))
        }
        Place::Line(_) if asked => (place, format!("no {what} before the next request")),
        Place::Line(_) => (place, format!("no {what} before the log ends")),
    };
    let refusal = Refusal { cause: Some(cause), ..Refusal::new(NO_RESPONSE, reason) };
    Event::new(place, Some(Direction::Answer), kind, Vec::new(), refusal.into())
}
