use servowire_core::{Feedback, Words};

use crate::abs40::Abs40;
use crate::doubt::Doubt;
use crate::resolution::Resolution;
use crate::response::{Body, Response};
use crate::sample::Sample;
use crate::status::{Alm, EncoderStatus};
use crate::tolerated::{Policy, Tolerated};

/// What an encoder has said of its position, and when it was sampled: judged where it is used, by [`at`](Self::at).
///
/// Who receives the response makes it, [`Exchange::evidence`](crate::master::Exchange::evidence), and finds out what does not
/// depend on the user: what the response carries, whether it fits the widths. Who uses the position, in an interrupt of another
/// priority perhaps, with a [`servowire_core::Cell`] in between, says how old it may be and what he lives with.
///
/// ```
/// use nikon_aformat::{
///     BitOrder, Command, Doubt, EncoderStatus, Evidence, Expected, Layout, Policy, Resolution, Response, Tolerated,
/// };
///
/// let expected = Expected::new(Layout::Abs40, Command::Abs40Mt);
/// let response = Response::parse_words(&expected, &[0x2085, 0xf64a, 0x8009, 0x80a1], BitOrder::MsbFirst)?;
/// let evidence = Evidence::of(response, Resolution::new(17, 16)?, 1_000_000);
///
/// // an encoder without its battery
/// let shown = EncoderStatus::BATT | EncoderStatus::ERROR;
/// let policy = Policy::new(125_000);
/// assert_eq!(evidence.at(1_040_000, policy), Err(Doubt::Status { es: shown }));
/// let commutation = policy.tolerating(Tolerated::SINGLE_TURN.status(shown));
/// let sample = evidence.at(1_040_000, commutation)?;
/// assert_eq!((sample.single_turn(), sample.turns()), (86_639, None));
/// assert_eq!(evidence.at(1_200_000, commutation), Err(Doubt::Old { age_ns: 200_000 }));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Evidence {
    sampled_ns: u64,
    /// Counts in the turn. With [`Flaw::UpperBits`] the width.
    single_turn: u32,
    turns: i32,
    alarms: Alm,
    status: EncoderStatus,
    flaw: Flaw,
    /// Whether one bit stood for all of the status.
    summed: bool,
    st_bits: u8,
}

servowire_core::one_line!(Evidence {
    Self { flaw: Flaw::Never, .. } => "no position was heard yet";
    Self { sampled_ns, .. } => "a position sampled at {} ns", sampled_ns;
});

/// What is wrong with a response, whatever a user lives with. The turns come first: who does not use them can live with
/// that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
enum Flaw {
    None,
    /// It carries fewer bits of the turns than the encoder counts.
    NoTurns,
    Never,
    Absent,
    UpperBits,
}

impl Flaw {
    /// The flaw with this number; [`Never`](Self::Never) for a number that none has.
    const fn numbered(number: u32) -> Self {
        match number {
            0 => Self::None,
            1 => Self::NoTurns,
            3 => Self::Absent,
            4 => Self::UpperBits,
            _ => Self::Never,
        }
    }
}

impl Evidence {
    /// Nothing was heard yet.
    pub const NEVER: Self = Self {
        sampled_ns: 0,
        single_turn: 0,
        turns: 0,
        alarms: Alm::empty(),
        status: EncoderStatus::empty(),
        flaw: Flaw::Never,
        summed: false,
        st_bits: 1,
    };

    /// What a response says of the position of an encoder with these widths, sampled at `sampled_ns`: for tools and buffers;
    /// a master's [`Exchange`](crate::master::Exchange) knows when that was, and that the response is no older than its request.
    pub const fn of(response: Response, resolution: Resolution, sampled_ns: u64) -> Self {
        let mut evidence = Self { sampled_ns, flaw: Flaw::Absent, ..Self::NEVER };
        match response.body {
            Body::Abs17 { es_any, .. } => {
                evidence.summed = true;
                if es_any {
                    evidence.status = EncoderStatus::all();
                }
            }
            Body::Full { es, .. } => evidence.status = es,
        }
        if let Some(alarms) = response.alm() {
            evidence.alarms = alarms;
        }
        match response.abs() {
            Some(abs) => evidence.with_abs(abs, response.layout().abs_bits(), resolution),
            None => evidence,
        }
    }

    /// The same of a response that [`Abs40`] has decoded.
    pub const fn of_abs40(response: Abs40, resolution: Resolution, sampled_ns: u64) -> Self {
        Self { sampled_ns, status: response.es, ..Self::NEVER }.with_abs(response.abs.get(), 40, resolution)
    }

