//! A line without bias: between frames nobody drives it, and it floats low.
//!
//! Its frames end with a falling edge that is not a start bit, and begin from a low level: with a rising edge if the driver
//! is on a little before the start bit, otherwise with the first 1, so that the start bit has no edge. The line is also low
//! during a change of direction, which cannot be told from a field of zeros by its length; only the checks of the frames
//! decide.

use std::io;

use super::evidence::Weights;
use super::receive::EdgeReceiver;
use super::spikes::{Edge, Spikes};
use super::start_stop::StartStop;
use super::trial::Trial;
use crate::event::{Direction, Event};
use crate::sink::Sink;
use crate::time::Time;

/// Bits of one level after which a piece has ended.
const REST: f64 = 26.0;
/// Maximum number of edges in a piece.
const MOST_EDGES: usize = 400;
/// The shortest low run in a change of direction, in bits: both drivers hold the line for part of it.
const SHORTEST_GAP: f64 = 2.2;
/// A driver releases the line at most this many bits before the end of its frame, and at most this many after it.
const LETS_GO: [f64; 2] = [0.6, 2.6];
/// Number of pieces after which it is known how frames begin.
const KNOWN: u32 = 3;
/// Maximum number of runs in a piece that are tried as the change of direction.
const MOST_TRIED: usize = 12;

/// How a frame begins from the low level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Begin {
    /// The line is high before the start bit.
    Seen,
    /// The first edge is that of the first 1.
    Hidden,
}

/// All combinations, for requests and for answers.
const WAYS: [[Begin; 2]; 4] = [
    [Begin::Seen, Begin::Seen],
    [Begin::Hidden, Begin::Hidden],
    [Begin::Seen, Begin::Hidden],
    [Begin::Hidden, Begin::Seen],
];

/// Collects the edges of a line that floats low, and reads them piece by piece.
#[derive(Debug, Clone)]
pub(super) struct Floating {
    bit: f64,
    spikes: Spikes,
    piece: Vec<Edge>,
    /// How frames begin, and in how many pieces this has held.
    way: [Begin; 2],
    held: u32,
}

impl Floating {
    /// `bit`: length of a bit in picoseconds.
    pub(super) fn new(bit: f64) -> Self {
        Self { bit, spikes: Spikes::new(bit), piece: Vec::new(), way: WAYS[0], held: 0 }
    }

    /// The line takes a level; returns the edges whose levels are now known to last.
    pub(super) fn change(&mut self, time: Time, level: bool) -> [Option<Edge>; 2] {
        self.spikes.change(time, level)
    }

    /// The line has not changed until `time`.
    pub(super) fn reach(&mut self, time: Time) -> [Option<Edge>; 2] {
        self.spikes.reach(time)
    }

    /// Returns whether the piece ends before `time`.
    pub(super) fn is_over(&self, time: Time) -> bool {
        let rests = |last: &Edge| (time - last.time) as f64 > REST * self.bit;
        self.piece.last().is_some_and(rests) || self.piece.len() >= MOST_EDGES
    }

    /// Takes the next edge of the piece.
    pub(super) fn push(&mut self, edge: Edge) {
        self.piece.push(edge);
    }

