use super::*;
use proptest::prelude::*;

/// Eighths from the edge of one frame to that of the next.
fn distance(before: Extra, next: Next) -> i64 {
    let rest = i64::from(before.bits()) * 8 - i64::from(before.get());
    rest + 864 + 48 * i64::from(next.stuffing.get()) + i64::from(next.extra.get())
}

proptest! {
    /// 48 N + W is constant, the edge stays in range and comes after a constant time, limiter or not.
    #[test]
    fn invariants(edge in 25..=72_u8, n in 1..26_u8, window in 25..=72_i16, adjust in prop::collection::vec(-2..=2_i16, 60)) {
        let mut state = ExtraWindow::new(Extra::new(edge).unwrap(), Stuffing::new(n).unwrap(), window);
        let sum = 48 * i64::from(n) + i64::from(window);
        let mut t = i64::from((edge - 1) % 8 + 1);
        for a in adjust {
            let before = state.extra();
            if state.step(a).is_err() {
                break;
            }
            prop_assert_eq!(48 * i64::from(state.stuffing().get()) + i64::from(state.window()), sum);
            let next = Next { stuffing: state.stuffing(), extra: state.extra() };
            prop_assert_eq!(distance(before, next), 864 + sum + i64::from(a));
            t = (t + i64::from(window) + i64::from(a) - 1).rem_euclid(8) + 1;
            prop_assert_eq!(i64::from((state.extra().get() - 1) % 8 + 1), t);
        }
    }

    #[test]
    fn a_refused_step_changes_nothing(edge in 24..=72_u8, n in 0..=26_u8, window in -300..300_i16, adjust in -300..300_i16) {
        let before = ExtraWindow::new(Extra::new(edge).unwrap(), Stuffing::new(n).unwrap(), window);
        let mut after = before;
        if after.step(adjust).is_err() {
            prop_assert_eq!(after, before);
        }
    }
}

/// Runs `pulses` pulses of `period` (in tenths of an eighth) and gives the largest distance of an edge from its
/// ideal place after the first `settle` pulses. `jitter` moves the measured pulse.
fn worst(period: i64, es: u8, start: i64, pulses: i64, settle: i64, mut jitter: impl FnMut() -> i64) -> i64 {
    worst_of(period / 10, period, es, start, pulses, settle, || Some(jitter()))
}

/// The same for a period that is given in eighths; pulses can be missing.
fn worst_of(
    given: i64,
    period: i64,
    es: u8,
    start: i64,
    pulses: i64,
    settle: i64,
    mut jitter: impl FnMut() -> Option<i64>,
) -> i64 {
    let es_ = Es::new(es).unwrap();
    let mut sync = Synchroniser::new(u32::try_from(given).unwrap(), es_).unwrap();
    let mut edge = start;
    let mut worst = 0;
    for pulse in 0..pulses {
        for k in 0..i64::from(es) {
            let ideal = pulse * period + k * period / i64::from(es);
            if pulse >= settle {
                worst = worst.max((edge - ideal).abs());
            }
            assert_eq!(sync.is_on_pulse(), k == 0);
            let late = if k == 0 { jitter().map(|jitter| ideal + jitter - edge) } else { None };
            let late = late.map(|late| (late + 5).div_euclid(10) as i16);
            let before = sync.extra();
            edge += 10 * distance(before, sync.next(late));
        }
    }
    assert!(settle == 0 || sync.is_in_step());
    worst
}

/// Every 0.1 us of the period from 12 to 27 us a frame and every ES: within an eighth of a bit of the ideal place.
#[test]
fn every_period_and_every_es() {
    for es in 1..=10 {
        let periods = 120 * i64::from(es)..=270 * i64::from(es);
        for tenths_of_us in periods.step_by(crate::thin(400)) {
            // 0.1 us is 7.5 eighths.
            let worst = worst(tenths_of_us * 75, es, 0, 60, 0, || 0);
            assert!(worst <= 10, "{tenths_of_us} {es}: {worst}");
        }
    }
}

/// From any phase the edge is pulled to the pulse, six eighths a frame, also at the ends of the range.
#[test]
fn pulls_in_from_anywhere() {
    for (us10, es) in [(120, 1), (121, 1), (200, 1), (270, 1), (250, 2), (625, 5), (1250, 10)] {
        for start in [-4000, -70, 0, 70, 4000].into_iter().step_by(crate::thin(3)) {
            assert!(worst(us10 * 75, es, start, 200, 150, || 0) <= 10, "{us10} {es} {start}");
        }
    }
}

/// Jitter of the pulse moves the edge by no more than the jitter and an eighth.
#[test]
fn jitter_is_not_amplified() {
    let mut seed = 1_u32;
    let mut noise = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        i64::from(seed >> 16) % 41 - 20
    };
    for (us10, es) in [(120, 1), (160, 1), (253, 2), (1250, 10)] {
        assert!(worst(us10 * 75, es, 0, if cfg!(miri) { 100 } else { 2000 }, 10, &mut noise) <= 31, "{us10} {es}");
    }
}

/// What is accepted is held, from the shortest frame to the longest, at any fraction of an eighth.
#[test]
fn every_period_that_is_accepted_is_held() {
    for es in 1..=10_u8 {
        let (low, high) = (864 * i64::from(es), 2190 * i64::from(es));
        let periods = (low..low + 50 * i64::from(es)).chain(high - 30 * i64::from(es)..high);
        for period in periods.step_by(crate::thin(61)) {
            if Synchroniser::new(u32::try_from(period).unwrap(), Es::new(es).unwrap()).is_err() {
                continue;
            }
            for part in [0, 5] {
                let worst = worst(period * 10 + part, es, 37, 120, 60, || 0);
                assert!(worst <= 15, "{period} {es}: {worst}");
            }
        }
    }
}

