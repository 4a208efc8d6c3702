use proptest::prelude::*;

use super::*;

const A_10_000: Acceleration = Acceleration(47_230_000);

/// 2^23 counts, a limit of 100 turns per second, and what it makes of samples given by angle bits and time.
fn tracked(samples: &[(u32, u64)]) -> Motion {
    let mut tracker = Tracker::new(1 << 23, 100).unwrap();
    samples.iter().fold(Motion::UNKNOWN, |_, (bits, ns)| tracker.sample(Angle::from_bits(*bits), *ns))
}

#[test]
fn acceleration_is_rounded_up() {
    // 2^72 / 10^18 is 4722.366.
    assert_eq!(Acceleration::from_turns_per_s2(1).map(Acceleration::to_bits), Some(4_723));
    assert_eq!(Acceleration::from_turns_per_s2(10_000), Some(A_10_000));
    assert_eq!(Acceleration::from_turns_per_s2(909_372).map(Acceleration::to_bits), Some(4_294_963_956));
    assert_eq!(Acceleration::from_turns_per_s2(909_373), None);
}

#[test]
fn speed_comes_from_two_samples_across_the_full_turn() {
    // A hundredth of a turn (42949673 of 2^32) in 1 ms is ten turns a second: 2814750 of 2^-48 turn/ns.
    let forward = tracked(&[(0xff00_0000, 5_000_000), (0xff00_0000_u32.wrapping_add(42_949_673), 6_000_000)]);
    assert_eq!(forward.speed(), Some(2_814_749));
    let backward = tracked(&[(42_949_673, 5_000_000), (0, 6_000_000)]);
    assert_eq!(backward.speed(), Some(-2_814_749));
}

#[test]
fn speed_is_known_after_two_samples_that_are_near_enough() {
    // At 100 turns a second half a turn takes 5 ms, less a count.
    for (samples, known) in [
        (&[][..], false),
        (&[(0, 0)], false),
        (&[(0, 0), (0, 4_999_998)], true),
        (&[(0, 0), (0, 5_000_000)], false),
        (&[(0, 0), (0, 5_000_000), (0, 6_000_000)], true),
        (&[(0, 1_000), (0, 999)], false),
        (&[(0, 1_000), (1 << 20, 1_000)], false),
        // The same sample again.
        (&[(0, 0), (0, 1_000), (0, 1_000)], true),
        (&[(0, 1_000), (0, 1_000)], false),
        // Another angle at the same instant: one of the two is wrong.
        (&[(0, 0), (0, 1_000), (1 << 20, 1_000)], false),
        // Faster than what the unit holds.
        (&[(0, 0), (0x4000_0000, 10)], false),
    ] {
        assert_eq!(tracked(samples).speed().is_some(), known, "{samples:?}");
    }
    let mut tracker = Tracker::new(1 << 23, 100).unwrap();
    tracker.sample(Angle::ZERO, 0);
    assert_eq!(tracker.interrupt(), Motion::UNKNOWN);
    assert_eq!(tracker.sample(Angle::ZERO, 1_000).speed(), None);
    assert_eq!(tracker.sample(Angle::ZERO, 2_000).speed(), Some(0));
}

#[test]
fn what_a_tracker_refuses() {
    for (counts, turns_per_s, taken) in [
        (2, 100, false),
        (3, 100, true),
        (0, 100, false),
        (4_096, 0, false),
        (4_096, 7_000, true),
        (4_096, 7_001, false),
    ] {
        assert_eq!(Tracker::new(counts, turns_per_s).is_some(), taken, "{counts} {turns_per_s}");
    }
}

