//! Time from wrapping counters, against exact arithmetic of 128 bits.

use proptest::prelude::*;
use servowire_core::{ClockCheck, ClockError, MAX_TICK_NS, MIN_TICK_HZ, TickRate, TimeBase};

/// Rates of processors and timers, and some that divide nothing.
const RATES: [u32; 31] = [
    1_000_000,
    1_000_003,
    8_000_000,
    10_000_000,
    12_000_000,
    13_333_333,
    16_000_000,
    32_768_000,
    48_000_000,
    64_000_000,
    72_000_000,
    84_000_000,
    99_999_989,
    100_000_007,
    120_000_000,
    125_000_000,
    133_000_000,
    150_000_000,
    160_000_000,
    168_000_000,
    170_000_000,
    179_999_987,
    179_999_990,
    180_000_000,
    200_000_000,
    240_000_000,
    480_000_000,
    600_000_000,
    1_000_000_000,
    4_294_967_291,
    u32::MAX,
];

const YEAR_S: u128 = 31_557_600;

/// Whether `got_ns` is 1 ns and 1 ppb from the time of this many ticks at most; all of it in units of 1e-9 ns / hz.
fn is_true(got_ns: u64, ticks: u128, hz: u32) -> bool {
    let exact = ticks * 1_000_000_000;
    let got = u128::from(got_ns) * u128::from(hz);
    // 1 ns, and a thousand-millionth of the time rounded up.
    got.abs_diff(exact) <= u128::from(hz) + exact.div_ceil(1_000_000_000)
}

#[test]
fn a_century_at_every_rate() {
    for hz in RATES {
        let rate = TickRate::new(hz).unwrap();
        for seconds in [0, 1, 10, 60, 3_600, 86_400, YEAR_S, 10 * YEAR_S, 100 * YEAR_S] {
            for more in [0, 1, u128::from(hz / 3), u128::from(hz - 1)] {
                let ticks = seconds * u128::from(hz) + more;
                // 136 years of the fastest clock fill 64 bits.
                let ns = rate.ns(ticks.try_into().unwrap());
                assert!(is_true(ns, ticks, hz), "{ticks} ticks of {hz} Hz are not {ns} ns");
            }
        }
    }
}

#[test]
fn whole_nanoseconds_are_exact() {
    for (hz, tick_ns) in [(1_000_000, 1000), (8_000_000, 125), (200_000_000, 5), (1_000_000_000, 1)] {
        let rate = TickRate::new(hz).unwrap();
        for ticks in [1, 3, 0xffff_ffff, 0x1_0000_0001, 0x12_3456_789a_bcde] {
            assert_eq!(rate.ns(ticks), ticks * tick_ns, "{hz} Hz");
        }
    }
    // 15.625 and 6.25 ns, which a fraction of 32 bits holds.
    assert_eq!(TickRate::of::<64_000_000>().ns(64_000_000 * 31_557_600 + 8), 31_557_600_000_000_125);
    assert_eq!(TickRate::of::<160_000_000>().ns(160_000_000 * 31_557_600 + 4), 31_557_600_000_000_025);
}

#[test]
fn a_rate_that_is_too_low_is_refused_with_the_limit() {
    assert_eq!((MAX_TICK_NS, MIN_TICK_HZ), (1_000, 1_000_000));
    for hz in [0, 1, 32_768, 999_999] {
        let refused = TickRate::new(hz).unwrap_err();
        assert_eq!(refused, ClockError::TooCoarse { hz, limit_hz: 1_000_000 });
    }
    let text = TickRate::new(32_768).unwrap_err().to_string();
    assert_eq!(text, "a clock of 32768 Hz is too coarse, the limit is 1000000 Hz");
    assert_eq!(TickRate::new(1_000_000).unwrap().ns(7), 7_000);
}

#[test]
fn a_tick_may_be_given_as_a_ratio() {
    // 3 / 125 us are 24 ns.
    assert_eq!(TickRate::of_ratio::<3, 125_000_000>().ns(1_000_001), 24_000_024);
    assert_eq!(TickRate::of_ratio::<1, 170_000_000>(), TickRate::of::<170_000_000>());
    assert_eq!(TickRate::of_ratio::<4294, 4_294_967_295>().ns(4_294_967_295), 4_294_000_000_000);
}

/// Years of readings in steps just below half of the counter's range, and every step is as good as the first.
#[test]
fn a_year_of_readings_adds_no_error() {
    for hz in RATES {
        let mut time = TimeBase::<32>::new(TickRate::new(hz).unwrap(), 0x1234_5678);
        let (mut counter, mut ticks, mut last_ns) = (0x1234_5678_u32, 0_u128, 0);
        let steps = [0x7fff_ffff, 0x7abc_def1, 0x4000_0003, 0x7fff_fffe];
        for step in steps.into_iter().cycle() {
            counter = counter.wrapping_add(step);
            ticks += u128::from(step);
            let ns = time.now_ns(counter).unwrap();
            assert!(ns > last_ns && is_true(ns, ticks, hz), "{ticks} ticks of {hz} Hz are not {ns} ns");
            last_ns = ns;
            if ticks > YEAR_S * u128::from(hz) {
                break;
            }
        }
    }
}