    /// Reads the piece in the way that makes most of its frames good.
    pub(super) fn read<P: StartStop + Clone>(
        &mut self,
        receiver: &mut EdgeReceiver,
        protocol: &mut P,
        weights: Weights,
        out: &mut dyn Sink,
    ) -> io::Result<()> {
        let piece = std::mem::take(&mut self.piece);
        let Some(last) = piece.last() else { return Ok(()) };
        let now = last.time + (REST * self.bit) as i64;
        let longest = (f64::from(P::CONTENT_BITS) + 1.7) * self.bit;
        // These are longer than any field is low.
        let sure = runs(&piece, |run| run > longest);
        let maybe = runs(&piece, |run| run <= longest && run > SHORTEST_GAP * self.bit);
        let maybe = maybe.into_iter().take(MOST_TRIED).map(Some);
        // If one change of direction is certain, another one is unlikely.
        let gaps: Vec<Option<usize>> =
            if sure.is_empty() { maybe.chain([None]).collect() } else { [None].into_iter().chain(maybe).collect() };
        let known = self.held >= KNOWN;
        let ways: Vec<[Begin; 2]> =
            [self.way].into_iter().chain(WAYS.into_iter().filter(|way| !known && *way != self.way)).collect();
        let mut best: Option<(Trial<P>, [Begin; 2])> = None;
        'all: for gap in gaps {
            for way in &ways {
                let idle: Vec<usize> = sure.iter().copied().chain(gap).collect();
                let edges = raised(&piece, &idle, *way, P::FIRST_LOW, self.bit);
                let trial = Trial::of(receiver, protocol, weights, &edges, now);
                // The change of direction is after a request; anywhere else it is a guess, and a damaged frame might pass
                // by chance.
                if gap.is_some_and(|gap| !piece.get(gap).is_some_and(|fall| self.ends_request(&trial, fall.time))) {
                    continue;
                }
                let perfect = trial.heard.is_perfect();
                // The low of a change of direction may look like a field of zeros, and a request with that like an answer.
                let score = |trial: &Trial<P>| {
                    let evidence = &trial.heard.evidence;
                    (evidence.score - weights.alone * i64::from(evidence.alone), evidence.score)
                };
                if best.as_ref().is_none_or(|(best, _)| score(&trial) > score(best)) {
                    best = Some((trial, *way));
                }
                if perfect {
                    break 'all;
                }
            }
        }
        let Some((trial, way)) = best else { return Ok(()) };
        if trial.heard.is_perfect() {
            self.held = if way == self.way { self.held.saturating_add(1) } else { 1 };
            self.way = way;
        }
        (*receiver, *protocol) = (trial.receiver, trial.protocol);
        receiver.forget();
        trial.heard.events.iter().try_for_each(|event| out.event(event))
    }
}

impl Floating {
    /// Returns whether a sound request ends where the line is released.
    fn ends_request<P>(&self, trial: &Trial<P>, fall: Time) -> bool {
        let [before, behind] = LETS_GO.map(|bits| (bits * self.bit) as i64);
        let is_there = |event: &Event| {
            let is_near = |end: Time| fall >= end - before && fall <= end + behind;
            event.verdict.is_ok()
                && event.direction == Some(Direction::Request)
                && event.place.end().is_some_and(is_near)
        };
        trial.heard.events.iter().any(is_there)
    }
}

/// Returns the falling edges of low runs of the wanted length, in picoseconds.
fn runs(piece: &[Edge], wanted: impl Fn(f64) -> bool) -> Vec<usize> {
    let low = |(at, pair): (usize, &[Edge])| match pair {
        [fall, rise] if !fall.level && wanted((rise.time - fall.time) as f64) => Some(at),
        _ => None,
    };
    piece.windows(2).enumerate().filter_map(low).collect()
}

/// Returns the same piece as if the line were high while nobody drives it: before its first edge, after its last one, and
/// from the falling edges at `idle` onwards.
fn raised(piece: &[Edge], idle: &[usize], way: [Begin; 2], low_bits: [u32; 2], bit: f64) -> Vec<Edge> {
    let mut out = Vec::with_capacity(piece.len() + 2);
    let [request, answer] = way;
    let [request_low, answer_low] = low_bits;
    let (mut begin, mut low) = (request, request_low);
    let mut floats = true;
    for (at, edge) in piece.iter().enumerate() {
        if floats && edge.level {
            if begin == Begin::Hidden {
                out.push(Edge { time: edge.time - (f64::from(low) * bit) as i64, level: false, spikes: 0 });
                out.push(*edge);
            }
            floats = false;
        } else if !edge.level && (idle.contains(&at) || at + 1 == piece.len()) {
            (begin, low) = (answer, answer_low);
            floats = true;
        } else {
            out.push(*edge);
            floats = false;
        }
    }
    out
}
