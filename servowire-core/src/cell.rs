use core::marker::PhantomData;

use crate::feedback::{Feedback, Policy};
use crate::four_slots::FourSlots;

/// A value that can pass through a [`Cell`], its fields packed into `W` words.
pub trait Words<const W: usize>: Sized {
    /// Packs the value into words.
    fn to_words(&self) -> [u32; W];

    /// Unpacks a value. A cell only passes words made by [`to_words`](Self::to_words); any other words may unpack to an
    /// arbitrary value.
    fn from_words(words: [u32; W]) -> Self;
}

/// Passes the newest evidence from the interrupt that receives it to a control loop of another priority. Either may preempt the
/// other, and they may run on one core or two.
///
/// Neither end ever waits, retries or disables interrupts, and the cell needs only loads and stores of 32 bits, which a
/// Cortex-M0+ has. A value that is read is whole. It is never older than the value read before it, and never older than the
/// last value that was stored completely. It takes 4 × `W` + 2 words of memory. The order of all loads and stores is
/// model-checked.
///
/// [`split`](Self::split) returns the two ends, once. If the cell is `'static`, they may be moved to where they are used,
/// including an interrupt: take the cell from `cortex_m::singleton!` or a `StaticCell`, and hand one end to the interrupt before
/// it is enabled, for example as a local resource of RTIC or a `static mut` of a `cortex-m-rt` handler.
///
/// ```
/// use servowire_core::{Cell, Feedback, Policy, Words};
/// # #[derive(Clone, Copy)]
/// # struct Evidence { count: u32, sampled_ns: Option<u64> }
/// # #[derive(Debug, Clone, Copy, PartialEq)]
/// # enum Doubt { Never, Old { age_ns: u64 } }
/// # impl Feedback for Evidence {
/// #     type Tolerated = ();
/// #     type Sample = u32;
/// #     type Doubt = Doubt;
/// #     const NEVER: Self = Self { count: 0, sampled_ns: None };
/// #     fn at(&self, now_ns: u64, policy: Policy<()>) -> Result<u32, Doubt> {
/// #         let sampled_ns = self.sampled_ns.ok_or(Doubt::Never)?;
/// #         policy.check_age(now_ns, sampled_ns).map_err(|age_ns| Doubt::Old { age_ns })?;
/// #         Ok(self.count)
/// #     }
/// # }
/// // The evidence of the example of `Feedback`; an instant of 0 stands for none.
/// impl Words<3> for Evidence {
///     fn to_words(&self) -> [u32; 3] {
///         let sampled_ns = self.sampled_ns.unwrap_or(0);
///         [self.count, sampled_ns as u32, (sampled_ns >> 32) as u32]
///     }
///
///     fn from_words([count, low, high]: [u32; 3]) -> Self {
///         let sampled_ns = u64::from(high) << 32 | u64::from(low);
///         Self { count, sampled_ns: (sampled_ns != 0).then_some(sampled_ns) }
///     }
/// }
///
/// let mut cell = Cell::<Evidence, 3>::new();
/// let (mut writer, mut reader) = cell.split();
/// let policy = Policy::new(125_000);
/// assert_eq!(reader.at(1_040_000, policy), Err(Doubt::Never));
/// // where answers are received
/// writer.put(Evidence { count: 4711, sampled_ns: Some(1_000_000) });
/// // where the current is controlled
/// assert_eq!(reader.at(1_040_000, policy), Ok(4711));
/// // and when answers fail to come
/// assert_eq!(reader.at(1_200_000, policy), Err(Doubt::Old { age_ns: 200_000 }));
/// ```
pub struct Cell<F, const W: usize> {
    slots: FourSlots<W, 0>,
    evidence: PhantomData<F>,
}

impl<F: Feedback + Words<W>, const W: usize> Cell<F, W> {
    /// Creates a cell that holds [`Feedback::NEVER`].
    pub const fn new() -> Self {
        Self { slots: FourSlots::new(), evidence: PhantomData }
    }

    /// Returns the two ends. The cell keeps its contents.
    pub const fn split(&mut self) -> (Writer<'_, F, W>, Reader<'_, F, W>) {
        let slots = &self.slots;
        (Writer { slots, evidence: PhantomData }, Reader { slots, evidence: PhantomData })
    }
}

