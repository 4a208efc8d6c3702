use servowire_core::{Angle, Feedback, Shaft, Words};

use crate::count::{Abm, Abs};
use crate::doubt::Doubt;
use crate::resolution::Resolution;
use crate::response::Response;
use crate::sample::Sample;
use crate::status::{Almc, StatusField};
use crate::tolerated::{Policy, Tolerated};

/// What an encoder has said of its position, and when it was sampled: judged where it is used, by [`at`](Self::at).
///
/// Who receives the response makes it, [`Exchange::evidence`](crate::master::Exchange::evidence), and finds out what does not
/// depend on the user: whether the request was damaged, whether the fields fit the widths. Who uses the position, in an
/// interrupt of another priority perhaps, with a [`servowire_core::Cell`] in between, says how old it may be and which alarms
/// he lives with: one that commutates a motor by the single turn others than one that counts turns.
///
/// ```
/// use tformat::{Almc, Doubt, Evidence, Policy, Request, Resolution, Response, Tolerated};
///
/// // The counter has overflowed and the battery was empty: nobody knows in which turn the shaft is.
/// let bytes = [0x1a, 0x20, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0xc8, 0x37];
/// let response = Response::parse(Request::ReadAll, &bytes)?;
/// let evidence = Evidence::of(response, Resolution::new(23, 16)?, 4_480);
///
/// let positioning = Policy::new(125_000).tolerating(Tolerated::MULTI_TURN);
/// assert_eq!(evidence.at(60_000, positioning), Err(Doubt::Alarms { alarms: Almc::BE }));
/// let commutation = Policy::new(125_000).tolerating(Tolerated::SINGLE_TURN);
/// let sample = evidence.at(60_000, commutation)?;
/// assert_eq!((sample.single_turn(), sample.turns()), (3_915_817, None));
/// assert_eq!(evidence.at(140_000, commutation), Err(Doubt::Old { age_ns: 135_520 }));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Evidence {
    sampled_ns: u64,
    /// Counts in the turn. With [`Flaw::UpperBits`] the field, with [`Flaw::OtherEncoder`] ENID.
    single_turn: u32,
    /// With [`Flaw::WideTurns`] the field.
    turns: i32,
    /// ALMC, and all that [`status`](Self::status) may stand for.
    alarms: Almc,
    /// EA0 and EA1 where ALMC does not come, or does not say the same. All of SF with a flaw of SF.
    status: StatusField,
    flaw: Flaw,
    abs_bits: u8,
    abm_bits: u8,
}

servowire_core::one_line!(Evidence {
    Self { flaw: Flaw::Never, .. } => "no position was heard yet";
    Self { sampled_ns, .. } => "a position sampled at {} ns", sampled_ns;
});

/// What is wrong with a response, whatever alarms a user lives with. The turns come first: who does not use them can live
/// with all up to [`TURNS`](Self::TURNS).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
enum Flaw {
    None,
    /// It carries no turns, and the encoder has them.
    NoTurns,
    /// ABM has bits above its width.
    WideTurns,
    Never,
    Absent,
    Shifted,
    RequestDamaged,
    OtherEncoder,
    UpperBits,
}

impl Flaw {
    const TURNS: Self = Self::WideTurns;

    /// The flaw with this number; [`Never`](Self::Never) for a number that none has.
    const fn numbered(number: u32) -> Self {
        match number {
            0 => Self::None,
            1 => Self::NoTurns,
            2 => Self::WideTurns,
            4 => Self::Absent,
            5 => Self::Shifted,
            6 => Self::RequestDamaged,
            7 => Self::OtherEncoder,
            8 => Self::UpperBits,
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
        alarms: Almc::empty(),
        status: StatusField::empty(),
        flaw: Flaw::Never,
        abs_bits: 0,
        abm_bits: 0,
    };

    /// What a response says of the position of an encoder with these widths, sampled at `sampled_ns`: for tools and buffers;
    /// a master's [`Exchange`](crate::master::Exchange) knows when that was, and that the response is no older than its request.
    ///
    /// ABS comes with ID 0, 3, 7, 8 and C, the turns with ID 3.
    pub const fn of(response: Response, resolution: Resolution, sampled_ns: u64) -> Self {
        let mut evidence =
            Self { sampled_ns, abs_bits: resolution.abs_bits(), abm_bits: resolution.abm_bits(), ..Self::NEVER };
        evidence.flaw = match (response.status(), response.abs()) {
            (Some(sf), Some(abs)) => evidence.take(response, resolution, sf, abs),
            _ => Flaw::Absent,
        };
        evidence
    }

    /// Takes the fields over as far as they are sound, and says what is not.
    #[expect(clippy::cast_possible_wrap, reason = "24 bits fit")]
    const fn take(&mut self, response: Response, resolution: Resolution, sf: StatusField, abs: Abs) -> Flaw {
        self.status = sf;
        if sf.bits() & 0x0f != 0 {
            return Flaw::Shifted;
        }
        if sf.intersects(StatusField::REQUEST_DAMAGED) {
            return Flaw::RequestDamaged;
        }
        let told = if let Response::ReadAll(data) = response { data.almc } else { Almc::empty() };
        // EA0 and EA1 without the alarm that they stand for: in a response to ID 3 one of the two bytes is wrong.
        self.status = sf.difference(StatusField::of_alarms(told));
        self.alarms = told.union(self.status.alarms_behind());
        if let Response::ReadAll(data) = response {
            if resolution.contradicts(data.enid) {
                self.single_turn = data.enid as u32;
                return Flaw::OtherEncoder;
            }
        }
        let Ok(single_turn) = resolution.single_turn(abs) else {
            self.single_turn = abs.get();
            return Flaw::UpperBits;
        };
        self.single_turn = single_turn;
        let abm = match response {
            Response::ReadAll(data) => data.abm,
            _ if self.abm_bits == 0 => Abm::truncate(0),
            _ => return Flaw::NoTurns,
        };
        let Ok(turns) = resolution.turns(abm) else {
            self.turns = abm.get() as i32;
            return Flaw::WideTurns;
        };
        self.turns = turns;
        Flaw::None
    }

    /// The position, if nothing speaks against its use at `now_ns`.
    ///
    /// # Errors
    /// [`Doubt`], in the order in which its variants are declared.
    #[inline]
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        let tolerated = policy.tolerated();
        let young = policy.check_age(now_ns, self.sampled_ns).is_ok();
        if young && self.is_sound(tolerated) && self.alarms.difference(tolerated.alarms).is_empty() {
            let turns = if tolerated.turns { None } else { Some(self.turns) };
            Ok(Sample::new(self.sampled_ns, self.single_turn, turns, self.abs_bits))
        } else {
            Err(self.doubt(now_ns, policy))
        }
    }