/// All ways of a counter of 16 bits: half of them are forward.
#[test]
fn every_step_of_a_small_counter() {
    for hz in [1_000_000, 48_000_000, 170_000_000] {
        let rate = TickRate::new(hz).unwrap();
        for start in [0, 1, 0x7fff, 0x8000, 0xfffe, 0xffff_u32] {
            let time = TimeBase::<16>::new(rate, start);
            for step in 0..0x1_0000 {
                let mut time = time;
                // What is above the counter is not looked at.
                let reading = start.wrapping_add(step) & 0xffff | 0xabcd_0000;
                match time.now_ns(reading) {
                    Ok(ns) => assert!(step < 0x8000 && is_true(ns, step.into(), hz), "{step} ticks are not {ns} ns"),
                    Err(ClockError::Backwards { by_ns }) => {
                        assert!(step >= 0x8000 && is_true(by_ns, (0x1_0000 - step).into(), hz), "{step}: {by_ns} ns");
                    }
                    Err(other) => panic!("{other}"),
                }
            }
        }
    }
}

#[test]
fn a_counter_of_24_bits_that_counts_down() {
    // SysTick at 120 MHz: 25/3 ns a tick.
    let mut time = TimeBase::<24>::new(TickRate::of::<120_000_000>(), !0x00ff_ffff);
    assert_eq!(time.now_ns(!0x00ff_ffff), Ok(0));
    assert_eq!(time.now_ns(!0x00ff_fffb), Ok(33));
    assert_eq!(time.now_ns(!0x0080_0000), Ok(69_905_058)); // 8,388,607 ticks
    assert_eq!(time.now_ns(!2), Ok(139_810_108)); // 16,777,213
    assert_eq!(time.now_ns(!0x00ff_ffff), Ok(139_810_133)); // a whole turn, 16,777,216
}

/// A small counter wraps often, and after 2^32 ticks so does the word in which they are counted.
#[test]
fn a_small_counter_counts_on_for_ever() {
    fn run<const BITS: u32>(hz: u32) {
        let mut time = TimeBase::<BITS>::new(TickRate::new(hz).unwrap(), 77);
        let step = (1_u32 << (BITS - 1)) - 1;
        let (mut ticks, mut last_ns) = (0_u64, 0);
        while ticks < 3 << 32 {
            ticks += u64::from(step);
            let ns = time.now_ns((ticks as u32).wrapping_add(77)).unwrap();
            assert!(ns > last_ns && is_true(ns, ticks.into(), hz), "{BITS} bits: {ticks} ticks are not {ns} ns");
            last_ns = ns;
        }
    }
    run::<16>(170_000_000);
    run::<24>(120_000_000);
    run::<31>(1_000_003);
}

#[test]
fn the_time_between_two_readings() {
    let rate = TickRate::of::<170_000_000>();
    // 2^31 - 1, 2^23 - 1 and 2^15 - 1 ticks
    assert_eq!(TimeBase::<32>::new(rate, 5).read_within_ns(), 12_632_256_747);
    assert_eq!(TimeBase::<24>::new(rate, 5).read_within_ns(), 49_344_747);
    assert_eq!(TimeBase::<16>::new(rate, 5).read_within_ns(), 192_747);
}

#[test]
fn a_counter_that_was_set_back_is_an_error_once() {
    let mut time = TimeBase::<32>::new(TickRate::of::<200_000_000>(), 1_000);
    assert_eq!(time.now_ns(2_000), Ok(5_000));
    // Reset.
    assert_eq!(time.now_ns(0), Err(ClockError::Backwards { by_ns: 10_000 }));
    assert_eq!(time.now_ns(0), Ok(5_000));
    assert_eq!(time.now_ns(100), Ok(5_500));
    // Unread for half of its range and a tick: 2^31 - 1 ticks are missing to a turn.
    let refused = time.now_ns(100_u32.wrapping_add(0x8000_0001)).unwrap_err();
    assert_eq!(refused, ClockError::Backwards { by_ns: 10_737_418_235 });
    assert_eq!(refused.to_string(), "the clock went back by 10737418235 ns");
    assert_eq!(time.now_ns(100_u32.wrapping_add(0x8000_0003)), Ok(5_510));
}

