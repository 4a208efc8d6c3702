//! Requests and answers of the T-Format vectors, in the layouts that `src/tformat.rs` describes.

use serde_json::Value;

use crate::{Source, hex, packed};

pub(crate) const SOURCES: &[Source] = &[
    ("c_codecs", "tformat/responses.jsonl", |row| row["bytes"].as_str().map(hex)),
    ("c_tformat", "tformat/responses.jsonl", bytes),
    ("c_tformat", "tformat/procedures.jsonl", procedure),
    ("tformat_request", "tformat/request_decode.jsonl", request),
    ("tformat_response", "tformat/responses.jsonl", bytes),
    ("tformat_response", "tformat/negatives.jsonl", line),
    ("tformat_differential", "tformat/responses.jsonl", line),
    ("tformat_differential", "tformat/negatives.jsonl", line),
    ("tformat_stream", "tformat/responses.jsonl", stream),
    ("tformat_master", "tformat/uart_echo.jsonl", transaction),
    ("tformat_device", "tformat/procedures.jsonl", procedure),
    ("tformat_inspect", "tformat/negatives.jsonl", inspected),
    ("tformat_world", "tformat/requests.jsonl", world),
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
fn answer(row: &Value, byte: u8, after: &[u8]) -> Option<Vec<u8>> {
    let mut input = chosen(row)?;
    input.push(byte);
    input.extend(after);
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

/// With echo at 2.5 Mbit/s, a byte every ten bits.
fn transaction(row: &Value) -> Option<Vec<u8>> {
    let request = hex(row["request"].as_str()?);
    let kind =
        [0x02, 0x8a, 0x92, 0x1a, 0x32, 0xba, 0xc2, 0x62, 0xea].iter().position(|cf| Some(cf) == request.first())?;
    let mut input = vec![kind as u8, *request.get(1).unwrap_or(&0), *request.get(2).unwrap_or(&0), 1];
    for byte in hex(row["rx"].as_str()?) {
        input.extend([10 << 2 | 2, byte]);
    }
    Some(input)
}

/// The procedure, address, data, page 2 and 40 tries; the third answer is damaged.
fn procedure(row: &Value) -> Option<Vec<u8>> {
    let request = hex(row["request"].as_str()?);
    let kind = [0xba, 0x62, 0xc2, 0x32, 0xea].iter().position(|cf| Some(cf) == request.first())?;
    let field = |at: usize| request.get(at).copied().unwrap_or(0);
    Some(vec![kind as u8, field(1), field(2), 2, 40, 0, 0, 0, 0, 0x60, 21])
}

/// The line, whole.
fn inspected(row: &Value) -> Option<Vec<u8>> {
    let bits = row["wire"].as_str()?.len();
    answer(row, u8::try_from(bits).ok()?, &wire(row)?)
}

/// A request at one rate or the other, in one of the procedures, an echo, and three faults that depend on its bytes.
fn world(row: &Value) -> Option<Vec<u8>> {
    let bytes = hex(row["bytes"].as_str()?);
    let sum = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_mul(31).wrapping_add(*byte));
    let kind = "0123678CD".find(row["data_id"].as_str()?)?;
    let byte = |key: &str| row[key].as_u64().unwrap_or(0) as u8;
    let mut input = vec![sum, sum >> 4, sum, kind as u8, byte("adf"), byte("edf")];
    input.extend([sum, sum >> 2, 0, 3, 0, 9, 7, 0]);
    for k in 0..3_u8 {
        input.extend([sum % 5 + k, k, sum.wrapping_add(5 * k), 3, sum, 40]);
    }
    Some(input)
}
