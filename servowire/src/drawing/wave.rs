//! A panel with a frame on a line: its levels, its bits, its fields, and what is wrong.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::chart::{decimals, fixed};
use super::{ALARM, Area, Drawn, GRID, INK, Panel, SHADE, SMALL, Stroke, ink, shortened, width_of};
use crate::clip::{Clip, Trace};
use servowire_decode::event::Place;
use servowire_decode::output::text::shown;
use servowire_decode::time::Time;

/// Pixels per bit, so that it can be read.
const BIT: u32 = 10;
const WIDEST: u32 = 4000;
const LEFT: u32 = 120;
const RIGHT: u32 = 40;
/// Heights in pixels: of a channel, of a row of text, and of the space below.
const TRACE: u32 = 56;
const ROW: u32 = 18;
const BELOW: u32 = 40;

/// A clip as a panel.
pub(crate) struct Wave {
    clip: Clip,
    /// Labels of fields with their places, in rows so that they do not overlap.
    labels: Vec<Label>,
    width: u32,
}

struct Label {
    text: String,
    start: Time,
    end: Time,
    row: usize,
}

impl Wave {
    pub(crate) fn new(clip: Clip) -> Self {
        let bits = clip.bits().map_or(0, |bits| bits.levels.len() as u32);
        let width = (LEFT + RIGHT + BIT * (bits + 14)).clamp(1000, WIDEST);
        let mut wave = Self { clip, labels: Vec::new(), width };
        wave.label();
        wave
    }

    /// Returns the width that it needs.
    pub(crate) fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height that it needs.
    pub(crate) fn height(&self) -> u32 {
        let rows = 2 + self.labels.iter().map(|label| label.row as u32 + 1).max().unwrap_or(0);
        TRACE * self.clip.traces.len() as u32 + ROW * rows + BELOW + 12
    }

    /// Returns microseconds from the start of the frame.
    fn us(&self, time: Time) -> f64 {
        (time - self.clip.span().0) as f64 / 1e6
    }

    fn pixels(&self) -> f64 {
        f64::from(self.width - LEFT - RIGHT)
    }

    /// Puts the labels of the fields into rows.
    fn label(&mut self) {
        let a_pixel = (self.us(self.clip.to) - self.us(self.clip.from)) / self.pixels();
        let mut ends: Vec<f64> = Vec::new();
        let mut fields: Vec<_> = self
            .clip
            .event
            .fields
            .iter()
            .filter_map(|field| match field.span?.place {
                Place::Time { start, end } => Some((field, start, end)),
                Place::Line(_) => None,
            })
            .collect();
        fields.sort_by_key(|(_, start, _)| *start);
        for (field, start, end) in fields {
            let text = shortened(&shown(field), SMALL, 240);
            let middle = f64::midpoint(self.us(start), self.us(end));
            let half = f64::from(width_of(&text, SMALL)) / 2.0 * a_pixel;
            let row = ends.iter().position(|last| *last < middle - half).unwrap_or(ends.len());
            if row == ends.len() {
                ends.push(0.0);
            }
            if let Some(last) = ends.get_mut(row) {
                *last = middle + half + 8.0 * a_pixel;
            }
            self.labels.push(Label { text, start, end, row });
        }
    }

    /// Returns the corners of a trace between two heights.
    fn corners(&self, trace: &Trace, low: f64, high: f64) -> Vec<(f64, f64)> {
        let height = |level: bool| if level { high } else { low };
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (time, level) in &trace.edges {
            let at = self.us(*time);
            points.extend(points.last().map(|(_, y)| (at, *y)));
            points.push((at, height(*level)));
        }
        points.extend(points.last().map(|(_, y)| (self.us(self.clip.to), *y)));
        points
    }
}

