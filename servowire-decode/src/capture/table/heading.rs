//! The heading of a table: separator, names, units, sample rate.

use std::collections::VecDeque;

use super::cell::{self, Cell};
use crate::time::{self, Time};

/// Maximum number of lines without numbers in a heading.
pub(super) const LONGEST: usize = 512;

/// How the time of a row is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Times {
    /// In a column, in this fraction of a second.
    Column { index: usize, divisor: i64 },
    /// In a column of dates.
    Dates { index: usize },
    /// At a fixed interval, in picoseconds.
    Steps { start: Time, period: f64 },
    /// At a sample rate.
    Rate(u64),
}

/// A heading.
#[derive(Debug)]
pub(super) struct Heading {
    separator: u8,
    comma: bool,
    names: Vec<String>,
    count: usize,
    time: Option<(usize, i64)>,
    fixed: Option<Times>,
}

/// Returns whether a line is a row of data: nearly all cells are numbers, levels or dates.
pub(super) fn is_row(line: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(line) else { return false };
    let text = text.trim().trim_end_matches([',', ';', '\t']);
    if text.is_empty() {
        return false;
    }
    let separator = separator(text.as_bytes());
    let comma = separator == b';';
    let cells = split(text.as_bytes(), separator);
    let plain = |cell: &&&[u8]| {
        !matches!(cell::level(cell), Cell::Other)
            || cell::number(cell, comma).is_some()
            || cell::word(cell).is_some()
            || is_date(cell)
    };
    let numbers = cells.iter().filter(|cell| cell::level(cell) != Cell::Nothing).count();
    numbers > 0 && cells.iter().filter(plain).count() == cells.len()
}

fn is_date(cell: &[u8]) -> bool {
    std::str::from_utf8(cell).is_ok_and(|text| cell::date(text).is_some())
}

pub(crate) fn separator(line: &[u8]) -> u8 {
    if line.contains(&b';') {
        b';'
    } else if line.contains(&b'\t') && !line.contains(&b',') {
        b'\t'
    } else {
        b','
    }
}

fn split(line: &[u8], separator: u8) -> Vec<&[u8]> {
    line.split(|byte| *byte == separator).map(<[u8]>::trim_ascii).collect()
}

/// Returns the cells of a line of text, in which quoted names may contain the separator.
pub(crate) fn titles(line: &str, separator: u8) -> Vec<String> {
    let (mut out, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            letter if !quoted && letter == char::from(separator) => out.push(std::mem::take(&mut cell)),
            letter => cell.push(letter),
        }
    }
    out.push(cell);
    out.into_iter().map(|cell| cell.trim().to_owned()).collect()
}

/// A comment; `#` may also be the title of a column of numbers.
fn is_remark(line: &str) -> bool {
    line.starts_with(';') || line.starts_with('#') && !line.starts_with("#,")
}

/// Parts of a second in a unit of time.
pub(crate) fn unit(text: &str) -> Option<i64> {
    match text.trim().trim_matches(['(', ')', '[', ']']).to_ascii_lowercase().as_str() {
        "s" | "sec" | "second" | "seconds" => Some(1),
        "ms" | "milliseconds" => Some(1_000),
        "us" | "µs" | "μs" | "microseconds" => Some(1_000_000),
        "ns" | "nanoseconds" => Some(1_000_000_000),
        "ps" | "picoseconds" => Some(1_000_000_000_000),
        _ => None,
    }
}

/// The unit in the brackets of a title.
fn bracket(title: &str) -> Option<i64> {
    let from = title.find(['(', '['])?;
    unit(title.get(from..)?)
}

fn is_time(title: &str) -> bool {
    let title = title.to_lowercase();
    ["time", "zeit", "temps", "second", "x-axis", "microseconds", "nanoseconds", "milliseconds", "picoseconds", "in s"]
        .iter()
        .any(|word| title.starts_with(word))
}

/// A line that contains only units.
fn is_units(cells: &[String]) -> bool {
    let known = |cell: &String| {
        let bare = cell.trim_matches(['(', ')']).to_ascii_lowercase();
        unit(cell).is_some()
            || matches!(bare.as_str(), "" | "v" | "mv" | "uv" | "volt" | "volts" | "value" | "logic" | "sequence")
    };
    cells.len() > 1 && cells.iter().all(known)
}

