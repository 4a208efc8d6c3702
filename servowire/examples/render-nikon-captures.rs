//! Renders the bundled A-format captures: `cargo run -p servowire --example render-nikon-captures`.
//!
//! The words are the rows of `tests/vectors/nikon/anchors.jsonl`, replies of encoders and worked examples that vendors
//! published; the edges are made here, with the request before each reply and 3 us between them.
#![allow(clippy::std_instead_of_core, clippy::arithmetic_side_effects)]

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use nikon_aformat::{BitOrder, Command, EncoderAddress, Layout, Operation, RawResponse, Request, Window};

/// A capture that the package carries, and how the `source` of its rows begins.
struct Capture {
    file: &'static str,
    source: &'static str,
    remark: &'static str,
    /// A bit in picoseconds.
    bit: u64,
}

const CAPTURES: [Capture; 3] = [
    Capture {
        file: "nikon-hpm-sei-log.vcd",
        source: "HPMicro hpm_sdk",
        remark: "hpm_sdk, console log of the SEI Nikon sample",
        bit: 400_000,
    },
    Capture {
        file: "nikon-ti-console.vcd",
        source: "vendor SDK 9.2",
        remark: "motor-control-sdk 9.2, console picture of the nikon diagnostic example",
        bit: 250_000,
    },
    Capture {
        file: "nikon-artinchip-crc.vcd",
        source: "ArtInChip",
        remark: "ArtInChip TA_IF documentation, CRC example",
        bit: 250_000,
    },
];

/// From the end of the request to the reply.
const TURN_ROUND: u64 = 3_000_000;
/// From request to request. The publications tell no cycle.
const CYCLE: u64 = 125_000_000;
/// Idle line before the first request.
const LEAD: u64 = 10_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (file, text) in render(&package.join("../tests/vectors/nikon/anchors.jsonl"))? {
        let path = package.join("../servowire-decode/captures").join(file);
        fs::write(&path, text)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// The files by name, with their content.
pub(crate) fn render(rows: &Path) -> Result<Vec<(&'static str, String)>, Box<dyn Error>> {
    let text = fs::read_to_string(rows)?;
    let rows = text.lines().map(published).collect::<Result<Vec<_>, _>>()?;
    let mut files = Vec::new();
    for capture in &CAPTURES {
        let of_it: Vec<&Row> = rows.iter().filter(|row| row.source.starts_with(capture.source)).collect();
        if of_it.is_empty() {
            return Err(format!("no rows for {}", capture.file).into());
        }
        files.push((capture.file, vcd(capture, &of_it)));
    }
    Ok(files)
}

/// A published reply and the request that it answers.
struct Row {
    request: Window,
    reply: Window,
    source: String,
}

fn published(line: &str) -> Result<Row, Box<dyn Error>> {
    let row: serde_json::Value = serde_json::from_str(line)?;
    let number = |value: Option<&serde_json::Value>| value.and_then(serde_json::Value::as_u64).unwrap_or_default();
    let words = row.get("words").and_then(serde_json::Value::as_array).ok_or("no words")?;
    let words = words.iter().map(|word| u16::from_str_radix(word.as_str().unwrap_or_default(), 16));
    let words = words.collect::<Result<Vec<_>, _>>()?;
    let name = row.get("layout").and_then(serde_json::Value::as_str).unwrap_or_default();
    let layout = Layout::ALL.into_iter().find(|layout| layout.name() == name).ok_or("no such layout")?;
    let reply = RawResponse::from_words(layout, &words, BitOrder::MsbFirst)?.line();
    let command = Command::from_code(u8::try_from(number(row.get("cmd")))?).ok_or("no such command")?;
    let ea = row.get("expect").and_then(|expect| expect.get("ea"));
    let ea = EncoderAddress::new(u8::try_from(number(ea))?).ok_or("no such address")?;
    let operation = Operation::without_arguments(command).ok_or("a command with arguments")?;
    let frames = Request::new(ea, operation).emit();
    let request = frames.as_slice().first().ok_or("no frame")?.line();
    let source = row.get("source").and_then(serde_json::Value::as_str).unwrap_or_default().to_owned();
    Ok(Row { request, reply, source })
}

/// One line, one transaction a row.
fn vcd(capture: &Capture, rows: &[&Row]) -> String {
    let mut text = format!(
        "$comment words: {}; edges: rendered by servowire $end\n$timescale 1 ps $end\n$scope module line $end\n\
         $var wire 1 ! RS485 $end\n$upscope $end\n$enddefinitions $end\n#0\n1!\n",
        capture.remark
    );
    let mut level = true;
    let mut set = |text: &mut String, time: u64, next: bool| {
        if next != level {
            level = next;
            // Writing to a string cannot fail.
            let _ = writeln!(text, "#{time}\n{}!", u8::from(next));
        }
    };
    for (cycle, row) in (0..).zip(rows) {
        let start = LEAD + cycle * CYCLE;
        let reply = start + u64::from(row.request.len()) * capture.bit + TURN_ROUND;
        for (begin, line) in [(start, row.request), (reply, row.reply)] {
            for at in 0..line.len() {
                set(&mut text, begin + u64::from(at) * capture.bit, line.get(at) == Some(true));
            }
        }
    }
    let _ = writeln!(text, "#{}", LEAD + rows.len() as u64 * CYCLE);
    text
}
