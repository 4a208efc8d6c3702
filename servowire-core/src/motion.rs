//! Computes where a shaft is between two samples: the writer divides, the reader multiplies.

use crate::angle::Angle;

/// An angle, and how far it may be off in either direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Estimate {
    /// The angle.
    pub angle: Angle,
    /// How far it may be off. Half a turn means that nothing is known.
    pub bound: Angle,
}

/// The largest acceleration of a shaft in either direction, including everything that its motor and load can cause.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Acceleration(u32);

impl Acceleration {
    /// Creates it from turns per second squared; one is 6.283 rad/s². `None` above 909,372.
    pub const fn from_turns_per_s2(turns_per_s2: u32) -> Option<Self> {
        // 2^72 / 10^18, rounded up: in units of 2^-72 turn/ns².
        match turns_per_s2.checked_mul(4_723) {
            Some(bits) => Some(Self(bits)),
            None => None,
        }
    }

    /// In units of 2^-72 turn per ns squared, rounded up.
    pub const fn to_bits(self) -> u32 {
        self.0
    }
}

/// Times from this length upwards are too long: 2.1 s.
const TOO_LONG_NS: u32 = 1 << 31;

/// The motion of a shaft at its last sample, from the last two.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Motion {
    angle: Angle,
    sampled_ns: u64,
    /// Time between the two samples; 0 if the speed is not known.
    span_ns: u32,
    /// In 2^-48 turn/ns.
    speed: i32,
    /// How far the mean speed over the span may be off, in the same unit.
    speed_error: u32,
    /// How far the angle may be off in units of 2^-32 turn: the width of a count, and the bound of an estimate.
    count: u32,
}

impl Motion {
    /// Number of words into which a motion is packed.
    pub(crate) const WORDS: usize = 7;

    /// The state before the first sample and after a doubtful one.
    pub(crate) const UNKNOWN: Self = Self::standing(Angle::ZERO, 0, 0);

    /// Starts with a sample that has no predecessor.
    const fn standing(angle: Angle, sampled_ns: u64, count: u32) -> Self {
        Self { angle, sampled_ns, span_ns: 0, speed: 0, speed_error: 0, count }
    }

    /// The mean speed between the last two samples in units of 2^-48 turn/ns, which is 3.55 millionths of a turn per second;
    /// `None` if it is not known.
    pub const fn speed(&self) -> Option<i32> {
        if self.span_ns == 0 { None } else { Some(self.speed) }
    }

    /// Returns where the shaft is now, or was shortly before the sample, extrapolated from the last angle with the last mean speed.
    ///
    /// The bound holds for every motion within the largest acceleration. Let a be the acceleration, s the time between the
    /// last two samples and t the time since the last one. In the last sample the shaft is off by up to one count; the mean
    /// speed is off by up to a count per s; at the last sample the speed differs from the mean speed by up to a·s/2; from
    /// there the shaft deviates by up to a·t²/2. In total: one count · (1 + t/s) + a·t·(s + t)/2. If the speed is not known,
    /// or either time exceeds 2.1 s, the bound is half a turn. If samples are [estimates](crate::Shaft::bound), the bound of the
    /// last one is added to its count, and those of both to the count per s.
    ///
    /// The instants of both samples are taken as exact: an error in them is multiplied by the speed.
    pub fn at(&self, now_ns: u64, max_acceleration: Acceleration) -> Estimate {
        let unknown = Estimate { angle: self.angle, bound: Angle::HALF };
        let Ok(time_ns) = u32::try_from(now_ns.abs_diff(self.sampled_ns)) else { return unknown };
        if self.span_ns == 0 || time_ns >= TOO_LONG_NS {
            return unknown;
        }
        let turned = Angle::from_bits(low(times(self.speed.unsigned_abs(), time_ns) >> 16));
        let forward = (self.speed < 0) == (now_ns < self.sampled_ns);
        let angle = if forward { self.angle.wrapping_add(turned) } else { self.angle.wrapping_sub(turned) };
        Estimate { angle, bound: self.bound(time_ns, max_acceleration) }
    }

    /// Computes the bound of [`at`](Self::at), with every term rounded up.
    const fn bound(&self, time_ns: u32, max_acceleration: Acceleration) -> Angle {
        let mean = times(self.speed_error, time_ns) >> 16;
        // t·(s + t) in 2^16 ns², below 2^46; times 2^-72 turn/ns², in 2^-32 turn and halved, is a shift by 72 - 16 - 32 + 1.
        let area = (times(time_ns, time_ns.wrapping_add(self.span_ns)) >> 16).wrapping_add(1);
        let Acceleration(acceleration) = max_acceleration;
        let upper = times(low(area >> 32), acceleration) << (32 - 25);
        let departed = (times(low(area), acceleration) >> 25).wrapping_add(upper);
        // What was rounded down: the way turned, and two terms here.
        let bound = departed.wrapping_add(mean).wrapping_add(self.count as u64).wrapping_add(3);
        if bound < Angle::HALF.to_bits() as u64 { Angle::from_bits(low(bound)) } else { Angle::HALF }
    }

