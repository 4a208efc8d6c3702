//! The start-up arithmetic of sync mode of the Motor Control SDK, which nobody but its vectors uses.

use hdsl::Error;
use hdsl::frame::{Extra, H_FRAME_BITS, Stuffing};
use hdsl::sync::{Es, ExtraWindow};

/// Bits of a frame with the shortest window, 4 bits.
const SHORTEST: u32 = H_FRAME_BITS + 4;

/// The start state from the vendor's register values: EXTRA_SIZE is the number of bits less one here, also when TIME_REST is 0.
pub(super) fn of_registers(extra_size: u8, time_rest: u8, stuffing: Stuffing, window: i16) -> Option<ExtraWindow> {
    let t = if time_rest == 0 { 8 } else { time_rest };
    Extra::new(extra_size.checked_mul(8)?.checked_add(t)?).map(|edge| ExtraWindow::new(edge, stuffing, window))
}

/// The clock of the vendor's core.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum CoreClock {
    /// 225 MHz: 24 cycles a bit, 3 an eighth.
    Mhz225,
    /// 300 MHz: 32 cycles a bit, 4 an eighth.
    Mhz300,
}

impl CoreClock {
    /// Cycles an eighth of a bit.
    pub(super) const fn cycles_per_eighth(self) -> u32 {
        match self {
            Self::Mhz225 => 3,
            Self::Mhz300 => 4,
        }
    }
}

/// What the start-up arithmetic of the Motor Control SDK makes of a pulse period.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Startup {
    /// Whole bits of the EXTRA window in every frame.
    pub(super) extra_size: u32,
    /// Frames of a pulse group whose window has one bit more.
    pub(super) extra_remainder: u32,
    /// Stuffing blocks in every frame.
    pub(super) stuffing: u32,
    /// Frames of a pulse group with one block more.
    pub(super) stuffing_remainder: u32,
    /// TIME_REST: eighths that are left, 0..=7.
    pub(super) time_rest: u8,
    /// EXTRA_EDGE for TIME_REST.
    pub(super) extra_edge: u8,
    /// Cycles of the period that the frames fill.
    pub(super) cycles_used: u32,
    /// Cycles that are less than an eighth; the correction by the measured time takes care of them.
    pub(super) cycles_dropped: u32,
}

impl Startup {
    /// Divides a pulse period, in cycles of the core, into `es` frames.
    ///
    /// # Errors
    /// [`Error::PeriodTooShort`].
    pub(super) fn new(period: u32, clock: CoreClock, es: Es) -> Result<Self, Error> {
        let eighth = clock.cycles_per_eighth();
        let bit = eighth * 8;
        let es = u32::from(es.get()).max(1);
        let shortest = SHORTEST * es * bit;
        let Some(left) = period.checked_sub(shortest) else {
            return Err(Error::PeriodTooShort { missing: (shortest - period).div_ceil(bit) });
        };
        let rest = left % bit / eighth;
        let add = left / bit;
        let mut stuffing = add / 6;
        let mut extra = add % 6 + 4 * es;
        let most = u32::from(Stuffing::MAX.get()) * es;
        if stuffing > most {
            extra = extra.saturating_add((stuffing - most).saturating_mul(6));
            stuffing = most;
        }
        let time_rest = rest.to_le_bytes()[0];
        let cycles_dropped = left % bit % eighth;
        Ok(Self {
            extra_size: extra / es,
            extra_remainder: extra % es,
            stuffing: stuffing / es,
            stuffing_remainder: stuffing % es,
            time_rest,
            extra_edge: 0xff_u8.checked_shr(time_rest.into()).map_or(0xff, |zeros| !zeros),
            cycles_used: period - cycles_dropped,
            cycles_dropped,
        })
    }

    /// Refuses a period that the frames cannot fill.
    ///
    /// # Errors
    /// [`Error::ExtraOutOfRange`] unless the window has 4..=9 bits.
    pub(super) const fn check(&self) -> Result<(), Error> {
        if self.extra_size >= 4 && self.extra_size <= 9 {
            Ok(())
        } else {
            Err(Error::ExtraOutOfRange { extra: self.extra_size })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same period gives the same frames at both clocks (release note 5537 of the SDK).
    #[test]
    fn both_clocks() {
        for es in [1, 2, 5, 10] {
            // A third of a microsecond is 75 cycles of the one and 100 of the other.
            for thirds in 36 * u32::from(es)..=81 * u32::from(es) {
                let es = Es::new(es).expect("1 to 10");
                let slow = Startup::new(thirds * 75, CoreClock::Mhz225, es);
                let fast = Startup::new(thirds * 100, CoreClock::Mhz300, es);
                let frames =
                    |s: Startup| (s.extra_size, s.extra_remainder, s.stuffing, s.stuffing_remainder, s.time_rest);
                assert_eq!(slow.map(frames), fast.map(frames));
            }
        }
    }
}
