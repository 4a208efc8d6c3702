use servowire_core::{Angle, Feedback, Shaft, Words};

use crate::abs40::Abs40;
use crate::doubt::Doubt;
use crate::marks::Marks;
use crate::resolution::Resolution;
use crate::response::{Body, Response};
use crate::sample::Sample;
use crate::status::EncoderStatus;
use crate::tolerated::{Policy, Tolerated};

/// What an encoder has said of its position, and when it was sampled: judged where it is used, by [`at`](Self::at).
///
/// Who receives the response makes it, [`Exchange::evidence`](crate::master::Exchange::evidence), and finds out what does not
/// depend on the user: what the response carries, whether it fits the widths. Who uses the position, in an interrupt of another
/// priority perhaps, with an [`EvidenceCell`] in between, says how old it may be and what he lives with.
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
    /// Counts in the turn. With [`Marks::UPPER_BITS`] the width.
    single_turn: u32,
    turns: i32,
    marks: Marks,
    st_bits: u8,
    /// Whether one bit stood for all of the status.
    summed: bool,
}

servowire_core::one_line!(Evidence {
    Self { marks, .. } if marks.contains(Marks::NEVER) => "no position was heard yet";
    Self { sampled_ns, .. } => "a position sampled at {} ns", sampled_ns;
});

impl Evidence {
    /// Nothing was heard yet.
    pub const NEVER: Self =
        Self { sampled_ns: 0, single_turn: 0, turns: 0, marks: Marks::NEVER, st_bits: 1, summed: false };

    /// What a response says of the position of an encoder with these widths, sampled at `sampled_ns`: for tools and buffers;
    /// a master's [`Exchange`](crate::master::Exchange) knows when that was, and that the response is no older than its request.
    pub const fn of(response: Response, resolution: Resolution, sampled_ns: u64) -> Self {
        let (status, summed) = match response.body {
            Body::Abs17 { es_any: true, .. } => (EncoderStatus::all(), true),
            Body::Abs17 { es_any: false, .. } => (EncoderStatus::empty(), true),
            Body::Full { es, .. } => (es, false),
        };
        let mut marks = Marks::of_status(status);
        if let Some(alarms) = response.alm() {
            marks = marks.union(Marks::of_alarms(alarms));
        }
        let evidence = Self { sampled_ns, marks, summed, ..Self::NEVER };
        let (Some(abs), abs_bits) = (response.abs(), response.layout().abs_bits()) else {
            return Self { marks: marks.union(Marks::ABSENT), ..evidence };
        };
        evidence.with_abs(abs, abs_bits, resolution)
    }

    /// The same of a response that [`Abs40`] has decoded.
    pub const fn of_abs40(response: Abs40, resolution: Resolution, sampled_ns: u64) -> Self {
        let evidence = Self { sampled_ns, marks: Marks::of_status(response.es), ..Self::NEVER };
        evidence.with_abs(response.abs.get(), 40, resolution)
    }

    /// Takes the `abs_bits` lowest position bits, which are all that the response carries.
    const fn with_abs(mut self, abs: u64, abs_bits: u8, resolution: Resolution) -> Self {
        let width = resolution.st_bits().wrapping_add(resolution.mt_bits());
        self.st_bits = resolution.st_bits();
        if abs_bits < self.st_bits {
            self.marks = self.marks.union(Marks::ABSENT);
        } else if abs.wrapping_shr(width as u32) != 0 {
            self.marks = self.marks.union(Marks::UPPER_BITS);
            self.single_turn = width as u32;
        } else {
            self.single_turn = resolution.single_turn(abs);
            if abs_bits < width {
                self.marks = self.marks.union(Marks::NO_TURNS);
            } else {
                self.turns = resolution.turns(abs);
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
        if policy.check_age(now_ns, self.sampled_ns).is_ok() && tolerated.objects_to(self.marks).is_empty() {
            let turns = if tolerated.ignores_turns() { None } else { Some(self.turns) };
            Ok(Sample::new(self.sampled_ns, self.single_turn, turns, self.st_bits))
        } else {
            Err(self.doubt(now_ns, policy))
        }
    }

    /// Off the hot path: what speaks against it.
    #[cold]
    #[inline(never)]
    #[expect(clippy::cast_possible_truncation, reason = "a width that was stored there")]
    const fn doubt(&self, now_ns: u64, policy: Policy) -> Doubt {
        let marks = policy.tolerated().objects_to(self.marks);
        let (es, alarms) = (marks.status(), marks.alarms());
        if marks.contains(Marks::NEVER) {
            Doubt::Never
        } else if let Err(age_ns) = policy.check_age(now_ns, self.sampled_ns) {
            Doubt::Old { age_ns }
        } else if marks.contains(Marks::UPPER_BITS) {
            Doubt::UpperBits { width: self.single_turn as u8 }
        } else if marks.intersects(Marks::ABSENT.union(Marks::NO_TURNS)) {
            Doubt::Absent
        } else if es.is_empty() {
            Doubt::Alarms { alarms }
        } else if self.summed {
            Doubt::AnyStatus
        } else {
            Doubt::Status { es }
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

/// For an [`EvidenceShaftCell`].
impl Shaft for Evidence {
    #[inline]
    fn shaft(sample: &Sample) -> (Angle, u64) {
        (sample.angle(), sample.sampled_ns())
    }
}

/// Carries evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 5>;

/// An [`EvidenceCell`] that carries the motion of the shaft too, for a control loop that runs more often than the encoder is read.
pub type EvidenceShaftCell = servowire_core::ShaftCell<Evidence, 5>;

/// For a [`servowire_core::Cell`].
///
/// ```text
///  word 0, 1   instant of sampling, low half first
///  word 2      single turn
///  word 3      turns
///  word 4      ALM in bits 0..=15, ES in 16..=19, what is wrong in 20..=23, single-turn bits in 24..=29, one bit for all of ES in 30
/// ```
impl Words<5> for Evidence {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "halves, and bits of the same width")]
    #[inline]
    fn to_words(&self) -> [u32; 5] {
        let marks = self.marks.bits() & 0xff_ffff | u32::from(self.st_bits) << 24 | u32::from(self.summed) << 30;
        [self.sampled_ns as u32, (self.sampled_ns >> 32) as u32, self.single_turn, self.turns as u32, marks]
    }

    #[expect(clippy::cast_possible_wrap, reason = "fields are cut out of words")]
    #[inline]
    fn from_words([low, high, single_turn, turns, marks]: [u32; 5]) -> Self {
        Self {
            sampled_ns: u64::from(high) << 32 | u64::from(low),
            single_turn,
            turns: turns as i32,
            marks: Marks::from_bits_truncate(marks),
            st_bits: (marks >> 24 & 0x3f) as u8,
            summed: marks >> 30 & 1 == 1,
        }
    }
}

#[cfg(test)]
mod tests;
