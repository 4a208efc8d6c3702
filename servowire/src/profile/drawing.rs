//! Draws speed, acceleration and step time of a move as SVG.

use std::ops::Range;

use step_profile::{MoveState, Profile};

use super::ramp::{Stretch, stretches};
use crate::drawing::{Chart, Drawn, Panel, Sheet, Stroke};

type Points = Vec<(f64, f64)>;

/// The horizontal axis of a drawing: milliseconds or steps.
type Along = fn(&Stretch) -> Range<f64>;

fn speed(stretches: &[Stretch], along: Along) -> Points {
    let level = |s: &Stretch| [(along(s).start, s.khz()), (along(s).end, s.khz())];
    let end = stretches.last().map_or(0.0, |last| along(last).end);
    [(0.0, 0.0)].into_iter().chain(stretches.iter().flat_map(level)).chain([(end, 0.0)]).collect()
}

fn step_time(stretches: &[Stretch], along: Along) -> Points {
    let us = |s: &Stretch| f64::from(s.first.t_step) / 1e3;
    stretches.iter().flat_map(|s| [(along(s).start, us(s)), (along(s).end, us(s))]).collect()
}

/// Returns the acceleration in 10³ steps/s², from the middle of a ramp entry to the middle of the next. Full speed counts
/// as an entry at each end, with zero acceleration between them.
fn acceleration(stretches: &[Stretch], k: u32, along: Along) -> Points {
    // Half an entry, in the unit of `range`.
    let half = |s: &Stretch, range: &Range<f64>| {
        let steps = s.steps();
        (range.end - range.start) * f64::min(1.0, f64::from(k) / (steps.end - steps.start)) / 2.0
    };
    let mut points = Points::new();
    let (mut left, mut left_ms, mut khz) = (0.0, 0.0, 0.0);
    // kHz / ms = 10⁶ steps/s²
    let mut slope =
        |from: f64, to: f64, rise: f64, ms: f64| points.extend([(from, rise / ms * 1e3), (to, rise / ms * 1e3)]);
    for stretch in stretches {
        let range = along(stretch);
        let (half, half_ms) = (half(stretch, &range), half(stretch, &stretch.ms));
        slope(left, range.start + half, stretch.khz() - khz, stretch.ms.start + half_ms - left_ms);
        if stretch.first.state == MoveState::Constant {
            slope(range.start + half, range.end - half, 0.0, 1.0);
        }
        (left, left_ms, khz) = (range.end - half, stretch.ms.end - half_ms, stretch.khz());
    }
    if let Some(last) = stretches.last() {
        slope(left, along(last).end, -khz, last.ms.end - left_ms);
    }
    points
}

/// Draws the whole move over time on the left, and the ramp up over its steps on the right.
pub(super) fn svg(profile: Profile<'_>, steps: u32) -> Drawn<String> {
    let stretches = stretches(profile, steps);
    let k = profile.parameters().steps_per_entry;
    let title = format!(
        "{steps} steps at {:.3} kHz, {k} steps per ramp entry: {:.3} ms",
        65_536_000.0 / f64::from(profile.parameters().speed.raw()),
        profile.duration_ns(steps) as f64 / 1e6
    );
    let end = stretches.last().map_or(1.0, |last| last.ms.end);
    let up = f64::from(profile.shape(steps).accelerating.max(1)) * 1.05;
    let sides: [(_, Along, _, _); 2] = [
        (7, |stretch| stretch.ms.clone(), end, "time in ms"),
        (5, Stretch::steps, f64::min(up, f64::from(steps.max(1))), "ramp up in steps"),
    ];
    let mut sheet = Sheet::new(&title, 1200);
    let rows: [(_, &dyn Fn(Along) -> Points, _); 3] = [
        ("speed in kHz", &|along| speed(&stretches, along), false),
        ("acceleration in 10³ steps/s²", &|along| acceleration(&stretches, k, along), false),
        ("step time in µs", &|along| step_time(&stretches, along), true),
    ];
    for (name, points, logarithmic) in rows {
        let panel = |(share, along, until, x): (u32, Along, f64, &str)| {
            let mut points = points(along);
            points.retain(|(at, _)| *at <= until);
            if let Some((_, value)) = points.last().copied() {
                points.push((until, value));
            }
            let chart = Chart { logarithmic, ..Chart::new(name, x, 0.0..until) };
            (share, Box::new(chart.with(Stroke::ONLY, points)) as Box<dyn Panel>)
        };
        sheet.beside(310, sides.map(panel).into());
    }
    sheet.svg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::nothing_is_covered;
    use step_profile::{Parameters, Speed};

    fn profile(hz: u32, steps_per_entry: u32) -> Profile<'static> {
        Profile::new(Parameters::at(Speed::from_hz(hz).unwrap()).with_steps_per_entry(steps_per_entry)).unwrap()
    }

    #[test]
    fn every_move_can_be_drawn() {
        for (hz, k, steps) in [(94_570, 20, 23_642), (250_000, 1, 64), (100, 1, 1), (1000, 1, 0)] {
            let svg = svg(profile(hz, k), steps).unwrap();
            for text in ["speed in kHz", "acceleration", "step time", "ramp up"] {
                assert!(svg.contains(text), "{steps} steps: {text}");
            }
            nothing_is_covered(&svg);
        }
    }

    /// The area under the acceleration is the speed: nothing in between, as much down as up.
    #[test]
    fn accelerations_add_up() {
        let stretches = stretches(profile(94_570, 20), 9000);
        let area = |points: &[(f64, f64)]| points.windows(2).map(|w| (w[1].0 - w[0].0) * w[0].1 / 1e3).sum::<f64>();
        let points = acceleration(&stretches, 20, |stretch| stretch.ms.clone());
        let up: Points = points.iter().copied().take_while(|p| p.1 >= 0.0).collect();
        assert!((area(&up) - 94.57).abs() < 0.1, "{}", area(&up));
        assert!(area(&points).abs() < 1e-6, "{}", area(&points));
    }
}
