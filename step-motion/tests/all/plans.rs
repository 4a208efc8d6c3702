//! Planned moves against closed forms and against a model in double precision.

use proptest::prelude::*;
use step_motion::{Clock, Error, Limits, Plan};

fn limits(v: u32, a: u32, j: u64) -> Limits {
    let limits = Limits::new(v, a).unwrap();
    if j == 0 { limits } else { limits.with_jerk(j).unwrap() }
}

/// Steps, greatest speed, acceleration, jerk (0: none), entry and exit speed; duration, and the time at which half a step
/// is left, in ns. Computed with 60 digits from the closed forms.
type Row = (u32, u32, u32, u64, u32, u32, f64, f64);

const WORKED: [Row; 20] = [
    (1, 1000, 10_000, 0, 0, 0, 20_000_000.0, 10_000_000.0),
    (64, 100_000, 1_000_000, 0, 0, 0, 16_000_000.0, 15_000_000.0),
    (1000, 2000, 4000, 0, 0, 0, 1_000_000_000.0, 984_188_611.699),
    (1000, 1000, 4000, 0, 0, 0, 1_250_000_000.0, 1_234_188_611.699),
    (51_200, 250_000, 2_000_000, 0, 0, 0, 329_800_000.0, 329_092_893.218),
    (200, 1000, 2000, 0, 500, 0, 474_568_837.309, 452_208_157.534),
    (200, 1000, 2000, 0, 0, 800, 448_528_137.423, 447_903_624.943),
    (3200, 20_000, 50_000, 0, 20_000, 20_000, 160_000_000.0, 159_975_000.0),
    (500, 8000, 40_000, 0, 3000, 1000, 150_000_000.0, 149_504_902.432),
    (2_000_000, 1_000_000, 100_000_000, 0, 0, 0, 2_010_000_000.0, 2_009_900_000.0),
    (1, 1000, 10_000, 1_000_000, 0, 0, 31_748_021.039, 15_874_010.519),
    (64, 100_000, 1_000_000, 100_000_000, 0, 0, 27_359_615.146, 24_252_382.640),
    (1000, 2000, 4000, 40_000, 0, 0, 1_104_987_562.112, 1_062_815_928.847),
    (1000, 1000, 4000, 16_000, 0, 0, 1_500_000_000.0, 1_442_764_287.872),
    (51_200, 250_000, 2_000_000, 40_000_000, 0, 0, 379_800_000.0, 375_582_836.673),
    (20, 1000, 5000, 50_000, 0, 0, 233_921_419.057, 194_772_742.645),
    (300, 2000, 4000, 40_000, 500, 0, 537_361_093.960, 495_189_460.695),
    (3200, 20_000, 50_000, 1_000_000, 20_000, 20_000, 160_000_000.0, 159_975_000.0),
    (500, 8000, 40_000, 1_000_000, 3000, 1000, 176_323_833.406, 175_823_854.236),
    (2_000_000, 1_000_000, 100_000_000, 10_000_000_000, 0, 0, 2_020_000_000.0, 2_019_330_567.049),
];

#[test]
fn worked_examples() {
    for (n, v, a, j, v0, v1, duration, last) in WORKED {
        let plan = Plan::between(Clock::NANOSECONDS, limits(v, a, j), n, v0, v1).unwrap();
        let mut count = 0;
        let mut end = 0;
        for tick in plan.pulses() {
            assert!(tick > end || count == 0, "{n} {v} {a} {j}: step {count} at {tick} after {end}");
            count += 1;
            end = tick;
        }
        assert_eq!(count, n, "{n} {v} {a} {j}");
        let (off, off_last) = (plan.duration() as f64 - duration, end as f64 - last);
        println!("{n} {v} {a} {j} {v0} {v1}: {off} {off_last}");
        assert!(off.abs() <= 0.51, "{n} {v} {a} {j} {v0} {v1}: duration {} for {duration}", plan.duration());
        assert!(off_last.abs() <= 0.51, "{n} {v} {a} {j} {v0} {v1}: last {end} for {last}");
    }
}

