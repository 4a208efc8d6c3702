//! CSV of logic analysers and oscilloscopes: Saleae, sigrok, DSView, Kingst, WaveForms, Rigol, Siglent, Tektronix,
//! Keysight, PicoScope.
//!
//! They differ in separators, headings and units, so nothing is assumed about the table: the data begin at the first two
//! consecutive lines of numbers, and the names are above them. A column of 0 and 1 is a channel; a column of voltages becomes
//! one, with a threshold half-way between its levels.

pub(super) mod cell;
mod heading;
pub(super) mod threshold;

use std::collections::VecDeque;

use super::hints::Hints;
use super::input::Input;
use super::recording::{Change, Hole, Line};
use crate::fault::{At, Fault};
use crate::time::{Clock, SECOND, Time};
use cell::Cell;
use heading::{Heading, Times};
pub(super) use heading::{separator, titles, unit};
use threshold::Threshold;

/// Changes returned at once.
const BLOCK: usize = 4096;
/// Maximum length of a line.
const LONGEST: usize = 1 << 20;
/// Rows examined for the kinds of the columns and the levels of voltages.
const SAMPLE: usize = 1 << 14;
/// Cells examined.
const SAMPLE_CELLS: usize = 1 << 18;

/// A table after its heading.
pub struct Table {
    name: String,
    lines: Lines,
    heading: Heading,
    channels: Vec<String>,
    columns: Vec<Column>,
    /// Rows that were read to find the columns.
    waiting: Waiting,
    clock: Times,
    /// Time of the first row, if times are absolute.
    origin: Option<Time>,
    now: Option<Time>,
    rows: u64,
    /// Rows that could not be read, and the first of them.
    bad: u64,
    first_bad: Option<(u64, String)>,
    /// Time since which there have been no data.
    since: Option<Time>,
    hole: Option<Hole>,
    over: bool,
    /// The last row comes first, so all changes have to be known before the first is returned.
    backwards: bool,
    turned: VecDeque<Change>,
}

/// Changes of a table that is written backwards are held in memory, up to this many.
const MOST_TURNED: usize = 1 << 20;

/// A channel: a column, or one line of the pod that a column is.
struct Column {
    index: usize,
    threshold: Option<Threshold>,
    bit: Option<u8>,
    level: Option<bool>,
}

/// Reads lines and numbers them.
pub(super) struct Lines {
    pub(super) input: Input,
    /// The number of the last one, from 1.
    pub(super) line: u64,
}

impl Lines {
    pub(super) fn new(input: Input) -> Self {
        Self { input, line: 0 }
    }

    /// Reads the next line into `text`, without its line end; returns whether there was one.
    pub(super) fn next(&mut self, text: &mut Vec<u8>) -> Result<bool, Fault> {
        text.clear();
        let at = At::Line(self.line + 1);
        let what = || format!("a line of more than {LONGEST} characters: not a table");
        if self.input.line(text, at, LONGEST, what)? == 0 {
            return Ok(false);
        }
        self.line += 1;
        while text.last().is_some_and(|last| matches!(last, b'\n' | b'\r')) {
            text.pop();
        }
        if self.line == 1 && text.starts_with(b"\xef\xbb\xbf") {
            text.drain(..3);
        }
        Ok(true)
    }
}

impl Table {
    /// Reads the heading, and enough rows to determine the columns.
    pub fn new(input: Input, hints: Hints) -> Result<Self, Fault> {
        let name = input.name().to_owned();
        let mut lines = Lines::new(input);
        let (above, mut waiting) = beginning(&mut lines)?;
        let rows: Vec<&[u8]> = waiting.iter().map(|(_, row)| row.as_slice()).collect();
        let Some(heading) = Heading::parse(&above, &rows, hints.sample_rate) else {
            let what = "no table with times or a sample rate and columns of levels or voltages is in it (the rate of a \
                table of levels alone is said with --format csv --rate)";
            return Err(Fault::new(&name, At::Line(1), what));
        };
        let (mut cells, mut text) = (0, Vec::new());
        let enough = |waiting: &Waiting, lines: &mut Lines| !waiting.is_empty() && lines.input.pauses();
        while waiting.len() < SAMPLE
            && cells < SAMPLE_CELLS
            && !enough(&waiting, &mut lines)
            && lines.next(&mut text)?
        {
            cells += heading.columns();
            waiting.push_back((lines.line, text.clone()));
        }
        let (columns, channels) = columns(&heading, &waiting, hints.threshold);
        if channels.is_empty() {
            return Err(Fault::new(&name, At::Line(1), "no column of levels or voltages is in the table"));
        }
        if hints.threshold.is_some() && columns.iter().all(|column| column.threshold.is_none()) {
            return Err(Fault::new(&name, At::Line(1), "--threshold is for voltages: this table has none"));
        }
        if u16::try_from(channels.len()).is_err() {
            return Err(Fault::new(&name, At::Line(1), "more than 65535 columns"));
        }
        let (clock, backwards) = heading
            .times(&waiting)
            .ok_or_else(|| Fault::new(&name, At::Line(1), "neither times nor a sample rate are in the table"))?;
        Ok(Self {
            name,
            lines,
            heading,
            channels,
            columns,
            waiting,
            clock,
            origin: None,
            now: None,
            rows: 0,
            bad: 0,
            first_bad: None,
            since: None,
            hole: None,
            over: false,
            backwards,
            turned: VecDeque::new(),
        })
    }

