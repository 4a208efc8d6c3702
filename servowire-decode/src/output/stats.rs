//! Figures over a whole capture instead of its frames.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde_json::{Map, Value as Json, json};

use super::printer::{Origin, Printer};
use crate::event::{Direction, Event, NO_RESPONSE, Place, Position, Verdict};
use crate::time::Time;

/// Jumps of the position that are listed; further ones are counted.
const LISTED: usize = 10;
/// Events that are listed; further ones are counted.
const EVENTS: usize = 1_000;

/// Collects figures and prints them at the end of a file.
pub struct Stats<W> {
    out: W,
    json: bool,
    /// Counts that a position may move from one frame to the next.
    limit: Option<u64>,
    figures: Figures,
}

#[derive(Debug, Default)]
struct Figures {
    requests: u64,
    answers: u64,
    others: u64,
    ok: u64,
    kinds: BTreeMap<String, u64>,
    refused: BTreeMap<&'static str, u64>,
    delay: Spread,
    /// Of all frames together, and by address where that is known.
    line: Axis,
    axes: BTreeMap<u32, Axis>,
    happened: Vec<Happening>,
    /// Of all lists together: what there was no room for.
    unlisted: u64,
}

/// What happened, to whom and where.
#[derive(Debug, Clone)]
struct Happening {
    place: Place,
    address: Option<u32>,
    what: String,
}

/// Figures of an encoder or a drive.
#[derive(Debug, Default)]
struct Axis {
    /// Start of the last frame of the side that keeps the cycle.
    last_start: Option<(Option<Direction>, Time)>,
    cycle: Spread,
    /// Times are counted and say nothing of a cycle.
    counted: bool,
    position: Option<(Time, Position)>,
    /// Least and most of the positions.
    range: Option<(i64, i64)>,
    /// Positions in frames without a time.
    untimed: u64,
    largest: u64,
    jumps: u64,
    listed: Vec<Jump>,
}

#[derive(Debug, Clone, Copy)]
struct Jump {
    time: Time,
    from: i64,
    to: i64,
    moved: i64,
}

/// Least, most, mean and deviation of a series, in picoseconds.
#[derive(Debug, Clone, Copy, Default)]
struct Spread {
    count: u64,
    min: i64,
    max: i64,
    mean: f64,
    squares: f64,
}

impl Spread {
    fn add(&mut self, value: i64) {
        (self.min, self.max) =
            if self.count == 0 { (value, value) } else { (self.min.min(value), self.max.max(value)) };
        self.count += 1;
        let apart = value as f64 - self.mean;
        self.mean += apart / self.count as f64;
        self.squares += apart * (value as f64 - self.mean);
    }

    fn deviation(&self) -> f64 {
        if self.count < 2 { 0.0 } else { (self.squares / (self.count - 1) as f64).sqrt() }
    }

    fn text(&self) -> String {
        if self.count == 0 {
            return "none seen".to_owned();
        }
        let us = |ps: f64| ps / 1e6;
        format!(
            "min {:.3} us, mean {:.3} us, max {:.3} us, jitter {:.3} us peak to peak, {:.3} us rms",
            us(self.min as f64),
            us(self.mean),
            us(self.max as f64),
            us((self.max - self.min) as f64),
            us(self.deviation())
        )
    }

    fn json(&self) -> Json {
        if self.count == 0 {
            return Json::Null;
        }
        json!({
            "count": self.count, "min_ps": self.min, "mean_ps": self.mean, "max_ps": self.max,
            "jitter_ps": self.max - self.min, "rms_ps": self.deviation(),
        })
    }
}

impl Figures {
    fn add(&mut self, event: &Event, limit: Option<u64>) {
        self.list(event);
        if event.remark {
            return;
        }
        match event.direction {
            _ if event.verdict.is_silence() => {}
            Some(Direction::Request) => self.requests += 1,
            Some(Direction::Answer) => self.answers += 1,
            None => self.others += 1,
        }
        match &event.verdict {
            Verdict::Ok => {
                self.ok += 1;
                // A request and its answer are one of a kind.
                if event.direction != Some(Direction::Request) {
                    *self.kinds.entry(event.kind.to_string()).or_default() += 1;
                }
            }
            Verdict::Refused(refusal) => *self.refused.entry(refusal.class).or_default() += 1,
        }
        if let Some(delay) = event.delay {
            self.delay.add(delay);
        }
        self.line.add(event, limit);
        // What is refused may be of anybody.
        if let Some(address) = event.address.filter(|_| event.verdict.is_ok()) {
            self.axes.entry(address).or_default().add(event, limit);
        }
    }

