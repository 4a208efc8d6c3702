//! Requests and answers of the T-Format vectors, in the layouts that `src/tformat.rs` describes.

use serde_json::Value;

use crate::{Source, hex, packed};

pub(crate) const SOURCES: &[Source] = &[
    ("tformat_request", "tformat/request_decode.jsonl", request),
    ("tformat_response", "tformat/responses.jsonl", bytes),
    ("tformat_response", "tformat/negatives.jsonl", line),
    ("tformat_differential", "tformat/responses.jsonl", line),
    ("tformat_differential", "tformat/negatives.jsonl", line),
    ("tformat_stream", "tformat/responses.jsonl", stream),
];

fn request(row: &Value) -> Option<Vec<u8>> {
    row["bytes"].as_str().map(hex)
}

/// The three bytes that choose the request of a row.
fn chosen(row: &Value) -> Option<Vec<u8>> {
    let kind = "0123678CD".find(row["request_id"].as_str()?)?;
    let byte = |key: &str| row[key].as_u64().unwrap_or(0) as u8;
    Some(vec![kind as u8, byte("adf"), byte("edf")])
}

/// The request, one more byte, and what follows.
fn answer(row: &Value, byte: u8, behind: &[u8]) -> Option<Vec<u8>> {
    let mut input = chosen(row)?;
    input.push(byte);
    input.extend(behind);
    Some(input)
}

fn bytes(row: &Value) -> Option<Vec<u8>> {
    answer(row, 0, &hex(row["bytes"].as_str()?))
}

fn wire(row: &Value) -> Option<Vec<u8>> {
    Some(packed(row["wire"].as_str()?.chars().map(|c| c == '1')))
}

fn line(row: &Value) -> Option<Vec<u8>> {
    answer(row, 0, &wire(row)?)
}

/// The answer twice, three bytes at a time.
fn stream(row: &Value) -> Option<Vec<u8>> {
    answer(row, 2, &hex(row["bytes"].as_str()?).repeat(2))
}
