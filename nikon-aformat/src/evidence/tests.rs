use super::*;
use crate::command::Command;
use crate::data::Data;
use crate::number::{EncoderAddress, U17, U40};
use crate::response::tests::exchanges;
use crate::status::{Alm, PmAlm};
use proptest::prelude::*;
use servowire_core::U24;
use servowire_core::{Feedback, Words};
use std::string::ToString;

const EA: EncoderAddress = EncoderAddress::ZERO;
const NONE: EncoderStatus = EncoderStatus::empty();
/// Nothing is tolerated, and time stands still.
const STRICT: Policy = Policy::new(0);

fn twenty() -> Resolution {
    Resolution::new(20, 16).unwrap()
}

fn judged(resolution: Resolution, response: Response, policy: Policy) -> Result<(u32, Option<i32>), Doubt> {
    let sample = Evidence::of(response, resolution, 7).at(7, policy)?;
    Ok((sample.single_turn(), sample.turns()))
}

/// The turns are not used, and nothing else is tolerated.
const SINGLE: Tolerated = Tolerated::ANY_TURNS;

fn response(command: Command, es: EncoderStatus, data: Data) -> Response {
    Response::new(EA, command, es, data)
}

fn low(es: EncoderStatus, alm: Alm) -> Response {
    response(Command::Abs24Status, es, Data::Abs24Status { abs: U24::truncate(0x40_0005), alm })
}

#[test]
fn every_status_and_every_alarm_is_a_doubt() {
    let abs = U40::truncate(5);
    for bits in 0..16 {
        let es = EncoderStatus::from_bits_truncate(bits);
        let whole = response(Command::Abs40, es, Data::Abs40 { abs });
        let want = if es.is_empty() { Ok((5, Some(0))) } else { Err(Doubt::Status { es }) };
        assert_eq!(judged(twenty(), whole, STRICT), want);
        let lenient = STRICT.tolerating(Tolerated::NOTHING.status(es));
        assert_eq!(judged(twenty(), whole, lenient), Ok((5, Some(0))));
        let direct = Evidence::of_abs40(Abs40 { ea: EA, es, abs }, twenty(), 7);
        assert_eq!(direct, Evidence::of(whole, twenty(), 7));
    }
    for alm in Alm::all().iter() {
        assert_eq!(judged(twenty(), low(NONE, alm), STRICT.tolerating(SINGLE)), Err(Doubt::Alarms { alarms: alm }));
        assert_eq!(judged(twenty(), low(NONE, alm), STRICT.tolerating(SINGLE.alarms(alm))), Ok((5, None)));
    }
}

/// The drive whose policy this is lives with BATT where it does not count turns, and with nothing else.
#[test]
fn an_encoder_without_its_battery_turns_all_the_same() {
    let policy = STRICT.tolerating(Tolerated::SINGLE_TURN);
    for alm in Alm::all().iter() {
        let shown = judged(twenty(), low(EncoderStatus::of_alarms(alm), alm), policy);
        assert_eq!(shown.is_ok(), alm == Alm::BATT, "{alm}");
    }
}

/// Turn 100 of a 20-bit encoder leaves 4 in the 24 bits of a short response: no turns, rather than four of them.
#[test]
fn turns_are_whole_or_absent() {
    let abs = twenty().compose(0xabcde, 100);
    let short = response(Command::Abs24Low, NONE, Data::Abs24 { abs: abs.low24() });
    assert_eq!(short.abs(), Some(0x4a_bcde));
    assert_eq!(judged(twenty(), short, STRICT), Err(Doubt::Absent));
    assert_eq!(judged(twenty(), short, STRICT.tolerating(SINGLE)), Ok((0xabcde, None)));
    assert_eq!(judged(Resolution::new(20, 4).unwrap(), short, STRICT), Ok((0xabcde, Some(4))));
    assert_eq!(judged(Resolution::new(23, 0).unwrap(), short, STRICT), Ok((0x4a_bcde, Some(0))));
    let whole = response(Command::Abs40, NONE, Data::Abs40 { abs });
    assert_eq!(judged(twenty(), whole, STRICT), Ok((0xabcde, Some(100))));
    let back = response(Command::Abs40, NONE, Data::Abs40 { abs: twenty().compose(3, u32::MAX) });
    assert_eq!(judged(twenty(), back, STRICT), Ok((3, Some(-1))));
    assert_eq!(judged(twenty(), back, STRICT.tolerating(SINGLE)), Ok((3, None)));
}

