//! Renders the bundled captures: `cargo run -p servowire --example render-captures`.
//!
//! The bytes are the rows of `tests/vectors/tformat/responses.jsonl` that were logged from hardware and published;
//! the edges are made here, at 2.5 Mbit/s, with the request before each answer and 3 us between them.
#![allow(clippy::std_instead_of_core, clippy::arithmetic_side_effects)]

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// A capture that the package carries, and how the `source` of its rows begins.
struct Capture {
    file: &'static str,
    sources: &'static [&'static str],
    remark: &'static str,
}

const CAPTURES: [Capture; 4] = [
    Capture {
        file: "hpm-sei-master-log.vcd",
        sources: &["hpm_sdk sei master log"],
        remark: "hpm_sdk, log of the SEI master sample, encoder TS5700N8401",
    },
    Capture {
        file: "hpm-uart-readme.vcd",
        sources: &["hpm_sdk uart_tamagawa README"],
        remark: "hpm_sdk, README of the uart_tamagawa sample",
    },
    Capture {
        file: "ti-sample-output.vcd",
        sources: &["motor-control-sdk tamagawa sample output picture"],
        remark: "motor-control-sdk, sample output picture of the tamagawa example",
    },
    Capture {
        file: "ti-uart-example.vcd",
        sources: &["motor-control-sdk tamagawa UART example picture"],
        remark: "motor-control-sdk, picture of the tamagawa UART example",
    },
];

/// Nanoseconds of a bit at 2.5 Mbit/s.
const BIT: u64 = 400;
/// From the end of the request to the answer.
const TURN_ROUND: u64 = 3_000;
/// From request to request. The logs tell no cycle; drives poll at this one.
const CYCLE: u64 = 125_000;
/// Idle line before the first request.
const LEAD: u64 = 10_000;

fn main() -> Result<(), Box<dyn Error>> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (file, text) in render(&package.join("../tests/vectors/tformat/responses.jsonl"))? {
        let path = package.join("../servowire-decode/captures").join(file);
        fs::write(&path, text)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// The files by name, with their content.
pub(crate) fn render(rows: &Path) -> Result<Vec<(&'static str, String)>, Box<dyn Error>> {
    let rows = logged(&fs::read_to_string(rows)?)?;
    let mut files = Vec::new();
    for capture in &CAPTURES {
        let of_it = |row: &&Row| capture.sources.iter().any(|source| row.source.starts_with(source));
        let answers: Vec<&Row> = rows.iter().filter(of_it).collect();
        if answers.is_empty() {
            return Err(format!("no rows for {}", capture.file).into());
        }
        files.push((capture.file, vcd(capture.remark, &answers)));
    }
    Ok(files)
}

/// An answer of real hardware.
struct Row {
    bytes: Vec<u8>,
    source: String,
}

/// The rows with `"origin": "capture"`. "same" as source means that of the row before.
fn logged(text: &str) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows: Vec<Row> = Vec::new();
    for line in text.lines() {
        let row: serde_json::Value = serde_json::from_str(line)?;
        let get = |key: &str| row.get(key).and_then(serde_json::Value::as_str).unwrap_or_default();
        if get("origin") != "capture" {
            continue;
        }
        let hex = get("bytes");
        let bytes = (0..hex.len()).step_by(2).map(|k| hex.get(k..k + 2).unwrap_or_default());
        let bytes = bytes.map(|pair| u8::from_str_radix(pair, 16)).collect::<Result<Vec<u8>, _>>()?;
        let source = match (get("source"), rows.last()) {
            (same, Some(before)) if same.starts_with("same") => before.source.clone(),
            (source, _) => source.to_owned(),
        };
        rows.push(Row { bytes, source });
    }
    Ok(rows)
}

/// One line, one transaction a row.
fn vcd(remark: &str, answers: &[&Row]) -> String {
    let mut text = format!(
        "$comment bytes: {remark}; edges: rendered by servowire $end\n$timescale 1 ns $end\n$scope module line $end\n\
         $var wire 1 ! RS485 $end\n$upscope $end\n$enddefinitions $end\n#0\n1!\n"
    );
    let mut level = true;
    let mut set = |text: &mut String, time: u64, next: bool| {
        if next != level {
            level = next;
            // Writing to a string cannot fail.
            let _ = writeln!(text, "#{time}\n{}!", u8::from(next));
        }
    };
    for (cycle, row) in (0..).zip(answers) {
        let start = LEAD + cycle * CYCLE;
        // The request of a read or reset is the control field, which the answer repeats.
        let request = row.bytes.get(..1).unwrap_or_default();
        let answer = start + 10 * BIT + TURN_ROUND;
        for (begin, bytes) in [(start, request), (answer, row.bytes.as_slice())] {
            for (k, bit) in (0..).zip(bytes.iter().flat_map(|byte| field(*byte))) {
                set(&mut text, begin + k * BIT, bit);
            }
        }
    }
    let _ = writeln!(text, "#{}", LEAD + answers.len() as u64 * CYCLE);
    text
}

/// Start bit, eight data bits with the lowest first, delimiter.
fn field(byte: u8) -> impl Iterator<Item = bool> {
    [false].into_iter().chain((0..8).map(move |k| byte >> k & 1 == 1)).chain([true])
}
