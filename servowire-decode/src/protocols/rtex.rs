//! Panasonic RTEX: logs of data blocks, command and response.
//!
//! The first block of a drive is shown whole, except flags and numbers that are 0; of each later block only what changed
//! since the previous block of the same drive and direction. The counter is mentioned only if it neither stays the
//! same nor advances by one.

mod blocks;
mod describe;
mod seen;
#[cfg(test)]
mod tests;

use std::collections::HashMap;
use std::io;

use rtex_block::inspect::{self, Cause, DriveTrouble, LogAnalysis, LogFinding, LogShape, Report, Trouble, inspect};
use rtex_block::{Error, Header};

use crate::capture::hexlog::Burst;
use crate::codec::{Codec, Facts, Found, LogDecoder};
use crate::event::{Direction, Event, Field, Place, Position, Refusal, Span, Verdict};
use crate::settings::{self, Settings};
use crate::sink::Sink;
use crate::time::Time;
use blocks::{Blocks, Check, Piece};
use seen::Seen;

/// The table row of RTEX.
pub(super) struct Rtex;

impl Codec for Rtex {
    fn facts(&self) -> &'static Facts {
        const {
            &Facts {
                name: "rtex",
                title: "RTEX",
                about: "Panasonic RTEX data blocks, from logs of bytes",
                needs: "RTEX blocks are read from logs of bytes: hex digits with --bytes, binary with --record-size",
                // A block has no check sum, and a log no levels for a VCD of fields.
                checked: false,
                ..Facts::NONE
            }
        }
    }

    fn log(&self, settings: &Settings, sample: &[Burst]) -> Option<Box<dyn LogDecoder>> {
        Some(Box::new(Decoder::new(settings.rtex, sample)))
    }
}

/// Maximum number of lines or records that are held back if the beginning says nothing about the shape, such as seconds of
/// NOPs after power-up.
const MOST_HELD: usize = 1 << 16;

/// Numbers of lines or records after the NOPs at which the shape is looked for, and the number that is enough to be told that it
/// has none.
const TELLING: [usize; 3] = [16, 64, 256];
const ENOUGH: usize = 1024;

/// Flags of a response that change with every motion and are therefore not events.
const MOTION: [&str; 3] = ["IN_POSITION", "IN_PROGRESS", "TORQUE_LIMITED"];

/// Follows the blocks of a log.
struct Decoder {
    settings: settings::Rtex,
    blocks: Blocks,
    /// The data read before the shape was known.
    held: Vec<Burst>,
    /// Whether blocks are being decoded in some shape.
    began: bool,
    /// Why the log is not as written.
    misread: Option<String>,
    analysis: LogAnalysis,
    /// The log goes on in another shape, so blocks were misread until then.
    goes_on: bool,
    /// The drives, and which of them are in misread blocks only.
    seen: Seen,
    /// The last block of a direction and a MAC-ID: byte 0 without the counter.
    last: HashMap<u8, Report>,
    /// For the same key, the last counter and the number of update periods so far.
    updates: HashMap<u8, (u8, i64)>,
    /// Place of the last block.
    place: Place,
}

impl Decoder {
    /// `sample`: the beginning of the log.
    fn new(settings: settings::Rtex, sample: &[Burst]) -> Self {
        let mut decoder = Self {
            settings,
            blocks: Blocks::new(settings.block_size),
            held: Vec::new(),
            began: false,
            misread: None,
            analysis: LogAnalysis::new(settings.period_ns, settings.gear),
            goes_on: false,
            seen: Seen::default(),
            last: HashMap::new(),
            updates: HashMap::new(),
            place: Place::Line(0),
        };
        decoder.look_at(sample);
        decoder
    }

    /// Finds the shape in this piece of the log.
    fn look_at(&mut self, sample: &[Burst]) {
        self.blocks.look_at(sample);
        self.misread = match self.blocks.doubt() {
            Some((a, b)) => Some(format!("{}; none of it is shown", either(a, b))),
            None => self.blocks.shape().0.and_then(misread),
        };
    }

    /// Decodes the data held back.
    fn let_go(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let held = std::mem::take(&mut self.held);
        self.began = true;
        self.look_at(&held);
        if let Some(note) = self.note() {
            out.event(&remark(Place::Line(1), note))?;
        }
        held.iter().try_for_each(|burst| self.decode(burst, out))
    }

    /// Takes a line or record, now that the shape is known as well as possible.
    fn decode(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(line) = self.blocks.feed(burst) {
            out.event(&self.stray(&line))?;
        }
        while let Some(piece) = self.blocks.next(burst) {
            self.piece(&piece, out)?;
        }
        Ok(())
    }

