//! Finds levels from voltages, even if the line drifts.
//!
//! While both levels stay where they are, the threshold does not move. If the whole line shifts, for example because a
//! probe warms up or an input is AC-coupled, the threshold follows: the middle of the swing, or, while nothing swings, the
//! slow shift itself. A line with a third level (while nobody drives it) is not mistaken for a drifting one.

/// Values that are examined together.
const WINDOW: usize = 512;
/// Fractions of the swing, as divisors or shares: the hysteresis, the shift that moves the threshold, the limit for flat,
/// and the limit for swinging.
const HYSTERESIS: f64 = 20.0;
const MOVES: f64 = 8.0;
const FLAT: f64 = 0.2;
const SWINGS: (f64, f64) = (0.75, 1.6);

/// Converts voltages to levels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Threshold {
    middle: f64,
    swing: f64,
    /// Whether it follows the line; not if the user has set it.
    follows: bool,
    window: Window,
    /// The mean of the previous window, if that was flat.
    flat: Option<f64>,
}

/// The values since the last check.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Window {
    count: usize,
    least: f64,
    most: f64,
    sum: f64,
}

impl Window {
    const EMPTY: Self = Self { count: 0, least: f64::INFINITY, most: f64::NEG_INFINITY, sum: 0.0 };

    fn add(&mut self, volts: f64) {
        self.count += 1;
        self.least = self.least.min(volts);
        self.most = self.most.max(volts);
        self.sum += volts;
    }

    fn of(values: &[f64]) -> Self {
        let mut window = Self::EMPTY;
        for value in values {
            window.add(*value);
        }
        window
    }

    fn spread(&self) -> f64 {
        self.most - self.least
    }

    fn middle(&self) -> f64 {
        f64::midpoint(self.least, self.most)
    }
}

impl Threshold {
    /// Finds the threshold half-way between the levels of some values, given in their order, or takes the user's.
    pub(crate) fn find(values: &mut [f64], said: Option<f64>) -> Self {
        // A value beyond the instrument's range was at least at the end of it.
        let inside = |value: &&f64| value.abs() < f64::MAX;
        let bottom = values.iter().filter(inside).copied().fold(f64::INFINITY, f64::min);
        let top = values.iter().filter(inside).copied().fold(f64::NEG_INFINITY, f64::max);
        if bottom <= top {
            for value in values.iter_mut() {
                *value = value.clamp(bottom, top);
            }
        }
        let local = Self::local(values);
        values.sort_by(f64::total_cmp);
        // The few values beyond these are overshoot.
        let at = |share: usize| values.get(values.len() * share / 200).copied().unwrap_or(0.0);
        let (least, most) =
            (at(1), values.get(values.len().saturating_sub(1 + values.len() / 200)).copied().unwrap_or(0.0));
        let (middle, swing) = match local {
            // The line is already drifting: no single swing covers the whole range.
            Some((middle, swing)) if said.is_none() && swing * 1.3 < most - least => (middle, swing),
            _ => (said.unwrap_or(f64::midpoint(least, most)), most - least),
        };
        Self { middle, swing, follows: said.is_none(), window: Window::EMPTY, flat: None }
    }

    /// Returns how far the line swings within a window, and its middle at the beginning; `None` if there are too few windows.
    fn local(values: &[f64]) -> Option<(f64, f64)> {
        let windows: Vec<Window> = values.chunks_exact(WINDOW).map(Window::of).collect();
        let mut spreads: Vec<f64> = windows.iter().map(Window::spread).collect();
        spreads.sort_by(f64::total_cmp);
        let swing = *spreads.get(spreads.len() * 9 / 10).filter(|_| windows.len() >= 4)?;
        let first = windows.iter().find(|window| window.spread() >= swing * SWINGS.0)?;
        Some((first.middle(), swing))
    }

