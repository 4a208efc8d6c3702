//! What was measured of a line while its fields were received.

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
    /// Their total length, in bits.
    pub spike_bits: f64,
    /// Dips when a driver released the line, after which a second attempt found a frame.
    pub dips: u64,
    /// Their total length, in bits.
    pub dip_bits: f64,
    /// Whether the line floats low while nobody drives it.
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
    /// Returns the mean rate relative to the nominal one; `None` until a field was measured.
    pub(crate) fn mean(&self) -> Option<f64> {
        (self.weight > 0.0).then(|| self.sum / self.weight)
    }

    /// Creates the measurements of a line with this many edges and spikes.
    pub(crate) fn of(edges: u64, spikes: u64) -> Self {
        Self { spikes, edges, ..Self::default() }
    }

    /// An edge that stays, and the spikes dropped before it.
    #[inline]
    pub(crate) fn count_edge(&mut self, spikes: u32) {
        self.spikes += u64::from(spikes);
        self.edges += 1;
    }

    /// Adds one measurement of the rate, relative to the nominal one.
    pub(crate) fn measured(&mut self, rate: f64) {
        self.least = self.least.min(rate);
        self.most = self.most.max(rate);
        self.weigh(rate, 1.0);
    }

    /// A rate counts in the mean.
    pub(super) fn weigh(&mut self, rate: f64, weight: f64) {
        self.sum += rate * weight;
        self.weight += weight;
    }
}
