//! Tables of messages: one row per message, with its bytes in one cell, and its time and sender in others.
//!
//! ```text
//! time_us,direction,axis,data
//! 0.0,command,5,45 20 80 00 E8 03 00 00 00 00 00 00 00 00 00 00
//! ```
//! The columns may be in any order, and other columns are ignored. Times are dates, or seconds unless the heading names
//! another unit.

use super::hexlog::{Burst, words};
use super::input::Input;
use super::table::{Lines, cell, separator, titles, unit};
use crate::event::Direction;
use crate::fault::{At, Fault};
use crate::time::Time;

/// A table after its heading.
pub struct ByteTable {
    lines: Lines,
    columns: Columns,
}

/// Which column is what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Columns {
    separator: u8,
    /// A column of times, with the fraction of a second that it counts.
    time: Option<(usize, i64)>,
    direction: Option<usize>,
    data: usize,
}

impl Columns {
    /// Finds the columns by their names; `None` if it is not a table of messages.
    fn of(heading: &str) -> Option<Self> {
        let separator = separator(heading.as_bytes());
        let names: Vec<String> = titles(&heading.to_lowercase(), separator);
        let find = |wanted: &[&str]| names.iter().position(|name| wanted.contains(&name.as_str()));
        let data = find(&["data", "bytes", "block", "payload", "frame", "hex", "raw"])?;
        let direction = find(&["direction", "dir", "from", "type", "kind"]);
        let time = names.iter().enumerate().find_map(|(index, name)| {
            let mut words = name.split([' ', '_', '(', '[', '/']);
            let is_time = words.next().is_some_and(|word| matches!(word, "time" | "timestamp" | "t" | "date"));
            let parts = words.find_map(unit);
            is_time.then_some((index, parts.unwrap_or(1)))
        });
        (time.is_some() || direction.is_some()).then_some(Self { separator, time, direction, data })
    }

    /// The content of a row.
    fn burst(&self, line: u64, row: &str) -> Result<Burst, String> {
        let cells = titles(row, self.separator);
        let cell = |index: usize| cells.get(index).map_or("", String::as_str);
        let said = words::line(cell(self.data))?;
        let bytes: Vec<u8> = said.into_iter().flat_map(|said| said.bytes).collect();
        if bytes.is_empty() {
            return Err(format!("the row has no bytes in column {}", self.data + 1));
        }
        let time = match self.time {
            Some((index, parts)) => Some(moment(cell(index), parts)?),
            None => None,
        };
        let direction = self.direction.map(|index| direction(cell(index))).transpose()?;
        Ok(Burst { time, direction, ..Burst::new(line, bytes) })
    }
}

fn moment(text: &str, parts: i64) -> Result<Time, String> {
    cell::time(text, parts).or_else(|| cell::date(text)).ok_or_else(|| format!("{text:?} is not a time"))
}

fn direction(text: &str) -> Result<Direction, String> {
    let of_side = match text.to_lowercase().as_str() {
        "master" | "host" | "controller" => Some(Direction::Request),
        "drive" | "slave" | "axis" | "device" | "encoder" => Some(Direction::Answer),
        _ => words::speaker(text),
    };
    of_side.ok_or_else(|| format!("{text:?} does not say who spoke: command or response, TX or RX, master or drive"))
}

/// Returns whether a file begins like a table of messages: with its heading, and a first row of more than one byte.
pub(super) fn looks_like(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines = text.lines().filter(|line| !is_remark(line));
    let Some(columns) = lines.next().and_then(Columns::of) else { return false };
    lines.next().is_some_and(|row| columns.burst(1, row).is_ok_and(|burst| burst.bytes.len() > 1))
}

fn is_remark(line: &str) -> bool {
    line.trim().is_empty() || line.starts_with('#')
}

impl ByteTable {
    /// Reads the heading.
    pub fn new(input: Input) -> Result<Self, Fault> {
        let mut lines = Lines::new(input);
        let mut text = Vec::new();
        while lines.next(&mut text)? {
            let line = String::from_utf8_lossy(&text);
            if is_remark(&line) {
                continue;
            }
            if let Some(columns) = Columns::of(&line) {
                return Ok(Self { lines, columns });
            }
            break;
        }
        let what = "not a table of messages: its heading names no column data beside a time or a direction";
        Err(lines.input.fault(At::Line(lines.line.max(1)), what))
    }

    /// The file that is read.
    pub(super) fn input(&mut self) -> &mut Input {
        &mut self.lines.input
    }

    /// Returns whether its rows have times.
    pub(super) fn has_times(&self) -> bool {
        self.columns.time.is_some()
    }

    /// Returns the message of the next row; if the row cannot be read, the reason. `None` at the end.
    pub fn burst(&mut self) -> Result<Option<Burst>, Fault> {
        let mut text = Vec::new();
        while self.lines.next(&mut text)? {
            let row = String::from_utf8_lossy(&text);
            if is_remark(&row) {
                continue;
            }
            let line = self.lines.line;
            return Ok(Some(self.columns.burst(line, &row).unwrap_or_else(|what| Burst::spoilt(line, what))));
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headings_and_rows() {
        let burst = |heading: &str, row: &str| Columns::of(heading).unwrap().burst(7, row);
        let want = Burst {
            time: Some(Time::from_ps(500_000_000)),
            direction: Some(Direction::Answer),
            ..Burst::new(7, vec![0xa5, 0x20])
        };
        for (heading, row) in [
            ("time,direction,axis,data", "0.0005,response,5,A5 20"),
            ("time_us,direction,axis,data", "500.0,rsp,5,a520"),
            ("Time [ms];Dir;Axis;Data", "0,5;RX;5;A5 20"),
            ("data\taxis\tt/ns\tdir", "\"A5,20\"\t5\t500000\tdrive"),
        ] {
            assert_eq!(burst(heading, row).as_ref(), Ok(&want), "{heading}");
        }
        let heading = "time,direction,axis,data";
        for (row, said) in [
            ("0,command,5,", "no bytes"),
            ("x,command,5,A5", "is not a time"),
            ("0,both,5,A5", "who spoke"),
            ("0,command,5,A", "not bytes in hex"),
            ("0", "no bytes"),
        ] {
            assert!(burst(heading, row).unwrap_err().contains(said), "{row}");
        }
        // A table of levels, of an analyser, of one byte a row.
        for other in ["time,data", "data", "Time [s],Channel 0", "axis,block"] {
            assert_eq!(Columns::of(other).is_some(), other.starts_with("time,"), "{other}");
        }
        assert!(!looks_like(b"start_time,data\n0.1,0x1A\n") && !looks_like(b"time,data\n0.1,0x1A\n"));
        assert!(looks_like(b"# a remark\n\ntime,data\n0.1,1A20\n") && !looks_like(b"time,data\n"));
    }
}
