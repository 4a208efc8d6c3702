//! Masters and encoders on the hostile line, with any faults at any places.

use nikon_aformat::BitRate;
use servowire_world::Scenario;

use crate::byte;

#[allow(dead_code, unreachable_pub, clippy::pedantic, reason = "what the tests share")]
#[path = "../../../nikon-aformat/tests/all/common/mod.rs"]
mod common;

use common::exchanges::{self, Setup};
use common::procedures;
use common::switches::Switches;

/// The laws of time hold, whatever happens on the line.
///
/// ```text
/// 0..2  switches of the encoders      2  rate and what is done (see the code)      3..11  host      11..  six bytes a fault
/// ```
pub fn hostile(mut data: &[u8]) {
    let number = u16::from_le_bytes([byte(&mut data), byte(&mut data)]);
    let what = byte(&mut data);
    let setup = Setup {
        seed: number.into(),
        rate: BitRate::ALL[usize::from(what >> 3) % BitRate::ALL.len()],
        scenario: Scenario::decode(data),
        switches: Switches::draw(number.into()),
        quiet: false,
    };
    let (mut exchanged, mut done) = (exchanges::Shown::default(), procedures::Shown::default());
    match what & 7 {
        0 => exchanges::single(&setup, 8, &mut exchanged),
        1 => exchanges::bus(&setup, 5, &mut exchanged),
        2 => procedures::zero_presets(&setup, number & 1 == 1, 2, &mut done),
        3 => procedures::addresses_by_wire(&setup, 2, &mut done),
        4 => procedures::addresses_by_id(&setup, 2, &mut done),
        5 => procedures::detections(&setup, 2, &mut done),
        6 => procedures::eeprom_reads(&setup, 3, &mut done),
        _ => procedures::writes(&setup, 2, &mut done),
    }
}