/// The bound term by term: a 23-bit encoder (a count is 512), 62.5 µs between the samples, 100 µs after the last one.
#[test]
fn the_bound_is_made_of_these_terms() {
    let standing = tracked(&[(0, 0), (0, 62_500)]);
    let bound = |ns: u64, acceleration| standing.at(62_500 + ns, acceleration).bound.to_bits();
    // One count, and one count · 100 / 62.5 by the speed; 512 + 819.2.
    assert!((1_332..=1_340).contains(&bound(100_000, Acceleration(0))), "{}", bound(100_000, Acceleration(0)));
    // And 10000 turns/s² · 100 µs · 162.5 µs / 2 = 8.125e-5 turns = 348966.
    assert!((350_290..=350_400).contains(&bound(100_000, A_10_000)), "{}", bound(100_000, A_10_000));
    assert!((512..=516).contains(&bound(0, A_10_000)), "{}", bound(0, A_10_000));
    // 10 ms: 10000 · 10 ms · 10.0625 ms / 2 is 0.503 turns.
    assert_eq!(bound(10_000_000, A_10_000), 1 << 31);
    assert!(bound(9_900_000, A_10_000) < 1 << 31);
    // Beyond 2.1 s.
    assert_eq!((bound((1 << 31) - 1, Acceleration(0)) == 1 << 31, bound(1 << 31, Acceleration(0))), (false, 1 << 31));
    assert_eq!(tracked(&[(7, 50)]).at(50, A_10_000), Estimate { angle: Angle::from_bits(7), bound: Angle::HALF });
    assert_eq!(Motion::UNKNOWN.at(0, A_10_000).bound, Angle::HALF);
}

/// The same far from the last sample, where times in ns fill their words: half a second and 62.5 µs make 0.125015625 s², and with
/// 1 turn/s² as many turns, or 536,938,021; the count goes 8001 times into it.
#[test]
fn the_bound_holds_far_from_the_last_sample() {
    let standing = tracked(&[(0, 0), (0, 62_500)]);
    let [slow, fast] = [1, 3].map(|limit| {
        let limit = Acceleration::from_turns_per_s2(limit).unwrap();
        standing.at(62_500 + 500_000_000, limit).bound.to_bits()
    });
    assert!((541_034_533..541_150_000).contains(&slow), "{slow}");
    assert!((1_614_910_575..1_615_200_000).contains(&fast), "{fast}");
}

/// The width of a count, rounded up, and a 2^-32 turn more by which an angle that is not a power of two is rounded down.
#[test]
fn a_count_is_as_wide_as_its_angles_are_apart() {
    for (counts, width) in [(1 << 23, 512), (1 << 31, 2), (10_000, 429_498), (3, 1_431_655_767), (u32::MAX, 3)] {
        let mut tracker = Tracker::new(counts, 100).unwrap();
        assert_eq!(tracker.sample(Angle::ZERO, 0).count, width, "{counts}");
    }
}

/// An estimate within 2^20, and after it a sample that is exact: the speed between them is as uncertain as the estimate was.
#[test]
fn a_bound_goes_into_the_speed() {
    let mut tracker = Tracker::new(1 << 23, 100).unwrap();
    let wide = Angle::from_bits(1 << 20);
    let none = Acceleration(0);
    tracker.sample_within(Angle::ZERO, 0, wide);
    let estimated = tracker.sample_within(Angle::ZERO, 50_000, wide);
    let exact = tracker.sample_within(Angle::ZERO, 100_000, Angle::ZERO);
    let after = tracker.sample_within(Angle::ZERO, 150_000, Angle::ZERO);
    for (motion, [now, later]) in [(estimated, [1 << 20, 3 << 20]), (exact, [0, 1 << 20]), (after, [0, 0])] {
        let bounds = [0, 50_000].map(|ns| motion.at(motion.sampled_ns + ns, none).bound.to_bits());
        assert!(
            (now + 512..now + 520).contains(&bounds[0]) && (later + 1024..later + 1040).contains(&bounds[1]),
            "{bounds:?}"
        );
    }
    // At 100 turns a second half a turn less a count takes 4,999,998 ns; with a quarter of a turn of doubt, half of that.
    for (bounds, longest) in
        [([0, 0], 4_999_998), ([1 << 30, 0], 2_499_998), ([1 << 29, 1 << 29], 2_499_998), ([1 << 31, 0], 0)]
    {
        let known = [longest, longest + 2].map(|span| {
            let mut tracker = Tracker::new(1 << 23, 100).unwrap();
            tracker.sample_within(Angle::ZERO, 7, Angle::from_bits(bounds[0]));
            tracker.sample_within(Angle::ZERO, 7 + span, Angle::from_bits(bounds[1])).speed().is_some()
        });
        assert_eq!(known, [longest != 0, false], "{bounds:?}");
    }
}

