//! Blocks both ways, what a master finds in them, and servo-off.

use rtex_block::master::{Acknowledgement, Checked, Expected, ServoOff};
use rtex_block::{
    BlockSize, Code, Command, CommandBlock, ControlBits, Error, MacId, Response, StatusFlags, UpdateCounter,
};

use super::{Tally, Topic, each};

/// A row of `responses16.jsonl`.
pub(crate) struct Response16 {
    name: &'static str,
    pub(crate) block: [u8; 16],
    mac_id: u8,
    counter: u8,
    cmd_error: bool,
    servo_active: bool,
    data1: i32,
}

/// A row of `commands16.jsonl`.
pub(crate) struct Command16 {
    name: &'static str,
    pub(crate) block: [u8; 16],
    mac_id: u8,
    servo_on: bool,
    data1: i32,
}

/// A row of `master_check.jsonl` for 16-byte blocks.
pub(crate) struct MasterCheck {
    name: &'static str,
    pub(crate) block: &'static [u8],
    mac_id: u8,
    counter: u8,
    code: u8,
    class: &'static str,
}

/// A row of `servo_off.jsonl`.
pub(crate) struct ServoOffRow {
    name: &'static str,
    before: [u8; 16],
    after: [u8; 16],
    effective: bool,
}

include!(concat!(env!("OUT_DIR"), "/rtex.rs"));

pub(crate) const TOPICS: &[Topic] = &[
    ("rtex/responses16", responses),
    ("rtex/commands16", commands),
    ("rtex/master_check, 16 bytes", checks),
    ("rtex/servo_off", servo_off),
];

impl MasterCheck {
    pub(crate) fn expected(&self) -> Option<Expected> {
        Some(Expected {
            size: BlockSize::Bytes16,
            mac_id: MacId::new(self.mac_id)?,
            update_counter: UpdateCounter::new(self.counter)?,
            code: Code::new(self.code)?,
        })
    }
}

fn responses() -> Tally {
    each(
        RESPONSES,
        |row| row.name,
        |row| {
            Response::parse_strict(&row.block).is_ok_and(|response| {
                response.emit() == row.block
                    && response.mac_id.get() == row.mac_id
                    && response.update_counter_echo.get() == row.counter
                    && response.cmd_error == row.cmd_error
                    && response.status.contains(StatusFlags::SERVO_ACTIVE) == row.servo_active
                    && response.response_data1 == row.data1
                    && response.with_noncyclic(&response.noncyclic()) == response
            })
        },
    )
}

fn commands() -> Tally {
    each(
        COMMANDS,
        |row| row.name,
        |row| {
            Command::parse_strict(&row.block).is_ok_and(|command| {
                command.emit() == row.block
                    && command.mac_id.get() == row.mac_id
                    && command.control.contains(ControlBits::SERVO_ON) == row.servo_on
                    && command.command_data1 == row.data1
            })
        },
    )
}

fn checks() -> Tally {
    each(
        CHECKS,
        |row| row.name,
        |row| {
            let class = match row.expected().map(|expected| expected.check(row.block)) {
                Some(Err(Error::Truncated { .. } | Error::TooLong { .. })) => "wrong_length",
                Some(Err(Error::Direction { .. })) => "not_a_response",
                Some(Err(Error::MacId { .. })) => "mac_id_mismatch",
                Some(Ok(Checked { acknowledgement: Acknowledgement::CounterNotEchoed, .. })) => "counter_not_echoed",
                Some(Ok(Checked { acknowledgement: Acknowledgement::CodeNotYetEchoed, .. })) => "code_not_yet_echoed",
                Some(Ok(Checked { acknowledgement: Acknowledgement::CommandError(_), .. })) => "command_error",
                Some(Ok(Checked { acknowledgement: Acknowledgement::Accepted, .. })) => "ok",
                _ => "",
            };
            class == row.class
        },
    )
}

fn servo_off() -> Tally {
    each(
        SERVO_OFF,
        |row| row.name,
        |row| {
            let made = Command::parse(&row.before).ok().and_then(|before| ServoOff::after(&before));
            let is_off = CommandBlock::of(&row.after).is_ok_and(CommandBlock::is_servo_off);
            is_off == row.effective && made.is_some_and(|off| (off.emit() == row.after) == row.effective)
        },
    )
}
