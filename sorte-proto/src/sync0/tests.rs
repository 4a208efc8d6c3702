use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::iep::{Activity, Channel, Edge};

/// Rise and fall of every pulse for the words given, and three cycles more.
fn pulses(mut axis: Channel, words: &[u16]) -> Vec<(u64, u64)> {
    let mut pulses = Vec::new();
    let mut up = None;
    for (end, &word) in (1..).map(|n| n * 4000).zip(words.iter().chain(&[0; 3])) {
        axis.set_start(StartTime::new(word));
        while let Some(edge) = axis.next_edge(end) {
            match edge {
                Edge { ns, high: true } => assert_eq!(up.replace(ns), None),
                Edge { ns, high: false } => pulses.push((up.take().unwrap(), ns)),
            }
        }
    }
    pulses
}

/// The output is disarmed and armed again when its pulse is over.
#[test]
fn writes_at_the_end_of_a_pulse() {
    let mut sync0 = Sync0::default();
    let late: Vec<_> = sync0.cmp7(StartTime::new(600)).into_iter().collect();
    assert_eq!(late.last(), Some(&Write { register: Register::CmpCfg, value: 0x107 }));
    let over: Vec<_> = sync0.cmp6().into_iter().map(|write| (write.register, write.value)).collect();
    assert_eq!(over, [(Register::CmpCfg, 0x103), (Register::SyncCtrl, 2), (Register::SyncCtrl, 3)]);
}

/// A pulse that ends 3390 ns into its cycle: the published device puts CMP6 at 10 ns, as 0 would be lost in the wrap.
#[test]
fn cmp6_is_never_at_0() {
    for (start, cmp6) in [(1385, 3385), (1390, 10), (1395, 5)] {
        let mut sync0 = Sync0::new(Variant::Published);
        let writes: Vec<_> = sync0.cmp7(StartTime::new(start)).into_iter().collect();
        assert!(writes.contains(&Write { register: Register::Cmp6, value: cmp6 }), "{start}: {writes:?}");
    }
}

/// The timer's registers before and after a word, and the edge that is not before its own time.
#[test]
fn registers_and_edges_of_the_timer() {
    const ALL: [Register; 5] =
        [Register::CmpCfg, Register::Cmp1, Register::Cmp6, Register::SyncStart, Register::SyncCtrl];
    let mut axis = Channel::new(Variant::Lossless, 2000, 300);
    assert_eq!(ALL.map(|register| axis.register(register)), [0x103, 0, 0, 0, 3]);
    axis.set_start(StartTime::new(600));
    assert_eq!(axis.next_edge(4595), None);
    assert_eq!(ALL.map(|register| axis.register(register)), [0x187, 3990, 2600, 120, 2]);
    assert_eq!(axis.next_edge(4596), Some(Edge { ns: 4595, high: true }));
}

fn requested(words: &[u16]) -> Vec<u64> {
    (1..).zip(words).filter(|(_, word)| **word != 0).map(|(n, &word)| n * 4000 + u64::from(word)).collect()
}

/// Steps at least 4 us apart, as words for consecutive cycles.
fn legal_words(gaps: &[u32]) -> Vec<u16> {
    let mut words = Vec::new();
    let mut at = 0u64;
    for &gap in gaps {
        at += u64::from(gap);
        let (mut cycle, mut ns) = (at / 4000, at % 4000);
        // The wire carries 1 to 3990; the shift must not bring two steps closer than 4 us.
        if ns == 0 || ns > 3990 {
            at += 4000 - ns + 1;
            (cycle, ns) = (at / 4000, at % 4000);
        }
        words.resize(cycle as usize, 0);
        words.push(ns as u16);
    }
    words
}

fn steps() -> impl Strategy<Value = Vec<u32>> {
    let gap = prop_oneof![Just(4000u32), 4000..4010u32, 4000..4200u32, 4000..8000u32, 4000..40_000u32];
    proptest::collection::vec(gap, 1..60)
}

