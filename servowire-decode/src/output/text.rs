//! One line per transaction, as wide as the terminal, or a hundred columns without one; longer lines continue below.
//!
//! ```text
//!      10.000 us  <>  ID 3  SF EA1  ABS 3915817  ABM 0  ALMC OF BE BA  0.466802 turns  +3.00 us  ok
//! ```
//! `>` is a request, `<` an answer, `<>` a good request with its answer.

use std::collections::{BTreeMap, HashMap};
use std::fmt::Write as _;
use std::io::{self, Write};

use super::printer::{Origin, Printer};
use crate::event::{Direction, Event, Field, Place, Value, Verdict};

/// Columns of a line if there is no terminal, and the minimum for a terminal.
const COLUMNS: usize = 100;
const FEWEST: usize = 40;
/// A value wider than this extends beyond its column.
const WIDEST: usize = 24;
/// Fields that hardly ever change are shown only when they do.
const STEADY: &[&str] = &["ENID", "delay"];
/// A good check field is not shown, because the verdict covers it.
const CHECKED: &str = "CRC";

const REFUSED: &str = "REFUSED";
/// Bold and red, and back (ECMA-48, SGR).
const ALARM: [&str; 2] = ["\x1b[1m\x1b[31m", "\x1b[0m"];

/// Prints for people.
pub struct Text<W> {
    out: W,
    line: Columns,
    /// A good request of each line whose answer may follow.
    held: BTreeMap<usize, Event>,
    headings: bool,
    /// The widest value of each field so far, so that lines of one kind align in columns.
    widths: HashMap<&'static str, usize>,
    /// The last shown values of a line's rarely changing fields.
    steady: HashMap<(usize, &'static str), Value>,
}

impl<W: Write> Text<W> {
    /// Plain lines.
    pub fn new(out: W) -> Self {
        Self {
            out,
            line: Columns { text: String::new(), pieces: Vec::new(), colour: false, most: COLUMNS },
            held: BTreeMap::new(),
            headings: false,
            widths: HashMap::new(),
            steady: HashMap::new(),
        }
    }

    /// Prints the name of each file above its lines.
    #[must_use]
    pub fn with_headings(self) -> Self {
        Self { headings: true, ..self }
    }

    /// Highlights refused frames.
    #[must_use]
    pub fn with_colour(mut self) -> Self {
        self.line.colour = true;
        self
    }

    /// Breaks lines at the width of a terminal.
    #[must_use]
    pub fn with_columns(mut self, columns: usize) -> Self {
        self.line.most = columns.max(FEWEST);
        self
    }

    fn print(
        &mut self,
        origin: &Origin,
        speaks: usize,
        event: &Event,
        place: Place,
        direction: &str,
    ) -> io::Result<()> {
        self.line.begin(place);
        if origin.lanes.len() > 1 {
            let names = || origin.lanes.iter().map(|lane| lane.channel.as_str());
            let widest = names().map(str::len).max().unwrap_or(0);
            let _ = write!(self.line.text, "  {:<widest$}", names().nth(speaks).unwrap_or_default());
        }
        let _ = write!(self.line.text, "  {direction:<2}");
        let _ = write!(self.line.piece(), "{:<4}", event.kind);
        for field in &event.fields {
            if field.name == CHECKED && event.verdict.is_ok() {
                continue;
            }
            if STEADY.contains(&field.name) {
                let known = self.steady.entry((speaks, field.name)).or_insert_with(|| Value::Text(String::new()));
                if *known == field.value {
                    continue;
                }
                known.clone_from(&field.value);
            }
            let line = self.line.piece();
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
            let _ = write!(self.line.piece(), "{turns:8.6} turns");
        }
        if let Some(delay) = event.delay {
            let _ = write!(self.line.piece(), "+{:.2} us", delay as f64 / 1e6);
        }
        if !event.remark {
            verdict_text(self.line.piece(), &event.verdict);
        }
        self.line.write(&mut self.out)
    }

    /// Prints the request of line `speaks` that is waiting for its answer.
    fn release(&mut self, origin: &Origin, speaks: usize) -> io::Result<()> {
        match self.held.remove(&speaks) {
            Some(request) => self.print(origin, speaks, &request, request.place, ">"),
            None => Ok(()),
        }
    }
}

/// A line made of unbreakable pieces.
struct Columns {
    text: String,
    /// Where its lines begin.
    pieces: Vec<usize>,
    colour: bool,
    /// Columns of a line.
    most: usize,
}

impl Columns {
    fn begin(&mut self, place: Place) {
        self.text.clear();
        self.pieces.clear();
        let _ = match place {
            Place::Time { start, .. } => write!(self.text, "{:>11.3} us", start.us()),
            Place::Line(number) => write!(self.text, "line {number:>5}"),
        };
    }

