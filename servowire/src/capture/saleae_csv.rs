//! Saleae Logic 2 digital CSV: `Time [s],Channel 0,...`, a row whenever a channel changes.

use std::io;

use csv::{ByteRecord, Reader, ReaderBuilder};

use super::{Change, Input, Line, time};
use crate::fault::{At, Fault};

/// Changes given at once.
const BLOCK: usize = 4096;

/// A CSV export behind its heading.
pub struct SaleaeCsv {
    name: String,
    reader: Reader<Input>,
    record: ByteRecord,
    channels: Vec<String>,
    levels: Vec<Option<bool>>,
    now: Option<i64>,
    over: bool,
}

impl SaleaeCsv {
    /// Reads the heading.
    pub fn new(input: Input) -> Result<Self, Fault> {
        let name = input.name().to_owned();
        let mut reader = ReaderBuilder::new().has_headers(false).flexible(true).from_reader(input);
        let mut record = ByteRecord::new();
        reader.read_byte_record(&mut record).map_err(|e| read_fault(&name, &e))?;
        let titles: Vec<String> = record.iter().map(|c| String::from_utf8_lossy(c).trim().to_owned()).collect();
        let first = titles.first().map_or("", |t| t.trim_start_matches('\u{feff}')).to_ascii_lowercase();
        if !first.starts_with("time") || titles.len() < 2 {
            let what = "the heading of a Logic 2 export (\"Time [s],Channel 0,...\") is missing";
            return Err(Fault::new(&name, At::Line(1), what));
        }
        if u16::try_from(titles.len()).is_err() {
            return Err(Fault::new(&name, At::Line(1), "more than 65535 columns"));
        }
        let channels: Vec<String> = titles.into_iter().skip(1).collect();
        let levels = vec![None; channels.len()];
        Ok(Self { name, reader, record, channels, levels, now: None, over: false })
    }

    fn step(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        if !self.reader.read_byte_record(&mut self.record).map_err(|e| read_fault(&self.name, &e))? {
            return Ok(false);
        }
        let line = self.record.position().map_or(0, csv::Position::line);
        let fault = |what: String| Fault::new(&self.name, At::Line(line), what);
        let cell = |column: usize| String::from_utf8_lossy(self.record.get(column).unwrap_or_default()).into_owned();
        if self.record.len() != self.channels.len() + 1 {
            let (got, want) = (self.record.len(), self.channels.len() + 1);
            return Err(fault(format!("the row has {got} columns, the heading {want}")));
        }
        let text = cell(0);
        let Some(now) = time::from_decimal(&text) else {
            return Err(fault(format!("\"{text}\" is not a time in seconds")));
        };
        if let Some(before) = self.now.filter(|before| now < *before) {
            let (now, before) = (now as f64 / 1e12, before as f64 / 1e12);
            return Err(fault(format!("time goes back from {before} s to {now} s")));
        }
        self.now = Some(now);
        for (channel, known) in (0_u16..).zip(&mut self.levels) {
            let column = usize::from(channel) + 1;
            let level = match self.record.get(column).unwrap_or_default().trim_ascii() {
                b"0" => false,
                b"1" => true,
                _ => {
                    let (title, got) = (self.channels.get(usize::from(channel)), cell(column));
                    let title = title.map_or("", String::as_str);
                    return Err(fault(format!("column \"{title}\" holds \"{got}\", where a level is 0 or 1")));
                }
            };
            if *known != Some(level) {
                *known = Some(level);
                changes.push(Change { time: now, channel, level });
            }
        }
        Ok(true)
    }
}

impl Line for SaleaeCsv {
    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        while !self.over && changes.len() < enough {
            let more = self.step(changes);
            self.over = !matches!(more, Ok(true));
            more?;
        }
        Ok(!self.over)
    }

    fn reached(&self) -> i64 {
        self.now.unwrap_or(0)
    }
}

fn read_fault(name: &str, error: &csv::Error) -> Fault {
    let line = error.position().map_or(At::File, |p| At::Line(p.line()));
    let what = match error.kind() {
        csv::ErrorKind::Io(e) if e.kind() != io::ErrorKind::InvalidData => e.to_string(),
        _ => error.to_string(),
    };
    Fault::new(name, line, format!("cannot be read: {what}"))
}
