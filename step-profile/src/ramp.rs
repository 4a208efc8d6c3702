use core::f64::consts::FRAC_PI_2;

use crate::error::Error;

/// The acceleration ramp: 32 intervals from zero to full speed, each stored as 1000 / sin²(x).
///
/// TIDEP0061, sections 2.3.1 and 2.3.2 (Figure 5); `SIN2_TBL32` in TI's `sorte_master_cfg.inc`. The values of the
/// original table were never published; [`SIN2`](Self::SIN2) takes the end points x = (i + 1) π / 64, rounded to
/// nearest. It is the choice that reaches full speed in the last interval and keeps the 100 Hz of TI's speed list
/// within 32 bits. You can use any other table instead, provided that it never accelerates on the way down.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[u32; 32]", into = "[u32; 32]"))]
pub struct RampTable([u32; RampTable::LEN]);

impl RampTable {
    /// Number of entries.
    pub const LEN: usize = 32;

    /// The entry of full speed; no entry may be smaller.
    const FULL_SPEED: u32 = 1000;

    /// 1000 / sin²((i + 1) π / 64), rounded to nearest: 415345, 104087, 46447, ... 1002, 1000.
    pub const SIN2: &'static Self = &Self(sin2());

    /// Creates your own table.
    ///
    /// # Errors
    /// [`Error::InvalidRampTable`] if an entry is below 1000 or above the previous one.
    pub const fn new(entries: [u32; Self::LEN]) -> Result<Self, Error> {
        let mut limit = u32::MAX;
        let mut rest: &[u32] = &entries;
        let mut index = 0_u8;
        while let [entry, tail @ ..] = rest {
            if *entry < Self::FULL_SPEED || *entry > limit {
                return Err(Error::InvalidRampTable { index, entry: *entry, limit });
            }
            limit = *entry;
            rest = tail;
            index = index.wrapping_add(1);
        }
        Ok(Self(entries))
    }

    /// All entries, the slowest first.
    pub const fn entries(&self) -> &[u32; Self::LEN] {
        &self.0
    }

    /// Returns entry `index`, or the last one for an index after the end.
    pub fn entry(&self, index: u8) -> u32 {
        self.0.get(usize::from(index)).copied().unwrap_or(self.last())
    }

    /// The slowest entry.
    pub const fn first(&self) -> u32 {
        let [first, ..] = self.0;
        first
    }

    /// The entry of the constant speed.
    pub const fn last(&self) -> u32 {
        let [.., last] = self.0;
        last
    }
}

impl Default for RampTable {
    fn default() -> Self {
        *Self::SIN2
    }
}

impl TryFrom<[u32; RampTable::LEN]> for RampTable {
    type Error = Error;

    fn try_from(entries: [u32; Self::LEN]) -> Result<Self, Error> {
        Self::new(entries)
    }
}

impl From<RampTable> for [u32; RampTable::LEN] {
    fn from(table: RampTable) -> Self {
        table.0
    }
}

#[cfg(feature = "arbitrary")]
#[cfg_attr(docsrs, doc(cfg(feature = "arbitrary")))]
impl<'a> arbitrary::Arbitrary<'a> for RampTable {
    fn arbitrary(u: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        let mut entries: [u32; Self::LEN] = u.arbitrary()?;
        for entry in &mut entries {
            *entry = (*entry).max(Self::FULL_SPEED);
        }
        entries.sort_unstable_by(|a, b| b.cmp(a));
        Ok(Self(entries))
    }
}

/// No entry is nearer to a tie than 0.013, so any evaluation in double precision rounds alike.
#[expect(
    clippy::indexing_slicing,
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "evaluated by the compiler"
)]
const fn sin2() -> [u32; RampTable::LEN] {
    let mut entries = [0; RampTable::LEN];
    let mut i = 0;
    let mut x = 1.0;
    while i < entries.len() {
        let sine = sine(x * FRAC_PI_2 / 32.0);
        entries[i] = (1000.0 / (sine * sine) + 0.5) as u32;
        i += 1;
        x += 1.0;
    }
    entries
}

/// The Taylor series; 13 terms leave less than 2^-60 for 0 <= x <= π/2.
const fn sine(x: f64) -> f64 {
    let mut sum = 0.0;
    let mut term = x;
    let mut k = 1.0;
    while k < 27.0 {
        sum += term;
        term *= -x * x / ((k + 1.0) * (k + 2.0));
        k += 2.0;
    }
    sum
}

/// The sum of csc²(kπ/64) for k = 1..=32 is 683 exactly, and the roundings cancel.
const _: () = {
    let mut sum = 0;
    let mut rest: &[u32] = &RampTable::SIN2.0;
    while let [entry, tail @ ..] = rest {
        sum += *entry;
        rest = tail;
    }
    assert!(sum == 683_000);
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_table() {
        let known = [
            415_345, 104_087, 46_447, 26_274, 16_938, 11_867, 8_811, 6_828, 5_470, 4_500, 3_784, 3_240, 2_818, 2_485,
            2_217, 2_000, 1_821, 1_674, 1_550, 1_446, 1_359, 1_286, 1_224, 1_172, 1_128, 1_092, 1_063, 1_040, 1_022,
            1_010, 1_002, 1_000,
        ];
        assert_eq!(RampTable::SIN2.entries(), &known);
        assert_eq!(RampTable::new(known), Ok(RampTable::default()));
        assert_eq!((RampTable::SIN2.first(), RampTable::SIN2.last()), (415_345, 1000));
        assert_eq!((RampTable::SIN2.entry(31), RampTable::SIN2.entry(255)), (1000, 1000));
    }

    #[test]
    fn a_table_that_is_too_fast_or_rises_is_refused_with_the_entry() {
        let mut entries = *RampTable::SIN2.entries();
        entries[31] = 999;
        assert_eq!(RampTable::new(entries), Err(Error::InvalidRampTable { index: 31, entry: 999, limit: 1002 }));
        entries = [5000; 32];
        assert!(RampTable::new(entries).is_ok());
        entries[7] = 5001;
        assert_eq!(RampTable::new(entries), Err(Error::InvalidRampTable { index: 7, entry: 5001, limit: 5000 }));
        entries[0] = 0;
        assert_eq!(RampTable::new(entries), Err(Error::InvalidRampTable { index: 0, entry: 0, limit: u32::MAX }));
    }
}