    /// Describes a line of another length than the others, in a log whose blocks do not begin with its lines.
    fn stray(&self, line: &Piece) -> Event {
        let (len, usual) = (line.bytes.len(), self.blocks.line());
        let class = if len < usual { "truncated" } else { "too_long" };
        let reason = format!("{len} bytes among lines of {usual}: it is not known where a block begins in them");
        Self::unread(line, "line", (class, reason))
    }

    /// Describes bytes of which nothing can be told: neither drive nor direction.
    fn unread(piece: &Piece, kind: &'static str, (class, reason): (&'static str, String)) -> Event {
        let place = piece.time.map_or(Place::Line(piece.line), |time| Place::Time { start: time, end: time });
        let bytes = Field::digits("bytes", piece.bytes.iter().copied(), 2);
        Event::new(place, None, kind, vec![bytes], Refusal::new(class, reason).into())
    }

    /// Decodes a block, or whatever is in its place.
    fn piece(&mut self, piece: &Piece, out: &mut dyn Sink) -> io::Result<()> {
        let block = self.blocks.in_order(&piece.bytes);
        let report = inspect(&block);
        if let Some(event) = self.block(piece, &block, &report) {
            out.event(&event)?;
        }
        // A NOP is mostly zeros, whatever their order.
        let is_sound = report.error().is_none() && block.get(1).is_some_and(|code| code & 0x7f != 0);
        match self.blocks.goes_on(&piece.bytes, is_sound) {
            Check::Nothing => Ok(()),
            Check::Holds => {
                self.seen.holds();
                Ok(())
            }
            Check::Changes(shape) => {
                let note = format!("from here on the log looks like {}", said(shape));
                self.changes(format!("{note} (line {})", piece.line));
                out.event(&remark(self.place, note))
            }
        }
    }

    /// Takes note that the last blocks were misread.
    fn changes(&mut self, why: String) {
        self.goes_on = true;
        self.seen.changes();
        self.misread.get_or_insert(why);
    }

    /// Says which drives are in misread blocks only, and forgets them.
    fn say_phantoms(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        for drive in self.seen.phantoms() {
            let note = format!("drive {drive} is only in blocks that were misread, and is not trusted");
            let address = Some(drive.get().into());
            out.event(&Event { address, misread: true, ..remark(self.place, note) })?;
            let alarmed = DriveTrouble { mac_id: drive, trouble: Trouble::Alarm };
            if self.analysis.troubles().any(|trouble| trouble == alarmed) {
                // It may have been a real one after all.
                let misread = self.misread.take().unwrap_or_default();
                self.misread = Some(format!("{misread}; drive {drive}, if there is one, reported an alarm"));
            }
            self.analysis.forget(drive);
        }
        Ok(())
    }

    /// Returns where a block is: at its time, if the log has times; in update periods, if the period is known; otherwise by
    /// its line in the log. Also returns whether that time is counted.
    fn place(&mut self, piece: &Piece, header: Header) -> (Place, bool) {
        let counter = header.update_counter.get();
        let (last, updates) = self.updates.entry(header.emit() & 0x9f).or_insert((counter, 0));
        *updates += i64::from(counter.wrapping_sub(*last) & 3);
        *last = counter;
        let counted = |period_ns| Time::from_ps(i128::from(*updates) * i128::from(period_ns) * 1_000);
        match (piece.time, self.settings.period_ns.map(counted)) {
            (Some(time), _) => (Place::Time { start: time, end: time }, false),
            (None, Some(time)) => (Place::Time { start: time, end: time }, true),
            (None, None) => (Place::Line(piece.line), false),
        }
    }

    fn block(&mut self, piece: &Piece, block: &[u8], report: &Report) -> Option<Event> {
        if let Some((a, b)) = self.blocks.doubt() {
            let event = Self::unread(piece, "block", ("shape", either(a, b)));
            self.place = event.place;
            return Some(event);
        }
        let header = Header::parse(block.first().copied()?);
        if self.settings.mac_id.is_some_and(|only| only != header.mac_id.get()) {
            return None;
        }
        let (place, counted) = self.place(piece, header);
        self.place = place;
        self.seen.see(header.mac_id);
        let (mut fields, mut happened) = (Vec::new(), Vec::new());
        if is_block(report) {
            let findings: Vec<LogFinding> = self.analysis.block(block).collect();
            let before = self.last.insert(header.emit() & 0x9f, *report);
            match &before {
                Some(before) if !self.settings.whole => describe::changed(report, before, &mut fields),
                _ => describe::whole(report, block, self.settings.whole, &mut fields),
            }
            let said: Vec<String> = findings.iter().map(LogFinding::to_string).collect();
            happened = events(report, before.as_ref());
            happened.extend(said.iter().cloned());
            describe::notes(report, said, &mut fields);
        } else {
            fields.push(Field::digits("bytes", block.iter().copied(), 2));
        }
        let (direction, word) = if header.response { (Direction::Answer, "rsp") } else { (Direction::Request, "cmd") };
        let kind = format!("{word} {}", header.mac_id);
        let verdict = match piece.direction.filter(|told| *told != direction) {
            Some(_) => turned_round(header.response),
            None => verdict(report),
        };
        if let Verdict::Refused(refusal) = &verdict {
            happened.push(format!("refused: {}", refusal.reason));
        }
        let event = Event::new(place, Some(direction), kind, fields, verdict).locate(|name| {
            let flags = matches!(name, "Status_Flags" | "Control_Bits").then_some((2, 3));
            let known = || report.fields().find(|field| field.name == name).map(|field| (field.first, field.last));
            let (first, last) = flags.or_else(known)?;
            // All bits of a block are at one instant.
            Some(Span { first: 8 * u32::from(first), last: 8 * u32::from(last) + 7, place })
        });
        let address = Some(header.mac_id.get().into());
        Some(Event { position: position(report), address, happened, counted, ..event })
    }
}

