#[cfg(feature = "embassy-time")]
pub(crate) mod embassy;
#[cfg(feature = "fugit")]
pub(crate) mod fugit;

use servowire_core::{ClockError, TickRate, TimeBase};

/// Looks at a clock that stands: some 30 ms of a fast processor, 0.3 s of a slow one. In a tick of 1 us it makes a hundred, but the
/// timer of an emulator can stand for thousands while its host is busy.
#[cfg(any(feature = "nikon", feature = "rtex", feature = "tformat"))]
pub(crate) const MAX_LOOKS: u32 = 200_000;

/// A free-running clock.
///
/// Its tick has to be 1 us or shorter, better a fraction of that: an encoder answers 3 us after its request. A [`CounterClock`] is
/// one, made of a cycle counter or a timer, and so is every closure that gives nanoseconds.
///
/// The drivers look twice: a clock that goes back, is ahead by more than a second within a call, or gives the same reading 200,000 times,
/// ends the call with [`Error::Clock`](crate::Error::Clock).
pub trait Clock {
    /// Nanoseconds from any origin; never backwards.
    ///
    /// # Errors
    /// What the clock itself has noticed.
    fn now_ns(&mut self) -> Result<u64, ClockError>;
}

impl<F: FnMut() -> u64> Clock for F {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        Ok(self())
    }
}

/// A clock made of a counter of `BITS` bits that wraps, by a [`TimeBase`]: a closure reads it, and the next reading has to come
/// within half of its range.
///
/// ```
/// use servowire_drivers::{Clock, CounterClock, TickRate};
///
/// # let mut cycles = 0_u32;
/// # let mut cycle_count = || { cycles += 170; cycles };
/// // a cycle counter at 170 MHz; one that counts down is read inverted, and a SysTick has 24 bits
/// let mut clock = CounterClock::<_, 32>::new(TickRate::of::<170_000_000>(), || cycle_count());
/// assert_eq!(clock.now_ns(), Ok(1_000));
/// ```
#[derive(Debug, Clone, Copy)]
pub struct CounterClock<F, const BITS: u32> {
    counter: F,
    time: TimeBase<BITS>,
}

impl<F: FnMut() -> u32, const BITS: u32> CounterClock<F, BITS> {
    /// Its time is 0 now.
    pub fn new(rate: TickRate, mut counter: F) -> Self {
        let time = TimeBase::new(rate, counter());
        Self { counter, time }
    }
}

impl<F, const BITS: u32> CounterClock<F, BITS> {
    /// The clock has to be read again within this many ns; a driver that is not called for longer returns
    /// [`ClockError::Backwards`].
    pub const fn read_within_ns(&self) -> u64 {
        self.time.read_within_ns()
    }
}

impl<F: FnMut() -> u32, const BITS: u32> Clock for CounterClock<F, BITS> {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.time.now_ns((self.counter)())
    }
}

/// A clock that can be waited for.
#[cfg(feature = "async")]
#[allow(async_fn_in_trait, reason = "drivers are used by one executor; Send is left to the implementation")]
pub trait Timer: Clock {
    /// Ends after this many ns, better later than earlier. What it is then the driver asks the clock: a wait that ends too early is
    /// followed by another, and a clock that does not go on ends the call.
    async fn wait_ns(&mut self, ns: u64);
}

/// A clock, and a delay to wait with.
#[cfg(feature = "async")]
#[derive(Debug, Clone, Copy)]
pub struct WithDelay<C, D> {
    /// The clock.
    pub clock: C,
    /// The delay.
    pub delay: D,
}

#[cfg(feature = "async")]
impl<C: Clock, D> Clock for WithDelay<C, D> {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.clock.now_ns()
    }
}

#[cfg(feature = "async")]
impl<C: Clock, D: embedded_hal_async::delay::DelayNs> Timer for WithDelay<C, D> {
    async fn wait_ns(&mut self, ns: u64) {
        self.delay.delay_ns(u32::try_from(ns).unwrap_or(u32::MAX)).await;
    }
}