impl Heading {
    /// Reads the lines above the first row. Returns `None` if they give neither times nor a rate, and the rate is not known
    /// otherwise (`knows`).
    pub(super) fn parse(above: &[Vec<u8>], rows: &[&[u8]], knows: Option<u64>) -> Option<Self> {
        let lines: Vec<String> = above.iter().map(|line| String::from_utf8_lossy(line).into_owned()).collect();
        let (remarks, lines): (Vec<&str>, Vec<&str>) =
            lines.iter().map(String::as_str).partition(|line| is_remark(line.trim_start()));
        let last = lines.last().copied().unwrap_or_default();
        let row = rows.first().copied().unwrap_or_default();
        let separator = separator(if row.is_empty() { last.as_bytes() } else { row });
        let count = if row.is_empty() { titles(last, separator).len() } else { split(row, separator).len() };
        let mut heads: Vec<Vec<String>> = lines.iter().map(|line| titles(line, separator)).collect();
        let only_units =
            |cells: &Vec<String>| is_units(cells) && !cells.iter().any(|cell| is_time(cell) && unit(cell).is_none());
        let units = if heads.last().is_some_and(only_units) { heads.pop() } else { None };
        // Rigol: first time and period stand after the units.
        let steps = if heads.last().is_some_and(|cells| cells.first().is_some_and(|cell| cell == "Sequence")) {
            heads.pop().and_then(|cells| Self::steps(&cells))
        } else {
            None
        };
        // A line of units may be the only heading; a key with its value is not.
        let is_heading = |cells: &&Vec<String>| {
            let number = |cell: &String| cell::number(cell.as_bytes(), false).is_some();
            cells.len() >= count.min(2)
                && (!cells.iter().any(number) || cells.first().is_some_and(|cell| is_time(cell)))
        };
        let names = heads.last().filter(is_heading).cloned().or(units.clone()).unwrap_or_default();
        let said = |key: &str| {
            let start = |line: &&&str| line.trim_start_matches([';', '#', ' ']).to_ascii_lowercase().starts_with(key);
            let line = remarks.iter().find(start)?;
            Some(line.split_once(':')?.1.trim().to_owned())
        };
        let rate = said("samplerate").or_else(|| said("sample rate")).and_then(|text| time::frequency(&text));
        let rate = rate.or(knows.map(|rate| rate as f64));
        let channels: Vec<String> = said("channels")
            .map(|text| text.split(',').map(|name| name.trim().to_owned()).collect())
            .unwrap_or_default();
        let mut heading = Self { separator, comma: separator == b';', names, count, time: None, fixed: steps };
        if steps.is_none() {
            heading.find_time(units.as_deref(), &heads, rate, channels.len());
        }
        if heading.time.is_none() && heading.fixed.is_none() && rate.is_none() {
            heading.time = heading.growing(rows).map(|index| (index, 1));
        }
        if heading.time.is_none() && heading.fixed.is_none() {
            let rate = rate.filter(|rate| (1.0..=1e12).contains(rate))?;
            heading.fixed = Some(Times::Rate(rate.round() as u64));
        }
        if !channels.is_empty() {
            heading.name_by(&channels);
        }
        Some(heading)
    }

    fn find_time(&mut self, units: Option<&[String]>, heads: &[Vec<String>], rate: Option<f64>, channels: usize) {
        // Rigol: start and increment after the units; memory saves have t0 and tInc among the names.
        if let (Some(first), Some(last)) = (self.names.first(), heads.last()) {
            let after = |key: &str| {
                last.iter().find_map(|cell| {
                    Some(
                        cell.replace(' ', "")
                            .split_once(key)?
                            .1
                            .trim_start_matches('=')
                            .trim_end_matches('s')
                            .to_owned(),
                    )
                })
            };
            if let (Some(start), Some(period)) = (after("t0="), after("tInc=")) {
                if let (Ok(start), Ok(period)) = (start.parse::<f64>(), period.parse::<f64>()) {
                    self.fixed =
                        Some(Times::Steps { start: Time::from_ps((start * 1e12) as i128), period: period * 1e12 });
                    return;
                }
            }
            if first.eq_ignore_ascii_case("x") {
                self.fixed = Self::steps(last);
                return;
            }
        }
        let time = self.names.iter().position(|name| is_time(name));
        // The names may not say it, but the units do.
        let time = time.or_else(|| units?.iter().position(|cell| unit(cell).is_some()));
        if let Some(index) = time {
            let name = self.names.get(index).map_or("", String::as_str);
            let by_units = units.and_then(|units| unit(units.get(index)?));
            // sigrok names no unit with the channels' names: it follows from the rate.
            let by_rate = rate.filter(|_| channels > 0 && unit(name).is_none()).map(|rate| match rate {
                ..=1e3 => 1_000,
                ..=1e6 => 1_000_000,
                ..=1e9 => 1_000_000_000,
                _ => 1_000_000_000_000,
            });
            let divisor = bracket(name).or(unit(name)).or(by_units).or(by_rate).unwrap_or(1);
            self.time = Some((index, divisor));
        }
    }

    /// Rigol's second line: `Sequence,Volt,Volt,START,INCREMENT`.
    fn steps(cells: &[String]) -> Option<Times> {
        let mut numbers = cells.iter().rev().filter_map(|cell| cell::number(cell.as_bytes(), false));
        let (period, start) = (numbers.next()?, numbers.next()?);
        Some(Times::Steps { start: Time::from_ps((start * 1e12) as i128), period: period * 1e12 })
    }

