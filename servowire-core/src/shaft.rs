use core::marker::PhantomData;

use crate::angle::{Angle, Commutation};
use crate::cell::Words;
use crate::feedback::{Feedback, Policy};
use crate::four_slots::FourSlots;
use crate::motion::{Acceleration, Estimate, Motion, Tracker};

/// Feedback about the angle of a shaft.
pub trait Shaft: Feedback {
    /// The angle within the turn, and the instant of sampling in ns.
    fn shaft(sample: &Self::Sample) -> (Angle, u64);

    /// How far the angle may be off in either direction beyond the width of a count, if it is an estimate.
    fn bound(_sample: &Self::Sample) -> Angle {
        Angle::ZERO
    }
}

/// A [`Cell`](crate::Cell) that carries the motion of the shaft in addition to the evidence, for a control loop that runs more
/// often than the encoder is read, or at other times.
///
/// The writer computes angle and speed, with divisions; the reader computes the electrical angle at this instant and the bound
/// of its error without any. It takes 4 × (`W` + 7) + 2 words of memory.
///
/// ```
/// use servowire_core::{Acceleration, Angle, Commutation, Policy, Sense, ShaftCell, Tracker};
/// # use servowire_core::{Feedback, Shaft, Words};
/// # #[derive(Clone, Copy)]
/// # struct Evidence { count: u32, sampled_ns: Option<u64> }
/// # #[derive(Debug, Clone, Copy, PartialEq)]
/// # enum Doubt { Never, Old { age_ns: u64 } }
/// # impl Feedback for Evidence {
/// #     type Tolerated = ();
/// #     type Sample = (u32, u64);
/// #     type Doubt = Doubt;
/// #     const NEVER: Self = Self { count: 0, sampled_ns: None };
/// #     fn at(&self, now_ns: u64, policy: Policy<()>) -> Result<(u32, u64), Doubt> {
/// #         let sampled_ns = self.sampled_ns.ok_or(Doubt::Never)?;
/// #         policy.check_age(now_ns, sampled_ns).map_err(|age_ns| Doubt::Old { age_ns })?;
/// #         Ok((self.count, sampled_ns))
/// #     }
/// # }
/// # impl Words<3> for Evidence {
/// #     fn to_words(&self) -> [u32; 3] {
/// #         let sampled_ns = self.sampled_ns.unwrap_or(0);
/// #         [self.count, sampled_ns as u32, (sampled_ns >> 32) as u32]
/// #     }
/// #     fn from_words([count, low, high]: [u32; 3]) -> Self {
/// #         let sampled_ns = u64::from(high) << 32 | u64::from(low);
/// #         Self { count, sampled_ns: (sampled_ns != 0).then_some(sampled_ns) }
/// #     }
/// # }
/// # impl Shaft for Evidence {
/// #     fn shaft((count, sampled_ns): &(u32, u64)) -> (Angle, u64) {
/// #         (Angle::from_counts(*count, 1 << 20), *sampled_ns)
/// #     }
/// # }
/// // An encoder with 20 bits on a servo that never exceeds 100 turns per second and 2000 turns per second squared.
/// let tracker = Tracker::new(1 << 20, 100).unwrap();
/// let acceleration = Acceleration::from_turns_per_s2(2_000).unwrap();
/// let commutation = Commutation::new(4, Angle::ZERO, Sense::Up).unwrap();
/// let policy = Policy::new(125_000);
///
/// let mut cell = ShaftCell::<Evidence, 3>::new();
/// let (mut writer, mut reader) = cell.split(tracker);
/// // where answers are received: 5000 counts in 62.5 µs are 76 turns per second
/// writer.put(Evidence { count: 10_000, sampled_ns: Some(1_000_000) }, 1_010_000, policy);
/// writer.put(Evidence { count: 15_000, sampled_ns: Some(1_062_500) }, 1_072_500, policy);
/// // where the current is controlled, 31.25 µs after the last sample: 17500 counts, times four
/// let field = reader.angle(1_093_750, policy, commutation, acceleration)?;
/// assert_eq!(field.angle.millidegrees(), 24_033);
/// assert_eq!(field.bound.millidegrees(), 6);
/// # Ok::<(), Doubt>(())
/// ```
pub struct ShaftCell<F, const W: usize> {
    slots: FourSlots<W, { Motion::WORDS }>,
    evidence: PhantomData<F>,
}

