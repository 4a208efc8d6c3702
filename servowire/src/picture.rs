//! One picture of a capture: position over time, errors on the same axis, and how long answers took.

use std::collections::BTreeMap;
use std::error::Error;
use std::io;

use plotters::coord::Shift;
use plotters::prelude::*;

use servowire_decode::event::{Event, Place, Position, Verdict};
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::time::Time;

/// Buckets of a time axis; when there are more, two become one.
const MOST: usize = 2000;
/// Bars of a histogram.
const MOST_BARS: usize = 160;
/// Width of the first buckets, in picoseconds: of times, of delays.
const FIRST: i128 = 1_000_000;
const FIRST_BAR: i128 = 10_000;
/// Classes of errors that have a row of their own.
const MOST_CLASSES: usize = 12;

type Drawn = Result<(), Box<dyn Error>>;
type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// What a bucket gathers.
trait Gather: Clone {
    /// The later bucket becomes part of this one.
    fn join(&mut self, later: &Self);
}

/// Least and most of a curve, first and last.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    first: f64,
    least: f64,
    most: f64,
    last: f64,
}

impl Gather for Span {
    fn join(&mut self, later: &Self) {
        self.least = self.least.min(later.least);
        self.most = self.most.max(later.most);
        self.last = later.last;
    }
}

impl Gather for u64 {
    fn join(&mut self, later: &Self) {
        *self += later;
    }
}

/// Values by time (or by length), in buckets that grow with the capture: memory is bounded however long it is.
#[derive(Debug, Clone)]
struct Buckets<T> {
    width: i128,
    most: usize,
    held: BTreeMap<i128, T>,
}

impl<T: Gather> Buckets<T> {
    fn new(width: i128, most: usize) -> Self {
        Self { width, most, held: BTreeMap::new() }
    }

    fn add(&mut self, at: i128, value: &T) {
        self.held.entry(at.div_euclid(self.width)).and_modify(|bucket| bucket.join(value)).or_insert(value.clone());
        while self.held.len() > self.most {
            self.width = self.width.saturating_mul(2);
            let mut joined: BTreeMap<i128, T> = BTreeMap::new();
            for (index, bucket) in std::mem::take(&mut self.held) {
                joined.entry(index.div_euclid(2)).and_modify(|first| first.join(&bucket)).or_insert(bucket);
            }
            self.held = joined;
        }
    }

    /// The beginnings of the buckets and what they hold.
    fn iter(&self) -> impl Iterator<Item = (i128, &T)> {
        self.held.iter().map(|(index, value)| (index.saturating_mul(self.width), value))
    }
}

/// Positions of one line that can be compared with each other.
#[derive(Debug, Clone)]
struct Curve {
    /// The name of the line.
    name: String,
    turns: bool,
    count: u64,
    values: Buckets<Span>,
}

impl Printer for Picture {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        self.add(origin, event);
        Ok(())
    }
}

/// A line, and an address on it where the frames tell it.
type Speaker = (usize, Option<u32>);

/// Gathers what is drawn.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    title: String,
    /// By line and address, and by the counts after which the value begins again.
    curves: BTreeMap<(Speaker, Option<u64>), Curve>,
    delays: Buckets<u64>,
    errors: BTreeMap<&'static str, Buckets<u64>>,
    /// First and last time.
    extent: Option<(Time, Time)>,
}

