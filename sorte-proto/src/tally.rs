/// Faults in the frames of one sender in the IO exchange, other than a wrong checksum. All counts saturate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tally {
    /// Cycles in which no frame came in time.
    pub missed: u32,
    /// Frames that came a second time in their cycle.
    pub doubled: u32,
    /// Frames that came at the wrong time.
    pub late: u32,
    /// Frames of a cycle that has ended.
    pub stale: u32,
}

/// The faults of a frame of the exchange whose checks are right, or which is missing.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Fault {
    Missed,
    Doubled,
    Late,
    Stale,
}

impl Tally {
    pub(crate) const ZERO: Self = Self { missed: 0, doubled: 0, late: 0, stale: 0 };

    pub(crate) const fn add(&mut self, fault: Fault) {
        let count = match fault {
            Fault::Missed => &mut self.missed,
            Fault::Doubled => &mut self.doubled,
            Fault::Late => &mut self.late,
            Fault::Stale => &mut self.stale,
        };
        *count = count.saturating_add(1);
    }
}

servowire_core::one_line!(Tally {
    Self { missed, doubled, late, stale } => "{} missed, {} doubled, {} late, {} stale", missed, doubled, late, stale;
});
