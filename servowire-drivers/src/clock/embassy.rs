use embassy_time::{Duration, Instant, TICK_HZ};
use servowire_core::{ClockError, TickRate};

use super::{Clock, Timer};

/// The clock of embassy-time. Choose a time driver of 1 MHz or more; with a slower one this does not compile.
#[derive(Debug, Clone, Copy, Default)]
pub struct EmbassyClock;

#[expect(clippy::cast_possible_truncation, reason = "it is looked at first, when the program is compiled")]
const RATE: TickRate = {
    assert!(TICK_HZ <= u32::MAX as u64, "a time driver beyond 4.29 GHz");
    TickRate::of::<{ TICK_HZ as u32 }>()
};

impl Clock for EmbassyClock {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        Ok(RATE.ns(Instant::now().as_ticks()))
    }
}

impl Timer for EmbassyClock {
    async fn wait_ns(&mut self, ns: u64) {
        // A tick later rather than earlier; what is too long for the product is waited for in pieces.
        let ticks = ns.saturating_mul(TICK_HZ).div_ceil(1_000_000_000);
        embassy_time::Timer::after(Duration::from_ticks(ticks)).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::future::Future;
    use core::pin::pin;
    use core::task::{Context, Waker};
    use embassy_time::MockDriver;

    /// Ticks of 1 us.
    #[test]
    fn a_wait_ends_with_the_tick_after_its_time() {
        assert_eq!(TICK_HZ, 1_000_000);
        MockDriver::get().advance(Duration::from_ticks(7));
        assert_eq!(EmbassyClock.now_ns(), Ok(7_000));
        let mut clock = EmbassyClock;
        let mut wait = pin!(clock.wait_ns(2_001));
        let mut context = Context::from_waker(Waker::noop());
        for _ in 7..10 {
            assert!(wait.as_mut().poll(&mut context).is_pending());
            MockDriver::get().advance(Duration::from_ticks(1));
        }
        assert!(wait.as_mut().poll(&mut context).is_ready());
        assert_eq!(EmbassyClock.now_ns(), Ok(10_000));
    }
}
