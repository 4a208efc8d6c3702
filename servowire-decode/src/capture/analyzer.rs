//! Tables of the bytes that a Logic 2 analyser found on a line: the data table of all analysers, and the table of a single
//! one.
//!
//! ```text
//! name,type,start_time,duration,"data"                 Time [s],Value,Parity Error,Framing Error
//! "Async Serial","data",0.000592672,0.0000038,0x1A     0.000592672000000,0x1A,,
//! ```
//! A row is a byte with its time. The line is reconstructed from the rows: a start bit, eight bits with the lowest first, a
//! delimiter. Gaps therefore separate the frames, and two analysers give two channels.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use super::input::Input;
use super::recording::{Change, Line};
use super::table::{Lines, cell, titles};
use crate::fault::{At, Fault};
use crate::time::Time;

/// Rows looked at for the names of the analysers and the length of a bit.
const SAMPLE: usize = 4096;
/// Changes returned at once.
const BLOCK: usize = 4096;
/// Maximum number of edges that are drawn but not yet returned; consecutive bytes leave a few.
const MOST_DRAWN: usize = 1 << 12;
/// Maximum number of analysers.
const CHANNELS: usize = 64;
/// Logic 2 draws a byte from the edge of its start bit to the middle of its delimiter.
const DRAWN_BITS: f64 = 9.5;
/// Bits of a byte on the line.
const FIELD_BITS: i64 = 10;

/// A table of bytes after its heading.
pub(super) struct Analyzer {
    lines: Lines,
    columns: Columns,
    channels: Vec<String>,
    /// Rows that were read to determine the channels.
    waiting: VecDeque<(u64, Row)>,
    /// Picoseconds.
    bit: f64,
    /// The first time, if times are dates.
    origin: Option<Time>,
    /// Edges drawn but not yet returned, the earliest first.
    drawn: BinaryHeap<Reverse<(Time, u64, u16, bool)>>,
    sequence: u64,
    begun: bool,
    now: Time,
    /// Rows that could not be read, and the first of them.
    bad: u64,
    first_bad: Option<(u64, String)>,
    over: bool,
}

/// Which column is what.
#[derive(Debug, Clone, Copy)]
struct Columns {
    name: Option<usize>,
    kind: Option<usize>,
    start: usize,
    duration: Option<usize>,
    value: usize,
    /// A cell that is not empty says that the delimiter was low.
    framing: Option<usize>,
}

/// A byte as its row has it.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Row {
    name: String,
    start: Time,
    duration: Option<i64>,
    byte: u8,
    delimiter: bool,
}

/// Returns whether a file begins like a table of bytes.
pub(super) fn looks_like(head: &[u8]) -> bool {
    let line = head.split(|byte| matches!(byte, b'\n' | b'\r')).next().unwrap_or_default();
    let text = String::from_utf8_lossy(line).to_lowercase().replace('"', "");
    let names: Vec<&str> = text.split(',').map(str::trim).collect();
    Columns::of(&names).is_some()
}

impl Columns {
    /// Finds the columns by their names in lower case.
    fn of(names: &[&str]) -> Option<Self> {
        let find = |wanted: &[&str]| names.iter().position(|name| wanted.contains(name));
        let start = find(&["start_time", "time [s]", "time[s]"])?;
        let value = find(&["data", "value"])?;
        let framing = find(&["framing error", "error"]);
        // A channel may be called so; a table of analysers has one of these beside.
        let (kind, duration) = (find(&["type"]), find(&["duration"]));
        (kind.is_some() || duration.is_some() || framing.is_some() || find(&["start_time"]).is_some()).then_some(Self {
            name: find(&["name"]),
            kind,
            start,
            duration,
            value,
            framing,
        })
    }
}