/// 200 ppm off, a pulse in twenty missing: within four eighths of a bit, 53 ns, once the difference is learned.
#[test]
fn a_frequency_is_learned() {
    for (us10, es) in [(130, 1), (250, 2), (1250, 10)] {
        for ppm in [-200, 200] {
            let given = us10 * 15 / 2;
            let mut pulse = 0_u32;
            let seen = || {
                pulse = pulse.wrapping_add(1);
                (!pulse.is_multiple_of(20)).then_some(0)
            };
            let worst = worst_of(given, given * 10 + given * ppm / 100_000, es, 0, 2000, 400, seen);
            assert!(worst <= 40, "{us10} {es} {ppm}: {worst}");
        }
    }
}

/// In step after four close pulses; out of it with one that is far off, and after eight that are not seen.
#[test]
fn in_step() {
    let mut sync = Synchroniser::new(1500, Es::ONE).unwrap();
    let mut after = |late| {
        let _ = sync.next(late);
        sync.is_in_step()
    };
    assert_eq!(
        [0, -7, 7, 3, 8, 0, 0, 0, 0].map(|late| after(Some(late))),
        [false, false, false, true, false, false, false, false, true]
    );
    assert_eq!([(); 9].map(|()| after(None)), [true, true, true, true, true, true, true, true, false]);
    assert!(after(Some(0)));
    assert!(!after(Some(-8)));
    // Only frames on a pulse count.
    let mut sync = Synchroniser::new(3000, Es::new(2).unwrap()).unwrap();
    let steps = [(); 8].map(|()| {
        let late = sync.is_on_pulse().then_some(0);
        let _ = sync.next(late);
        sync.is_in_step()
    });
    assert_eq!(steps, [false, false, false, false, false, false, true, true]);
}

#[test]
fn outside_the_range() {
    assert!(matches!(Synchroniser::new(895, Es::ONE), Err(Error::PeriodTooShort { missing: 1 })));
    assert!(Synchroniser::new(896, Es::ONE).is_ok());
    assert!(Synchroniser::new(864 + 69 + 26 * 48, Es::ONE).is_ok());
    assert!(matches!(Synchroniser::new(864 + 70 + 26 * 48, Es::ONE), Err(Error::ExtraOutOfRange { extra: 161 })));
    let sync = Synchroniser::new(4567, Es::new(4).unwrap()).unwrap();
    // 1,141 eighths and three quarters a frame: 864, five blocks of 48, and 37 up to the edge after SYNC and the ones of SAMPLE.
    assert_eq!((sync.period(), sync.lead(), sync.extra().get()), (4567, 64 + 37, 37));
    let mut window = ExtraWindow::new(Extra::new(72).unwrap(), Stuffing::MAX, 72);
    assert_eq!(window.step(5), Err(Error::ExtraOutOfRange { extra: (72 + 5 - 48) / 8 }));
    assert_eq!((Es::new(0), Es::new(11)), (None, None));
}

/// At either end of the range the window has no room for the whole correction, and the frames after it make up for the rest: 200 ppm
/// off, a pulse in twenty missing.
#[test]
fn the_ends_of_the_range_are_held_with_a_clock_that_is_off() {
    for es in [1, 2, 5, 9, 10_u8] {
        let (low, high) = (896 * i64::from(es), 2181 * i64::from(es));
        for (given, ppm) in [(low, 200), (low + low / 4000, -200), (high, -200), (high - high / 2000, 200)] {
            let mut pulse = 0_u32;
            let seen = || {
                pulse = pulse.wrapping_add(1);
                (!pulse.is_multiple_of(20)).then_some(0)
            };
            let worst = worst_of(given, given * 10 + given * ppm / 100_000, es, 0, 2000, 400, seen);
            assert!(worst <= 80, "{given} {es} {ppm}: {worst}");
        }
    }
}

/// In step after few pulses, and then eight are missing: what was learned from the few keeps the edges near.
#[test]
fn a_gap_soon_after_the_lock() {
    for (period, es) in [(1000, 1), (3000, 2), (15_000, 10), (21_000, 10)] {
        for ppm in [-200, 200] {
            for (first, most) in [(4, 140), (8, 80), (16, 70), (64, 70), (250, 70)] {
                let mut pulse = 0;
                let seen = || {
                    pulse += 1;
                    (pulse <= first).then_some(0)
                };
                let real = period * 10 + period * ppm / 100_000;
                let worst = worst_of(period, real, es, 0, first + 8, first, seen);
                assert!(worst <= most, "{period} {es} {ppm} {first}: {worst}");
            }
        }
    }
}

/// Without a measurement, and with a period that is exact, no edge is more than half an eighth beside its place.
#[test]
fn the_spread_is_even() {
    for es in 1..=10_u8 {
        for rest in 0..u32::from(es) {
            let period = 1200 * u32::from(es) + rest;
            let mut sync = Synchroniser::new(period, Es::new(es).unwrap()).unwrap();
            let mut edge = 0;
            for frame in 0..200_i64 {
                // Times ES.
                let beside = edge * i64::from(es) - frame * i64::from(period);
                assert!(2 * beside.abs() <= i64::from(es), "{es} {rest} {frame}: {beside}");
                let before = sync.extra();
                edge += distance(before, sync.next(None));
            }
        }
    }
}
