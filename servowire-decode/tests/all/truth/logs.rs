//! RTEX logs under many conditions: how they are written, and what goes wrong in them.

use std::fmt::Write as _;
use std::io::Cursor;

use servowire_decode::capture::{self, Hints, Input};
use servowire_decode::event::{Event, Value};
use servowire_decode::settings::{Rtex, Settings};

use super::ring::{Block, Ring, build};
use super::rng::Rng;
use super::{Outcome, Said, Shown, hold, hold_these, judge, read, start};
use crate::protocol;

/// How a log is written down.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// A line a block, nothing else.
    Lines,
    /// With time and direction.
    Monitor,
    /// A table with times, directions and drives.
    Table,
    /// Binary records of a block each.
    Records,
}

/// What happens to a log, and how it is read.
#[derive(Debug, Clone, Copy)]
struct Log {
    form: Form,
    /// Bytes of each word exchanged; 1: as they are.
    word: usize,
    /// Update periods of which blocks are missing, and blocks that are cut short, as shares.
    missing: f64,
    cut: f64,
    /// Every block shown whole.
    whole: bool,
    /// Times by the update counter.
    counted: bool,
}

const PLAIN: Log = Log { form: Form::Monitor, word: 1, missing: 0.0, cut: 0.0, whole: true, counted: false };

type Condition = fn(&mut Rng) -> (Ring, Log);

fn ring(rng: &mut Rng) -> Ring {
    Ring { drives: 1 + rng.below(4) as usize, ..Ring::PLAIN }
}

const CONDITIONS: &[(&str, Condition)] = &[
    ("lines", |rng| (ring(rng), Log { form: Form::Lines, ..PLAIN })),
    ("lines of a monitor", |rng| (ring(rng), PLAIN)),
    ("a table", |rng| (ring(rng), Log { form: Form::Table, ..PLAIN })),
    ("binary records", |rng| (ring(rng), Log { form: Form::Records, ..PLAIN })),
    ("only what changes", |rng| (ring(rng), Log { whole: false, ..PLAIN })),
    ("32 bytes", |rng| {
        (Ring { wide: true, ..ring(rng) }, Log { form: rng.pick(&[Form::Lines, Form::Records]), ..PLAIN })
    }),
    ("32 bytes, only what changes", |rng| (Ring { wide: true, ..ring(rng) }, Log { whole: false, ..PLAIN })),
    ("times by the counter", |rng| (ring(rng), Log { form: Form::Lines, counted: true, ..PLAIN })),
    ("NOPs before the start", |rng| (Ring { nops: 5 + rng.below(90) as usize, ..ring(rng) }, PLAIN)),
    ("words of 16 bits exchanged", |rng| (ring(rng), Log { word: 2, form: Form::Lines, ..PLAIN })),
    ("words of 32 bits exchanged", |rng| (ring(rng), Log { word: 4, form: Form::Lines, ..PLAIN })),
    ("NOPs, and words exchanged", |rng| {
        let nops = 5 + rng.below(300) as usize;
        (
            Ring { nops, ..ring(rng) },
            Log { word: rng.pick(&[2, 4]), form: rng.pick(&[Form::Lines, Form::Records]), ..PLAIN },
        )
    }),
    ("much is asked", |rng| (Ring { asked: 0.8, ..ring(rng) }, PLAIN)),
    ("much is refused", |rng| (Ring { asked: 0.8, refused: 0.5, ..ring(rng) }, PLAIN)),
    ("a drive alarms", |rng| (Ring { alarm: true, ..ring(rng) }, PLAIN)),
    ("update periods are missing", |rng| (ring(rng), Log { missing: 0.1, whole: rng.chance(0.5), ..PLAIN })),
    ("blocks are cut short", |rng| (ring(rng), Log { cut: 0.1, form: Form::Lines, ..PLAIN })),
];