impl Analyzer {
    /// Reads the heading, and enough rows to determine the analysers.
    pub(super) fn new(input: Input) -> Result<Self, Fault> {
        let mut lines = Lines::new(input);
        let mut heading = Vec::new();
        lines.next(&mut heading)?;
        let heading: Vec<String> = cells(&heading).iter().map(|name| name.to_lowercase()).collect();
        let names: Vec<&str> = heading.iter().map(String::as_str).collect();
        let Some(columns) = Columns::of(&names) else {
            let what = "not a table of bytes of Logic 2: it has no columns start_time and data, or Time [s] and Value";
            return Err(lines.input.fault(At::Line(1), what));
        };
        let mut table = Self {
            lines,
            columns,
            channels: Vec::new(),
            waiting: VecDeque::new(),
            bit: 0.0,
            origin: None,
            drawn: BinaryHeap::new(),
            sequence: 0,
            begun: false,
            now: Time::ZERO,
            bad: 0,
            first_bad: None,
            over: false,
        };
        while table.waiting.len() < SAMPLE && (table.waiting.is_empty() || !table.lines.input.pauses()) {
            match table.next_row()? {
                Some(row) => table.waiting.push_back(row),
                None => break,
            }
        }
        for (_, row) in &table.waiting {
            if !table.channels.contains(&row.name) && table.channels.len() < CHANNELS {
                table.channels.push(row.name.clone());
            }
        }
        match table.length() {
            Some(bit) if !table.channels.is_empty() => table.bit = bit,
            _ => {
                let what = match &table.first_bad {
                    Some((_, what)) => what.clone(),
                    None => "fewer than two bytes are in the table".to_owned(),
                };
                let line = table.first_bad.as_ref().map_or(1, |(line, _)| *line);
                return Err(table.lines.input.fault(At::Line(line), what));
            }
        }
        Ok(table)
    }

    /// Returns the length of a bit in picoseconds: from the durations, otherwise from bytes without a gap between them.
    fn length(&self) -> Option<f64> {
        let mut durations: Vec<i64> = self.waiting.iter().filter_map(|(_, row)| row.duration).collect();
        durations.sort_unstable();
        if let Some(middle) = durations.get(durations.len() / 2).filter(|middle| **middle > 0) {
            return Some(*middle as f64 / DRAWN_BITS);
        }
        let starts: Vec<Time> = self.waiting.iter().map(|(_, row)| row.start).collect();
        let mut apart: Vec<i64> = starts.iter().zip(starts.iter().skip(1)).map(|(a, b)| *b - *a).collect();
        apart.retain(|apart| *apart > 0);
        apart.sort_unstable();
        // Neither the least, which may be a mistake, nor one with a pause.
        apart.get(apart.len() / 8).map(|apart| *apart as f64 / FIELD_BITS as f64)
    }

    /// Returns the next row that holds a byte, with its line.
    fn next_row(&mut self) -> Result<Option<(u64, Row)>, Fault> {
        let mut text = Vec::new();
        while self.lines.next(&mut text)? {
            if text.is_empty() {
                continue;
            }
            let line = self.lines.line;
            match self.row(&cells(&text)) {
                Ok(Some(row)) => return Ok(Some((line, row))),
                Ok(None) => {}
                Err(what) => {
                    self.bad += 1;
                    self.first_bad.get_or_insert((line, what));
                }
            }
        }
        Ok(None)
    }

    fn row(&mut self, cells: &[String]) -> Result<Option<Row>, String> {
        let text = |index: usize| cells.get(index).cloned().unwrap_or_default();
        let Columns { name, kind, start, duration, value, framing } = self.columns;
        // Rows of other analysers, as of SPI, say what they are.
        if kind.is_some_and(|kind| !matches!(text(kind).as_str(), "data" | "v1frame")) {
            return Ok(None);
        }
        let moment = |index: usize| cell::time(&text(index), 1);
        let start = match moment(start) {
            Some(time) => time,
            None => match cell::date(&text(start)) {
                Some(time) => time.since(*self.origin.get_or_insert(time)),
                None => return Err(format!("{:?} is not a time", text(start))),
            },
        };
        let said = text(value);
        let byte = byte(&said).ok_or_else(|| {
            format!("{said:?} is not a byte such as 0x1A: export the table with hexadecimal values of eight bits")
        })?;
        let name = name.map_or_else(|| "bytes".to_owned(), text);
        let delimiter = framing.is_none_or(|framing| {
            !text(framing).to_lowercase().contains("fram") && {
                // A column of its own says what is wrong, or true.
                !matches!(text(framing).to_lowercase().as_str(), "error" | "true" | "1")
            }
        });
        Ok(Some(Row {
            name,
            start,
            duration: duration.and_then(moment).map(|duration| duration - Time::ZERO),
            byte,
            delimiter,
        }))
    }

