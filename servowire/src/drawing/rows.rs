//! A panel of named rows over a common axis: who does what and when, or what went wrong and where.

use std::ops::Range;

use plotters::prelude::*;

use super::chart::{decimals, fixed, widest_of};
use super::{ALARM, Area, Drawn, GRID, INK, Panel, SHADE, SMALL, ink, shortened, width_of};

const TITLE: i32 = 24;
const BELOW: i32 = 36;
/// The height of a row.
const ROW: i32 = 22;
/// Names and notes are cut at these widths.
const WIDEST: (i32, i32) = (260, 420);

/// Rows, one below the other.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rows {
    pub(crate) title: String,
    /// The quantity along the axis, with its unit.
    pub(crate) along: String,
    pub(crate) x: Range<f64>,
    pub(crate) each: Vec<Row>,
}

/// A row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    /// Text to the left of the row.
    pub(crate) name: String,
    /// Text to the right of the row.
    pub(crate) note: String,
    /// Intervals in which something was done.
    pub(crate) bars: Vec<Range<f64>>,
    /// Instants at which something went wrong.
    pub(crate) faults: Vec<f64>,
}

impl Rows {
    /// Returns the height that the rows need.
    pub(crate) fn height(&self) -> u32 {
        (TITLE + BELOW + 12 + ROW * self.each.len().max(1) as i32) as u32
    }
}

impl Panel for Rows {
    fn draw(&self, area: &Area<'_>) -> Drawn {
        let width = area.dim_in_pixel().0 as i32;
        area.draw(&Text::new(shortened(&self.title, SMALL, width - 20), (10, 6), ink(SMALL)))?;
        let widest = |of: fn(&Row) -> &String, most: i32| {
            self.each.iter().map(|row| width_of(of(row), SMALL)).max().unwrap_or(0).min(most)
        };
        let (names, notes) = (widest(|row| &row.name, WIDEST.0), widest(|row| &row.note, WIDEST.1));
        // Half of the first and of the last label stands beyond the ends of the axis.
        let each = widest_of(&self.x, 8);
        let (left, right) = ((names + 20).max(each / 2 + 6), (notes + 34).max(each / 2 + 6));
        let (_, body) = area.split_vertically(TITLE);
        let mut builder = ChartBuilder::on(&body);
        builder.margin_right(right).margin_top(6).x_label_area_size(BELOW).y_label_area_size(left);
        let count = self.each.len().max(1);
        let mut chart = builder.build_cartesian_2d(self.x.clone(), 0.0..count as f64)?;
        let digits = decimals(&self.x, 8);
        chart
            .configure_mesh()
            .axis_style(INK)
            .bold_line_style(GRID)
            .max_light_lines(0)
            .disable_y_mesh()
            .y_labels(0)
            .x_labels(((width - left - right) / (each + 24)).clamp(2, 11) as usize)
            .x_label_formatter(&|x| fixed(*x, digits))
            .label_style(ink(SMALL))
            .axis_desc_style(ink(SMALL))
            .x_desc(self.along.as_str())
            .draw()?;
        let plot = chart.plotting_area().get_pixel_range();
        for (at, row) in self.each.iter().enumerate() {
            let (top, bottom) = ((count - at) as f64 - 0.15, (count - at) as f64 - 0.85);
            for bar in &row.bars {
                let corners = [(bar.start, bottom), (bar.end, top)];
                chart.draw_series([
                    Rectangle::new(corners, SHADE.filled()),
                    Rectangle::new(corners, INK.stroke_width(1)),
                ])?;
            }
            let fault = |x: &f64| PathElement::new(vec![(*x, bottom), (*x, top)], ALARM.style());
            chart.draw_series(row.faults.iter().map(fault))?;
            let base = body.get_pixel_range();
            let y = plot.1.start - base.1.start
                + (at as i32 * 2 + 1) * (plot.1.end - plot.1.start) / (2 * count as i32)
                - SMALL as i32 / 2;
            body.draw(&Text::new(shortened(&row.name, SMALL, WIDEST.0), (10, y), ink(SMALL)))?;
            let beside = (plot.0.end - base.0.start + 12, y);
            body.draw(&Text::new(shortened(&row.note, SMALL, WIDEST.1), beside, ink(SMALL)))?;
        }
        Ok(())
    }
}
