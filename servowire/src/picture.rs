//! One picture of a capture: of each encoder its position over time and how long its answers took, and all errors on the same
//! axis.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;

use servowire_decode::event::{Event, Place, Position, Verdict};
use servowire_decode::output::printer::{Origin, Printer, Speaker};
use servowire_decode::time::Time;

use crate::drawing::{Chart, Drawn, Row, Rows, Share, Sheet, Stroke};

/// Maximum number of buckets on a time axis; when there are more, they are merged in pairs.
const MOST: usize = 2000;
/// Maximum number of bars in a histogram.
const MOST_BARS: usize = 160;
/// Initial width of a bucket in picoseconds, for times and for delays.
const FIRST: i128 = 1_000_000;
const FIRST_BAR: i128 = 10_000;
/// Maximum number of error classes with their own row, and of encoders with a panel.
const MOST_CLASSES: usize = 24;
const MOST_ENCODERS: usize = 32;
/// Instants later than this, in picoseconds, are shown relative to the first frame: 1000 s.
const LATE: i128 = 1_000_000_000_000_000;

/// The content of a bucket.
trait Gather: Clone {
    /// Merges a later bucket into this one.
    fn join(&mut self, later: &Self);
}

/// Minimum, maximum, first and last value of a curve.
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

/// Positions that can be compared.
#[derive(Debug, Clone)]
struct Curve {
    turns: bool,
    count: u64,
    values: Buckets<Span>,
}

/// The data of an encoder: its positions, by name and by the counts after which the value wraps, and its delays.
#[derive(Debug, Clone)]
struct Encoder {
    curves: BTreeMap<(&'static str, Option<u64>), Curve>,
    delays: Buckets<u64>,
}

/// Collects the data to draw.
#[derive(Debug, Clone)]
pub(crate) struct Picture {
    title: String,
    encoders: BTreeMap<Speaker, Encoder>,
    /// Errors by speaker and by class.
    errors: BTreeMap<(Speaker, &'static str), Buckets<u64>>,
    /// First and last instant.
    extent: Option<(Time, Time)>,
    /// The names of the speakers, once all lines are known.
    names: BTreeMap<Speaker, String>,
}

impl Printer for Picture {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        self.add(origin.speaker(event), event);
        Ok(())
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        let all = self.encoders.keys().chain(self.errors.keys().map(|(speaker, _)| speaker));
        self.names = all.map(|speaker| (*speaker, origin.name(*speaker))).collect();
        Ok(())
    }
}

impl Picture {
    /// Creates an empty picture.
    pub(crate) fn new(title: &str) -> Self {
        Self {
            title: title.to_owned(),
            encoders: BTreeMap::new(),
            errors: BTreeMap::new(),
            extent: None,
            names: BTreeMap::new(),
        }
    }

    /// Returns when the first frame begins, and when the last one ends.
    pub(crate) fn extent(&self) -> Option<(Time, Time)> {
        self.extent
    }

    fn add(&mut self, speaker: Speaker, event: &Event) {
        if event.misread {
            self.encoders.remove(&speaker);
            return;
        }
        let Place::Time { start, end } = event.place else { return };
        let (first, last) = self.extent.unwrap_or((start, end));
        self.extent = Some((first.min(start), last.max(end)));
        if let Verdict::Refused(refusal) = &event.verdict {
            let known = self.errors.len() < MOST_CLASSES || self.errors.contains_key(&(speaker, refusal.class));
            let class = if known { refusal.class } else { "other" };
            self.errors.entry((speaker, class)).or_insert_with(|| Buckets::new(FIRST, MOST)).add(start.ps(), &1);
        }
        if event.delay.is_none() && event.position.is_none() {
            return;
        }
        let encoder = self.encoders.entry(speaker).or_insert_with(Encoder::new);
        if let Some(delay) = event.delay {
            encoder.delays.add(delay.into(), &1);
        }
        if let Some(position) = event.position {
            encoder.position(start, position);
        }
    }

