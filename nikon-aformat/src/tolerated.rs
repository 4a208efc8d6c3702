use servowire_core::Tolerance;

use crate::marks::{NO_TURNS, OBJECTIONS, of_alarms, of_status};
use crate::status::{Alm, EncoderStatus};

/// Up to which age, and in spite of what, a position may be used.
///
/// ```
/// use nikon_aformat::{EncoderStatus, Policy, Tolerated};
/// // Two cycles of a 16 kHz loop, and an encoder without its battery whose turns are not used.
/// const COMMUTATION: Policy = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN);
/// assert_eq!(COMMUTATION.max_age_ns(), 125_000);
/// ```
pub type Policy = servowire_core::Policy<Tolerated>;

/// In spite of what a position may be used: status bits, and alarms where a response carries them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Tolerated {
    status: EncoderStatus,
    alarms: Alm,
    /// Turns may be anything, or missing: they are not used.
    any_turns: bool,
}

impl Tolerated {
    /// Nothing.
    pub const NOTHING: Self = Self { status: EncoderStatus::empty(), alarms: Alm::empty(), any_turns: false };

    #[cfg(test)]
    pub(crate) const ANY_TURNS: Self = Self { any_turns: true, ..Self::NOTHING };

    /// As one drive does where turns are not used: an encoder without its battery shows BATT. The turns are not judged then, and
    /// the [`Sample`](crate::Sample) does not have them. Everything else means that the position may be wrong or that something
    /// is about to fail.
    pub const SINGLE_TURN: Self = Self { status: EncoderStatus::BATT, alarms: Alm::BATT, any_turns: true };

    /// These status bits too.
    #[must_use]
    pub const fn status(self, status: EncoderStatus) -> Self {
        Self { status: self.status.union(status), ..self }
    }

    /// These alarms too.
    #[must_use]
    pub const fn alarms(self, alarms: Alm) -> Self {
        Self { alarms: self.alarms.union(alarms), ..self }
    }

    /// What of these marks is not tolerated.
    #[inline]
    pub(crate) const fn objects_to(self, marks: u32) -> u32 {
        let turns = if self.any_turns { NO_TURNS } else { 0 };
        marks & OBJECTIONS & !(turns | of_status(self.status) | of_alarms(self.alarms))
    }

    /// Whether turns may be anything.
    #[inline]
    pub(crate) const fn ignores_turns(self) -> bool {
        self.any_turns
    }
}

servowire_core::one_line!(Tolerated {
    Self { status, alarms, any_turns: true } => "status {} and alarms {}, any turns", status, alarms;
    Self { status, alarms, any_turns: false } => "status {} and alarms {}", status, alarms;
});

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}