    const fn is_sound(&self, tolerated: Tolerated) -> bool {
        self.flaw as u8 <= if tolerated.turns { Flaw::TURNS as u8 } else { Flaw::None as u8 }
    }

    /// Off the hot path: what speaks against it.
    #[cold]
    #[inline(never)]
    #[expect(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "fields that were stored there")]
    const fn doubt(&self, now_ns: u64, policy: Policy) -> Doubt {
        if let Flaw::Never = self.flaw {
            return Doubt::Never;
        }
        if let Err(age_ns) = policy.check_age(now_ns, self.sampled_ns) {
            return Doubt::Old { age_ns };
        }
        let tolerated = policy.tolerated();
        let sf = self.status;
        if !self.is_sound(tolerated) {
            return match self.flaw {
                Flaw::Shifted => Doubt::Shifted { sf },
                Flaw::RequestDamaged => Doubt::RequestDamaged { sf },
                Flaw::OtherEncoder => Doubt::OtherEncoder { enid: self.single_turn as u8, abs_bits: self.abs_bits },
                Flaw::UpperBits => upper_bits(self.single_turn, self.abs_bits),
                Flaw::WideTurns => upper_bits(self.turns as u32, self.abm_bits),
                Flaw::None | Flaw::NoTurns | Flaw::Never | Flaw::Absent => Doubt::Absent,
            };
        }
        let alarms = self.alarms.difference(sf.alarms_behind()).difference(tolerated.alarms);
        if alarms.is_empty() { Doubt::Status { sf } } else { Doubt::Alarms { alarms } }
    }
}

/// A field that is wider than the encoder's.
const fn upper_bits(value: u32, bits: u8) -> Doubt {
    Doubt::UpperBits { value, excess: value & u32::MAX.wrapping_shl(bits as u32) }
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
    fn shaft(sample: &Sample) -> (Angle, u64) {
        (sample.angle(), sample.sampled_ns())
    }
}

/// Carries evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 5>;

/// As [`EvidenceCell`], and it also gives the angle of an instant between two samples.
pub type EvidenceShaftCell = servowire_core::ShaftCell<Evidence, 5>;

/// For an [`EvidenceCell`].
///
/// ```text
///  word 0, 1   instant of sampling, low half first
///  word 2      single turn
///  word 3      turns
///  word 4      ALMC in bits 0..=7, SF in 8..=15, flaw in 16..=19, widths of ABS and ABM in 20..=24 and 25..=29
/// ```
impl Words<5> for Evidence {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "halves, and bits of the same width")]
    #[inline]
    fn to_words(&self) -> [u32; 5] {
        let marks = u32::from(self.alarms.bits())
            | u32::from(self.status.bits()) << 8
            | (self.flaw as u32) << 16
            | u32::from(self.abs_bits) << 20
            | u32::from(self.abm_bits) << 25;
        [self.sampled_ns as u32, (self.sampled_ns >> 32) as u32, self.single_turn, self.turns as u32, marks]
    }

    #[expect(clippy::cast_possible_wrap, reason = "bits of the same width")]
    #[inline]
    fn from_words([low, high, single_turn, turns, marks]: [u32; 5]) -> Self {
        let [alarms, status, ..] = marks.to_le_bytes();
        let bits = |at: u32| (marks >> at & 0x1f).to_le_bytes()[0];
        Self {
            sampled_ns: u64::from(high) << 32 | u64::from(low),
            single_turn,
            turns: turns as i32,
            alarms: Almc::from_bits_retain(alarms),
            status: StatusField::from_bits_retain(status),
            flaw: Flaw::numbered(marks >> 16 & 0xf),
            abs_bits: bits(20),
            abm_bits: bits(25),
        }
    }
}

#[cfg(test)]
mod tests;