    /// Returns the place for another piece.
    fn piece(&mut self) -> &mut String {
        self.text.push_str("  ");
        self.pieces.push(self.text.len());
        &mut self.text
    }

    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        if !self.colour && self.text.len() <= self.most {
            out.write_all(self.text.as_bytes())?;
            return out.write_all(b"\n");
        }
        let indent = self.pieces.first().copied().unwrap_or(0);
        out.write_all(self.text.get(..indent).unwrap_or_default().as_bytes())?;
        let (mut at, mut first) = (indent, true);
        let ends = self.pieces.iter().skip(1).copied().chain([self.text.len()]);
        for (from, to) in self.pieces.iter().zip(ends) {
            let piece = self.text.get(*from..to).unwrap_or_default().trim_end();
            let width = to - from;
            if !first && at + 2 + piece.chars().count() > self.most && indent + piece.len() <= self.most {
                write!(out, "\n{:indent$}", "")?;
                at = indent;
            } else if !first {
                out.write_all(b"  ")?;
                at += 2;
            }
            first = false;
            at = self.words(out, piece, at, indent)?;
            // Padding keeps the columns.
            let padding = width.saturating_sub(2 + piece.len());
            if to < self.text.len() && at + padding < self.most {
                write!(out, "{:padding$}", "")?;
                at += padding;
            }
        }
        out.write_all(b"\n")
    }

    /// Puts a piece at a column; a piece longer than a line is split between words.
    fn words(&self, out: &mut impl Write, piece: &str, mut at: usize, indent: usize) -> io::Result<usize> {
        for (k, word) in piece.split(' ').enumerate() {
            let width = word.chars().count();
            if k > 0 && at + 1 + width > self.most {
                write!(out, "\n{:indent$}", "")?;
                at = indent;
            } else if k > 0 {
                out.write_all(b" ")?;
                at += 1;
            }
            if k == 0 && word == REFUSED && self.colour {
                write!(out, "{}{word}{}", ALARM[0], ALARM[1])?;
            } else {
                out.write_all(word.as_bytes())?;
            }
            at += width;
        }
        Ok(at)
    }
}

impl<W: Write> Printer for Text<W> {
    fn begin(&mut self, origin: &Origin) -> io::Result<()> {
        self.steady.clear();
        if self.headings { writeln!(self.out, "{}", origin.file) } else { Ok(()) }
    }

    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        let speaks = origin.speaks;
        match event.direction {
            Some(Direction::Answer) => {
                if let Some(request) = self.held.remove(&speaks) {
                    if event.kind == request.kind {
                        return self.print(origin, speaks, event, request.place, "<>");
                    }
                    self.print(origin, speaks, &request, request.place, ">")?;
                }
                self.print(origin, speaks, event, event.place, "<")
            }
            Some(Direction::Request) => {
                self.release(origin, speaks)?;
                if event.verdict.is_ok() {
                    self.held.insert(speaks, event.clone());
                    return Ok(());
                }
                self.print(origin, speaks, event, event.place, ">")
            }
            None => {
                self.release(origin, speaks)?;
                self.print(origin, speaks, event, event.place, "")
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        for speaks in 0..origin.lanes.len().max(1) {
            self.release(origin, speaks)?;
        }
        if self.headings {
            writeln!(self.out)?;
        }
        self.out.flush()
    }
}

/// Returns a field as shown: its name and its value.
pub fn shown(field: &Field) -> String {
    let mut text = String::new();
    field_text(&mut text, field);
    text
}

/// Returns a verdict as shown.
pub fn verdict(verdict: &Verdict) -> String {
    let mut text = String::new();
    verdict_text(&mut text, verdict);
    text
}

fn field_text(line: &mut String, field: &Field) {
    let name = field.name;
    let _ = match &field.value {
        Value::Number { value, unit: "" } => write!(line, "{name} {value}"),
        Value::Number { value, unit } => write!(line, "{name} {value} {unit}"),
        Value::Decimal { value, unit } => write!(line, "{name} {value:.2} {unit}"),
        Value::Hex { value, digits } => write!(line, "{name} {value:0digits$X}"),
        Value::Flags { raw: 0, .. } => write!(line, "{name} 0"),
        // The names alone, unless one of the bits has none.
        Value::Flags { raw, set, .. } if raw.count_ones() as usize == set.len() => {
            write!(line, "{name} {}", set.join(" "))
        }
        Value::Flags { raw, digits, set } if set.is_empty() => write!(line, "{name} {raw:0digits$X}"),
        Value::Flags { raw, digits, set } => write!(line, "{name} {raw:0digits$X} [{}]", set.join(" ")),
        Value::Text(text) => write!(line, "{name} {text}"),
    };
}

fn verdict_text(line: &mut String, verdict: &Verdict) {
    match verdict {
        Verdict::Ok => line.push_str("ok"),
        Verdict::Refused(refusal) => {
            let _ = write!(line, "{REFUSED} {}", refusal.class);
            if let Some(field) = &refusal.field {
                let _ = write!(line, " in {field}");
            }
            if let Some(bit) = refusal.bit {
                let _ = write!(line, " bit {bit}");
            }
            if let Some(time) = refusal.time {
                let _ = write!(line, " at {:.3} us", time.us());
            }
            let _ = write!(line, ": {}", refusal.reason);
            if let Some(cause) = &refusal.cause {
                let _ = write!(line, " ({cause})");
            }
        }
    }
}
