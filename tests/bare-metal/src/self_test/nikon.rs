//! Replies of all layouts from line bits and words, ABS40 in both bit orders, refused flips, request frames.

use nikon_aformat::{
    Abs40, BitOrder, Command, Crc, EncoderAddress, ErrorClass, Expected, Layout, RawResponse, RequestFrame, Response,
    Window,
};

use super::{Tally, Topic, each};

/// A row of `rx_responses.jsonl`.
pub(crate) struct Replied {
    name: &'static str,
    pub(crate) expected: Expected,
    pub(crate) line: Window,
    pub(crate) words: &'static [u16],
    ea: u8,
    abs: Option<u64>,
    crc: u8,
}

/// A row of `rx_responses.jsonl` of layout ABS40, its line bits in either bit order.
pub(crate) struct Whole {
    pub(crate) expected: Expected,
    pub(crate) lsb_first: [u8; Abs40::LINE_BYTES],
    pub(crate) msb_first: [u8; Abs40::LINE_BYTES],
    abs: u64,
}

/// A row of `rx_bitflips.jsonl` that is refused.
pub(crate) struct Flip {
    name: &'static str,
    pub(crate) expected: Expected,
    pub(crate) line: Window,
    want: ErrorClass,
}

const fn window(bits: u128, len: u32) -> Window {
    match Window::from_bits(bits, len) {
        Some(window) => window,
        None => panic!("no reply is that long"),
    }
}

const fn expected(layout: Layout, code: usize, ea: u8) -> Expected {
    let command = Command::ALL[code];
    let expected = Expected::new(layout, command);
    if command.answers_with_own_address() { expected.from_address(EncoderAddress::truncate(ea)) } else { expected }
}

include!(concat!(env!("OUT_DIR"), "/nikon.rs"));

/// ABS40 with its first start bit lost.
pub(crate) const LONG: Flip = Flip {
    name: "long",
    expected: expected(Layout::Abs40, 0, 2),
    line: window(0x12_3456_789a_bcde_f001 & ((1 << 72) - 1), 72),
    want: ErrorClass::StartBit,
};

pub(crate) const TOPICS: &[Topic] = &[
    ("nikon/rx_responses", replies),
    ("nikon/rx_responses of ABS40 in both orders", whole),
    ("nikon/rx_bitflips", flips),
    ("nikon/tx_cdf", sent),
];

fn replies() -> Tally {
    each(
        REPLIES,
        |row| row.name,
        |row| {
            let from_line = Response::parse_line(&row.expected, row.line);
            let reply = RawResponse::from_line(row.expected.layout(), row.line);
            from_line == Response::parse_words(&row.expected, row.words, BitOrder::MsbFirst)
                && from_line.is_ok_and(|response| response.abs() == row.abs && response.ea.get() == row.ea)
                && reply
                    .is_ok_and(|reply| reply.crc() == Crc { got: row.crc, want: row.crc } && reply.line() == row.line)
        },
    )
}

fn whole() -> Tally {
    each(
        WHOLE,
        |_| "ABS40",
        |row| {
            let lsb = Abs40::parse_line(&row.expected, &row.lsb_first, BitOrder::LsbFirst);
            lsb == Abs40::parse_line(&row.expected, &row.msb_first, BitOrder::MsbFirst)
                && lsb.is_ok_and(|reply| reply.abs.get() == row.abs)
        },
    )
}

fn flips() -> Tally {
    each(
        FLIPS,
        |row| row.name,
        |row| Response::parse_line(&row.expected, row.line).map_err(nikon_aformat::Error::class) == Err(row.want),
    )
}

fn sent() -> Tally {
    each(
        SENT,
        |row| row.0,
        |(_, line, word)| {
            let frame = RequestFrame::from_line(window(u128::from(*line), 18));
            frame.is_ok_and(|frame| {
                frame.transmit_word() == *word
                    && frame == RequestFrame::cdf(frame.frame_code(), frame.ea(), frame.code())
            })
        },
    )
}
