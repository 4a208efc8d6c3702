//! Periods, timers and the time a frame takes.

/// A pair of communication and update period with the drive parameters that choose it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Periods {
    /// Communication period: one exchange of frames, ns.
    pub com_ns: u32,
    /// Update period of the commands, ns: one or two communication periods.
    pub update_ns: u32,
    /// Whether the pair works with the internal-timer system, which needs one communication period per update.
    pub internal_timer: bool,
}

/// The parameters that choose the periods of an A6N drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct A6nParameters {
    /// Pr7.20: -1 makes Pr7.91 effective.
    pub pr7_20: i32,
    /// Pr7.21: communication periods in an update period.
    pub pr7_21: u32,
    /// Pr7.91: communication period, ns.
    pub pr7_91: u32,
}

servowire_core::one_line!(A6nParameters {
    Self { pr7_20, pr7_21, pr7_91 } => "Pr7.20 = {}, Pr7.21 = {}, Pr7.91 = {}", pr7_20, pr7_21, pr7_91;
});

impl Periods {
    const fn of(com_ns: u32, per_update: u32, internal_timer: bool) -> Self {
        Self { com_ns, update_ns: com_ns.wrapping_mul(per_update), internal_timer }
    }

    /// Number of communication periods in an update period, Pr7.21.
    pub const fn communications(&self) -> u32 {
        match self.update_ns.checked_div(self.com_ns) {
            Some(n) => n,
            None => 0,
        }
    }

    /// The parameters of an A6N drive for this pair: -1, the communications per update, and the communication period in ns.
    pub const fn a6n_parameters(&self) -> A6nParameters {
        A6nParameters { pr7_20: -1, pr7_21: self.communications(), pr7_91: self.com_ns }
    }

    /// Returns by how many communication periods new commands are sent too late, if the exchange that writes them ends `end_ns`
    /// after the start of the frame that began its update period (the falling edge of XSYNC).
    ///
    /// Returns 0 as long as the exchange ends before the next frame starts. A frame in progress at the falling edge of XSYNC
    /// delays the switch of the memory banks, so anything later waits for one more frame. System Design Guide for Master, "2
    /// communications per calculation".
    pub const fn frames_late(&self, end_ns: u32) -> u32 {
        match end_ns.checked_div(self.com_ns) {
            Some(late) => late,
            None => 0,
        }
    }

    /// Returns the pair that an A5NL drive uses with these parameters; `None` if SX-DSV02310 does not show it.
    ///
    /// Pr7.20 = 3 is 0.5 ms, 0 is 1/12 ms; that 1/6 ms is Pr7.20 = 1 is inferred.
    pub fn from_a5nl(pr7_20: i32, pr7_21: i32) -> Option<Self> {
        A5NL.into_iter().find(|(a, b, _)| (*a, *b) == (pr7_20, pr7_21)).map(|(_, _, periods)| periods)
    }

    /// Returns the pair that an A6N drive uses with these parameters; `None` if the guide's table does not list it.
    ///
    /// A pair that is not listed is not necessarily bad. Pr7.91 is evaluated only if Pr7.20 is -1 (inferred; the table
    /// gives Pr7.20 = 3 and 6 without it).
    pub fn from_a6n(pr7_20: i32, pr7_21: i32, pr7_91: Option<i64>) -> Option<Self> {
        let com_ns = match (pr7_20, pr7_21) {
            (-1, _) => u32::try_from(pr7_91?).ok()?,
            (3, 1 | 2) => 500_000,
            (6, 1) => 1_000_000,
            _ => return None,
        };
        let per_update = u32::try_from(pr7_21).ok()?;
        A6N.into_iter().find(|p| p.com_ns == com_ns && p.communications() == per_update)
    }
}

