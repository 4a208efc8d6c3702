//! Words, answers, heads, messages, samples; for the machines a start-up and a few disturbances.

use serde_json::Value;

use crate::Source;

pub(crate) const SOURCES: &[Source] = &[
    ("c_codecs", "hdsl/short_message.jsonl", |row| hex(&row["request"])),
    ("c_codecs", "hdsl/long_message.jsonl", |row| hex(&row["request"])),
    ("hdsl_symbol", "hdsl/8b10b_stream.jsonl", symbols),
    ("hdsl_answer", "hdsl/answer.jsonl", answer),
    ("hdsl_head", "hdsl/master_header.jsonl", head),
    ("hdsl_message", "hdsl/short_message.jsonl", message),
    ("hdsl_message", "hdsl/long_message.jsonl", message),
    ("hdsl_learn", "hdsl/learn.jsonl", samples),
    ("hdsl_position", "hdsl/fast_position.jsonl", position),
    ("hdsl_master", "hdsl/sampled_answer.jsonl", master),
    ("hdsl_link", "hdsl/sampled_answer.jsonl", link),
];

/// Line bits as an integer, the first in bit 0.
fn line(text: &Value) -> Option<u128> {
    Some(text.as_str()?.bytes().rev().fold(0, |line, bit| line << 1 | u128::from(bit & 1)))
}

fn hex(text: &Value) -> Option<Vec<u8>> {
    let text = text.as_str()?;
    (0..text.len()).step_by(2).map(|at| u8::from_str_radix(text.get(at..at + 2)?, 16).ok()).collect()
}

fn symbols(row: &Value) -> Option<Vec<u8>> {
    let words = row["codes"].as_array()?.iter().map(|code| line(code).map(|bits| (bits as u16).to_le_bytes()));
    words.collect::<Option<Vec<_>>>().map(|words| words.concat())
}

fn answer(row: &Value) -> Option<Vec<u8>> {
    Some(((line(&row["bits"])? << 3) as u64).to_le_bytes().to_vec())
}

fn head(row: &Value) -> Option<Vec<u8>> {
    let mut input = line(&row["bits"])?.to_le_bytes().to_vec();
    input.push(u8::try_from(row["bits"].as_str()?.len()).ok()?);
    Some(input)
}

fn message(row: &Value) -> Option<Vec<u8>> {
    hex(&row["request"]).or_else(|| hex(&row["answer"]))
}

fn samples(row: &Value) -> Option<Vec<u8>> {
    hex(&row["samples"])
}

/// The words of all frames, with a safe position after every eighth.
fn position(row: &Value) -> Option<Vec<u8>> {
    let mut input = vec![u8::try_from(row["pos_bits"].as_u64()?).ok()?];
    for frame in row["frames"].as_array()? {
        let word = u16::from_str_radix(frame["acc"].as_str()?, 16).ok()?;
        input.push(if frame["byte_error"] == true { 2 } else { 3 });
        input.extend(word.to_le_bytes());
        if let Some(safe) = frame["vpos"].as_str() {
            input.push(0);
            input.extend(u64::from_str_radix(safe, 16).ok()?.to_le_bytes());
        }
    }
    Some(input)
}

/// A start-up up to the identifier, then the samples of the row.
fn master(row: &Value) -> Option<Vec<u8>> {
    let samples = hex(&row["samples"])?;
    let mut input = vec![samples.first()? & 3];
    input.extend([0; 52]);
    input.extend([2, 0x41, 0x10, 3]);
    input.extend(samples.get(..72)?);
    Some(input)
}

fn link(row: &Value) -> Option<Vec<u8>> {
    let number = |key: &str| row[key].as_u64().and_then(|n| u8::try_from(n).ok());
    let mut input = vec![number("delay")?, number("delay_eighths")?, number("jitter")?, number("rssi")?, 20];
    input.extend((line(&row["bits"])? as u64).to_le_bytes());
    Some(input)
}
