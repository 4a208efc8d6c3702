//! Tables from `8b10b_decode`, `crc16` and `answer` of HIPERFACE DSL.

use serde_json::Value;

use super::{bytes, line, table, text};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let answers = rows("answer");
    [
        table("WORDS: &[Symbol]", &rows("8b10b_decode"), word),
        table("CHECKS: &[(&[u8], u16)]", rows("crc16").iter().filter(|row| row["kind"] == "crc"), |row| {
            format!("(&{}, 0x{})", bytes(text(row, "data")), text(row, "crc"))
        }),
        table("ANSWERS: &[Received]", answers.iter().filter(|row| row["truncated"] != true), answer),
    ]
    .concat()
}

fn word(row: &Value) -> String {
    let character = match (row["byte"].as_str(), row["k"].as_bool()) {
        (Some(byte), Some(k)) => format!("Some((0x{byte}, {k}))"),
        _ => "None".to_owned(),
    };
    format!("Symbol {{ name: {:?}, word: {}, want: {character} }}", text(row, "code"), line(text(row, "code")))
}

fn answer(row: &Value) -> String {
    let bits = text(row, "bits");
    let dd = row["dd"].as_i64().map_or("None".to_owned(), |dd| format!("Some({dd})"));
    format!("Received {{ name: {bits:?}, bits: {}, dd: {dd} }}", line(bits))
}
