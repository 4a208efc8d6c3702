//! Panasonic RTEX: logs of data blocks, command and response.
//!
//! The first block of a drive is shown whole (flags that are 0 and numbers that are 0 left out), of each later one what
//! changed since the block of the same drive and direction before it. The counter is only mentioned where it does
//! not stand still or go on by one.

use std::collections::HashMap;
use std::io;

use rtex_block::inspect::{self, Cause, LogAnalysis, LogShape, Report, Trouble, inspect};
use rtex_block::{Error, Header};

use crate::capture::hexlog::Burst;
use crate::codec::{Codec, Facts, LogDecoder};
use crate::event::{Direction, Event, Field, Place, Position, Refusal, Span, Value, Verdict};
use crate::settings::{self, Settings};
use crate::sink::Sink;
use crate::time::Time;

/// RTEX in the table.
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

/// Bytes by which size and byte order are recognised.
const SAMPLE: usize = 1 << 14;
/// Lines or records that are held back where the beginning says nothing of the shape: seconds of NOPs after power-up.
const MOST_HELD: usize = 1 << 16;

/// Lines or records behind the NOPs that are enough to tell the shape.
const TELLING: usize = 16;

/// Follows the blocks of a log.
struct Decoder {
    settings: settings::Rtex,
    block_size: usize,
    shape: Option<LogShape>,
    /// What was read before the shape was known.
    held: Vec<Burst>,
    /// Blocks are decoded, in whichever shape.
    began: bool,
    /// Each line holds half a block of 32 bytes; the main half, while the other is still to come.
    halves: bool,
    half: Option<Vec<u8>>,
    analysis: LogAnalysis,
    /// The last block of a direction and a MAC-ID: byte 0 without the counter.
    last: HashMap<u8, Report>,
    /// Of the same: the last counter, and the update periods so far.
    updates: HashMap<u8, (u8, i64)>,
    /// Where the last block was.
    place: Place,
}

impl Decoder {
    /// `sample`: the beginning of the log.
    fn new(settings: settings::Rtex, sample: &[Burst]) -> Self {
        let mut decoder = Self {
            settings,
            block_size: 0,
            shape: None,
            held: Vec::new(),
            began: false,
            halves: false,
            half: None,
            analysis: LogAnalysis::new(settings.period_ns, settings.gear),
            last: HashMap::new(),
            updates: HashMap::new(),
            place: Place::Line(0),
        };
        decoder.look_at(sample);
        decoder
    }

    /// Finds the shape in this piece of the log.
    fn look_at(&mut self, sample: &[Burst]) {
        let read = || sample.iter().filter(|burst| burst.spoilt.is_none()).map(|burst| &burst.bytes);
        // What a line has held that is spoilt, or too short or long, does not matter, but its place does.
        let line = vec![0; most_common(read().map(Vec::len))];
        let is_whole = |burst: &Burst| burst.spoilt.is_none() && burst.bytes.len() == line.len();
        let lines = sample.iter().map(|burst| if is_whole(burst) { &burst.bytes } else { &line });
        let bytes: Vec<u8> = lines.flatten().copied().collect();
        // NOPs from before the start tell nothing: so the end of what is there, which has more than them.
        let known = bytes.chunks(SAMPLE).find_map(LogShape::guess);
        let from_last = bytes.len().saturating_sub(SAMPLE) / 32 * 32;
        self.shape = known.or_else(|| LogShape::guess(bytes.get(from_last..).unwrap_or_default()));
        // Lines or records of one block are what they are; a size is guessed where the lines allow both.
        let guessed = self.shape.map_or(rtex_block::LEN, |shape| shape.size.bytes());
        self.block_size = self.settings.block_size.unwrap_or(guessed);
        self.halves =
            self.block_size == rtex_block::LEN32 && !line.is_empty() && read().all(|it| it.len() == rtex_block::LEN);
    }

    /// Decodes what was held back.
    fn let_go(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let held = std::mem::take(&mut self.held);
        self.began = true;
        self.look_at(&held);
        if let Some(note) = self.note() {
            out.event(&Event::remark(Place::Line(1), "log", note))?;
        }
        held.iter().try_for_each(|burst| self.decode(burst, out))
    }

    /// A line or record, now that the shape is known as well as it can be.
    fn decode(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        if self.halves {
            return self.half(burst, out);
        }
        for block in burst.bytes.chunks(self.block_size.max(1)) {
            if let Some(event) = self.block(burst, block) {
                out.event(&event)?;
            }
        }
        Ok(())
    }

    /// Half of a block.
    fn half(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        let Some(mut block) = self.half.take() else {
            self.half = Some(burst.bytes.clone());
            return Ok(());
        };
        if block.is_empty() {
            return Ok(());
        }
        block.extend_from_slice(&burst.bytes);
        let event = self.block(burst, &block);
        event.map_or(Ok(()), |event| out.event(&event))
    }