/// The log as a file, and what was said of each block in it.
fn written(log: &Log, blocks: Vec<Block>, rng: &mut Rng) -> (Vec<u8>, Vec<Said>) {
    let (mut text, mut said) = (Vec::new(), Vec::new());
    let mut lines = 0;
    if log.form == Form::Table {
        text.extend(b"time_us,direction,axis,data\n");
        lines += 1;
    }
    let mut gone = None;
    let mut first = None;
    let mut updates = std::collections::BTreeMap::new();
    for block in blocks {
        if block.drive == 1 && block.from_master {
            gone = rng.chance(log.missing).then_some(block.update);
        }
        if gone == Some(block.update) {
            continue;
        }
        let mut bytes: Vec<u8> = block.bytes.chunks(log.word).flat_map(|word| word.iter().rev()).copied().collect();
        let cut = rng.chance(log.cut);
        if cut {
            bytes.truncate(1 + rng.below(15) as usize);
        }
        let mut line = String::new();
        let us = block.ns as f64 / 1e3;
        let side = |master: &'static str, drive: &'static str| if block.from_master { master } else { drive };
        // A String takes everything.
        let _ = match log.form {
            Form::Lines | Form::Records => Ok(()),
            Form::Monitor => write!(line, "14:02:07.{:06} {} ", us, side("TX", "RX")),
            Form::Table => write!(line, "{us},{},{},", side("command", "response"), block.drive),
        };
        for byte in &bytes {
            let _ = write!(line, "{byte:02x}");
        }
        lines += 1;
        if log.form == Form::Records {
            text.extend(&bytes);
        } else {
            text.extend(line.as_bytes());
            text.push(b'\n');
        }
        let begin: &mut usize = updates.entry((block.drive, block.from_master)).or_insert(block.update);
        let start = match log.form {
            // From the first block of the drive and the direction on.
            _ if log.counted => (block.update - *begin) as f64 * 500e6,
            Form::Lines | Form::Records => f64::from(lines),
            Form::Monitor => (block.ns - *first.get_or_insert(block.ns)) as f64 * 1e3,
            Form::Table => block.ns as f64 * 1e3,
        };
        let mut fields = block.said.fields;
        fields.push(("note", Shown::Any));
        // Where blocks are missing, the counter goes on by more than one.
        fields.extend(
            ["Update_Counter", "Update_Counter_Echo"].iter().filter(|_| log.missing > 0.0).map(|it| (*it, Shown::Any)),
        );
        said.push(Said { start, damaged: cut, fields, ..block.said });
    }
    (text, said)
}

/// What is said beside the values of a block and is not so.
fn remarks(event: &Event, said: &[Said]) -> Vec<String> {
    let Some(said) = said.iter().find(|it| it.kind == event.kind && (it.start - start(event)).abs() < 0.5) else {
        return Vec::new();
    };
    let is = |name: &str| said.fields.iter().any(|(field, due)| *field == name && *due == Shown::Number(1));
    let holds = |remark: &&str| match *remark {
        "command failed while executing" => is("ERR"),
        "command executed with a restriction" => is("WNG"),
        "command not accepted" => is("CMD_Error"),
        "alarm" => is("ALARM"),
        "a NOP does not switch the servo off" => {
            let nop = Shown::Text("NOP normal (00h)".to_owned());
            said.fields.iter().any(|(name, due)| *name == "Command_Code" && *due == nop)
        }
        // How long the drive took, or was given, is counted from its answers.
        remark => remark.starts_with("answered after ") || remark.contains(" is given up after "),
    };
    let note = event.fields.iter().find_map(|field| match &field.value {
        Value::Text(text) if field.name == "note" => Some(text.as_str()),
        _ => None,
    });
    let wrong = note.into_iter().flat_map(|note| note.split("; ")).filter(|remark| !holds(remark));
    wrong.map(|remark| format!("{}: {remark}", event.kind)).collect()
}

fn run(name: &str, condition: Condition, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed ^ 0x0052_7465 ^ (name.len() as u64) << 32);
    let (ring, log) = condition(&mut rng);
    let (text, said) = written(&log, build(&ring, seed), &mut rng);
    let record_size = (log.form == Form::Records).then_some(if ring.wide { 32 } else { 16 });
    let hints = Hints { record_size, ..Hints::default() };
    let capture = capture::open(Input::over("log.txt", Cursor::new(text)), hints).unwrap();
    let period_ns = log.counted.then_some(500_000);
    let settings = Settings { rtex: Rtex { whole: log.whole, period_ns, ..Rtex::default() }, ..Settings::default() };
    let (events, notes) = read(capture, Some(protocol("rtex")), &settings);
    let mut outcome = judge(&events, &said, 0.5, |_, _| true);
    if log.missing + log.cut == 0.0 {
        outcome.wrong.extend(events.iter().filter(|event| !event.remark).flat_map(|event| remarks(event, &said)));
    }
    if notes.contains("exchanged") != (log.word == 2) || notes.contains("in the other order") != (log.word == 4) {
        outcome.wrong.push(notes.clone());
    }
    outcome.notes = notes;
    outcome
}

