//! Start-stop fields from the edges of a line whose speakers keep their own time.
//!
//! Edges are gathered until the line is idle. All fields up to a change of direction were sent by one clock: its bit
//! length is fitted to the edges, then every field is read on the grid that fits it best. A controller and an encoder may
//! therefore each be off by a few per cent, and jitter and spikes do not shift any bit.

mod even;
mod field;
mod grid;
mod rates;
mod reading;

pub use rates::Rates;

use super::spikes::{Edge, Spikes};
use super::start_stop::LineField;
use crate::capture::samples::Turns;
use crate::time::Time;

/// A speaker that begins after at most this many bits of pause is answering another one.
const ANSWERS_WITHIN: f64 = 22.0;
/// Number of speeches by which the spread of edges is judged, and the minimum for a result. One of the latter, or a third of
/// the former, may be far worse than the others: with another driver at the same time.
const LATELY: usize = 16;
const FEWEST: usize = 4;
/// Maximum number of edges kept of an open burst; beyond that, whole fields are read.
const MOST_EDGES: usize = 512;
/// A line that is low for longer ends a burst too, in picoseconds: 13 days. The times within a burst therefore fit into 64
/// bits.
const LONGEST_LOW: i64 = 1 << 60;

/// Receives fields of one line. Levels are given as on an idle-high line.
#[derive(Debug, Clone)]
pub(crate) struct EdgeReceiver {
    bit: f64,
    content_bits: u32,
    spikes: Spikes,
    /// The open burst; it begins with a falling edge.
    burst: Vec<Edge>,
    /// Measured bit lengths, the most recent first.
    heard: Vec<f64>,
    /// Sum of measured bit lengths relative to the nominal one, and their number.
    rates: Rates,
    /// Complete fields, for the caller to take.
    fields: Vec<LineField>,
    /// Spikes dropped before the next field.
    dropped: u32,
    /// A line that is high for longer is idle, in picoseconds.
    rest: i64,
    /// Falling edges of the first burst that are not start bits, until it has been read.
    skipped: u32,
    /// Edges that were read, until they are [forgotten](Self::forget).
    past: Vec<Edge>,
    /// Bit lengths known when they were read.
    heard_before: Vec<f64>,
    /// When the last field ended.
    until: Option<Time>,
    /// Mean square distance of edges from the grid, in bits, in the last speeches of those who speak first, and the number of
    /// such speeches.
    spread: ([f64; LATELY], usize),
    tried: grid::Tried,
}

impl EdgeReceiver {
    /// Creates a receiver for fields of `content_bits`, 8 or 16, with bits of `bit` picoseconds.
    pub(crate) fn new(bit: f64, content_bits: u32) -> Self {
        Self {
            bit,
            content_bits,
            spikes: Spikes::new(bit),
            burst: Vec::with_capacity(64),
            heard: Vec::new(),
            rates: Rates::default(),
            fields: Vec::new(),
            dropped: 0,
            // A field is not high for longer.
            rest: ((f64::from(content_bits) + 3.0) * bit) as i64,
            skipped: 0,
            past: Vec::new(),
            heard_before: Vec::new(),
            until: None,
            spread: ([0.0; LATELY], 0),
            tried: grid::Tried::default(),
        }
    }

    /// Creates an empty receiver with the measurements up to the last time edges were forgotten.
    #[must_use]
    pub(super) fn emptied(&self) -> Self {
        let heard = self.heard_before.clone();
        Self { heard_before: heard.clone(), heard, rates: self.rates, ..Self::new(self.bit, self.content_bits) }
    }

    /// Discards the measurements since edges were forgotten: they came from no speaker.
    pub(super) fn unlearn(&mut self) {
        self.heard.clone_from(&self.heard_before);
    }

    /// Adopts the measurements that `other` has made of the speakers.
    pub(super) fn learn(&mut self, other: &Self) {
        self.heard.clone_from(&other.heard);
    }

    /// Takes edges after which the line is idle.
    pub(super) fn feed(&mut self, edges: &[Edge]) {
        for edge in edges {
            self.edge(*edge);
        }
        self.close();
    }

