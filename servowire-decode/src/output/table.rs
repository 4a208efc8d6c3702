//! CSV for spreadsheets: one row per frame, one column per field, numbers as numbers.

use std::borrow::Cow;
use std::io::{self, Write};

use super::printer::{Origin, Printer};
use crate::event::{Direction, Event, Place, Value, Verdict};

/// Columns that every file has; the columns of the fields follow, and finally anything without its own column.
const COLUMNS: [&str; 17] = [
    "file",
    "channel",
    "address",
    "protocol",
    "line",
    "start_us",
    "end_us",
    "direction",
    "kind",
    "position",
    "turns",
    "delay_us",
    "verdict",
    "at_field",
    "reason",
    "cause",
    "flags",
];
const MORE: &str = "more";

/// Frames that are held back to learn the fields of a log.
const HELD: usize = 512;

/// Writes a table.
pub struct Csv<W: Write> {
    out: csv::Writer<W>,
    /// Names of the fields that have a column, once the heading is written.
    names: Option<Vec<&'static str>>,
    /// Rows that wait for the heading.
    held: Vec<Event>,
}

impl<W: Write> Csv<W> {
    /// Writes to `out`.
    pub fn new(out: W) -> Self {
        let out = csv::WriterBuilder::new().flexible(false).from_writer(out);
        Self { out, names: None, held: Vec::new() }
    }

    /// Writes the heading, and the rows that waited for it.
    fn heading(&mut self, origin: &Origin) -> io::Result<()> {
        if self.names.is_none() {
            let mut names: Vec<&'static str> = Vec::new();
            let of_lanes = origin.lanes.iter().flat_map(|lane| lane.protocol.fields.iter().copied());
            let of_events = self.held.iter().flat_map(|event| event.fields.iter().map(|field| field.name));
            for name in of_lanes.chain(of_events) {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
            self.out.write_record(COLUMNS.into_iter().chain(names.iter().copied()).chain([MORE]))?;
            self.names = Some(names);
        }
        for event in std::mem::take(&mut self.held) {
            self.row(origin, &event)?;
        }
        Ok(())
    }

    fn row(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        let lane = origin.lane();
        let names = self.names.as_deref().unwrap_or_default();
        let out = &mut self.out;
        out.write_field(&origin.file)?;
        out.write_field(lane.map_or("", |lane| &lane.channel))?;
        out.write_field(event.address.map_or_else(String::new, |address| address.to_string()))?;
        out.write_field(lane.map_or("", |lane| lane.protocol.title))?;
        match event.place {
            Place::Line(line) => [line.to_string(), String::new(), String::new()],
            Place::Time { start, end } => [String::new(), microseconds(start.ps()), microseconds(end.ps())],
        }
        .iter()
        .try_for_each(|field| out.write_field(field))?;
        out.write_field(match event.direction {
            Some(Direction::Request) => "request",
            Some(Direction::Answer) => "answer",
            None => "",
        })?;
        out.write_field(event.kind.as_bytes())?;
        out.write_field(event.position.map_or_else(String::new, |position| position.counts.to_string()))?;
        let turns = event.position.and_then(|position| position.turns());
        out.write_field(turns.map_or_else(String::new, |turns| turns.to_string()))?;
        out.write_field(event.delay.map_or_else(String::new, |delay| microseconds(delay.into())))?;
        match &event.verdict {
            Verdict::Ok => ["ok", "", "", ""].iter().try_for_each(|field| out.write_field(field))?,
            Verdict::Refused(refusal) => {
                let field = refusal.field.as_deref().unwrap_or_default();
                let cause = refusal.cause.as_deref().unwrap_or_default();
                [refusal.class, field, &refusal.reason, cause].iter().try_for_each(|field| out.write_field(field))?;
            }
        }
        let flags: Vec<&str> = event.fields.iter().flat_map(|field| set(&field.value)).copied().collect();
        out.write_field(flags.join(" "))?;
        for name in names {
            let field = event.fields.iter().find(|field| field.name == *name);
            out.write_field(field.map_or(Cow::Borrowed(""), |field| cell(&field.value)).as_bytes())?;
        }
        let more = event.fields.iter().filter(|field| !names.contains(&field.name));
        let more: Vec<String> = more.map(|field| format!("{}={}", field.name, cell(&field.value))).collect();
        out.write_field(more.join("; "))?;
        out.write_record(None::<&[u8]>)?;
        Ok(())
    }
}

/// Converts picoseconds to microseconds, exactly.
fn microseconds(time: i128) -> String {
    let sign = if time < 0 { "-" } else { "" };
    let time = time.unsigned_abs();
    format!("{sign}{}.{:06}", time / 1_000_000, time % 1_000_000)
}

fn set(value: &Value) -> &[&'static str] {
    match value {
        Value::Flags { set, .. } => set,
        _ => &[],
    }
}

fn cell(value: &Value) -> Cow<'_, str> {
    match value {
        Value::Number { value, .. } => Cow::Owned(value.to_string()),
        Value::Decimal { value, .. } => Cow::Owned(value.to_string()),
        Value::Hex { value, .. } | Value::Flags { raw: value, .. } => Cow::Owned(value.to_string()),
        Value::Text(text) => Cow::Borrowed(text),
    }
}

impl<W: Write> Printer for Csv<W> {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        if self.names.is_none() && origin.lanes.is_empty() {
            // A log: its fields are those that come.
            self.held.push(event.clone());
            return if self.held.len() < HELD { Ok(()) } else { self.heading(origin) };
        }
        self.heading(origin)?;
        self.row(origin, event)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        if !self.held.is_empty() {
            self.heading(origin)?;
        }
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn microseconds_keep_every_digit() {
        assert_eq!(microseconds(17_000_001), "17.000001");
        assert_eq!(microseconds(-70_000_000), "-70.000000");
        assert_eq!(microseconds(-1), "-0.000001");
    }
}
