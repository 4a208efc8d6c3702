//! The laws of time on a hostile line: what cannot be undone, and what is read back.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test all hostile_procedures:: -- --nocapture` prints the mix.

use crate::common::exchanges::Setup;
use crate::common::line::{USUAL_EVENTS, events, first_seed, rates};
use crate::common::procedures::{
    Shown, addresses_by_id, addresses_by_wire, detections, eeprom_reads, writes, zero_presets,
};
use crate::common::switches::{Switches, assert_all_drawn};
use nikon_aformat::BitRate;
use servowire_world::Scenario;

/// Runs seeds until enough has happened; all of these ends have been seen then.
fn seeds(ends: &[&str], run: impl Fn(&Setup, &mut Shown)) {
    let mut shown = Shown::default();
    for seed in first_seed().. {
        let setup = Setup {
            seed,
            rate: BitRate::ALL[seed as usize % 5],
            scenario: Scenario::random(seed, rates(seed)),
            switches: Switches::draw(seed),
            quiet: seed % 4 == 0,
        };
        run(&setup, &mut shown);
        if shown.tally.events() > events() {
            break;
        }
    }
    println!("{:?}\n{:?}\n{}", shown.ends, shown.mix, shown.tally);
    assert_all_drawn(&shown.mix);
    for end in ends {
        assert!(events() < USUAL_EVENTS || shown.ends.contains_key(*end), "{end} never happened");
    }
}

#[test]
fn hostile_resets() {
    let ends = ["zero preset: done", "zero preset: not_done", "zero preset: effect_unknown", "noisy zero preset: done"];
    seeds(&ends, |setup, shown| zero_presets(setup, setup.seed % 8 >= 4, 6, shown));
}

#[test]
fn hostile_addresses() {
    let ends =
        ["address by wire: done", "address by wire: not_done", "address by ID: done", "address by ID: effect_unknown"];
    seeds(&ends, |setup, shown| {
        addresses_by_wire(setup, 4, shown);
        addresses_by_id(setup, 6, shown);
    });
}

#[test]
fn hostile_detection() {
    seeds(&["detection: done"], |setup, shown| detections(setup, 6, shown));
}

#[test]
fn hostile_eeprom_reads() {
    seeds(&["read: done"], |setup, shown| eeprom_reads(setup, 10, shown));
}

#[test]
fn hostile_writes() {
    let ends = ["write: done", "write: not_done", "write: effect_unknown", "id: done"];
    seeds(&ends, |setup, shown| writes(setup, 6, shown));
}
