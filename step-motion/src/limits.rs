//! Limits of a machine, in the units of its data sheet, and the clock that counts the ticks of its steps.

use core::fmt;

use servowire_core::OutOfRange;

use crate::real::Real;

/// The clock of a timer: ticks per second, 1000 to 2^30 - 1.
///
/// 1 MHz is a common timer; [`NANOSECONDS`](Self::NANOSECONDS) suits the 4 µs cycle of TIDEP0061, whose PTO words are in ns.
///
/// Time ends 272 years or more after tick 0: no step that would be later is ever due. A request in the second half of that time counts as
/// one at its beginning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u32", into = "u32"))]
pub struct Clock(u32);

impl Clock {
    /// A tick is a nanosecond.
    pub const NANOSECONDS: Self = Self(1_000_000_000);
    /// A tick is a microsecond.
    pub const MICROSECONDS: Self = Self(1_000_000);
    /// The slowest, in ticks per second.
    pub const MIN_HZ: u32 = 1000;
    /// The fastest, in ticks per second: 2^30 - 1.
    pub const MAX_HZ: u32 = (1 << 30) - 1;

    /// Creates the clock; `None` outside 1000..=2^30 - 1.
    pub const fn new(hz: u32) -> Option<Self> {
        if hz < Self::MIN_HZ || hz > Self::MAX_HZ { None } else { Some(Self(hz)) }
    }

    /// Ticks per second.
    pub const fn hz(self) -> u32 {
        self.0
    }

    /// A tick has 2^shift moments; moments are 0.47 to 0.93 ns.
    pub(super) const fn shift(self) -> u32 {
        self.0.leading_zeros().saturating_sub(1)
    }

    /// Half a tick, in moments: steps are found to this grid, and rounded to a tick from it.
    pub(super) const fn grid(self) -> u32 {
        1 << self.shift().saturating_sub(1)
    }

    /// Rounds up to the next half tick.
    pub(super) const fn aligned(self, moment: u64) -> u64 {
        let mask = (self.grid() as u64).wrapping_sub(1);
        moment.saturating_add(mask) & !mask
    }

    /// Moments per second: 2^30 to 2^31.
    pub(super) const fn moments(self) -> u32 {
        self.0 << self.shift()
    }

    /// Duration of a moment, in seconds.
    pub(super) fn seconds(self) -> Real {
        Real::ONE / Real::new(self.moments().into())
    }

    /// How far off a step of a segment may be, in moments: 3/4 of a tick, or 25 ns if that is more, less the half tick that
    /// rounding to ticks takes.
    pub(super) fn blur(self) -> Real {
        let tick = Real::new(self.moment(1));
        let ns = |n: u64| Real::new(self.moments().into()) * Real::new(n) / Real::new(1_000_000_000);
        (tick / Real::new(5)).max(ns(23) - tick.half())
    }

    /// Returns the tick nearest to a moment, rounding halves up.
    pub(super) const fn tick(self, moment: u64) -> u64 {
        let shift = self.shift();
        moment.saturating_add(1 << shift.saturating_sub(1)) >> shift
    }

    /// Returns the moment at which a tick begins, or the last moment for a tick beyond it.
    pub(super) const fn moment(self, tick: u64) -> u64 {
        let shift = self.shift();
        if tick > u64::MAX >> shift { u64::MAX } else { tick << shift }
    }

    /// Returns whether a tick has moments. None of what is planned for later happens.
    pub(super) const fn is_in_time(self, tick: u64) -> bool {
        tick <= u64::MAX >> self.shift()
    }

    /// Returns a tick, or the last one at which motion may begin: from there on are as many moments as before.
    pub(super) const fn within_reach(self, tick: u64) -> u64 {
        let last = u64::MAX >> 1 >> self.shift();
        if tick < last { tick } else { last }
    }
}

impl TryFrom<u32> for Clock {
    type Error = OutOfRange;

    fn try_from(hz: u32) -> Result<Self, OutOfRange> {
        Self::new(hz).ok_or_else(|| range(hz.into(), Self::MIN_HZ.into(), Self::MAX_HZ.into()))
    }
}

impl From<Clock> for u32 {
    fn from(clock: Clock) -> Self {
        clock.0
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} Hz", self.0)
    }
}

/// Returns the limit that `got` exceeds.
fn range(got: u64, min: u64, max: u64) -> OutOfRange {
    OutOfRange::above(got, if got < min { min } else { max })
}

