//! Tables from `responses`, `negatives` and `crc` of T-Format.

use serde_json::Value;

use super::{bytes, line, line_bytes, number, pascal, table, text, window};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let (responses, negatives) = (rows("responses"), rows("negatives"));
    let full: Vec<&Value> = responses.iter().filter(|row| row["request_id"] == "3").collect();
    [
        table("ANSWERS: &[Answer]", &responses, answer),
        table("FULL: &[Full]", full.iter().copied(), fields),
        table("FULL_FORMS: &[FullForms]", full, full_forms),
        table("FLIPS: &[Flip]", negatives.iter().filter(|row| row["kind"] == "bit_flip"), flip),
        table("CHECKS: &[(&str, &[u8], u8)]", &rows("crc"), |row| {
            format!("({:?}, &{}, 0x{})", text(row, "name"), bytes(text(row, "bytes")), text(row, "crc"))
        }),
    ]
    .concat()
}

fn answer(row: &Value) -> String {
    format!(
        "Answer {{ name: {:?}, request: {}, bytes: &{}, line: {}, want: Response::Id{}({}) }}",
        text(row, "name"),
        request(row),
        bytes(text(row, "bytes")),
        window(text(row, "wire")),
        text(row, "request_id"),
        fields(row)
    )
}

fn full_forms(row: &Value) -> String {
    let bits = text(row, "wire");
    format!(
        "FullForms {{ uart: {}, lsb_first: {}, msb_first: {} }}",
        bytes(text(row, "bytes")),
        line_bytes(bits, line),
        line_bytes(bits, |byte| format!("0b{byte}"))
    )
}

fn flip(row: &Value) -> String {
    format!(
        "Flip {{ name: {:?}, request: {}, line: {}, want: ErrorClass::{} }}",
        text(row, "name"),
        request(row),
        window(text(row, "wire")),
        pascal(text(row, "error"))
    )
}

/// The decoded values of an answer as a value of the crate.
fn fields(row: &Value) -> String {
    let sf = || format!("sf: StatusField::new({})", number(&row["sf"], "raw"));
    let data = |key| format!("{key}: U24::truncate({})", number(row, key));
    match text(row, "request_id") {
        "0" | "7" | "8" | "C" => format!("SingleTurn {{ {}, {} }}", sf(), data("abs")),
        "1" => format!("MultiTurn {{ {}, {} }}", sf(), data("abm")),
        "2" => format!("EncoderId {{ {}, enid: {} }}", sf(), number(row, "enid")),
        "3" => format!(
            "Full {{ {}, {}, enid: {}, {}, almc: Almc::new({}) }}",
            sf(),
            data("abs"),
            number(row, "enid"),
            data("abm"),
            number(&row["almc"], "raw")
        ),
        _ => {
            let busy = u64::from(row["busy"] == true) << 7;
            format!("Memory {{ adf: Adf::new({}), edf: {} }}", number(row, "adf") | busy, number(row, "edf"))
        }
    }
}

/// The request that a row answers; address and data of EEPROM access are the row's own.
fn request(row: &Value) -> String {
    let byte = |key: &str| row[key].as_u64().unwrap_or(0);
    match text(row, "request_id") {
        "6" => format!("Request::Id6 {{ adf: Adf::new({}), edf: {} }}", byte("adf"), byte("edf")),
        "D" => format!("Request::IdD {{ adf: Adf::new({}) }}", byte("adf")),
        id => format!("Request::Id{id}"),
    }
}
