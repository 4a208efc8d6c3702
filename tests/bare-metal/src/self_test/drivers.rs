//! The drivers over a transport: an answer becomes a position, a damaged one does not, and silence ends.

use nikon_aformat::{EncoderAddress, Resolution as Widths};
use servowire_drivers::{Automatic, Error};
use servowire_drivers::{nikon, tformat::blocking::Driver};
use tformat::master::Line;
use tformat::{BitRate, Resolution};

use super::{Tally, Topic, each};
use crate::transport::{Port, Steps, Uart};

/// All data (ID 3): ABS 0x3bc029, turns 3, no alarms.
pub(crate) const ALL_DATA: &[u8] = &[0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x03, 0x00, 0x00, 0x00, 0xdc];
/// The same with a bit turned round.
const DAMAGED: &[u8] = &[0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x03, 0x00, 0x00, 0x01, 0xdc];
/// The whole position (command 0) of encoder 1: row 0 of `rx_responses.jsonl`, 24 bits a turn.
pub(crate) const ABS40: &[u16] =
    &[0x3000_u16.reverse_bits(), 0x14cb_u16.reverse_bits(), 0x6d00_u16.reverse_bits(), 0x00df_u16.reverse_bits()];
/// The same with another check.
const DAMAGED40: &[u16] =
    &[0x3000_u16.reverse_bits(), 0x14cb_u16.reverse_bits(), 0x6d00_u16.reverse_bits(), 0x00de_u16.reverse_bits()];

/// What an answer becomes: ABS, whether it is refused, or nothing.
type Row = (&'static str, &'static [u8], Option<u32>);
const TFORMAT: [Row; 3] = [("good", ALL_DATA, Some(0x3b_c029)), ("damaged", DAMAGED, None), ("silent", &[], None)];
type Row40 = (&'static str, &'static [u16], Option<u32>);
const NIKON: [Row40; 3] = [("good", ABS40, Some(11_981_608)), ("damaged", DAMAGED40, None), ("silent", &[], None)];

pub(crate) const TOPICS: &[Topic] = &[("drivers/tformat", tformat), ("drivers/nikon", nikon)];

pub(crate) const LINE: Line = Line::new(BitRate::Mbit2_5);

/// A-format at 2.5 Mbit/s: the first frame of an answer ends some frames after the request, a frame with each look.
pub(crate) const SLOW: nikon_aformat::master::Line =
    nikon_aformat::master::Line::new(nikon_aformat::BitRate::Mbit2_5).with_response_timeout_ns(30_000);

pub(crate) const RESOLUTION: Resolution = match Resolution::new(23, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!("possible widths"),
};

pub(crate) const WIDTHS: Widths = match Widths::new(24, 0) {
    Ok(widths) => widths,
    Err(_) => panic!("possible widths"),
};

fn tformat() -> Tally {
    each(
        &TFORMAT,
        |row| row.0,
        |(_, answer, want)| {
            let Ok(mut encoder) = Driver::new(Uart::new(answer), Automatic, Steps::new(4_000), LINE) else {
                return false;
            };
            match encoder.read_position(RESOLUTION, tformat::Policy::new(1_000_000)) {
                Ok(sample) => Some(sample.single_turn()) == *want && sample.turns() == Some(3),
                Err(Error::Protocol(_)) => want.is_none(),
                Err(_) => false,
            }
        },
    )
}

fn nikon() -> Tally {
    each(
        &NIKON,
        |row| row.0,
        |(_, answer, want)| {
            let mut master = nikon::blocking::Driver::new(Port::new(answer), Steps::new(7_200), WIDTHS, SLOW);
            match master.read_position(EncoderAddress::truncate(1), nikon_aformat::Policy::new(1_000_000)) {
                Ok(sample) => Some(sample.single_turn()) == *want,
                Err(Error::Protocol(_)) => want.is_none(),
                Err(_) => false,
            }
        },
    )
}
