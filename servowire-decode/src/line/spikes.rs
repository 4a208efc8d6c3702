//! Removes runs that are too short to be a bit.

use crate::time::Time;

/// Runs shorter than this, in bits, are spikes: more than a sample at four samples per bit, less than a bit with jitter at
/// both ends.
const SHORTEST_RUN: f64 = 0.375;

/// A cluster between equal levels that spends this long at the other level is a bit in pieces; in bits.
const TORN_BIT: f64 = 0.5;

/// A spike within this many bits after an edge belongs to it.
const NEAR: f64 = 0.7;

/// An edge between two levels that last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Edge {
    /// When, in picoseconds.
    pub(crate) time: Time,
    /// The level from here onwards.
    pub(crate) level: bool,
    /// Spikes dropped since the previous edge.
    pub(crate) spikes: u32,
}

/// Drops spikes from a line.
///
/// Between two levels that last lies one edge, or a cluster of short runs (ringing). A cluster becomes one edge, placed
/// so that each level keeps its time; a cluster between equal levels disappears. The memory needed is constant, however long
/// the cluster is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spikes {
    bit: f64,
    shortest: i64,
    /// The last level that lasted.
    solid: Option<bool>,
    /// The present level and since when.
    level: bool,
    since: Time,
    /// Edges of the cluster, and its time at the level opposite to the solid one.
    edges: u32,
    other: i64,
    /// When the cluster began.
    begun: Time,
    dropped: u32,
    /// Time of the previous edge.
    last: Time,
    /// Clusters near a rising edge and near a falling one, and the total length of their spikes, in bits.
    near: [u64; 2],
    near_bits: f64,
}

/// Up to two edges: both edges of a bit in pieces come together.
pub(crate) type Edges = [Option<Edge>; 2];

impl Spikes {
    /// Creates it for bits of `bit` picoseconds.
    pub(crate) fn new(bit: f64) -> Self {
        let shortest = (bit * SHORTEST_RUN) as i64;
        Self {
            bit,
            shortest,
            solid: None,
            level: true,
            since: Time::ZERO,
            edges: 0,
            other: 0,
            begun: Time::ZERO,
            dropped: 0,
            last: Time::ZERO,
            near: [0; 2],
            near_bits: 0.0,
        }
    }

    /// Returns how many spikes were near a rising edge and near a falling one, and their total length in bits.
    pub(crate) fn near_edges(&self) -> ([u64; 2], f64) {
        (self.near, self.near_bits)
    }

    /// Does the same as [`change`](Self::change) if the previous change was a clean edge, as it nearly always is.
    #[inline]
    pub(crate) fn plain_change(&mut self, time: Time, level: bool) -> Option<Edge> {
        let is_plain = self.edges == 1 && level != self.level && (time - self.since) >= self.shortest;
        is_plain.then(|| {
            let edge = self.edge(self.since, self.level);
            (self.solid, self.begun) = (Some(self.level), time);
            (self.level, self.since) = (level, time);
            edge
        })
    }

    /// Returns the length below which a run is a spike.
    pub(super) fn shortest(&self) -> i64 {
        self.shortest
    }

    /// Returns when the level last changed, if that is an edge that has not been reported yet and no spike is near.
    pub(super) fn plain(&self) -> Option<Time> {
        (self.edges == 1 && self.dropped == 0).then_some(self.since)
    }

    /// Notes that all changes of a [plain](Self::plain) line were edges. Those up to `last` have been reported, the one at
    /// `since` has not.
    pub(super) fn go_on(&mut self, last: &Edge, since: Time) {
        if since != self.since {
            (self.last, self.solid) = (last.time, Some(last.level));
            (self.level, self.since, self.begun) = (!last.level, since, since);
        }
    }

    /// The line changes to `level`; returns the earlier edges whose levels are now known to last.
    #[inline]
    pub(crate) fn change(&mut self, time: Time, level: bool) -> Edges {
        let edge = self.reach(time);
        match self.solid {
            None => {
                self.solid = Some(level);
                (self.level, self.since) = (level, time);
            }
            Some(solid) if level != self.level => {
                if self.edges > 0 && self.level != solid {
                    self.other = self.other.saturating_add(time - self.since);
                }
                if self.edges == 0 {
                    self.begun = time;
                }
                self.edges = self.edges.saturating_add(1);
                (self.level, self.since) = (level, time);
            }
            Some(_) => {}
        }
        edge
    }

