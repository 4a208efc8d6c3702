//! Prints figures for a whole capture instead of its frames.

use std::collections::BTreeMap;
use std::io::{self, Write};

use serde_json::{Value as Json, json};

use super::printer::{Origin, Printer, Speaker};
use crate::event::{Direction, Event, NO_RESPONSE, Place, Position, Verdict};
use crate::time::Time;

/// Maximum number of position jumps listed; further ones are only counted.
const LISTED: usize = 10;
/// Maximum number of events listed of each kind; further ones are only counted.
const EVENTS: usize = 1_000;

/// Collects figures and prints them at the end of a file.
pub struct Stats<W> {
    out: W,
    json: bool,
    gathered: Gathered,
}

/// The figures of one speaker, in words.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Table {
    /// Its name; empty if there is only one.
    pub speaker: String,
    /// The quantity and its figures; a row that belongs to the row above has no name.
    pub rows: Vec<(&'static str, String)>,
}

/// Figures of each encoder, drive or device.
#[derive(Debug, Clone, Default)]
pub struct Gathered {
    /// How many counts a position may move from one frame to the next.
    limit: Option<u64>,
    by: BTreeMap<Speaker, Figures>,
}

#[derive(Debug, Clone, Default)]
struct Figures {
    requests: u64,
    answers: u64,
    others: u64,
    ok: u64,
    kinds: BTreeMap<String, u64>,
    refused: BTreeMap<&'static str, u64>,
    /// Start of the last frame of the side that sets the cycle.
    last_start: Option<(Option<Direction>, Time)>,
    cycle: Spread,
    delay: Spread,
    /// Keyed by the names of the positions.
    positions: BTreeMap<&'static str, Followed>,
    /// The newest positions in frames without a time: how far they moved is not known.
    untimed: BTreeMap<&'static str, Position>,
    jumps: u64,
    listed: Vec<Jump>,
    /// Times are counted, not measured, and say nothing about the cycle.
    counted: bool,
    /// Nothing of it is trusted: it was misread.
    misread: bool,
    /// Events with their places, and their number.
    happened: Vec<(Place, String)>,
    events: usize,
}

/// A position, and its largest move.
#[derive(Debug, Clone, Copy)]
struct Followed {
    last: Position,
    largest: u64,
}

#[derive(Debug, Clone, Copy)]
struct Jump {
    time: Time,
    from: i64,
    to: i64,
    moved: i64,
}

