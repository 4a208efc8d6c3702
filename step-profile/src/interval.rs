use core::fmt;

/// Length of a SORTE cycle in ns.
pub const CYCLE_NS: u32 = 4000;

/// The place of a pulse: in which cycle after the one of the previous pulse, and when in that cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepTime {
    /// 4us_cnt: cycles from the cycle of the previous pulse to the cycle of this one.
    pub cnt: u32,
    /// sync_time: start of the pulse in its cycle, in ns.
    pub sync: u32,
}

/// `415 cycles, 1380 ns`.
impl fmt::Display for StepTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cycles, {} ns", self.cnt, self.sync)
    }
}

/// A step time split into cycles and the rest: `cnt` cycles and `rest` ns.
///
/// It is the same for all steps of a ramp entry, so it is computed once per entry; each step then needs only an addition
/// and a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Interval {
    pub(crate) cnt: u32,
    /// Below 4000, or a little below 2^32 in the PRU's arithmetic.
    pub(crate) rest: u32,
    /// In 2^-16 ns, below 2^16; 0 unless carried.
    pub(crate) fraction: u32,
}

impl Interval {
    /// Returns the pulse that comes this long after one with sync_time `prev`.
    ///
    /// [`Arithmetic::Carried`](crate::Arithmetic::Carried) drops its fraction here; [`RampSteps`](crate::RampSteps) carries
    /// it over.
    #[inline]
    pub const fn after(self, prev: u32) -> StepTime {
        let sync = prev.wrapping_add(self.rest);
        match sync.checked_sub(CYCLE_NS) {
            Some(sync) => StepTime { cnt: self.cnt.wrapping_add(1), sync },
            None => StepTime { cnt: self.cnt, sync },
        }
    }
}

/// Returns the time of a step in ns, product bits 47..16 (Equation 1 of TIDEP0061, section 2.3.2).
///
/// `entry` is 1000 / sin², `speed` is 2^16 / f\[MHz\]. Bits above 2^48 of the product are dropped, as on the PRU.
#[expect(clippy::cast_possible_truncation, reason = "the PRU takes 32 bits out of the middle of the product")]
#[inline]
pub const fn step_time_ns(entry: u32, speed: u32) -> u32 {
    ((entry as u64).wrapping_mul(speed as u64) >> 16) as u32
}
