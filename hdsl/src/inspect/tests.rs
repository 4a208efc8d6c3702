use super::*;
use crate::acceleration::DeltaDelta;
use crate::answer::Content;
use crate::parameter::EncoderSymbol;
use crate::symbol::{Character, RunningDisparity};
use std::string::ToString;

const NORMAL: Expected = Expected::Normal { at: None };

fn content() -> Content {
    Content {
        vertical: Character::data(0x42),
        parameter: EncoderByte::of(EncoderSymbol::Idle),
        pipe: Character::control(Control::K30_7),
        acceleration: DeltaDelta::new(-3),
        secondary: Character::data(0x17),
    }
}

fn line(content: Content) -> u128 {
    content.emit(RunningDisparity::Minus).bits.into()
}

fn window(bits: u128, len: u32) -> Window {
    Window::from_bits(bits, len).unwrap()
}

#[test]
fn a_sound_answer_has_no_fault() {
    let report = inspect(NORMAL, window(line(content()), 61));
    assert_eq!((report.error(), report.findings(), report.cause()), (None, Findings::NONE, None));
    assert!(report.disparity().holds());
    assert_eq!(report.answer().map(|answer| answer.vertical().byte()), Some(Ok(0x42)));
    assert_eq!((report.to_string().as_str(), score(window(line(content()), 61))), ("sound", PERFECT));
}

/// Each mistake is undone, and what stands there then is shown.
#[test]
fn mistakes_and_their_causes() {
    let good = line(content());
    let doubled = (0..61).fold(0, |all, at| all | ((good >> at & 1) * 3) << (2 * at));
    let ones = |bits: u32| (1_u128 << bits) - 1;
    for (line, cause) in [
        (window(good, 61).inverted(), LineCause::LineInverted),
        (window(good << 4 | ones(4), 80), LineCause::Shifted { bits: 4 }),
        (window(good << 12 | ones(12), 80), LineCause::Shifted { bits: 12 }),
        (window(doubled, 122), LineCause::HalfRate),
    ] {
        let report = inspect(NORMAL, line);
        assert!(report.error().is_some(), "{cause}");
        assert_eq!(report.cause(), Some(Cause::Line(cause)));
        assert_eq!(report.answer().map(crate::Answer::bits), Some(good as u64));
    }
    for (bits, cause) in [(0, LineCause::StuckLow), (u128::MAX, LineCause::StuckHigh)] {
        let report = inspect(NORMAL, window(bits, 73));
        assert_eq!((report.cause(), report.answer()), (Some(Cause::Line(cause)), None));
    }
    let report = inspect(NORMAL, window(TEST_PATTERN.into(), 61));
    assert_eq!(report.cause(), Some(Cause::TestPattern));
}

/// What is shown as the answer after a mistake is sound, switch bit and disparity included; noise has no cause.
#[test]
fn no_cause_is_made_up() {
    let good = line(content());
    let report = inspect(NORMAL, window((good ^ 1 << 50) << 4 | 15, 80));
    assert_eq!((report.cause(), report.answer()), (Some(LineCause::Disturbed.into()), None));
    // No word of the code, between short runs of either level.
    let noise = (0..61).fold(0_u128, |bits, at| bits | u128::from(at / 5 % 2 == 0 || at % 7 == 0) << at);
    let report = inspect(NORMAL, window(noise, 61));
    assert!(report.error().is_some() && score(window(noise, 61)) < PERFECT / 2);
    assert_eq!(report.cause(), None);
}

/// One flipped bit of the acceleration: its word is bad, or the check bits are wrong.
#[test]
fn one_flipped_bit_is_a_disturbance() {
    for at in 30..50 {
        let report = inspect(NORMAL, window(line(content()) ^ 1 << at, 61));
        assert_eq!(report.cause(), Some(Cause::Line(LineCause::Disturbed)), "{at}");
        assert_eq!(report.answer(), None);
        assert!(report.to_string().ends_with("; likely cause: single bits were disturbed"));
    }
}

/// Special characters have their places: K29.7 and K27.7 stand for a position, K28.y for STATUS2.
#[test]
fn characters_where_they_are_not_due() {
    let k29 = Content { vertical: Character::control(Control::K29_7), ..content() };
    let k27 = Content { secondary: Character::control(Control::K27_7), ..content() };
    let k28 = Content { secondary: Character::control(Control::K28_4), ..content() };
    for (content, mark, due) in [(k29, 0xfd, 1..=5), (k27, 0xfb, 1..=5), (k28, 0x9c, 0..=0)] {
        for at in 0..8 {
            let report = inspect(Expected::Normal { at: Some(at) }, window(line(content), 61));
            let want = (!due.contains(&at)).then_some(Error::WrongKind { byte: mark });
            assert_eq!(report.error(), want, "{at}");
        }
        assert_eq!(inspect(NORMAL, window(line(content), 61)).error(), None);
    }
}

/// Every kind of fault is found, and the first is the one that is reported.
#[test]
fn all_kinds_of_faults() {
    // Ten zeros in the vertical word; 12h is no symbol of an encoder.
    let undefined = Content { parameter: EncoderByte::new(0x12), ..content() };
    let report = inspect(NORMAL, window(line(undefined) & !0x3ff, 61));
    assert_eq!(report.error(), Some(Error::InvalidWord { word: 0 }));
    assert_eq!(report.findings().to_string(), "invalid_word undefined_symbol");
    let report = inspect(NORMAL, window(line(content()), 40));
    assert_eq!(report.error(), Some(Error::Truncated { got: 40, want: 61 }));
    assert_eq!(report.findings().to_string(), "truncated");
}

#[test]
fn answers_of_the_start_up() {
    let pattern = window(TEST_PATTERN.into(), 61);
    assert_eq!(inspect(Expected::TestPattern, pattern).error(), None);
    let report = inspect(Expected::TestPattern, window(u128::from(TEST_PATTERN) ^ 1 << 30, 61));
    assert_eq!(report.error(), Some(Error::Pattern));
    let id = EncoderId::new(0x00153).unwrap().to_answer(Character::data(0), RunningDisparity::Minus).bits;
    assert_eq!(inspect(Expected::Identifier, window(id.into(), 61)).error(), None);
    let late = inspect(Expected::Identifier, window(u128::from(id) << 2 | 3, 70));
    assert_eq!(late.cause(), Some(Cause::Line(LineCause::Shifted { bits: 2 })));
    assert_eq!(late.answer().map(EncoderId::from_answer), Some(Ok(EncoderId::new(0x00153).unwrap())));
}
