//! The laws of time on a hostile line: single transactions and buses.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p nikon-aformat --test all hostile:: -- --nocapture` prints the mix.

use crate::common::exchanges::{Setup, Shown, bus, single};
use crate::common::line::{USUAL_EVENTS, events, first_seed, rates};
use crate::common::switches::{Switches, assert_all_drawn};
use nikon_aformat::BitRate;
use servowire_world::{Kind, Scenario};

/// Runs seeds until enough has happened.
fn seeds(run: impl Fn(&Setup, &mut Shown)) -> Shown {
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
    println!("{shown:?}");
    assert_all_drawn(&shown.mix);
    shown
}

#[test]
fn hostile_transactions() {
    seeds(|setup, shown| single(setup, 60, shown));
}

#[test]
fn hostile_buses() {
    let shown = seeds(|setup, shown| bus(setup, 30, shown));
    assert!(events() < USUAL_EVENTS || shown.tally.of(Kind::Flip) > 0);
}