    /// Where a block is: in update periods, if the period is known, else in the log.
    fn place(&mut self, burst: &Burst, header: Header) -> Place {
        let counter = header.update_counter.get();
        let (last, updates) = self.updates.entry(header.emit() & 0x9f).or_insert((counter, 0));
        *updates += i64::from(counter.wrapping_sub(*last) & 3);
        *last = counter;
        match self.settings.period_ns {
            Some(period_ns) => {
                let start = Time::from_ps(i128::from(*updates) * i128::from(period_ns) * 1_000);
                Place::Time { start, end: start }
            }
            None => Place::Line(burst.line),
        }
    }

    fn block(&mut self, burst: &Burst, block: &[u8]) -> Option<Event> {
        let header = Header::parse(block.first().copied()?);
        if self.settings.mac_id.is_some_and(|only| only != header.mac_id.get()) {
            return None;
        }
        let report = inspect(block);
        let place = self.place(burst, header);
        self.place = place;
        let mut fields = Vec::new();
        if is_block(&report) {
            let findings: Vec<String> = self.analysis.block(block).map(|finding| finding.to_string()).collect();
            let before = self.last.insert(header.emit() & 0x9f, report);
            match before {
                Some(before) => changed(&report, &before, &mut fields),
                None => whole(&report, block, &mut fields),
            }
            notes(&report, findings, &mut fields);
        } else {
            fields.push(Field::digits("bytes", block.iter().copied(), 2));
        }
        let (direction, word) = if header.response { (Direction::Answer, "rsp") } else { (Direction::Request, "cmd") };
        let kind = format!("{word} {}", header.mac_id);
        let position = self.position(&report);
        let event = Event::new(place, Some(direction), kind, fields, verdict(&report)).locate(|name| {
            let flags = matches!(name, "Status_Flags" | "Control_Bits").then_some((2, 3));
            let known = || report.fields().find(|field| field.name == name).map(|field| (field.first, field.last));
            let (first, last) = flags.or_else(known)?;
            Some(Span::even(place, 8 * block.len() as u32, 8 * u32::from(first), 8 * u32::from(last) + 7))
        });
        Some(Event { position, address: Some(header.mac_id.get().into()), ..event })
    }

    /// The actual position, where only one drive is looked at: the figures are made for one axis.
    fn position(&self, report: &Report) -> Option<Position> {
        self.settings.mac_id?;
        let field = report.fields().find(|field| field.name == "Response_Data1")?;
        match field.value {
            inspect::Value::Number(counts) if is_block(report) => {
                Some(Position { name: field.name, counts, span: Some(1 << 32), per_turn: None })
            }
            _ => None,
        }
    }
}

impl LogDecoder for Decoder {
    /// What there is to say about the log as a whole, before its blocks.
    fn note(&self) -> Option<String> {
        let LogShape { size, word, skip } = self.shape?;
        let size = size.bytes();
        let order = match word {
            1 => "",
            2 => ", with the bytes of each 16-bit word exchanged",
            _ => ", with the bytes of each 32-bit word in the other order",
        };
        if skip > 0 {
            return Some(format!(
                "the log looks like blocks of {size} bytes{order}, the first of which begins at byte {skip}"
            ));
        }
        if word == 1 && size == self.block_size && (size == rtex_block::LEN || self.settings.block_size.is_some()) {
            return None;
        }
        let taken = if size == self.block_size { "" } else { "; try --block-size" };
        Some(format!("the log looks like blocks of {size} bytes{order}{taken}"))
    }

    /// Why the log as a whole was not read as it was written, or what somebody has to look after.
    fn fault(&self) -> Option<&'static str> {
        match self.shape {
            Some(LogShape { skip: 1.., .. }) => {
                Some("the log begins in the middle of a block: no block is read as it was written")
            }
            Some(LogShape { word: 2, .. }) => {
                Some("the bytes of each 16-bit word are exchanged in most of its blocks: pack with shifts")
            }
            Some(LogShape { word: 4, .. }) => {
                Some("the bytes of each 32-bit word are in the other order in most of its blocks: pack with shifts")
            }
            _ => self.analysis.trouble().map(Trouble::name),
        }
    }

    /// A line or record of the log. NOPs from before the start are held back until something tells the shape.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        if self.shape.is_some() || self.settings.block_size.is_some() || self.began {
            return self.decode(burst, out);
        }
        self.held.push(burst.clone());
        let nops = |burst: &Burst| burst.bytes.chunks(rtex_block::LEN).all(is_empty);
        let told = self.held.iter().rev().take_while(|burst| !nops(burst)).count();
        // Nothing but NOPs, or too few blocks behind them to tell by.
        let waits = self.held.len() > told && told < TELLING && self.held.len() < MOST_HELD;
        if waits { Ok(()) } else { self.let_go(out) }
    }

    /// A line that is not bytes: of a block in two lines the other half is lost with it.
    fn spoilt(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        if !self.held.is_empty() {
            self.let_go(out)?;
        }
        self.half = match self.half.take() {
            Some(_) => None,
            None => self.halves.then(Vec::new),
        };
        Ok(())
    }

    /// The end of the log: drives that were on one side of it only, and what goes on there.
    fn end(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        if !self.held.is_empty() {
            self.let_go(out)?;
        }
        let mut notes: Vec<String> = self.analysis.end().map(|finding| finding.to_string()).collect();
        if self.half.as_ref().is_some_and(|half| !half.is_empty()) {
            notes.push("the log ends in the middle of a block".to_owned());
        }
        if notes.is_empty() {
            return Ok(());
        }
        out.event(&Event::remark(self.place, "log", notes.join("; ")))
    }
}

