use servowire_core::Tolerance;

use crate::marks::{NO_TURNS, OBJECTIONS, alarms, of_alarms, of_status, status};
use crate::status::{Alm, EncoderStatus};

/// The age up to which, and the faults despite which, a position may be used.
///
/// ```
/// use nikon_aformat::{EncoderStatus, Policy, Tolerated};
/// // Two cycles of a 16 kHz loop, and an encoder without its battery whose turns are not used.
/// const COMMUTATION: Policy = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN);
/// assert_eq!(COMMUTATION.max_age_ns(), 125_000);
/// ```
pub type Policy = servowire_core::Policy<Tolerated>;

/// The faults despite which a position may be used: status bits, and alarms if a response carries them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "Written", into = "Written"))]
pub struct Tolerated(u32);

impl Tolerated {
    /// Nothing.
    pub const NOTHING: Self = Self(0);

    #[cfg(test)]
    pub(crate) const ANY_TURNS: Self = Self(NO_TURNS);

    /// The faults that one maker's drive tolerates when turns are not used, because an encoder without its battery shows
    /// BATT. The turns are then not judged, and the [`Sample`](crate::Sample) does not have them. Everything else means that
    /// the position may be wrong or that something is about to fail.
    pub const SINGLE_TURN: Self = Self(NO_TURNS).status(EncoderStatus::BATT).alarms(Alm::BATT);

    /// Also tolerates these status bits.
    #[must_use]
    pub const fn status(self, status: EncoderStatus) -> Self {
        Self(self.0 | of_status(status))
    }

    /// Also tolerates these alarms.
    #[must_use]
    pub const fn alarms(self, alarms: Alm) -> Self {
        Self(self.0 | of_alarms(alarms))
    }

    /// Returns the marks that are not tolerated.
    #[inline]
    pub(crate) const fn objects_to(self, marks: u32) -> u32 {
        marks & OBJECTIONS & !self.0
    }

    /// Returns whether turns are not used, so that they may be wrong or missing.
    #[inline]
    pub(crate) const fn ignores_turns(self) -> bool {
        self.0 & NO_TURNS != 0
    }
}

servowire_core::one_line!(Tolerated {
    Self(marks) if marks & NO_TURNS != 0 => "status {} and alarms {}, any turns", status(*marks), alarms(*marks);
    Self(marks) => "status {} and alarms {}", status(*marks), alarms(*marks);
});

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}

/// The serialised form of what is tolerated.
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[cfg(any(feature = "serde", feature = "arbitrary"))]
struct Written {
    status: EncoderStatus,
    alarms: Alm,
    any_turns: bool,
}

#[cfg(any(feature = "serde", feature = "arbitrary"))]
impl From<Written> for Tolerated {
    fn from(Written { status, alarms, any_turns }: Written) -> Self {
        Self(if any_turns { NO_TURNS } else { 0 }).status(status).alarms(alarms)
    }
}

#[cfg(feature = "serde")]
impl From<Tolerated> for Written {
    fn from(tolerated: Tolerated) -> Self {
        Self { status: status(tolerated.0), alarms: alarms(tolerated.0), any_turns: tolerated.ignores_turns() }
    }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for Tolerated {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        from.arbitrary::<Written>().map(Self::from)
    }
}
