//! The positions that a control loop may use, judged at the moment of use.

use servowire_core::{Angle, Feedback, Shaft, Tolerance, Words};

use crate::doubt::Doubt;

/// How many acceleration words may be missing before the position must not be used.
///
/// One wrong bit makes an acceleration word unusable, and with it the exact position is lost for 17 to 24 frames, until a safe
/// position has shown what was in the word and another one has agreed. In the meantime the position is estimated, with a bound
/// that grows.
///
/// ```
/// use hdsl::{Policy, Tolerated};
/// // Not older than 30 µs, and over up to 8 missing words of a shaft whose speed changes by up to 12 steps a frame in a frame.
/// let policy = Policy::new(30_000).tolerating(Tolerated::missing_words(8, 12));
/// # let _ = policy;
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Tolerated {
    words: u8,
    acceleration: u16,
}

impl Tolerated {
    /// Tolerates nothing: every doubt counts.
    pub const NOTHING: Self = Self { words: 0, acceleration: 0 };

    /// Tolerates at most this many missing acceleration words since the position was exact, in answers of which something
    /// could be read (a silent encoder may not have heard the head, in which case it has not sampled). `acceleration` is the
    /// largest of the shaft, in either direction, in steps per frame²; 1024 is the most that the link can carry.
    /// [`Sample::bound`] holds for this acceleration.
    pub const fn missing_words(words: u8, acceleration: u16) -> Self {
        Self { words, acceleration }
    }
}

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}

/// The age up to which, and the number of missing words over which, a position may be used.
pub type Policy = servowire_core::Policy<Tolerated>;

/// A fast position that may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Sample {
    pub(crate) position: i64,
    pub(crate) velocity: i32,
    pub(crate) bound: u32,
    pub(crate) frame: u32,
    pub(crate) steps_per_turn: u32,
    pub(crate) sampled_ns: u64,
}

impl Sample {
    /// Position in steps, with its sign if the encoder's positions have one.
    pub const fn position(&self) -> i64 {
        self.position
    }

    /// Speed in steps per H-frame.
    pub const fn velocity(&self) -> i32 {
        self.velocity
    }

    /// How far the position may be off in either direction, in steps: 0 unless acceleration words are missing and the policy
    /// tolerates that. It does not cover a wrong word that passed its checks; if others are missing at the same time, this is
    /// discovered after 24 frames or more, not after 16.
    pub const fn bound(&self) -> u32 {
        self.bound
    }

    /// Number of the H-frame, modulo 2^32. Frames reported with [`Master::skip`](crate::master::Master::skip) have numbers too.
    /// Frames that were lost without a report are recognised only by their time; they lead to doubts first and are left out of
    /// the numbers.
    pub const fn frame(&self) -> u32 {
        self.frame
    }

    /// The angle within the turn, if [`Master::set_steps_per_turn`](crate::master::Master::set_steps_per_turn) was called;
    /// otherwise 0.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "less than the steps of a turn")]
    pub const fn angle(&self) -> Angle {
        match self.position.checked_rem_euclid(self.steps_per_turn as i64) {
            Some(steps) => Angle::from_counts(steps as u32, self.steps_per_turn),
            None => Angle::ZERO,
        }
    }

    /// How far that angle may be off in either direction, rounded up; half a turn at most. The bounds of an [`EvidenceShaftCell`]
    /// include it.
    pub const fn angle_bound(&self) -> Angle {
        if self.bound >= self.steps_per_turn / 2 {
            return Angle::HALF;
        }
        let rounded_down = Angle::from_counts(self.bound, self.steps_per_turn);
        if self.bound == 0 || self.steps_per_turn.is_power_of_two() {
            return rounded_down;
        }
        rounded_down.wrapping_add(Angle::from_bits(1))
    }

    /// When the shaft was at this position, on the clock used for the ends of the frames: the time at which the sampling edge of
    /// its
    /// H-frame left the master, plus the latency set with [`Master::set_latency_ns`](crate::master::Master::set_latency_ns).
    pub const fn sampled_ns(&self) -> u64 {
        self.sampled_ns
    }
}

