//! The cable of these tests does what it is asked to do.

use hdsl::Window;
use hdsl::device::Transmission;
use hdsl::sampling::{Alignment, EdgeRule, TEST_PATTERN, WINDOW, line};
use proptest::prelude::*;

use crate::cable::{Cable, Disturbance};

proptest! {
    #[test]
    fn a_clean_line_only_delays(bits in 0..1_u64 << 61, delay in 0..88_u32) {
        let mut simulated = Cable::new(Disturbance::default().with_delay(delay), 1);
        prop_assert_eq!(simulated.up(Some(Transmission { bits })), line(bits, delay));
        prop_assert_eq!(simulated.up(None), [0xff; WINDOW]);
    }

    /// Jitter of one sample never makes a bit error, wherever the receiver learned to sample.
    #[test]
    fn one_sample_of_jitter(bits in 0..1_u64 << 61, delay in 0..84_u32, seed: u64) {
        let mut simulated = Cable::new(Disturbance::default().with_delay(delay).with_jitter(1), seed);
        let learned = Alignment::learn(EdgeRule::Leading, &simulated.up(Some(Transmission { bits: TEST_PATTERN })));
        prop_assert_eq!(learned.unwrap().bits(&simulated.up(Some(Transmission { bits }))), Ok(bits));
    }

    /// An encoder whose clock is 2000 ppm off is still read.
    #[test]
    fn clock_offset(bits in 0..1_u64 << 61, ppm in -2000..2000, seed: u64) {
        let mut simulated = Cable::new(Disturbance::default().with_delay(20).with_clock_ppm(ppm).with_jitter(1), seed);
        let learned = Alignment::learn(EdgeRule::Leading, &simulated.up(Some(Transmission { bits: TEST_PATTERN })));
        prop_assert_eq!(learned.unwrap().bits(&simulated.up(Some(Transmission { bits }))), Ok(bits));
    }
}

#[test]
fn rates_are_as_asked_for() {
    let mut simulated = Cable::new(Disturbance::default().with_bit_errors(10_000), 7);
    // One of a hundred of 61 bits.
    let rounds = if cfg!(miri) { 100 } else { 2000 };
    let zeros = Window::from_bits(0, 61).unwrap();
    let wrong: u32 = (0..rounds).map(|_| simulated.down(zeros).bits().count_ones()).sum();
    assert!((rounds * 61 / 125..rounds * 61 / 80).contains(&wrong), "{wrong}");
    // 5 ns a metre each way are 37.5 samples for 100 m.
    assert_eq!((Disturbance::metres(100).delay, Disturbance::metres(100).down_delay), (82, 37));
}