#[test]
fn every_value_of_a_log_of_blocks_is_true() {
    hold(CONDITIONS, run);
}

#[test]
fn the_shape_of_a_log_is_told_by_sound_blocks() {
    // Random bytes of NOPs have looked like blocks of 32 bytes, and what was cut off has moved the blocks after it.
    let seeds = [("NOPs before the start", 59), ("blocks are cut short", 43), ("blocks are cut short", 53)];
    hold_these(CONDITIONS, &seeds, run);
}

/// Blocks that go over the ends of lines, and one line that is not bytes: its blocks are lost, and every other one is shown with its own
/// values and the line in which it begins.
#[test]
fn a_spoilt_line_costs_its_own_blocks() {
    for (wide, from, len) in
        [(false, 5, 16), (false, 16, 24), (true, 5, 16), (true, 20, 32), (false, 3, 48), (true, 9, 48)]
    {
        let size = if wide { 32 } else { 16 };
        let mut bytes = Vec::new();
        for k in 0..90_i32 {
            let counter = (k % 4 * 32) as u8;
            for (byte0, status, position) in
                [(counter + 5, 0x80, 70_000 * k + 40), (0x80 + counter + 5, 0xc1, 70_000 * k)]
            {
                let mut block = vec![0; size];
                block[..3].copy_from_slice(&[byte0, 0x20, status]);
                block[4..8].copy_from_slice(&position.to_le_bytes());
                if wide && byte0 < 0x80 {
                    block[16] = 0x80;
                }
                bytes.extend(block);
            }
        }
        let bytes = &bytes[from..];
        let bytes = &bytes[..bytes.len() / len * len];
        let first = (size - from % size) % size;
        for spoilt in (0..bytes.len() / len).step_by(7) {
            let mut text = String::new();
            for (k, line) in bytes.chunks(len).enumerate() {
                // A String takes everything.
                let _ = match k {
                    _ if k == spoilt => writeln!(text, "{}", "zz ".repeat(len)),
                    _ => writeln!(
                        text,
                        "{}",
                        line.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x} "))
                    ),
                };
            }
            let begins = (first..).step_by(size).take_while(|at| at + size <= bytes.len());
            let is_whole = |at: &usize| !(at / len..=(at + size - 1) / len).contains(&spoilt);
            let want: Vec<_> = begins
                .filter(is_whole)
                .map(|at| {
                    let position = i32::from_le_bytes(bytes[at + 4..at + 8].try_into().unwrap());
                    let response = bytes[at] >= 0x80;
                    (
                        (1 + at / len) as f64,
                        if response { "rsp 5" } else { "cmd 5" },
                        response.then_some(position.into()),
                    )
                })
                .collect();
            let capture = capture::open(Input::over("log.txt", Cursor::new(text)), Hints::default()).unwrap();
            let (events, notes) = read(capture, Some(protocol("rtex")), &Settings::default());
            let is_good = |event: &&Event| event.verdict.is_ok() && !event.remark;
            let shown: Vec<_> = events
                .iter()
                .filter(is_good)
                .map(|event| (start(event), event.kind.as_ref(), event.position.map(|position| position.counts)))
                .collect();
            assert_eq!(shown, want, "{wide} {from} {len}, line {}: {notes}", spoilt + 1);
        }
    }
}