servowire_core::one_line!(Sample {
    Self { position, velocity, bound: 0, sampled_ns, .. } =>
        "{} at {} a frame, sampled at {} ns", position, velocity, sampled_ns;
    Self { position, velocity, bound, sampled_ns, .. } =>
        "{} within {} at {} a frame, sampled at {} ns", position, bound, velocity, sampled_ns;
});

/// What is known about the fast position after an H-frame; returned by [`Master::fast`](crate::master::Master::fast).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Evidence {
    pub(crate) doubt: Option<Doubt>,
    pub(crate) sample: Sample,
    /// Number of missing words, if they are all that keeps the position from being known.
    pub(crate) missing: Option<u8>,
    /// For these words, the sum of the frames since each of them, and the distance estimated over those frames.
    pub(crate) frames: u32,
    pub(crate) way: u32,
}

impl Evidence {
    /// The evidence before the first H-frame.
    pub const NEVER: Self = Self::doubtful(Doubt::Never);

    pub(crate) const fn doubtful(doubt: Doubt) -> Self {
        let sample = Sample { position: 0, velocity: 0, bound: 0, frame: 0, steps_per_turn: 0, sampled_ns: 0 };
        Self { doubt: Some(doubt), sample, missing: None, frames: 0, way: 0 }
    }

    /// Returns the fast position, if it may be used at this time. It is the true position as long as the real speed stays below
    /// a sixteenth of the range per frame, or is within [`Sample::bound`] of it if words that the policy tolerates are missing.
    ///
    /// # Errors
    /// [`Doubt::Never`], [`Doubt::NoLink`], [`Doubt::Speed`], [`Doubt::Estimated`], [`Doubt::Alignment`], then
    /// [`Doubt::Old`].
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        let mut sample = self.sample;
        if let Some(doubt) = self.doubt {
            match self.over_missing_words(policy.tolerated()) {
                Some(bound) => sample.bound = bound,
                None => return Err(doubt),
            }
        }
        match policy.check_age(now_ns, sample.sampled_ns) {
            Ok(()) => Ok(sample),
            Err(age_ns) => Err(Doubt::Old { age_ns }),
        }
    }

    /// Returns how far the position may be off; `None` if more words are missing than are tolerated.
    #[cold]
    const fn over_missing_words(&self, tolerated: Tolerated) -> Option<u32> {
        match self.missing {
            Some(words) if words <= tolerated.words && tolerated.words != 0 => {
                Some(self.frames.saturating_mul(tolerated.acceleration as u32).saturating_add(self.way))
            }
            _ => None,
        }
    }
}

/// For an [`EvidenceShaftCell`].
impl Shaft for Evidence {
    fn shaft(sample: &Sample) -> (Angle, u64) {
        (sample.angle(), sample.sampled_ns())
    }

    fn bound(sample: &Sample) -> Angle {
        sample.angle_bound()
    }
}

/// A safe position that may be used. It must not be used in a control loop, because it is not synchronous with the pulse (SICK
/// manual, p. 67).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SafeSample {
    pub(crate) position: i64,
    pub(crate) summary: u8,
    pub(crate) sampled_ns: u64,
}

impl SafeSample {
    /// Position in steps, with its sign if the encoder's positions have one.
    pub const fn position(&self) -> i64 {
        self.position
    }

    /// SUMMARY: bit n summarises the encoder status register ENC_STn.
    pub const fn summary(&self) -> u8 {
        self.summary
    }

    /// When the sampling edge of the H-frame before its V-frame left the master, on the clock used for the ends of the frames: 8
    /// to 15 H-frames before the edge of the last H-frame.
    pub const fn sampled_ns(&self) -> u64 {
        self.sampled_ns
    }
}

servowire_core::one_line!(SafeSample {
    Self { position, summary, sampled_ns } => "{}, SUMMARY {:02X}h, sampled at {} ns", position, summary, sampled_ns;
});

/// What is known about the safe position after an H-frame; returned by [`Master::safe`](crate::master::Master::safe).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SafeEvidence(pub(crate) Result<SafeSample, Doubt>);

impl SafeEvidence {
    /// The evidence before the first H-frame.
    pub const NEVER: Self = Self(Err(Doubt::Never));

