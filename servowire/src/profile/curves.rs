//! Position, speed, acceleration and jerk of moves over time as SVG.

use std::error::Error;

use plotters::prelude::*;

use super::motion::{Move, Sample};
use super::stroke::Stroke;

/// A shape has its stroke, wherever it is drawn.
const SHAPES: [&str; 3] = ["sin2", "trapezoid", "s-curve"];

/// What is drawn, in which unit.
type Row = (&'static str, fn(&Sample) -> Option<f64>);

const ROWS: [Row; 4] = [
    ("position [steps]", |sample| Some(sample.position)),
    ("speed [kHz]", |sample| Some(sample.speed / 1e3)),
    ("acceleration [10³ steps/s²]", |sample| Some(sample.acceleration / 1e3)),
    ("jerk [10⁶ steps/s³]", |sample| sample.jerk.map(|jerk| jerk / 1e6)),
];

fn stroke(name: &str) -> Stroke {
    Stroke::number(SHAPES.iter().position(|known| *known == name).unwrap_or(SHAPES.len()))
}

/// The moves over one another. The legend stands above the plots.
pub(super) fn svg(title: &str, moves: &[Move]) -> Result<String, Box<dyn Error>> {
    let mut drawing = String::new();
    let root = SVGBackend::with_string(&mut drawing, (1100, 1280)).into_drawing_area();
    root.fill(&WHITE)?;
    let (head, body) = root.titled(title, ("sans-serif", 22))?.split_vertically(34);
    for (at, made) in (0..).zip(moves) {
        let label = format!("{}, {:.3} ms", made.name, made.duration() * 1e3);
        stroke(made.name).legend(&head, 90 + at * 300, &label)?;
    }
    let end = moves.iter().map(Move::duration).fold(1e-6, f64::max) * 1e3;
    for (area, (name, value)) in body.split_evenly((4, 1)).iter().zip(ROWS) {
        let all = || moves.iter().flat_map(|made| made.curve.iter().filter_map(value));
        let (low, high) = (all().fold(0.0, f64::min), all().fold(1e-9, f64::max));
        let mut chart = ChartBuilder::on(area);
        chart.margin(12).x_label_area_size(36).y_label_area_size(86);
        let mut chart = chart.build_cartesian_2d(0.0..end, low * 1.08..high * 1.08)?;
        chart
            .configure_mesh()
            .max_light_lines(0)
            .x_desc("time [ms]")
            .y_desc(name)
            .label_style(("sans-serif", 13))
            .draw()?;
        for made in moves {
            let points = made.curve.iter().filter_map(|sample| Some((sample.time * 1e3, value(sample)?)));
            stroke(made.name).curve(&mut chart, points)?;
        }
    }
    root.present()?;
    drop((root, head, body));
    Ok(drawing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::profile::stroke::geometry::nothing_is_covered;
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
            assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"), "{steps} steps");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{steps} steps");
            for text in ["position", "speed [kHz]", "acceleration", "jerk", "sin2", "trapezoid", "s-curve"] {
                assert!(svg.contains(text), "{steps} steps: {text}");
            }
            nothing_is_covered(&svg);
        }
    }
}