/// A ring from power-up in a log that begins inside a block, with exchanged words. As long as motors stand, words of 16 and of 32 bits
/// look alike: what follows is not shown in the wrong one.
#[test]
fn a_shape_that_nothing_tells_yet_waits_for_what_does() {
    for (word, from) in [(2, 30), (4, 2), (4, 0), (2, 0)] {
        for (nops, standing) in [(30, 0), (30, 2), (30, 10), (30, 40), (30, 150), (0, 10), (0, 400)] {
            let turning = 200;
            let mut bytes = Vec::new();
            for k in 0..nops + standing + turning {
                let counter = if k < nops { 0 } else { ((k - nops + 1) % 4 * 32) as u8 };
                let place: i32 = 70_000 * (k - nops - standing).max(0);
                for drive in [3, 9] {
                    for (byte0, off) in [(counter + drive, 0), (0x80 + counter + drive, 40)] {
                        let mut block = [0; 32];
                        block[0] = byte0;
                        if k >= nops {
                            block[1] = 0x20;
                            block[2] = if place == 0 {
                                0
                            } else if byte0 < 0x80 {
                                0x80
                            } else {
                                0xc1
                            };
                            block[4..8].copy_from_slice(&(place - off.min(place)).to_le_bytes());
                        }
                        if byte0 < 0x80 {
                            block[16] = 0x80;
                        }
                        bytes.extend(block.chunks(word).flat_map(|word| word.iter().rev().copied()));
                    }
                }
            }
            let mut text = String::new();
            for line in bytes[from..].chunks_exact(32) {
                let digits = line.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"));
                // A String takes everything.
                let _ = writeln!(text, "{digits}");
            }
            let capture = capture::open(Input::over("log.txt", Cursor::new(text)), Hints::default()).unwrap();
            let (events, notes) = read(capture, Some(protocol("rtex")), &Settings::default());
            let positions = |kind: &str| {
                let of = events.iter().filter(|event| event.kind == kind && event.verdict.is_ok());
                of.filter_map(|event| event.position).map(|position| position.counts).collect::<Vec<_>>()
            };
            // From where it is told, each position is the one that was sent; at most 64 blocks and a piece are seen before.
            for kind in ["rsp 3", "rsp 9"] {
                let shown = positions(kind);
                let want: Vec<i64> = (0..turning).map(|k| i64::from((70_000 * k - 40).max(0))).collect();
                let end = &shown[shown.len().saturating_sub(150)..];
                let last = want.len() - usize::from(kind == "rsp 9" && from > 0);
                let said = format!("{word} {from}, {nops} NOPs, {standing}: {kind} {notes} {:?}", end.last());
                assert!(end.len() == 150 && end == &want[last - 150..last], "{said}");
            }
        }
    }
}

/// Motors that stand, energised, and turn later: what was sent before that is shown in the shape that is told only then, from the first
/// block on.
#[test]
fn what_stands_is_shown_in_the_shape_that_is_told_later() {
    for (word, from) in [(2, 30), (4, 2), (4, 0), (2, 0)] {
        for (nops, standing) in [(30, 10), (30, 40), (0, 10), (0, 40)] {
            let mut text = String::new();
            let mut bytes = Vec::new();
            for k in 0..nops + standing + 60_i32 {
                let (counter, code) = if k < nops { (0, 0) } else { (((k - nops + 1) % 4 * 32) as u8, 0x20) };
                let [l, ml, mh, h] = (70_000 * (k - nops - standing).max(0)).to_le_bytes();
                for (byte0, status, sub) in [(counter + 3, 0x80, 0x80), (0x80 + counter + 3, 0xc1, 0)] {
                    let mut block = [0; 32];
                    block[0] = byte0;
                    if code != 0 {
                        block[..8].copy_from_slice(&[byte0, code, status, 0, l, ml, mh, h]);
                    }
                    block[16] = sub;
                    bytes.extend(block.chunks(word).flat_map(|word| word.iter().rev().copied()));
                }
            }
            for line in bytes[from..].chunks_exact(32) {
                // A String takes everything.
                let _ = writeln!(text, "{}", line.iter().fold(String::new(), |all, byte| all + &format!("{byte:02x}")));
            }
            let capture = capture::open(Input::over("log.txt", Cursor::new(text)), Hints::default()).unwrap();
            let settings = Settings { rtex: Rtex { whole: true, ..Rtex::default() }, ..Settings::default() };
            let (events, notes) = read(capture, Some(protocol("rtex")), &settings);
            let said = format!("{word} {from}, {nops} NOPs, {standing}: {notes}");
            for (kind, name, due) in [("cmd 3", "Control_Bits", 0x80), ("rsp 3", "Status_Flags", 0xc1)] {
                let raw: Vec<u64> = events
                    .iter()
                    .filter(|event| event.kind == kind && event.verdict.is_ok())
                    .flat_map(|event| &event.fields)
                    .filter_map(|field| match field.value {
                        Value::Flags { raw, .. } if field.name == name => Some(raw),
                        _ => None,
                    })
                    .collect();
                let shown = raw.iter().filter(|raw| **raw == due).count() as i32;
                assert!(
                    shown >= standing + 58 && raw.iter().all(|raw| [0, due].contains(raw)),
                    "{said} {kind} {shown}"
                );
                let zero = raw.iter().filter(|raw| **raw == 0).count() as i32;
                assert!(zero <= nops, "{said} {kind}: {zero} without flags");
            }
        }
    }
}