#[test]
fn a_steady_shaft_is_where_it_was_going() {
    // A sixteenth of a turn in 2^20 ns, forward and backward; looked at after, at and before the last sample.
    for (sign, samples) in [(1, [(0, 1 << 20), (1 << 28, 2 << 20)]), (-1, [(1 << 29, 1 << 20), (1 << 28, 2 << 20)])] {
        let motion = tracked(&samples);
        for (ns, turned) in [(3 << 20, 1 << 28), (5 << 19, 1 << 27), (2 << 20, 0), (3 << 19, -(1 << 27))] {
            let angle = motion.at(ns, Acceleration(0)).angle;
            assert_eq!(angle.difference(Angle::from_bits(1 << 28)), sign * turned, "{ns}");
        }
    }
}

#[test]
fn words_carry_all_of_it() {
    let motion = Motion {
        angle: Angle::from_bits(0x8000_0001),
        sampled_ns: 0x1234_5678_9abc_def0,
        span_ns: 62_500,
        speed: -2,
        speed_error: 0xffff_fffe,
        count: 512,
    };
    let words = motion.to_words();
    assert_eq!(words, [0x8000_0001, 0x9abc_def0, 0x1234_5678, 62_500, 0xffff_fffe, 0xffff_fffe, 512]);
    assert_eq!(Motion::from_words(words), motion);
}

/// A shaft with one acceleration after another, in whole numbers without rounding: times in ns, speed in 2^-72 turn/ns,
/// acceleration in 2^-72 turn/ns², position in 2^-73 turn.
#[derive(Clone, Copy)]
struct Truth {
    position: i128,
    speed: i128,
    fastest: i128,
}

impl Truth {
    fn run(&mut self, acceleration: i128, ns: i128) {
        self.position += 2 * self.speed * ns + acceleration * ns * ns;
        self.speed += acceleration * ns;
        self.fastest = self.fastest.max(self.speed.abs());
    }

    /// In two halves with their own shares of the largest acceleration, in thousandths.
    fn run_halves(&mut self, limit: Acceleration, shares: (i128, i128), ns: i128) {
        let limit = i128::from(limit.0);
        self.run(limit * shares.0 / 1_000, ns / 3);
        self.run(limit * shares.1 / 1_000, ns - ns / 3);
    }

    /// What an encoder shows.
    fn shown(&self, counts_per_turn: u32) -> Angle {
        let count = (self.position * i128::from(counts_per_turn)) >> 73;
        Angle::from_counts(count.rem_euclid(counts_per_turn.into()) as u32, counts_per_turn)
    }

    /// How far an angle is off, in 2^-73 turn.
    fn off(&self, angle: Angle) -> i128 {
        let off = (self.position - (i128::from(angle.to_bits()) << 41)).rem_euclid(1 << 73);
        off.min((1 << 73) - off)
    }
}

/// One turn per second, in 2^-72 turn/ns.
const TURN_PER_S: i128 = (1 << 72) / 1_000_000_000;

fn unsigned(ns: i128) -> u64 {
    ns.try_into().unwrap()
}

