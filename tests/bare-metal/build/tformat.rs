//! Tables from `responses`, `negatives` and `crc` of T-Format.

use serde_json::Value;

use super::{bytes, line, line_bytes, number, pascal, table, text, window};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let (responses, negatives) = (rows("responses"), rows("negatives"));
    let full: Vec<&Value> = responses.iter().filter(|row| row["request_id"] == "3").collect();
    [
        table("ANSWERS: &[Answer]", &responses, answer),
        table("FULL: &[AllData]", full.iter().copied(), fields),
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
        "Answer {{ name: {:?}, request: {}, bytes: &{}, line: {}, want: Response::{}({}) }}",
        text(row, "name"),
        request(row),
        bytes(text(row, "bytes")),
        window(text(row, "wire")),
        variant(row),
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

/// The crate's name of a data ID.
fn variant(row: &Value) -> &'static str {
    match text(row, "request_id") {
        "0" => "ReadSingleTurn",
        "1" => "ReadMultiTurn",
        "2" => "ReadEncoderId",
        "3" => "ReadAll",
        "6" => "WriteEeprom",
        "7" => "ResetErrors",
        "8" => "SetSingleTurnZero",
        "C" => "ResetTurnsAndErrors",
        _ => "ReadEeprom",
    }
}

/// The decoded values of an answer as a value of the crate.
fn fields(row: &Value) -> String {
    let sf = || format!("sf: StatusField::from_bits_retain({})", number(&row["sf"], "raw"));
    let abs = || format!("abs: Abs::truncate({})", number(row, "abs"));
    let abm = || format!("abm: Abm::truncate({})", number(row, "abm"));
    match text(row, "request_id") {
        "0" | "7" | "8" | "C" => format!("SingleTurn {{ {}, {} }}", sf(), abs()),
        "1" => format!("MultiTurn {{ {}, {} }}", sf(), abm()),
        "2" => format!("Identification {{ {}, enid: {} }}", sf(), number(row, "enid")),
        "3" => format!(
            "AllData {{ {}, {}, enid: {}, {}, almc: Almc::from_bits_retain({}) }}",
            sf(),
            abs(),
            number(row, "enid"),
            abm(),
            number(&row["almc"], "raw")
        ),
        _ => {
            let busy = u64::from(row["busy"] == true) << 7;
            format!("Memory {{ adf: Adf::from_bits({}), edf: {} }}", number(row, "adf") | busy, number(row, "edf"))
        }
    }
}

/// The request that a row answers; address and data of EEPROM access are the row's own.
fn request(row: &Value) -> String {
    let byte = |key: &str| row[key].as_u64().unwrap_or(0);
    match text(row, "request_id") {
        "6" => format!("Request::WriteEeprom {{ adf: Adf::from_bits({}), edf: {} }}", byte("adf"), byte("edf")),
        "D" => format!("Request::ReadEeprom {{ adf: Adf::from_bits({}) }}", byte("adf")),
        _ => format!("Request::{}", variant(row)),
    }
}
