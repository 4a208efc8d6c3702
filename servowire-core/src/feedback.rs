/// What a policy can tolerate: status bits and alarms that a drive can live with; `()` for a protocol that has none.
pub trait Tolerance: Copy {
    /// Tolerates nothing: every alarm is a doubt.
    const NOTHING: Self;
}

impl Tolerance for () {
    const NOTHING: Self = ();
}

/// How old a value may be, and which alarms it may carry, to be used. There is deliberately no default age: only the control
/// loop knows how far a shaft turns in that time.
///
/// Each protocol crate declares its own: `type Policy = servowire_core::Policy<Tolerated>`.
///
/// ```
/// type Policy = servowire_core::Policy<()>;
/// let policy = Policy::new(125_000); // two cycles of a 16 kHz loop
/// assert_eq!(policy.check_age(1_125_000, 1_000_000), Ok(()));
/// assert_eq!(policy.check_age(1_125_001, 1_000_000), Err(125_001));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Policy<T> {
    max_age_ns: u64,
    tolerated: T,
}

impl<T: Tolerance> Policy<T> {
    /// Accepts values up to this age, in ns from the instant of sampling; no alarm is tolerated.
    pub const fn new(max_age_ns: u64) -> Self {
        Self { max_age_ns, tolerated: T::NOTHING }
    }

    /// Also accepts values with these alarms, in place of those tolerated before.
    #[must_use]
    pub const fn tolerating(self, tolerated: T) -> Self {
        Self { tolerated, ..self }
    }

    /// The maximum age, in ns from the instant of sampling.
    pub const fn max_age_ns(&self) -> u64 {
        self.max_age_ns
    }

    /// The alarms that are tolerated.
    pub const fn tolerated(&self) -> T {
        self.tolerated
    }

    /// Checks the age of a value.
    ///
    /// If the instant of sampling lies after `now_ns`, the age is the distance between them, so a clock that was set back
    /// does not make a value look young. A short distance is normal, because the writer may interrupt a reader between reading
    /// its clock and reading the value.
    ///
    /// # Errors
    /// The age in ns, if it exceeds the maximum.
    pub const fn check_age(&self, now_ns: u64, sampled_ns: u64) -> Result<(), u64> {
        if now_ns < sampled_ns {
            self.check_ahead(now_ns, sampled_ns)
        } else {
            self.within(now_ns.abs_diff(sampled_ns))
        }
    }

    /// It is kept out of line, to keep the ordinary case straight.
    #[cold]
    const fn check_ahead(&self, now_ns: u64, sampled_ns: u64) -> Result<(), u64> {
        self.within(sampled_ns.abs_diff(now_ns))
    }

    const fn within(&self, age_ns: u64) -> Result<(), u64> {
        if age_ns > self.max_age_ns { Err(age_ns) } else { Ok(()) }
    }
}

/// Evidence of a position, speed or torque. It is judged where it is used, not where it is received, because it ages in
/// between.
///
/// Protocol crates implement it by forwarding to an inherent `const fn at`, so a control loop is written the same way for all of
/// them:
///
/// ```
/// use servowire_core::{Feedback, Policy, Tolerance};
///
/// /// What a simple encoder has said: a count, and when it was sampled.
/// #[derive(Clone, Copy)]
/// struct Evidence {
///     count: u32,
///     sampled_ns: Option<u64>,
/// }
///
/// #[derive(Debug, Clone, Copy, PartialEq)]
/// enum Doubt {
///     Never,
///     Old { age_ns: u64 },
/// }
///
/// impl Feedback for Evidence {
///     type Tolerated = ();
///     type Sample = u32;
///     type Doubt = Doubt;
///     const NEVER: Self = Self { count: 0, sampled_ns: None };
///
///     fn at(&self, now_ns: u64, policy: Policy<()>) -> Result<u32, Doubt> {
///         let sampled_ns = self.sampled_ns.ok_or(Doubt::Never)?;
///         policy.check_age(now_ns, sampled_ns).map_err(|age_ns| Doubt::Old { age_ns })?;
///         Ok(self.count)
///     }
/// }
///
/// let policy = Policy::new(125_000);
/// let evidence = Evidence { count: 4711, sampled_ns: Some(1_000_000) };
/// assert_eq!(evidence.at(1_040_000, policy), Ok(4711));
/// assert_eq!(evidence.at(1_200_000, policy), Err(Doubt::Old { age_ns: 200_000 }));
/// assert_eq!(Evidence::NEVER.at(1_040_000, policy), Err(Doubt::Never));
/// ```
pub trait Feedback: Copy {
    /// What a policy can tolerate.
    type Tolerated: Tolerance;
    /// A value that may be used, with its instant of sampling.
    type Sample: Copy;
    /// Why a value must not be used.
    type Doubt: Copy;

    /// The evidence before the first exchange: doubtful under every policy.
    const NEVER: Self;

    /// Returns the value, if it may be used at this time.
    ///
    /// # Errors
    /// The reason why it must not be used.
    fn at(&self, now_ns: u64, policy: Policy<Self::Tolerated>) -> Result<Self::Sample, Self::Doubt>;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Lamps(u8);

    impl Tolerance for Lamps {
        const NOTHING: Self = Self(0);
    }

    #[test]
    fn nothing_is_tolerated_unless_asked_for() {
        const POLICY: Policy<Lamps> = Policy::new(500);
        assert_eq!((POLICY.max_age_ns(), POLICY.tolerated()), (500, Lamps(0)));
        let lenient = POLICY.tolerating(Lamps(3));
        assert_eq!((lenient.max_age_ns(), lenient.tolerated()), (500, Lamps(3)));
        assert_eq!(lenient.tolerating(Lamps(4)).tolerated(), Lamps(4));
    }

    #[test]
    fn the_longest_age_is_still_young() {
        let policy = Policy::<()>::new(500);
        for (now_ns, sampled_ns, verdict) in [
            (1_000, 1_000, Ok(())),
            (1_500, 1_000, Ok(())),
            (1_501, 1_000, Err(501)),
            (u64::MAX, 0, Err(u64::MAX)),
            // The reader's clock was read before the sample was taken, and it was set back.
            (500, 1_000, Ok(())),
            (499, 1_000, Err(501)),
            (0, u64::MAX, Err(u64::MAX)),
        ] {
            assert_eq!(policy.check_age(now_ns, sampled_ns), verdict, "{now_ns} {sampled_ns}");
        }
        assert_eq!(Policy::<()>::new(0).check_age(7, 7), Ok(()));
        assert_eq!(Policy::<()>::new(0).check_age(8, 7), Err(1));
        assert_eq!(Policy::<()>::new(u64::MAX).check_age(u64::MAX, 0), Ok(()));
    }
}