fn share() -> impl Strategy<Value = i128> {
    prop_oneof![Just(-1_000), Just(1_000), -1_000_i128..=1_000]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if cfg!(miri) { 1 } else { 20_000 }, ..ProptestConfig::default() })]

    /// For any motion within the acceleration and the speed that were named the shaft is within the bound.
    #[test]
    fn the_shaft_is_within_the_bound(
        counts in prop_oneof![Just(1 << 23), Just(1 << 17), Just(10_000), Just(3), 3_u32..=u32::MAX],
        turns_per_s in -3_000_i128..3_000,
        limit in prop_oneof![0_u32..50_000, 0_u32..900_000],
        (span, later) in (prop_oneof![1_i128..300_000, 1_i128..5_000_000], prop_oneof![0_i128..300_000, 0_i128..3_000_000]),
        (before, after) in ((share(), share()), (share(), share())),
        start in 0_i128..1 << 73,
    ) {
        let limit = Acceleration::from_turns_per_s2(limit).unwrap();
        let mut truth = Truth { position: start, speed: turns_per_s * TURN_PER_S, fastest: 0 };
        let mut tracker = Tracker::new(counts, 7_000).unwrap();
        tracker.sample(truth.shown(counts), 1_000);
        truth.run_halves(limit, before, span);
        prop_assume!(truth.fastest < 7_000 * TURN_PER_S);
        let sampled_ns = 1_000 + unsigned(span);
        let motion = tracker.sample(truth.shown(counts), sampled_ns);
        truth.run_halves(limit, after, later);
        let estimate = motion.at(sampled_ns + unsigned(later), limit);
        prop_assert!(truth.off(estimate.angle) <= i128::from(estimate.bound.to_bits()) << 41);
    }

    /// Also if the samples are estimates, off by as much as was said; with the largest speed that the tracker was told.
    #[test]
    fn the_shaft_is_within_the_bound_of_estimates(
        counts in prop_oneof![Just(1 << 23), Just(10_000), 3_u32..=u32::MAX],
        (share_of_it, fastest) in (-980_i128..980, 1_000_u32..7_000),
        (span, later) in (prop_oneof![1_000_i128..300_000, 1_i128..700_000], 0_i128..300_000),
        bounds in prop::array::uniform2(prop_oneof![Just(0_u32), 0_u32..1 << 20, 0_u32..1 << 31]),
        (off, start) in (prop::array::uniform2(-1_000_i64..=1_000), 0_i128..1 << 73),
        (before, after) in ((share(), share()), (share(), share())),
    ) {
        let mut truth = Truth { position: start, speed: i128::from(fastest) * share_of_it * TURN_PER_S / 1_000, fastest: 0 };
        let mut tracker = Tracker::new(counts, fastest).unwrap();
        let shown = |truth: &Truth, k: usize| {
            let off = i64::from(bounds[k]) * off[k] / 1_000;
            (Angle::from_bits(truth.shown(counts).to_bits().wrapping_add_signed(off as i32)), Angle::from_bits(bounds[k]))
        };
        let (angle, bound) = shown(&truth, 0);
        tracker.sample_within(angle, 1_000, bound);
        truth.run_halves(A_10_000, before, span);
        prop_assume!(truth.fastest < i128::from(fastest) * TURN_PER_S);
        let sampled_ns = 1_000 + unsigned(span);
        let (angle, bound) = shown(&truth, 1);
        let motion = tracker.sample_within(angle, sampled_ns, bound);
        truth.run_halves(A_10_000, after, later);
        let estimate = motion.at(sampled_ns + unsigned(later), A_10_000);
        prop_assert!(truth.off(estimate.angle) <= i128::from(estimate.bound.to_bits()) << 41);
    }

    /// And before the sample, for a reader that looked at its clock before the writer interrupted it.
    #[test]
    fn the_shaft_was_within_the_bound(
        turns_per_s in -3_000_i128..3_000,
        (span, earlier) in (1_000_i128..60_000, 0_i128..1_000),
        (before, after) in (share(), share()),
    ) {
        let mut truth = Truth { position: 0, speed: turns_per_s * TURN_PER_S, fastest: 0 };
        let mut tracker = Tracker::new(1 << 20, 7_000).unwrap();
        tracker.sample(truth.shown(1 << 20), 0);
        truth.run(i128::from(A_10_000.0) * before / 1_000, span - earlier);
        let then = truth;
        truth.run(i128::from(A_10_000.0) * after / 1_000, earlier);
        let estimate = tracker.sample(truth.shown(1 << 20), unsigned(span)).at(unsigned(span - earlier), A_10_000);
        prop_assert!(then.off(estimate.angle) <= i128::from(estimate.bound.to_bits()) << 41);
    }

    /// The bound is not wider than it has to be: a shaft that takes all of its acceleration comes to the end of it.
    #[test]
    fn the_bound_is_reached(turns_per_s in -100_i128..100, (span, later) in (50_000_i128..500_000, 50_000_i128..500_000)) {
        let counts = 1 << 31;
        let mut truth = Truth { position: 0, speed: turns_per_s * TURN_PER_S, fastest: 0 };
        let mut tracker = Tracker::new(counts, 1_000).unwrap();
        tracker.sample(truth.shown(counts), 0);
        truth.run(i128::from(A_10_000.0), span);
        let motion = tracker.sample(truth.shown(counts), unsigned(span));
        truth.run(i128::from(A_10_000.0), later);
        let estimate = motion.at(unsigned(span + later), A_10_000);
        let bound = i128::from(estimate.bound.to_bits()) << 41;
        let off = truth.off(estimate.angle);
        prop_assert!(off <= bound && off > bound * 98 / 100, "{off} of {bound}");
    }
}
