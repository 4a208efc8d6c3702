//! Reads a failed frame from its edges a second time.
//!
//! When a driver releases the line, the line may dip for a bit before the bias pulls it up, or it may be disturbed. A
//! receiver takes that for a start bit, and the following frame is lost. Here the frame is read a second time, from the
//! next edge onwards.

use super::evidence::Weights;
use super::receive::EdgeReceiver;
use super::spikes::Edge;
use super::start_stop::StartStop;
use super::trial::{Trial, is_failed};
use crate::event::{Event, Field, Place, Value};
use crate::time::Time;

/// Maximum number of edges read again: those of one or two exchanges.
pub(super) const MOST_AGAIN: usize = 400;
/// Maximum number of pulses skipped in these.
const ROUNDS: usize = 4;
/// The longest low pulse that need not belong to the frame, in bits.
const LONGEST_PULSE: f64 = 1.75;
/// Shortest high level after this pulse, in bits: nobody answers earlier.
const QUIET: f64 = 3.0;
/// Time after a frame within which its driver releases the line, in bits.
const LETS_GO: f64 = 2.5;

/// Where a frame failed.
pub(super) struct Failed<'a, P> {
    pub(super) receiver: &'a EdgeReceiver,
    /// The protocol as it was before these edges.
    pub(super) before: &'a P,
    pub(super) weights: Weights,
    pub(super) edges: &'a [Edge],
    /// Where the frames begin that were already passed on.
    pub(super) passed: &'a [Time],
    /// The time until which the line has been idle.
    pub(super) now: Time,
    /// Picoseconds per bit.
    pub(super) bit: f64,
}

/// A low pulse that was skipped.
#[derive(Debug, Clone, Copy)]
struct Pulse {
    time: Time,
    bits: f64,
}

/// The better reading.
pub(super) struct Better<P> {
    pub(super) protocol: P,
    pub(super) receiver: EdgeReceiver,
    /// Events after those that were already passed on.
    pub(super) events: Vec<Event>,
    /// Dips of drivers that released the line, and their total length in bits.
    pub(super) dips: u64,
    pub(super) dip_bits: f64,
}

impl<P: StartStop + Clone> Failed<'_, P> {
    fn trial(&self, edges: &[Edge]) -> Trial<P> {
        Trial::of(self.receiver, self.before, self.weights, edges, self.now)
    }

    /// Returns whether a reading contains the frames that were already passed on.
    fn goes_on(&self, trial: &Trial<P>) -> bool {
        let same = |(start, event): (&Time, &Event)| match event.place {
            Place::Time { start: own, .. } => !is_failed(event) && ((own - *start) as f64).abs() < self.bit,
            Place::Line(_) => false,
        };
        trial.heard.events.len() >= self.passed.len() && self.passed.iter().zip(&trial.heard.events).all(same)
    }

    /// Returns the low pulses that need not belong to a frame, with the places of their falling edges.
    fn pulses(&self, edges: &[Edge]) -> Vec<(usize, Pulse)> {
        let pulse = |(at, fall): (usize, &Edge)| {
            let rise = edges.get(at + 1).filter(|_| !fall.level)?;
            let bits = (rise.time - fall.time) as f64 / self.bit;
            let quiet = edges.get(at + 2).map_or(f64::INFINITY, |next| (next.time - rise.time) as f64 / self.bit);
            (bits < LONGEST_PULSE && quiet > QUIET).then_some((at, Pulse { time: fall.time, bits }))
        };
        edges.iter().enumerate().filter_map(pulse).collect()
    }

    /// Returns a reading that skips some pulses and has more good frames.
    pub(super) fn again(&self) -> Option<Better<P>> {
        let mut edges = self.edges.to_vec();
        let mut best = self.trial(&edges);
        let mut pulses = Vec::new();
        while best.heard.failed > 0 && pulses.len() < ROUNDS {
            let mut next: Option<(Trial<P>, Vec<Edge>, Pulse)> = None;
            for (at, pulse) in self.pulses(&edges) {
                let mut without = edges.clone();
                without.drain(at..at + 2);
                let trial = self.trial(&without);
                // In the middle of a frame this would be a guess, and a damaged frame might pass by chance.
                let inside = |event: &Event| match event.place {
                    Place::Time { start, end } => pulse.time > start && pulse.time < end - (0.6 * self.bit) as i64,
                    Place::Line(_) => false,
                };
                if trial.heard.events.iter().any(inside) {
                    continue;
                }
                let than = next.as_ref().map_or(&best.heard, |(trial, ..)| &trial.heard);
                if self.goes_on(&trial) && trial.heard.is_better_than(than) {
                    next = Some((trial, without, pulse));
                }
            }
            let Some((trial, without, pulse)) = next else { break };
            pulses.push(pulse);
            (best, edges) = (trial, without);
        }
        (!pulses.is_empty()).then(|| self.told(best, &pulses))
    }

    /// Returns the events, with remarks about the skipped pulses.
    fn told(&self, best: Trial<P>, pulses: &[Pulse]) -> Better<P> {
        let mut events = best.heard.events;
        let (mut dips, mut dip_bits) = (0, 0.0);
        for Pulse { time, bits } in pulses {
            let before = |event: &&Event| event.place.end().is_some_and(|end| end < *time + (0.5 * self.bit) as i64);
            let behind = events.iter().take_while(before).count();
            let end = behind.checked_sub(1).and_then(|at| events.get(at)?.place.end());
            let lets_go = end.is_some_and(|end| ((*time - end) as f64) < LETS_GO * self.bit);
            let what = if lets_go { "dip" } else { "pulse" };
            let when = if lets_go { ", when its driver let go" } else { " on the idle line" };
            (dips, dip_bits) = (dips + u64::from(lets_go), dip_bits + if lets_go { *bits } else { 0.0 });
            // What has already been reported cannot be changed.
            let at = if lets_go && behind > self.passed.len() { behind - 1 } else { behind.max(self.passed.len()) };
            if let Some(event) = events.get_mut(at) {
                let when = if at + 1 == behind || !lets_go { when } else { ", when the driver before it let go" };
                note(event, &format!("a {what} of {bits:.1} bits at {:.3} us{when}, is passed over", time.us()));
            }
        }
        events.drain(..self.passed.len());
        Better { protocol: best.protocol, receiver: best.receiver, events, dips, dip_bits }
    }
}

/// Adds a remark to the fields of an event.
fn note(event: &mut Event, what: &str) {
    let known = event.fields.iter_mut().find(|field| field.name == "note");
    match known.map(|field| &mut field.value) {
        Some(Value::Text(text)) => {
            text.push_str("; ");
            text.push_str(what);
        }
        _ => event.fields.push(Field::text("note", what)),
    }
}
