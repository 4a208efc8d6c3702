//! Moves of any shape as curves over time, with figures of their quality.

use std::io::{self, Write};

use step_motion::{Clock, Error, Limits, Plan};
use step_profile::{MoveState, Profile};

use super::ramp::{pulse_ns, stretches};

/// State of a move at a time.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sample {
    /// In s.
    pub(super) time: f64,
    /// In steps.
    pub(super) position: f64,
    /// In steps/s.
    pub(super) speed: f64,
    /// In steps/s².
    pub(super) acceleration: f64,
    /// In steps/s³; `None` where the acceleration jumps.
    pub(super) jerk: Option<f64>,
}

/// A move: its steps, and the curve from which they are taken.
pub(super) struct Move {
    pub(super) name: &'static str,
    /// Times of the steps in ns.
    pub(super) steps: Vec<u64>,
    pub(super) curve: Vec<Sample>,
    /// Largest distance of a step from its time on the unrounded curve, in ns.
    error_ns: f64,
}

/// Number of points on a curve between two corners.
const POINTS: u64 = 100;

impl Move {
    /// Plans a trapezoid, or an S-curve with a jerk limit.
    pub(super) fn planned(limits: Limits, steps: u32) -> Result<Self, Error> {
        let plan = Plan::new(Clock::NANOSECONDS, limits, steps)?;
        let corners: Vec<u64> = plan.corners().collect();
        let mut curve = Vec::new();
        for pair in corners.windows(2) {
            let &[from, to] = pair else { continue };
            // A corner belongs to both sides: a nanosecond in from it.
            let (from, to) = (from + 1, to.saturating_sub(1).max(from + 1));
            curve.extend((0..=POINTS).map(|i| sample(&plan, from + (to - from) * i / POINTS, limits)));
        }
        if let (Some(first), Some(end)) = (curve.first().copied(), corners.last()) {
            curve.insert(0, Sample { time: 0.0, position: 0.0, speed: 0.0, ..first });
            curve.push(Sample { time: *end as f64 / 1e9, position: f64::from(steps), ..Sample::default() });
        }
        let mut error_ns = 0.0;
        let times: Vec<u64> = plan.pulses().collect();
        for (k, &tick) in times.iter().enumerate() {
            let at = sample(&plan, tick, limits);
            error_ns = f64::max(error_ns, ((at.position - k as f64 - 0.5) / at.speed * 1e9).abs());
        }
        let name = if limits.jerk().is_some() { "s-curve" } else { "trapezoid" };
        Ok(Self { name, steps: times, curve, error_ns })
    }

    /// Returns the published ramp, which has levels of speed. The acceleration is taken from the middle of a level to the
    /// middle of the next.
    pub(super) fn sin2(profile: Profile<'_>, steps: u32) -> Self {
        let stretches = stretches(profile, steps);
        let k = f64::from(profile.parameters().steps_per_entry);
        let mut curve = vec![Sample::default()];
        let (mut middle, mut speed) = (0.0, 0.0);
        for stretch in &stretches {
            let (hz, time) = (stretch.khz() * 1e3, stretch.ms.start / 1e3..stretch.ms.end / 1e3);
            let count = stretch.steps().end - stretch.steps().start;
            // Full speed counts as a level of K steps at either end.
            let half = (time.end - time.start) * f64::min(1.0, k / count) / 2.0;
            let acceleration = (hz - speed) / (time.start + half - middle);
            let constant = stretch.first.state == MoveState::Constant;
            let at = |time, position, acceleration| Sample { time, position, speed: hz, acceleration, jerk: None };
            curve.push(Sample { acceleration, ..*curve.last().unwrap_or(&Sample::default()) });
            curve.push(at(time.start, stretch.steps().start, acceleration));
            if constant {
                let begin = stretch.steps().start;
                curve.push(at(time.start + half, begin + half * hz, acceleration));
                curve.push(at(time.start + half, begin + half * hz, 0.0));
                curve.push(at(time.end - half, begin + count - half * hz, 0.0));
            }
            curve.push(at(time.end, stretch.steps().end, if constant { 0.0 } else { acceleration }));
            (middle, speed) = (time.end - half, hz);
        }
        if let Some(&last) = curve.last() {
            let acceleration = if last.time > middle { -speed / (last.time - middle) } else { 0.0 };
            curve.push(Sample { acceleration, ..last });
            curve.push(Sample { speed: 0.0, acceleration, ..last });
        }
        let parameters = profile.parameters();
        let (mut exact, mut error_ns) = (f64::from(parameters.init_sync), 0.0);
        let mut times = Vec::new();
        for step in profile.steps(steps) {
            exact += f64::from(parameters.table.entry(step.entry)) * f64::from(parameters.speed.raw()) / 65536.0;
            let time = pulse_ns(step);
            error_ns = f64::max(error_ns, (time as f64 - exact).abs());
            times.push(time - u64::from(parameters.init_sync));
        }
        Self { name: "sin2", steps: times, curve, error_ns }
    }

    /// In s.
    pub(super) fn duration(&self) -> f64 {
        self.curve.last().map_or(0.0, |last| last.time)
    }

