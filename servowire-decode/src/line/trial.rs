//! Trial readings: what a decoder would make of some edges, without any output.

use std::io;

use super::evidence::{Evidence, Weights};
use super::receive::EdgeReceiver;
use super::spikes::Edge;
use super::start_stop::StartStop;
use crate::event::{Event, Verdict};
use crate::sink::Sink;
use crate::time::Time;

/// Returns whether an event is a frame that arrived but is not good. A refusal by an encoder is itself a sound frame.
pub(super) fn is_failed(event: &Event) -> bool {
    match &event.verdict {
        Verdict::Ok => false,
        Verdict::Refused(refusal) => !event.remark && !event.verdict.is_silence() && refusal.class != "rejected",
    }
}

/// The events of a reading, and the evidence for it.
#[derive(Debug)]
pub(super) struct Heard {
    pub(super) events: Vec<Event>,
    pub(super) evidence: Evidence,
    /// Frames that are not good.
    pub(super) failed: usize,
}

impl Heard {
    fn new(weights: Weights) -> Self {
        Self { events: Vec::new(), evidence: Evidence::new(weights), failed: 0 }
    }

    /// Returns whether there is an answer, and every frame is good.
    pub(super) fn is_perfect(&self) -> bool {
        self.failed == 0 && self.evidence.answers > 0
    }

    /// Returns the number of frames before the first that failed.
    fn sound(&self) -> usize {
        let sound = self.events.iter().take_while(|event| !is_failed(event));
        sound.filter(|event| event.verdict.is_ok()).count()
    }

    /// Returns whether more of it is good: more answers, more frames before the first failed one, or fewer failed ones.
    /// One failed frame may have become two: an answer, and what follows it. A request alone proves little, and part of an
    /// answer may look like
    /// a request, which then has no answer.
    pub(super) fn is_better_than(&self, other: &Self) -> bool {
        let more = self.evidence.answers > other.evidence.answers && self.failed <= other.failed;
        let no_more_asked = self.evidence.requests <= other.evidence.requests;
        let as_many = self.evidence.answers >= other.evidence.answers && no_more_asked;
        let fewer = self.failed < other.failed && (self.failed == 0 || as_many);
        let missing = self.evidence.tally.missing > other.evidence.tally.missing;
        let further = self.sound() > other.sound() && self.failed <= other.failed + 1;
        (more || fewer || further) && self.evidence.score > other.evidence.score && !missing
    }
}

impl Sink for Heard {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        self.failed += usize::from(is_failed(event));
        self.events.push(event.clone());
        self.evidence.event(event)
    }
}

/// A reading of some edges, with the receiver and the protocol in their state before these edges.
#[derive(Debug)]
pub(super) struct Trial<P> {
    pub(super) receiver: EdgeReceiver,
    pub(super) protocol: P,
    pub(super) heard: Heard,
}

impl<P: StartStop + Clone> Trial<P> {
    /// Reads `edges`; after these the line is idle until `now`.
    pub(super) fn of(receiver: &EdgeReceiver, protocol: &P, weights: Weights, edges: &[Edge], now: Time) -> Self {
        let mut trial = Self { receiver: receiver.emptied(), protocol: protocol.clone(), heard: Heard::new(weights) };
        trial.receiver.feed(edges);
        for field in trial.receiver.fields() {
            // Nothing is written, so nothing fails.
            let _ = trial.protocol.field(field, &mut trial.heard);
        }
        trial.receiver.take();
        let _ = trial.protocol.rest(now, &mut trial.heard);
        trial
    }
}
