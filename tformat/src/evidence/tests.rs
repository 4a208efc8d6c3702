use super::*;
use crate::count::{Abm, Abs};
use crate::message::{AllData, MultiTurn, SingleTurn};
use crate::response::tests::exchanges;
use crate::status::Almc;
use proptest::prelude::*;
use servowire_core::{Angle, Words};
use std::string::ToString;
use std::vec::Vec;

const R23: Resolution = widths(23, 16);
const ANY_AGE: u64 = u64::MAX;
const STRICT: Policy = Policy::new(ANY_AGE);
const MULTI_TURN: Policy = STRICT.tolerating(Tolerated::MULTI_TURN);
const SINGLE_TURN: Policy = STRICT.tolerating(Tolerated::SINGLE_TURN);
const ALL: Policy = STRICT.tolerating(Tolerated::NOTHING.alarms(Almc::all()));

const fn widths(abs_bits: u8, abm_bits: u8) -> Resolution {
    match Resolution::new(abs_bits, abm_bits) {
        Ok(resolution) => resolution,
        Err(_) => panic!(),
    }
}

fn data(sf: u8, almc: u8) -> AllData {
    AllData {
        sf: StatusField::from_bits_retain(sf),
        abs: Abs::truncate(0x12_3456),
        enid: 0x17,
        abm: Abm::truncate(0xfffe),
        almc: Almc::from_bits_retain(almc),
    }
}

fn all(data: AllData) -> Evidence {
    Evidence::of(Response::ReadAll(data), R23, 1_000)
}

fn single(sf: u8, resolution: Resolution) -> Evidence {
    let single = SingleTurn { sf: StatusField::from_bits_retain(sf), abs: Abs::truncate(7) };
    Evidence::of(Response::ReadSingleTurn(single), resolution, 1_000)
}

fn doubt(evidence: Evidence, policy: Policy) -> Option<Doubt> {
    evidence.at(1_000, policy).err()
}

#[test]
fn a_position_without_doubt() {
    let sample = all(data(0, 0)).at(1_000, STRICT).unwrap();
    assert_eq!((sample.single_turn(), sample.turns(), sample.sampled_ns()), (0x12_3456, Some(-2), 1_000));
    assert_eq!(sample.to_string(), "turn -2, 1193046 counts at 1000 ns");
    let without_turns = single(0, widths(23, 0)).at(1_000, STRICT).unwrap();
    assert_eq!((without_turns.single_turn(), without_turns.turns()), (7, Some(0)));
}

/// 17 bits in the turn, 16 of turns, with and without a sign; half a turn is half of 2^32.
#[test]
fn the_units_of_a_position() {
    let at = |resolution: Resolution, abs, abm| {
        let data = AllData { abs: Abs::truncate(abs), enid: 0x11, abm: Abm::truncate(abm), ..data(0, 0) };
        Evidence::of(Response::ReadAll(data), resolution, 0).at(0, STRICT).unwrap()
    };
    let signed = at(widths(17, 16), 131_071, 0xffff);
    assert_eq!((signed.turns(), signed.counts()), (Some(-1), Some(-1)));
    let unsigned = at(widths(17, 16).with_unsigned_turns(), 131_071, 0xffff);
    assert_eq!((unsigned.turns(), unsigned.counts()), (Some(65_535), Some(8_589_934_591)));
    assert_eq!(at(widths(17, 16), 65_536, 0).angle(), Angle::HALF);
}

/// Who does not use the turns is not given any, however good or bad they are.
#[test]
fn a_single_turn_has_no_turns() {
    let without = |evidence: Evidence| {
        let sample = evidence.at(1_000, SINGLE_TURN).unwrap();
        assert_eq!((sample.turns(), sample.counts()), (None, None));
        sample.single_turn()
    };
    assert_eq!(without(all(data(0, 0))), 0x12_3456);
    // OF, BE, ME and BA, a count that is too wide, and ID 0 of an encoder with turns.
    assert_eq!(without(all(data(0x20, 0xe8))), 0x12_3456);
    assert_eq!(without(all(AllData { abm: Abm::truncate(0x1_0000), ..data(0, 0) })), 0x12_3456);
    assert_eq!(without(single(0, R23)), 7);
    assert_eq!(single(0, R23).at(1_000, SINGLE_TURN).unwrap().to_string(), "7 counts at 1000 ns");
}

/// Each alarm is a doubt unless the policy tolerates it, in ID 3 and, as far as SF tells, elsewhere.
#[test]
fn alarms() {
    // The drive whose tolerance this is: OF ignored, BA a warning; without turns BA, BE, ME and OS ignored too.
    for (policy, tolerated) in [(STRICT, 0), (MULTI_TURN, 0x88), (SINGLE_TURN, 0xe9), (ALL, 0xff)] {
        for bits in 0..=255_u8 {
            let sf = StatusField::of_alarms(Almc::from_bits_retain(bits)).bits();
            let alarms = Almc::from_bits_retain(bits & !tolerated);
            let want = (!alarms.is_empty()).then_some(Doubt::Alarms { alarms });
            assert_eq!(doubt(all(data(sf, bits)), policy), want);
            let doubtful = bits & 4 & !tolerated != 0 || (bits & 0xf0 != 0 && tolerated & 0xf0 != 0xf0);
            let want = doubtful.then_some(Doubt::Status { sf: StatusField::from_bits_retain(sf) });
            assert_eq!(doubt(single(sf, widths(23, 0)), policy), want, "{bits:#x}");
        }
    }
}

