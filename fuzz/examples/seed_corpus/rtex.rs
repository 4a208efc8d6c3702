//! Blocks of the RTEX vectors, and events for the ring.

use serde_json::Value;

use crate::{Source, hex};

pub(crate) const SOURCES: &[Source] = &[
    ("c_codecs", "rtex/commands32.jsonl", block),
    ("c_codecs", "rtex/responses16.jsonl", block),
    ("c_codecs", "rtex/responses32.jsonl", block),
    ("rtex_block", "rtex/commands16.jsonl", block),
    ("rtex_block", "rtex/commands32.jsonl", block),
    ("rtex_block", "rtex/responses16.jsonl", block),
    ("rtex_block", "rtex/responses32.jsonl", block),
    ("rtex_log", "rtex/noncyclic_traces.jsonl", trace),
    ("rtex_drive", "rtex/drive_check.jsonl", drive),
    ("rtex_ring", "rtex/update_counter_traces.jsonl", ring),
];

fn block(row: &Value) -> Option<Vec<u8>> {
    row["hex"].as_str().map(hex)
}

fn trace(row: &Value) -> Option<Vec<u8>> {
    let blocks = row["responses"].as_array()?.iter().filter_map(Value::as_str);
    Some(blocks.flat_map(hex).collect())
}

/// The same block, often enough for its fault to last.
fn drive(row: &Value) -> Option<Vec<u8>> {
    let mut block = block(row)?;
    block[0] = block[0] & 0xe0 | 5;
    Some(block.repeat(10))
}

/// Servo on, then a missed exchange wherever the echo of the row stands still.
fn ring(row: &Value) -> Option<Vec<u8>> {
    let echoes: Vec<u64> = row["echoes"].as_array()?.iter().filter_map(Value::as_u64).collect();
    let on = [[4, 0]; 30];
    let missed = echoes.windows(2).map(|pair| if pair[0] == pair[1] { [1, 0] } else { [10, 3] });
    Some(on.into_iter().chain(missed).flatten().collect())
}