    /// Returns the mean square distance of edges from their grid, in bits, for those who speak first: no other driver is on
    /// then, as a rule.
    pub(super) fn spread(&self) -> Option<f64> {
        let (mut spread, count) = self.spread;
        let spread = spread.get_mut(..count.min(LATELY)).filter(|spread| spread.len() >= FEWEST)?;
        spread.sort_by(f64::total_cmp);
        spread.get(spread.len() * 2 / 3).copied()
    }

    /// Returns the bit length of the last speaker before edges were forgotten, in picoseconds.
    pub(super) fn bit_before(&self) -> f64 {
        self.heard_before.first().copied().unwrap_or(self.bit)
    }

    /// Returns the edges read since they were last forgotten.
    pub(super) fn past(&self) -> &[Edge] {
        &self.past
    }

    /// Forgets the edges that were read.
    pub(super) fn forget(&mut self) {
        self.past.clear();
        self.heard_before.clone_from(&self.heard);
    }

    /// Returns the bit length of the last speaker, in picoseconds.
    pub(super) fn bit_heard(&self) -> f64 {
        self.heard.first().copied().unwrap_or(self.bit)
    }

    /// Returns whether all edges were read except the first of the next burst.
    pub(super) fn is_between(&self) -> bool {
        self.burst.len() < 2
    }

    /// When the next burst began, if it has.
    pub(super) fn begun(&self) -> Option<Time> {
        self.burst.first().map(|first| first.time)
    }

    /// The capture begins inside a field: this many falling edges are passed over before the first start bit.
    #[must_use]
    pub(crate) fn beginning_at(self, skipped: u32) -> Self {
        Self { skipped, ..self }
    }

    /// Returns the measurements so far.
    pub(crate) fn rates(&self) -> Rates {
        let mut rates = self.rates;
        (rates.spikes_at, rates.spike_bits) = self.spikes.near_edges();
        rates
    }

    /// The line takes a level. Returns whether there are fields to [`take`](Self::take).
    #[inline]
    pub(crate) fn change(&mut self, time: Time, level: bool) -> bool {
        if let Some(edge) = self.spikes.plain_change(time, level) {
            self.edge(edge);
        } else {
            for edge in self.spikes.change(time, level).into_iter().flatten() {
                self.edge(edge);
            }
        }
        !self.fields.is_empty()
    }

    /// Returns the shortest run that is not a spike, and the longest in a field.
    pub(super) fn runs(&self) -> [i64; 2] {
        [self.spikes.shortest(), self.rest]
    }

    /// Takes changes until there are fields to [`take`](Self::take) or no change is left; returns whether there are. Runs
    /// are even if they [may belong](Self::runs) to a field.
    pub(super) fn turns(&mut self, turns: &mut Turns<'_>) -> bool {
        loop {
            self.even_turns(turns);
            let Some((time, level)) = turns.next() else { return false };
            if self.change(time, level) {
                return true;
            }
        }
    }

    /// Takes changes as long as each of them is an edge without spikes that continues the burst.
    fn even_turns(&mut self, turns: &mut Turns<'_>) {
        let Some((since, last)) = self.spikes.plain().zip(self.burst.last()) else { return };
        let room = MOST_EDGES.saturating_sub(self.burst.len());
        if turns.told_at() != Some(since) || since - last.time > self.rest {
            return;
        }
        let even = turns.even(room, &mut self.burst, |time, level| Edge { time, level, spikes: 0 });
        self.rates.edges += even as u64;
        if let (Some(last), Some(since)) = (self.burst.last(), turns.told_at()) {
            self.spikes.go_on(last, since);
        }
    }

    /// The line has not changed until `time`. Returns whether there are fields to [`take`](Self::take).
    pub(crate) fn reach(&mut self, time: Time) -> bool {
        for edge in self.spikes.reach(time).into_iter().flatten() {
            self.edge(edge);
        }
        let Some(last) = self.burst.last() else { return !self.fields.is_empty() };
        let over = if last.level { self.longest_high() } else { f64::from(self.field_bits()) * 2.0 };
        if (time - last.time) as f64 > over * self.bit {
            self.close();
        }
        !self.fields.is_empty()
    }