/// Time of the fastest move by closed forms and halving, in s; `None` if the speeds cannot be changed within `n` steps.
fn optimum(n: f64, [v, a, j]: [f64; 3], [v0, v1]: [f64; 2]) -> Option<f64> {
    let time = |dv: f64| {
        let dv = dv.abs();
        if j == 0.0 {
            dv / a
        } else if dv >= a * a / j {
            dv / a + a / j
        } else {
            2.0 * (dv / j).sqrt()
        }
    };
    let need = |top: f64| f64::midpoint(v0, top) * time(top - v0) + f64::midpoint(top, v1) * time(top - v1);
    let (mut low, mut high) = (v0.max(v1), v);
    if f64::midpoint(v0, v1) * time(v1 - v0) > n {
        return None;
    }
    if need(high) > n {
        for _ in 0..200 {
            let middle = f64::midpoint(low, high);
            if need(middle) <= n { low = middle } else { high = middle }
        }
    } else {
        low = high;
    }
    let cruise = if low > 0.0 { (n - need(low)) / low } else { 0.0 };
    Some(time(low - v0) + time(low - v1) + cruise)
}

/// All that is promised of a plan, at every step and every corner.
fn check(plan: &Plan, n: u32, limits: Limits, [v0, v1]: [u32; 2]) -> Result<(), TestCaseError> {
    let hz = f64::from(plan.clock().hz());
    // The limits, with what is left of 64 bits; and a corner may be up to a nanosecond from its tick.
    let ns = 1e-9;
    let (a, j) = (f64::from(limits.acceleration()), limits.jerk().map_or(0.0, |jerk| jerk as f64));
    let state = |tick: u64| plan.at(tick);
    let within = |value: i64, limit: f64| (value as f64 / 65536.0).abs() <= limit * (1.0 + 1e-6) + 1e-3;
    let corners: Vec<u64> = plan.corners().collect();
    prop_assert_eq!((corners.first(), corners.last()), (Some(&0), Some(&plan.duration())));
    for pair in corners.windows(2) {
        for tick in [pair[0], pair[0].midpoint(pair[1]), pair[1]] {
            let s = state(tick);
            prop_assert!(
                within(s.speed, f64::from(limits.speed()) + a * ns) && s.speed >= -1,
                "speed at {tick}: {s:?}"
            );
            prop_assert!(within(s.acceleration, a + j * ns), "acceleration at {tick}: {s:?}");
            prop_assert!(within(s.jerk, j), "jerk at {tick}: {s:?}");
        }
    }
    prop_assert_eq!(state(plan.duration() + 1).position, i64::from(n) << 32);
    // The steps: all of them, each in a tick of its own, none more than half a tick (and what p is rounded to) away.
    let mut last = None;
    let mut k = 0_u32;
    for tick in plan.pulses() {
        prop_assert!(last.is_none_or(|last| tick > last), "step {k}: {tick} after {last:?}");
        let target = (i64::from(k) << 32) + (1 << 31);
        let s = state(tick);
        let slack =
            (s.speed as f64 / 65536.0 / hz * 0.5 + s.acceleration.abs() as f64 / 65536.0 / hz / hz) * 2_f64.powi(32);
        prop_assert!(((s.position - target).abs() as f64) <= slack * 1.001 + 4.0, "step {k} at {tick}: {s:?}, {slack}");
        (last, k) = (Some(tick), k + 1);
    }
    prop_assert_eq!(k, n);
    // As fast as possible.
    let s = [f64::from(limits.speed()), limits.acceleration().into(), limits.jerk().unwrap_or(0) as f64];
    let took = plan.duration() as f64;
    // A move may be shorter than its speeds need by 2^-16 of a step; the model then knows none.
    let best = optimum(n.into(), s, [v0.into(), v1.into()]).map_or(took, |best| best * hz);
    prop_assert!((took - best).abs() <= 1.0 + best * 1e-9, "{took} ticks for {best}");
    Ok(())
}

/// The first steps are ten million ticks apart: more than the kernel foresees.
#[test]
fn steps_that_are_far_apart() {
    for (n, speed, acceleration) in [(107, 13_346, 3_610), (300, 400_000, 1), (300, 1, 100_000_000), (20_000, 1000, 50)]
    {
        for hz in [1_000_000, 84_000_000, 1_000_000_000] {
            let limits = Limits::new(speed, acceleration).unwrap();
            let plan = Plan::new(Clock::new(hz).unwrap(), limits, n).unwrap();
            check(&plan, n, limits, [0, 0]).unwrap();
        }
    }
}