/// Greatest speed, acceleration and jerk of an axis.
///
/// ```
/// use step_motion::Limits;
/// let limits = Limits::new(20_000, 50_000)?.with_jerk(1_000_000)?;
/// assert_eq!((limits.speed(), limits.acceleration(), limits.jerk()), (20_000, 50_000, Some(1_000_000)));
/// # Ok::<_, servowire_core::OutOfRange>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "(u32, u32, Option<u64>)", into = "(u32, u32, Option<u64>)"))]
pub struct Limits {
    speed: u32,
    acceleration: u32,
    jerk: Option<u64>,
}

impl Limits {
    /// The greatest acceleration, in steps/s²: 2^31 - 1.
    pub const MAX_ACCELERATION: u32 = (1 << 31) - 1;
    /// The greatest jerk, in steps/s³: 2^44 - 1.
    pub const MAX_JERK: u64 = (1 << 44) - 1;

    /// Creates limits: `speed` in steps/s, `acceleration` in steps/s², each at least 1. Without a jerk limit a move is a
    /// trapezoid.
    ///
    /// # Errors
    /// [`OutOfRange`] for 0, and for an acceleration above [`MAX_ACCELERATION`](Self::MAX_ACCELERATION).
    pub fn new(speed: u32, acceleration: u32) -> Result<Self, OutOfRange> {
        if speed == 0 {
            return Err(range(0, 1, u32::MAX.into()));
        }
        if acceleration == 0 || acceleration > Self::MAX_ACCELERATION {
            return Err(range(acceleration.into(), 1, Self::MAX_ACCELERATION.into()));
        }
        Ok(Self { speed, acceleration, jerk: None })
    }

    /// Sets the `jerk` in steps/s³, at least 1: a move is then an S-curve.
    ///
    /// # Errors
    /// [`OutOfRange`] for 0 and above [`MAX_JERK`](Self::MAX_JERK).
    pub fn with_jerk(self, jerk: u64) -> Result<Self, OutOfRange> {
        if jerk == 0 || jerk > Self::MAX_JERK {
            return Err(range(jerk, 1, Self::MAX_JERK));
        }
        Ok(Self { jerk: Some(jerk), ..self })
    }

    /// Removes the jerk limit.
    pub const fn without_jerk(self) -> Self {
        Self { jerk: None, ..self }
    }

    /// Replaces the speed, in steps/s, at least 1.
    ///
    /// # Errors
    /// [`OutOfRange`] for 0.
    pub fn with_speed(self, speed: u32) -> Result<Self, OutOfRange> {
        if speed == 0 { Err(range(0, 1, u32::MAX.into())) } else { Ok(Self { speed, ..self }) }
    }

    /// Greatest speed in steps/s.
    pub const fn speed(self) -> u32 {
        self.speed
    }

    /// Greatest acceleration in steps/s².
    pub const fn acceleration(self) -> u32 {
        self.acceleration
    }

    /// Greatest jerk in steps/s³, if it is limited.
    pub const fn jerk(self) -> Option<u64> {
        self.jerk
    }

    /// Returns the higher of the two limits of each kind; no jerk limit counts as the highest.
    pub(super) fn or_higher(self, other: Self) -> Self {
        Self {
            speed: self.speed.max(other.speed),
            acceleration: self.acceleration.max(other.acceleration),
            jerk: self.jerk.zip(other.jerk).map(|(own, other)| own.max(other)),
        }
    }

    /// Converts the limits to steps and moments.
    pub(super) fn bounds(self, clock: Clock) -> Bounds {
        self.bounds_in(clock.seconds())
    }

    /// Does the same for a moment given in seconds.
    pub(super) fn bounds_in(self, moment: Real) -> Bounds {
        let squared = moment.squared();
        let (speed, acceleration) =
            (Real::new(self.speed.into()) * moment, Real::new(self.acceleration.into()) * squared);
        Bounds::new(speed, acceleration, self.jerk.map(|jerk| Real::new(jerk) * squared * moment))
    }
}

impl TryFrom<(u32, u32, Option<u64>)> for Limits {
    type Error = OutOfRange;

    fn try_from((speed, acceleration, jerk): (u32, u32, Option<u64>)) -> Result<Self, OutOfRange> {
        let limits = Self::new(speed, acceleration)?;
        jerk.map_or(Ok(limits), |jerk| limits.with_jerk(jerk))
    }
}

impl From<Limits> for (u32, u32, Option<u64>) {
    fn from(limits: Limits) -> Self {
        (limits.speed, limits.acceleration, limits.jerk)
    }
}

