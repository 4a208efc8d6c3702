//! A panel of curves or bars over an axis.

use std::ops::Range;

use plotters::prelude::*;

use super::{Area, Drawn, GRID, INK, Panel, SMALL, Stroke, ink, shortened, width_of};

/// Space for the title, for the labels below, and for the margins.
const TITLE: i32 = 24;
const BELOW: i32 = 36;
const LEFT: i32 = 6;
const RIGHT: i32 = 34;
const TOP: i32 = 6;
/// Minimum distance of labels in pixels.
const APART: i32 = 26;

/// Curves and bars; the title above it names the vertical quantity.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chart {
    pub(crate) title: String,
    /// The quantity along the axis, with its unit.
    pub(crate) along: String,
    pub(crate) x: Range<f64>,
    /// If unset, the range of the curves and bars.
    pub(crate) y: Option<Range<f64>>,
    /// The axis is logarithmic.
    pub(crate) logarithmic: bool,
    /// A unit has the same length on both axes, as for a path in a plane.
    pub(crate) equal: bool,
    pub(crate) curves: Vec<(Stroke, Vec<(f64, f64)>)>,
    /// Bars: from, to, and height.
    pub(crate) bars: Vec<(Range<f64>, f64)>,
}

impl Chart {
    /// Creates a chart with the quantities on both axes, and the horizontal range.
    pub(crate) fn new(title: impl Into<String>, along: impl Into<String>, x: Range<f64>) -> Self {
        Self { title: title.into(), along: along.into(), x, ..Self::default() }
    }

    /// Adds a curve.
    #[must_use]
    pub(crate) fn with(mut self, stroke: Stroke, points: Vec<(f64, f64)>) -> Self {
        self.curves.push((stroke, points));
        self
    }

    /// Returns the range from the lowest to the highest value, with some margin.
    fn up(&self) -> Range<f64> {
        if let Some(range) = &self.y {
            return range.clone();
        }
        let curves = self.curves.iter().flat_map(|(_, points)| points.iter().map(|(_, y)| *y));
        let bars = self.bars.iter().flat_map(|(_, y)| [0.0, *y]);
        let (low, high) =
            curves.chain(bars).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| (low.min(y), high.max(y)));
        match () {
            () if low > high => 0.0..1.0,
            () if self.logarithmic => low.max(1e-6) * 0.8..high.max(1e-6) * 1.25,
            () => {
                let room = ((high - low) * 0.06).max(high.abs().max(low.abs()) * 1e-9).max(1e-6);
                (if self.bars.is_empty() { low - room } else { 0.0 })..high + room
            }
        }
    }

    /// Returns both ranges; in a plane, the shorter one is extended.
    fn ranges(&self, pixels: (i32, i32)) -> (Range<f64>, Range<f64>) {
        let (x, y) = (self.x.clone(), self.up());
        if !self.equal {
            return (x, y);
        }
        let a_pixel = |range: &Range<f64>, pixels: i32| (range.end - range.start) / f64::from(pixels.max(1));
        let most = a_pixel(&x, pixels.0).max(a_pixel(&y, pixels.1));
        let longer = |range: Range<f64>, pixels: i32| {
            let (middle, half) = (f64::midpoint(range.start, range.end), most * f64::from(pixels.max(1)) / 2.0);
            middle - half..middle + half
        };
        (longer(x, pixels.0), longer(y, pixels.1))
    }
}

impl Panel for Chart {
    fn draw(&self, area: &Area<'_>) -> Drawn {
        let (width, height) = (area.dim_in_pixel().0 as i32, area.dim_in_pixel().1 as i32);
        let title = shortened(&self.title, SMALL, width - 2 * LEFT);
        area.draw(&Text::new(title, (LEFT + 4, 6), ink(SMALL)))?;
        let up = self.up();
        let labels = (height - TITLE - BELOW) / APART;
        let label = if self.logarithmic { any as fn(f64, usize) -> String } else { fixed };
        let digits = decimals(&up, labels.max(1));
        let widest = [up.start, up.end].map(|y| width_of(&label(y, digits), SMALL)).into_iter().max().unwrap_or(0);
        let beside = widest.max(40) + 12;
        // Half of the last label stands beyond the end of its axis.
        let right = RIGHT.max(widest_of(&self.x, 8) / 2 + 6);
        let pixels = (width - LEFT - right - beside, height - TITLE - TOP - BELOW);
        let (x, y) = self.ranges(pixels);
        let (_, body) = area.split_vertically(TITLE);
        let mut builder = ChartBuilder::on(&body);
        builder
            .margin_left(LEFT)
            .margin_right(right)
            .margin_top(TOP)
            .x_label_area_size(BELOW)
            .y_label_area_size(beside);
        let along = decimals(&x, 8);
        let across = (pixels.0 / (widest_of(&x, 8) + 24)).clamp(2, 11) as usize;
        // The two kinds of axes are of different types, so the few calls are there twice.
        macro_rules! fill {
            ($chart:expr) => {{
                let mut chart = $chart;
                chart
                    .configure_mesh()
                    .axis_style(INK)
                    .bold_line_style(GRID)
                    .max_light_lines(0)
                    .x_labels(across)
                    .y_labels(labels.clamp(2, 8) as usize)
                    .x_label_formatter(&|x| fixed(*x, along))
                    .y_label_formatter(&|y| label(*y, digits))
                    .label_style(ink(SMALL))
                    .axis_desc_style(ink(SMALL))
                    .x_desc(self.along.as_str())
                    .draw()?;
                for (bar, high) in &self.bars {
                    let corners = [(bar.start, 0.0), (bar.end, *high)];
                    chart.draw_series([Rectangle::new(corners, Stroke::ONLY.filled())])?;
                }
                for (stroke, points) in &self.curves {
                    stroke.curve(&mut chart, points)?;
                }
            }};
        }
        if self.logarithmic {
            fill!(builder.build_cartesian_2d(x, y.log_scale())?);
        } else {
            fill!(builder.build_cartesian_2d(x, y)?);
        }
        Ok(())
    }
}

/// Returns the digits after the point needed to tell `labels` labels of a range apart.
pub(super) fn decimals(range: &Range<f64>, labels: i32) -> usize {
    let step = (range.end - range.start).abs() / f64::from(labels) / 2.0;
    (-step.max(1e-9).log10()).ceil().clamp(0.0, 9.0) as usize
}

/// Returns the pixels of the widest label of a range.
pub(super) fn widest_of(range: &Range<f64>, labels: i32) -> i32 {
    let digits = decimals(range, labels);
    [range.start, range.end].map(|value| width_of(&fixed(value, digits), SMALL)).into_iter().max().unwrap_or(0)
}

/// Formats a number with this many digits after the point, and zero without a sign.
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches(['-', '0', '.']).is_empty() { text.trim_start_matches('-').to_owned() } else { text }
}

/// Formats a number of any size.
fn any(value: f64, _: usize) -> String {
    if value >= 1.0 { format!("{value:.0}") } else { format!("{value:.3}") }
}