/// A NOP from before the start, in any order of its bytes: there is nothing but an address, or Sub_Chk.
fn is_empty(block: &[u8]) -> bool {
    matches!(block, [_, code, control, ..] if code & 0x7f == 0 && *control == 0)
}

/// The length that most lines have; of several the longest.
fn most_common(lengths: impl Iterator<Item = usize>) -> usize {
    let mut counts = HashMap::new();
    lengths.for_each(|len| *counts.entry(len).or_insert(0_usize) += 1);
    counts.into_iter().max_by_key(|(len, count)| (*count, *len)).map_or(0, |(len, _)| len)
}

/// The code, then all that is not 0.
fn whole(report: &Report, block: &[u8], fields: &mut Vec<Field>) {
    let (flags, others): (Vec<_>, Vec<_>) = report.fields().partition(is_flag);
    let shown = |field: &inspect::Field| {
        !matches!(field.value, inspect::Value::Bit(false) | inspect::Value::Number(0) | inspect::Value::Hex(0))
            && field.first != 0
    };
    let (codes, data): (Vec<_>, Vec<_>) = others.into_iter().filter(shown).partition(|field| field.first == 1);
    fields.extend(codes.iter().map(field));
    let name = if report.is_response() == Some(true) { "Status_Flags" } else { "Control_Bits" };
    fields.push(flag_field(&flags, block, name));
    fields.extend(data.iter().map(field));
}

/// The code, and what changed.
fn changed(report: &Report, before: &Report, fields: &mut Vec<Field>) {
    let code = report.fields().find(|field| matches!(field.value, inspect::Value::Code(_)));
    fields.extend(code.as_ref().map(field));
    for inspect::Change { field: new, before: old } in report.changes(before) {
        if matches!(new.value, inspect::Value::Code(_)) {
            continue;
        }
        match (new.value, old) {
            (inspect::Value::Number(counter), Some(inspect::Value::Number(last))) if new.first == 0 => {
                if counter != (last + 1) % 4 {
                    fields.push(Field::text(new.name, format_args!("{last} -> {counter}: not the next")));
                }
            }
            _ => fields.push(field(&new)),
        }
    }
}

fn notes(report: &Report, findings: Vec<String>, fields: &mut Vec<Field>) {
    let said = report.notes().map(|note| note.to_string());
    let strict = report.errors().map(|error| error.to_string());
    let cause = report.cause().map(|cause| cause.to_string());
    let text = findings.into_iter().chain(said).chain(strict).chain(cause).collect::<Vec<_>>().join("; ");
    if !text.is_empty() {
        fields.push(Field::text("note", text));
    }
}

fn is_flag(field: &inspect::Field) -> bool {
    matches!(field.first, 2 | 3)
}

/// Bytes 2-3 as one field.
fn flag_field(flags: &[inspect::Field], block: &[u8], name: &'static str) -> Field {
    let raw = block.get(2..4).map_or(0, |bytes| bytes.iter().rev().fold(0, |raw, &byte| raw << 8 | u64::from(byte)));
    let set = flags.iter().filter(|f| f.value == inspect::Value::Bit(true)).map(|f| f.name).collect();
    Field::new(name, Value::Flags { raw, digits: 4, set })
}

fn field(field: &inspect::Field) -> Field {
    match field.value {
        inspect::Value::Number(value) => Field::number(field.name, value),
        inspect::Value::Bit(bit) => Field::number(field.name, bit),
        inspect::Value::Hex(value) => Field::hex(field.name, value, if value > 0xff { 4 } else { 2 }),
        other => Field::text(field.name, other),
    }
}

/// Whether it is a block at all. A bus without a device is no drive, although its ones look like a response with an undefined
/// code.
fn is_block(report: &Report) -> bool {
    report.is_usable() && report.cause() != Some(Cause::AllOnes)
}

/// A block that a drive takes is good; what strict decoding says of it is a note.
fn verdict(report: &Report) -> Verdict {
    let Some(error) = report.error().filter(|_| !is_block(report)) else { return Verdict::Ok };
    let at = match error {
        Error::Direction { .. } | Error::MacId { .. } => Some(0),
        Error::CyclicCode { .. } | Error::NonCyclicCode { .. } => Some(1),
        Error::SubChk { .. } | Error::SubCommandCode { .. } => Some(16),
        _ => None,
    };
    let field = at.map(|byte: u8| format!("byte {byte}"));
    let cause = report.cause().map(|cause| cause.to_string());
    Refusal { field, cause, ..Refusal::new(error.class().name(), error) }.into()
}
