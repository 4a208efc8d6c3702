//! Master and encoder on the hostile line, with any faults at any places.

use servowire_world::Scenario;
use tformat::device::Config;
use tformat::master::{EEPROM_POLLING, EepromAccess, SingleTurnZero};
use tformat::{Address, BitRate, Error, Page, Request, Resolution};

use super::chosen;
use crate::byte;

#[allow(dead_code, unreachable_pub, clippy::pedantic, reason = "the bench of the tests; not all of it is used")]
#[path = "../../../tformat/tests/bench/mod.rs"]
mod bench;

use bench::Bench;

/// The laws of time hold, whatever happens on the line.
///
/// ```text
/// 0..2  switches of the encoder      2  rate (bit 0), echo hint (bit 1), procedure (bits 2, 3)      3..6  request
/// 6..14  host      14..  six bytes a fault
/// ```
pub fn hostile(mut data: &[u8]) {
    let number = u16::from_le_bytes([byte(&mut data), byte(&mut data)]);
    let options = byte(&mut data);
    let request = chosen(&mut data);
    let rate = BitRate::ALL[usize::from(options & 1)];
    let config = Config::numbered(number % Config::NUMBERED);
    let mut bench = Bench::new(Scenario::decode(data), rate, config, options & 2 != 0);
    match options >> 2 & 3 {
        0 | 1 => {
            for k in 0..6 {
                let at_ns = bench.ready_ns;
                let _ = bench.exchange(if k % 2 == 0 { request } else { Request::ReadSingleTurn }, at_ns);
            }
        }
        2 => {
            bench.moves = false;
            bench.device.set_position(tformat::Abs::truncate(0x1000), tformat::Abm::truncate(3));
            let resolution = Resolution::new(23, 16).expect("possible widths");
            let mut zero = SingleTurnZero::set_and_shift_commutation_angle(resolution, 10);
            let step = zero.start(bench.ready_ns);
            let end = bench.run(step, |outcome, ready_ns| zero.receive(outcome, ready_ns));
            if bench.forged_requests == 0 && bench.seen.forged + bench.seen.undetected == 0 {
                assert!(bench.device.effects() <= 1);
                if let Err(Error::NotDone { .. }) = end {
                    assert_eq!(bench.device.effects(), 0);
                }
            }
        }
        _ => {
            let (page, address) = (Page::truncate(options >> 4), Address::truncate(number.to_le_bytes()[0]));
            let mut access = EepromAccess::write(Some(page), address, 0x5a, EEPROM_POLLING);
            let step = access.start(bench.ready_ns);
            let _ = bench.run(step, |outcome, ready_ns| access.receive(outcome, ready_ns));
        }
    }
}
