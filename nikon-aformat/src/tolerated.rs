use servowire_core::Tolerance;

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
    pub(crate) status: EncoderStatus,
    pub(crate) alarms: Alm,
    /// Turns may be anything, or missing: they are not used.
    pub(crate) turns: bool,
}

impl Tolerated {
    /// Nothing.
    pub const NOTHING: Self = Self { status: EncoderStatus::empty(), alarms: Alm::empty(), turns: false };

    /// As one drive does where turns are not used: an encoder without its battery shows BATT. The turns are not judged then, and
    /// the [`Sample`](crate::Sample) does not have them. Everything else means that the position may be wrong or that something
    /// is about to fail.
    pub const SINGLE_TURN: Self = Self { turns: true, ..Self::NOTHING }.status(EncoderStatus::BATT).alarms(Alm::BATT);

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
}

servowire_core::one_line!(Tolerated {
    Self { status, alarms, turns: false } => "status {} and alarms {}", status, alarms;
    Self { status, alarms, turns: true } => "status {} and alarms {}, any turns", status, alarms;
});

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}
