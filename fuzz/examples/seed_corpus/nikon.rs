//! Requests and replies of the A-format vectors, in the layouts that `src/nikon.rs` describes.

use serde_json::Value;

use crate::{Source, hex, packed};

pub(crate) const SOURCES: &[Source] = &[
    ("c_codecs", "nikon/rx_responses.jsonl", words),
    ("nikon_request", "nikon/tx_transactions.jsonl", request),
    ("nikon_reply", "nikon/rx_responses.jsonl", reply),
    ("nikon_reply", "nikon/rx_negative.jsonl", reply),
    ("nikon_reception", "nikon/rx_bus.jsonl", bus),
    ("nikon_reception", "nikon/rx_oversampled.jsonl", oversampled),
    ("nikon_master", "nikon/rx_responses.jsonl", transaction),
    ("nikon_device", "nikon/tx_transactions.jsonl", frames),
    ("nikon_inspect", "nikon/rx_negative.jsonl", inspected),
    ("nikon_world", "nikon/tx_transactions.jsonl", world),
];

/// 16-bit words, low byte first.
fn words(row: &Value) -> Option<Vec<u8>> {
    let words = row["words"].as_array()?.iter().filter_map(Value::as_str);
    Some(words.flat_map(|word| hex(word).into_iter().rev()).collect())
}

fn request(row: &Value) -> Option<Vec<u8>> {
    let words = row["frames"].as_array()?.iter().filter_map(|frame| frame["word16"].as_str());
    Some(words.flat_map(hex).collect())
}

/// The three bytes that choose the request of a row.
fn chosen(row: &Value) -> Option<Vec<u8>> {
    let (command, ea) = (row["cmd"].as_u64()? as u8, row["request_ea"].as_u64()? as u8);
    let bank = u8::from(matches!(row["layout"].as_str(), Some("EEPROM_BANK" | "VELCOEF")));
    Some(vec![command << 3 | ea, row["expect"]["addr"].as_u64().unwrap_or(0) as u8, bank])
}

fn wire(row: &Value) -> Option<Vec<u8>> {
    Some(packed(row["wire"].as_str()?.chars().map(|c| c == '1')))
}

fn reply(row: &Value) -> Option<Vec<u8>> {
    Some([chosen(row)?, vec![0], wire(row)?].concat())
}

fn inspected(row: &Value) -> Option<Vec<u8>> {
    let len = row["wire"].as_str()?.len().min(128) as u8;
    Some([chosen(row)?, vec![len], wire(row)?].concat())
}

fn layout(row: &Value) -> Option<u8> {
    let names = [
        "ABS40",
        "ABS24",
        "ABS24H",
        "ABS17",
        "STATUS",
        "EEPROM",
        "EEPROM_BANK",
        "TEMP",
        "ID",
        "VELCOEF",
        "ABS24_ALM",
        "ABS24_TEMP",
        "ABS24_VEL",
        "ABS24_VEL_ACC",
        "ABS40_VEL",
    ];
    Some(names.iter().position(|name| row["layout"].as_str() == Some(name))? as u8)
}

fn bus(row: &Value) -> Option<Vec<u8>> {
    let line = packed(row["line"].as_str()?.chars().map(|c| c == '1'));
    Some([vec![layout(row)?, 0x80], line].concat())
}

fn oversampled(row: &Value) -> Option<Vec<u8>> {
    let samples = hex(row["samples_packed_msb_first"].as_str()?);
    let line: Vec<u8> = samples.into_iter().map(u8::reverse_bits).collect();
    Some([vec![layout(row)?, row["oversampling"].as_u64()? as u8], line].concat())
}

/// Every frame of the reply, 2.3 us apart.
fn transaction(row: &Value) -> Option<Vec<u8>> {
    let words = row["words"].as_array()?.iter().filter_map(Value::as_str).map(hex);
    let events = words.flat_map(|word| [word[0].reverse_bits(), word[1].reverse_bits(), 2, 23]);
    Some([chosen(row)?, events.collect()].concat())
}

/// Every frame of the request, 6 us apart.
fn frames(row: &Value) -> Option<Vec<u8>> {
    let words = row["frames"].as_array()?.iter().filter_map(|frame| frame["word16"].as_str()).map(hex);
    Some(words.flat_map(|word| [word[0].reverse_bits(), word[1].reverse_bits(), 2, 6]).collect())
}

/// What is done, the host and three faults out of the words of a request.
fn world(row: &Value) -> Option<Vec<u8>> {
    let bytes = request(row)?;
    let sum = bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_mul(31).wrapping_add(*byte));
    let mut input = vec![sum, sum >> 3, sum ^ sum >> 4];
    input.extend([sum, sum >> 2, 0, 1, 0, 9, 7, 0]);
    for k in 0..3_u8 {
        input.extend([sum % 5 + k, k, sum.wrapping_add(5 * k), 3, sum, 40]);
    }
    Some(input)
}
