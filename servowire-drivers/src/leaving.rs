//! Tracks when the last bit of a request leaves, as exactly as software can know it; without I/O.

use crate::Worst;

/// The earliest and the latest end of the fields handed to a UART so far. A closer estimate is impossible, because it is not
/// known how long the processor was elsewhere before the UART took a byte, nor how long the UART then waited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Leaving {
    worst: Worst,
    field_ns: u64,
    /// Time from the end of the request to the earliest answer.
    window_ns: u64,
    ends: Option<Ends>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Ends {
    earliest_ns: u64,
    latest_ns: u64,
}

impl Leaving {
    pub(crate) fn new(worst: Worst, field_ns: u32, window_ns: u32) -> Self {
        Self { worst, field_ns: field_ns.into(), window_ns: window_ns.into(), ends: None }
    }

    /// Notes that a `write`, which had begun by the reading `before_ns` and ended by `after_ns`, has taken this many fields.
    ///
    /// The first `write` is given no more than one field. It need not wait, so all the time it took may have passed before the
    /// UART had the field; without this assumption, the last bit of a one-field request could be cut off. A later `write` that
    /// took a field time or more has waited for room.
    pub(crate) fn taken(&mut self, fields: usize, before_ns: u64, after_ns: u64) {
        let fields_ns = self.field_ns.saturating_mul(fields as u64);
        let waited = self.ends.is_some() && after_ns.saturating_sub(before_ns) >= self.field_ns;
        let had_ns = if waited { before_ns } else { after_ns };
        let begun_ns =
            had_ns.saturating_add(self.worst.clock_ns.into()).saturating_add(self.worst.uart_start_ns.into());
        let ends = self.ends.unwrap_or(Ends { earliest_ns: 0, latest_ns: 0 });
        self.ends = Some(Ends {
            earliest_ns: ends.earliest_ns.max(before_ns).saturating_add(fields_ns),
            latest_ns: ends.latest_ns.max(begun_ns).saturating_add(fields_ns),
        });
    }

    /// The reading at which to switch the driver off: in the middle of the time in which it is neither too early nor too late
    /// or, if there is no such time, rather too late than too early.
    pub(crate) fn off_ns(&self) -> Option<u64> {
        let Ends { earliest_ns, latest_ns } = self.ends?;
        let slack_ns = u64::from(self.worst.wake_ns).saturating_add(self.worst.clock_ns.into());
        let last_ns = earliest_ns.saturating_add(self.window_ns).saturating_sub(slack_ns);
        Some(latest_ns.saturating_add(last_ns.saturating_sub(latest_ns) >> 1))
    }

    /// See [`longest_ns`].
    pub(crate) const fn longest_ns(&self) -> u64 {
        longest_ns(self.field_ns, self.window_ns)
    }

    /// Returns whether enough time has passed for an answer to have begun.
    pub(crate) const fn is_late(&self, before_ns: u64, after_ns: u64) -> bool {
        after_ns.saturating_sub(before_ns) > self.window_ns
    }

    /// Returns how much too late the driver may have been switched off, if it was off by the reading `now_ns`.
    pub(crate) fn late_ns(&self, now_ns: u64) -> u64 {
        let latest_ns = self.ends.map_or(u64::MAX, |ends| ends.earliest_ns.saturating_add(self.window_ns));
        now_ns.saturating_add(self.worst.clock_ns.into()).saturating_sub(latest_ns)
    }
}

/// A time longer than a whole request needs to leave, plus the longest time for which the driver may stay on after it.
pub(crate) const fn longest_ns(field_ns: u64, window_ns: u64) -> u64 {
    field_ns.saturating_mul(4).saturating_add(window_ns.saturating_mul(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WORST: Worst = Worst { uart_start_ns: 300, wake_ns: 500, clock_ns: 100 };

    fn leaving() -> Leaving {
        Leaving::new(WORST, 4_000, 1_600)
    }

    /// Handed over between 10.0 and 10.05 us: the field ends between 14.0 and 14.45 us, and an answer begins at 15.6 us. The pin needs
    /// 0.6 us, so it is told between 14.45 and 15.0 us.
    #[test]
    fn one_field() {
        let mut leaving = leaving();
        assert_eq!((leaving.off_ns(), leaving.late_ns(u64::MAX)), (None, 0));
        leaving.taken(1, 10_000, 10_050);
        assert_eq!(leaving.off_ns(), Some(14_725));
        assert_eq!(leaving.late_ns(15_500), 0);
        assert_eq!(leaving.late_ns(15_501), 1);
    }

    /// However long `write` took: the UART may have been given the field at its end.
    #[test]
    fn a_field_that_was_held_up_is_waited_for() {
        for held_up_ns in [3_900, 4_000, 12_000, 1_000_000] {
            let mut leaving = leaving();
            leaving.taken(1, 10_000, 10_000 + held_up_ns);
            assert_eq!(leaving.off_ns(), Some(14_400 + held_up_ns));
            assert_eq!(leaving.late_ns(14_400 + held_up_ns), held_up_ns - 1_100);
        }
    }

    /// A UART with room for one field makes `write` wait for the others; one without makes nobody wait.
    #[test]
    fn the_fields_after_the_first_follow_it() {
        for ends in [10_100, 14_050, 18_200] {
            let mut leaving = leaving();
            leaving.taken(1, 10_000, 10_000);
            leaving.taken(3, 10_050, ends);
            assert_eq!(leaving.off_ns(), Some(26_700), "{ends}");
        }
        // A pause of 20 us between them.
        let mut leaving = leaving();
        leaving.taken(1, 10_000, 10_000);
        leaving.taken(2, 30_000, 30_050);
        assert_eq!(leaving.off_ns(), Some(38_725));
    }
}