/// SF tells of an alarm that ALMC does not show: an encoder that leaves SF at 0 does not, damage does.
#[test]
fn a_status_without_its_alarm_is_a_doubt() {
    for (sf, almc, doubtful) in [(0x10, 0, true), (0x20, 0x04, true), (0x10, 0x80, true), (0, 0x84, false)] {
        let any = STRICT.tolerating(Tolerated::NOTHING.alarms(Almc::from_bits_retain(almc)));
        let want = doubtful.then_some(Doubt::Status { sf: StatusField::from_bits_retain(sf) });
        assert_eq!(doubt(all(data(sf, almc)), any), want, "{sf:#x} {almc:#x}");
    }
}

/// No tolerance helps against these.
#[test]
fn damage_and_shifts() {
    for policy in [STRICT, SINGLE_TURN, ALL] {
        let read = |sf: u8| doubt(all(data(sf, 0)), policy);
        assert_eq!(read(0x02), Some(Doubt::Shifted { sf: StatusField::DD1 }));
        assert_eq!(read(0x80), Some(Doubt::RequestDamaged { sf: StatusField::CA1 }));
        assert_eq!(read(0x40), Some(Doubt::RequestDamaged { sf: StatusField::CA0 }));
        let both = StatusField::CA0 | StatusField::EA1;
        assert_eq!(doubt(single(0x60, R23), policy), Some(Doubt::RequestDamaged { sf: both }));
    }
}

#[test]
fn fields_that_are_too_wide() {
    let wide = all(AllData { abs: Abs::truncate(0x92_3456), ..data(0, 0) });
    let want = Some(Doubt::UpperBits { value: 0x92_3456, excess: 0x80_0000 });
    assert_eq!((doubt(wide, STRICT), doubt(wide, SINGLE_TURN)), (want, want));
    let turns = all(AllData { abm: Abm::truncate(0xf1_0000), ..data(0, 0) });
    assert_eq!(doubt(turns, ALL), Some(Doubt::UpperBits { value: 0xf1_0000, excess: 0xf1_0000 }));
    let seventeen = widths(17, 16);
    let of = |data, resolution| Evidence::of(Response::ReadAll(data), resolution, 1_000).at(1_000, STRICT);
    assert_eq!(of(data(0, 0), seventeen), Err(Doubt::OtherEncoder { enid: 0x17, abs_bits: 17 }));
    let own_rules = of(data(0, 0), seventeen.with_upper_bits_ignored());
    assert_eq!(own_rules.map(Sample::single_turn), Ok(0x3456));
    // An encoder ID that no document knows says nothing.
    assert!(of(AllData { enid: 0x99, abs: Abs::truncate(5), ..data(0, 0) }, seventeen).is_ok());
}

#[test]
fn what_carries_no_position() {
    let turns = Response::ReadMultiTurn(MultiTurn { sf: StatusField::empty(), abm: Abm::truncate(1) });
    let evidence = Evidence::of(turns, R23, 1_000);
    assert_eq!((doubt(evidence, ALL), doubt(evidence, SINGLE_TURN)), (Some(Doubt::Absent), Some(Doubt::Absent)));
    // ABS alone is no position of an encoder that counts turns.
    assert_eq!(doubt(single(0, R23), ALL), Some(Doubt::Absent));
}

#[test]
fn never_is_a_doubt_at_any_time() {
    for now_ns in [0, 1, u64::MAX] {
        assert_eq!(Evidence::NEVER.at(now_ns, ALL), Err(Doubt::Never));
        assert_eq!(Evidence::NEVER.at(now_ns, Policy::new(0)), Err(Doubt::Never));
    }
    assert_eq!(Evidence::NEVER.to_string(), "no position was heard yet");
    assert_eq!(all(data(0, 0)).to_string(), "a position sampled at 1000 ns");
}

/// Sampled at 1,000 ns: 500 ns old is young enough, 501 ns is not, before and after. An old one is that first.
#[test]
fn the_age_of_a_position() {
    let policy = Policy::new(500);
    for (now_ns, age_ns) in [(500, None), (1_000, None), (1_500, None), (1_501, Some(501)), (499, Some(501))] {
        let want = age_ns.map(|age_ns| Doubt::Old { age_ns });
        assert_eq!(all(data(0, 0)).at(now_ns, policy).err(), want);
        if want.is_some() {
            assert_eq!(all(data(0x80, 0xff)).at(now_ns, policy).err(), want);
        }
    }
}