impl<F: Shaft + Words<W>, const W: usize> ShaftCell<F, W> {
    /// Creates a cell that holds [`Feedback::NEVER`].
    pub const fn new() -> Self {
        Self { slots: FourSlots::new(), evidence: PhantomData }
    }

    /// Returns the two ends, as [`Cell::split`](crate::Cell::split) does. The cell keeps its contents; the next sample counts as
    /// a first one.
    pub const fn split(&mut self, tracker: Tracker) -> (ShaftWriter<'_, F, W>, ShaftReader<'_, F, W>) {
        let slots = &self.slots;
        (ShaftWriter { slots, tracker, evidence: PhantomData }, ShaftReader { slots, evidence: PhantomData })
    }
}

impl<F: Shaft + Words<W>, const W: usize> Default for ShaftCell<F, W> {
    fn default() -> Self {
        Self::new()
    }
}

/// The end of a [`ShaftCell`] where evidence is received.
pub struct ShaftWriter<'a, F, const W: usize> {
    slots: &'a FourSlots<W, { Motion::WORDS }>,
    tracker: Tracker,
    evidence: PhantomData<F>,
}

impl<F: Shaft + Words<W>, const W: usize> ShaftWriter<'_, F, W> {
    /// Stores the newest evidence, replacing all earlier evidence.
    ///
    /// The policy, usually that of the reader, decides which evidence is used for the speed. After a doubt the speed is not
    /// known until there are two good samples again, as at the start.
    pub fn put(&mut self, evidence: F, now_ns: u64, policy: Policy<F::Tolerated>) {
        let motion = if let Ok(sample) = evidence.at(now_ns, policy) {
            let (angle, sampled_ns) = F::shaft(&sample);
            self.tracker.sample_within(angle, sampled_ns, F::bound(&sample))
        } else {
            self.tracker.interrupt()
        };
        self.slots.put(&(evidence.to_words(), motion.to_words()));
    }
}

/// The end of a [`ShaftCell`] where evidence is used.
pub struct ShaftReader<'a, F, const W: usize> {
    slots: &'a FourSlots<W, { Motion::WORDS }>,
    evidence: PhantomData<F>,
}

impl<F: Shaft + Words<W>, const W: usize> ShaftReader<'_, F, W> {
    /// Returns the value of the newest evidence, if it may be used at this time.
    ///
    /// # Errors
    /// The reason why it must not be used.
    #[inline]
    pub fn at(&mut self, now_ns: u64, policy: Policy<F::Tolerated>) -> Result<F::Sample, F::Doubt> {
        self.latest().at(now_ns, policy)
    }

    /// Returns the speed and the mechanical angle, if the newest evidence may be used at this time.
    ///
    /// # Errors
    /// The reason why it must not be used.
    #[inline]
    pub fn motion(&mut self, now_ns: u64, policy: Policy<F::Tolerated>) -> Result<Motion, F::Doubt> {
        let (evidence, motion) = self.newest();
        evidence.at(now_ns, policy).map(|_| motion)
    }

    /// Returns the electrical angle at this time, if the newest evidence may be used. Compare the bound with what the drive can
    /// tolerate; if the speed is not known, the bound is half a turn.
    ///
    /// # Errors
    /// The reason why it must not be used.
    #[inline]
    pub fn angle(
        &mut self,
        now_ns: u64,
        policy: Policy<F::Tolerated>,
        commutation: Commutation,
        max_acceleration: Acceleration,
    ) -> Result<Estimate, F::Doubt> {
        let Estimate { angle, bound } = self.motion(now_ns, policy)?.at(now_ns, max_acceleration);
        Ok(Estimate { angle: commutation.electrical(angle), bound: commutation.bound(bound) })
    }

    /// Returns the newest evidence, unjudged.
    #[inline]
    fn latest(&mut self) -> F {
        self.newest().0
    }

    #[inline]
    fn newest(&self) -> (F, Motion) {
        match self.slots.get() {
            Some((words, motion)) => (F::from_words(words), Motion::from_words(motion)),
            None => (F::NEVER, Motion::UNKNOWN),
        }
    }
}

