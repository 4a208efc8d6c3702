//! Tables from `rx_responses`, `rx_bitflips` and `tx_cdf` of A-format.

use serde_json::Value;

use super::{line, line_bytes, number, pascal, table, text, window};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let replies = rows("rx_responses");
    let whole = replies.iter().filter(|row| row["layout"] == "ABS40");
    let flips = rows("rx_bitflips");
    let refused = flips.iter().filter(|row| row["expect"]["error"].is_string());
    [
        table("REPLIES: &[Replied]", &replies, reply),
        table("WHOLE: &[Whole]", whole, forms),
        table("FLIPS: &[Flip]", refused, flip),
        table("SENT: &[(&str, u64, u32)]", &rows("tx_cdf"), |row| {
            format!("({:?}, {}, 0x{})", text(row, "name"), line(text(row, "wire")), text(row, "ti_word32"))
        }),
    ]
    .concat()
}

fn reply(row: &Value) -> String {
    let words: String = row["words"]
        .as_array()
        .into_iter()
        .flatten()
        .map(|word| word.as_str().unwrap_or(""))
        .fold(String::new(), |all, word| all + "0x" + word + ",");
    format!(
        "Replied {{ name: {:?}, expected: {}, line: {}, words: &[{words}], ea: {}, abs: {:?}, crc: {} }}",
        text(row, "name"),
        expected(row),
        window(text(row, "wire")),
        number(&row["expect"], "ea"),
        row["expect"]["abs"].as_u64(),
        number(&row["expect"], "crc")
    )
}

fn forms(row: &Value) -> String {
    let bits = text(row, "wire");
    format!(
        "Whole {{ expected: {}, lsb_first: {}, msb_first: {}, abs: {} }}",
        expected(row),
        line_bytes(bits, line),
        line_bytes(bits, |byte| format!("0b{byte}")),
        number(&row["expect"], "abs")
    )
}

fn flip(row: &Value) -> String {
    format!(
        "Flip {{ name: {:?}, expected: {}, line: {}, want: ErrorClass::{} }}",
        text(row, "case"),
        expected(row),
        window(text(row, "wire")),
        pascal(text(&row["expect"], "error"))
    )
}

/// What the reply of a row has to be.
fn expected(row: &Value) -> String {
    let layout = match text(row, "layout") {
        "ABS24H" => "Abs24High".to_owned(),
        "EEPROM_BANK" => "EepromBank".to_owned(),
        "TEMP" => "Temperature".to_owned(),
        "VELCOEF" => "Coefficient".to_owned(),
        "ABS24_ALM" => "Abs24Status".to_owned(),
        name => pascal(&name.to_lowercase()),
    };
    format!("expected(Layout::{layout}, {}, {})", number(row, "cmd"), number(row, "request_ea"))
}