    /// Draws a byte; edges before it can then be returned.
    fn draw(&mut self, row: &Row) -> Result<(), String> {
        let Some(channel) = self.channels.iter().position(|known| *known == row.name) else {
            return Err(format!("the analyser {:?} has no byte before this one", row.name));
        };
        if row.start < self.now {
            return Err("time goes back".to_owned());
        }
        if self.drawn.len() > MOST_DRAWN {
            return Err("more bytes begin here than a line can hold".to_owned());
        }
        self.now = row.start;
        let channel = channel as u16;
        let bits = u16::from(row.byte) << 1 | u16::from(row.delimiter) << (FIELD_BITS - 1);
        let mut level = true;
        for at in 0..FIELD_BITS {
            let next = bits >> at & 1 == 1;
            if next != level {
                self.edge(row.start + ((at as f64 * self.bit) as i64), channel, next);
            }
            level = next;
        }
        if !level {
            self.edge(row.start + ((FIELD_BITS as f64 * self.bit) as i64), channel, true);
        }
        Ok(())
    }

    fn edge(&mut self, time: Time, channel: u16, level: bool) {
        self.drawn.push(Reverse((time, self.sequence, channel, level)));
        self.sequence += 1;
    }

    /// Returns the edges earlier than `time`.
    fn give(&mut self, time: Time, changes: &mut Vec<Change>) {
        while let Some(Reverse((at, _, channel, level))) = self.drawn.peek().copied().filter(|edge| edge.0.0 < time) {
            self.drawn.pop();
            changes.push(Change { time: at, channel, level });
        }
    }
}

/// Returns the cells of a line, without their quotes.
fn cells(line: &[u8]) -> Vec<String> {
    titles(&String::from_utf8_lossy(line), b',')
}

/// `0x1A`, `26`, `0b0001 1010`, `0b00011010`
fn byte(text: &str) -> Option<u8> {
    if let Some(digits) = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        return u8::from_str_radix(digits, 16).ok();
    }
    if let Some(digits) = text.strip_prefix("0b") {
        return u8::from_str_radix(&digits.replace(' ', ""), 2).ok();
    }
    // A digit alone may be a letter of ASCII.
    if text.len() > 1 && text.bytes().all(|byte| byte.is_ascii_digit()) { text.parse().ok() } else { None }
}

impl Line for Analyzer {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.lines.input)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        while !self.over && changes.len() < enough {
            if self.waiting.is_empty() && !changes.is_empty() && self.lines.input.pauses() {
                break;
            }
            let row = match self.waiting.pop_front() {
                Some(row) => Some(row),
                None => self.next_row()?,
            };
            let Some((line, row)) = row else {
                self.over = true;
                self.give(Time::MAX, changes);
                self.now = changes.last().map_or(self.now, |last| last.time.max(self.now));
                break;
            };
            if !std::mem::replace(&mut self.begun, true) {
                // The lines rest before their first byte.
                self.now = row.start - ((3.0 * FIELD_BITS as f64 * self.bit) as i64);
                let time = self.now;
                changes.extend((0..self.channels.len()).map(|channel| Change {
                    time,
                    channel: channel as u16,
                    level: true,
                }));
            }
            match self.draw(&row) {
                Ok(()) => self.give(row.start, changes),
                Err(what) => {
                    self.bad += 1;
                    self.first_bad.get_or_insert((line, what));
                }
            }
        }
        if let (true, Some((line, what))) = (self.over, self.first_bad.take()) {
            let all = if self.bad == 1 { "row was" } else { "rows were" };
            let what = format!("{what}; {} {all} left out", self.bad);
            return Err(self.lines.input.fault(At::Line(line), what));
        }
        Ok(!self.over)
    }

    fn reached(&self) -> Time {
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_by_their_radix() {
        for (text, want) in [
            ("0x1A", Some(0x1a)),
            ("0x9", Some(9)),
            ("26", Some(26)),
            ("0b00011010", Some(26)),
            ("0b0001 1010", Some(26)),
            ("5", None),
            ("A", None),
            ("0x100", None),
            ("", None),
            ("\\r", None),
        ] {
            assert_eq!(byte(text), want, "{text}");
        }
    }

    #[test]
    fn tables_by_their_heading() {
        for heading in [
            "name,type,start_time,duration,\"data\"\n",
            "start_time,\"data\"\r\n",
            "name,start_time,\"data\",\"error\"",
            "Time [s],Value,Parity Error,Framing Error\n",
        ] {
            assert!(looks_like(heading.as_bytes()), "{heading}");
        }
        for heading in ["Time [s],Channel 0\n", "Time [s],Data\n", "name,type,start_time,duration\n", ""] {
            assert!(!looks_like(heading.as_bytes()), "{heading}");
        }
    }
}
