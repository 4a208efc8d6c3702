//! The example `noisy_bus`, shorter: nothing wrong is accepted beyond what an 8-bit check cannot see.

#[expect(dead_code, reason = "the example's own main")]
#[path = "../../examples/noisy_bus.rs"]
mod example;

use example::run;

#[test]
fn without_noise_everything_arrives() {
    let tally = run(2_000, 0, 7);
    assert_eq!((tally.sent, tally.good, tally.lost), (16_000, 16_000, 0));
}

/// Two wrong bits in a thousand: one response in eight is hit.
#[test]
fn through_noise_only_the_unseen_pass() {
    let tally = run(30_000, 2_000, 1);
    assert!(tally.lost > tally.sent / 20 && tally.good > tally.sent / 2, "{tally:?}");
    // Expected are 41 664 triples of bits x (2e-3)^3 x 0.48 % = 1.6e-6 a response, so 0.4 here.
    assert!(tally.unseen_by_crc <= 5, "{tally:?}");
    assert!(tally.fewest_bits.is_none_or(|bits| bits >= 3), "{tally:?}");
    assert_eq!(tally.slipped, 0, "{tally:?}");
}