    /// Returns the picture as SVG.
    pub(crate) fn draw(&self) -> Drawn<String> {
        let more = self.encoders.len().saturating_sub(MOST_ENCODERS);
        let more = if more > 0 {
            format!(", the first {MOST_ENCODERS} of {} encoders", more + MOST_ENCODERS)
        } else {
            String::new()
        };
        let mut sheet = Sheet::new(&format!("{}{more}", self.title), 1000);
        let clock = Clock::of(self.extent);
        for (speaker, encoder) in self.encoders.iter().take(MOST_ENCODERS) {
            let name = self.names.get(speaker).filter(|name| !name.is_empty());
            encoder.draw(name.map_or("", String::as_str), &clock, &mut sheet);
        }
        let rows = self.rows(&clock);
        sheet.panel(rows.height(), rows);
        sheet.svg()
    }

    fn rows(&self, clock: &Clock) -> Rows {
        let row = |((speaker, class), buckets): (&(Speaker, &'static str), &Buckets<u64>)| {
            let count: u64 = buckets.iter().map(|(_, count)| *count).sum();
            let who = self.names.get(speaker).filter(|name| !name.is_empty());
            Row {
                name: who.map_or_else(|| (*class).to_owned(), |who| format!("{who}: {class}")),
                note: count.to_string(),
                faults: buckets.iter().map(|(time, _)| clock.show(time)).collect(),
                ..Row::default()
            }
        };
        let title = if self.errors.is_empty() { "no errors" } else { "errors" };
        Rows {
            title: title.to_owned(),
            along: clock.label.clone(),
            x: clock.range.clone(),
            each: self.errors.iter().map(row).collect(),
        }
    }
}

impl Encoder {
    fn new() -> Self {
        Self { curves: BTreeMap::new(), delays: Buckets::new(FIRST_BAR, MOST_BARS) }
    }