/// One of each flaw and doubt, as it was made and as it comes out of a cell.
fn every_doubt() -> Vec<Evidence> {
    let wide = |abs, abm| all(AllData { abs: Abs::truncate(abs), abm: Abm::truncate(abm), ..data(0, 0) });
    let turns = Response::ReadMultiTurn(MultiTurn { sf: StatusField::empty(), abm: Abm::truncate(1) });
    let other = Evidence::of(Response::ReadAll(data(0, 0)), widths(17, 24), u64::MAX);
    let mut every = Vec::from([Evidence::NEVER, Evidence::of(turns, R23, 5), other]);
    every.extend([wide(0xff_ffff, 0), wide(0, 0xff_ffff), wide(0, 0xffff), single(0, R23), single(0, widths(1, 0))]);
    every.extend((0..=255).flat_map(|bits| [all(data(bits, 0)), all(data(0, bits)), single(bits, R23)]));
    every
}

#[test]
fn through_a_cell_and_back() {
    for evidence in every_doubt() {
        let back = Evidence::from_words(evidence.to_words());
        assert_eq!(back, evidence);
        for policy in [STRICT, MULTI_TURN, SINGLE_TURN, ALL] {
            assert_eq!(back.at(5, policy), evidence.at(5, policy));
        }
    }
    let mut cell = servowire_core::Cell::<Evidence, 5>::new();
    let (mut writer, mut reader) = cell.split();
    assert_eq!(reader.at(1_000, STRICT), Err(Doubt::Never));
    writer.put(all(data(0, 0)));
    assert_eq!(reader.at(1_000, STRICT).map(Sample::turns), Ok(Some(-2)));
}

proptest! {
    /// Words that no evidence has become anything, and nothing breaks.
    #[test]
    fn any_words(words: [u32; 5], now_ns: u64) {
        let evidence = Evidence::from_words(words);
        for policy in [STRICT, SINGLE_TURN, Policy::new(0)] {
            match evidence.at(now_ns, policy) {
                Ok(sample) => prop_assert!(sample.counts().is_some() || policy == SINGLE_TURN),
                Err(doubt) => prop_assert!(!doubt.to_string().is_empty()),
            }
        }
        prop_assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
    }

    /// Any response in any widths: what is given fits the widths, and a stricter policy gives nothing more.
    #[test]
    fn what_is_given_fits((_, response) in exchanges(), abs_bits in 1..=24_u8, abm_bits in 0..=24_u8, ignored: bool) {
        let resolution = widths(abs_bits, abm_bits);
        let resolution = if ignored { resolution.with_upper_bits_ignored() } else { resolution };
        let evidence = Evidence::of(response, resolution, 9);
        let [strict, turns, lax] = [STRICT, MULTI_TURN, SINGLE_TURN].map(|policy| evidence.at(9, policy));
        prop_assert!(strict.is_err() || strict == turns);
        prop_assert!(turns.is_err() || lax.is_ok());
        if let Ok(sample) = lax {
            prop_assert!(sample.single_turn() < resolution.counts_per_turn());
        }
        if let Ok(sample) = turns {
            prop_assert!(sample.turns().is_some_and(|turns| i64::from(turns).abs() << 1 <= 1 << abm_bits));
        }
    }

    #[test]
    fn counts_are_turns_and_single_turn(abs_bits in 1..=24_u8, abm_bits in 0..=24_u8, low: u32, high: u32, signed: bool) {
        let resolution = widths(abs_bits, abm_bits);
        let resolution = if signed { resolution } else { resolution.with_unsigned_turns() };
        let (low, high) = (low & ((1 << abs_bits) - 1), high & ((1 << abm_bits) - 1));
        let fields = AllData { abs: Abs::truncate(low), enid: 0, abm: Abm::truncate(high), ..data(0, 0) };
        let sample = Evidence::of(Response::ReadAll(fields), resolution, 0).at(0, STRICT).unwrap();
        let full = 1_i64 << abm_bits;
        let turns = if signed && i64::from(high) * 2 >= full && abm_bits > 0 { i64::from(high) - full } else { i64::from(high) };
        prop_assert_eq!(sample.turns().map(i64::from), Some(turns));
        prop_assert_eq!(sample.counts(), Some(turns * (1 << abs_bits) + i64::from(low)));
        prop_assert_eq!(u64::from(sample.angle().to_bits()), u64::from(low) << (32 - abs_bits));
    }
}

/// 17 bits of turns where the encoder has 16: what is too much is told.
#[test]
fn what_is_beyond_the_width_of_the_turns_is_told() {
    let wide = AllData { abm: Abm::truncate(0x1_fffe), ..data(0, 0) };
    assert_eq!(all(wide).at(1_000, STRICT), Err(Doubt::UpperBits { value: 0x1_fffe, excess: 0x1_0000 }));
}

#[test]
fn alarms_that_are_tolerated_twice_are_tolerated() {
    let once = Tolerated::NOTHING.alarms(Almc::BE);
    assert_eq!(once.alarms(Almc::BE), once);
}
