//! Start-stop fields from the edges of a line whose speakers keep their own time.
//!
//! Edges are gathered until the line rests. What follows without a change of direction was sent by one clock: its bit
//! length is fitted to the edges, then every field is read on the grid that fits it best. So a controller and an encoder
//! may be off by some per cent each, and jitter and spikes move no bit.

use super::spikes::{Edge, Spikes};
use super::start_stop::LineField;

use crate::time::Time;

/// How far a speaker's bit may be from the nominal one: one part in this many.
const OFF: f64 = 0.065;
/// Steps of the search for a bit length, to each side.
const STEPS: i32 = 26;
/// Bits without a field after which somebody else may speak.
const OTHER_SPEAKER: f64 = 3.0;
/// Mean square distance from the grid, in bits, up to which a known bit length is kept.
const GOOD_FIT: f64 = 0.02;
/// Mean square distance up to which the bit length heard last is taken without looking at the others.
const PERFECT_FIT: f64 = 2e-4;
/// What a bit length far from the nominal one has against it, per edge, as a part of its square in nominal ones: clocks are
/// off by 2 %, and edges of a coarse or shaky recording by 0.07 of a bit. Three edges fit many grids.
const UNLIKELY: f64 = (0.07 * 0.07) / (0.02 * 0.02);
/// Edges of an open burst that are kept at most; further ones are read as far as whole fields go.
const MOST_EDGES: usize = 512;

/// Receives fields of one line. Levels are given as on an idle-high line.
#[derive(Debug, Clone)]
pub(crate) struct EdgeReceiver {
    bit: f64,
    content_bits: u32,
    spikes: Spikes,
    /// The open burst; it begins with a falling edge.
    burst: Vec<Edge>,
    /// Bit lengths heard, the last one first.
    heard: Vec<f64>,
    /// Sum of measured bit lengths in parts of the nominal, and how many.
    rates: Rates,
    /// Fields that end a burst, for the caller to take.
    fields: Vec<LineField>,
    /// Spikes dropped before the next field.
    dropped: u32,
    /// A line that is high for longer rests, in picoseconds.
    rest: i64,
    /// Falling edges of the first burst that are no start bits, until it has been read.
    skipped: u32,
    /// Edges that were read, until they are [forgotten](Self::forget).
    past: Vec<Edge>,
    /// Bit lengths that had been heard when they were.
    heard_before: Vec<f64>,
}

/// Bit rates measured on a line, relative to the nominal one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Slowest.
    pub least: f64,
    /// Fastest.
    pub most: f64,
    sum: f64,
    weight: f64,
    /// Spikes dropped so far.
    pub spikes: u64,
    /// Edges that stayed.
    pub edges: u64,
    /// Spikes that were dropped near a rising edge, and near a falling one.
    pub spikes_at: [u64; 2],
    /// How long these were together, in bits.
    pub spike_bits: f64,
    /// Dips when a driver let go of the line, behind which a frame was found by a second try.
    pub dips: u64,
    /// How long these were together, in bits.
    pub dip_bits: f64,
    /// Whether the line floats low where nobody drives it.
    pub floats_low: bool,
}

impl Default for Rates {
    fn default() -> Self {
        Self {
            least: f64::INFINITY,
            most: 0.0,
            sum: 0.0,
            weight: 0.0,
            spikes: 0,
            edges: 0,
            spikes_at: [0; 2],
            spike_bits: 0.0,
            dips: 0,
            dip_bits: 0.0,
            floats_low: false,
        }
    }
}

impl Rates {
    /// The mean rate as a share of the nominal one; none before a field was measured.
    pub(crate) fn mean(&self) -> Option<f64> {
        (self.weight > 0.0).then(|| self.sum / self.weight)
    }

    /// Of a line with this many edges and spikes.
    pub(crate) fn of(edges: u64, spikes: u64) -> Self {
        Self { spikes, edges, ..Self::default() }
    }

    /// An edge that stays, and the spikes dropped before it.
    pub(crate) fn count_edge(&mut self, spikes: u32) {
        self.spikes += u64::from(spikes);
        self.edges += 1;
    }

    /// The rate was measured once more, as a share of the nominal one.
    pub(crate) fn measured(&mut self, rate: f64) {
        self.least = self.least.min(rate);
        self.most = self.most.max(rate);
        self.weigh(rate, 1.0);
    }

    /// A rate counts in the mean.
    fn weigh(&mut self, rate: f64, weight: f64) {
        self.sum += rate * weight;
        self.weight += weight;
    }
}