    /// The capture ends at `time`. A high level is assumed to last; a field that ends low is incomplete and is dropped.
    pub(crate) fn finish(&mut self, time: Time) -> bool {
        for edge in self.spikes.reach(time + (self.bit * 2.0) as i64).into_iter().flatten() {
            self.edge(edge);
        }
        let open = self.burst.last().is_some_and(|last| !last.level);
        self.close();
        if open && self.fields.last().is_some_and(|field| field.end > time + self.bit as i64) {
            self.fields.pop();
        }
        !self.fields.is_empty()
    }

    /// Returns the complete fields, until they are [taken](Self::take).
    pub(crate) fn fields(&self) -> &[LineField] {
        &self.fields
    }

    /// Removes the complete fields.
    pub(crate) fn take(&mut self) {
        self.fields.clear();
    }

    fn field_bits(&self) -> u32 {
        self.content_bits + 2
    }

    /// A line is high for less than this inside a field, in bits.
    fn longest_high(&self) -> f64 {
        f64::from(self.field_bits()) + 1.0
    }

    #[inline]
    fn push(&mut self, edge: Edge) {
        self.rates.count_edge(edge.spikes);
        // A burst begins with a falling edge; a rising one ends something from before the capture.
        if self.burst.is_empty() && edge.level {
            self.dropped = self.dropped.saturating_add(edge.spikes);
        } else {
            self.burst.push(edge);
        }
    }

    #[inline]
    fn edge(&mut self, edge: Edge) {
        let pause = self.burst.last().map_or(0, |last| edge.time - last.time);
        if pause > self.rest && (!edge.level || pause > LONGEST_LOW) {
            self.close();
        } else if self.burst.len() >= MOST_EDGES {
            self.read(false);
        }
        self.push(edge);
    }

    fn close(&mut self) {
        self.read(true);
        self.burst.clear();
    }

    /// Reads the burst speaker by speaker. Unless it is `whole`, the fields of its last speaker stay for the next call.
    fn read(&mut self, whole: bool) {
        let burst = std::mem::take(&mut self.burst);
        let mut rest = burst.as_slice();
        let skipped = std::mem::take(&mut self.skipped) as usize;
        if skipped > 0 {
            let mut falls = rest.iter().enumerate().filter(|(_, edge)| !edge.level);
            let (piece, fields) = rest.split_at(falls.nth(skipped).map_or(rest.len(), |(at, _)| at));
            if let (Some(first), Some(last)) = (piece.first(), piece.last()) {
                // It is not known how long the level after its last edge still belongs to it.
                let end = last.time + self.bit as i64;
                let (start, end) = (first.time, fields.first().map_or(end, |next| end.min(next.time)));
                self.fields.push(LineField { content: 0, delimiter: false, start, end, spikes: 0, bits: 0 });
            }
            rest = fields;
        }
        while !rest.is_empty() {
            let (bit, first) = (self.heard.first().copied(), self.fields.len());
            let exact = bit.and_then(|bit| even::exact(rest, self.field_bits(), bit, &mut self.fields));
            let speech = exact.unwrap_or_else(|| self.speech(rest));
            let (now, after) = rest.split_at(speech.min(rest.len()));
            if after.is_empty() && !whole && now.len() < MOST_EDGES / 2 {
                self.fields.truncate(first);
                break;
            }
            match bit.filter(|_| exact.is_some()) {
                Some(bit) => self.spoke_exactly(now, first, bit),
                None => self.speak(now),
            }
            rest = after;
        }
        let kept = burst.len() - rest.len();
        self.burst = burst;
        if kept == self.burst.len() && self.past.is_empty() {
            std::mem::swap(&mut self.past, &mut self.burst);
        } else {
            self.past.extend(self.burst.drain(..kept));
        }
    }