    /// Reads a table that is written backwards to its end, as if time ran backwards, and reverses it.
    fn turn(&mut self) -> Result<(), Fault> {
        let mut changes = Vec::new();
        let end = loop {
            if changes.len() > MOST_TURNED {
                let what = "its last row comes first, and it is too long to be turned round: save it as VCD or binary";
                return Err(Fault::new(&self.name, At::File, what));
            }
            match self.step(&mut changes) {
                Ok(true) => {}
                end => break end,
            }
        };
        // Each channel keeps a level from where it takes the one that is later in the file.
        let begin = -self.now.unwrap_or_default();
        let mut later: Vec<Option<bool>> = vec![None; self.columns.len()];
        for Change { time, channel, level } in changes {
            if let Some(before) = later.get_mut(usize::from(channel)).and_then(|known| known.replace(level)) {
                self.turned.push_front(Change { time: -time, channel, level: before });
            }
        }
        for (channel, level) in (0_u16..).zip(later) {
            if let Some(level) = level {
                self.turned.push_front(Change { time: begin, channel, level });
            }
        }
        end.map(|_| ())
    }

    fn step(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let (line, row) = if let Some(row) = self.waiting.pop_front() {
            row
        } else {
            let mut text = Vec::new();
            if !self.lines.next(&mut text)? {
                return Ok(false);
            }
            (self.lines.line, text)
        };
        if row.is_empty() {
            return Ok(true);
        }
        if let Err(what) = self.row(&row, changes) {
            self.bad += 1;
            self.first_bad.get_or_insert((line, what));
        }
        Ok(true)
    }

    /// Returns the time of a row.
    fn time(&mut self, cells: &[&[u8]]) -> Result<Time, String> {
        let text = |index: usize| String::from_utf8_lossy(cells.get(index).copied().unwrap_or_default());
        let time = match self.clock {
            Times::Column { index, divisor } => {
                cell::time(&text(index), divisor).ok_or_else(|| format!("{:?} is not a time", text(index)))?
            }
            Times::Dates { index } => {
                let time =
                    cell::date(&text(index)).ok_or_else(|| format!("{:?} is not a date and time", text(index)))?;
                time.since(*self.origin.get_or_insert(time))
            }
            Times::Steps { start, period } => start + ((self.rows as f64 * period).round() as i64),
            Times::Rate(rate) => Clock::new(rate).time(self.rows),
        };
        Ok(if self.backwards { -time } else { time })
    }

    /// Returns the level of a column in a row, and its voltage; no level if the cell is empty.
    fn level(&self, column: &Column, cells: &[&[u8]]) -> Result<(Option<bool>, Option<f64>), String> {
        let volts = |text| cell::number(text, self.heading.comma());
        let text = cells.get(column.index).copied().unwrap_or_default();
        let level = self.of_cell(column, text)?;
        Ok((level, column.threshold.and_then(|_| volts(text))))
    }

    fn of_cell(&self, column: &Column, text: &[u8]) -> Result<Option<bool>, String> {
        let shown = || String::from_utf8_lossy(text);
        match (cell::level(text), &column.threshold) {
            (Cell::Other, None) if column.bit.is_some() => match (cell::word(text), column.bit) {
                (Some(word), Some(bit)) => Ok(Some(word >> bit & 1 == 1)),
                _ => Err(format!("{:?} is not a number in hex", shown())),
            },
            (Cell::Level(level), None) => Ok(Some(level)),
            (Cell::Nothing, _) => Ok(None),
            (_, Some(threshold)) => match cell::number(text, self.heading.comma()) {
                Some(volts) => Ok(Some(threshold.level(volts, column.level))),
                None => Err(format!("{:?} is no voltage", shown())),
            },
            (Cell::Other, None) => Err(format!("{:?}, where a level is 0 or 1", shown())),
        }
    }

    /// Takes a row; if something is wrong with it, returns that and changes nothing.
    fn row(&mut self, row: &[u8], changes: &mut Vec<Change>) -> Result<(), String> {
        let cells = self.heading.split(row);
        let needed = self.columns.last().map_or(0, |column| column.index);
        if cells.len() <= needed {
            return Err(format!("the row has {} columns, the heading {}", cells.len(), self.heading.columns()));
        }
        let time = self.time(&cells)?;
        if let Some(before) = self.now.filter(|before| time < *before) {
            let (now, before) = (time.ps() as f64 / SECOND as f64, before.ps() as f64 / SECOND as f64);
            return Err(format!("time goes back from {before} s to {now} s"));
        }
        let levels = self.columns.iter().map(|column| self.level(column, &cells)).collect::<Result<Vec<_>, _>>()?;
        self.rows += 1;
        self.now = Some(time);
        if levels.iter().all(|(level, _)| level.is_none()) {
            // No data from here on.
            self.since.get_or_insert(time);
            return Ok(());
        }
        if let Some(from) = self.since.take() {
            self.hole = Some(Hole { from, to: time });
            self.columns.iter_mut().for_each(|column| column.level = None);
        }
        for ((channel, column), (level, volts)) in (0_u16..).zip(&mut self.columns).zip(levels) {
            if let (Some(threshold), Some(volts)) = (&mut column.threshold, volts) {
                threshold.follow(volts);
            }
            if let Some(level) = level.filter(|level| column.level != Some(*level)) {
                column.level = Some(level);
                changes.push(Change { time, channel, level });
            }
        }
        Ok(())
    }
}

