//! The capture again, with the decoded frames beside it as string variables (GTKWave, Surfer).

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Write};

use vcd::{IdCode, TimescaleUnit, VarType, Writer};

use super::printer::Lane;
use crate::capture::Change;
use crate::event::{Direction, Event, Field, Place, Value, Verdict};
use crate::time::Time;

/// An event comes after the edges it was made of; edges wait so long for it, in picoseconds.
const WINDOW: i64 = 2_000_000_000;

/// What a string variable shows between frames. The format has no empty string.
const NOTHING: &str = "-";

/// A VCD being written.
pub struct VcdOut {
    writer: Writer<Box<dyn Write>>,
    /// The capture's channels: the lines that say they are low and high.
    channels: Vec<[String; 2]>,
    /// The codes of each line that was found before the header was written.
    strings: Vec<Strings>,
    /// Levels that are to be written, in the order of time.
    levels: VecDeque<Change>,
    /// Strings that are to be written, by time and as they came.
    texts: BTreeMap<(Time, u64), (IdCode, String)>,
    sequence: u64,
    /// Time of the capture that is 0 in the file.
    origin: Option<Time>,
    written: Option<u64>,
}

#[derive(Clone)]
struct Strings {
    frame: IdCode,
    verdict: IdCode,
    names: &'static [&'static str],
    fields: Vec<IdCode>,
}

impl VcdOut {
    /// Writes to `out`, in many small pieces.
    pub fn new(out: impl Write + 'static) -> Self {
        Self {
            writer: Writer::new(Box::new(out)),
            channels: Vec::new(),
            strings: Vec::new(),
            levels: VecDeque::new(),
            texts: BTreeMap::new(),
            sequence: 0,
            origin: None,
            written: None,
        }
    }

    /// Writes the header. A line that is found later has no place in it.
    pub(super) fn channels(&mut self, channels: &[String], lanes: &[Lane]) -> io::Result<()> {
        let writer = &mut self.writer;
        writer.version("servowire")?;
        writer.timescale(1, TimescaleUnit::NS)?;
        writer.add_module("capture")?;
        for name in channels {
            let code = writer.add_wire(1, &word(name))?;
            self.channels.push([format!("0{code}\n"), format!("1{code}\n")]);
        }
        writer.upscope()?;
        for lane in lanes {
            writer.add_module(&format!("decoded_{}", word(&lane.channel)))?;
            let mut string = |name: &str| writer.add_var(VarType::String, 1, name, None);
            let (frame, verdict) = (string("frame")?, string("verdict")?);
            let names = lane.protocol.fields;
            let fields = names.iter().map(|name| string(name)).collect::<io::Result<Vec<_>>>()?;
            writer.upscope()?;
            self.strings.push(Strings { frame, verdict, names, fields });
        }
        writer.enddefinitions()
    }

    fn wait(&mut self, time: Time, code: IdCode, text: String) {
        self.texts.insert((time, self.sequence), (code, text));
        self.sequence += 1;
    }

    /// A level of the capture.
    pub(super) fn change(&mut self, change: &Change) -> io::Result<()> {
        if self.origin.is_none() {
            self.origin = Some(change.time.min(Time::ZERO));
            let strings = self.strings.clone();
            for code in strings.iter().flat_map(|s| [s.frame, s.verdict].into_iter().chain(s.fields.clone())) {
                self.wait(change.time, code, NOTHING.to_owned());
            }
        }
        self.levels.push_back(*change);
        self.flush_before(change.time - WINDOW)
    }

    /// A decoded frame of a line.
    pub(super) fn event(&mut self, speaks: usize, event: &Event) {
        let (Place::Time { start, end }, Some(strings)) = (event.place, self.strings.get(speaks)) else { return };
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
            self.wait(start, code, word(&text));
            self.wait(end, code, NOTHING.to_owned());
        }
    }

    fn flush_before(&mut self, time: Time) -> io::Result<()> {
        loop {
            let level = self.levels.front().map(|change| change.time).filter(|at| *at < time);
            let text = self.texts.first_key_value().map(|((at, _), _)| *at).filter(|at| *at < time);
            match (level, text) {
                (None, None) => return Ok(()),
                (Some(at), text) if text.is_none_or(|text| at <= text) => {
                    self.stamp(at)?;
                    let change = self.levels.pop_front();
                    let lines =
                        change.and_then(|change| Some((change, self.channels.get(usize::from(change.channel))?)));
                    if let Some((change, [low, high])) = lines {
                        self.writer.writer().write_all(if change.level { high } else { low }.as_bytes())?;
                    }
                }
                _ => {
                    if let Some(((at, _), (code, text))) = self.texts.pop_first() {
                        self.stamp(at)?;
                        self.writer.change_string(code, &text)?;
                    }
                }
            }
        }
    }

    /// Goes on to a time. An event older than the window is shown late rather than out of order.
    fn stamp(&mut self, time: Time) -> io::Result<()> {
        let nanoseconds = ((time.since(self.origin.unwrap_or_default()).ps().max(0) + 500) / 1000) as u64;
        if self.written.is_none_or(|written| written < nanoseconds) {
            self.written = Some(nanoseconds);
            let mut digits = itoa::Buffer::new();
            let out = self.writer.writer();
            out.write_all(b"#")?;
            out.write_all(digits.format(nanoseconds).as_bytes())?;
            out.write_all(b"\n")?;
        }
        Ok(())
    }

    /// Writes what is left.
    pub(super) fn finish(&mut self) -> io::Result<()> {
        self.flush_before(Time::MAX)?;
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
