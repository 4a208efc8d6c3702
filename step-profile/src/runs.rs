/// The move rule as runs of steps with the same ramp entry.
///
/// Step j of n takes entry min(j, n - 1 - j, 32k - 1) / k: k steps per entry upwards, the last entry as long as steps
/// remain for it, and the same entries downwards. A move too short for the whole ramp turns back where it is.
///
/// ```text
/// entry            ┌────────────┐ 31
///               ┌──┘            └──┐
///            ┌──┘                  └──┐ 1
///         ┌──┘                        └──┐ 0
/// step    0  k  2k  ..            n-2k n-k n
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Runs {
    /// Steps of the move.
    steps: u32,
    /// Steps per ramp entry, 1..2^27.
    per_entry: u32,
    /// First step of the next run.
    at: u32,
    /// Ramp entry of the next run.
    entry: u8,
    falling: bool,
}

/// A run: this many steps at this ramp entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) entry: u8,
    pub(crate) len: u32,
}

/// The entry of full speed.
const TOP: u8 = 31;

impl Runs {
    /// Returns a move of `steps` steps with `per_entry` (1..2^27) steps per ramp entry.
    pub(crate) const fn new(steps: u32, per_entry: u32) -> Self {
        Self { steps, per_entry, at: 0, entry: 0, falling: false }
    }

    /// Returns the ramp down of a move that stops as soon as it can: `done` steps are made, the last of them with `depth`
    /// steps between it and the standstill.
    pub(crate) const fn stop(done: u32, depth: u32, per_entry: u32) -> Self {
        let entry = match depth.saturating_sub(1).checked_div(per_entry) {
            Some(entry) if entry < TOP as u32 => entry.to_le_bytes()[0],
            _ => TOP,
        };
        Self { steps: done.saturating_add(depth), per_entry, at: done, entry, falling: true }
    }

    /// Steps of the move.
    pub(crate) const fn steps(&self) -> u32 {
        self.steps
    }

    /// First step with an entry above `entry`, on the way up.
    const fn climb(&self, entry: u8) -> u32 {
        (entry as u32).saturating_add(1).saturating_mul(self.per_entry)
    }
}

impl Iterator for Runs {
    type Item = Run;

    fn next(&mut self) -> Option<Run> {
        if self.at >= self.steps {
            return None;
        }
        let entry = self.entry;
        let up = self.climb(entry);
        // Is there a step so far from both ends that it takes the next entry?
        let end = if !self.falling && entry < TOP && up < self.steps.saturating_sub(up) {
            self.entry = entry.saturating_add(1);
            up
        } else {
            self.falling = true;
            self.entry = entry.saturating_sub(1);
            self.steps.saturating_sub(up.saturating_sub(self.per_entry))
        };
        let len = end.saturating_sub(self.at);
        self.at = end;
        Some(Run { entry, len })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn entries(runs: Runs) -> Vec<u8> {
        runs.flat_map(|run| core::iter::repeat_n(run.entry, run.len as usize)).collect()
    }

    /// The rule itself.
    fn rule(n: u32, k: u32) -> Vec<u8> {
        (0..n).map(|j| (j.min(n - 1 - j).min(32 * k - 1) / k) as u8).collect()
    }

    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn every_short_move_follows_the_rule() {
        for k in 1..=7 {
            for n in 0..=70 * k {
                assert_eq!(entries(Runs::new(n, k)), rule(n, k), "{n} steps, {k} an entry");
            }
        }
    }

    #[test]
    fn the_longest_moves_have_63_runs_that_cover_them() {
        for k in [1, 1000, 67_108_863, 67_108_864, (1 << 27) - 1] {
            let runs: Vec<Run> = Runs::new(u32::MAX, k).collect();
            assert!(runs.len() <= 63);
            assert!(runs.iter().all(|run| run.len > 0));
            assert_eq!(runs.iter().map(|run| u64::from(run.len)).sum::<u64>(), u64::from(u32::MAX), "{k}");
        }
    }

    /// A stop after j steps goes down by the steps below the depth reached.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn every_stop_goes_straight_down() {
        for k in 1..=4_u32 {
            for n in 1..=70 * k {
                let all = rule(n, k);
                for done in 1..=n {
                    let depth = (done - 1).min(n - done).min(32 * k - 1);
                    let rest = entries(Runs::stop(done, depth, k));
                    let want: Vec<u8> = (0..depth).rev().map(|d| (d / k) as u8).collect();
                    assert_eq!(rest, want, "{done} of {n}, {k}");
                    assert!(rest.first().is_none_or(|&first| first <= all[done as usize - 1]));
                }
            }
        }
    }
}