/// Logarithmically spread.
fn spread(low: f64, high: f64) -> impl Strategy<Value = f64> {
    (low.ln()..high.ln()).prop_map(f64::exp)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2 * ProptestConfig::default().cases, ..ProptestConfig::default() })]

    #[test]
    fn every_plan_keeps_its_promises(
        n in prop_oneof![0..300_u32, 0..20_000_u32],
        v in spread(1.0, 400_000.0),
        a in spread(1.0, 1e8),
        j in prop_oneof![Just(0.0), spread(100.0, 1.7e13)],
        entry in prop_oneof![Just(0.0), 0.0..=1.0],
        exit in prop_oneof![Just(0.0), 0.0..=1.0],
        hz in prop_oneof![Just(1_000_000), Just(1_000_000_000), 1_000_000..(1_u32 << 30)],
    ) {
        let limits = limits(v as u32, a as u32, j as u64);
        let speeds = [(v * entry) as u32, (v * exit) as u32];
        let plan = Plan::between(Clock::new(hz).unwrap(), limits, n, speeds[0], speeds[1]);
        let s = [f64::from(limits.speed()), limits.acceleration().into(), limits.jerk().unwrap_or(0) as f64];
        match plan {
            Ok(plan) => check(&plan, n, limits, speeds)?,
            Err(error) => {
                prop_assert!(matches!(error, Error::TooShort { .. }), "{error:?}");
                prop_assert_eq!(optimum(f64::from(n), s, speeds.map(f64::from)), None);
            }
        }
    }
}

/// Short moves at every combination of few and many, slow and fast, soft and hard.
#[test]
fn all_small_moves() {
    for clock in [Clock::MICROSECONDS, Clock::NANOSECONDS, Clock::new(72_000_000).unwrap()] {
        for v in [1, 30, 1000, 20_000, 250_000] {
            for a in [10, 1000, 100_000, 10_000_000] {
                for j in [0, 1000, 1_000_000, 1_000_000_000] {
                    let limits = limits(v, a, j);
                    for n in 0..=64 {
                        let plan = Plan::new(clock, limits, n).unwrap();
                        if let Err(e) = check(&plan, n, limits, [0, 0]) {
                            panic!("{n} steps, {limits}, {clock}: {e}");
                        }
                    }
                }
            }
        }
    }
}

/// A trapezoid step by step against v² = 2 a s.
#[test]
fn steps_of_a_trapezoid_are_where_the_formula_says() {
    let (n, v, a) = (5000_u32, 40_000_f64, 1_000_000_f64);
    let plan = Plan::new(Clock::NANOSECONDS, limits(40_000, 1_000_000, 0), n).unwrap();
    let ramp = v * v / (2.0 * a);
    let end = 2.0 * v / a + (f64::from(n) - 2.0 * ramp) / v;
    for (k, tick) in plan.pulses().enumerate() {
        let s = k as f64 + 0.5;
        let left = f64::from(n) - s;
        let t = if s < ramp {
            (2.0 * s / a).sqrt()
        } else if left < ramp {
            end - (2.0 * left / a).sqrt()
        } else {
            v / a + (s - ramp) / v
        };
        assert!((tick as f64 - t * 1e9).abs() <= 0.501, "step {k}: {tick} for {}", t * 1e9);
    }
}

#[test]
fn what_cannot_be_done_is_refused_with_what_would_do() {
    let limits = limits(1000, 1000, 0);
    assert_eq!(
        Plan::between(Clock::MICROSECONDS, limits, 100, 0, 500).unwrap_err(),
        Error::TooShort { steps: 100, needed: 125 }
    );
    let jerky = limits.with_jerk(10_000).unwrap();
    assert_eq!(
        Plan::between(Clock::MICROSECONDS, jerky, 100, 0, 500).unwrap_err(),
        Error::TooShort { steps: 100, needed: 150 }
    );
    // 5·10^8 steps/s at 1 step/s²: (5·10^8)² / 2 steps to rest.
    let slow = Limits::new(500_000_000, 1).unwrap();
    assert_eq!(
        Plan::between(Clock::NANOSECONDS, slow, 7, 500_000_000, 0).unwrap_err(),
        Error::TooShort { steps: 7, needed: 125_000_000_000_000_000 }
    );
    let fast = limits.with_speed(500_001).unwrap();
    assert_eq!(
        Plan::new(Clock::MICROSECONDS, fast, 5).unwrap_err(),
        Error::SpeedAboveClock { speed: 500_001, limit: 500_000 }
    );
    let many = Plan::new(Clock::MICROSECONDS, limits, 1 << 31).unwrap_err();
    assert_eq!(many, Error::TooManySteps { steps: 1 << 31, limit: (1 << 31) - 1 });
}

