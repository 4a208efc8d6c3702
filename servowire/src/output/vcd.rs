//! The capture again, with the decoded frames beside it as string variables (GTKWave, Surfer).

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use vcd::{IdCode, TimescaleUnit, VarType, Writer};

use super::Lane;
use crate::capture::Change;
use crate::event::{Direction, Event, Field, Place, Value, Verdict};

/// An event comes after the edges it was made of; edges wait so long for it, in picoseconds.
const WINDOW: i64 = 2_000_000_000;

/// What a string variable shows between frames. The format has no empty string.
const NOTHING: &str = "-";

/// A VCD being written.
pub struct VcdOut {
    writer: Writer<BufWriter<File>>,
    /// Codes of the capture's channels.
    channels: Vec<IdCode>,
    /// Lines found before the header was written.
    lanes: Vec<Lane>,
    /// The codes of each.
    strings: Vec<Strings>,
    /// The line that the events are of.
    lane: usize,
    /// What is to be written, in order.
    waiting: BTreeMap<(i64, u64), Item>,
    sequence: u64,
    /// Time of the capture that is 0 in the file.
    origin: Option<i64>,
    written: Option<u64>,
}

#[derive(Clone)]
struct Strings {
    frame: IdCode,
    verdict: IdCode,
    names: &'static [&'static str],
    fields: Vec<IdCode>,
}

enum Item {
    Level(IdCode, bool),
    Text(IdCode, String),
}

impl VcdOut {
    /// A new file.
    pub fn create(path: &Path) -> io::Result<Self> {
        Ok(Self {
            writer: Writer::new(BufWriter::new(File::create(path)?)),
            channels: Vec::new(),
            lanes: Vec::new(),
            strings: Vec::new(),
            lane: 0,
            waiting: BTreeMap::new(),
            sequence: 0,
            origin: None,
            written: None,
        })
    }

    pub(super) fn begin_lane(&mut self, lane: Lane) {
        self.lanes.push(lane);
    }

    pub(super) fn lane(&mut self, lane: usize) {
        self.lane = lane;
    }

    /// Writes the header. A line that is found later has no place in it.
    pub(super) fn channels(&mut self, channels: &[String]) -> io::Result<()> {
        let writer = &mut self.writer;
        writer.version("servowire")?;
        writer.timescale(1, TimescaleUnit::NS)?;
        writer.add_module("capture")?;
        for name in channels {
            self.channels.push(writer.add_wire(1, &word(name))?);
        }
        writer.upscope()?;
        for lane in &self.lanes {
            writer.add_module(&format!("decoded_{}", word(&lane.channel)))?;
            let mut string = |name: &str| writer.add_var(VarType::String, 1, name, None);
            let (frame, verdict) = (string("frame")?, string("verdict")?);
            let names = lane.protocol.field_names();
            let fields = names.iter().map(|name| string(name)).collect::<io::Result<Vec<_>>>()?;
            writer.upscope()?;
            self.strings.push(Strings { frame, verdict, names, fields });
        }
        writer.enddefinitions()
    }

    fn wait(&mut self, time: i64, item: Item) {
        self.waiting.insert((time, self.sequence), item);
        self.sequence += 1;
    }

    /// A level of the capture.
    pub(super) fn change(&mut self, change: &Change) -> io::Result<()> {
        if self.origin.is_none() {
            self.origin = Some(change.time.min(0));
            let strings = self.strings.clone();
            for code in strings.iter().flat_map(|s| [s.frame, s.verdict].into_iter().chain(s.fields.clone())) {
                self.wait(change.time, Item::Text(code, NOTHING.to_owned()));
            }
        }
        if let Some(code) = self.channels.get(usize::from(change.channel)).copied() {
            self.wait(change.time, Item::Level(code, change.level));
        }
        self.flush_before(change.time.saturating_sub(WINDOW))
    }

    /// A decoded frame.
    pub(super) fn event(&mut self, event: &Event) {
        let (Place::Time { start, end }, Some(strings)) = (event.place, self.strings.get(self.lane)) else { return };
        let side = match event.direction {
            Some(Direction::Request) => "request ",
            Some(Direction::Answer) => "answer ",
            None => "",
        };
        let verdict = match &event.verdict {
            Verdict::Ok => "ok".to_owned(),
            Verdict::Refused(refusal) => format!("{}: {}", refusal.class, refusal.reason),
        };
        let mut shown = vec![(strings.frame, format!("{side}{}", event.kind)), (strings.verdict, verdict)];
        for (name, code) in strings.names.iter().zip(&strings.fields) {
            if let Some(field) = event.fields.iter().find(|field| field.name == *name) {
                shown.push((*code, text(field)));
            }
        }
        for (code, text) in shown {
            self.wait(start, Item::Text(code, word(&text)));
            self.wait(end, Item::Text(code, NOTHING.to_owned()));
        }
    }

    fn flush_before(&mut self, time: i64) -> io::Result<()> {
        while let Some(first) = self.waiting.first_entry().filter(|first| first.key().0 < time) {
            let ((time, _), item) = first.remove_entry();
            let nanoseconds = (time.saturating_sub(self.origin.unwrap_or(0)).max(0) as u64 + 500) / 1000;
            // An event older than the window is shown late rather than out of order.
            let stamp = nanoseconds.max(self.written.unwrap_or(0));
            if self.written != Some(stamp) {
                self.writer.timestamp(stamp)?;
                self.written = Some(stamp);
            }
            match item {
                Item::Level(code, level) => self.writer.change_scalar(code, level)?,
                Item::Text(code, text) => self.writer.change_string(code, &text)?,
            }
        }
        Ok(())
    }

    /// Writes what is left.
    pub fn finish(&mut self) -> io::Result<()> {
        self.flush_before(i64::MAX)?;
        self.writer.flush()
    }
}

fn text(field: &Field) -> String {
    match &field.value {
        Value::Number { value, unit } => format!("{value} {unit}").trim_end().to_owned(),
        Value::Decimal { value, unit } => format!("{value} {unit}").trim_end().to_owned(),
        Value::Hex { value, digits } => format!("{value:0digits$X}"),
        Value::Flags { raw, digits, set } => format!("{raw:0digits$X} {}", set.join(" ")).trim_end().to_owned(),
        Value::Text(text) => text.clone(),
    }
}

/// As the format wants it: one word of printable ASCII.
fn word(text: &str) -> String {
    let printable = |c: char| if c.is_ascii_graphic() { c } else { '_' };
    if text.is_empty() { NOTHING.to_owned() } else { text.chars().map(printable).collect() }
}
