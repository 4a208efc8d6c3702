//! Receivers of a sampled line, on the hostile line.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test all hostile_line:: -- --nocapture` prints the mix.

use crate::common::exchanges::Setup;
use crate::common::line::{USUAL_EVENTS, events, first_seed};
use crate::common::sampled::{Shown, lost_frames, single_flips};
use crate::common::switches::Switches;
use nikon_aformat::BitRate;
use servowire_world::{Kind, Scenario};

/// Runs seeds until enough has happened.
fn seeds(kind: Kind, run: impl Fn(&Setup, &mut Shown)) -> Shown {
    let mut shown = Shown::default();
    for seed in first_seed().. {
        let setup = Setup {
            seed,
            rate: BitRate::ALL[seed as usize % 5],
            scenario: Scenario::quiet(),
            switches: Switches::draw(seed),
            quiet: false,
        };
        run(&setup, &mut shown);
        if shown.tally.events() > events() {
            break;
        }
    }
    println!("{shown:?}\n{}", shown.tally);
    assert!(
        shown.heard > 0 && shown.refused > 0 && shown.tally.of(kind) > 0,
        "the line was not hostile, or nothing but"
    );
    assert!(events() < USUAL_EVENTS || shown.tally.of(kind) > 100, "{:?}", shown.tally);
    shown
}

#[test]
fn hostile_bits() {
    seeds(Kind::Flip, |setup, shown| single_flips(setup, 200, shown));
}

#[test]
fn hostile_frames() {
    let shown = seeds(Kind::Drop, |setup, shown| lost_frames(setup, 40, shown));
    assert!(shown.owed > 0);
}
