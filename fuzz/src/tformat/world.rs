//! Master and encoder on the hostile line, with any faults at any places.

use servowire_world::Scenario;
use tformat::device::Behaviour;
use tformat::master::{EEPROM_POLLING, EepromAccess, MultiTurnZero, SingleTurnZero};
use tformat::{Abm, Abs, Address, BitRate, Error, Page, Request, Resolution};

use super::chosen;
use crate::byte;

#[allow(dead_code, unreachable_pub, clippy::pedantic, reason = "the bench of the tests; not all of it is used")]
#[path = "../../../tformat/tests/all/bench/mod.rs"]
mod bench;

use bench::Bench;

/// The laws of time hold, whatever happens on the line.
///
/// ```text
/// 0..2  switches of the encoder      2  rate (bit 0), echo hint (bit 1), procedure (bits 2, 3), page or trembling (bits 4...)
/// 3..6  request
/// 6..14  host                        14..  six bytes a fault
/// ```
pub fn hostile(mut data: &[u8]) {
    let number = u16::from_le_bytes([byte(&mut data), byte(&mut data)]);
    let options = byte(&mut data);
    let request = chosen(&mut data);
    let rate = BitRate::ALL[usize::from(options & 1)];
    let behaviour = Behaviour::numbered(number % Behaviour::NUMBERED);
    let mut bench = Bench::new(Scenario::decode(data), rate, behaviour, options & 2 != 0);
    match options >> 2 & 3 {
        0 => {
            for k in 0..6 {
                let at_ns = bench.ready_ns;
                let _ = bench.exchange(if k % 2 == 0 { request } else { Request::ReadSingleTurn }, at_ns);
            }
        }
        1 => {
            bench.moves = false;
            bench.trembles = options & 16 != 0;
            bench.device.set_position(Abs::truncate(0), Abm::truncate(0x300));
            let mut zero = MultiTurnZero::set_and_lose_multi_turn_reference(widths(), 1);
            let end = bench.run(&mut zero);
            once(&bench, end.err());
        }
        2 => {
            bench.moves = false;
            bench.device.set_position(Abs::truncate(0x1000), Abm::truncate(3));
            let mut zero = SingleTurnZero::set_and_shift_commutation_angle(widths(), 10);
            let end = bench.run(&mut zero);
            once(&bench, end.err());
        }
        _ => {
            let (page, address) = (Page::truncate(options >> 4), Address::truncate(number.to_le_bytes()[0]));
            let mut access = EepromAccess::write(page, address, 0x5a, EEPROM_POLLING);
            let _ = bench.run(&mut access);
        }
    }
}

fn widths() -> Resolution {
    Resolution::new(23, 16).expect("possible widths")
}

/// A reset that is read back is done once if it says so, at most once if it does not know, and otherwise not at all: unless
/// the encoder was asked by somebody else, or two readings were wrong ones.
fn once(bench: &Bench, error: Option<Error>) {
    if bench.forged_requests > 0 || bench.misread > 1 {
        return;
    }
    let effects = bench.device.effects();
    match error {
        None => assert_eq!(effects, 1),
        Some(Error::EffectUnknown { .. }) => assert!(effects <= 1),
        Some(error) => assert_eq!(effects, 0, "{error}"),
    }
}
