//! RTEX blocks from logs of hex lines, tables and binary records.

mod blocks;
mod findings;
mod lines;
mod report;
mod shape;

use std::fmt::Write as _;

use rtex_block::{Command, ControlBits, MacId, Response, StatusFlags, UpdateCounter};

/// Commands and responses of a drive that moves on by 10 in every exchange.
fn exchanges() -> Vec<([u8; 16], [u8; 16])> {
    let mac_id = MacId::new(5).unwrap();
    let mut counter = UpdateCounter::ZERO;
    (0..6)
        .map(|k| {
            counter = counter.next();
            let control = if k < 2 { ControlBits::empty() } else { ControlBits::SERVO_ON };
            let command = Command { control, command_data1: 1_000 + 10 * k, ..Command::idle(mac_id, counter) };
            let response = Response {
                mac_id,
                update_counter_echo: counter,
                cmd_error: false,
                code: command.code(),
                status: StatusFlags::SERVO_READY,
                response_data1: 990 + 10 * k,
                response_data2: 20_000,
                response_data3: 0,
            };
            (command.emit(), response.emit())
        })
        .collect()
}

fn hex_log(exchanges: &[([u8; 16], [u8; 16])]) -> String {
    let mut text = "# command, response\n".to_owned();
    for (command, response) in exchanges {
        for block in [command, response] {
            writeln!(text, "{:032x}", u128::from_be_bytes(*block)).unwrap();
        }
    }
    text
}
