use servowire_core::Tolerance;

use crate::marks::{NO_TURNS, OBJECTIONS, WIDE_TURNS};
use crate::status::Almc;

/// Up to which age, and in spite of which alarms, a position may be used.
///
/// ```
/// use tformat::{Almc, Policy, Tolerated};
/// // Two cycles of a 16 kHz loop; an encoder that is hot is still read.
/// const POSITIONING: Policy = Policy::new(125_000).tolerating(Tolerated::MULTI_TURN.alarms(Almc::OH));
/// assert_eq!(POSITIONING.max_age_ns(), 125_000);
/// ```
pub type Policy = servowire_core::Policy<Tolerated>;

/// In spite of what a position may be used. How severe an alarm is depends on the drive, see [`Almc`].
///
/// Where ALMC does not come, in all responses but that to ID 3, EA0 stands for CE, and EA1 for any of [`Almc::IN_EA1`]: it
/// is tolerated where they all are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Tolerated {
    alarms: Almc,
    /// Turns may be anything, or missing: they are not used.
    turns: bool,
}

impl Tolerated {
    /// Nothing.
    pub const NOTHING: Self = Self { alarms: Almc::empty(), turns: false };
    /// What one drive tolerates that counts turns: an overflow of the turns is ignored, a low battery is a warning.
    pub const MULTI_TURN: Self = Self::NOTHING.alarms(Almc::OF.union(Almc::BA));
    /// What the same drive tolerates where turns are not used: all that concerns the turns and the battery. The turns are
    /// not judged then, and the [`Sample`](crate::Sample) does not have them.
    pub const SINGLE_TURN: Self =
        Self { turns: true, ..Self::MULTI_TURN }.alarms(Almc::BE.union(Almc::ME).union(Almc::OS));

    /// These alarms too.
    #[must_use]
    pub const fn alarms(self, alarms: Almc) -> Self {
        Self { alarms: self.alarms.union(alarms), ..self }
    }

    /// What of these marks is not tolerated.
    #[inline]
    pub(crate) const fn objects_to(self, marks: u32) -> u32 {
        let turns = if self.turns { NO_TURNS | WIDE_TURNS } else { 0 };
        marks & OBJECTIONS & !(turns | self.alarms.bits() as u32)
    }

    /// Whether turns may be anything.
    #[inline]
    pub(crate) const fn ignores_turns(self) -> bool {
        self.turns
    }
}

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}