    fn most(&self, what: impl Fn(&Sample) -> f64) -> f64 {
        self.curve.iter().map(|sample| what(sample).abs()).fold(0.0, f64::max)
    }

    /// Returns the time to the greatest speed, in s.
    fn ramp(&self) -> f64 {
        let most = self.most(|sample| sample.speed) * (1.0 - 1e-6);
        self.curve.iter().find(|sample| sample.speed >= most).map_or(0.0, |sample| sample.time)
    }

    fn jump(&self) -> f64 {
        let jumps = self.curve.windows(2).map(|pair| match pair {
            [a, b] if b.time - a.time < 1e-8 => (b.speed - a.speed).abs(),
            _ => 0.0,
        });
        jumps.fold(0.0, f64::max)
    }
}

fn sample(plan: &Plan, tick: u64, limits: Limits) -> Sample {
    let state = plan.at(tick);
    let scale = |value: i64| value as f64 / 65536.0;
    Sample {
        time: tick as f64 / 1e9,
        position: state.position as f64 / 2_f64.powi(32),
        speed: scale(state.speed),
        acceleration: scale(state.acceleration),
        jerk: limits.jerk().map(|_| scale(state.jerk)),
    }
}

/// Prints one line per move.
pub(super) fn table(moves: &[Move], out: &mut dyn Write) -> io::Result<()> {
    writeln!(
        out,
        "shape      duration/ms   ramp/ms  speed/kHz  jump/kHz  peak a/(1000 steps/s²)  peak/mean a  jerk/(10⁶ steps/s³)  error/ns"
    )?;
    for made in moves {
        let speed = made.most(|sample| sample.speed);
        let (peak, ramp) = (made.most(|sample| sample.acceleration), made.ramp());
        let jerk = if made.curve.iter().any(|sample| sample.jerk.is_some()) {
            format!("{:.3}", made.most(|sample| sample.jerk.unwrap_or(0.0)) / 1e6)
        } else {
            "unbounded".to_owned()
        };
        writeln!(
            out,
            "{:<10} {:>11.3} {:>9.3} {:>10.3} {:>9.3} {:>23.3} {:>12.2} {jerk:>20} {:>9.2}",
            made.name,
            made.duration() * 1e3,
            ramp * 1e3,
            speed / 1e3,
            made.jump() / 1e3,
            peak / 1e3,
            if speed > 0.0 { peak * ramp / speed } else { 0.0 },
            made.error_ns
        )?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use step_profile::{Parameters, Speed};

    fn limits() -> Limits {
        Limits::new(100_000, 2_000_000).unwrap()
    }

    #[test]
    fn shapes_keep_to_what_they_are() {
        let flat = Move::planned(limits(), 20_000).unwrap();
        // v/a + n/v
        assert!((flat.duration() - 0.25).abs() < 1e-6, "{}", flat.duration());
        assert!((flat.ramp() - 0.05).abs() < 1e-3 && flat.error_ns <= 0.51, "{} {}", flat.ramp(), flat.error_ns);
        let smooth = Move::planned(limits().with_jerk(40_000_000).unwrap(), 20_000).unwrap();
        // v/a + a/j + n/v
        assert!((smooth.duration() - 0.3).abs() < 1e-6, "{}", smooth.duration());
        assert!((smooth.most(|s| s.jerk.unwrap_or(0.0)) - 4e7).abs() < 1e3 && smooth.jump() < 10.0);
        for made in [&flat, &smooth] {
            assert_eq!(made.steps.len(), 20_000);
            assert!((made.most(|s| s.speed) - 1e5).abs() < 1.0 && (made.most(|s| s.acceleration) - 2e6).abs() < 20.0);
        }
    }

    /// The figures of the published ramp: the peak acceleration is 21.6 times the mean, the first entry takes 61 % of the
    /// ramp's time, and the speed jumps by 12.3 kHz at 250 kHz.
    #[test]
    fn the_published_ramp_in_figures() {
        let profile = Profile::new(Parameters::at(Speed::KHZ_250)).unwrap();
        let made = Move::sin2(profile, 51_200);
        let mean = 250_000.0 / 2.732e-3;
        assert!((made.most(|s| s.acceleration) / mean - 21.6).abs() < 0.1, "{}", made.most(|s| s.acceleration) / mean);
        assert!((made.jump() - 12_300.0).abs() < 100.0, "{}", made.jump());
        let first = f64::from(profile.step_time_ns(0)) / 1e9;
        assert!((first / 2.732e-3 - 0.61).abs() < 0.01);
        assert!((made.duration() - 0.210_008).abs() < 1e-9 && made.steps.len() == 51_200);
    }

    #[test]
    fn a_table_has_a_line_a_shape() {
        let profile = Profile::new(Parameters::at(Speed::KHZ_100)).unwrap();
        let mut out = Vec::new();
        table(&[Move::sin2(profile, 64), Move::planned(limits(), 64).unwrap()], &mut out).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<_> = text.lines().collect();
        assert!(lines.len() == 3 && lines[1].starts_with("sin2") && lines[2].starts_with("trapezoid"), "{text}");
        assert!(lines[1].contains("unbounded") && !text.contains("NaN"), "{text}");
    }
}
