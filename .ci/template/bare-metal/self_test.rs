//! Frames.

use @snake@::Frame;

use super::{Tally, Topic, each};

/// A row of `frames.jsonl`.
pub(crate) struct Row {
    name: &'static str,
    bytes: &'static [u8],
    value: Option<u8>,
}

include!(concat!(env!("OUT_DIR"), "/@short@.rs"));

pub(crate) const TOPICS: &[Topic] = &[("@short@/frames", frames)];

fn frames() -> Tally {
    each(FRAMES, |row| row.name, |row| Frame::parse(row.bytes).ok().map(|frame| frame.value) == row.value)
}
