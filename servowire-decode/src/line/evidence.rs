//! Evidence for a protocol: its frames, weighted by how unlikely they are to occur by chance.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;

use crate::event::{Direction, Event, Place, Value, Verdict};
use crate::sink::{Sink, Tally};
use crate::time::Time;

/// Bits of proof in the valid frames of a protocol: the part of a frame that is fixed or checked.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Weights {
    /// A valid request.
    pub request: i64,
    /// A valid answer to it.
    pub answer: i64,
    /// A valid answer without a request.
    pub alone: i64,
}

/// An answer that came and fails only its check.
const ONLY_THE_CHECK: i64 = 4;
/// A refusal by the encoder itself is a sound frame.
const REJECTED: i64 = 10;
/// A frame that is not valid.
const NO_FRAME: i64 = -6;
/// Below this share, more frames do not help.
const HOPELESS: i64 = -90;

/// From this score, a line is considered recognised.
pub(super) const CERTAIN: i64 = 20;

/// Weighs events.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Evidence {
    weights: Weights,
    /// The sum, in bits.
    pub(super) score: i64,
    /// Sound requests, sound answers to them, sound answers alone.
    pub(super) requests: u32,
    pub(super) answers: u32,
    pub(super) alone: u32,
    /// All frames by their verdict.
    pub(super) tally: Tally,
    /// Where sound frames begin, in picoseconds, and what they hold.
    pub(super) starts: Vec<(Time, u64)>,
    /// The time up to which the line was heard.
    pub(super) until: Time,
}

impl Evidence {
    pub(super) fn new(weights: Weights) -> Self {
        Self {
            weights,
            score: 0,
            requests: 0,
            answers: 0,
            alone: 0,
            tally: Tally::default(),
            starts: Vec::new(),
            until: Time::MAX,
        }
    }

    pub(super) fn is_hopeless(&self) -> bool {
        self.score < HOPELESS
    }

    /// Returns whether most of the sound frames here also occur there, within `near` picoseconds and while both were heard.
    pub(super) fn is_part_of(&self, other: &Self, near: i64) -> bool {
        let heard = |(start, content): &&(Time, u64)| {
            let at = other.starts.partition_point(|(there, _)| *there < *start - near);
            let there = other.starts.get(at..).unwrap_or_default();
            there.iter().take_while(|(there, _)| *there <= *start + near).any(|(_, same)| same == content)
        };
        let own = self.starts.partition_point(|(start, _)| *start <= other.until);
        let both = self.starts.iter().take(own).filter(heard).count();
        own > 0 && 10 * both >= 7 * own
    }
}

impl Sink for Evidence {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        // What the first edges cut off is judged by nobody.
        if event.kind == "cut" || event.kind == "gap" || event.verdict == Verdict::cut_off() {
            return Ok(());
        }
        self.tally.event(event)?;
        let weight = match (&event.verdict, event.direction, event.delay) {
            (Verdict::Ok, Some(Direction::Request), _) => {
                self.requests += 1;
                self.weights.request
            }
            (Verdict::Ok, Some(Direction::Answer), Some(_)) => {
                self.answers += 1;
                self.weights.answer
            }
            (Verdict::Ok, Some(Direction::Answer), None) => {
                self.alone += 1;
                self.weights.alone
            }
            (Verdict::Ok, None, _) => 0,
            (Verdict::Refused(_), _, _) if event.verdict.is_silence() => 0,
            (Verdict::Refused(refusal), _, delay) => match (refusal.class, delay) {
                ("rejected", _) => REJECTED,
                ("crc", Some(_)) => ONLY_THE_CHECK,
                ("truncated", _) | (_, Some(_)) => 0,
                _ => NO_FRAME,
            },
        };
        self.score += weight;
        if let (Verdict::Ok, Place::Time { start, .. }) = (&event.verdict, event.place) {
            self.starts.push((start, content(event)));
        }
        Ok(())
    }
}

/// Returns a hash of the kind and fields of an event, except what depends on earlier frames.
fn content(event: &Event) -> u64 {
    let mut hasher = DefaultHasher::new();
    event.kind.hash(&mut hasher);
    for field in event.fields.iter().filter(|field| field.name != "spikes" && field.name != "delay") {
        match &field.value {
            Value::Number { value, .. } => value.hash(&mut hasher),
            Value::Decimal { value, .. } => value.to_bits().hash(&mut hasher),
            Value::Hex { value, .. } | Value::Flags { raw: value, .. } => value.hash(&mut hasher),
            Value::Text(text) => text.hash(&mut hasher),
        }
    }
    hasher.finish()
}