fn assert_lossless(words: &[u16], latency: u16) {
    let real = pulses(Channel::new(Variant::Lossless, CMP7_NS, latency), words);
    let want = requested(words);
    assert_eq!(real.len(), want.len(), "{words:?} at {latency} ns");
    for ((rise, fall), want) in real.into_iter().zip(want) {
        assert!(rise.abs_diff(want) < 10, "{rise} for {want} in {words:?} at {latency} ns");
        assert_eq!(fall - rise, u64::from(PULSE_NS), "{words:?} at {latency} ns");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: if cfg!(miri) { 1 } else { 4000 }, ..ProptestConfig::default() })]

    #[test]
    fn lossless_keeps_every_step(gaps in steps(), latency in 0u16..=MAX_LATENCY_NS) {
        assert_lossless(&legal_words(&gaps), latency);
    }

    /// The two machines differ only in when, never in what a write may be.
    #[test]
    fn writes_stay_in_range(events in proptest::collection::vec((0u8..3, 0u16..4000), 0..200), published: bool) {
        let mut sync0 = Sync0::new(if published { Variant::Published } else { Variant::Lossless });
        for (event, ns) in events {
            let writes = match event {
                0 => sync0.cmp6(),
                1 => sync0.cmp0(),
                _ => sync0.cmp7(StartTime::new(ns)),
            };
            let mut count = 0;
            for Write { register, value } in writes {
                count += 1;
                match register {
                    Register::CmpCfg => prop_assert_eq!(value & !0x084, CMP_CFG_IDLE),
                    Register::Cmp1 => prop_assert!((1..=3990).contains(&value)),
                    Register::Cmp6 => prop_assert!((1..=3990).contains(&value)),
                    Register::SyncStart => prop_assert!(value <= 798),
                    Register::SyncCtrl => prop_assert!(value == 2 || value == 3),
                }
            }
            prop_assert!(count <= 7);
        }
    }
}

/// Every phase, after a rest and after a step of the same phase, at every latency of the timer: what
/// [`MAX_LATENCY_NS`] promises.
#[test]
fn lossless_keeps_every_phase_at_every_latency() {
    let words: Vec<u16> = (1..=3990).step_by(crate::stride(499)).flat_map(|phase| [phase, phase, 0]).collect();
    for latency in (0..=MAX_LATENCY_NS).step_by(if cfg!(miri) { 295 } else { 5 }) {
        assert_lossless(&words, latency);
    }
}

/// Every pair of phases, one cycle after the other, at every fifth latency: the second not before 4 us after the first.
#[test]
fn lossless_keeps_every_pair_of_phases() {
    let phases: Vec<u16> =
        (1..=3990).step_by(133).chain(1380..=1400).chain([3389, 3390, 3990]).step_by(crate::stride(11)).collect();
    for &first in &phases {
        for &second in phases.iter().filter(|&&second| second >= first) {
            for latency in [0, 100, 300, 590].into_iter().step_by(crate::stride(3)) {
                assert_lossless(&[first, second, second, 0, second], latency);
            }
        }
    }
}

/// What the module promises of the published machine: some steps are late or lost, and none is without reason.
#[test]
fn the_published_machine_loses_some_steps_in_a_hundred() {
    let mut state = 1u32;
    let mut random = |below: u32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(state) * u64::from(below)) >> 32) as u32
    };
    let (mut asked, mut on_time) = (0, 0);
    for _ in 0..if cfg!(miri) { 4 } else { 400 } {
        let gaps: Vec<u32> = (0..50).map(|_| 4000 + if random(2) == 0 { random(60) } else { random(8000) }).collect();
        let words = legal_words(&gaps);
        let real = pulses(Channel::new(Variant::Published, CMP7_NS, 300), &words);
        let want = requested(&words);
        asked += want.len();
        on_time += want.iter().filter(|want| real.iter().any(|(rise, _)| rise.abs_diff(**want) < 10)).count();
    }
    let missed = 100 * (asked - on_time) / asked;
    assert!((1..=15).contains(&missed), "{missed} %");
}

/// The event-driven timer against one that looks at every tick.
#[test]
fn the_timer_is_the_one_that_looks_at_every_tick() {
    for words in [vec![600, 0, 0], vec![500, 520, 540, 560, 0], vec![2500, 2520, 2540, 2560], vec![3990, 0, 1, 1, 1390]]
    {
        for variant in [Variant::Published, Variant::Lossless] {
            for latency in [0, 5, 100, 300, 590].into_iter().step_by(crate::stride(4)) {
                let fast = pulses(Channel::new(variant, CMP7_NS, latency), &words);
                assert_eq!(fast, tick_by_tick(variant, latency, &words), "{variant:?} {latency} {words:?}");
            }
        }
    }
}