/// Minimum, maximum, mean and standard deviation of a series, in picoseconds.
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
        match event.direction {
            _ if event.verdict.is_silence() => {}
            Some(Direction::Request) => self.requests += 1,
            Some(Direction::Answer) => self.answers += 1,
            None => self.others += 1,
        }
        match &event.verdict {
            Verdict::Ok => {
                self.ok += 1;
                // A request and its answer count as one.
                if event.direction != Some(Direction::Request) {
                    match self.kinds.get_mut(event.kind.as_ref()) {
                        Some(count) => *count += 1,
                        None => drop(self.kinds.insert(event.kind.to_string(), 1)),
                    }
                }
            }
            Verdict::Refused(refusal) => *self.refused.entry(refusal.class).or_default() += 1,
        }
        self.counted |= event.counted;
        self.list(event);
        if let Some(delay) = event.delay {
            self.delay.add(delay);
        }
        let Place::Time { start, .. } = event.place else {
            self.untimed.extend(event.position.map(|position| (position.name, position)));
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

    /// Keeps only the numbers of frames: everything said so far was misread.
    fn forget(&mut self) {
        let Self { requests, answers, others, ok, ref mut refused, .. } = *self;
        let refused = std::mem::take(refused);
        *self = Self { misread: true, requests, answers, others, ok, refused, ..Self::default() };
    }

    /// Lists what happened.
    fn list(&mut self, event: &Event) {
        self.events += event.happened.len();
        let room = EVENTS.saturating_sub(self.happened.len());
        self.happened.extend(event.happened.iter().take(room).map(|what| (event.place, what.clone())));
    }

    /// Returns what is missing to detect jumps.
    fn missing(&self) -> Option<&'static str> {
        match (self.positions.is_empty(), self.untimed.is_empty()) {
            (false, _) => None,
            (true, true) => Some("no position is seen"),
            (true, false) => Some("the positions have no times (a log of RTEX blocks needs times, or --period)"),
        }
    }

    /// The cycle is that of the requests; on a line without requests, that of the frames present.
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
        let Some(known) = self.positions.get_mut(position.name) else {
            self.positions.insert(position.name, Followed { last: position, largest: 0 });
            return;
        };
        let before = std::mem::replace(&mut known.last, position);
        // Single-turn and multi-turn positions are not compared with each other.
        if before.span != position.span {
            return;
        }
        let moved = position.moved_from(&before);
        known.largest = known.largest.max(moved.unsigned_abs());
        if limit.is_some_and(|limit| moved.unsigned_abs() > limit) {
            self.jumps += 1;
            if self.listed.len() < LISTED {
                self.listed.push(Jump { time, from: before.counts, to: position.counts, moved });
            }
        }
    }

    /// Returns whether anybody spoke, or should have; otherwise all that is known are events.
    fn has_frames(&self) -> bool {
        self.ok > 0 || !self.refused.is_empty()
    }

    /// Returns the figures by their names; a row that belongs to the one above has no name.
    fn rows(&self, limit: Option<u64>) -> Vec<(&'static str, String)> {
        let mut rows = if self.misread {
            let frames = self.requests + self.answers + self.others;
            vec![("misread", format!("{frames} frames, not trusted"))]
        } else if self.has_frames() || self.events == 0 {
            self.rows_of_frames(limit)
        } else {
            Vec::new()
        };
        if self.events > 0 {
            rows.push(("events", self.events.to_string()));
            rows.extend(self.happened.iter().map(|(place, what)| match place {
                Place::Line(line) => ("", format!("line {line:>9}  {what}")),
                Place::Time { start, .. } => ("", format!("{:>14.3} us  {what}", start.us())),
            }));
        }
        rows
    }

    fn rows_of_frames(&self, limit: Option<u64>) -> Vec<(&'static str, String)> {
        let missing = self.refused.get(NO_RESPONSE).copied().unwrap_or(0);
        let refused = self.refused.values().sum::<u64>() - missing;
        let list = |all: Vec<String>| if all.is_empty() { "none".to_owned() } else { all.join(", ") };
        let kinds = list(self.kinds.iter().map(|(kind, n)| format!("{kind}: {n}")).collect());
        let without = if missing > 0 { format!(", {missing} answers missing") } else { String::new() };
        let mut rows = vec![
            ("frames", format!("{} requests, {} answers, {} others", self.requests, self.answers, self.others)),
            ("kinds", kinds),
            ("verdicts", format!("{} ok, {refused} refused{without}", self.ok)),
        ];
        rows.extend(self.refused.iter().map(|(class, count)| ("", format!("{class:<17} {count}"))));
        rows.extend([("cycle", self.cycle_text()), ("answer delay", self.delay.text())]);
        let several = self.positions.len() > 1;
        let moved = |(name, Followed { largest, .. }): (&&str, &Followed)| {
            if several { format!("{name} {largest} counts") } else { format!("{largest} counts") }
        };
        if !self.positions.is_empty() {
            rows.push(("largest move", list(self.positions.iter().map(moved).collect())));
        }
        match (limit, self.missing()) {
            (Some(_), Some(missing)) => rows.push(("jumps", format!("not known: {missing}"))),
            (Some(limit), None) => {
                rows.push(("jumps", format!("{} of more than {limit} counts", self.jumps)));
                rows.extend(self.listed.iter().map(|Jump { time, from, to, moved }| {
                    ("", format!("{:>14.3} us  {from} to {to}: {moved:+}", time.us()))
                }));
            }
            (None, _) => {}
        }
        rows
    }

    /// In a line.
    fn brief(&self) -> String {
        let us = |ps: f64| ps / 1e6;
        let missing = self.refused.get(NO_RESPONSE).copied().unwrap_or(0);
        let bad = self.refused.values().sum::<u64>();
        let all = self.ok + bad;
        let mut said = vec![format!("{all} frames")];
        // Where nothing is wrong, nothing is to be read about it.
        let refused =
            self.refused.iter().map(|(class, count)| format!("{class} {count}")).collect::<Vec<_>>().join(", ");
        let share = bad as f64 * 100.0 / (all as f64).max(1.0);
        said.push(if bad == 0 { "no errors".to_owned() } else { format!("{share:.2} % errors ({refused})") });
        for (what, spread) in [("cycle", self.cycle), ("delay", self.delay)] {
            if spread.count > 0 && !(self.counted && what == "cycle") {
                said.push(format!("{what} {:.3} us +- {:.3}", us(spread.mean), us(spread.deviation())));
            }
        }
        said.extend(self.newest().map(|(name, last)| match last.turns() {
            Some(turns) => format!("{name} {} ({turns:.6} turns)", last.counts),
            None => format!("{name} {}", last.counts),
        }));
        if missing == all {
            return format!("{missing} requests without an answer");
        }
        said.join("  ")
    }

    /// The newest positions by their names.
    fn newest(&self) -> impl Iterator<Item = (&'static str, &Position)> {
        let timed = self.positions.iter().map(|(name, followed)| (*name, &followed.last));
        timed.chain(self.untimed.iter().map(|(name, last)| (*name, last)))
    }

    fn cycle_text(&self) -> String {
        match self.cycle {
            Spread { count: 1.., mean, .. } if self.counted => {
                format!("{:.3} us on average as counted: the log has no times", mean / 1e6)
            }
            cycle => cycle.text(),
        }
    }

    fn events_json(&self) -> Vec<Json> {
        let one = |(place, what): &(Place, String)| match place {
            Place::Line(line) => json!({ "line": line, "what": what }),
            Place::Time { start, .. } => json!({ "time_ps": start, "what": what }),
        };
        self.happened.iter().map(one).collect()
    }
}

impl Gathered {
    /// `limit`: moves of a position above it are listed as jumps.
    pub fn new(limit: Option<u64>) -> Self {
        Self { limit, by: BTreeMap::new() }
    }

