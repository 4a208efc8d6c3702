//! Answers from bytes and from line bits in both orders, refused single flips, check fields.

use tformat::{
    Abm, Abs, Adf, AllData, Almc, BitOrder, ErrorClass, Frame, Identification, Memory, MultiTurn, Request, Response,
    SingleTurn, StatusField, Window, crc,
};

use super::{Tally, Topic, each};

/// A row of `responses.jsonl`.
pub(crate) struct Answer {
    name: &'static str,
    pub(crate) request: Request,
    pub(crate) bytes: &'static [u8],
    pub(crate) line: Window,
    pub(crate) want: Response,
}

/// A row of `responses.jsonl` that answers ID 3, as [`AllData`] takes it: UART bytes, line bits in either bit order.
pub(crate) struct FullForms {
    pub(crate) uart: [u8; AllData::FIELDS],
    pub(crate) lsb_first: [u8; Frame::MAX_LINE_BYTES],
    pub(crate) msb_first: [u8; Frame::MAX_LINE_BYTES],
}

/// A row of `negatives.jsonl` with one wrong bit.
pub(crate) struct Flip {
    name: &'static str,
    pub(crate) request: Request,
    pub(crate) line: Window,
    want: ErrorClass,
}

const fn window(bits: u128, len: u32) -> Window {
    match Window::from_bits(bits, len) {
        Some(window) => window,
        None => panic!("no frame is that long"),
    }
}

include!(concat!(env!("OUT_DIR"), "/tformat.rs"));

pub(crate) const TOPICS: &[Topic] = &[
    ("tformat/responses", answers),
    ("tformat/responses to ID 3 in three forms", full_forms),
    ("tformat/negatives, single flips", flips),
    ("tformat/crc", checks),
];

fn answers() -> Tally {
    each(
        ANSWERS,
        |row| row.name,
        |row| {
            let sent = row.want.emit();
            Response::parse(row.request, row.bytes) == Ok(row.want)
                && Response::parse_line(row.request, row.line) == Ok(row.want)
                && sent.as_bytes() == row.bytes
                && sent.line() == row.line
        },
    )
}

fn flips() -> Tally {
    each(
        FLIPS,
        |row| row.name,
        |row| Response::parse_line(row.request, row.line).map_err(tformat::Error::class) == Err(row.want),
    )
}

/// All forms of an answer give the same; its values are those of [`answers`].
fn full_forms() -> Tally {
    each(
        FULL_FORMS,
        |_| "of an answer to ID 3",
        |row| {
            let lines = [(BitOrder::LsbFirst, row.lsb_first), (BitOrder::MsbFirst, row.msb_first)];
            AllData::parse(&row.uart).is_ok_and(|full| {
                full.emit() == row.uart
                    && lines.iter().all(|(order, line)| {
                        AllData::parse_line(line, *order) == Ok(full) && full.emit_line(*order) == *line
                    })
            })
        },
    )
}

fn checks() -> Tally {
    each(CHECKS, |row| row.0, |row| crc(row.1) == row.2)
}
