//! Levels of a line as they are driven, and as an instrument records them.

use super::rng::Rng;

/// Levels of a line by time in picoseconds.
#[derive(Debug, Clone)]
pub(crate) struct Wire {
    /// The level before the first edge.
    pub(crate) begins: bool,
    pub(crate) edges: Vec<(f64, bool)>,
}

impl Wire {
    pub(crate) fn new(begins: bool) -> Self {
        Self { begins, edges: Vec::new() }
    }

    pub(crate) fn level(&self) -> bool {
        self.edges.last().map_or(self.begins, |(_, level)| *level)
    }

    /// The line has this level from `time` on.
    pub(crate) fn drive(&mut self, time: f64, level: bool) {
        if self.level() != level {
            self.edges.push((time, level));
        }
    }

    /// Bits one after the other, the first at `time`; when the last is over.
    pub(crate) fn send(&mut self, time: f64, bit: f64, bits: &[bool]) -> f64 {
        for (at, level) in bits.iter().enumerate() {
            self.drive(time + at as f64 * bit, *level);
        }
        time + bits.len() as f64 * bit
    }
}

/// How it is recorded.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recording {
    /// Picoseconds between samples; none: exact times.
    pub(crate) period: Option<f64>,
    /// Edges lie off by up to so many picoseconds, either way.
    pub(crate) jitter: f64,
    /// Where the recording begins.
    pub(crate) from: f64,
    pub(crate) inverted: bool,
}

impl Recording {
    pub(crate) const EXACT: Self = Self { period: None, jitter: 0.0, from: 0.0, inverted: false };
}

/// The level at the beginning, and all changes.
pub(crate) fn record(wire: &Wire, how: Recording, rng: &mut Rng) -> Vec<(i64, bool)> {
    let mut out = vec![(how.from.round() as i64, wire.begins)];
    let phase = rng.between(0.0, how.period.unwrap_or(0.0));
    for (time, level) in &wire.edges {
        let time = time + rng.between(-how.jitter, how.jitter);
        let seen = how.period.map_or(time, |period| ((time - phase) / period).ceil() * period + phase);
        let at = seen.max(how.from).round() as i64;
        match out.last_mut() {
            Some((before, last)) if *before >= at => *last = *level,
            _ => out.push((at, *level)),
        }
    }
    out.dedup_by_key(|(_, level)| *level);
    for (_, level) in &mut out {
        *level ^= how.inverted;
    }
    out
}