impl EdgeReceiver {
    /// For fields of `content_bits`, 8 or 16, of bits of `bit` picoseconds.
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
        }
    }

    /// One that has measured what was measured until edges were forgotten, and holds nothing.
    #[must_use]
    pub(super) fn emptied(&self) -> Self {
        let heard = self.heard_before.clone();
        Self { heard_before: heard.clone(), heard, rates: self.rates, ..Self::new(self.bit, self.content_bits) }
    }

    /// What was measured since edges were forgotten was no speaker.
    pub(super) fn unlearn(&mut self) {
        self.heard.clone_from(&self.heard_before);
    }

    /// What `other` has measured of the speakers is true of these.
    pub(super) fn learn(&mut self, other: &Self) {
        self.heard.clone_from(&other.heard);
    }

    /// Takes edges behind which the line rests.
    pub(super) fn feed(&mut self, edges: &[Edge]) {
        for edge in edges {
            self.edge(*edge);
        }
        self.close();
    }

    /// The edges that were read since they were forgotten.
    pub(super) fn past(&self) -> &[Edge] {
        &self.past
    }

    /// Forgets the edges that were read.
    pub(super) fn forget(&mut self) {
        self.past.clear();
        self.heard_before.clone_from(&self.heard);
    }

    /// The bit length that fits the speaker who was heard last, in picoseconds.
    pub(super) fn bit_heard(&self) -> f64 {
        self.heard.first().copied().unwrap_or(self.bit)
    }

    /// Whether all edges were read but for the first of what follows.
    pub(super) fn is_between(&self) -> bool {
        self.burst.len() < 2
    }

    /// When what follows has begun, if it has.
    pub(super) fn begun(&self) -> Option<Time> {
        self.burst.first().map(|first| first.time)
    }

    /// The capture begins inside a field: this many falling edges are passed over before the first start bit.
    #[must_use]
    pub(crate) fn beginning_at(self, skipped: u32) -> Self {
        Self { skipped, ..self }
    }

    /// What was measured so far.
    pub(crate) fn rates(&self) -> Rates {
        let (spikes_at, spike_bits) = self.spikes.near_edges();
        Rates { spikes_at, spike_bits, ..self.rates }
    }

    /// The line takes a level. Says whether there are fields to [`take`](Self::take).
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

    /// The line has not changed until `time`. Says whether there are fields to [`take`](Self::take).
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

    /// The capture ends at `time`. A high level is taken to last; a field that ends low is not whole and is left out.
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

    /// The fields that are complete.
    pub(crate) fn take(&mut self) -> std::vec::Drain<'_, LineField> {
        self.fields.drain(..)
    }

    fn field_bits(&self) -> u32 {
        self.content_bits + 2
    }

    /// Longer than a line is high inside a field, in bits.
    fn longest_high(&self) -> f64 {
        f64::from(self.field_bits()) + 1.0
    }

    fn push(&mut self, edge: Edge) {
        self.rates.count_edge(edge.spikes);
        // A burst begins with a falling edge: a rising one ends what was before the capture.
        if self.burst.is_empty() && edge.level {
            self.dropped = self.dropped.saturating_add(edge.spikes);
        } else {
            self.burst.push(edge);
        }
    }

    fn edge(&mut self, edge: Edge) {
        let pause = self.burst.last().map_or(0, |last| edge.time - last.time);
        if !edge.level && pause > self.rest {
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

    /// Reads the burst speaker by speaker. Unless it is `whole`, its last speech stays for the next time.
    fn read(&mut self, whole: bool) {
        let burst = std::mem::take(&mut self.burst);
        let mut rest = burst.as_slice();
        let skipped = std::mem::take(&mut self.skipped) as usize;
        if skipped > 0 {
            let mut falls = rest.iter().enumerate().filter(|(_, edge)| !edge.level);
            let (piece, fields) = rest.split_at(falls.nth(skipped).map_or(rest.len(), |(at, _)| at));
            if let (Some(first), Some(last)) = (piece.first(), piece.last()) {
                // How long the level after its last edge still belongs to it is not known.
                let end = last.time + self.bit as i64;
                let (start, end) = (first.time, fields.first().map_or(end, |next| end.min(next.time)));
                self.fields.push(LineField { content: 0, delimiter: false, start, end, spikes: 0, bits: 0 });
            }
            rest = fields;
        }
        while !rest.is_empty() {
            let speech = self.speech(rest);
            let (now, after) = rest.split_at(speech.min(rest.len()));
            if after.is_empty() && !whole && now.len() < MOST_EDGES / 2 {
                break;
            }
            self.speak(now);
            rest = after;
        }
        let kept = burst.len() - rest.len();
        self.past.extend_from_slice(burst.get(..kept).unwrap_or_default());
        self.burst = burst;
        self.burst.drain(..kept);
    }

    /// Edges up to the first pause in which somebody else may have begun.
    fn speech(&self, edges: &[Edge]) -> usize {
        let bit = self.heard.first().copied().unwrap_or(self.bit);
        let mut start = edges.first().map_or(Time::ZERO, |edge| edge.time);
        let last = ((f64::from(self.field_bits()) - 1.0) * bit) as i64;
        let other = ((f64::from(self.field_bits()) + OTHER_SPEAKER) * bit) as i64;
        for (at, edge) in edges.iter().enumerate().skip(1) {
            let time = edge.time - start;
            if edge.level || time < last {
                continue;
            }
            if time > other {
                return at;
            }
            start = edge.time;
        }
        edges.len()
    }

    /// Fields of one speaker.
    fn speak(&mut self, edges: &[Edge]) {
        let bit = self.fit(edges);
        let first = self.fields.len();
        let mut rest = edges;
        while let Some(start) = rest.first() {
            let last = start.time + ((f64::from(self.field_bits()) - 0.6) * bit) as i64;
            let inside = rest.iter().skip(1).position(|edge| !edge.level && edge.time > last);
            let (field, after) = rest.split_at(inside.map_or(rest.len(), |at| at + 1));
            self.field(field, bit);
            rest = after;
        }
        self.time_fields(first, bit);
        if let Some(field) = self.fields.get_mut(first) {
            field.bits = line_bits(edges, field.start, bit);
        }
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

    /// A field on its grid: its start bit begins with the first edge.
    fn field(&mut self, edges: &[Edge], bit: f64) {
        let Some(first) = edges.first() else { return };
        let per = 1.0 / bit;
        let place = |edge: &Edge| (edge.time - first.time) as f64 * per;
        // The first edge is as uncertain as the others: the grid lies where all fit best.
        let whole = f64::from(self.field_bits());
        let (mut sum, mut count) = (0.0, 1.0);
        for at in edges.iter().skip(1).map(place).take_while(|at| *at < whole - 0.4) {
            sum += at - nearest(at);
            count += 1.0;
        }
        let shift = sum / count;
        let (mut bits, mut level, mut from) = (0_u32, false, 0_u32);
        let mut spikes = 0_u32;
        for edge in edges {
            spikes = spikes.saturating_add(edge.spikes);
        }
        for edge in edges.iter().skip(1) {
            let at = nearest(place(edge) - shift).clamp(0.0, whole) as u32;
            if level && at > from {
                bits |= ones(at) & !ones(from);
            }
            (level, from) = (edge.level, at.max(from));
        }
        if level {
            bits |= ones(self.field_bits()) & !ones(from);
        }
        let spikes = spikes.saturating_add(std::mem::take(&mut self.dropped));
        if bits & 1 == 1 {
            // The start bit was no bit.
            self.dropped = spikes.saturating_add(1);
            return;
        }
        let start = first.time + (shift * bit) as i64;
        self.fields.push(LineField {
            content: (bits >> 1 & ones(self.content_bits)) as u16,
            delimiter: bits >> (self.content_bits + 1) & 1 == 1,
            start,
            end: start + (whole * bit) as i64,
            spikes,
            bits: 0,
        });
    }

    /// The bit length that fits the edges: one that was heard before if it does, else the best.
    fn fit(&mut self, edges: &[Edge]) -> f64 {
        let mut best: Option<(Fit, usize)> = None;
        for (at, bit) in self.heard.iter().enumerate() {
            let fit = self.measure(edges, *bit);
            if fit.misfit < GOOD_FIT && best.is_none_or(|(least, _)| fit.misfit < least.misfit) {
                best = Some((fit, at));
                if at == 0 && fit.misfit < PERFECT_FIT {
                    break;
                }
            }
        }
        if let Some((fit, at)) = best {
            // The last one heard comes first.
            if let Some(before) = self.heard.get_mut(..=at) {
                before.rotate_right(1);
            }
            let Some(bit) = self.heard.first_mut() else { return self.bit };
            *bit += 0.2 * (fit.slope(*bit) - *bit);
            self.rates.measured(self.bit / *bit);
            return *bit;
        }
        let step = OFF / f64::from(STEPS);
        let against = UNLIKELY / edges.len().max(1) as f64;
        let mut found = (self.measure(edges, self.bit), self.bit, 0.0);
        for k in 1..=STEPS {
            for side in [-1.0, 1.0] {
                let off = f64::from(k) * step;
                let bit = self.bit * (1.0 + side * off);
                let fit = self.measure(edges, bit);
                let unlikely = against * off * off;
                if fit.misfit + unlikely < found.0.misfit + found.2 {
                    found = (fit, bit, unlikely);
                }
            }
        }
        let bit = found.0.slope(found.1);
        if found.0.misfit < GOOD_FIT && edges.len() > 3 {
            self.heard.insert(0, bit);
            self.heard.truncate(4);
            self.rates.measured(self.bit / bit);
        }
        bit
    }

    /// How the edges lie on the grids of their fields; each field has an offset of its own.
    fn measure(&self, edges: &[Edge], bit: f64) -> Fit {
        let (mut all, mut edges_in_all, mut above, mut below) = (0.0, 0.0, 0.0, 0.0);
        // Sums over a field, whose first edge lies at 0.
        let (mut count, mut off, mut squares, mut places, mut spread, mut both) = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut close = |count: f64, off: f64, squares: f64, places: f64, spread: f64, both: f64| {
            let per = 1.0 / count;
            all += squares - off * off * per;
            below += spread - places * places * per;
            above += both - places * off * per;
        };
        self.each(edges, bit, |place, first| {
            if first {
                close(count, off, squares, places, spread, both);
                (count, off, squares, places, spread, both) = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            }
            let whole = nearest(place);
            let distance = place - whole;
            off += distance;
            squares += distance * distance;
            places += whole;
            spread += whole * whole;
            both += whole * distance;
            count += 1.0;
            edges_in_all += 1.0;
        });
        close(count, off, squares, places, spread, both);
        Fit { misfit: if edges_in_all > 0.0 { all / edges_in_all } else { 0.0 }, above, below }
    }

    /// The places of all edges but the first of each field, in bits from the start of the field.
    fn each(&self, edges: &[Edge], bit: f64, mut take: impl FnMut(f64, bool)) {
        let last = f64::from(self.field_bits()) - 0.6;
        let per = 1.0 / bit;
        let mut start = edges.first().map_or(Time::ZERO, |edge| edge.time);
        let mut first = true;
        for edge in edges.iter().skip(1) {
            let place = (edge.time - start) as f64 * per;
            if place > last && !edge.level {
                start = edge.time;
                first = true;
            } else if place < last + 0.2 {
                take(place, first);
                first = false;
            }
        }
    }
}

/// How edges lie on a grid.
#[derive(Debug, Clone, Copy)]
struct Fit {
    /// Mean square distance, in bits.
    misfit: f64,
    /// How the distances go with the places, and how far the places are spread: sums of products.
    above: f64,
    below: f64,
}

impl Fit {
    /// The bit length by which the edges lie best, where `bit` is that of the grid.
    fn slope(self, bit: f64) -> f64 {
        // Few short fields say little.
        if self.below < 40.0 { bit } else { bit * (1.0 + self.above / self.below).clamp(0.97, 1.03) }
    }
}

/// The nearest whole number, for values not below -0.5.
#[inline]
fn nearest(number: f64) -> f64 {
    (number + 0.5) as i64 as f64
}

/// Bits of a line from `start` on.
fn line_bits(edges: &[Edge], start: Time, bit: f64) -> u128 {
    let per = 1.0 / bit;
    let place = |edge: &Edge| nearest((edge.time - start) as f64 * per).clamp(0.0, 128.0) as u32;
    let below = |at: u32| 1_u128.checked_shl(at).map_or(u128::MAX, |bit| bit - 1);
    let mut bits = u128::MAX;
    for (k, edge) in edges.iter().enumerate().filter(|(_, edge)| !edge.level) {
        let from = place(edge);
        if from >= 128 {
            break;
        }
        let until = edges.get(k + 1).map_or(128, place);
        bits &= !(below(until) & !below(from));
    }
    bits
}

/// So many ones.
const fn ones(count: u32) -> u32 {
    if count >= 32 { u32::MAX } else { (1 << count) - 1 }
}