    /// Returns the number of edges up to the first pause in which another speaker may have begun.
    fn speech(&self, edges: &[Edge]) -> usize {
        let Some((first, rest)) = edges.split_first() else { return 0 };
        let bit = self.bit_heard();
        let mut start = first.time;
        let last = ((f64::from(self.field_bits()) - 1.0) * bit) as i64;
        let other = (f64::from(self.field_bits() + even::OTHER_SPEAKER) * bit) as i64;
        for (at, edge) in rest.iter().enumerate() {
            let time = edge.time.after(start);
            if edge.level || time < last {
                continue;
            }
            if time > other {
                return at + 1;
            }
            start = edge.time;
        }
        edges.len()
    }

    /// The fields from number `first` onwards were read from the edges of one speaker, which were all in their places.
    fn spoke_exactly(&mut self, edges: &[Edge], first: usize, bit: f64) {
        if let Some(field) = self.fields.get_mut(first) {
            field.spikes = std::mem::take(&mut self.dropped);
        }
        self.spoke(edges, first, &grid::Found { bit, is_sure: true, alone: Some(bit), misfit: 0.0, read_by: None });
    }

    /// Reads the fields of one speaker.
    fn speak(&mut self, edges: &[Edge]) {
        let field_bits = self.field_bits();
        let found = grid::fit(edges, field_bits, self.bit, &mut self.heard, &mut self.tried);
        let grid::Found { bit, read_by, .. } = found;
        let speaker = field::Speaker::new(field_bits, bit);
        let first = self.fields.len();
        let mut line = field::Line::IDLE;
        if let Some(by) = read_by {
            let mut fields = std::mem::take(&mut self.tried.best);
            for field in fields.drain(..) {
                let read = field.read(bit, by / bit);
                line.add(&read, speaker);
                self.take_field(&read, speaker);
            }
            self.tried.best = fields;
        } else {
            let mut rest = edges;
            while let Some((read, next)) = field::read(rest, speaker) {
                line.add(&read, speaker);
                self.take_field(&read, speaker);
                rest = next;
            }
        }
        self.spoke(edges, first, &found);
        if let Some(field) = self.fields.get_mut(first) {
            field.bits = line.bits(edges, field.start, speaker);
        }
    }

    /// Keeps the measurements of a speaker whose fields begin with number `first`.
    fn spoke(&mut self, edges: &[Edge], first: usize, found: &grid::Found) {
        let grid::Found { bit, is_sure, alone, misfit, .. } = *found;
        if is_sure {
            self.rates.measured(self.bit / bit);
        }
        let pause = edges.first().zip(self.until).map(|(edge, until)| (edge.time - until) as f64 / bit);
        let answers = pause.is_some_and(|pause| pause < ANSWERS_WITHIN);
        if let Some(alone) = alone.filter(|_| is_sure) {
            self.rates.spoke(answers, self.bit / alone);
        }
        if is_sure && !answers {
            let (spread, count) = &mut self.spread;
            if let Some(place) = spread.get_mut(*count % LATELY) {
                *place = misfit;
            }
            *count += 1;
        }
        self.until = self.fields.last().map(|field| field.end);
        self.time_fields(first, bit);
    }

    /// Fields that follow each other without a pause tell the bit length better than the edges inside them.
    fn time_fields(&mut self, first: usize, bit: f64) {
        let fields = self.fields.get(first..).unwrap_or_default();
        let [begin, .., last] = fields else { return };
        let (time, bits) =
            ((last.start - begin.start) as f64, f64::from(self.field_bits()) * (fields.len() - 1) as f64);
        if (time - bits * bit).abs() < 0.5 * bit {
            self.rates.weigh(self.bit * bits / time, bits * bits);
        }
    }

    /// Adds a field of a speaker.
    #[inline]
    fn take_field(&mut self, read: &reading::Read, speaker: field::Speaker) {
        let reading::Read { bits, start, spikes, .. } = *read;
        let spikes = spikes.saturating_add(std::mem::take(&mut self.dropped));
        if bits & 1 == 1 {
            // The start bit was not a bit.
            self.dropped = spikes.saturating_add(1);
            return;
        }
        self.fields.push(LineField {
            content: (bits >> 1 & ((1 << self.content_bits) - 1)) as u16,
            delimiter: bits >> (self.content_bits + 1) & 1 == 1,
            start,
            end: start + speaker.field,
            spikes,
            bits: 0,
        });
    }
}
