//! What one cycle of the IO exchange has brought.

/// What the present cycle has brought, and how many before it were bad in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Cycle {
    /// A master frame has been sent.
    pub(super) open: bool,
    /// A bit for each address that has answered.
    pub(super) seen: [u64; 4],
    /// A device frame was damaged.
    pub(super) damaged: bool,
    pub(super) damaged_in_a_row: u8,
    pub(super) silent_in_a_row: u8,
}

impl Cycle {
    pub(super) const NEW: Self =
        Self { open: false, seen: [0; 4], damaged: false, damaged_in_a_row: 0, silent_in_a_row: 0 };

    pub(super) fn mark(&mut self, address: u8) {
        if let Some(word) = self.seen.get_mut(usize::from(address >> 6)) {
            *word |= 1 << (address & 63);
        }
    }

    pub(super) fn has(&self, address: u8) -> bool {
        self.seen.get(usize::from(address >> 6)).is_some_and(|word| word >> (address & 63) & 1 == 1)
    }

    /// Devices seen; a fast way to tell that none is missing.
    pub(super) const fn count(&self) -> u32 {
        let [a, b, c, d] = self.seen;
        // At most 256.
        a.count_ones().saturating_add(b.count_ones()).saturating_add(c.count_ones()).saturating_add(d.count_ones())
    }
}