    /// Takes the `abs_bits` lowest position bits, which are all that the response carries.
    const fn with_abs(mut self, abs: u64, abs_bits: u8, resolution: Resolution) -> Self {
        let width = resolution.st_bits().wrapping_add(resolution.mt_bits());
        self.st_bits = resolution.st_bits();
        if abs_bits < self.st_bits {
            self.flaw = Flaw::Absent;
        } else if abs.wrapping_shr(width as u32) != 0 {
            (self.flaw, self.single_turn) = (Flaw::UpperBits, width as u32);
        } else {
            self.single_turn = resolution.single_turn(abs);
            if abs_bits < width {
                self.flaw = Flaw::NoTurns;
            } else {
                (self.flaw, self.turns) = (Flaw::None, resolution.turns(abs));
            }
        }
        self
    }

    /// The position, if nothing speaks against its use at `now_ns`.
    ///
    /// # Errors
    /// [`Doubt`], in the order in which its variants are declared.
    #[inline]
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        let tolerated = policy.tolerated();
        let young = policy.check_age(now_ns, self.sampled_ns).is_ok();
        let shown = self.status.difference(tolerated.status).is_empty();
        if young && self.is_sound(tolerated) && shown && self.alarms.difference(tolerated.alarms).is_empty() {
            let turns = if tolerated.turns { None } else { Some(self.turns) };
            Ok(Sample::new(self.sampled_ns, self.single_turn, turns, self.st_bits))
        } else {
            Err(self.doubt(now_ns, policy))
        }
    }

    const fn is_sound(&self, tolerated: Tolerated) -> bool {
        self.flaw as u8 <= if tolerated.turns { Flaw::NoTurns as u8 } else { Flaw::None as u8 }
    }

    /// Off the hot path: what speaks against it.
    #[cold]
    #[inline(never)]
    #[expect(clippy::cast_possible_truncation, reason = "a width that was stored there")]
    const fn doubt(&self, now_ns: u64, policy: Policy) -> Doubt {
        if let Flaw::Never = self.flaw {
            return Doubt::Never;
        }
        if let Err(age_ns) = policy.check_age(now_ns, self.sampled_ns) {
            return Doubt::Old { age_ns };
        }
        let tolerated = policy.tolerated();
        if !self.is_sound(tolerated) {
            return match self.flaw {
                Flaw::UpperBits => Doubt::UpperBits { width: self.single_turn as u8 },
                Flaw::None | Flaw::NoTurns | Flaw::Never | Flaw::Absent => Doubt::Absent,
            };
        }
        let es = self.status.difference(tolerated.status);
        match (es.is_empty(), self.summed) {
            (false, true) => Doubt::AnyStatus,
            (false, false) => Doubt::Status { es },
            (true, _) => Doubt::Alarms { alarms: self.alarms.difference(tolerated.alarms) },
        }
    }
}

impl Default for Evidence {
    fn default() -> Self {
        Self::NEVER
    }
}

impl Feedback for Evidence {
    type Tolerated = Tolerated;
    type Sample = Sample;
    type Doubt = Doubt;
    const NEVER: Self = Self::NEVER;

    #[inline]
    fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        self.at(now_ns, policy)
    }
}

/// Carries evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 5>;

/// For a [`servowire_core::Cell`].
///
/// ```text
///  word 0, 1   instant of sampling, low half first
///  word 2      single turn
///  word 3      turns
///  word 4      ALM in bits 0..=15, ES in 16..=19, flaw in 20..=22, one bit for all of ES in 23, single-turn bits in 24..=29
/// ```
impl Words<5> for Evidence {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "halves, and bits of the same width")]
    #[inline]
    fn to_words(&self) -> [u32; 5] {
        let marks = u32::from(self.alarms.bits())
            | u32::from(self.status.bits() & 0xf) << 16
            | (self.flaw as u32) << 20
            | u32::from(self.summed) << 23
            | u32::from(self.st_bits) << 24;
        [self.sampled_ns as u32, (self.sampled_ns >> 32) as u32, self.single_turn, self.turns as u32, marks]
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "fields are cut out of words")]
    #[inline]
    fn from_words([low, high, single_turn, turns, marks]: [u32; 5]) -> Self {
        Self {
            sampled_ns: u64::from(high) << 32 | u64::from(low),
            single_turn,
            turns: turns as i32,
            alarms: Alm::from_bits_retain(marks as u16),
            status: EncoderStatus::from_bits_truncate((marks >> 16) as u8),
            flaw: Flaw::numbered(marks >> 20 & 7),
            summed: marks >> 23 & 1 == 1,
            st_bits: (marks >> 24 & 0x3f) as u8,
        }
    }
}

#[cfg(test)]
mod tests;
