//! Receivers of a sampled line, on the hostile line.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test all hostile_line:: -- --nocapture` prints the mix.

use crate::common::exchanges::{Setup, seeds};
use crate::common::line::{USUAL_FAULTS, faults};
use crate::common::sampled::{Shown, lost_frames, single_flips};
use servowire_world::Kind;

/// Runs seeds until enough has happened.
fn hostile(kind: Kind, run: impl Fn(&Setup, &mut Shown)) -> Shown {
    let shown: Shown = seeds(Setup::still, |shown: &Shown| &shown.tally, run);
    println!("{shown:?}\n{}", shown.tally);
    assert!(
        shown.heard > 0 && shown.refused > 0 && shown.tally.of(kind) > 0,
        "the line was not hostile, or nothing but"
    );
    assert!(faults() < USUAL_FAULTS || shown.tally.of(kind) > 100, "{:?}", shown.tally);
    shown
}

#[test]
fn hostile_bits() {
    hostile(Kind::Flip, |setup, shown| single_flips(setup, 200, shown));
}

#[test]
fn hostile_frames() {
    let shown = hostile(Kind::Drop, |setup, shown| lost_frames(setup, 40, shown));
    assert!(shown.owed > 0);
}