/// The period table of the A6N family, from the longest update period. System Design Guide for Master, "Setting of
/// the communication period and the update period".
pub const A6N: [Periods; 11] = [
    Periods::of(2_000_000, 2, false),
    Periods::of(2_000_000, 1, true),
    Periods::of(1_000_000, 2, false),
    Periods::of(1_000_000, 1, true),
    Periods::of(500_000, 2, false),
    Periods::of(500_000, 1, true),
    Periods::of(250_000, 2, false),
    Periods::of(250_000, 1, true),
    Periods::of(125_000, 2, false),
    Periods::of(125_000, 1, true),
    Periods::of(62_500, 2, false),
];

/// The pairs that SX-DSV02310 shows for the A5NL family, with Pr7.20 and Pr7.21; periods in whole ns, rounded down. It does
/// not say whether they work with the internal-timer system; here, the pairs with one communication per update do.
pub const A5NL: [(i32, i32, Periods); 4] = [
    (3, 2, Periods::of(500_000, 2, false)),
    (3, 1, Periods::of(500_000, 1, true)),
    (1, 1, Periods::of(166_666, 1, true)),
    (0, 2, Periods::of(83_333, 2, false)),
];

/// The timer that sets the pace.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum TimerSystem {
    /// A timer of the host drives XTXTIM at the communication period and, divided, the NC interrupt at the update
    /// period. The receive interrupt (XINTRX) switches the memory bank and has priority **above** the NC interrupt.
    External,
    /// The ASIC's own timer; the NC interrupt comes from XSYNC at the start of transmission. The receive interrupt, if used,
    /// clears a watchdog and has priority **below** the NC interrupt.
    Internal,
}

impl TimerSystem {
    /// Returns whether a pair of periods works with this system.
    pub const fn allows(self, periods: &Periods) -> bool {
        match self {
            Self::External => true,
            Self::Internal => periods.internal_timer,
        }
    }

    /// Returns whether the receive interrupt has priority over the NC interrupt.
    pub(crate) const fn reception_first(self) -> bool {
        matches!(self, Self::External)
    }
}

/// Returns the reload value of a timer that counts at `timer_hz` and restarts after `period_ns`: ticks less one.
///
/// `None` if the period is not a whole number of ticks, or the value exceeds 32 bits. 50 MHz and 0.5 ms give
/// 24999, the guide's own example.
pub fn timer_reload(timer_hz: u32, period_ns: u32) -> Option<u32> {
    const NS_PER_S: u64 = 1_000_000_000;
    let scaled = u64::from(timer_hz).checked_mul(period_ns.into())?;
    if scaled.checked_rem(NS_PER_S)? != 0 {
        return None;
    }
    u32::try_from(scaled.checked_div(NS_PER_S)?.checked_sub(1)?).ok()
}

/// An estimate of the time that a frame takes, as a straight line through two points.
///
/// The guide publishes about 11 us with one axis and about 300 us with 32; everything between is an assumption, the vendor's
/// own limits for axes per period are not known, and blocks of 32 bytes take longer. Use measured times if you have them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FrameTime {
    /// With one axis, ns.
    pub one_ns: u32,
    /// With 32 axes, ns.
    pub full_ns: u32,
}

impl FrameTime {
    /// The two figures of the guide.
    pub const GUIDE: Self = Self { one_ns: 11_000, full_ns: 300_000 };
    /// Axes on a full ring.
    const FULL: u32 = 32;
    /// Number of steps from one axis to a full ring.
    const STEPS: u64 = 31;

    /// Returns the estimated time with `axes` axes, ns, rounded; `axes` is limited to 1 to 32.
    pub fn estimate_ns(self, axes: u32) -> u64 {
        let more = u64::from(axes.clamp(1, Self::FULL).saturating_sub(1));
        let rise = more.saturating_mul(self.rise()).saturating_mul(2).saturating_add(Self::STEPS);
        u64::from(self.one_ns).saturating_add(rise.checked_div(2 * Self::STEPS).unwrap_or(0))
    }