    /// Returns the safe position, if it may be used at this time: words and CRC are good, and the encoder does not mark it as
    /// missing.
    ///
    /// # Errors
    /// [`Doubt::Never`], [`Doubt::NoLink`], [`Doubt::NoVFrame`], [`Doubt::Stale`], [`Doubt::Withheld`], then [`Doubt::Old`].
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<SafeSample, Doubt> {
        match self.0 {
            Ok(sample) => match policy.check_age(now_ns, sample.sampled_ns) {
                Ok(()) => Ok(sample),
                Err(age_ns) => Err(Doubt::Old { age_ns }),
            },
            Err(doubt) => Err(doubt),
        }
    }
}

/// Forwards to the inherent methods.
macro_rules! feedback {
    ($($evidence:ident => $sample:ident;)*) => {
        $(
            impl Feedback for $evidence {
                type Tolerated = Tolerated;
                type Sample = $sample;
                type Doubt = Doubt;
                const NEVER: Self = Self::NEVER;

                fn at(&self, now_ns: u64, policy: Policy) -> Result<$sample, Doubt> {
                    self.at(now_ns, policy)
                }
            }

            impl Default for $evidence {
                fn default() -> Self {
                    Self::NEVER
                }
            }
        )*
    };
}

feedback! {
    Evidence => Sample;
    SafeEvidence => SafeSample;
}

/// The numbers of the doubts in a cell; 0 means that there is a value.
const fn number(doubt: Doubt) -> u32 {
    match doubt {
        Doubt::Never => 1,
        Doubt::NoLink => 2,
        Doubt::Estimated => 3,
        Doubt::Alignment => 4,
        Doubt::Speed => 5,
        Doubt::NoVFrame => 6,
        Doubt::Stale => 7,
        Doubt::Withheld => 8,
        Doubt::Old { .. } => 9,
    }
}

/// Returns the doubt with this number; `wide` is the number that the cell carries in place of the position.
const fn doubt(number: u32, wide: u64) -> Doubt {
    match number {
        2 => Doubt::NoLink,
        3 => Doubt::Estimated,
        4 => Doubt::Alignment,
        5 => Doubt::Speed,
        6 => Doubt::NoVFrame,
        7 => Doubt::Stale,
        8 => Doubt::Withheld,
        9 => Doubt::Old { age_ns: wide },
        _ => Doubt::Never,
    }
}

