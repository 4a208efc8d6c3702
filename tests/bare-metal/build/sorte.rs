//! Tables from `ioex_master`, `ioex_master_negative`, `process_data_slice` and `sync0_fsm` of SORTE.

use serde_json::Value;

use super::{bytes, number, table, text};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let masters = rows("ioex_master");
    let stock = masters.iter().filter(|row| row["out_data"].is_string());
    [
        table("MASTERS: &[Master]", stock, |row| {
            format!(
                "Master {{ output: {}, time_stamp: {}, frame: {} }}",
                bytes(text(row, "out_data")),
                number(row, "tx_timestamp"),
                bytes(text(row, "frame"))
            )
        }),
        table("REFUSED: &[(&[u8], Option<ErrorClass>)]", &rows("ioex_master_negative"), |row| {
            let want = match text(row, "expect") {
                "Ok" => "None".to_owned(),
                "LengthMismatch" => "Some(ErrorClass::TooLong)".to_owned(),
                class => format!("Some(ErrorClass::{class})"),
            };
            format!("(&{}, {want})", bytes(text(row, "frame")))
        }),
        table("SLICES: &[([u8; 4], Option<u16>)]", &rows("process_data_slice"), |row| {
            let start = row["start_ns"].as_u64().map_or("None".to_owned(), |ns| format!("Some({ns})"));
            format!("({}, {start})", bytes(text(row, "slice")))
        }),
        table("RUNS: &[(Variant, &[Step])]", &rows("sync0_fsm"), |row| {
            let variant = if text(row, "variant") == "lossless" { "Lossless" } else { "Published" };
            format!(
                "(Variant::{variant}, &[{}])",
                row["steps"].as_array().into_iter().flatten().map(step).collect::<String>()
            )
        }),
    ]
    .concat()
}

fn step(row: &Value) -> String {
    let has = |event: &str| row["ev"].as_array().is_some_and(|events| events.iter().any(|e| e == event));
    let cmp7 = if has("CMP7") { format!("Some({})", number(row, "pto")) } else { "None".to_owned() };
    let writes: String = row["writes"].as_array().into_iter().flatten().map(write).collect();
    format!("Step {{ cmp6: {}, cmp0: {}, cmp7: {cmp7}, writes: &[{writes}] }},", has("CMP6"), has("CMP0"))
}

fn write(row: &Value) -> String {
    let register = match row[0].as_str() {
        Some("CMP_CFG") => "CmpCfg",
        Some("CMP1") => "Cmp1",
        Some("CMP6") => "Cmp6",
        Some("SYNC_START") => "SyncStart",
        Some("SYNC_CTRL") => "SyncCtrl",
        other => panic!("register {other:?}"),
    };
    format!("Write {{ register: Register::{register}, value: {} }},", row[1])
}
