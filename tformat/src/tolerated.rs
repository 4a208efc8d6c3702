use servowire_core::Tolerance;

use crate::marks::{NO_TURNS, OBJECTIONS, WIDE_TURNS, alarms};
use crate::status::Almc;

/// The age up to which, and the alarms despite which, a position may be used.
///
/// ```
/// use tformat::{Almc, Policy, Tolerated};
/// // Two cycles of a 16 kHz loop; an encoder that is hot is still read.
/// const POSITIONING: Policy = Policy::new(125_000).tolerating(Tolerated::MULTI_TURN.alarms(Almc::OH));
/// assert_eq!(POSITIONING.max_age_ns(), 125_000);
/// ```
pub type Policy = servowire_core::Policy<Tolerated>;

/// The alarms despite which a position may be used. How severe an alarm is depends on the drive, see [`Almc`].
///
/// In responses without ALMC, which are all except that to ID 3, EA0 stands for CE, and EA1 for any of [`Almc::IN_EA1`]; EA1 is
/// tolerated if all of these are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "Written", into = "Written"))]
pub struct Tolerated(u32);

servowire_core::one_line!(Tolerated {
    Self(marks) if marks & NO_TURNS != 0 => "alarms {}, any turns", alarms(*marks);
    Self(marks) => "alarms {}", alarms(*marks);
});

impl Tolerated {
    /// Nothing.
    pub const NOTHING: Self = Self(0);
    /// The alarms that one maker's drive tolerates when it counts turns: an overflow of the turns is ignored, and a low battery
    /// is a warning.
    pub const MULTI_TURN: Self = Self::NOTHING.alarms(Almc::OF.union(Almc::BA));
    /// The alarms that the same drive tolerates when turns are not used: everything about the turns and the battery. The
    /// turns are then not judged, and the [`Sample`](crate::Sample) does not have them.
    pub const SINGLE_TURN: Self =
        Self(Self::MULTI_TURN.0 | NO_TURNS | WIDE_TURNS).alarms(Almc::BE.union(Almc::ME).union(Almc::OS));

    /// Also tolerates these alarms.
    #[must_use]
    pub const fn alarms(self, alarms: Almc) -> Self {
        Self(self.0 | alarms.bits() as u32)
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

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}

/// The serialised form of what is tolerated.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Written {
    alarms: Almc,
    turns: bool,
}

#[cfg(feature = "serde")]
impl From<Written> for Tolerated {
    fn from(Written { alarms, turns }: Written) -> Self {
        let turns = if turns { NO_TURNS | WIDE_TURNS } else { 0 };
        Self(turns).alarms(alarms)
    }
}

#[cfg(feature = "serde")]
impl From<Tolerated> for Written {
    fn from(tolerated: Tolerated) -> Self {
        Self { alarms: alarms(tolerated.0), turns: tolerated.ignores_turns() }
    }
}