/// Splits into low and high word.
const fn halves(value: u64) -> [u32; 2] {
    let [a, b, c, d, e, f, g, h] = value.to_le_bytes();
    [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
}

const fn whole(low: u32, high: u32) -> u64 {
    (high as u64) << 32 | low as u64
}

/// Passes evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 10>;

/// Like [`EvidenceCell`], and also returns the angle at an instant between two samples.
pub type EvidenceShaftCell = servowire_core::ShaftCell<Evidence, 10>;

/// For an [`EvidenceCell`]; of a 64-bit number, the low half comes first.
///
/// ```text
///  word 0      doubt in bits 0..=7, missing words in 8..=15, whether but for them the position would be known in 16
///  word 1, 2   position, or the age in a doubt
///  word 3      velocity       4  frame      5  steps a turn      6, 7  instant      8  frames      9  way
/// ```
impl Words<10> for Evidence {
    fn to_words(&self) -> [u32; 10] {
        let Sample { position, velocity, bound: _, frame, steps_per_turn, sampled_ns } = self.sample;
        let verdict = self.doubt.map_or(0, number) | self.missing.map_or(0, |words| u32::from(words) << 8 | 1 << 16);
        let wide = match self.doubt {
            Some(Doubt::Old { age_ns }) => age_ns,
            _ => u64::from_le_bytes(position.to_le_bytes()),
        };
        let ([low, high], [early, late]) = (halves(wide), halves(sampled_ns));
        let velocity = u32::from_le_bytes(velocity.to_le_bytes());
        [verdict, low, high, velocity, frame, steps_per_turn, early, late, self.frames, self.way]
    }

    fn from_words(words: [u32; 10]) -> Self {
        let [verdict, low, high, velocity, frame, steps_per_turn, early, late, frames, way] = words;
        let ([code, missing, followed, _], wide) = (verdict.to_le_bytes(), whole(low, high));
        let doubt = (code != 0).then(|| doubt(code.into(), wide));
        let position = if let Some(Doubt::Old { .. }) = doubt { 0 } else { i64::from_le_bytes(wide.to_le_bytes()) };
        let velocity = i32::from_le_bytes(velocity.to_le_bytes());
        let sampled_ns = whole(early, late);
        let sample = Sample { position, velocity, bound: 0, frame, steps_per_turn, sampled_ns };
        Self { doubt, sample, missing: (followed != 0).then_some(missing), frames, way }
    }
}

impl Words<6> for SafeEvidence {
    fn to_words(&self) -> [u32; 6] {
        let (verdict, wide, summary, sampled_ns) = match self.0 {
            Ok(SafeSample { position, summary, sampled_ns }) => {
                (0, u64::from_le_bytes(position.to_le_bytes()), summary.into(), sampled_ns)
            }
            Err(Doubt::Old { age_ns }) => (number(Doubt::Old { age_ns }), age_ns, 0, 0),
            Err(doubt) => (number(doubt), 0, 0, 0),
        };
        let ([low, high], [early, late]) = (halves(wide), halves(sampled_ns));
        [verdict, low, high, summary, early, late]
    }

    fn from_words([verdict, low, high, summary, early, late]: [u32; 6]) -> Self {
        let wide = whole(low, high);
        let [summary, ..] = summary.to_le_bytes();
        Self(match verdict {
            0 => Ok(SafeSample {
                position: i64::from_le_bytes(wide.to_le_bytes()),
                summary,
                sampled_ns: whole(early, late),
            }),
            number => Err(doubt(number, wide)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    /// Through a cell and back, the highest and lowest numbers and each doubt.
    #[test]
    fn words_come_back() {
        let doubts = [
            Doubt::Never,
            Doubt::NoLink,
            Doubt::Estimated,
            Doubt::Alignment,
            Doubt::Speed,
            Doubt::NoVFrame,
            Doubt::Stale,
            Doubt::Withheld,
            Doubt::Old { age_ns: 0x1_0000_0002 },
        ];
        for told in doubts {
            let evidence = Evidence::doubtful(told);
            assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
            assert_eq!(SafeEvidence::from_words(SafeEvidence(Err(told)).to_words()), SafeEvidence(Err(told)));
        }
        let sample = Sample { sampled_ns: 0x1_0000_0003, ..sample(i64::MIN, -2) };
        let evidence = Evidence { doubt: None, sample, missing: Some(0), frames: 0, way: 0 };
        assert_eq!(evidence.to_words(), [0x1_0000, 0, 0x8000_0000, 0xffff_fffe, 8, 9, 3, 1, 0, 0]);
        assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
        let evidence = Evidence { doubt: Some(Doubt::Estimated), missing: Some(3), frames: 17, way: 4, ..evidence };
        assert_eq!(evidence.to_words(), [0x1_0303, 0, 0x8000_0000, 0xffff_fffe, 8, 9, 3, 1, 17, 4]);
        assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
        let safe = SafeEvidence(Ok(SafeSample { position: -1, summary: 0x81, sampled_ns: u64::MAX }));
        assert_eq!(SafeEvidence::from_words(safe.to_words()), safe);
    }

    const POLICY: Policy = Policy::new(50_000);

    fn sample(position: i64, velocity: i32) -> Sample {
        Sample { position, velocity, bound: 0, frame: 8, steps_per_turn: 9, sampled_ns: 0 }
    }

    /// Three words are missing, over 17 frames; 40 steps of the way were estimated.
    #[test]
    fn missing_words_are_tolerated_with_a_bound() {
        let known = Evidence { doubt: None, sample: sample(5, 1), missing: Some(0), frames: 0, way: 0 };
        let evidence = Evidence { doubt: Some(Doubt::Estimated), missing: Some(3), frames: 17, way: 40, ..known };
        let at =
            |evidence: Evidence, tolerated| evidence.at(0, POLICY.tolerating(tolerated)).map(|sample| sample.bound());
        for (words, verdict) in [(0, Err(Doubt::Estimated)), (2, Err(Doubt::Estimated)), (3, Ok(210)), (255, Ok(210))] {
            assert_eq!(at(evidence, Tolerated::missing_words(words, 10)), verdict);
            assert_eq!(at(known, Tolerated::missing_words(words, 10)), Ok(0));
            assert!(at(Evidence { missing: None, ..evidence }, Tolerated::missing_words(words, 10)).is_err());
        }
        assert_eq!(at(Evidence { frames: u32::MAX, ..evidence }, Tolerated::missing_words(3, 10)), Ok(u32::MAX));
        assert_eq!(
            evidence.at(50_001, POLICY.tolerating(Tolerated::missing_words(3, 10))),
            Err(Doubt::Old { age_ns: 50_001 })
        );
    }

    /// A quarter of a turn of 1000 steps, also below 0, and half a degree.
    #[test]
    fn angles() {
        let at = |position| Sample { steps_per_turn: 1000, bound: 2, ..sample(position, 0) };
        assert_eq!([250, -750, 7250].map(|position| at(position).angle().millidegrees()), [90_000; 3]);
        // 2/1000 of 2^32 are 8,589,934.6, rounded up; what is exact is not.
        let bound = |steps_per_turn, bound| Sample { bound, steps_per_turn, ..at(0) }.angle_bound().to_bits();
        assert_eq!([bound(1000, 2), bound(1000, 0), bound(1024, 2)], [8_589_935, 0, 8_388_608]);
        for bound in [500, 700, 1999, 5000] {
            assert_eq!(Sample { bound, ..at(0) }.angle_bound(), Angle::HALF);
        }
        let shaft = Evidence::shaft(&Sample { sampled_ns: 77, ..at(250) });
        assert_eq!((shaft.0.millidegrees(), shaft.1), (90_000, 77));
        let unknown = Sample { steps_per_turn: 0, ..at(7) };
        assert_eq!((unknown.angle(), unknown.angle_bound()), (Angle::ZERO, Angle::HALF));
    }

    #[test]
    fn a_value_that_nobody_refreshes_becomes_old() {
        let sample = Sample { sampled_ns: 1_000_000, ..sample(-7, 12) };
        let evidence = Evidence { doubt: None, sample, missing: None, frames: 0, way: 0 };
        assert_eq!(evidence.at(1_050_000, POLICY), Ok(sample));
        assert_eq!(evidence.at(1_050_001, POLICY), Err(Doubt::Old { age_ns: 50_001 }));
        assert_eq!(Feedback::at(&evidence, 900_000, POLICY), Err(Doubt::Old { age_ns: 100_000 }));
        let safe = SafeEvidence(Ok(SafeSample { position: 5, summary: 0x81, sampled_ns: 1_000_000 }));
        assert_eq!(safe.at(1_050_000, POLICY).map(|safe| (safe.position(), safe.summary())), Ok((5, 0x81)));
        assert_eq!(safe.at(2_000_000, POLICY), Err(Doubt::Old { age_ns: 1_000_000 }));
    }

    /// What was known when the evidence was taken goes before the age.
    #[test]
    fn doubts_do_not_age() {
        assert_eq!(Evidence::doubtful(Doubt::NoLink).at(u64::MAX, POLICY), Err(Doubt::NoLink));
        assert_eq!(Evidence::default().at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
        assert_eq!(SafeEvidence::default().at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
    }

    #[test]
    fn as_a_log_shows_them() {
        let sample = Sample { sampled_ns: 34, ..sample(-7, 12) };
        assert_eq!(sample.to_string(), "-7 at 12 a frame, sampled at 34 ns");
        assert_eq!(Sample { bound: 5, ..sample }.to_string(), "-7 within 5 at 12 a frame, sampled at 34 ns");
        let safe = SafeSample { position: 5, summary: 0x81, sampled_ns: 34 };
        assert_eq!(safe.to_string(), "5, SUMMARY 81h, sampled at 34 ns");
        assert_eq!(Doubt::Old { age_ns: 3 }.to_string(), "the position is 3 ns old");
    }
}
