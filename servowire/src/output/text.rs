//! One line a transaction.
//!
//! ```text
//!     10.000 us  <>  ID 3    SF 20 [ea1]  ABS 3915817  ENID 23  ABM 0  ...  = 0.466802 turns  after 3.00 us  ok
//! ```
//! `>` is a request, `<` an answer, `<>` a good request with what it got.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::io::{self, Write};

use super::{Lane, Printer, Sink};
use crate::event::{Direction, Event, Field, Place, Value, Verdict};

/// Prints for people.
pub struct Text<W> {
    out: W,
    line: String,
    /// A good request of each line whose answer may follow.
    held: BTreeMap<usize, Event>,
    /// Names of the lines, and the one that speaks.
    lanes: Vec<String>,
    lane: usize,
    headings: bool,
    /// The widest value of each field so far, so that lines of one kind stand in columns.
    widths: HashMap<&'static str, usize>,
}

/// Wider values are left to stand out of their column.
const WIDEST: usize = 24;

impl<W: Write> Text<W> {
    /// `headings`: print the file's name above its lines.
    pub fn new(out: W, headings: bool) -> Self {
        Self {
            out,
            line: String::new(),
            held: BTreeMap::new(),
            lanes: Vec::new(),
            lane: 0,
            headings,
            widths: HashMap::new(),
        }
    }

    fn print(&mut self, event: &Event, place: Place, direction: &str) -> io::Result<()> {
        let line = &mut self.line;
        line.clear();
        place_column(line, place);
        if self.lanes.len() > 1 {
            let widest = self.lanes.iter().map(String::len).max().unwrap_or(0);
            let _ = write!(line, "  {:<widest$}", self.lanes.get(self.lane).map_or("", String::as_str));
        }
        let _ = write!(line, "  {direction:<2}  {:<6}", event.kind);
        for field in &event.fields {
            line.push_str("  ");
            let from = line.len();
            field_text(line, field);
            let width = line.len() - from;
            if width <= WIDEST {
                let widest = self.widths.entry(field.name).or_default();
                *widest = width.max(*widest);
                let _ = write!(line, "{:1$}", "", *widest - width);
            }
        }
        if let Some(turns) = event.position.and_then(|position| position.turns()) {
            let _ = write!(line, "  = {turns:10.6} turns");
        }
        if let Some(delay) = event.delay {
            let _ = write!(line, "  after {:.2} us", delay as f64 / 1e6);
        }
        verdict_text(line, &event.verdict);
        line.push('\n');
        self.out.write_all(line.as_bytes())
    }

    fn release(&mut self) -> io::Result<()> {
        match self.held.remove(&self.lane) {
            Some(request) => self.print(&request, request.place, ">"),
            None => Ok(()),
        }
    }
}

impl<W: Write> Sink for Text<W> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        match event.direction {
            Some(Direction::Answer) => match self.held.remove(&self.lane) {
                Some(request) if event.kind == request.kind => self.print(event, request.place, "<>"),
                held => {
                    if let Some(request) = held {
                        self.print(&request, request.place, ">")?;
                    }
                    self.print(event, event.place, "<")
                }
            },
            Some(Direction::Request) => {
                self.release()?;
                if event.verdict.is_ok() {
                    self.held.insert(self.lane, event.clone());
                    return Ok(());
                }
                self.print(event, event.place, ">")
            }
            None => {
                self.release()?;
                self.print(event, event.place, "")
            }
        }
    }
}

impl<W: Write> Printer for Text<W> {
    fn begin(&mut self, file: &str) -> io::Result<()> {
        if self.headings { writeln!(self.out, "{file}") } else { Ok(()) }
    }

    fn begin_lane(&mut self, lane: &Lane) -> io::Result<()> {
        self.lanes.push(lane.channel.clone());
        Ok(())
    }

    fn lane(&mut self, lane: usize) {
        self.lane = lane;
    }

    fn end(&mut self) -> io::Result<()> {
        for lane in 0..self.lanes.len().max(1) {
            self.lane = lane;
            self.release()?;
        }
        self.lanes.clear();
        self.lane = 0;
        if self.headings {
            writeln!(self.out)?;
        }
        self.out.flush()
    }
}

fn place_column(line: &mut String, place: Place) {
    let _ = match place {
        Place::Time { start, .. } => write!(line, "{:>14.3} us", start as f64 / 1e6),
        Place::Line(number) => write!(line, "line {number:>6}"),
    };
}

fn field_text(line: &mut String, field: &Field) {
    let name = field.name;
    let _ = match &field.value {
        Value::Number { value, unit: "" } => write!(line, "{name} {value}"),
        Value::Number { value, unit } => write!(line, "{name} {value} {unit}"),
        Value::Hex { value, digits } => write!(line, "{name} {value:0digits$X}"),
        Value::Flags { raw, digits, set } => {
            let _ = write!(line, "{name} {raw:0digits$X}");
            // The brackets of no names are left out.
            if set.is_empty() { Ok(()) } else { write!(line, " [{}]", set.join(" ")) }
        }
        Value::Text(text) => write!(line, "{name} {text}"),
    };
}

fn verdict_text(line: &mut String, verdict: &Verdict) {
    match verdict {
        Verdict::Ok => line.push_str("  ok"),
        Verdict::Refused(refusal) => {
            let _ = write!(line, "  REFUSED {}", refusal.class);
            if let Some(field) = &refusal.field {
                let _ = write!(line, " in {field}");
            }
            if let Some(bit) = refusal.bit {
                let _ = write!(line, " bit {bit}");
            }
            if let Some(time) = refusal.time {
                let _ = write!(line, " at {:.3} us", time as f64 / 1e6);
            }
            let _ = write!(line, ": {}", refusal.reason);
            if let Some(cause) = &refusal.cause {
                let _ = write!(line, " ({cause})");
            }
        }
    }
}