impl Picture {
    /// An empty one.
    pub(crate) fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            curves: BTreeMap::new(),
            delays: Buckets::new(FIRST_BAR, MOST_BARS),
            errors: BTreeMap::new(),
            extent: None,
        }
    }

    fn add(&mut self, origin: &Origin, event: &Event) {
        let Place::Time { start, end } = event.place else { return };
        let (first, last) = self.extent.unwrap_or((start, end));
        self.extent = Some((first.min(start), last.max(end)));
        if let Some(delay) = event.delay {
            self.delays.add(delay.into(), &1);
        }
        if let Verdict::Refused(refusal) = &event.verdict {
            let rows = self.errors.len();
            let class =
                if rows < MOST_CLASSES || self.errors.contains_key(refusal.class) { refusal.class } else { "other" };
            self.errors.entry(class).or_insert_with(|| Buckets::new(FIRST, MOST)).add(start.ps(), &1);
        }
        if let Some(position) = event.position {
            self.position(origin, event.address, start, position);
        }
    }

    fn position(&mut self, origin: &Origin, address: Option<u32>, time: Time, position: Position) {
        let turns = position.turns();
        let curve = self.curves.entry(((origin.speaks, address), position.span)).or_insert_with(|| Curve {
            name: match (origin.lane(), address) {
                (lane, Some(address)) => {
                    let line = lane.map_or_else(String::new, |lane| format!("{} ", lane.channel));
                    format!("{line}axis {address}")
                }
                (lane, None) => lane.map_or_else(String::new, |lane| lane.channel.clone()),
            },
            turns: turns.is_some(),
            count: 0,
            values: Buckets::new(FIRST, MOST),
        });
        let value = if curve.turns { turns } else { Some(position.counts as f64) };
        if let Some(value) = value {
            curve.count += 1;
            curve.values.add(time.ps(), &Span { first: value, least: value, most: value, last: value });
        }
    }

    /// The picture as SVG.
    pub(crate) fn draw(&self) -> Result<String, Box<dyn Error>> {
        let mut svg = String::new();
        self.draw_on(&SVGBackend::with_string(&mut svg, (1000, 900)).into_drawing_area())?;
        Ok(svg)
    }

    fn draw_on(&self, root: &Area<'_>) -> Drawn {
        root.fill(&WHITE)?;
        let root = root.titled(&self.title, ("sans-serif", 18))?;
        let (positions, rest) = root.split_vertically(390);
        let (errors, delays) = rest.split_vertically(210);
        self.draw_positions(&positions)?;
        self.draw_errors(&errors)?;
        self.draw_delays(&delays)?;
        root.present()?;
        Ok(())
    }

    /// The time axis, in milliseconds.
    fn milliseconds(&self) -> std::ops::Range<f64> {
        let (first, last) = self.extent.unwrap_or((Time::ZERO, Time::ZERO + 1));
        let (first, last) = (first.ps() as f64 / 1e9, last.ps() as f64 / 1e9);
        first..last.max(first + 1e-6)
    }

    fn draw_positions(&self, area: &Area<'_>) -> Drawn {
        // Of each line the curve that has most points; turns and counts do not go together.
        let mut best: BTreeMap<Speaker, &Curve> = BTreeMap::new();
        for ((speaker, _), curve) in &self.curves {
            if best.get(speaker).is_none_or(|known| (known.turns, known.count) < (curve.turns, curve.count)) {
                best.insert(*speaker, curve);
            }
        }
        let turns = best.values().any(|curve| curve.turns);
        best.retain(|_, curve| curve.turns == turns);
        let all = || best.values().flat_map(|curve| curve.values.iter()).map(|(_, span)| span);
        let low = all().map(|span| span.least).fold(f64::INFINITY, f64::min);
        let high = all().map(|span| span.most).fold(f64::NEG_INFINITY, f64::max);
        let (low, high) = if low <= high { (low, high) } else { (0.0, 1.0) };
        let room = ((high - low) * 0.05).max(high.abs() * 1e-9).max(1e-6);
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(32)
            .y_label_area_size(90)
            .build_cartesian_2d(self.milliseconds(), low - room..high + room)?;
        let unit = if turns { "position in turns" } else { "position in counts" };
        chart.configure_mesh().x_desc("time in ms").y_desc(unit).light_line_style(WHITE).draw()?;
        for (row, curve) in best.values().enumerate() {
            let colour = Palette99::pick(row).to_rgba();
            let points = curve.values.iter().flat_map(|(time, span)| {
                let time = time as f64 / 1e9;
                [(time, span.first), (time, span.least), (time, span.most), (time, span.last)]
            });
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(1)))?
                .label(curve.name.as_str())
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 16, y)], colour.stroke_width(2)));
        }
        if best.len() > 1 {
            chart.configure_series_labels().background_style(WHITE).border_style(BLACK).draw()?;
        }
        Ok(())
    }

    fn draw_errors(&self, area: &Area<'_>) -> Drawn {
        let rows: Vec<(&&'static str, &Buckets<u64>)> = self.errors.iter().collect();
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(32)
            .y_label_area_size(90)
            .build_cartesian_2d(self.milliseconds(), 0.0..rows.len().max(1) as f64)?;
        let title = if rows.is_empty() { "no errors" } else { "errors" };
        chart
            .configure_mesh()
            .x_desc("time in ms")
            .y_desc(title)
            .y_labels(0)
            .disable_y_mesh()
            .light_line_style(WHITE)
            .draw()?;
        let (_, pixels) = area.dim_in_pixel();
        for (row, (class, buckets)) in rows.iter().enumerate() {
            let y = rows.len() as f64 - row as f64;
            let colour = Palette99::pick(row).to_rgba();
            let marks = buckets.iter().map(|(time, _)| {
                let time = time as f64 / 1e9;
                PathElement::new(vec![(time, y - 0.8), (time, y - 0.2)], colour.stroke_width(1))
            });
            chart.draw_series(marks)?;
            let count: u64 = buckets.iter().map(|(_, count)| *count).sum();
            let at = ((rows.len() as f64 - y + 0.5) * (f64::from(pixels) - 52.0) / rows.len() as f64) as i32 + 10;
            area.draw(&Text::new(format!("{class} {count}"), (104, at - 6), ("sans-serif", 12).into_font()))?;
        }
        Ok(())
    }

    fn draw_delays(&self, area: &Area<'_>) -> Drawn {
        let width = self.delays.width;
        let first = self.delays.iter().next().map_or(0, |(delay, _)| delay);
        let last = self.delays.iter().last().map_or(FIRST, |(delay, _)| delay + width);
        let most = self.delays.iter().map(|(_, count)| *count).max().unwrap_or(1);
        let us = |delay: i128| delay as f64 / 1e6;
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(32)
            .y_label_area_size(90)
            .build_cartesian_2d(us(first - width)..us(last + width), 0.0..most as f64 * 1.05)?;
        let title = if self.delays.held.is_empty() { "no answers to requests" } else { "answers" };
        chart.configure_mesh().x_desc("answer delay in us").y_desc(title).light_line_style(WHITE).draw()?;
        let colour = Palette99::pick(0).to_rgba();
        let bars = self.delays.iter().map(|(delay, count)| {
            Rectangle::new([(us(delay), 0.0), (us(delay + width), *count as f64)], colour.filled())
        });
        chart.draw_series(bars)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buckets_grow_and_lose_nothing() {
        let mut buckets = Buckets::new(1, 100);
        for k in 0..10_000 {
            buckets.add(k, &1_u64);
        }
        assert!(buckets.held.len() <= 100 && buckets.width == 128, "{}", buckets.width);
        assert_eq!(buckets.iter().map(|(_, count)| *count).sum::<u64>(), 10_000);
        let mut curve = Buckets::new(1, 4);
        for (at, value) in [(0, 1.0), (5, 9.0), (6, -2.0), (7, 3.0), (100, 4.0), (1000, 5.0)] {
            curve.add(at, &Span { first: value, least: value, most: value, last: value });
        }
        let spans: Vec<_> = curve.iter().map(|(_, span)| *span).collect();
        let ends = [spans[0].first, spans.last().unwrap().last];
        let extremes = spans.iter().fold([0.0; 2], |[low, high], span| [span.least.min(low), span.most.max(high)]);
        assert!(ends.iter().chain(&extremes).zip([1.0, 5.0, -2.0, 9.0]).all(|(is, due)| (is - due).abs() < 1e-12));
    }
}