    /// Takes the next event of a file.
    pub fn add(&mut self, origin: &Origin, event: &Event) {
        // A remark is no frame; most have nothing for the figures.
        if event.remark && event.happened.is_empty() {
            return;
        }
        let figures = self.by.entry(origin.speaker(event)).or_default();
        if event.misread {
            figures.forget();
        }
        if event.remark { figures.list(event) } else { figures.add(event, self.limit) }
    }

    /// Returns a table for each speaker.
    pub fn tables(&self, origin: &Origin) -> Vec<Table> {
        let one = |(speaker, figures): (&Speaker, &Figures)| Table {
            speaker: origin.name(*speaker),
            rows: figures.rows(self.limit),
        };
        self.by.iter().map(one).collect()
    }

    /// Writes a table for each speaker, and one without figures if nobody spoke.
    pub fn write(mut self, origin: &Origin, out: &mut impl Write) -> io::Result<()> {
        self.at_least_one();
        writeln!(out, "{}", origin.file)?;
        for Table { speaker, rows } in self.tables(origin) {
            if !speaker.is_empty() {
                writeln!(out, "  {speaker}")?;
            }
            for (what, text) in rows {
                match what {
                    "" => writeln!(out, "    {text}")?,
                    _ => writeln!(out, "  {what:<12}  {text}")?,
                }
            }
        }
        out.flush()
    }

    /// Writes an object on a line for each speaker, and one without figures if nobody spoke.
    pub fn write_json(mut self, origin: &Origin, out: &mut impl Write) -> io::Result<()> {
        self.at_least_one();
        for object in self.json(origin) {
            serde_json::to_writer(&mut *out, &object)?;
            out.write_all(b"\n")?;
        }
        out.flush()
    }

    fn at_least_one(&mut self) {
        if self.by.is_empty() {
            self.by.insert(Speaker { lane: 0, address: None }, Figures::default());
        }
    }

    /// Returns a line for each speaker of `all` with its part in these figures: frames, errors, cycle, delay and position.
    pub fn brief(&self, all: &Self, origin: &Origin) -> Vec<String> {
        let one = |speaker: &Speaker| {
            let name = match origin.name(*speaker) {
                name if name.is_empty() => name,
                name => format!("{name}: "),
            };
            let figures = self.by.get(speaker).filter(|figures| figures.has_frames());
            let said = figures.map_or_else(|| "nothing".to_owned(), Figures::brief);
            format!("{name}{said}")
        };
        all.by.keys().map(one).collect()
    }

    /// Returns the figures of each speaker as an object; speakers that are in `all` but not in these figures have zeros.
    pub fn objects(&self, all: &Self, origin: &Origin) -> Vec<Json> {
        let mut whole = self.clone();
        for speaker in all.by.keys() {
            whole.by.entry(*speaker).or_default();
        }
        whole.json(origin)
    }

    fn json(&self, origin: &Origin) -> Vec<Json> {
        let jump = |j: &Jump| json!({ "time_ps": j.time, "from": j.from, "to": j.to, "moved": j.moved });
        let one = |(speaker, f): (&Speaker, &Figures)| {
            let mut object = json!({
                "file": origin.file, "channel": origin.lanes.get(speaker.lane).map(|lane| &lane.channel),
                "address": speaker.address, "requests": f.requests, "answers": f.answers, "others": f.others,
                "ok": f.ok, "refused": f.refused, "kinds": f.kinds,
                "cycle": if f.counted { Json::Null } else { f.cycle.json() }, "answer_delay": f.delay.json(),
                "last_positions": f.newest().map(|(name, last)| (name, last.counts)).collect::<BTreeMap<_, _>>(),
                "largest_move": f.positions.values().map(|followed| followed.largest).max(),
                "jumps": self.limit.filter(|_| f.missing().is_none()).map(|_| f.jumps),
                "jumps_listed": f.listed.iter().map(jump).collect::<Vec<_>>(),
            });
            if let Some(object) = object.as_object_mut().filter(|_| f.events > 0) {
                object.insert("events".to_owned(), f.events_json().into());
            }
            if let Some(object) = object.as_object_mut().filter(|_| f.misread) {
                object.insert("misread".to_owned(), true.into());
            }
            object
        };
        self.by.iter().map(one).collect()
    }
}

impl<W: Write> Stats<W> {
    /// `limit`: moves of the position above it are listed as jumps.
    pub fn new(out: W, limit: Option<u64>) -> Self {
        Self { out, json: false, gathered: Gathered::new(limit) }
    }

    /// Writes JSON Lines instead of tables.
    #[must_use]
    pub fn in_json(self) -> Self {
        Self { json: true, ..self }
    }
}

impl<W: Write> Printer for Stats<W> {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        self.gathered.add(origin, event);
        Ok(())
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        let empty = Gathered::new(self.gathered.limit);
        let gathered = std::mem::replace(&mut self.gathered, empty);
        if self.json { gathered.write_json(origin, &mut self.out) } else { gathered.write(origin, &mut self.out) }
    }
}