    /// The figures of the only one there is; none of several, each of which has its own.
    fn alone(&self) -> Option<&Axis> {
        match self.axes.len() {
            0 => Some(&self.line),
            1 => self.axes.values().next(),
            _ => None,
        }
    }

    /// What belongs in the list of events.
    fn list(&mut self, event: &Event) {
        for what in &event.happened {
            if self.happened.len() < EVENTS {
                self.happened.push(Happening { place: event.place, address: event.address, what: what.clone() });
            } else {
                self.unlisted += 1;
            }
        }
    }
}

impl Axis {
    fn add(&mut self, event: &Event, limit: Option<u64>) {
        self.counted |= event.counted;
        if let Some(Position { counts, .. }) = event.position {
            let (least, most) = self.range.unwrap_or((counts, counts));
            self.range = Some((least.min(counts), most.max(counts)));
        }
        let Place::Time { start, .. } = event.place else {
            self.untimed += u64::from(event.position.is_some());
            return;
        };
        if event.verdict.is_silence() {
            return;
        }
        self.keep_cycle(event.direction, start);
        if let Some(position) = event.position {
            self.follow(start, position, limit);
        }
    }

    /// What there must be to tell jumps, and is not.
    fn missing(&self) -> Option<&'static str> {
        match (self.position, self.untimed) {
            (Some(_), _) => None,
            (None, 0) => Some("no position is seen"),
            (None, _) => Some("the positions have no times (a log of RTEX blocks needs times, or --period)"),
        }
    }

    /// The cycle is that of the requests; on a line without them, that of the frames there are.
    fn keep_cycle(&mut self, direction: Option<Direction>, start: Time) {
        match self.last_start {
            Some((side, last)) if side == direction => self.cycle.add(start - last),
            Some(_) if direction == Some(Direction::Request) => self.cycle = Spread::default(),
            Some(_) => return,
            None => {}
        }
        self.last_start = Some((direction, start));
    }

    fn follow(&mut self, time: Time, position: Position, limit: Option<u64>) {
        // Single-turn and multi-turn positions are not compared with each other.
        let before = self.position.replace((time, position)).filter(|(_, before)| before.span == position.span);
        let Some((_, before)) = before else { return };
        let moved = position.moved_from(&before);
        self.largest = self.largest.max(moved.unsigned_abs());
        if limit.is_some_and(|limit| moved.unsigned_abs() > limit) {
            self.jumps += 1;
            if self.listed.len() < LISTED {
                self.listed.push(Jump { time, from: before.counts, to: position.counts, moved });
            }
        }
    }

    fn cycle_text(&self) -> String {
        match self.cycle {
            Spread { count: 1.., mean, .. } if self.counted => {
                format!("{:.3} us on average as counted: the log has no times", mean / 1e6)
            }
            cycle => cycle.text(),
        }
    }

    fn print_range(&self, out: &mut impl Write) -> io::Result<()> {
        let Some((least, most)) = self.range else { return Ok(()) };
        writeln!(out, "    position      {least} to {most} counts")
    }

    fn print(&self, out: &mut impl Write, limit: Option<u64>, indent: &str) -> io::Result<()> {
        if self.position.is_some() {
            writeln!(out, "{indent}largest move  {} counts", self.largest)?;
        }
        if let (Some(_), Some(missing)) = (limit, self.missing()) {
            writeln!(out, "{indent}jumps         not known: {missing}")?;
        } else if let Some(limit) = limit {
            writeln!(out, "{indent}jumps         {} of more than {limit} counts", self.jumps)?;
            for Jump { time, from, to, moved } in &self.listed {
                writeln!(out, "{indent}  {:>14.3} us  {from} to {to}: {moved:+}", time.us())?;
            }
        }
        Ok(())
    }

    /// Into an object; the cycle is that of `line`.
    fn json(&self, limit: Option<u64>, line: &Self, object: &mut Map<String, Json>) {
        let jump = |j: &Jump| json!({ "time_ps": j.time, "from": j.from, "to": j.to, "moved": j.moved });
        let entries = [
            ("cycle", if line.counted { Json::Null } else { line.cycle.json() }),
            ("largest_move", json!(self.position.map(|_| self.largest))),
            ("least_position", json!(self.range.map(|range| range.0))),
            ("most_position", json!(self.range.map(|range| range.1))),
            ("jumps", json!(limit.filter(|_| self.missing().is_none()).map(|_| self.jumps))),
            ("jumps_listed", self.listed.iter().map(jump).collect()),
        ];
        object.extend(entries.map(|(key, value)| (key.to_owned(), value)));
    }
}

