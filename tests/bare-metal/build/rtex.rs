//! Tables from `responses16`, `commands16`, `master_check` and `servo_off` of RTEX.

use serde_json::Value;

use super::{bytes, number, table, text};

pub(crate) fn tables(rows: &dyn Fn(&str) -> Vec<Value>) -> String {
    let checks = rows("master_check");
    let short = checks.iter().filter(|row| number(row, "mode") == 16);
    [
        table("RESPONSES: &[Response16]", &rows("responses16"), response),
        table("COMMANDS: &[Command16]", &rows("commands16"), command),
        table("CHECKS: &[MasterCheck]", short, check),
        table("SERVO_OFF: &[ServoOffRow]", &rows("servo_off"), |row| {
            format!(
                "ServoOffRow {{ name: {:?}, before: {}, after: {}, effective: {} }}",
                text(row, "id"),
                bytes(text(row, "before")),
                bytes(text(row, "servo_off")),
                row["effective"]
            )
        }),
    ]
    .concat()
}

fn response(row: &Value) -> String {
    format!(
        "Response16 {{ name: {:?}, block: {}, mac_id: {}, counter: {}, cmd_error: {}, servo_active: {}, data1: {} }}",
        text(row, "id"),
        bytes(text(row, "hex")),
        number(row, "actual_mac_id"),
        number(row, "update_counter_echo"),
        number(row, "cmd_error") == 1,
        number(&row["status"], "servo_active") == 1,
        row["response_data1"]
    )
}

fn command(row: &Value) -> String {
    format!(
        "Command16 {{ name: {:?}, block: {}, mac_id: {}, servo_on: {}, data1: {} }}",
        text(row, "id"),
        bytes(text(row, "hex")),
        number(row, "mac_id"),
        number(&row["control"], "servo_on") == 1,
        row["command_data1"]
    )
}

fn check(row: &Value) -> String {
    format!(
        "MasterCheck {{ name: {:?}, block: &{}, mac_id: {}, counter: {}, code: 0x{}, class: {:?} }}",
        text(row, "id"),
        bytes(text(row, "hex")),
        number(row, "expected_mac_id"),
        number(row, "sent_counter"),
        text(row, "sent_code"),
        text(row, "class")
    )
}
