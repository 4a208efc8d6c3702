//! Random captures without a single option, under every condition of the table.
//!
//! A handful of captures each, so that it stays short; `cargo run --release -p servowire --example recognition-table`
//! draws as many as one likes.

use std::fmt::Write as _;

use crate::random::speech::Kind;
use crate::random::table::{CONDITIONS, row};

/// Captures a condition and protocol.
const CAPTURES: u32 = 6;

#[test]
fn random_captures_come_out_right() {
    let (mut right, mut all) = (0, 0);
    let mut faults = String::new();
    for condition in CONDITIONS {
        for kind in Kind::ALL {
            let row = row(condition, kind, 0, CAPTURES);
            right += row.right;
            all += row.captures;
            assert_eq!(row.wrong, 0, "{} {}: values that were never sent", condition.name, kind.name());
            for (seed, why, notes) in row.faults {
                writeln!(faults, "{} {}, seed {seed}: {why}\n{notes}", condition.name, kind.name()).unwrap();
            }
        }
    }
    assert!(100 * right >= 98 * all, "{right} of {all} are right\n{faults}");
}

/// A request for the position of encoder 0 has three edges after its first: many bit lengths fit them, and the nominal one is
/// the likeliest.
#[test]
fn a_first_request_of_few_edges() {
    let drawn = [
        ("4 to 6 samples a bit", 5014),
        ("4 to 6 samples a bit", 5086),
        ("ringing after 5 to 100 % of the edges", 5068),
        ("edges jitter by 10 % of a bit", 9028),
    ];
    for (name, number) in drawn {
        let condition = CONDITIONS.iter().find(|condition| condition.name == name).unwrap();
        let row = row(condition, Kind::Aformat, number, 1);
        assert_eq!(row.right, 1, "{name}: {:?}", row.faults);
    }
}