#[test]
fn a_clock_that_stands_or_goes_back_is_noticed() {
    let mut check = ClockCheck::new(3);
    for ns in [0, 5, 5, 5, 5, 6, 6, 6, 6, 7] {
        assert_eq!(check.check(ns), Ok(ns));
    }
    assert_eq!([check.check(7), check.check(7), check.check(7)], [Ok(7); 3]);
    assert_eq!([check.check(7), check.check(7)], [Err(ClockError::Stopped); 2]);
    assert_eq!(check.check(8), Ok(8));
    assert_eq!((check.check(3), check.last_ns()), (Err(ClockError::Backwards { by_ns: 5 }), 3));
    assert_eq!([check.check(3), check.check(3), check.check(3)], [Ok(3); 3]);
    assert_eq!(check.check(3), Err(ClockError::Stopped));
    assert_eq!(check.check(u64::MAX), Ok(u64::MAX));
    // Set back to the very reading at which it stood: it has only just got there.
    let mut check = ClockCheck::new(1);
    assert_eq!([check.check(7), check.check(7), check.check(7)], [Ok(7), Ok(7), Err(ClockError::Stopped)]);
    assert_eq!([check.check(8), check.check(7)], [Ok(8), Err(ClockError::Backwards { by_ns: 1 })]);
    assert_eq!([check.check(7), check.check(7)], [Ok(7), Err(ClockError::Stopped)]);
}

proptest! {
    #[test]
    fn any_number_of_ticks_at_any_rate(hz in 1_000_000_u32.., ticks: u64) {
        // What 64 bits of ns hold at any rate.
        let ticks = ticks >> 10;
        let ns = TickRate::new(hz).unwrap().ns(ticks);
        prop_assert!(is_true(ns, ticks.into(), hz), "{} ns", ns);
    }

    #[test]
    fn any_readings_are_true_and_never_before_the_last(
        hz in prop_oneof![1_000_000_u32.., proptest::sample::select(&RATES[..])],
        start: u32,
        steps in prop::collection::vec(prop_oneof![0..200_u32, 0..0x7fff_u32, 0..0x7fff_ffff_u32], 1..200),
    ) {
        let rate = TickRate::new(hz).unwrap();
        let (mut long, mut short) = (TimeBase::<32>::new(rate, start), TimeBase::<16>::new(rate, start));
        let (mut ticks, mut short_ticks, mut last_ns, mut short_last_ns) = (0_u64, 0_u64, 0, 0);
        for step in steps {
            ticks += u64::from(step);
            let ns = long.now_ns(start.wrapping_add(ticks as u32)).unwrap();
            prop_assert!(ns >= last_ns && is_true(ns, ticks.into(), hz), "{} ns after {} ticks", ns, ticks);
            last_ns = ns;
            short_ticks += u64::from(step & 0x7fff);
            let ns = short.now_ns(start.wrapping_add(short_ticks as u32) & 0xffff).unwrap();
            prop_assert!(ns >= short_last_ns && is_true(ns, short_ticks.into(), hz), "{} ns of 16 bits", ns);
            short_last_ns = ns;
        }
    }

    /// Errors among the readings: time goes on, and never back.
    #[test]
    fn arbitrary_readings_never_take_time_back(hz in 1_000_000_u32.., readings: Vec<u32>) {
        let mut time = TimeBase::<32>::new(TickRate::new(hz).unwrap(), 0);
        let (mut last_ns, mut last) = (0, 0);
        for reading in readings {
            match time.now_ns(reading) {
                Ok(ns) => {
                    prop_assert!(reading.wrapping_sub(last) < 0x8000_0000 && ns >= last_ns);
                    last_ns = ns;
                }
                Err(error) => {
                    prop_assert!(reading.wrapping_sub(last) >= 0x8000_0000, "{}", error);
                    prop_assert_eq!(time.now_ns(reading), Ok(last_ns));
                }
            }
            last = reading;
        }
    }
}

/// A second at the most from look to look: what is more has jumped, once, and all else is as without a limit.
#[test]
fn a_clock_that_jumps_is_seen_where_looks_follow_each_other() {
    const MOST_NS: u64 = 1_000_000_000;
    let mut check = ClockCheck::new(1);
    let jumped = |by_ns| Err(ClockError::Ahead { by_ns });
    for (now_ns, want) in [
        (MOST_NS, Ok(MOST_NS)),
        (2 * MOST_NS + 1, jumped(MOST_NS + 1)),
        (2 * MOST_NS + 2, Ok(2 * MOST_NS + 2)),
        (5, Err(ClockError::Backwards { by_ns: 2 * MOST_NS - 3 })),
        (6, Ok(6)),
        (6, Ok(6)),
        (6, Err(ClockError::Stopped)),
        (u64::MAX / 2, jumped(u64::MAX / 2 - 6)),
        (0, Err(ClockError::Backwards { by_ns: u64::MAX / 2 })),
    ] {
        assert_eq!(check.check_within(now_ns, MOST_NS), want, "{now_ns}");
        assert_eq!(check.last_ns(), now_ns);
    }
}
