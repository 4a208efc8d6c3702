//! What a control loop may use of the positions, judged at the moment of use.

use servowire_core::{Feedback, Tolerance, Words};

use crate::doubt::Doubt;

/// In spite of what a position may be used: nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub struct Tolerated {}

impl Tolerated {
    /// Nothing: every doubt counts.
    pub const NOTHING: Self = Self {};
}

impl Tolerance for Tolerated {
    const NOTHING: Self = Self::NOTHING;
}

/// Up to which age a position may be used.
pub type Policy = servowire_core::Policy<Tolerated>;

/// A fast position that may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Sample {
    pub(crate) position: i64,
    pub(crate) velocity: i32,
    pub(crate) sampled_ns: u64,
}

impl Sample {
    /// Position in steps, with its sign if the encoder's positions have one.
    pub const fn position(&self) -> i64 {
        self.position
    }

    /// Speed in steps an H-frame.
    pub const fn velocity(&self) -> i32 {
        self.velocity
    }

    /// When the sampling edge of its H-frame left the master, on the clock that the ends of the frames were told by.
    pub const fn sampled_ns(&self) -> u64 {
        self.sampled_ns
    }
}

servowire_core::one_line!(Sample {
    Self { position, velocity, sampled_ns } => "{} at {} a frame, sampled at {} ns", position, velocity, sampled_ns;
});

/// What there is to say about the fast position after an H-frame: from [`Master::fast`](crate::master::Master::fast).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Evidence(pub(crate) Result<Sample, Doubt>);

impl Evidence {
    /// Before the first H-frame.
    pub const NEVER: Self = Self(Err(Doubt::Never));

    /// The fast position, if it may be used at this time: the truth as long as the real speed stays below a sixteenth of the
    /// range a frame.
    ///
    /// # Errors
    /// [`Doubt::Never`], [`Doubt::NoLink`], [`Doubt::Estimated`], [`Doubt::Alignment`], [`Doubt::Speed`], then
    /// [`Doubt::Old`].
    pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
        match self.0 {
            Ok(sample) => match policy.check_age(now_ns, sample.sampled_ns) {
                Ok(()) => Ok(sample),
                Err(age_ns) => Err(Doubt::Old { age_ns }),
            },
            Err(doubt) => Err(doubt),
        }
    }
}

/// A safe position that may be used. It must not close a control loop: it is not in step with the pulse (SICK manual,
/// p. 67).
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

    /// SUMMARY: bit n sums up the encoder status register ENC_STn.
    pub const fn summary(&self) -> u8 {
        self.summary
    }

    /// When the sampling edge of the H-frame before its V-frame left the master, on the clock that the ends of the frames were
    /// told by: 8 to 15 H-frames before that of the last H-frame.
    pub const fn sampled_ns(&self) -> u64 {
        self.sampled_ns
    }
}

servowire_core::one_line!(SafeSample {
    Self { position, summary, sampled_ns } => "{}, SUMMARY {:02X}h, sampled at {} ns", position, summary, sampled_ns;
});

/// What there is to say about the safe position after an H-frame: from [`Master::safe`](crate::master::Master::safe).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SafeEvidence(pub(crate) Result<SafeSample, Doubt>);

impl SafeEvidence {
    /// Before the first H-frame.
    pub const NEVER: Self = Self(Err(Doubt::Never));

    /// The safe position, if it may be used at this time: words and CRC good, and no mark that the encoder has none.
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

/// The numbers that stand for doubts in a cell; 0 is a value.
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

/// The doubt with this number; `wide` is what came in the place of the position.
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

/// Low and high word.
const fn halves(value: u64) -> [u32; 2] {
    let [a, b, c, d, e, f, g, h] = value.to_le_bytes();
    [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
}

const fn whole(low: u32, high: u32) -> u64 {
    (high as u64) << 32 | low as u64
}

/// A verdict, a position or the age in a doubt, what came with the position, the instant of sampling.
const fn pack(verdict: u32, wide: u64, more: u32, sampled_ns: u64) -> [u32; 6] {
    let ([low, high], [early, late]) = (halves(wide), halves(sampled_ns));
    [verdict, low, high, more, early, late]
}

const fn pack_doubt(doubt: Doubt) -> [u32; 6] {
    let age_ns = if let Doubt::Old { age_ns } = doubt { age_ns } else { 0 };
    pack(number(doubt), age_ns, 0, 0)
}

/// Carries evidence from where it is received to where it is used, between two priorities or cores.
pub type EvidenceCell = servowire_core::Cell<Evidence, 6>;

impl Words<6> for Evidence {
    fn to_words(&self) -> [u32; 6] {
        match self.0 {
            Ok(Sample { position, velocity, sampled_ns }) => pack(
                0,
                u64::from_le_bytes(position.to_le_bytes()),
                u32::from_le_bytes(velocity.to_le_bytes()),
                sampled_ns,
            ),
            Err(doubt) => pack_doubt(doubt),
        }
    }

    fn from_words([verdict, low, high, velocity, early, late]: [u32; 6]) -> Self {
        let wide = whole(low, high);
        Self(match verdict {
            0 => Ok(Sample {
                position: i64::from_le_bytes(wide.to_le_bytes()),
                velocity: i32::from_le_bytes(velocity.to_le_bytes()),
                sampled_ns: whole(early, late),
            }),
            number => Err(doubt(number, wide)),
        })
    }
}

impl Words<6> for SafeEvidence {
    fn to_words(&self) -> [u32; 6] {
        match self.0 {
            Ok(SafeSample { position, summary, sampled_ns }) => {
                pack(0, u64::from_le_bytes(position.to_le_bytes()), summary.into(), sampled_ns)
            }
            Err(doubt) => pack_doubt(doubt),
        }
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
            assert_eq!(Evidence::from_words(Evidence(Err(told)).to_words()), Evidence(Err(told)));
            assert_eq!(SafeEvidence::from_words(SafeEvidence(Err(told)).to_words()), SafeEvidence(Err(told)));
        }
        let evidence = Evidence(Ok(Sample { position: i64::MIN, velocity: -2, sampled_ns: 0x1_0000_0003 }));
        assert_eq!(evidence.to_words(), [0, 0, 0x8000_0000, 0xffff_fffe, 3, 1]);
        assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
        let safe = SafeEvidence(Ok(SafeSample { position: -1, summary: 0x81, sampled_ns: u64::MAX }));
        assert_eq!(SafeEvidence::from_words(safe.to_words()), safe);
    }

    const POLICY: Policy = Policy::new(50_000);

    #[test]
    fn a_value_that_nobody_refreshes_becomes_old() {
        let sample = Sample { position: -7, velocity: 12, sampled_ns: 1_000_000 };
        let evidence = Evidence(Ok(sample));
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
        assert_eq!(Evidence(Err(Doubt::NoLink)).at(u64::MAX, POLICY), Err(Doubt::NoLink));
        assert_eq!(Evidence::default().at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
        assert_eq!(SafeEvidence::default().at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
    }

    #[test]
    fn as_a_log_shows_them() {
        let sample = Sample { position: -7, velocity: 12, sampled_ns: 34 };
        assert_eq!(sample.to_string(), "-7 at 12 a frame, sampled at 34 ns");
        let safe = SafeSample { position: 5, summary: 0x81, sampled_ns: 34 };
        assert_eq!(safe.to_string(), "5, SUMMARY 81h, sampled at 34 ns");
        assert_eq!(Doubt::Old { age_ns: 3 }.to_string(), "the position is 3 ns old");
    }
}