    /// Picks the column of times if nothing identifies it: the first column that increases from row to row and is not the
    /// only one.
    fn growing(&self, rows: &[&[u8]]) -> Option<usize> {
        let [first, second] = rows else { return None };
        let numbers = |row: &[u8]| -> Vec<Option<f64>> {
            self.split(row).into_iter().map(|cell| cell::number(cell, self.comma)).collect()
        };
        let (first, second) = (numbers(first), numbers(second));
        let both = first.iter().zip(&second).filter_map(|(a, b)| a.zip(*b));
        let grows = first.iter().zip(&second).position(|(a, b)| a.zip(*b).is_some_and(|(a, b)| a < b && b - a < 1.0));
        grows.filter(|_| both.count() > 1)
    }

    /// Names of the channels from a comment; the column of times is not among them.
    fn name_by(&mut self, channels: &[String]) {
        let mut names = channels.iter();
        let skip = self.time.map(|(index, _)| index);
        self.names = (0..self.count)
            .map(
                |index| if Some(index) == skip { "Time".to_owned() } else { names.next().cloned().unwrap_or_default() },
            )
            .collect();
    }

    /// Columns of a row.
    pub(super) fn columns(&self) -> usize {
        self.count
    }

    /// Whether the decimal mark is a comma.
    pub(super) fn comma(&self) -> bool {
        self.comma
    }

    pub(super) fn split<'a>(&self, row: &'a [u8]) -> Vec<&'a [u8]> {
        split(row, self.separator)
    }

    /// Returns whether a column may hold a channel: it is not a column of times.
    pub(super) fn may_be_channel(&self, index: usize) -> bool {
        let name = self.names.get(index).map_or("", String::as_str);
        self.time.is_none_or(|(time, _)| time != index) && !is_time(name) && !["x", "X", "#"].contains(&name)
    }

    /// The name of a column without its unit.
    pub(super) fn name(&self, index: usize) -> String {
        let name = self.names.get(index).map_or("", String::as_str).trim();
        let bare = ["(V)", "(mV)", "(Volt)"].iter().fold(name, |name, unit| name.trim_end_matches(unit).trim_end());
        if bare.is_empty() { format!("column {}", index + 1) } else { bare.to_owned() }
    }

    /// The names of the lines of a pod of this many bits, the lowest first: those of `D7-D0` are `D0` to `D7`.
    pub(super) fn pod(&self, index: usize, bits: u8) -> Vec<String> {
        let name = self.name(index);
        let part = |text: &str| {
            let (letters, digits) = text.split_at(text.find(|c: char| c.is_ascii_digit())?);
            Some((letters.to_owned(), digits.parse::<u8>().ok()?))
        };
        let ends = name.split_once('-').and_then(|(most, least)| Some((part(most.trim())?, part(least.trim())?)));
        match ends {
            Some(((letters, most), (_, least))) if most >= least && most - least < 64 => {
                (least..=most).map(|number| format!("{letters}{number}")).collect()
            }
            _ => (0..bits).map(|bit| format!("{name}[{bit}]")).collect(),
        }
    }

    /// Determines from the first rows how the times are given, and whether they decrease.
    pub(super) fn times(&self, rows: &VecDeque<(u64, Vec<u8>)>) -> Option<(Times, bool)> {
        if let Some(fixed) = self.fixed {
            return Some((fixed, false));
        }
        let (index, divisor) = self.time?;
        let stamp = |row: &[u8]| {
            let text = String::from_utf8_lossy(self.split(row).get(index)?).into_owned();
            cell::time(&text, divisor)
        };
        let first = rows.front().map(|(_, row)| row.as_slice()).unwrap_or_default();
        if self.split(first).get(index).is_some_and(|cell| is_date(cell)) {
            return Some((Times::Dates { index }, false));
        }
        let stamps: Vec<Time> = rows.iter().filter_map(|(_, row)| stamp(row)).collect();
        let pairs =
            |is: fn(Time, Time) -> bool| stamps.windows(2).filter(|pair| matches!(pair, [a, b] if is(*a, *b))).count();
        // A row or two may be mistaken.
        let falls = stamps.len() > 8 && pairs(|a, b| a > b) > 2 * pairs(|a, b| a < b);
        let times = match (stamps.first(), stamps.last()) {
            // Stamps with too few digits: the rows are taken at equal distances.
            (Some(first), Some(last)) if 4 * pairs(|a, b| a == b) > stamps.len() && stamps.len() > 64 => {
                Times::Steps { start: *first, period: (*last - *first) as f64 / (stamps.len() - 1) as f64 }
            }
            _ => Times::Column { index, divisor },
        };
        Some((times, falls))
    }
}
