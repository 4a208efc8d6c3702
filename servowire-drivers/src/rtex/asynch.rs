//! The exchange as a future, which waits for the interrupt while watching the clock.

use embedded_hal_async::digital::Wait;

use super::{Driver, Exchanged, Failure, Port};
use crate::Timer;
use crate::race::{race, sleep};

/// How the period of an exchange began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Began {
    /// It began with the interrupt.
    Edge,
    /// It began by the clock, because the edge did not come: it was lost, or the ASIC has stopped, which the echo watch
    /// notices.
    Clock,
}

/// The period that was awaited.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Period {
    /// How the period began.
    pub began: Began,
    /// How the exchange of the period went.
    pub exchanged: Exchanged,
}

impl<P: Port, T: Timer, const N: usize> Driver<'_, P, T, N> {
    /// Waits for the next falling edge of `sync` (XSYNC, or the pin of the external timer), for one and a half update periods at
    /// most, then performs the exchange. The future may be dropped while it waits; the exchange itself is one step. An edge that
    /// comes while no future waits for it is missed, and the commands of that period are sent once more.
    ///
    /// # Errors
    /// [`Error::Io`](crate::Error::Io) and [`Error::Clock`](crate::Error::Clock); the next exchange continues. A fault reported
    /// by the pin counts as a lost edge.
    pub async fn next(&mut self, sync: &mut impl Wait) -> Result<Period, Failure<P>> {
        let update_ns = u64::from(self.master().config().periods.update_ns);
        let until_ns = self.now_ns()?.saturating_add(update_ns.saturating_mul(3) >> 1);
        let look = |clock: &mut T| self.check.check(clock.now_ns()?);
        let edge = race(sync.wait_for_falling_edge(), sleep(&mut self.clock, look, until_ns)).await?;
        let began = match edge {
            Some(Ok(())) => Began::Edge,
            Some(Err(_)) => {
                sleep(&mut self.clock, |clock| self.check.check(clock.now_ns()?), until_ns).await?;
                Began::Clock
            }
            None => Began::Clock,
        };
        let now_ns = self.now_ns()?;
        let began_ns = self.began_ns(now_ns, began);
        self.exchange(began_ns).map(|exchanged| Period { began, exchanged })
    }

    /// Returns when the period began that contains `now_ns`. An executor wakes late, and a lost edge is noticed half a period
    /// late. So the start is derived from the grid of the previous periods; the two clocks may differ by 1/4096. If in doubt,
    /// the result is too early rather than too late, because the bank is switched at the end of the period. An edge that is
    /// noticed more than half a period late is mistaken for the next one.
    fn began_ns(&self, now_ns: u64, began: Began) -> u64 {
        let update_ns = u64::from(self.master().config().periods.update_ns);
        let past_ns = now_ns.saturating_sub(self.began_ns.unwrap_or(now_ns));
        let periods = past_ns.checked_div(update_ns).unwrap_or(0);
        let phase_ns = past_ns.saturating_sub(periods.saturating_mul(update_ns));
        let drift_ns = periods.saturating_add(1).saturating_mul(update_ns >> 12);
        // An edge in the second half of a period is a new one that is early on the grid, and the grid follows.
        let is_new = began == Began::Edge && phase_ns > update_ns >> 1;
        let late_ns = if is_new { 0 } else { phase_ns.saturating_sub(drift_ns) };
        now_ns.saturating_sub(late_ns)
    }
}