/// Declares `Evidence`, `Sample`, `EvidenceCell` and `EvidenceShaftCell` for a protocol whose encoders count turns.
///
/// The reasons against using a position are bits of one word of marks, so that one mask says which are tolerated. The
/// protocol defines what the marks mean. The calling module has in scope its own `Policy`, `Tolerated` (with
/// `objects_to(marks)` and `ignores_turns()`), `Doubt`, the mark `NEVER`, `single_turn_bits(marks)`, and it implements
/// `Evidence::doubt`, which names the reason against using a position. The fields are private to the module that calls this
/// macro, so nothing else can create a sample. The last argument is the serialised name of the field for the width of the
/// single turn.
#[macro_export]
macro_rules! shaft_evidence {
    ($(#[$about:meta])* Evidence, $bits:ident) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize))]
        pub struct Evidence {
            sampled_ns: u64,
            single_turn: u32,
            turns: i32,
            marks: u32,
        }

        $crate::one_line!(Evidence {
            Self { marks, .. } if marks & NEVER != 0 => "no position was heard yet";
            Self { sampled_ns, .. } => "a position sampled at {} ns", sampled_ns;
        });

        impl Evidence {
            /// Nothing has been received yet.
            pub const NEVER: Self = Self { sampled_ns: 0, single_turn: 0, turns: 0, marks: NEVER };

            /// Returns the position, if it may be used at `now_ns`.
            ///
            /// # Errors
            /// [`Doubt`], in the order in which its variants are declared.
            #[inline]
            pub const fn at(&self, now_ns: u64, policy: Policy) -> Result<Sample, Doubt> {
                let Self { sampled_ns, single_turn, turns, marks } = *self;
                let tolerated = policy.tolerated();
                if policy.check_age(now_ns, sampled_ns).is_ok() && tolerated.objects_to(marks) == 0 {
                    let turns = if tolerated.ignores_turns() { None } else { Some(turns) };
                    Ok(Sample { sampled_ns, single_turn, turns, $bits: single_turn_bits(marks) })
                } else {
                    Err(self.doubt(now_ns, policy))
                }
            }
        }

        impl Default for Evidence {
            fn default() -> Self {
                Self::NEVER
            }
        }

        impl $crate::Feedback for Evidence {
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
        impl $crate::Shaft for Evidence {
            #[inline]
            fn shaft(sample: &Sample) -> ($crate::Angle, u64) {
                (sample.angle(), sample.sampled_ns())
            }
        }

        /// Passes evidence from where it is received to where it is used, between two priorities or cores.
        pub type EvidenceCell = $crate::Cell<Evidence, 5>;

        /// Like [`EvidenceCell`], and also returns the angle at an instant between two samples.
        pub type EvidenceShaftCell = $crate::ShaftCell<Evidence, 5>;

        /// For an [`EvidenceCell`]: the instant of sampling, low half first, single turn, turns, marks.
        impl $crate::Words<5> for Evidence {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "halves, and bits of one width")]
            #[inline]
            fn to_words(&self) -> [u32; 5] {
                let Self { sampled_ns, single_turn, turns, marks } = *self;
                [sampled_ns as u32, (sampled_ns >> 32) as u32, single_turn, turns as u32, marks]
            }

            #[allow(clippy::cast_possible_wrap, reason = "bits of one width")]
            #[inline]
            fn from_words([low, high, single_turn, turns, marks]: [u32; 5]) -> Self {
                Self { sampled_ns: u64::from(high) << 32 | u64::from(low), single_turn, turns: turns as i32, marks }
            }
        }

        /// A position that may be used, and when it was sampled: from [`Evidence::at`].
        ///
        /// It has turns only if the policy judged them. With [`Tolerated::SINGLE_TURN`] they may be wrong, so they are left
        /// out.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize))]
        pub struct Sample {
            sampled_ns: u64,
            single_turn: u32,
            turns: Option<i32>,
            $bits: u8,
        }

        $crate::one_line!(Sample {
            Self { single_turn, turns: Some(turns), sampled_ns, .. } =>
                "turn {}, {} counts at {} ns", turns, single_turn, sampled_ns;
            Self { single_turn, turns: None, sampled_ns, .. } => "{} counts at {} ns", single_turn, sampled_ns;
        });

        impl Sample {
            /// When it was sampled, in ns by the clock of the master, as reported by the exchange. The age of the position
            /// counts from here.
            pub const fn sampled_ns(self) -> u64 {
                self.sampled_ns
            }

            /// Counts within the turn.
            pub const fn single_turn(self) -> u32 {
                self.single_turn
            }

            /// The position within the turn as an angle.
            pub const fn angle(self) -> $crate::Angle {
                $crate::Angle::from_bits(self.single_turn.wrapping_shl(32_u32.wrapping_sub(self.$bits as u32)))
            }

            /// Turns, if the policy judged them.
            pub const fn turns(self) -> Option<i32> {
                self.turns
            }

            /// Both parts as counts, if the policy judged the turns: the turns times the counts per turn, plus the single turn.
            pub const fn counts(self) -> Option<i64> {
                match self.turns {
                    Some(turns) => Some((turns as i64).wrapping_shl(self.$bits as u32) | self.single_turn as i64),
                    None => None,
                }
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Sense;

    /// A count of 2^16, good or not, and its instant; never if this is 0.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Count(u32, bool, u32);

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    enum Doubt {
        Never,
        Bad,
        Old(u64),
    }

    impl Feedback for Count {
        type Tolerated = ();
        type Sample = Self;
        type Doubt = Doubt;
        const NEVER: Self = Self(0, true, 0);

        fn at(&self, now_ns: u64, policy: Policy<()>) -> Result<Self, Doubt> {
            match *self {
                Self(_, _, 0) => Err(Doubt::Never),
                Self(_, false, _) => Err(Doubt::Bad),
                Self(_, true, ns) => policy.check_age(now_ns, ns.into()).map_err(Doubt::Old).map(|()| *self),
            }
        }
    }

    impl Shaft for Count {
        fn shaft(Self(count, _, ns): &Self) -> (Angle, u64) {
            (Angle::from_counts(*count, 1 << 16), (*ns).into())
        }
    }

    impl Words<3> for Count {
        fn to_words(&self) -> [u32; 3] {
            [self.0, self.1.into(), self.2]
        }

        fn from_words([count, good, ns]: [u32; 3]) -> Self {
            Self(count, good != 0, ns)
        }
    }

    const POLICY: Policy<()> = Policy::new(100_000);

    /// An electrical angle in degrees, and whether anything is known.
    fn field(reader: &mut ShaftReader<'_, Count, 3>, now_ns: u64) -> Result<(u32, bool), Doubt> {
        let commutation = Commutation::new(2, Angle::from_millidegrees(90_000), Sense::Down).unwrap();
        let acceleration = Acceleration::from_turns_per_s2(1_000).unwrap();
        let estimate = reader.angle(now_ns, POLICY, commutation, acceleration)?;
        Ok(((estimate.angle.millidegrees() + 500) / 1_000, estimate.bound != Angle::HALF))
    }

    #[test]
    fn the_field_goes_on_between_samples_until_they_are_old() {
        let mut cell = ShaftCell::<Count, 3>::default();
        let (mut writer, mut reader) = cell.split(Tracker::new(1 << 16, 1_000).unwrap());
        assert_eq!((field(&mut reader, 1_000), reader.latest()), (Err(Doubt::Never), Count::NEVER));
        // 1/64 of a turn in 100 µs: 5.6 degrees of the shaft, 11.25 of the field, backward from 90.
        writer.put(Count(0, true, 1_000_000), 1_000_000, POLICY);
        assert_eq!(field(&mut reader, 1_000_000), Ok((90, false)));
        writer.put(Count(1 << 10, true, 1_100_000), 1_100_000, POLICY);
        assert_eq!([1_100_000, 1_200_000].map(|now| field(&mut reader, now)), [Ok((79, true)), Ok((68, true))]);
        assert_eq!(field(&mut reader, 1_200_001), Err(Doubt::Old(100_001)));
        assert_eq!(reader.at(1_200_000, POLICY), Ok(Count(1 << 10, true, 1_100_000)));
        // 156 turns per second.
        assert_eq!(reader.motion(1_100_000, POLICY).map(|motion| motion.speed()), Ok(Some(43_980_465)));
    }

    #[test]
    fn after_a_doubt_the_speed_begins_anew() {
        let mut cell = ShaftCell::<Count, 3>::new();
        let (mut writer, mut reader) = cell.split(Tracker::new(1 << 16, 1_000).unwrap());
        let known = [true, true, false, true, true].iter().zip(1..).map(|(good, k)| {
            let ns = k * 50_000;
            writer.put(Count(7, *good, ns), ns.into(), POLICY);
            field(&mut reader, ns.into()).map(|(_, known)| known)
        });
        assert!(known.eq([Ok(false), Ok(true), Err(Doubt::Bad), Ok(false), Ok(true)]));
    }

    /// What is too old for the position is too old for the speed.
    #[test]
    fn evidence_that_comes_late_is_no_sample_of_the_speed() {
        let mut cell = ShaftCell::<Count, 3>::new();
        let (mut writer, mut reader) = cell.split(Tracker::new(1 << 16, 1_000).unwrap());
        let mut known = |sampled_ns: u32, put_ns| {
            writer.put(Count(7, true, sampled_ns), put_ns, POLICY);
            reader.motion(sampled_ns.into(), POLICY).map(|motion| motion.speed())
        };
        assert_eq!(known(50_000, 60_000), Ok(None));
        assert_eq!(known(100_000, 200_000), Ok(Some(0)));
        // 1 ns more than the longest age.
        assert_eq!(known(150_000, 250_001), Ok(None));
        assert_eq!(known(200_000, 210_000), Ok(None));
        assert_eq!(known(250_000, 260_000), Ok(Some(0)));
    }

    /// Whoever splits a cell again finds what was in it, and a speed that starts anew.
    #[test]
    fn a_cell_that_is_split_again_keeps_its_value() {
        let mut cell = ShaftCell::<Count, 3>::new();
        let tracker = Tracker::new(1 << 16, 1_000).unwrap();
        let (mut writer, _) = cell.split(tracker);
        writer.put(Count(7, true, 50_000), 50_000, POLICY);
        writer.put(Count(7, true, 100_000), 100_000, POLICY);
        let (mut writer, mut reader) = cell.split(tracker);
        assert_eq!(reader.latest(), Count(7, true, 100_000));
        assert_eq!(reader.motion(100_000, POLICY).map(|motion| motion.speed()), Ok(Some(0)));
        writer.put(Count(7, true, 150_000), 150_000, POLICY);
        assert_eq!(reader.motion(150_000, POLICY).map(|motion| motion.speed()), Ok(None));
    }
}
