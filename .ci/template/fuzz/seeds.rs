//! Frames of the vectors.

use serde_json::Value;

use crate::{Source, hex};

pub(crate) const SOURCES: &[Source] = &[("@snake@_frame", "@short@/frames.jsonl", frame)];

fn frame(row: &Value) -> Option<Vec<u8>> {
    Some(hex(row["bytes"].as_str()?))
}
