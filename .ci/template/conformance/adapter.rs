//! @Title@.

use @snake@::Frame;
use serde::Deserialize;

use crate::hex::Bytes;
use crate::row::{Check, Row, Verdict, each, same};

pub(crate) const TOPICS: &[(&str, Check)] = &[("frames", frames)];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct FrameRow {
    bytes: Bytes,
    value: Option<u8>,
    error: Option<String>,
}

fn frames(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: FrameRow| {
        let frame = Frame::parse(&row.bytes.0);
        same("error", &row.error.as_deref(), &frame.err().map(|error| error.class().name()))?;
        same("value", &row.value, &frame.ok().map(|frame| frame.value))?;
        frame.map_or(Ok(()), |frame| same("bytes", row.bytes.0.as_slice(), &frame.emit()))
    })
}
