/// Determines when a readout that is repeated at a fixed period is due (continuous mode).
///
/// The time grid is fixed: a late start does not shift the following ones, and missed starts are counted but not made up for.
///
/// ```
/// use nikon_aformat::master::{Cycle, Line};
/// use nikon_aformat::{BitRate, EncoderAddress, Operation, Resolution, Request};
///
/// let line = Line::new(BitRate::Mbit16).with_response_timeout_ns(10_000);
/// let request = Request::new(EncoderAddress::MAX, Operation::Abs40Mt);
/// let min_ns = line.min_cycle_ns(request, &request.expected(Resolution::default()));
/// assert!(Cycle::new(min_ns - 1, min_ns, 0).is_err());
///
/// let mut cycle = Cycle::new(125_000, min_ns, 1_000)?;
/// assert!(cycle.is_due(1_000));
/// assert_eq!(cycle.next_ns(), 126_000);
/// assert!(!cycle.is_due(125_999));
/// assert!(cycle.is_due(400_000)); // two starts were missed
/// assert_eq!((cycle.missed(), cycle.next_ns()), (2, 501_000));
/// # Ok::<(), nikon_aformat::master::PeriodTooShort>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Cycle {
    period_ns: u32,
    next_ns: u64,
    missed: u32,
}

/// The period is too short for the transaction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[error("a period of {period_ns} ns is too short: the transaction needs {min_ns} ns")]
pub struct PeriodTooShort {
    /// Requested period, in ns.
    pub period_ns: u32,
    /// Shortest possible period, in ns.
    pub min_ns: u32,
}

impl Cycle {
    /// Starts at `first_ns` and then every `period_ns`; `min_ns` is the shortest possible period, from
    /// [`Line::min_cycle_ns`](super::Line::min_cycle_ns).
    ///
    /// # Errors
    /// [`PeriodTooShort`].
    pub const fn new(period_ns: u32, min_ns: u32, first_ns: u64) -> Result<Self, PeriodTooShort> {
        if period_ns < min_ns || period_ns == 0 {
            return Err(PeriodTooShort { period_ns, min_ns });
        }
        Ok(Self { period_ns, next_ns: first_ns, missed: 0 })
    }

    /// Returns whether a start is due at `now_ns`; if so, the next one is a period later.
    #[must_use]
    pub fn is_due(&mut self, now_ns: u64) -> bool {
        let Some(late) = now_ns.checked_sub(self.next_ns) else { return false };
        let period = u64::from(self.period_ns);
        let missed = late.checked_div(period).unwrap_or(0);
        self.missed = self.missed.saturating_add(u32::try_from(missed).unwrap_or(u32::MAX));
        self.next_ns = self.next_ns.saturating_add(period.saturating_mul(missed.saturating_add(1)));
        true
    }

    /// When the next start is due.
    pub const fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// Number of starts missed so far.
    pub const fn missed(&self) -> u32 {
        self.missed
    }
}