/// Creates a remark about the log, which is also one of its events.
fn remark(place: Place, what: String) -> Event {
    Event { happened: vec![what.clone()], ..Event::remark(place, "log", what) }
}

/// Returns the actual position.
fn position(report: &Report) -> Option<Position> {
    let field = report.fields().find(|field| field.name == "Response_Data1")?;
    match field.value {
        inspect::Value::Number(counts) if is_block(report) => {
            Some(Position { name: field.name, counts, span: Some(1 << 32), per_turn: None })
        }
        _ => None,
    }
}

/// Returns what belongs in a list of events: changed flags, except those of every motion; a change of the cyclic mode; an
/// alarm that was requested.
fn events(report: &Report, before: Option<&Report>) -> Vec<String> {
    let is_event = |field: &inspect::Field| match field.value {
        inspect::Value::Bit(_) => matches!(field.first, 2 | 3) && !MOTION.contains(&field.name),
        inspect::Value::Code(_) => field.name == "Command_Code",
        inspect::Value::AlarmData(_) | inspect::Value::Error(_) => true,
        _ => false,
    };
    let said = |field: inspect::Field| format!("{} {}", field.name, field.value);
    match before {
        Some(before) => report.changes(before).map(|change| change.field).filter(is_event).map(said).collect(),
        // At the beginning, what is there.
        None => report.fields().filter(|it| is_event(it) && it.value != inspect::Value::Bit(false)).map(said).collect(),
    }
}

/// Describes the shape in words.
fn said(LogShape { size, word, skip }: LogShape) -> String {
    let size = size.bytes();
    let order = match word {
        1 => "",
        2 => ", with the bytes of each 16-bit word exchanged",
        _ => ", with the bytes of each 32-bit word in the other order",
    };
    let from = if skip > 0 { format!(", the first of which begins at byte {skip}") } else { String::new() };
    format!("blocks of {size} bytes{order}{from}")
}

/// Says that either of two shapes may be the right one.
fn either(a: LogShape, b: LogShape) -> String {
    format!("the log is either {} or {}, and nothing in it tells which", said(a), said(b))
}

/// Says why a log of this shape is not what was intended.
fn misread(shape: LogShape) -> Option<String> {
    let what = match shape {
        LogShape { skip: 1.., .. } => {
            return Some(format!(
                "the log begins in the middle of a block: its first {} bytes are left out",
                shape.skip
            ));
        }
        LogShape { word: 2, .. } => {
            "the bytes of each 16-bit word are exchanged in most of its blocks: pack with shifts"
        }
        LogShape { word: 4, .. } => {
            "the bytes of each 32-bit word are in the other order in most of its blocks: pack with shifts"
        }
        _ => return None,
    };
    Some(what.to_owned())
}

impl LogDecoder for Decoder {
    /// Returns remarks about the log as a whole, before its blocks.
    fn note(&self) -> Option<String> {
        let (Some(shape), taken) = self.blocks.shape() else { return None };
        if let Some((a, b)) = self.blocks.doubt() {
            return Some(either(a, b));
        }
        let size = shape.size.bytes();
        let plain = LogShape { word: 1, skip: 0, ..shape } == shape;
        if plain && size == taken && (size == rtex_block::LEN || self.settings.block_size.is_some()) {
            return None;
        }
        let other = if size == taken { "" } else { "; try --block-size" };
        Some(format!("the log looks like {}{other}", said(shape)))
    }

