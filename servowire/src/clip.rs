//! A piece of a recording around one frame: its levels, its bits, and what is wrong in it.

use servowire_decode::capture::Change;
use servowire_decode::event::{Event, Place, Refusal, Verdict};
use servowire_decode::output::printer::Lane;
use servowire_decode::time::Time;

/// Bits before and after the frame.
const AROUND: i64 = 6;
/// Largest error of a speaker's clock, in parts per thousand.
const OFF: i64 = 60;
/// Maximum number of bits drawn one by one.
const MOST_BITS: i64 = 400;

/// Levels of a channel.
#[derive(Debug, Clone)]
pub(crate) struct Trace {
    pub(crate) name: String,
    /// Its level at the beginning, if known, and its edges.
    pub(crate) edges: Vec<(Time, bool)>,
}

/// The bits of a frame.
#[derive(Debug, Clone)]
pub(crate) struct Bits {
    start: Time,
    /// Picoseconds per bit, measured from the edges.
    width: f64,
    /// Their levels, in the order of the line.
    pub(crate) levels: Vec<bool>,
}

impl Bits {
    /// Returns when bit `index` begins.
    pub(crate) fn begin(&self, index: usize) -> Time {
        self.start + (self.width * index as f64) as i64
    }

    /// Returns the bit at a time.
    pub(crate) fn at(&self, time: Time) -> Option<usize> {
        let index = ((time - self.start) as f64 + self.width * 0.1) / self.width;
        (0.0..self.levels.len() as f64).contains(&index).then_some(index as usize)
    }
}

/// A frame with the line around it.
#[derive(Debug, Clone)]
pub(crate) struct Clip {
    pub(crate) event: Event,
    pub(crate) lane: Lane,
    pub(crate) from: Time,
    pub(crate) to: Time,
    pub(crate) traces: Vec<Trace>,
}

impl Clip {
    /// Creates a clip of an event with a time, still without levels; `names`: names of the channels.
    pub(crate) fn new(event: &Event, lane: &Lane, names: &[String]) -> Option<Self> {
        let Place::Time { start, end } = event.place else { return None };
        let around = (1_000_000_000_000 / i64::from(lane.rate.max(1)) * AROUND).max((end - start) / 20);
        let name = |channel: &u16| names.get(usize::from(*channel)).cloned().unwrap_or_default();
        let traces = lane.channels.iter().map(|channel| Trace { name: name(channel), edges: Vec::new() });
        let traces = traces.collect();
        Some(Self { event: event.clone(), lane: lane.clone(), from: start - around, to: end + around, traces })
    }

    /// Sets the levels of the channels at the beginning.
    pub(crate) fn begin(&mut self, level: impl Fn(u16) -> Option<bool>) {
        for (channel, trace) in self.lane.channels.iter().zip(&mut self.traces) {
            trace.edges.extend(level(*channel).map(|level| (self.from, level)));
        }
    }

    /// Takes the next change of any channel after the beginning, in the order of time.
    pub(crate) fn change(&mut self, change: &Change) {
        let own = self.lane.channels.iter().position(|channel| *channel == change.channel);
        let Some(trace) = own.and_then(|own| self.traces.get_mut(own)).filter(|_| change.time <= self.to) else {
            return;
        };
        trace.edges.push((change.time, change.level));
    }

    /// Returns start and end of the frame.
    pub(crate) fn span(&self) -> (Time, Time) {
        match self.event.place {
            Place::Time { start, end } => (start, end),
            Place::Line(_) => (self.from, self.to),
        }
    }

    pub(crate) fn refusal(&self) -> Option<&Refusal> {
        match &self.event.verdict {
            Verdict::Ok => None,
            Verdict::Refused(refusal) => Some(refusal),
        }
    }

    /// Returns the bits of the frame, as they look if the line idles high; none for a missing answer.
    pub(crate) fn bits(&self) -> Option<Bits> {
        if self.event.verdict.is_silence() {
            return None;
        }
        let (start, end) = self.span();
        let inside = |trace: &&Trace| trace.edges.iter().filter(|(time, _)| *time >= start && *time < end).count();
        let trace = self.traces.iter().max_by_key(inside)?;
        let nominal = 1e12 / f64::from(self.lane.rate.max(1));
        let edges: Vec<f64> = trace
            .edges
            .iter()
            .map(|(time, _)| (*time - start) as f64)
            .filter(|at| (0.0..(end - start) as f64).contains(at))
            .collect();
        // How far the edges are from the grid of a bit length.
        let misfit = |off: &i64| {
            let width = nominal * (1.0 + *off as f64 / 1e3);
            let apart = |at: &f64| (at / width - (at / width).round()).abs();
            (edges.iter().map(apart).sum::<f64>() * 1e6) as i64 + off.abs()
        };
        let off = (-OFF..=OFF).min_by_key(misfit).unwrap_or(0);
        let width = nominal * (1.0 + off as f64 / 1e3);
        let count = ((end - start) as f64 / width).round() as i64;
        if !(1..=MOST_BITS).contains(&count) {
            return None;
        }
        let level = |at: Time| trace.edges.iter().take_while(|(time, _)| *time <= at).last().map(|(_, level)| *level);
        // A line that rests low is upside down.
        let turned = !self.lane.protocol.clocked && level(start - width as i64) == Some(false);
        let middle = |bit: i64| start + (width * (bit as f64 + 0.5)) as i64;
        let levels = (0..count).map(|bit| level(middle(bit)).unwrap_or(true) != turned).collect();
        Some(Bits { start, width, levels })
    }

    /// Returns the bit that broke the frame, if the check identifies it.
    pub(crate) fn broken_bit(&self) -> Option<usize> {
        let refusal = self.refusal()?;
        let first = self.bits()?.at(refusal.time?)?;
        Some(first + refusal.bit? as usize)
    }

    /// Returns the place that is wrong: the bit, or else the field.
    pub(crate) fn broken(&self) -> Option<(Time, Time)> {
        let (refusal, bits) = (self.refusal()?, self.bits()?);
        if let Some(bit) = self.broken_bit() {
            return Some((bits.begin(bit), bits.begin(bit + 1)));
        }
        let first = bits.at(refusal.time?)?;
        // To the end of the field in the frame, which is that of ten bits or of a word where nothing tells it.
        let own = self.event.fields.iter().find(|field| Some(field.name) == refusal.field.as_deref());
        match own.and_then(|field| field.span).map(|span| span.place) {
            Some(Place::Time { start, end }) => Some((start, end)),
            _ => Some((bits.begin(first), self.span().1.min(bits.begin(first + 10)))),
        }
    }
}