/// The ideal timer as it is described: one look at every 5 ns.
fn tick_by_tick(variant: Variant, latency: u16, words: &[u16]) -> Vec<(u64, u64)> {
    let mut sync0 = Sync0::new(variant);
    let (mut cmp1, mut cmp6, mut start, mut cfg) = (0u16, 0u16, 0u64, CMP_CFG_IDLE);
    let (mut armed, mut rise, mut fall, mut serve) = (true, None, None, None);
    let (mut p0, mut p6, mut p7) = (false, false, false);
    let (mut pulses, mut up) = (Vec::new(), 0);
    for tick in 0..800 * (words.len() as u64 + 3) {
        let count = tick % 800 * 5;
        let hit = |value: u16| u64::from(value) <= count && u64::from(value) + 5 > count;
        if cfg & 4 != 0 && hit(cmp1) && armed {
            (armed, rise) = (false, Some(tick + start + 1));
        }
        let (e0, e6, e7) = (count == 3995, cfg & 0x80 != 0 && hit(cmp6), count == 2000);
        (p0, p6, p7) = (p0 || e0, p6 || e6, p7 || e7);
        if e0 || e6 || e7 {
            serve = serve.or(Some(tick + u64::from(latency) / 5));
        }
        if rise == Some(tick) {
            (rise, up, fall) = (None, tick * 5, Some(tick + 400));
        }
        if fall == Some(tick) {
            fall = None;
            pulses.push((up, tick * 5));
        }
        if serve != Some(tick) {
            continue;
        }
        serve = None;
        let mut writes = Vec::new();
        if core::mem::take(&mut p6) {
            writes.extend(sync0.cmp6());
        }
        if core::mem::take(&mut p0) {
            writes.extend(sync0.cmp0());
        }
        if core::mem::take(&mut p7) {
            writes.extend(sync0.cmp7(words.get(tick as usize / 800).and_then(|&word| StartTime::new(word))));
        }
        for Write { register, value } in writes {
            match register {
                Register::CmpCfg => cfg = value,
                Register::Cmp1 => cmp1 = value,
                Register::Cmp6 => cmp6 = value,
                Register::SyncStart => start = value.into(),
                Register::SyncCtrl if value == 3 => armed = true,
                Register::SyncCtrl => {
                    (armed, rise) = (false, None);
                    if fall.take().is_some() {
                        pulses.push((up, tick * 5));
                    }
                }
            }
        }
    }
    pulses
}

#[test]
fn the_handler_never_runs_without_an_event() {
    let mut axis = Channel::new(Variant::Lossless, CMP7_NS, 100);
    let mut served = 0;
    while let Some(happening) = axis.next(40_000) {
        if let Activity::Served(run) = happening {
            assert!(run.events.cmp0 || run.events.cmp6 || run.events.cmp7);
            served += 1;
        }
    }
    assert_eq!(served, 19);
}

/// Every phase of a step, alone, after one of the same phase, and after a rest, with writes as events of their own: as
/// long as the last write is made before 600 ns, all come, and DIR is still for 200 ns around each rise.
#[test]
fn lossless_up_to_the_last_write_before_600_ns() {
    let stride = if cfg!(miri) { 499 } else { 1 };
    for write_ns in [0, 5, 10, 20, 40, 60] {
        let longest = (MAX_LATENCY_NS - 7 * write_ns) / 5 * 5;
        for latency in [0, longest / 10 * 5, longest] {
            for phase in (1..=3990).step_by(stride) {
                let words = [phase, phase, 0, phase, 0, 0, phase];
                assert_walk(Channel::new(Variant::Lossless, CMP7_NS, latency).with_write_time(write_ns), &words);
            }
        }
    }
}

