//! Positions over time, as an SVG.

use std::error::Error;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::bench::{AXES, Sample};

/// Writes the positions of all axes, with marked moments (ms and text).
pub(crate) fn positions(path: &str, history: &[Sample], marks: &[(f64, &str)]) -> Result<(), Box<dyn Error>> {
    let begin = history.first().map_or(0.0, |(at, _)| *at);
    let end = history.last().map_or(1.0, |(at, _)| *at);
    let all = || history.iter().flat_map(|(_, positions)| positions.iter().copied());
    let (low, high) = (all().min().unwrap_or(0), all().max().unwrap_or(1));
    let margin = (high - low) / 20 + 1;

    let root = SVGBackend::new(path, (1_100, 640)).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption("RTEX ring: 32 axes, one drive goes silent", ("sans-serif", 22))
        .margin(14)
        .x_label_area_size(44)
        .y_label_area_size(86)
        .build_cartesian_2d(begin..end, low - margin..high + margin)?;
    chart
        .configure_mesh()
        .x_desc("time, ms")
        .y_desc("actual position, command units")
        .light_line_style(WHITE)
        .draw()?;
    for place in 0..AXES {
        let colour = HSLColor(place as f64 / AXES as f64 * 0.8, 0.7, 0.45);
        let points = history.iter().filter_map(|(at, all)| Some((*at, *all.get(place)?)));
        chart.draw_series(LineSeries::new(points, colour.stroke_width(1)))?;
    }
    // Marks that lie close together are written one below the other, away from the right edge.
    let line = (high - low) / 20;
    for (row, (at, text)) in (0..).zip(marks) {
        let x = *at;
        chart.draw_series(LineSeries::new([(x, low - margin), (x, high + margin)], BLACK.stroke_width(1)))?;
        let (text, y) = (format!("{text}, {x:.1} ms "), high + margin - line * (row + 1));
        let right = Pos::new(HPos::Right, VPos::Center);
        chart.draw_series([Text::new(
            text,
            (x, y),
            ("sans-serif", 14).into_font().into_text_style(&root).pos(right),
        )])?;
    }
    root.present()?;
    Ok(())
}