    /// Returns what is wrong with the log as a whole, and what needs attention.
    fn found(&self) -> Found {
        let said = |it: DriveTrouble| format!("drive {} {}", it.mac_id, it.trouble.name());
        let troubles: Vec<String> = self.analysis.troubles().map(said).collect();
        let trouble = (!troubles.is_empty()).then(|| troubles.join("; "));
        match (&self.misread, trouble) {
            // What was misread may have been taken for drives that do not answer: it is said, and proves nothing.
            (Some(misread), Some(trouble)) if self.goes_on => {
                Found { misread: Some(format!("{misread}; {trouble}")), trouble: None }
            }
            (misread, trouble) => Found { misread: misread.clone(), trouble },
        }
    }

    /// Takes a line or record of the log. NOPs from before the start are held back until something determines the shape.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        if self.blocks.shape().0.is_some() || self.settings.block_size.is_some() || self.began {
            return self.decode(burst, out);
        }
        self.held.push(burst.clone());
        let nops = |burst: &Burst| burst.bytes.chunks(rtex_block::LEN).all(is_empty);
        let first = self.held.iter().rposition(nops).map_or(0, |last| last + 1);
        let told = self.held.get(first..).unwrap_or_default();
        // Nothing but NOPs, or too few blocks after them to tell by.
        let tells = TELLING.contains(&told.len()) && Blocks::tells(told);
        let waits = !tells && told.len() < ENOUGH && self.held.len() < MOST_HELD;
        if waits { Ok(()) } else { self.let_go(out) }
    }

    /// Takes a line that is not bytes; its part of a block is lost.
    fn spoilt(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        if !self.held.is_empty() {
            self.let_go(out)?;
        }
        self.blocks.lose();
        Ok(())
    }

    /// Ends the log: reports drives that appear in only one direction, and what remains open.
    fn end(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        if !self.held.is_empty() {
            self.let_go(out)?;
        }
        if let Some((count, shape)) = self.blocks.last() {
            let note = format!("the last {count} blocks of the log look like {}", said(shape));
            self.changes(note.clone());
            out.event(&remark(self.place, note))?;
        }
        self.say_phantoms(out)?;
        for finding in self.analysis.end() {
            let address = match finding {
                LogFinding::NeverAnswered(drive) | LogFinding::NeverAsked(drive) | LogFinding::AtEnd(drive, _) => {
                    Some(drive.get().into())
                }
                _ => None,
            };
            out.event(&Event { address, ..remark(self.place, finding.to_string()) })?;
        }
        if self.blocks.is_open() {
            out.event(&remark(self.place, "the log ends in the middle of a block".to_owned()))?;
        }
        Ok(())
    }
}

/// Returns whether a block is a NOP from before the start, in any byte order: it holds only an address, or Sub_Chk.
fn is_empty(block: &[u8]) -> bool {
    let nothing_else = || block.iter().filter(|byte| **byte != 0).count() <= 1;
    matches!(block, [_, code, control, ..] if code & 0x7f == 0 && *control == 0) || nothing_else()
}

/// Returns whether the log says that the other end sent it.
fn turned_round(response: bool) -> Verdict {
    let (told, is) = if response { ("command", "response") } else { ("response", "command") };
    Refusal {
        field: Some("byte 0".to_owned()),
        ..Refusal::new("direction", format!("the log has a {told}, C/R says {is}"))
    }
    .into()
}

/// Returns whether it is a block at all. A bus without a device is not a drive, although its ones look like a response with an
/// undefined code.
fn is_block(report: &Report) -> bool {
    report.is_usable() && report.cause() != Some(Cause::AllOnes)
}

/// A block that a drive accepts is good; anything that strict decoding reports is a note.
fn verdict(report: &Report) -> Verdict {
    let Some(error) = report.error().filter(|_| !is_block(report)) else { return Verdict::Ok };
    let at = match error {
        Error::CyclicCode { .. } | Error::NonCyclicCode { .. } => Some(1),
        Error::SubChk { .. } | Error::SubCommandCode { .. } => Some(16),
        _ => None,
    };
    let field = at.map(|byte: u8| format!("byte {byte}"));
    let cause = report.cause().map(|cause| cause.to_string());
    Refusal { field, cause, ..Refusal::new(error.class().name(), error) }.into()
}