    fn position(&mut self, time: Time, position: Position) {
        let turns = position.turns();
        let curve = self.curves.entry((position.name, position.span)).or_insert_with(|| Curve {
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

    /// Draws its positions below each other, with the delays beside the first one.
    fn draw(&self, who: &str, clock: &Clock, sheet: &mut Sheet) {
        let of = if who.is_empty() { String::new() } else { format!("{who}: ") };
        // Of each name the curve that has most points; turns and counts do not go together.
        let mut best: BTreeMap<&str, &Curve> = BTreeMap::new();
        for ((name, _), curve) in &self.curves {
            if best.get(name).is_none_or(|known| (known.turns, known.count) < (curve.turns, curve.count)) {
                best.insert(name, curve);
            }
        }
        let curve = |(name, curve): (&&str, &&Curve)| -> Share {
            let unit = if curve.turns { "turns" } else { "counts" };
            let title = format!("{of}position {name} in {unit}");
            let points = curve.values.iter().flat_map(|(time, span)| {
                let time = clock.show(time);
                [(time, span.first), (time, span.least), (time, span.most), (time, span.last)]
            });
            let chart = Chart::new(title, &clock.label, clock.range.clone());
            (3, Box::new(chart.with(Stroke::ONLY, points.collect())))
        };
        let delays = (!self.delays.held.is_empty()).then(|| -> Share { (2, Box::new(self.delays(&of))) });
        let mut curves = best.iter().map(curve);
        let first: Vec<_> = curves.next().into_iter().chain(delays).collect();
        sheet.beside(230, first);
        curves.for_each(|panel| sheet.beside(230, vec![panel]));
    }

    fn delays(&self, of: &str) -> Chart {
        let width = self.delays.width;
        let us = |delay: i128| delay as f64 / 1e6;
        let first = self.delays.iter().next().map_or(0, |(delay, _)| delay);
        let last = self.delays.iter().last().map_or(FIRST, |(delay, _)| delay + width);
        let bars = self.delays.iter().map(|(delay, count)| (us(delay)..us(delay + width), *count as f64));
        let chart =
            Chart::new(format!("{of}answers by their delay"), "delay in us", us(first - width)..us(last + width));
        Chart { bars: bars.collect(), ..chart }
    }
}

/// The time axis: its unit, and its origin.
struct Clock {
    origin: i128,
    unit: f64,
    label: String,
    range: Range<f64>,
}

impl Clock {
    fn of(extent: Option<(Time, Time)>) -> Self {
        let (first, last) = extent.unwrap_or((Time::ZERO, Time::ZERO + 1));
        let late = first.ps().abs() > LATE;
        let origin = if late { first.ps() } else { 0 };
        let (unit, name) = match last - first {
            ..=2_000_000_000 => (1e6, "us"),
            2_000_000_001..=2_000_000_000_000 => (1e9, "ms"),
            _ => (1e12, "s"),
        };
        let from = if late { " from the first frame on" } else { "" };
        let mut clock = Self { origin, unit, label: format!("time in {name}{from}"), range: 0.0..1.0 };
        clock.range = clock.show(first.ps())..clock.show(last.ps()).max(clock.show(first.ps()) + 1e-3);
        clock
    }

    fn show(&self, time: i128) -> f64 {
        (time - self.origin) as f64 / self.unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::geometry::nothing_is_covered;
    use servowire_decode::event::Refusal;

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

    fn answer(start: i64, address: u32, counts: i64, verdict: Verdict) -> (Speaker, Event) {
        let start = Time::from_ps(start.into());
        let place = Place::Time { start, end: start + 40_000_000 };
        let event = Event::new(place, None, "ABS40", Vec::new(), verdict);
        let position = Position { name: "ABS", counts, span: Some(1 << 40), per_turn: Some(1 << 20) };
        let speaker = Speaker { lane: 0, address: Some(address) };
        (speaker, Event { position: Some(position), delay: Some(3_000_000 + start.ps() as i64 % 7 * 10_000), ..event })
    }

    /// Eight encoders that stand far from each other: each has its own panel, and nothing covers anything.
    #[test]
    fn a_panel_an_encoder() {
        let mut picture =
            Picture::new("/a/long/path/to/a/capture/that/somebody/made/of/a/whole/bus/of/eight/encoders/yesterday.vcd");
        for k in 0..800_i64 {
            let address = (k % 8) as u32;
            let refused = Refusal::new(["crc", "delimiter", "no_response"][(k / 8 % 3) as usize], "damaged").into();
            let verdict = if k % 29 == 0 { refused } else { Verdict::Ok };
            let (speaker, event) = answer(k * 100_000_000, address, i64::from(address) * 5_900_000_000 + k, verdict);
            picture.add(speaker, &event);
            picture.names.insert(speaker, format!("line, address {address}"));
        }
        let svg = picture.draw().unwrap();
        nothing_is_covered(&svg);
        for address in 0..8 {
            assert!(svg.contains(&format!("line, address {address}: position ABS in turns")), "{address}");
        }
        // A position that was read once is seen too.
        let mut once = Picture::new("once");
        let (speaker, event) = answer(1_000_000, 1, 4711, Verdict::Ok);
        once.add(speaker, &event);
        let svg = once.draw().unwrap();
        nothing_is_covered(&svg);
        assert!(svg.contains("<circle"), "{svg}");
        // Without anything in it, and with the date of a network card.
        nothing_is_covered(&Picture::new("nothing").draw().unwrap());
        let mut late = Picture::new("late");
        for k in 0..50 {
            let (speaker, mut event) = answer(k * 1_000_000, 1, k * 47_501_010_355, Verdict::Ok);
            let start = Time::from_ps(1_700_000_000_000_000_000_000 + i128::from(k) * 1_000_000_000);
            event.place = Place::Time { start, end: start + 1 };
            late.add(speaker, &event);
        }
        nothing_is_covered(&late.draw().unwrap());
        assert!(late.draw().unwrap().contains("time in ms from the first frame on"));
    }
}
