//! The stroke of a curve.

use plotters::coord::CoordTranslate;
use plotters::prelude::*;

use super::{Area, Drawn, INK, SMALL, ink};

/// A colour, a width, and pixels drawn and omitted; none omitted is a solid line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Stroke {
    colour: RGBColor,
    width: u32,
    dash: (u32, u32),
}

/// Maximum number of points on a curve that are marked one by one.
const FEW: usize = 160;

/// The stroke for whatever is wrong.
pub(crate) const ALARM: Stroke = Stroke { colour: RGBColor(176, 0, 32), width: 2, dash: (1, 0) };

impl Stroke {
    /// Wide strokes are drawn first, so that thinner ones lie on top.
    pub(crate) const ALL: [Self; 4] = [
        Self { colour: RGBColor(200, 90, 0), width: 3, dash: (1, 0) },
        Self { colour: RGBColor(0, 90, 180), width: 2, dash: (12, 6) },
        Self { colour: RGBColor(0, 130, 70), width: 2, dash: (4, 4) },
        Self { colour: RGBColor(122, 60, 160), width: 2, dash: (16, 4) },
    ];

    /// The stroke of a single curve.
    pub(crate) const ONLY: Self = Self { colour: RGBColor(0, 90, 180), width: 2, dash: (1, 0) };

    /// Returns stroke number `at`, from 0.
    pub(crate) fn number(at: usize) -> Self {
        Self::ALL.get(at).copied().unwrap_or(Self { colour: INK, width: 1, dash: (1, 0) })
    }

    pub(crate) fn style(self) -> ShapeStyle {
        self.colour.stroke_width(self.width)
    }

    pub(crate) fn filled(self) -> ShapeStyle {
        self.colour.filled()
    }

    /// Draws a curve into a chart.
    pub(super) fn curve<C>(self, chart: &mut ChartContext<'_, SVGBackend<'_>, C>, points: &[(f64, f64)]) -> Drawn
    where
        C: CoordTranslate<From = (f64, f64)>,
    {
        let (drawn, gap) = self.dash;
        // A line through few points does not show where they are, and one point is none.
        if self == Self::ONLY && points.len() <= FEW {
            let mut places: Vec<(f64, f64)> = points.to_vec();
            places.dedup();
            chart.draw_series(places.into_iter().map(|place| Circle::new(place, 3, self.filled())))?;
        }
        let points = points.iter().copied();
        if gap == 0 {
            chart.draw_series(LineSeries::new(points, self.style()))?;
        } else {
            // Its dashes are counted on from point to point.
            chart.draw_series(DashedLineSeries::new(points, drawn, gap, self.style()))?;
        }
        Ok(())
    }

    /// Draws a sample of `long` pixels at `at`, and its meaning.
    pub(super) fn sample(self, area: &Area<'_>, (left, y): (i32, i32), long: i32, what: &str) -> Drawn {
        let (drawn, gap) = (self.dash.0 as i32, self.dash.1 as i32);
        let (end, mut from) = (left + long, left);
        while from < end {
            let to = if gap == 0 { end } else { (from + drawn).min(end) };
            area.draw(&PathElement::new(vec![(from, y), (to, y)], self.style()))?;
            from = to + gap;
        }
        area.draw(&Text::new(what.to_owned(), (end + 8, y - SMALL as i32 / 2), ink(SMALL)))?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn strokes_differ_in_colour_and_in_dash() {
        let colours: BTreeSet<_> = Stroke::ALL.iter().map(|stroke| stroke.colour.rgb()).collect();
        let dashes: BTreeSet<_> = Stroke::ALL.iter().map(|stroke| stroke.dash).collect();
        assert_eq!((colours.len(), dashes.len()), (Stroke::ALL.len(), Stroke::ALL.len()));
    }
}
