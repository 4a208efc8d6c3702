//! HIPERFACE DSL.

mod bench;
mod code;
mod firmware;
mod frame;
mod message;
mod position;
mod registers;
mod startup;
mod sync;

use crate::row::{Check, Fault};
use hdsl::symbol::{Character, RunningDisparity, Word};
use serde::{Deserialize, Deserializer, de::Error};

pub(crate) const TOPICS: &[(&str, Check)] = &[
    ("8b10b_decode", code::decode),
    ("8b10b_encode", code::encode),
    ("8b10b_stream", code::stream),
    ("answer", frame::answer),
    ("answer_strict", frame::answer_strict),
    ("crc16", code::crc16),
    ("crc5", code::crc5),
    ("edges", frame::edges),
    ("ext_sync_seed", sync::ext_sync_seed),
    ("fast_position", position::fast_position),
    ("fast_position_wrap", position::fast_position_wrap),
    ("fw_link", firmware::fw_link),
    ("fw_messages", firmware::fw_messages),
    ("fw_startup", firmware::fw_startup),
    ("fw_sync", sync::fw_sync),
    ("learn", frame::learn),
    ("learn_leading", frame::learn_leading),
    ("link_sick", firmware::link_sick),
    ("long_message", message::long_message),
    ("master_header", frame::master_header),
    ("master_param", code::master_param),
    ("pipe_fifo", registers::pipe_fifo),
    ("quality_monitor", position::quality_monitor),
    ("register_ops", registers::register_ops),
    ("rssi", frame::rssi),
    ("sample_edge", frame::sample_edge),
    ("sampled_answer", frame::sampled_answer),
    ("short_message", message::short_message),
    ("sync_startup", sync::sync_startup),
    ("vframe", frame::vframe),
    ("vframe_strict", frame::vframe_strict),
];

/// Line bits as an integer, the first of them in bit 0.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Line {
    bits: u128,
    len: u32,
}

impl Line {
    fn new(bits: u128, len: u32) -> Self {
        Self { bits: bits & 1_u128.checked_shl(len).map_or(u128::MAX, |one| one - 1), len }
    }

    fn window(&self) -> hdsl::Window {
        hdsl::Window::from_bits(self.bits, self.len).unwrap_or(hdsl::Window::EMPTY)
    }

    fn word(&self) -> Word {
        Word::truncate(self.bits as u16)
    }
}

impl<'de> Deserialize<'de> for Line {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let bits = crate::hex::Bits::deserialize(from)?.0;
        let len = u32::try_from(bits.len()).ok().filter(|len| *len <= 128);
        let len = len.ok_or_else(|| D::Error::custom("more than 128 line bits"))?;
        Ok(Self::new(bits.iter().rev().fold(0, |line, bit| line << 1 | u128::from(*bit)), len))
    }
}

/// Running disparity as the rows write it, -1 or 1.
fn disparity(rd: i8) -> RunningDisparity {
    if rd < 0 { RunningDisparity::Minus } else { RunningDisparity::Plus }
}

fn sign(rd: RunningDisparity) -> i8 {
    match rd {
        RunningDisparity::Minus => -1,
        RunningDisparity::Plus => 1,
    }
}

/// A character as the rows write it: value and whether it is special.
type Pair = (crate::hex::Hex, bool);

fn character((byte, k): Pair) -> Result<Character, Fault> {
    Character::try_from((byte.0 as u8, k)).map_err(|_| Fault::Unreadable(format!("no special character {byte:?}")))
}

fn pair(character: Character) -> Pair {
    (crate::hex::Hex(u64::from(character.byte())), character.is_control())
}
