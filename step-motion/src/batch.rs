//! Steps that are made ahead, where registers are few.
#![expect(clippy::cast_possible_truncation, reason = "a small number")]

use crate::guess::Guess;

/// Ticks of steps that are looked for one by one, the last one first. Where registers are few a loop of its own has room in them
/// for what it needs; where they are many, it is there from step to step, and an array would take it out of them.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Batch {
    ticks: [u64; Batch::SIZE],
    pub(super) left: u32,
}

impl Batch {
    /// How many there may be; unit tests make them everywhere.
    pub(super) const SIZE: usize = if cfg!(all(target_pointer_width = "64", not(test))) { 0 } else { 16 };

    pub(super) const NONE: Self = Self { ticks: [0; Self::SIZE], left: 0 };

    /// The next of them.
    #[inline(always)]
    pub(super) fn next(&mut self) -> Option<u64> {
        self.left = self.left.checked_sub(1)?;
        self.ticks.get(self.left as usize).copied()
    }

    /// With those of the next `left` steps that `guess` looks for one by one; what is left then.
    pub(super) fn fill(&mut self, guess: &mut Guess, left: u32, last: u64) -> u32 {
        let count = guess.singles(left).min(Self::SIZE as u32);
        let mut free = count;
        guess.fold(count, last, (), &mut |(), tick| {
            free = free.wrapping_sub(1);
            if let Some(place) = self.ticks.get_mut(free as usize) {
                *place = tick;
            }
        });
        self.left = count;
        left.wrapping_sub(count)
    }
}