/// The size and the sign of the jerk in each of the seven phases, in steps/s³; the number of steps, before and after the first.
#[test]
fn a_plan_tells_its_jerk_and_its_steps() {
    let plan = Plan::new(Clock::MICROSECONDS, limits(250_000, 2_000_000, 40_000_000), 51_200).unwrap();
    let corners: Vec<u64> = plan.corners().collect();
    let jerks: Vec<i64> = corners.windows(2).map(|pair| plan.at(pair[0].midpoint(pair[1])).jerk).collect();
    assert_eq!(jerks.len(), 7);
    for (got, want) in jerks.iter().zip([1, 0, -1, 0, -1, 0, 1]) {
        assert!(got.abs_diff((want * 40_000_000) << 16) <= 1 << 16, "{jerks:?}");
    }
    assert_eq!(plan.at(0).position, 0);
    assert_eq!(plan.steps(), 51_200);
    let mut pulses = plan.pulses();
    assert_eq!(pulses.size_hint(), (51_200, Some(51_200)));
    pulses.next().unwrap();
    assert_eq!(pulses.size_hint(), (51_199, Some(51_199)));
}

/// 1000 steps/s at 1000 steps/s², for a second; then with half a second of 2000 steps/s³ at either end of each ramp.
#[test]
fn the_corners_of_a_plan() {
    let corners =
        |limits, steps| Plan::new(Clock::MICROSECONDS, limits, steps).unwrap().corners().collect::<Vec<u64>>();
    assert_eq!(corners(limits(1000, 1000, 0), 2000), [0, 1_000_000, 2_000_000, 3_000_000]);
    let halves = [0, 1, 2, 3, 5, 6, 7, 8].map(|half| half * 500_000);
    assert_eq!(corners(limits(1000, 1000, 2000), 2500), halves);
}

/// Half the clock and 2^31 - 1 steps are allowed; one more is not.
#[test]
fn the_last_that_is_allowed() {
    let clock = Clock::new(1_000_000).unwrap();
    assert!(Plan::new(clock, limits(500_000, 1_000_000, 0), 10).is_ok());
    let refused = Plan::new(clock, limits(500_001, 1_000_000, 0), 10);
    assert!(matches!(refused, Err(Error::SpeedAboveClock { speed: 500_001, limit: 500_000 })));
    let most = (1_u32 << 31) - 1;
    assert_eq!(Plan::new(clock, limits(500_000, 1_000_000, 0), most).unwrap().steps(), most);
    let refused = Plan::new(clock, limits(500_000, 1_000_000, 0), most + 1);
    assert!(matches!(refused, Err(Error::TooManySteps { steps: 0x8000_0000, limit: 0x7fff_ffff })));
}

/// 315 ordinary S-curves, to the finest scale and the hardest jerk that machines have: none is refused, all are as fast as possible.
#[test]
fn ordinary_curves_of_machines() {
    let clock = Clock::new(168_000_000).unwrap();
    for per_mm in [5, 25, 80, 160, 400, 1600, 10_000_u32] {
        for acceleration in [50, 200, 1000, 5000, 20_000_u32] {
            for jerk in [200, 1000, 5000, 20_000, 50_000, 100_000, 250_000, 1_000_000, 2_000_000_u64] {
                // 100 mm/s, over 10 mm.
                let [v, a] = [100 * per_mm, acceleration * per_mm];
                let plan = Plan::new(clock, limits(v, a, jerk * u64::from(per_mm)), 10 * per_mm).unwrap();
                let best = optimum(10.0, [100.0, acceleration.into(), jerk as f64], [0.0; 2]).unwrap();
                let off = plan.duration() as f64 - best * 168e6;
                assert!(off.abs() <= 1.0, "{per_mm} steps/mm, {acceleration} mm/s², {jerk} mm/s³: {off} ticks");
            }
        }
    }
}
