use super::{ClockError, TickRate};

/// Derives the time from a counter of `BITS` bits that wraps: 32 for a cycle counter or a 32-bit timer, 24 for the SysTick, 16
/// for a small timer; 8 to 32 are possible.
///
/// ```
/// use servowire_core::{ClockError, TickRate, TimeBase};
///
/// // the cycle counter of a processor at 170 MHz, which stands at 4,294,967,000 now
/// let mut time = TimeBase::<32>::new(TickRate::of::<170_000_000>(), 4_294_967_000);
/// assert_eq!(time.now_ns(4_294_967_170), Ok(1_000));
/// assert_eq!(time.now_ns(44), Ok(2_000)); // it has wrapped
/// assert_eq!(time.read_within_ns(), 12_632_256_747); // 12.6 s
/// assert!(matches!(time.now_ns(27), Err(ClockError::Backwards { by_ns: 100 })));
/// assert_eq!(time.now_ns(197), Ok(3_000)); // time goes on from where it was
/// ```
///
/// The time is 0 at the start and never goes back. Its error is less than 1 ns plus the rounding of its [`TickRate`], however
/// long it runs. No error accumulates, because the ticks themselves are counted.
///
/// A counter that counts down (SysTick) is read inverted: `!SYST::get_current()`. Bits above `BITS` are ignored.
///
/// **The counter has to be read within half of its range** ([`read_within_ns`](Self::read_within_ns)). A larger step forward
/// cannot be told from a step back. [`ClockError::Backwards`] reports both: a counter that was reset or set back, and one
/// that was not read for too long. Two faults are not detected: a reset of a counter that was beyond the middle of its
/// range, which looks like a wrap, and whole wraps between two readings.
///
/// If several priorities read one time base, read the counter and call [`now_ns`](Self::now_ns) in one critical section: a
/// reading older than the last one looks like a clock that went back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TimeBase<const BITS: u32> {
    /// The time when `ticks` was 0, modulo 2^64.
    base_ns: u64,
    /// The ticks at the last reading; their low bits are the counter.
    ticks: u32,
    rate: TickRate,
}

impl<const BITS: u32> TimeBase<BITS> {
    /// Bits of a word above those of the counter.
    const ABOVE: u32 = {
        assert!(BITS >= 8 && BITS <= 32, "a counter has 8 to 32 bits");
        32_u32.wrapping_sub(BITS)
    };

    /// Starts at 0 ns with a counter that counts at this rate and reads `counter` now.
    pub const fn new(rate: TickRate, counter: u32) -> Self {
        let mut time = Self { base_ns: 0, ticks: 0, rate };
        time.go_on(counter, 0);
        time
    }

    /// Returns the time since the start, in ns, from a reading of the counter. It wraps after 584 years.
    ///
    /// # Errors
    /// [`ClockError::Backwards`], once: the next reading continues from this one, at the time of the last good one.
    #[inline]
    pub const fn now_ns(&mut self, counter: u32) -> Result<u64, ClockError> {
        let past = counter.wrapping_sub(self.ticks) << Self::ABOVE;
        if past >= 1 << 31 {
            return Err(self.set_back(counter));
        }
        let ticks = self.ticks.wrapping_add(past >> Self::ABOVE);
        if ticks < self.ticks {
            self.wrap();
        }
        self.ticks = ticks;
        Ok(self.last_ns())
    }

    /// The longest time between two readings of the counter, ns.
    pub const fn read_within_ns(&self) -> u64 {
        self.rate.low_ns(u32::MAX >> Self::ABOVE >> 1)
    }

    /// How fast the counter counts.
    pub const fn rate(&self) -> TickRate {
        self.rate
    }

    /// The time of the last reading.
    #[inline]
    const fn last_ns(&self) -> u64 {
        self.base_ns.wrapping_add(self.rate.low_ns(self.ticks))
    }

    /// Sets the time to `now_ns` at this counter reading.
    const fn go_on(&mut self, counter: u32, now_ns: u64) {
        self.ticks = counter << Self::ABOVE >> Self::ABOVE;
        self.base_ns = now_ns.wrapping_sub(self.rate.low_ns(self.ticks));
    }

    /// It is kept out of line, because it is rare, and its operands would occupy registers of a Cortex-M0+ in every reading.
    #[cold]
    #[inline(never)]
    const fn wrap(&mut self) {
        self.base_ns = self.base_ns.wrapping_add(self.rate.turn_ns());
    }

    #[cold]
    #[inline(never)]
    const fn set_back(&mut self, counter: u32) -> ClockError {
        let by = self.ticks.wrapping_sub(counter) << Self::ABOVE >> Self::ABOVE;
        self.go_on(counter, self.last_ns());
        ClockError::Backwards { by_ns: self.rate.low_ns(by) }
    }
}
