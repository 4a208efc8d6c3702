//! The laws of time on a hostile line: what cannot be undone, and what is read back.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test all hostile_procedures:: -- --nocapture` prints the mix.

use crate::common::exchanges::{Setup, seeds};
use crate::common::line::{USUAL_FAULTS, faults};
use crate::common::procedures::{
    Shown, addresses_by_id, addresses_by_wire, detections, eeprom_reads, writes, zero_presets,
};
use crate::common::switches::assert_all_drawn;

/// Runs seeds until enough has happened; all of these ends have been seen then.
fn hostile(ends: &[&str], run: impl Fn(&Setup, &mut Shown)) {
    let shown: Shown = seeds(Setup::hostile, |shown: &Shown| &shown.tally, run);
    println!("{:?}\n{:?}\n{}", shown.ends, shown.mix, shown.tally);
    assert_all_drawn(&shown.mix);
    for end in ends {
        assert!(faults() < USUAL_FAULTS || shown.ends.contains_key(*end), "{end} never happened");
    }
}

#[test]
fn hostile_resets() {
    let ends = ["zero preset: done", "zero preset: not_done", "zero preset: effect_unknown", "noisy zero preset: done"];
    hostile(&ends, |setup, shown| zero_presets(setup, setup.seed % 8 >= 4, 6, shown));
}

#[test]
fn hostile_addresses() {
    let ends =
        ["address by wire: done", "address by wire: not_done", "address by ID: done", "address by ID: effect_unknown"];
    hostile(&ends, |setup, shown| {
        addresses_by_wire(setup, 4, shown);
        addresses_by_id(setup, 6, shown);
    });
}

#[test]
fn hostile_detection() {
    hostile(&["detection: done"], |setup, shown| detections(setup, 6, shown));
}

#[test]
fn hostile_eeprom_reads() {
    hostile(&["read: done"], |setup, shown| eeprom_reads(setup, 10, shown));
}

#[test]
fn hostile_writes() {
    let ends = ["write: done", "write: not_done", "write: effect_unknown", "id: done"];
    hostile(&ends, |setup, shown| writes(setup, 6, shown));
}
