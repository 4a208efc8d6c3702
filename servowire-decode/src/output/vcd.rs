//! A copy of the capture, with the decoded frames beside it as string variables (GTKWave, Surfer).

mod ring;

use std::collections::{BTreeMap, VecDeque};
use std::io::{self, Write};

use vcd::{IdCode, TimescaleUnit, VarType, Writer};

use super::printer::{Origin, Printer};
use crate::capture::Change;
use crate::event::{Direction, Event, Field, Place, Value, Verdict};
use crate::time::Time;
use ring::{Ring, Turn};

/// An event comes after the edges from which it was made; edges wait this long for it, in picoseconds.
const WINDOW: i64 = 2_000_000_000;

/// What a string variable shows between frames. The format has no empty string.
const NOTHING: &str = "-";

/// A VCD being written.
pub struct VcdOut {
    writer: Writer<Box<dyn Write>>,
    /// The channels of the capture: the VCD lines that say they are low and high.
    channels: Vec<[String; 2]>,
    /// The codes of each line that was found before the header was written.
    strings: Vec<Strings>,
    /// Levels that are to be written, in the order of time.
    levels: VecDeque<Change>,
    /// Strings that are to be written, by time and order of arrival.
    texts: BTreeMap<(Time, u64), (IdCode, String)>,
    sequence: u64,
    /// Time of the capture that is 0 in the file.
    origin: Option<Time>,
    written: Option<u64>,
    window: Option<(Time, Time)>,
    /// Set if only the parts near refused frames are written.
    ring: Option<Ring>,
    /// The levels of the channels before the window, or before the next part to be written.
    before: BTreeMap<u16, bool>,
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
            window: None,
            ring: None,
            before: BTreeMap::new(),
        }
    }

    /// Writes only the part between two times of the capture; the file keeps these times.
    #[must_use]
    pub fn within(self, from: Time, to: Time) -> Self {
        Self { window: Some((from, to)), ..self }
    }

    /// Writes only the parts around refused frames and missing answers, this many picoseconds before and after each.
    /// Between these parts the channels are unknown. No more than this span is held in memory, however long the capture is.
    #[must_use]
    pub fn around(self, picoseconds: i64) -> Self {
        Self { ring: Some(Ring::new(picoseconds.max(0))), ..self }
    }

    fn wait(&mut self, time: Time, code: IdCode, text: String) {
        self.texts.insert((time, self.sequence), (code, text));
        self.sequence += 1;
    }

    /// Writes the initial values: the levels of the channels at that time, and the string shown between frames.
    fn open(&mut self, time: Time) {
        if self.origin.is_some() {
            return;
        }
        self.origin = Some(time.min(Time::ZERO));
        if self.ring.is_some() {
            return;
        }
        for code in self.codes() {
            self.wait(time, code, NOTHING.to_owned());
        }
        let levels = std::mem::take(&mut self.before);
        self.levels.extend(levels.into_iter().map(|(channel, level)| Change { time, channel, level }));
    }

    /// Returns all string variables.
    fn codes(&self) -> Vec<IdCode> {
        let of = |s: &Strings| [s.frame, s.verdict].into_iter().chain(s.fields.clone()).collect::<Vec<_>>();
        self.strings.iter().flat_map(of).collect()
    }

    /// Begins and ends the pieces around faults up to a time; returns whether that time is within one.
    fn turn(&mut self, time: Time) -> io::Result<bool> {
        while let Some(turn) = self.ring.as_mut().and_then(|ring| ring.turn(time)) {
            let (at, begins) = match turn {
                Turn::Begins(at) => (at, true),
                Turn::Ends(at) => (at, false),
            };
            self.stamp(at)?;
            for (channel, [low, high]) in (0_u16..).zip(&self.channels) {
                let level = self.before.get(&channel).filter(|_| begins);
                // The line that says that it is unknown differs in its first letter only.
                let line = match level {
                    Some(true) => high.clone(),
                    Some(false) => low.clone(),
                    None => low.replacen('0', "x", 1),
                };
                self.writer.writer().write_all(line.as_bytes())?;
            }
            for code in self.codes() {
                self.writer.change_string(code, NOTHING)?;
            }
        }
        Ok(self.ring.as_ref().is_none_or(Ring::is_inside))
    }

    fn flush_before(&mut self, time: Time) -> io::Result<()> {
        loop {
            let level = self.levels.front().map(|change| change.time).filter(|at| *at < time);
            let text = self.texts.first_key_value().map(|((at, _), _)| *at).filter(|at| *at < time);
            match (level, text) {
                (None, None) => return Ok(()),
                (Some(at), text) if text.is_none_or(|text| at <= text) => {
                    let is_written = self.turn(at)?;
                    let change = self.levels.pop_front();
                    if self.ring.is_some() {
                        self.before.extend(change.map(|change| (change.channel, change.level)));
                    }
                    if !is_written {
                        continue;
                    }
                    self.stamp(at)?;
                    let lines =
                        change.and_then(|change| Some((change, self.channels.get(usize::from(change.channel))?)));
                    if let Some((change, [low, high])) = lines {
                        self.writer.writer().write_all(if change.level { high } else { low }.as_bytes())?;
                    }
                }
                _ => {
                    if let Some(((at, _), (code, text))) = self.texts.pop_first() {
                        if self.turn(at)? {
                            self.stamp(at)?;
                            self.writer.change_string(code, &text)?;
                        }
                    }
                }
            }
        }
    }

    /// Advances the output to a time. An event older than the window is shown late rather than out of order.
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
}

impl Printer for VcdOut {
    /// Writes the header. A line found later has no place in it.
    fn channels(&mut self, origin: &Origin, channels: &[String]) -> io::Result<()> {
        let writer = &mut self.writer;
        writer.version("servowire")?;
        writer.timescale(1, TimescaleUnit::NS)?;
        writer.add_module("capture")?;
        for name in channels {
            let code = writer.add_wire(1, &word(name))?;
            self.channels.push([format!("0{code}\n"), format!("1{code}\n")]);
        }
        writer.upscope()?;
        for lane in &origin.lanes {
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

    fn wants_changes(&self) -> bool {
        true
    }

    fn change(&mut self, change: &Change) -> io::Result<()> {
        match self.window {
            Some((from, _)) if change.time < from => {
                self.before.insert(change.channel, change.level);
                return Ok(());
            }
            Some((_, to)) if change.time >= to => return Ok(()),
            Some((from, _)) => self.open(from),
            None => self.open(change.time),
        }
        self.levels.push_back(*change);
        let around = self.ring.as_ref().map_or(0, Ring::around);
        self.flush_before(change.time - WINDOW - around)
    }

    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        let (Place::Time { start, end }, Some(strings)) = (event.place, self.strings.get(origin.speaks)) else {
            return Ok(());
        };
        if let Some(ring) = self.ring.as_mut().filter(|_| !event.verdict.is_ok()) {
            ring.fault(start, end);
        }
        let (from, to) = self.window.unwrap_or((start, end));
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
            self.wait(start.max(from), code, word(&text));
            self.wait(end.min(to), code, NOTHING.to_owned());
        }
        Ok(())
    }

    /// Writes the rest.
    fn end(&mut self, _: &Origin) -> io::Result<()> {
        if let Some((from, _)) = self.window {
            self.open(from);
        }
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

/// Converts a string as the format requires: one word of printable ASCII.
fn word(text: &str) -> String {
    let printable = |c: char| if c.is_ascii_graphic() { c } else { '_' };
    if text.is_empty() { NOTHING.to_owned() } else { text.chars().map(printable).collect() }
}