    /// Returns how many axes fit into a communication period according to this line, at most 32; 0 if not even one does.
    pub fn axes_within(self, com_ns: u32) -> u32 {
        let Some(room) = com_ns.checked_sub(self.one_ns) else { return 0 };
        let steps = u64::from(room).saturating_mul(Self::STEPS).checked_div(self.rise()).unwrap_or(u64::MAX);
        u32::try_from(steps).unwrap_or(u32::MAX).saturating_add(1).min(Self::FULL)
    }

    fn rise(self) -> u64 {
        u64::from(self.full_ns.saturating_sub(self.one_ns))
    }
}

impl Default for FrameTime {
    fn default() -> Self {
        Self::GUIDE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_agrees_with_its_parameters() {
        for periods in A6N {
            let A6nParameters { pr7_20, pr7_21, pr7_91 } = periods.a6n_parameters();
            assert_eq!(Periods::from_a6n(pr7_20, i32::try_from(pr7_21).unwrap(), Some(pr7_91.into())), Some(periods));
            assert_eq!(periods.update_ns, periods.com_ns * pr7_21);
            assert_eq!(TimerSystem::Internal.allows(&periods), pr7_21 == 1);
        }
        assert_eq!(Periods::from_a6n(3, 2, None).map(|p| p.update_ns), Some(1_000_000));
        // 6 is 1 ms, 3 is 0.5 ms, whatever Pr7.91 says.
        assert_eq!(Periods::from_a6n(6, 1, Some(5)).map(|p| (p.com_ns, p.update_ns)), Some((1_000_000, 1_000_000)));
        assert_eq!(Periods::from_a6n(6, 2, None), None);
        assert_eq!(Periods::from_a6n(-1, 1, None), None);
        assert_eq!(Periods::from_a6n(-1, 1, Some(62_500)), None);
    }

    /// The figures of SX-DSV02310, pages 10 and 11.
    #[test]
    fn periods_of_the_a5nl() {
        let of = |a, b| Periods::from_a5nl(a, b).map(|p| (p.com_ns, p.update_ns));
        assert_eq!(of(3, 1), Some((500_000, 500_000)));
        assert_eq!(of(3, 2), Some((500_000, 1_000_000)));
        assert_eq!(of(0, 2), Some((83_333, 166_666)));
        assert_eq!(of(1, 1), Some((166_666, 166_666)));
        assert_eq!([of(0, 1), of(1, 2), of(6, 1), of(-1, 1)], [None; 4]);
    }

    #[test]
    fn an_exchange_that_runs_into_the_next_frame_is_late() {
        let periods = Periods::from_a6n(3, 1, None).unwrap();
        assert_eq!([0, 499_999, 500_000, 999_999, 1_000_000].map(|end| periods.frames_late(end)), [0, 0, 1, 1, 2]);
    }

    #[test]
    fn the_guides_timer_example() {
        assert_eq!(timer_reload(50_000_000, 500_000), Some(0x61a7));
        assert_eq!(timer_reload(25_000_000, 62_500), None);
        assert_eq!(timer_reload(0, 500_000), None);
        assert_eq!(timer_reload(u32::MAX, u32::MAX), None);
    }

    /// The line goes through its two points and never decreases; the inverse agrees with it.
    #[test]
    fn frame_time_line() {
        let line = FrameTime::GUIDE;
        assert_eq!((line.estimate_ns(1), line.estimate_ns(32), line.estimate_ns(99)), (11_000, 300_000, 300_000));
        let fit = [10_999, 11_000, 62_500, 83_333, 125_000, 166_666, 250_000, 500_000].map(|ns| line.axes_within(ns));
        assert_eq!(fit, [0, 1, 6, 8, 13, 17, 26, 32]);
        for com_ns in [0, 10_999, 11_000, 62_500, 83_333, 125_000, 166_666, 250_000, 299_999, 300_000, u32::MAX] {
            let axes = line.axes_within(com_ns);
            assert!(axes == 0 || line.estimate_ns(axes) <= u64::from(com_ns));
            assert!(axes == 32 || line.estimate_ns(axes + 1) > u64::from(com_ns) || axes == 0);
        }
    }
}
