//! 8b/10b, the checks, and the parameter byte of the master.

use hdsl::symbol::{Character, DisparityCheck, DisparityStatus, Encoded, Rule, RunningDisparity, Word};
use hdsl::{CRC_16, DeltaDelta, EncodedParameter, LineDisparity, ParameterByte, RunningCrc16};
use serde::Deserialize;

use super::{Line, Pair, disparity, pair, sign};
use crate::hex::{Bytes, Hex};
use crate::row::{Row, Verdict, each, same};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Encode {
    byte: Hex,
    k: bool,
    rd_in: i8,
    code: Line,
    rd_out: i8,
}

pub(super) fn encode(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Encode| {
        let character = Character::try_from((row.byte.0 as u8, row.k));
        same("character exists", &true, &character.is_ok())?;
        let got = character.map(|c| c.encode(disparity(row.rd_in)));
        let want = Encoded { word: row.code.word(), disparity: disparity(row.rd_out) };
        same("code and rd_out", &Ok(want), &got)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Decode {
    code: Line,
    valid: bool,
    byte: Option<Hex>,
    k: Option<bool>,
    rd_in: Vec<i8>,
    disparity: i8,
    reduced: Reduced,
}

#[derive(Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Reduced {
    byte: Hex,
    byte_error: bool,
    special: bool,
    secondary_byte: Hex,
}

pub(super) fn decode(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Decode| {
        let word = row.code.word();
        same("valid", &row.valid, &word.decode().is_some())?;
        same("byte, k", &row.byte.zip(row.k), &word.decode().map(pair))?;
        same("strict reading", &row.valid, &word.read(Rule::Strict).byte().is_ok())?;
        let columns = [RunningDisparity::Minus, RunningDisparity::Plus];
        let rd_in: Vec<i8> = columns.into_iter().filter(|rd| word.is_in(*rd)).map(sign).collect();
        same("rd_in", &row.rd_in, &rd_in)?;
        same("disparity", &row.disparity, &word.disparity())?;
        let reading = word.read(Rule::Reduced);
        // The word alone in the secondary channel of an answer.
        let secondary = hdsl::Answer::from_bits(Rule::Reduced, u64::from(word.get()) << 51).secondary();
        let reduced = Reduced {
            byte: Hex(reading.raw().into()),
            byte_error: reading.is_byte_error(),
            special: reading.is_special(),
            secondary_byte: Hex(secondary.raw().into()),
        };
        same("reduced", &row.reduced, &reduced)
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Stream {
    rd_in: i8,
    sent: Vec<Pair>,
    flips: Vec<usize>,
    codes: Vec<Line>,
    status: Vec<String>,
    decoded: Vec<Option<Pair>>,
    rd_out: i8,
}

pub(super) fn stream(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Stream| {
        let mut rd = disparity(row.rd_in);
        let mut words = Vec::new();
        for sent in &row.sent {
            let coded = super::character(*sent)?.encode(rd);
            words.push(coded.word.get());
            rd = coded.disparity;
        }
        for flip in &row.flips {
            if let Some(word) = words.get_mut(flip / 10) {
                *word ^= 1 << (flip % 10);
            }
        }
        let words: Vec<_> = words.into_iter().filter_map(Word::new).collect();
        same("codes", &row.codes.iter().map(Line::word).collect(), &words)?;
        same("decoded", &row.decoded, &words.iter().map(|w| w.decode().map(pair)).collect())?;
        let mut check = DisparityCheck::new(disparity(row.rd_in));
        let name = |status| match status {
            DisparityStatus::Ok => "ok",
            DisparityStatus::Disparity => "disparity",
            DisparityStatus::Invalid => "invalid",
        };
        let status: Vec<_> = words.iter().map(|w| name(check.step(*w)).to_owned()).collect();
        same("status", &row.status, &status)?;
        same("rd_out", &row.rd_out, &sign(check.disparity()))
    })
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Crc16 {
    Check { data: Bytes, crc: Hex },
    Crc { data: Bytes, crc: Hex },
    Frame { frame: Bytes, ok: bool, flip: Option<usize> },
}

pub(super) fn crc16(rows: &[Row]) -> Vec<Verdict> {
    let running = |bytes: &[u8]| {
        let mut crc = RunningCrc16::new();
        for byte in bytes {
            crc.update(*byte);
        }
        crc
    };
    each(rows, |row: Crc16| match row {
        Crc16::Check { data, crc } => {
            same("algorithm", &crc, &Hex(CRC_16.check.into()))?;
            same("crc", &crc, &Hex(hdsl::crc16(&data.0).into()))
        }
        Crc16::Crc { data, crc } => {
            same("crc", &crc, &Hex(hdsl::crc16(&data.0).into()))?;
            same("running crc", &crc, &Hex(running(&data.0).finish().into()))
        }
        Crc16::Frame { frame, ok, flip } => {
            same("ok", &ok, &running(&frame.0).is_residue())?;
            let mut sent = frame.0;
            if let Some(flip) = flip {
                // Counted from the most significant bit of the first byte.
                if let Some(byte) = sent.get_mut(flip / 8) {
                    *byte ^= 0x80 >> (flip % 8);
                }
            }
            same("ok before the flip", &true, &running(&sent).is_residue())
        }
    })
}

#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
enum Crc5 {
    Word { dd: i16, word: Hex },
    Bad { word: Hex, ok: bool, flip: Option<u32>, flips: Option<Vec<u32>> },
}

pub(super) fn crc5(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: Crc5| match row {
        Crc5::Word { dd, word } => {
            let value = DeltaDelta::new(dd);
            same("word", &Some(word.0 as u16), &value.map(DeltaDelta::to_word))?;
            same("dd", &value, &DeltaDelta::from_word(word.0 as u16).ok())
        }
        Crc5::Bad { word, ok, flip, flips } => {
            same("ok", &ok, &DeltaDelta::from_word(word.0 as u16).is_ok())?;
            let flips: Vec<u32> = flip.into_iter().chain(flips.unwrap_or_default()).collect();
            if flips.is_empty() {
                return Ok(());
            }
            let sent = flips.iter().fold(word.0 as u16, |w, flip| w ^ 0x8000 >> flip);
            same("ok before the flips", &true, &DeltaDelta::from_word(sent).is_ok())
        }
    })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MasterParam {
    param: Hex,
    d_in: i8,
    code: Line,
    d_out: i8,
}

pub(super) fn master_param(rows: &[Row]) -> Vec<Verdict> {
    each(rows, |row: MasterParam| {
        let byte = ParameterByte::new(row.param.0 as u8);
        let got = LineDisparity::new(row.d_in).encode(byte);
        let want = EncodedParameter { word: row.code.word(), disparity: LineDisparity::new(row.d_out) };
        same("code and d_out", &want, &got)?;
        same("decoded", &Some(byte), &ParameterByte::decode(row.code.word()))
    })
}