#[test]
fn pairs_of_phases_with_writes_of_their_own() {
    let phases: Vec<u16> =
        (1..=3990).step_by(if cfg!(miri) { 1900 } else { 97 }).chain((1384..=1392).step_by(crate::stride(4))).collect();
    for &first in &phases {
        for &second in phases.iter().filter(|&&second| second >= first) {
            for (latency, write_ns) in [(170, 60), (450, 20), (590, 0)] {
                let axis = Channel::new(Variant::Lossless, CMP7_NS, latency).with_write_time(write_ns);
                assert_walk(axis, &[first, second, second, 0, second]);
            }
        }
    }
}

/// The walk can fail: above the bound, steps are lost, however the time is split between latency and writes.
#[test]
fn beyond_the_bound_steps_are_lost() {
    for (latency, write_ns) in [(610, 0), (540, 10), (470, 20), (330, 40), (190, 60)] {
        let lost = (1380..1400).any(|phase| {
            let axis = Channel::new(Variant::Lossless, CMP7_NS, latency).with_write_time(write_ns);
            pulses(axis, &[phase, phase, phase, 0]).len() < 3
        });
        assert!(lost, "{latency} + 7 x {write_ns}");
    }
}

/// Words with alternating DIR: all steps at their time and full width, DIR right at each and still around it.
fn assert_walk(mut axis: Channel, words: &[u16]) {
    use crate::pins::DIR_SETUP_HOLD_NS;
    use crate::pto::{Direction, Pto};
    let (mut rises, mut falls, mut changes, mut dir) = (Vec::new(), 0, Vec::new(), Direction::Low);
    let direction = |n: usize| if n % 2 == 0 { Direction::High } else { Direction::Low };
    for (n, &start) in words.iter().chain(&[0; 3]).enumerate() {
        axis.set_word(match StartTime::new(start) {
            Some(start) => Pto::Pulse { start, direction: direction(n) },
            None => Pto::NoPulse { direction: direction(n) },
        });
        while let Some(happening) = axis.next(4000 * (n as u64 + 1)) {
            match happening {
                Activity::Edge(Edge { ns, high: true }) => rises.push((ns, dir)),
                Activity::Edge(Edge { ns, .. }) => {
                    falls += 1;
                    assert_eq!(ns - rises[falls - 1].0, u64::from(PULSE_NS), "{words:?}");
                }
                Activity::Served(served) => {
                    if let Some(levels) = served.levels {
                        changes.push(served.ns);
                        dir = levels.direction;
                    }
                }
            }
        }
    }
    let want: Vec<_> = (0..).zip(words).filter(|(_, start)| **start != 0).collect();
    assert_eq!((rises.len(), falls), (want.len(), want.len()), "{words:?}");
    for ((rise, dir), (n, start)) in rises.iter().zip(want) {
        assert!(rise.abs_diff((n as u64 + 1) * 4000 + u64::from(*start)) < 10, "{words:?}");
        assert_eq!(*dir, direction(n), "{words:?}");
        assert!(changes.iter().all(|change| change.abs_diff(*rise) >= DIR_SETUP_HOLD_NS), "{words:?} {changes:?}");
    }
}

/// A deferred pulse is programmed when the handler of CMP0 runs, `latency` after the wrap: one before that is missed, and comes
/// a cycle later.
#[test]
fn deferred_programming_misses_what_is_before_its_handler() {
    for (latency, missed, made) in [(300, 295, 300), (200, 195, 200), (10, 5, 10)] {
        let of = |second| pulses(Channel::new(Variant::Published, 2000, latency), &[500, second]);
        let rise = |second: u16| of(second).get(1).map(|pulse| pulse.0);
        assert_eq!(rise(made), Some(8000 + u64::from(made) + 5), "{latency}");
        assert_ne!(rise(missed), Some(8000 + u64::from(missed) + 5), "{latency}");
    }
}

/// The lossless machine ends an overlapping pulse at 600 ns of the next cycle at the earliest: 3990 before the end of the pulse.
#[test]
fn an_overlapping_pulse_ends_600_ns_into_its_cycle_at_the_earliest() {
    for (start, cmp6) in [(1389, 3389), (1390, 600), (2585, 600), (2590, 600), (2591, 601), (3990, 2000)] {
        let mut generator = Sync0::new(Variant::Lossless);
        let writes: Vec<Write> = generator.cmp7(StartTime::new(start)).into_iter().collect();
        assert!(writes.contains(&Write { register: Register::Cmp6, value: cmp6 }), "{start}: {writes:?}");
    }
}