impl<W: Write> Stats<W> {
    /// `limit`: moves of the position above it are listed as jumps.
    pub fn new(out: W, json: bool, limit: Option<u64>) -> Self {
        Self { out, json, limit, figures: Figures::default() }
    }

    fn print_text(&mut self, file: &str) -> io::Result<()> {
        let f = &self.figures;
        let missing = f.refused.get(NO_RESPONSE).copied().unwrap_or(0);
        let refused = f.refused.values().sum::<u64>() - missing;
        let kinds = f.kinds.iter().map(|(kind, n)| format!("{kind}: {n}")).collect::<Vec<_>>().join(", ");
        writeln!(self.out, "{file}")?;
        writeln!(self.out, "  frames        {} requests, {} answers, {} others", f.requests, f.answers, f.others)?;
        writeln!(self.out, "  kinds         {}", if kinds.is_empty() { "none" } else { &kinds })?;
        let without = if missing > 0 { format!(", {missing} answers missing") } else { String::new() };
        writeln!(self.out, "  verdicts      {} ok, {refused} refused{without}", f.ok)?;
        for (class, count) in &f.refused {
            writeln!(self.out, "    {class:<17} {count}")?;
        }
        let alone = f.alone();
        if alone.is_some() {
            writeln!(self.out, "  cycle         {}", f.line.cycle_text())?;
        }
        writeln!(self.out, "  answer delay  {}", f.delay.text())?;
        if let Some(axis) = alone {
            axis.print(&mut self.out, self.limit, "  ")?;
        } else {
            for (address, axis) in &f.axes {
                writeln!(self.out, "  axis {address}")?;
                writeln!(self.out, "    cycle         {}", axis.cycle_text())?;
                axis.print_range(&mut self.out)?;
                axis.print(&mut self.out, self.limit, "    ")?;
            }
        }
        self.print_events()
    }

    fn print_events(&mut self) -> io::Result<()> {
        let Figures { happened, unlisted, .. } = &self.figures;
        if happened.is_empty() {
            return Ok(());
        }
        writeln!(self.out, "  events        {}", happened.len() as u64 + unlisted)?;
        for Happening { place, address, what } in happened {
            match place {
                Place::Line(line) => write!(self.out, "    line {line:>9}")?,
                Place::Time { start, .. } => write!(self.out, "    {:>14.3} us", start.us())?,
            }
            if let Some(address) = address {
                write!(self.out, "  axis {address}")?;
            }
            writeln!(self.out, "  {what}")?;
        }
        if *unlisted > 0 {
            writeln!(self.out, "    and {unlisted} more")?;
        }
        Ok(())
    }

    fn print_json(&mut self, file: &str) -> io::Result<()> {
        let f = &self.figures;
        let mut object = Map::new();
        for (key, value) in [
            ("file", json!(file)),
            ("requests", json!(f.requests)),
            ("answers", json!(f.answers)),
            ("others", json!(f.others)),
            ("ok", json!(f.ok)),
            ("refused", json!(f.refused)),
            ("kinds", json!(f.kinds)),
            ("answer_delay", f.delay.json()),
        ] {
            object.insert(key.to_owned(), value);
        }
        if let Some(alone) = f.alone() {
            alone.json(self.limit, &f.line, &mut object);
        } else {
            let of = |(address, axis): (&u32, &Axis)| {
                let mut object = Map::from_iter([("address".to_owned(), json!(address))]);
                axis.json(self.limit, axis, &mut object);
                Json::Object(object)
            };
            object.insert("axes".to_owned(), f.axes.iter().map(of).collect());
        }
        if !f.happened.is_empty() {
            object.insert("events".to_owned(), f.happened.iter().map(Happening::json).collect());
            object.insert("events_unlisted".to_owned(), f.unlisted.into());
        }
        serde_json::to_writer(&mut self.out, &object)?;
        self.out.write_all(b"\n")
    }
}

impl Happening {
    fn json(&self) -> Json {
        let (key, at) = match self.place {
            Place::Line(line) => ("line", json!(line)),
            Place::Time { start, .. } => ("time_ps", json!(start)),
        };
        json!({ key: at, "address": self.address, "what": self.what })
    }
}

impl<W: Write> Printer for Stats<W> {
    fn event(&mut self, _: &Origin, event: &Event) -> io::Result<()> {
        self.figures.add(event, self.limit);
        Ok(())
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        if self.json {
            self.print_json(&origin.file)?;
        } else {
            self.print_text(&origin.file)?;
        }
        self.figures = Figures::default();
        self.out.flush()
    }
}
