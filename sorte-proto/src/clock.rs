/// Time from reading the counter until the new value takes effect in the published device: 27 instructions, 135 ns.
pub(crate) const WRITE_DELAY_NS: u32 = 135;
/// Number of frames averaged for one correction.
pub(crate) const AVERAGE: u8 = 16;

/// The correction of a device's counter. The IEP counter adds 5 per 5 ns tick, so it counts nanoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Correction {
    /// Nothing.
    None,
    /// Write the counter.
    Set {
        /// The value.
        counter_ns: u32,
    },
    /// Add `increment` instead of 5 for `ticks` ticks: each moves the clock by 1 ns.
    Rate {
        /// 6 to catch up, 4 to fall back.
        increment: u8,
        /// How many ticks; 0 if the mean error was below 1 ns.
        ticks: u16,
    },
}

servowire_core::one_line!(Correction {
    Self::None => "clock as it is";
    Self::Set { counter_ns } => "counter = {} ns", counter_ns;
    Self::Rate { increment, ticks } => "add {} a tick for {} ticks", increment, ticks;
});

/// Clock discipline of a device: the first SYNC frame sets the counter, then the mean error of each 16 frames is removed with ±1
/// ns per tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Clock {
    set: bool,
    average: u8,
    count: u8,
    sum: i32,
}

impl Default for Clock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock {
    /// Creates a clock that is not set yet.
    pub const fn new() -> Self {
        Self::averaging(AVERAGE)
    }

    /// Creates a clock that is not set yet and makes each correction from this many frames, 16 in the published device. The
    /// clock runs free between two corrections: at 50 ppm 3 ns in 16 cycles of 4 us, and 180 ns in 16 of 224 us, more than
    /// any gap between two device frames allows. 0 counts as 1.
    pub(crate) const fn averaging(frames: u8) -> Self {
        Self { set: false, average: frames, count: 0, sum: 0 }
    }

    /// Takes a frame that was expected at `time_stamp_ns` of the master's time and began at `rx_sof_ns` of the device's own
    /// counter, which now reads `counter_now_ns`. In SYNC the time stamp comes with the frame; in the IO exchange it is the
    /// accumulated delay plus 500 in each cycle.
    pub const fn frame(&mut self, time_stamp_ns: u32, rx_sof_ns: u32, counter_now_ns: u32) -> Correction {
        if !self.set {
            self.set = true;
            let since = counter_now_ns.wrapping_sub(rx_sof_ns);
            let counter_ns = time_stamp_ns.wrapping_add(since).wrapping_add(WRITE_DELAY_NS);
            return Correction::Set { counter_ns };
        }
        let error = i32::from_le_bytes(time_stamp_ns.wrapping_sub(rx_sof_ns).to_le_bytes());
        self.sum = self.sum.wrapping_add(error);
        self.count = self.count.saturating_add(1);
        if self.count < self.average {
            return Correction::None;
        }
        let increment = if self.sum >= 0 { 6 } else { 4 };
        // The published register takes 16 bits of the mean.
        let mean = match self.sum.unsigned_abs().checked_div(self.average as u32) {
            Some(mean) => mean,
            None => self.sum.unsigned_abs(),
        };
        let [low, high, ..] = mean.to_le_bytes();
        (self.count, self.sum) = (0, 0);
        Correction::Rate { increment, ticks: u16::from_le_bytes([low, high]) }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// A clock that is off by a constant is right after one correction, to the nanosecond below 16.
        #[test]
        fn one_correction_takes_out_the_mean(offset in -30_000i32..30_000, start: u32) {
            let mut clock = Clock::new();
            let set = clock.frame(start, 1_000_000, 1_000_700);
            prop_assert_eq!(set, Correction::Set { counter_ns: start.wrapping_add(700 + 135) });
            for k in 1..=16u32 {
                let expected = start.wrapping_add(k * 10_000);
                let seen = expected.wrapping_add_signed(-offset);
                let correction = clock.frame(expected, seen, seen);
                if k < 16 {
                    prop_assert_eq!(correction, Correction::None);
                } else {
                    let increment = if offset >= 0 { 6 } else { 4 };
                    let ticks = offset.unsigned_abs() as u16;
                    prop_assert_eq!(correction, Correction::Rate { increment, ticks });
                }
            }
        }
    }
}