    /// The line has not changed until `time`.
    #[inline]
    pub(crate) fn reach(&mut self, time: Time) -> Edges {
        let Some(solid) = self.solid else { return [None; 2] };
        if self.edges == 0 || (time - self.since) < self.shortest {
            return [None; 2];
        }
        if self.edges == 1 {
            // A plain edge.
            self.edges = 0;
            self.solid = Some(self.level);
            return [Some(self.edge(self.since, self.level)), None];
        }
        self.cluster(solid)
    }

    /// Returns the edges that a cluster of short runs after `solid` amounts to.
    #[cold]
    fn cluster(&mut self, solid: bool) -> Edges {
        let (count, other) = (self.edges, self.other);
        (self.edges, self.other) = (0, 0);
        self.classify(solid, other);
        if self.level != solid {
            self.dropped = self.dropped.saturating_add(count / 2);
            self.solid = Some(self.level);
            return [Some(self.edge(self.since - other, self.level)), None];
        }
        let whole = (other as f64 / self.bit).round();
        if (other as f64) < TORN_BIT * self.bit {
            self.dropped = self.dropped.saturating_add(count / 2);
            return [None; 2];
        }
        self.dropped = self.dropped.saturating_add(count / 2 - 1);
        let after = (self.begun + ((whole * self.bit) as i64)).min(self.since);
        [Some(self.edge(self.begun, !solid)), Some(self.edge(after, solid))]
    }

    /// Assigns a cluster of spikes to the edge that it is near, if there is one.
    fn classify(&mut self, solid: bool, other: i64) {
        let rings = self.level != solid;
        // A spike beside an edge of the line, or before the edge that ends the cluster.
        let (spike, rising) = if rings {
            (other.min(self.since - self.begun - other), self.level)
        } else if (self.begun - self.last) as f64 <= NEAR * self.bit {
            (other, solid)
        } else {
            return;
        };
        let [up, down] = &mut self.near;
        *(if rising { up } else { down }) += 1;
        self.near_bits += spike as f64 / self.bit;
    }

    /// Returns the last change of the line and the level since.
    pub(crate) fn last_change(&self) -> Option<(Time, bool)> {
        self.solid.map(|_| (self.since, self.level))
    }

    /// Returns the last change of the line and the level since, if no spike is near.
    pub(crate) fn settled(&self) -> Option<(Time, bool)> {
        (self.solid == Some(self.level) && self.edges == 0 && self.dropped == 0).then_some((self.since, self.level))
    }

    /// Notes that the last change was at `time`, and that the level since has lasted.
    pub(crate) fn settle(&mut self, time: Time, level: bool) {
        (self.solid, self.level, self.since, self.edges, self.other) = (Some(level), level, time, 0, 0);
    }

    fn edge(&mut self, time: Time, level: bool) -> Edge {
        self.last = time;
        Edge { time, level, spikes: std::mem::take(&mut self.dropped) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clean(changes: &[(i128, bool)], end: i128) -> Vec<(i128, bool, u32)> {
        let mut spikes = Spikes::new(100.0);
        let mut out: Vec<Edge> =
            changes.iter().flat_map(|&(time, level)| spikes.change(Time::from_ps(time), level)).flatten().collect();
        out.extend(spikes.reach(Time::from_ps(end)).into_iter().flatten());
        out.iter().map(|edge| (edge.time.ps(), edge.level, edge.spikes)).collect()
    }

    #[test]
    fn a_clean_line_is_left_alone() {
        let line = [(0, true), (100, false), (200, true), (500, false)];
        assert_eq!(clean(&line, 600), [(100, false, 0), (200, true, 0), (500, false, 0)]);
    }

    #[test]
    fn a_spike_is_gone_and_counted_with_the_next_edge() {
        assert_eq!(clean(&[(0, true), (40, false), (60, true), (200, false)], 300), [(200, false, 1)]);
    }

    #[test]
    fn a_bit_torn_by_spikes_is_put_together() {
        let line = [(0, true), (200, false), (230, true), (250, false), (270, true), (280, false), (300, true)];
        assert_eq!(clean(&line, 500), [(200, false, 2), (300, true, 0)]);
    }

    #[test]
    fn ringing_is_one_edge_that_keeps_the_times_of_the_levels() {
        // 10 low, 20 high, then low for good: 20 high lie after the first edge.
        let line = [(0, true), (200, false), (210, true), (230, false)];
        assert_eq!(clean(&line, 400), [(220, false, 1)]);
    }
}
