use fugit::Instant;
use servowire_core::{ClockError, TickRate, TimeBase};

use super::Clock;

/// A clock based on 64-bit instants of `fugit`, such as those of an RTIC monotonic. A clock whose tick is longer than 1 us does
/// not compile.
///
/// ```
/// use fugit::TimerInstantU64;
/// use servowire_drivers::{Clock, FugitClock};
///
/// let mut clock = FugitClock(|| TimerInstantU64::<16_000_000>::from_ticks(100));
/// assert_eq!(clock.now_ns(), Ok(6_250));
/// ```
///
/// ```compile_fail
/// # use servowire_drivers::{Clock, FugitClock};
/// let mut clock = FugitClock(|| fugit::TimerInstantU64::<32_768>::from_ticks(100));
/// let _ = clock.now_ns();
/// ```
#[derive(Debug, Clone, Copy)]
pub struct FugitClock<F>(pub F);

impl<F: FnMut() -> Instant<u64, NOM, DENOM>, const NOM: u32, const DENOM: u32> Clock for FugitClock<F> {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        Ok(const { TickRate::of_ratio::<NOM, DENOM>() }.ns((self.0)().ticks()))
    }
}

/// The same for 32-bit instants, which wrap: the next reading has to follow within half of their range.
///
/// ```
/// use fugit::TimerInstantU32;
/// use servowire_drivers::{Clock, FugitClock32};
///
/// # let mut ticks = 0xffff_ff00_u32;
/// # let mut now = || { ticks = ticks.wrapping_add(160); TimerInstantU32::<16_000_000>::from_ticks(ticks) };
/// let mut clock = FugitClock32::new(|| now());
/// assert_eq!([clock.now_ns(), clock.now_ns()], [Ok(10_000), Ok(20_000)]);
/// ```
#[derive(Debug, Clone, Copy)]
pub struct FugitClock32<F> {
    now: F,
    time: TimeBase<32>,
}

impl<F> FugitClock32<F> {
    /// Creates the clock; its time is now 0.
    pub fn new<const NOM: u32, const DENOM: u32>(mut now: F) -> Self
    where
        F: FnMut() -> Instant<u32, NOM, DENOM>,
    {
        let time = TimeBase::new(TickRate::of_ratio::<NOM, DENOM>(), now().ticks());
        Self { now, time }
    }
}

impl<F: FnMut() -> Instant<u32, NOM, DENOM>, const NOM: u32, const DENOM: u32> Clock for FugitClock32<F> {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.time.now_ns((self.now)().ticks())
    }
}
