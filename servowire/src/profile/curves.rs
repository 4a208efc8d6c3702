//! Draws position, speed, acceleration and jerk of moves over time as SVG.

use super::motion::{Move, Sample};
use crate::drawing::{Chart, Drawn, Sheet, Stroke};

/// Each shape has the same stroke in all drawings.
const SHAPES: [&str; 3] = ["sin2", "trapezoid", "s-curve"];

/// The quantity drawn, and its unit.
type Row = (&'static str, fn(&Sample) -> Option<f64>);

const ROWS: [Row; 4] = [
    ("position in steps", |sample| Some(sample.position)),
    ("speed in kHz", |sample| Some(sample.speed / 1e3)),
    ("acceleration in 10³ steps/s²", |sample| Some(sample.acceleration / 1e3)),
    ("jerk in 10⁶ steps/s³", |sample| sample.jerk.map(|jerk| jerk / 1e6)),
];

fn stroke(name: &str) -> Stroke {
    Stroke::number(SHAPES.iter().position(|known| *known == name).unwrap_or(SHAPES.len()))
}

/// Draws the moves over one another.
pub(super) fn svg(title: &str, moves: &[Move]) -> Drawn<String> {
    let mut sheet = Sheet::new(title, 1100);
    for made in moves {
        sheet.explain(stroke(made.name), format!("{}, {:.3} ms", made.name, made.duration() * 1e3));
    }
    let end = moves.iter().map(Move::duration).fold(1e-6, f64::max) * 1e3;
    for (name, value) in ROWS {
        let curve = |chart: Chart, made: &Move| {
            let points = made.curve.iter().filter_map(|sample| Some((sample.time * 1e3, value(sample)?)));
            chart.with(stroke(made.name), points.collect())
        };
        sheet.panel(300, moves.iter().fold(Chart::new(name, "time in ms", 0.0..end), curve));
    }
    sheet.svg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::nothing_is_covered;
    use step_motion::Limits;
    use step_profile::{Parameters, Profile, Speed};

    #[test]
    fn all_shapes_can_be_drawn_over_one_another() {
        let profile = Profile::new(Parameters::at(Speed::KHZ_100)).unwrap();
        let limits = Limits::new(100_000, 1_000_000).unwrap();
        for steps in [1, 64, 9000] {
            let moves = [
                Move::sin2(profile, steps),
                Move::planned(limits, steps).unwrap(),
                Move::planned(limits.with_jerk(1 << 30).unwrap(), steps).unwrap(),
            ];
            let svg = svg("a move", &moves).unwrap();
            for text in ["position", "speed in kHz", "acceleration", "jerk", "sin2", "trapezoid", "s-curve"] {
                assert!(svg.contains(text), "{steps} steps: {text}");
            }
            nothing_is_covered(&svg);
        }
    }
}