impl Panel for Wave {
    fn draw(&self, area: &Area<'_>) -> Drawn {
        let clip = &self.clip;
        let rows = f64::from(self.height() - BELOW - 12);
        let (from, to) = (self.us(clip.from), self.us(clip.to));
        let mut builder = ChartBuilder::on(area);
        builder.margin_right(RIGHT).margin_top(12).x_label_area_size(BELOW).y_label_area_size(LEFT);
        let mut chart = builder.build_cartesian_2d(from..to, rows..0.0)?;
        let digits = decimals(&(from..to), 8);
        let each = width_of(&fixed(to, digits), SMALL) as u32 + 30;
        chart
            .configure_mesh()
            .axis_style(INK)
            .disable_mesh()
            .y_labels(0)
            .x_labels(((self.width - LEFT - RIGHT) / each).clamp(2, 20) as usize)
            .x_label_formatter(&|x| fixed(*x, digits))
            .label_style(ink(SMALL))
            .axis_desc_style(ink(SMALL))
            .x_desc(format!("us from the start of the frame, which is at {:.3} us", clip.span().0.us()))
            .draw()?;
        let lines = f64::from(TRACE) * clip.traces.len() as f64;
        if let Some((start, end)) = clip.broken() {
            let corners = [(self.us(start), 2.0), (self.us(end), lines + f64::from(ROW))];
            chart.draw_series([Rectangle::new(corners, ALARM.filled().color.mix(0.25).filled())])?;
        }
        let centre = ink(SMALL).pos(Pos::new(HPos::Center, VPos::Center));
        if let Some(bits) = clip.bits() {
            for bit in 0..=bits.levels.len() {
                let x = self.us(bits.begin(bit));
                chart.draw_series([PathElement::new(vec![(x, 4.0), (x, lines)], GRID.stroke_width(1))])?;
            }
            for (bit, level) in bits.levels.iter().enumerate() {
                let x = f64::midpoint(self.us(bits.begin(bit)), self.us(bits.begin(bit + 1)));
                let place = (x, lines + f64::from(ROW) / 2.0);
                chart.draw_series([Text::new(if *level { "1" } else { "0" }, place, centre.clone())])?;
            }
        }
        for (at, trace) in clip.traces.iter().enumerate() {
            let top = f64::from(TRACE) * at as f64;
            let corners = self.corners(trace, top + f64::from(TRACE) - 8.0, top + 10.0);
            chart.draw_series([PathElement::new(corners, Stroke::ONLY.style())])?;
            let name = shortened(&trace.name, SMALL, LEFT as i32 - 20);
            area.draw(&Text::new(name, (10, 12 + top as i32 + TRACE as i32 / 2 - 6), ink(SMALL)))?;
        }
        let below = lines + f64::from(ROW);
        for Label { text, start, end, row } in &self.labels {
            let (start, end) = (self.us(*start), self.us(*end));
            let corners = [(start, below + 2.0), (end, below + f64::from(ROW) - 4.0)];
            chart
                .draw_series([Rectangle::new(corners, SHADE.filled()), Rectangle::new(corners, INK.stroke_width(1))])?;
            let y = below + f64::from(ROW) * (*row as f64 + 1.5);
            chart.draw_series([Text::new(text.clone(), (f64::midpoint(start, end), y), centre.clone())])?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Sheet;
    use crate::drawing::geometry::nothing_is_covered;
    use servowire_decode::capture::Change;
    use servowire_decode::event::{Direction, Event, Field, Refusal, Span};
    use servowire_decode::output::printer::Lane;
    use servowire_decode::protocols::CODECS;

    /// Many narrow fields with long values beside each other, with and without a bit that is wrong.
    #[test]
    fn labels_of_narrow_fields_do_not_meet() {
        let start = Time::from_ps(1_000_000_000);
        let bit = |at: i64| start + at * 400_000;
        let field = |at: i64, long: i64, text: &str| Field {
            span: Some(Span { first: at as u32, last: 0, place: Place::Time { start: bit(at), end: bit(at + long) } }),
            ..Field::text("FIELD", text)
        };
        let fields = vec![
            field(0, 2, "a long value"),
            field(2, 2, "another long value"),
            field(4, 30, "one that is even longer than the others and than anybody would read"),
            field(34, 1, "x"),
            field(35, 5, "at the end of the frame"),
        ];
        let lane = Lane { channel: "A + B".to_owned(), channels: vec![0, 1], protocol: CODECS[0], rate: 2_500_000 };
        let broken = Refusal { field: None, bit: Some(3), time: Some(bit(20)), ..Refusal::new("crc", "wrong") };
        for verdict in [servowire_decode::event::Verdict::Ok, broken.into()] {
            let place = Place::Time { start, end: bit(40) };
            let event = Event::new(place, Some(Direction::Answer), "ID 3", fields.clone(), verdict);
            let mut clip =
                Clip::new(&event, &lane, &["A".to_owned(), "a channel with a long name".to_owned()]).unwrap();
            for at in -10..60 {
                let (channel, level) = (u16::from(at % 3 == 0), at % 2 == 0);
                clip.change(&Change { time: bit(at), channel, level });
            }
            let wave = Wave::new(clip);
            let mut sheet = Sheet::new("a frame", wave.width());
            sheet.panel(wave.height(), wave);
            nothing_is_covered(&sheet.svg().unwrap());
        }
    }
}