    /// Returns the level of a voltage, given the previous level.
    pub(crate) fn level(&self, volts: f64, before: Option<bool>) -> bool {
        let near = self.swing / HYSTERESIS;
        match before {
            Some(true) => volts >= self.middle - near,
            Some(false) => volts > self.middle + near,
            None => volts > self.middle,
        }
    }

    /// Follows the line, whose next voltage this is.
    pub(crate) fn follow(&mut self, volts: f64) {
        if !self.follows || volts.abs() >= f64::MAX {
            return;
        }
        self.window.add(volts);
        if self.window.count < WINDOW {
            return;
        }
        let window = std::mem::replace(&mut self.window, Window::EMPTY);
        let before = self.flat.take();
        if window.spread() < self.swing * FLAT {
            let mean = window.sum / window.count as f64;
            if let Some(shifted) = before.map(|before| mean - before) {
                self.middle += shifted;
            }
            self.flat = Some(mean);
        } else if (self.swing * SWINGS.0..=self.swing * SWINGS.1).contains(&window.spread()) {
            let apart = window.middle() - self.middle;
            if apart.abs() > self.swing / MOVES {
                self.middle += apart;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames of 100 bits with pauses, sampled ten times a bit, and what `volts` makes of their levels.
    fn line(samples: usize, volts: impl Fn(usize, Option<bool>) -> f64) -> Vec<(bool, f64)> {
        let bit = |at: usize| at.wrapping_mul(0x9e37_79b9) >> 7 & 1 == 1;
        let said = |k: usize| (k / 10 % 400 < 100).then(|| k / 10 % 400 == 99 || k / 10 % 400 != 0 && bit(k / 10));
        (0..samples).map(|k| (said(k).unwrap_or(true), volts(k, said(k)))).collect()
    }

    /// Counts samples whose level is wrong.
    fn wrong(line: &[(bool, f64)], said: Option<f64>) -> usize {
        let first = 16_384.min(line.len());
        let mut values: Vec<f64> = line.iter().take(first).map(|(_, volts)| *volts).collect();
        let mut threshold = Threshold::find(&mut values, said);
        let mut level = None;
        let mut bad = 0;
        for (due, volts) in line {
            let is = threshold.level(*volts, level);
            threshold.follow(*volts);
            level = Some(is);
            bad += usize::from(is != *due);
        }
        bad
    }

    fn driven(level: Option<bool>) -> f64 {
        if level == Some(false) { -1.0 } else { 1.0 }
    }

    #[test]
    fn it_goes_along_with_a_line_that_drifts() {
        let noise = |k: usize| (k.wrapping_mul(0x2545_f491) >> 9 & 63) as f64 / 1000.0;
        for (what, drift) in [
            ("none", 0.0),
            // By three times its swing, up and down, from the beginning.
            ("up", 6.0),
            ("down", -6.0),
        ] {
            let volts = |k: usize, level| driven(level) + drift * k as f64 / 300_000.0 + noise(k);
            assert_eq!(wrong(&line(300_000, volts), None), 0, "{what}");
            // Only after the values that are examined first.
            let volts =
                |k: usize, level| driven(level) + drift * k.saturating_sub(50_000) as f64 / 300_000.0 + noise(k);
            assert_eq!(wrong(&line(300_000, volts), None), 0, "{what}, later");
        }
        let hum = |k: usize, level| driven(level) + 1.5 * (k as f64 / 20_000.0).sin() + noise(k);
        assert_eq!(wrong(&line(300_000, hum), None), 0);
        // A threshold set by the user stays.
        assert!(wrong(&line(300_000, |k, level| driven(level) + 6.0 * k as f64 / 300_000.0), Some(0.0)) > 10_000);
    }

    #[test]
    fn a_third_level_is_no_drift() {
        // Driven to 1 and -1; at rest nobody drives it, and it is a little above 0.
        let volts = |_: usize, level: Option<bool>| level.map_or(0.25, |level| driven(Some(level)));
        assert_eq!(wrong(&line(300_000, volts), None), 0);
    }
}
