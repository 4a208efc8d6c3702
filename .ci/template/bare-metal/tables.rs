//! Tables from `frames` of @Title@.

use serde_json::Value;

use super::{bytes, table, text};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    table("FRAMES: &[Row]", &rows("frames"), |row| {
        format!(
            "Row {{ name: {:?}, bytes: &{}, value: {:?} }}",
            text(row, "name"),
            bytes(text(row, "bytes")),
            row["value"].as_u64()
        )
    })
}