/// `20000 steps/s, 50000 steps/s², 1000000 steps/s³`.
impl fmt::Display for Limits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} steps/s, {} steps/s²", self.speed, self.acceleration)?;
        self.jerk.map_or(Ok(()), |jerk| write!(f, ", {jerk} steps/s³"))
    }
}

/// [`Limits`] for a planner, in the caller's units of length and time.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Bounds {
    pub(super) v: Real,
    pub(super) a: Real,
    /// 1 / a.
    pub(super) per_a: Real,
    pub(super) jerk: Option<Jerk>,
}

/// A jerk limit and what follows from it.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Jerk {
    pub(super) j: Real,
    /// 1 / j.
    pub(super) per_j: Real,
    /// Time to the greatest acceleration, a / j.
    pub(super) edge: Real,
    /// The change of speed that just reaches the greatest acceleration, a² / j.
    pub(super) knee: Real,
}

impl Bounds {
    /// No motion. All bytes are zero, so an array of it is cleared rather than copied.
    pub(super) const NONE: Self = Self { v: Real::ZERO, a: Real::ZERO, per_a: Real::ZERO, jerk: None };

    pub(super) fn new(v: Real, a: Real, j: Option<Real>) -> Self {
        let jerk = j.map(|j| {
            let per_j = Real::ONE / j;
            let edge = a * per_j;
            Jerk { j, per_j, edge, knee: a * edge }
        });
        Self { v, a, per_a: Real::ONE / a, jerk }
    }

    /// Raises the limits as far as an acceleration under way needs, and the jerk so that it brings a deceleration back to 0
    /// before rest.
    pub(super) fn holding(self, v: Real, (a, up): (Real, bool)) -> Self {
        let Some(Jerk { j, .. }) = self.jerk else { return self };
        // Rounding may make it a little more than the jerk that leads there already.
        let least = if up || v.is_zero() { Real::ZERO } else { (a.squared() / v).half() };
        let needs_more = least > j + j.scaled(-8);
        if a > self.a || needs_more {
            let j = if needs_more { least + least.scaled(-8) } else { j };
            return Self::new(self.v, self.a.max(a), Some(j));
        }
        self
    }

    /// Returns the higher of the two limits of each kind; no limit counts as the highest.
    pub(super) fn or_higher(self, other: &Self) -> Self {
        let jerk = self.jerk.zip(other.jerk).map(|(own, other)| own.j.max(other.j));
        Self::new(self.v.max(other.v), self.a.max(other.a), jerk)
    }

    /// Returns the lower of the two limits of each kind.
    pub(super) fn or_lower(self, other: &Self) -> Self {
        let (a, v) = (self.a.min(other.a), self.v.min(other.v));
        let j = match (self.jerk, other.jerk) {
            (Some(own), Some(other)) => Some(own.j.min(other.j)),
            (own, other) => own.or(other).map(|jerk| jerk.j),
        };
        Self::new(v, a, j)
    }

    /// Returns whether the acceleration or the jerk may be higher.
    pub(super) fn allows_more(&self, than: &Self) -> bool {
        self.a > than.a || self.jerk.zip(than.jerk).is_some_and(|(own, than)| own.j > than.j)
    }

    /// Returns the limits with a lower speed.
    pub(super) fn slower(self, v: Real) -> Self {
        Self { v: self.v.min(v), ..self }
    }
}

