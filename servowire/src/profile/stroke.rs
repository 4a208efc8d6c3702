//! How a curve is drawn: each has a colour and a dash of its own, so that it is told apart in black and white too.

use std::error::Error;

use plotters::coord::Shift;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

/// A colour, a width, and pixels drawn and left out; nothing left out is a solid line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stroke {
    colour: RGBColor,
    width: u32,
    dash: (u32, u32),
}

pub(super) type Chart<'a, 'b> = ChartContext<'a, SVGBackend<'b>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

impl Stroke {
    /// Wide ones are drawn first, so that thinner ones lie on top.
    pub(super) const ALL: [Self; 3] = [
        Self { colour: RGBColor(200, 90, 0), width: 3, dash: (1, 0) },
        Self { colour: RGBColor(0, 90, 180), width: 2, dash: (12, 6) },
        Self { colour: RGBColor(0, 130, 70), width: 2, dash: (4, 4) },
    ];

    /// Number `at`, from 0.
    pub(super) fn number(at: usize) -> Self {
        Self::ALL.get(at).copied().unwrap_or(Self { colour: BLACK, width: 1, dash: (1, 0) })
    }

    fn style(self) -> ShapeStyle {
        self.colour.stroke_width(self.width)
    }

    /// Draws a curve into a chart.
    pub(super) fn curve(
        self,
        chart: &mut Chart<'_, '_>,
        points: impl Iterator<Item = (f64, f64)>,
    ) -> Result<(), Box<dyn Error>> {
        let points: Vec<_> = points.collect();
        let (drawn, gap) = self.dash;
        if gap == 0 {
            chart.draw_series(LineSeries::new(points, self.style()))?;
        } else {
            // Its dashes are counted on from point to point.
            chart.draw_series(DashedLineSeries::new(points, drawn, gap, self.style()))?;
        }
        Ok(())
    }

    /// Draws a sample and what it stands for, from `left` on.
    pub(super) fn legend(
        self,
        area: &DrawingArea<SVGBackend<'_>, Shift>,
        left: i32,
        label: &str,
    ) -> Result<(), Box<dyn Error>> {
        let (drawn, gap) = (i32::try_from(self.dash.0)?, i32::try_from(self.dash.1)?);
        let (end, mut from) = (left + 44, left);
        while from < end {
            let to = if gap == 0 { end } else { (from + drawn).min(end) };
            area.draw(&PathElement::new(vec![(from, 16), (to, 16)], self.style()))?;
            from = to + gap;
        }
        area.draw(&Text::new(label.to_owned(), (left + 52, 9), ("sans-serif", 15)))?;
        Ok(())
    }
}

/// What an SVG says about where things are.
#[cfg(test)]
pub(super) mod geometry {
    use super::*;
    use std::collections::BTreeSet;

    /// Left, top, right, bottom.
    type Box = [f64; 4];

    fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
        let from = tag.find(&format!(" {name}=\""))? + name.len() + 3;
        tag[from..].split('"').next()
    }

    fn number(tag: &str, name: &str) -> f64 {
        attribute(tag, name).and_then(|text| text.parse().ok()).unwrap_or(0.0)
    }

    /// The room of a text: letters are 0.62 as wide as high, which is wide.
    fn texts(svg: &str) -> Vec<(String, Box)> {
        let elements = svg.split("<text").skip(1);
        let room = |element: &str| {
            let (tag, rest) = element.split_once('>').unwrap();
            let words = rest.split("</text").next().unwrap().trim().to_owned();
            let size = number(tag, "font-size");
            let (x, y, wide) = (number(tag, "x"), number(tag, "y"), words.chars().count() as f64 * size * 0.62);
            let left = match attribute(tag, "text-anchor") {
                Some("middle") => x - wide / 2.0,
                Some("end") => x - wide,
                _ => x,
            };
            let top = match attribute(tag, "dy") {
                Some("0.76em") => y,
                Some("0.5ex") => y - size / 2.0,
                _ => y - size,
            };
            let flat = [left, top, left + wide, top + size];
            // Turned by 90° around its place.
            let turned = [x + top - y, y - (left + wide - x), x + top + size - y, y - (left - x)];
            (words, if tag.contains("rotate(") { turned } else { flat })
        };
        elements.map(room).collect()
    }

    /// The lines of these colours.
    fn lines(svg: &str, colours: &BTreeSet<String>) -> Vec<Vec<(f64, f64)>> {
        let elements = svg.split("<polyline").skip(1).map(|element| element.split('>').next().unwrap());
        let own = elements.filter(|tag| colours.contains(attribute(tag, "stroke").unwrap_or("")));
        let point = |text: &str| {
            let (x, y) = text.split_once(',')?;
            Some((x.parse().ok()?, y.parse().ok()?))
        };
        own.map(|tag| attribute(tag, "points").unwrap().split_whitespace().filter_map(point).collect()).collect()
    }

    /// No text stands on another one or on a curve.
    pub(in super::super) fn nothing_is_covered(svg: &str) {
        let colours: BTreeSet<String> = Stroke::ALL
            .iter()
            .map(|stroke| {
                let (r, g, b) = stroke.colour.rgb();
                format!("#{r:02X}{g:02X}{b:02X}")
            })
            .chain(["#0000FF".to_owned()])
            .collect();
        let (texts, lines) = (texts(svg), lines(svg, &colours));
        assert!(texts.len() > 10 && !lines.is_empty(), "{} texts, {} lines", texts.len(), lines.len());
        for (at, (words, [left, top, right, bottom])) in texts.iter().enumerate() {
            for (other, room) in texts.iter().skip(at + 1) {
                let apart = room[0] >= *right || room[2] <= *left || room[1] >= *bottom || room[3] <= *top;
                assert!(apart, "\"{words}\" covers \"{other}\": {:?} {room:?}", [left, top, right, bottom]);
            }
            for line in &lines {
                for pair in line.windows(2) {
                    // Points a pixel apart along the line.
                    let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
                    let parts = dx.abs().max(dy.abs()).ceil().max(1.0);
                    let mut part = 0.0;
                    while part <= parts {
                        let (x, y) = (pair[0].0 + dx * part / parts, pair[0].1 + dy * part / parts);
                        let off = x < *left || x > *right || y < *top || y > *bottom;
                        assert!(off, "\"{words}\" covers a curve at {x}, {y}");
                        part += 1.0;
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_covered_is_seen() {
        let covered = |x: f64| {
            let mut svg = String::new();
            let root = SVGBackend::with_string(&mut svg, (400, 300)).into_drawing_area();
            for row in 0..12 {
                root.draw(&Text::new("text", (200, row * 20), ("sans-serif", 12))).unwrap();
            }
            root.draw(&PathElement::new(vec![(x as i32, 0), (x as i32, 299)], Stroke::ALL[1].style())).unwrap();
            root.present().unwrap();
            drop(root);
            std::panic::catch_unwind(|| nothing_is_covered(&svg)).is_err()
        };
        assert!(covered(210.0) && !covered(190.0) && !covered(260.0));
    }

    #[test]
    fn strokes_differ_in_colour_and_in_dash() {
        let colours: BTreeSet<_> = Stroke::ALL.iter().map(|stroke| stroke.colour.rgb()).collect();
        let dashes: BTreeSet<_> = Stroke::ALL.iter().map(|stroke| stroke.dash).collect();
        assert_eq!((colours.len(), dashes.len()), (Stroke::ALL.len(), Stroke::ALL.len()));
    }
}
