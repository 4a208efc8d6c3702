//! What was measured on a line while its fields were received.

/// Many measurements of the same quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Many {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Many {
    const NONE: Self = Self { count: 0.0, sum: 0.0, squares: 0.0 };

    /// Returns the mean and its standard error, if there are enough measurements.
    fn mean(self) -> Option<(f64, f64)> {
        let mean = self.sum / self.count;
        let variance = (self.squares / self.count - mean * mean).max(0.0);
        (self.count >= FEWEST).then(|| (mean, SURE * (variance / self.count).sqrt()))
    }
}

/// Minimum number of measurements for a mean, and the number of standard errors by which it may be off.
const FEWEST: f64 = 6.0;
const SURE: f64 = 4.0;
/// Clocks that differ by less than this are not told apart.
const SAME_CLOCK: f64 = 0.002;

/// Bit rates measured on a line, relative to the nominal one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// Slowest.
    pub least: f64,
    /// Fastest.
    pub most: f64,
    sum: f64,
    weight: f64,
    /// Rates of the end that speaks after a pause, as a controller does, and of the end that answers at once.
    ends: [Many; 2],
    /// Spikes dropped so far.
    pub spikes: u64,
    /// Edges that were kept.
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
            ends: [Many::NONE; 2],
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

    /// Counts an edge that is kept, and the spikes dropped before it.
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

    /// Adds the rate of one end of the line: the one that `answers`, or the other one.
    #[inline]
    pub(super) fn spoke(&mut self, answers: bool, rate: f64) {
        let [asking, answering] = &mut self.ends;
        let end = if answers { answering } else { asking };
        let off = rate - 1.0;
        *end = Many { count: end.count + 1.0, sum: end.sum + off, squares: end.squares + off * off };
    }

    /// Returns the rates of the two ends of the line, the slower one first, if they have different clocks.
    pub(crate) fn ends(&self) -> Option<[f64; 2]> {
        let [asking, answering] = self.ends.map(Many::mean);
        let ((asking, near), (answering, also_near)) = (asking?, answering?);
        let differ = (asking - answering).abs() > SAME_CLOCK.max(near + also_near);
        differ.then(|| [1.0 + asking.min(answering), 1.0 + asking.max(answering)])
    }

    /// Adds a rate to the mean.
    pub(super) fn weigh(&mut self, rate: f64, weight: f64) {
        self.sum += rate * weight;
        self.weight += weight;
    }
}