impl<F: Feedback + Words<W>, const W: usize> Default for Cell<F, W> {
    fn default() -> Self {
        Self::new()
    }
}

/// The end of a [`Cell`] where evidence is received.
pub struct Writer<'a, F, const W: usize> {
    slots: &'a FourSlots<W, 0>,
    evidence: PhantomData<F>,
}

impl<F: Feedback + Words<W>, const W: usize> Writer<'_, F, W> {
    /// Stores the newest evidence, replacing all earlier evidence.
    pub fn put(&mut self, evidence: F) {
        self.slots.put(&(evidence.to_words(), []));
    }
}

/// The end of a [`Cell`] where evidence is used.
pub struct Reader<'a, F, const W: usize> {
    slots: &'a FourSlots<W, 0>,
    evidence: PhantomData<F>,
}

impl<F: Feedback + Words<W>, const W: usize> Reader<'_, F, W> {
    /// Returns the value of the newest evidence, if it may be used at this time.
    ///
    /// # Errors
    /// The reason why it must not be used.
    #[inline]
    pub fn at(&mut self, now_ns: u64, policy: Policy<F::Tolerated>) -> Result<F::Sample, F::Doubt> {
        self.latest().at(now_ns, policy)
    }

    /// Returns the newest evidence, unjudged.
    #[inline]
    fn latest(&mut self) -> F {
        self.slots.get().map_or(F::NEVER, |(words, [])| F::from_words(words))
    }
}

#[cfg(test)]
mod tests {
    use std::thread;

    use super::*;

    /// Evidence whose five words all follow from one number; 0 is never put.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    struct Number(u32);

    impl Words<5> for Number {
        fn to_words(&self) -> [u32; 5] {
            [0, 1, 2, 3, 4].map(|k| self.0.wrapping_mul(0x9e37_79b1).rotate_left(k * 5) ^ k)
        }

        fn from_words(words: [u32; 5]) -> Self {
            let number = Self(words[0].wrapping_mul(0x0e8b_2f51));
            assert_eq!(number.to_words(), words, "torn");
            number
        }
    }

    impl Feedback for Number {
        type Tolerated = ();
        type Sample = u32;
        type Doubt = u64;
        const NEVER: Self = Self(0);

        /// The number is its instant.
        fn at(&self, now_ns: u64, policy: Policy<()>) -> Result<u32, u64> {
            policy.check_age(now_ns, self.0.into()).map(|()| self.0)
        }
    }

    #[test]
    fn evidence_is_judged_when_it_is_read() {
        let mut cell = Cell::<Number, 5>::default();
        let (mut writer, mut reader) = cell.split();
        let policy = Policy::new(100);
        assert_eq!((reader.latest(), reader.at(1_000, policy)), (Number(0), Err(1_000)));
        writer.put(Number(950));
        assert_eq!([1_000, 1_050, 1_051].map(|now| reader.at(now, policy)), [Ok(950), Ok(950), Err(101)]);
        // Split anew, it holds what it held.
        let (_, mut reader) = cell.split();
        assert_eq!(reader.latest(), Number(950));
    }

    /// Any sequence of whole puts and readings: the newest value is read.
    #[test]
    fn what_was_put_last_is_read() {
        let steps = if cfg!(miri) { 4 } else { 14 };
        for pattern in 0_u32..1 << steps {
            let mut cell = Cell::<Number, 5>::new();
            let (mut writer, mut reader) = cell.split();
            let mut last = 0;
            for step in 0..steps {
                if pattern >> step & 1 == 1 {
                    last = step + 1;
                    writer.put(Number(last));
                } else {
                    assert_eq!(reader.latest(), Number(last), "{pattern:#b} step {step}");
                }
            }
        }
    }

    #[test]
    fn between_two_threads() {
        let puts = if cfg!(miri) { 50 } else { 1_000_000 };
        let mut cell = Cell::<Number, 5>::new();
        let (mut writer, mut reader) = cell.split();
        thread::scope(|scope| {
            scope.spawn(move || (1..=puts).for_each(|n| writer.put(Number(n))));
            let mut newest = 0;
            while newest < puts {
                let Number(n) = reader.latest();
                assert!(n >= newest, "{n} after {newest}");
                newest = n;
            }
        });
    }
}