#[cfg(test)]
#[expect(clippy::cast_precision_loss, reason = "numbers to compare with 1e-6 of them")]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_limit_has_its_range() {
        assert_eq!(Limits::new(0, 1), Err(OutOfRange { got: 0, max: 1 }));
        assert_eq!(Limits::new(1, 0), Err(OutOfRange { got: 0, max: 1 }));
        assert_eq!(Limits::new(1, 1 << 31), Err(OutOfRange { got: 1 << 31, max: (1 << 31) - 1 }));
        let limits = Limits::new(u32::MAX, (1 << 31) - 1).unwrap();
        assert_eq!(limits.with_jerk(0), Err(OutOfRange { got: 0, max: 1 }));
        assert_eq!(limits.with_jerk(1 << 44), Err(OutOfRange { got: 1 << 44, max: (1 << 44) - 1 }));
        let jerky = limits.with_jerk((1 << 44) - 1).unwrap();
        assert_eq!(jerky.without_jerk(), limits);
        assert!(limits.with_speed(0).is_err());
        assert_eq!(limits.with_speed(7).unwrap().speed(), 7);
        assert_eq!(Limits::new(20, 5).unwrap().with_jerk(9).unwrap().to_string(), "20 steps/s, 5 steps/s², 9 steps/s³");
    }

    #[test]
    fn a_moment_is_a_fraction_of_a_tick() {
        assert_eq!((Clock::new(999), Clock::new(1 << 30)), (None, None));
        assert!(Clock::try_from(7).is_err());
        for hz in [1000, 1001, 250_000, 1_000_000, 72_000_000, 1_000_000_000, (1 << 30) - 1] {
            let clock = Clock::new(hz).unwrap();
            assert!((1 << 30..=u32::MAX / 2).contains(&clock.moments()), "{clock}");
            assert!(clock.shift() >= 1);
            let half = 1 << (clock.shift() - 1);
            for tick in [0, 1, 1 << 40] {
                let moment = clock.moment(tick);
                assert_eq!([0, half - 1, half].map(|by| clock.tick(moment + by)), [tick, tick, tick + 1]);
            }
        }
    }

    #[test]
    fn the_last_moment_stands_for_all_that_are_later() {
        for hz in [1000, 1_000_000, 200_000_000] {
            let (clock, shift) = (Clock::new(hz).unwrap(), Clock::new(hz).unwrap().shift());
            let last = u64::MAX >> shift;
            assert_eq!([last, last + 1, u64::MAX].map(|tick| clock.moment(tick)), [last << shift, u64::MAX, u64::MAX]);
            assert_eq!(clock.within_reach(last), last >> 1);
            assert_eq!([0, last >> 1].map(|tick| clock.within_reach(tick)), [0, last >> 1]);
        }
    }

    fn near(x: Real, want: f64) -> bool {
        let got = x.to_fixed(40) as f64 / (1_u64 << 40) as f64;
        (got - want).abs() <= want * 1e-6
    }

    /// A fifth of a tick, or what is left of 23 ns.
    #[test]
    fn segments_may_be_off_by_so_much() {
        for (hz, ns) in [(1_000_000, 200.0), (25_000_000, 8.0), (40_000_000, 10.5), (200_000_000, 20.5)] {
            let clock = Clock::new(hz).unwrap();
            let want = ns * 1e-9 * f64::from(clock.moments());
            assert!(near(clock.blur(), want), "{hz}: {want}");
        }
    }

    /// 10 of acceleration and 20 of jerk: at a speed of 5 a deceleration of 10 needs 10, at 2.5 it needs 20, and at 1 it needs 50.
    #[test]
    fn an_acceleration_under_way_is_kept() {
        let bounds = Bounds::new(Real::new(100), Real::new(10), Some(Real::new(20)));
        let holding = |v: u64, a: u64, up| {
            let new = bounds.holding(Real::new(v).half(), (Real::new(a), up));
            (new.v, new.a, new.jerk.unwrap().j)
        };
        let same = |(v, a, j): (Real, Real, Real)| near(v, 100.0) && near(a, 10.0) && near(j, 20.0);
        for (v, a, up) in [(10, 10, false), (5, 10, false), (2, 10, true), (0, 10, false), (2, 0, false)] {
            assert!(same(holding(v, a, up)), "{v} {a} {up}");
        }
        let (v, a, j) = holding(2, 10, false);
        assert!(near(v, 100.0) && near(a, 10.0) && near(j, 50.0 * (1.0 + 1.0 / 256.0)));
        let (v, a, j) = holding(200, 15, true);
        assert!(near(v, 100.0) && near(a, 15.0) && near(j, 20.0));
        let (_, a, j) = holding(4, 12, false);
        assert!(near(a, 12.0) && near(j, 36.0 * (1.0 + 1.0 / 256.0)));
        let free = Bounds::new(Real::new(100), Real::new(10), None).holding(Real::new(1), (Real::new(15), false));
        assert!(near(free.a, 10.0) && free.jerk.is_none());
    }

    /// Of acceleration or jerk, whatever the speed; no limit of jerk is not compared.
    #[test]
    fn which_limits_allow_more() {
        let bounds = |v: u64, a: u64, j: Option<u64>| Bounds::new(Real::new(v), Real::new(a), j.map(Real::new));
        let own = bounds(100, 10, Some(20));
        for (than, more) in [
            ((100, 10, Some(20)), false),
            ((1, 10, Some(20)), false),
            ((100, 9, Some(20)), true),
            ((100, 9, Some(21)), true),
            ((100, 10, Some(19)), true),
            ((100, 11, Some(19)), true),
            ((100, 11, Some(21)), false),
            ((100, 10, None), false),
        ] {
            assert_eq!(own.allows_more(&bounds(than.0, than.1, than.2)), more, "{than:?}");
        }
    }
}
