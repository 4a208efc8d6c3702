//! All 1024 words by the strict tables, CRC-16, acceleration of answers by the reduced rule.

use hdsl::symbol::Word;
use hdsl::{Answer, DeltaDelta, Rule, crc16};

use super::{Tally, Topic, each};

/// A row of `8b10b_decode.jsonl`.
pub(crate) struct Symbol {
    name: &'static str,
    pub(crate) word: u64,
    want: Option<(u8, bool)>,
}

/// A row of `answer.jsonl`.
pub(crate) struct Received {
    name: &'static str,
    pub(crate) bits: u64,
    dd: Option<i16>,
}

include!(concat!(env!("OUT_DIR"), "/hdsl.rs"));

pub(crate) const TOPICS: &[Topic] = &[("hdsl/8b10b_decode", words), ("hdsl/crc16", checks), ("hdsl/answer", answers)];

fn words() -> Tally {
    each(WORDS, |row| row.name, |row| Word::truncate(row.word as u16).decode().map(Into::into) == row.want)
}

fn checks() -> Tally {
    each(CHECKS, |_| "crc", |(bytes, crc)| crc16(bytes) == *crc)
}

fn answers() -> Tally {
    let acceleration = |bits| Answer::from_bits(Rule::Reduced, bits).delta_delta().ok();
    each(ANSWERS, |row| row.name, |row| acceleration(row.bits).map(DeltaDelta::get) == row.dd)
}