/// Numbered rows that were read but not yet taken.
type Waiting = VecDeque<(u64, Vec<u8>)>;

/// Reads the lines of a heading and the first two rows after it: up to the second of two consecutive lines of numbers.
fn beginning(lines: &mut Lines) -> Result<(Vec<Vec<u8>>, Waiting), Fault> {
    let mut above: Vec<Vec<u8>> = Vec::new();
    let mut waiting = Waiting::new();
    let mut text = Vec::new();
    while lines.next(&mut text)? {
        if heading::is_row(&text) {
            waiting.push_back((lines.line, text.clone()));
            if waiting.len() == 2 {
                break;
            }
        } else if !text.is_empty() {
            above.extend(waiting.drain(..).map(|(_, row)| row));
            above.push(text.clone());
        }
        if above.len() > heading::LONGEST {
            break;
        }
    }
    Ok((above, waiting))
}

/// Finds the columns that are channels: all their cells are levels, or all are voltages.
fn columns(heading: &Heading, rows: &Waiting, threshold: Option<f64>) -> (Vec<Column>, Vec<String>) {
    let mut digital = vec![true; heading.columns()];
    let mut numbers: Vec<Vec<f64>> = vec![Vec::new(); heading.columns()];
    let mut other = vec![0_usize; heading.columns()];
    // The digits of the longest word of a pod.
    let mut words = vec![0_usize; heading.columns()];
    for (_, row) in rows {
        for (index, text) in heading.split(row).into_iter().enumerate().take(heading.columns()) {
            let kind = cell::level(text);
            let (Some(digital), Some(numbers), Some(other), Some(digits)) =
                (digital.get_mut(index), numbers.get_mut(index), other.get_mut(index), words.get_mut(index))
            else {
                continue;
            };
            match (kind, cell::number(text, heading.comma())) {
                (Cell::Nothing, _) => {}
                (_, None) if cell::word(text).is_some() => *digits = (text.len() - 2).max(*digits),
                (kind, Some(number)) => {
                    *digital &= matches!(kind, Cell::Level(_));
                    numbers.push(number);
                }
                (_, None) => *other += 1,
            }
        }
    }
    let (mut columns, mut names) = (Vec::new(), Vec::new());
    for index in 0..heading.columns() {
        if !heading.may_be_channel(index) {
            continue;
        }
        if let Some(digits @ 1..=16) = words.get(index) {
            let lines = heading.pod(index, (4 * digits) as u8);
            columns.extend((0..).zip(&lines).map(|(bit, _)| Column {
                index,
                threshold: None,
                bit: Some(bit),
                level: None,
            }));
            names.extend(lines);
            continue;
        }
        let Some(values) =
            numbers.get_mut(index).filter(|values| values.len() > other.get(index).copied().unwrap_or(0))
        else {
            continue;
        };
        let is_digital = digital.get(index).copied().unwrap_or(false);
        let threshold = if is_digital { None } else { Some(Threshold::find(values, threshold)) };
        columns.push(Column { index, threshold, bit: None, level: None });
        names.push(heading.name(index));
    }
    (columns, names)
}

impl Line for Table {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.lines.input)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        let (first, mut rows) = (changes.len(), 0);
        if self.backwards && !self.over {
            self.over = true;
            self.turn()?;
        }
        if self.backwards {
            changes.extend(self.turned.drain(..BLOCK.min(self.turned.len())));
            self.now = changes.last().map(|last| last.time).or(self.now);
            if !self.turned.is_empty() {
                return Ok(true);
            }
        }
        while !self.over
            && changes.len() < enough
            && rows < 16 * BLOCK
            && !(self.since.is_some() && changes.len() > first)
        {
            if rows > 0 && self.waiting.is_empty() && self.lines.input.pauses() {
                break;
            }
            let more = self.step(changes);
            self.over = !matches!(more, Ok(true));
            more?;
            rows += 1;
        }
        if let (true, Some((line, what))) = (self.over, self.first_bad.take()) {
            let all = if self.bad == 1 {
                "this row was left out".to_owned()
            } else {
                format!("{} rows were left out", self.bad)
            };
            return Err(Fault::new(&self.name, At::Line(line), format!("{what}; {all}")));
        }
        Ok(!self.over)
    }

    fn reached(&self) -> Time {
        self.now.unwrap_or_default()
    }

    fn hole(&mut self) -> Option<Hole> {
        self.hole.take()
    }
}
