/// A free-running clock.
///
/// It has to resolve a fraction of a microsecond: an encoder answers 3 us after its request. A cycle counter or a timer that
/// runs with the system clock will do; every closure that gives nanoseconds is a clock.
pub trait Clock {
    /// Nanoseconds from any origin; never backwards. A timer of 32 bits has to be made longer before it wraps: a clock that was set
    /// back keeps the next call waiting until it has caught up.
    fn now_ns(&mut self) -> u64;
}

impl<F: FnMut() -> u64> Clock for F {
    fn now_ns(&mut self) -> u64 {
        self()
    }
}

/// A clock that can be waited for.
#[cfg(feature = "async")]
#[allow(async_fn_in_trait, reason = "drivers are used by one executor; Send is left to the implementation")]
pub trait Timer: Clock {
    /// Ends at `ns`, or at once if that is past.
    async fn wait_until(&mut self, ns: u64);
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
    fn now_ns(&mut self) -> u64 {
        self.clock.now_ns()
    }
}

#[cfg(feature = "async")]
impl<C: Clock, D: embedded_hal_async::delay::DelayNs> Timer for WithDelay<C, D> {
    async fn wait_until(&mut self, ns: u64) {
        loop {
            let left_ns = ns.saturating_sub(self.clock.now_ns());
            if left_ns == 0 {
                return;
            }
            self.delay.delay_ns(u32::try_from(left_ns).unwrap_or(u32::MAX)).await;
        }
    }
}

/// The clock of embassy-time. Its tick is 1 us by default and may be 31 us: choose a time driver with 1 MHz or more.
#[cfg(feature = "embassy-time")]
#[derive(Debug, Clone, Copy, Default)]
pub struct EmbassyClock;

#[cfg(feature = "embassy-time")]
impl Clock for EmbassyClock {
    fn now_ns(&mut self) -> u64 {
        let ticks = u128::from(embassy_time::Instant::now().as_ticks());
        let ns = ticks.saturating_mul(1_000_000_000).checked_div(embassy_time::TICK_HZ.into()).unwrap_or(0);
        u64::try_from(ns).unwrap_or(u64::MAX)
    }
}

#[cfg(feature = "embassy-time")]
impl Timer for EmbassyClock {
    async fn wait_until(&mut self, ns: u64) {
        // A tick later rather than earlier.
        let ticks = u128::from(ns).saturating_mul(embassy_time::TICK_HZ.into()).div_ceil(1_000_000_000);
        let ticks = u64::try_from(ticks).unwrap_or(u64::MAX);
        embassy_time::Timer::at(embassy_time::Instant::from_ticks(ticks)).await;
    }
}
