use super::ClockError;

/// Makes sure that a wait ends: checks every reading of a clock from outside and limits the number of readings of a clock that
/// has stopped.
///
/// A loop that waits for a time never ends if the clock has stopped, was set back, or is a 32-bit counter that wraps before that
/// time. With this check it does:
///
/// ```
/// use servowire_core::{ClockCheck, ClockError};
///
/// fn wait(check: &mut ClockCheck, until_ns: u64, mut now_ns: impl FnMut() -> u64) -> Result<(), ClockError> {
///     while check.check(now_ns())? < until_ns {}
///     Ok(())
/// }
///
/// let mut check = ClockCheck::new(10_000);
/// assert_eq!(wait(&mut check, 5_000, || 4_999), Err(ClockError::Stopped));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ClockCheck {
    last_ns: u64,
    /// The reading that was last repeated, and how many times.
    stood_ns: u64,
    repeats: u32,
    max_repeats: u32,
}

impl ClockCheck {
    /// Creates the check. A clock counts as stopped when a reading is repeated more than `max_repeats` times; choose more than
    /// a fast processor can make within one tick.
    pub const fn new(max_repeats: u32) -> Self {
        Self { last_ns: 0, stood_ns: 0, repeats: 0, max_repeats }
    }

    /// The last reading, whether it was good or not; 0 before the first one.
    pub const fn last_ns(&self) -> u64 {
        self.last_ns
    }

    /// Returns the reading, if it is plausible.
    ///
    /// # Errors
    /// [`ClockError::Backwards`] if it is before the last one, reported once: the next reading is compared with this one.
    /// [`ClockError::Stopped`] if it was repeated too often, reported until it changes.
    #[inline]
    pub const fn check(&mut self, now_ns: u64) -> Result<u64, ClockError> {
        if now_ns > self.last_ns {
            self.last_ns = now_ns;
            return Ok(now_ns);
        }
        match self.refuse(now_ns) {
            None => Ok(now_ns),
            Some(error) => Err(error),
        }
    }

    /// Returns the reading, if it is plausible and at most `most_ns` after the last one; `most_ns` is at most 2^63.
    ///
    /// # Errors
    /// Those of [`check`](Self::check), and [`ClockError::Ahead`] if more time has passed, reported once: the next reading is
    /// compared with this one.
    #[inline]
    pub const fn check_within(&mut self, now_ns: u64, most_ns: u64) -> Result<u64, ClockError> {
        // What is not after the last one is far above.
        if now_ns.wrapping_sub(self.last_ns).wrapping_sub(1) < most_ns {
            self.last_ns = now_ns;
            return Ok(now_ns);
        }
        self.without(now_ns)
    }

    /// Handles a reading that is not after the last one, or too long after it.
    #[cold]
    #[inline(never)]
    const fn without(&mut self, now_ns: u64) -> Result<u64, ClockError> {
        let last_ns = self.last_ns;
        match self.check(now_ns) {
            Ok(now_ns) if now_ns > last_ns => Err(ClockError::Ahead { by_ns: now_ns.wrapping_sub(last_ns) }),
            checked => checked,
        }
    }

    /// Returns what is wrong with a reading that is not after the last one.
    #[cold]
    #[inline(never)]
    const fn refuse(&mut self, now_ns: u64) -> Option<ClockError> {
        let by_ns = self.last_ns.saturating_sub(now_ns);
        self.last_ns = now_ns;
        if by_ns > 0 {
            self.repeats = 0;
            return Some(ClockError::Backwards { by_ns });
        }
        if self.stood_ns != now_ns {
            self.stood_ns = now_ns;
            self.repeats = 0;
        }
        if self.repeats >= self.max_repeats {
            return Some(ClockError::Stopped);
        }
        self.repeats = self.repeats.saturating_add(1);
        None
    }
}