    pub(crate) const fn to_words(self) -> [u32; Self::WORDS] {
        let Self { angle, sampled_ns, span_ns, speed, speed_error, count } = self;
        let speed = 0_u32.wrapping_add_signed(speed);
        [angle.to_bits(), low(sampled_ns), low(sampled_ns >> 32), span_ns, speed, speed_error, count]
    }

    pub(crate) fn from_words(words: [u32; Self::WORDS]) -> Self {
        let [angle, early, late, span_ns, speed, speed_error, count] = words;
        let sampled_ns = u64::from(late) << 32 | u64::from(early);
        let speed = 0_i32.wrapping_add_unsigned(speed);
        Self { angle: Angle::from_bits(angle), sampled_ns, span_ns, speed, speed_error, count }
    }
}

/// Returns the full product, which takes one instruction on a Cortex-M4.
const fn times(a: u32, b: u32) -> u64 {
    (a as u64).wrapping_mul(b as u64)
}

#[expect(clippy::cast_possible_truncation, reason = "the half that is meant")]
const fn low(bits: u64) -> u32 {
    bits as u32
}

/// Derives [`Motion`] from successive samples. The writer runs it, because it divides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tracker {
    count: u32,
    longest_span_ns: u32,
    last: Option<Motion>,
}

impl Tracker {
    /// Creates a tracker for an encoder with `counts_per_turn` on a shaft that never turns faster than `max_turns_per_s`.
    ///
    /// Two samples determine the speed only if the shaft has moved less than half a turn between them, because 0.7 of a turn
    /// looks like 0.3 of a turn backward. At 100 turns per second (6000 rpm), half a turn takes 5 ms. After a longer gap the
    /// next sample counts as a first one. `None` if there are fewer than 3 counts, or if the speed is not between 1 and
    /// 7000.
    pub const fn new(counts_per_turn: u32, max_turns_per_s: u32) -> Option<Self> {
        if counts_per_turn < 3 || max_turns_per_s > 7_000 {
            return None;
        }
        let Some(count) = (1_u64 << 32).checked_div(counts_per_turn as u64) else { return None };
        // Rounded up, and one more where angles are rounded down.
        let count = if counts_per_turn.is_power_of_two() { count } else { count.wrapping_add(2) };
        // Half a turn, less the count by which the samples may be off, in turns · 10^9.
        let half = (1_u64 << 31).saturating_sub(count).wrapping_mul(1_000_000_000) >> 32;
        match half.checked_div(max_turns_per_s as u64) {
            Some(longest) => Some(Self { count: low(count), longest_span_ns: low(longest), last: None }),
            None => None,
        }
    }

    /// Takes the next sample. The same sample again changes nothing. A sample that contradicts the last one (another angle at
    /// the same instant, or an earlier instant because the clock was set back) counts as a first one.
    pub fn sample(&mut self, angle: Angle, sampled_ns: u64) -> Motion {
        self.sample_within(angle, sampled_ns, Angle::ZERO)
    }

    /// Does the same with an angle that may be off by up to `bound`, in addition to the count.
    pub(crate) fn sample_within(&mut self, angle: Angle, sampled_ns: u64, bound: Angle) -> Motion {
        let standing = Motion::standing(angle, sampled_ns, self.count.saturating_add(bound.to_bits()));
        let motion = match self.last {
            Some(last) if last.sampled_ns == sampled_ns && last.angle == angle => last,
            Some(last) => self.moved(last, standing),
            None => standing,
        };
        self.last = Some(motion);
        motion
    }

    /// Call this when a sample is missing or doubtful: the next one then counts as a first one.
    pub const fn interrupt(&mut self) -> Motion {
        self.last = None;
        Motion::UNKNOWN
    }

    /// Computes the motion from one sample to the next, which is `standing` so far.
    fn moved(&self, last: Motion, standing: Motion) -> Motion {
        // How far the way from one to the other may be off beyond a count.
        let bounds = last.count.wrapping_sub(self.count).saturating_add(standing.count.wrapping_sub(self.count));
        let span = standing.sampled_ns.checked_sub(last.sampled_ns).and_then(|span| u32::try_from(span).ok());
        let Some(span_ns) = span.filter(|span| *span <= self.longest_span_ns(bounds)) else { return standing };
        let step = i64::from(standing.angle.difference(last.angle));
        let speed = (step << 16).checked_div(span_ns.into()).map(i32::try_from);
        let error = u64::from(self.count).wrapping_add(bounds.into()) << 16;
        let error = error.checked_div(span_ns.into()).map(u32::try_from);
        let (Some(Ok(speed)), Some(Ok(error))) = (speed, error) else { return standing };
        // Both divisions are rounded towards zero.
        Motion { span_ns, speed, speed_error: error.saturating_add(2), ..standing }
    }

    /// Returns the longest time in which the shaft moves less than half a turn, less a count and the `bounds` of both samples.
    fn longest_span_ns(&self, bounds: u32) -> u32 {
        if bounds == 0 { self.longest_span_ns } else { self.shorter_span_ns(bounds) }
    }

    #[cold]
    fn shorter_span_ns(&self, bounds: u32) -> u32 {
        let half = Angle::HALF.to_bits().saturating_sub(self.count);
        let left = times(self.longest_span_ns, half.saturating_sub(bounds));
        left.checked_div(half.into()).map_or(0, low)
    }
}

#[cfg(test)]
mod tests;