#[test]
fn what_is_no_position() {
    let upper = response(Command::Abs24High, NONE, Data::Abs24High { abs: U24::truncate(5) });
    let status = Data::Status { alm: Alm::empty(), pm_alm: PmAlm::empty() };
    let short = Response::abs17(EA, NONE, U17::truncate(5));
    for other in [upper, response(Command::Status, NONE, status), short] {
        assert_eq!(judged(twenty(), other, STRICT.tolerating(SINGLE)), Err(Doubt::Absent));
    }
    let seventeen = Resolution::new(17, 16).unwrap();
    assert_eq!(judged(seventeen, short, STRICT), Err(Doubt::Absent));
    assert_eq!(judged(seventeen, short, STRICT.tolerating(SINGLE)), Ok((5, None)));
    let doubtful = Response::abs17(EA, EncoderStatus::BATT, U17::truncate(5));
    let all_but_one = SINGLE.status(EncoderStatus::all().difference(EncoderStatus::ERROR));
    assert_eq!(judged(seventeen, doubtful, STRICT.tolerating(all_but_one)), Err(Doubt::AnyStatus));
    let all = SINGLE.status(EncoderStatus::all());
    assert_eq!(judged(seventeen, doubtful, STRICT.tolerating(all)), Ok((5, None)));
    for policy in [STRICT, STRICT.tolerating(SINGLE)] {
        let wide = response(Command::Abs40, NONE, Data::Abs40 { abs: U40::truncate(1 << 36) });
        assert_eq!(judged(twenty(), wide, policy), Err(Doubt::UpperBits { width: 36 }));
    }
}

/// Doubts in their order: an old position with alarms is old, and nothing is said of what never was.
#[test]
fn age_and_nothing_yet() {
    let evidence = Evidence::of(low(EncoderStatus::ERROR, Alm::STERR), twenty(), 1_000);
    let policy = Policy::new(500);
    assert_eq!(evidence.at(1_501, policy), Err(Doubt::Old { age_ns: 501 }));
    assert_eq!(evidence.at(499, policy), Err(Doubt::Old { age_ns: 501 }));
    assert_eq!(evidence.at(1_500, policy), Err(Doubt::Absent));
    assert_eq!(evidence.at(1_500, policy.tolerating(SINGLE)), Err(Doubt::Status { es: EncoderStatus::ERROR }));
    assert_eq!(Evidence::default().at(0, Policy::new(u64::MAX)), Err(Doubt::Never));
    assert_eq!(Feedback::at(&Evidence::NEVER, u64::MAX, STRICT), Err(Doubt::Never));
}

/// Turn -1 and three counts of 2^20; a quarter of a turn is 90 degrees.
#[test]
fn the_units_of_a_sample() {
    let sample = |abs| {
        let whole = response(Command::Abs40, NONE, Data::Abs40 { abs });
        Evidence::of(whole, twenty(), 34).at(34, STRICT).unwrap()
    };
    let back = sample(twenty().compose(3, u32::MAX));
    assert_eq!((back.counts(), back.sampled_ns()), (Some(-1_048_573), 34));
    assert_eq!((back.single_turn(), back.turns()), (3, Some(-1)));
    assert_eq!(back.to_string(), "turn -1, 3 counts at 34 ns");
    assert_eq!(sample(twenty().compose(0x4_0000, 0)).angle().millidegrees(), 90_000);
}

#[test]
fn as_a_log_shows_them() {
    assert_eq!(Doubt::Status { es: EncoderStatus::BATT }.to_string(), "the encoder shows BATT");
    assert_eq!(Tolerated::NOTHING.to_string(), "status - and alarms -");
    assert_eq!(Tolerated::SINGLE_TURN.to_string(), "status BATT and alarms BATT, any turns");
    assert_eq!(Evidence::NEVER.to_string(), "no position was heard yet");
}

proptest! {
    /// Nothing is lost in the words of a cell.
    #[test]
    fn words_and_back((_, _, response) in exchanges(), st in 1..=32_u8, mt in 0..=8_u8, sampled_ns: u64) {
        let resolution = Resolution::new(st, mt).unwrap();
        for evidence in [Evidence::of(response, resolution, sampled_ns), Evidence::NEVER] {
            prop_assert_eq!(Evidence::from_words(evidence.to_words()), evidence);
        }
    }
}
