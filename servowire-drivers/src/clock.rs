#[cfg(feature = "embassy-time")]
pub(crate) mod embassy;
#[cfg(feature = "fugit")]
pub(crate) mod fugit;

use servowire_core::{ClockError, TickRate, TimeBase};

/// The number of looks after which a clock counts as stopped: some 30 ms on a fast processor, 0.3 s on a slow one. Within a
/// tick of 1 us a processor makes a hundred looks, but the timer of an emulator can stand still for thousands of them while
/// its host is busy.
#[cfg(any(feature = "nikon", feature = "rtex", feature = "tformat"))]
pub(crate) const MAX_LOOKS: u32 = 200_000;

/// A free-running clock.
///
/// Its tick has to be 1 us or shorter, preferably a fraction of that, because an encoder answers 3 us after its request. A
/// [`CounterClock`] over a cycle counter or a timer is a clock, and so is every closure that returns nanoseconds.
///
/// The drivers check every reading: a clock that goes backwards, jumps ahead by more than a second within a call, or returns
/// the same reading 200,000 times ends the call with [`Error::Clock`](crate::Error::Clock).
pub trait Clock {
    /// Returns the time in nanoseconds from any origin; it never goes backwards.
    ///
    /// # Errors
    /// A fault that the clock itself has detected.
    fn now_ns(&mut self) -> Result<u64, ClockError>;
}

impl<F: FnMut() -> u64> Clock for F {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        Ok(self())
    }
}

/// A clock over a counter of `BITS` bits that wraps, extended by a [`TimeBase`]. A closure reads the counter, and the next
/// reading has to follow within half of its range.
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
    /// Creates the clock; its time is now 0.
    pub fn new(rate: TickRate, mut counter: F) -> Self {
        let time = TimeBase::new(rate, counter());
        Self { counter, time }
    }
}

impl<F, const BITS: u32> CounterClock<F, BITS> {
    /// The time in ns within which the clock has to be read again; a driver that is not called for longer returns
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
    /// Waits for this many ns; it should end late rather than early. The driver then reads the clock: a wait that ended too early
    /// is followed by another, and a clock that does not advance ends the call.
    async fn wait_ns(&mut self, ns: u64);
}

/// A clock, and a delay for waiting.
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
