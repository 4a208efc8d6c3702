//! For tools: looks at a line that was refused, lists every fault and guesses the cause.
//!
//! Decoders stop at the first fault and return no value, which is right for a drive and unhelpful at a bench. Here all
//! frames are read whatever their framing, and the usual mistakes (swapped wires, wrong bit order, some bits early or late, own
//! echo, wrong rate, other encoder, other command, other layout) are undone one by one: the one that makes the
//! response sound is the cause.
//!
//! ```
//! use nikon_aformat::inspect::{Cause, LineCause, inspect};
//! use nikon_aformat::{Data, EncoderAddress, EncoderStatus, Operation, Resolution, Request, Response, U24};
//!
//! let request = Request::new(EncoderAddress::ZERO, Operation::Abs24Low);
//! let data = Data::Abs24 { abs: U24::truncate(0x12_3456) };
//! let answer = Response::new(EncoderAddress::ZERO, request.command(), EncoderStatus::empty(), data);
//! // A and B exchanged: every level is inverted
//! let report = inspect(request, Resolution::default(), answer.emit().line().inverted());
//! assert_eq!(report.cause(), Some(Cause::Line(LineCause::LineInverted)));
//! assert_eq!(report.response(), Some(answer));
//! ```

use nrz_line::{BitOrder, Search, Window};

use crate::command::Command;
use crate::error::{Error, ErrorClass};
use crate::expected::Expected;
use crate::layout::{FRAME_BITS, Layout};
use crate::number::EncoderAddress;
use crate::raw_response::{Crc, RawResponse};
use crate::request::Request;
use crate::resolution::Resolution;
use crate::response::Response;

pub use nrz_line::Cause as LineCause;

/// One frame, read without judging it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RawFrame {
    /// The content bits, the first on the line in bit 0.
    pub content: u16,
    /// Whether the start bit reads 0.
    pub start_ok: bool,
    /// Whether the delimiter reads 1.
    pub delimiter_ok: bool,
}

/// What a frame is, judged by its sync code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Kind {
    /// A frame of a request.
    Request,
    /// The first frame of a response.
    Response,
    /// Neither: a later frame of a response, or a damaged one.
    Other,
}

impl Kind {
    /// Classifies a frame by its content bits, the first on the line in bit 0. Later frames of a response may hold anything, so
    /// call this only where a request or a response can begin.
    pub const fn of(content: u16) -> Self {
        match content & 7 {
            2 => Self::Request,
            4 => Self::Response,
            _ => Self::Other,
        }
    }
}

/// What most likely went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// The line itself was damaged, or is connected or read in the wrong way.
    Line(LineCause),
    /// A sound response of another encoder.
    OtherEncoder {
        /// The encoder that answered.
        ea: EncoderAddress,
    },
    /// A sound response to another command.
    OtherCommand {
        /// The command that was answered.
        answered: Command,
    },
    /// A sound response to this command in another layout: the resolution does not know the factory setting of the encoder.
    OtherLayout {
        /// The layout of the response.
        layout: Layout,
    },
}

servowire_core::one_line!(Cause {
    Self::Line(cause) => "{}", cause;
    Self::OtherEncoder { ea } => "this is a sound response of encoder {}", ea;
    Self::OtherCommand { answered } => "this is a sound response to command {}, {}", answered.code(), answered;
    Self::OtherLayout { layout } => "this is a sound response in layout {}: the encoder's factory setting differs", layout;
});

/// The result of an inspection of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report {
    error: Option<Error>,
    findings: Findings,
    cause: Option<Cause>,
    response: Option<Response>,
    crc: Option<Crc>,
    #[cfg_attr(feature = "serde", serde(skip))]
    frames: [RawFrame; RawResponse::MAX_FRAMES],
    #[cfg_attr(feature = "serde", serde(skip))]
    len: u8,
}

servowire_core::report! {
    Self { response: Some(response), .. } => "sound: {}", response;
    // Never: there is a response or an error.
    _ => "nothing";
}

impl Report {
    /// The response as received if nothing is wrong, otherwise as it would be without the cause. For display only.
    pub const fn response(&self) -> Option<Response> {
        self.response
    }

    /// The CRC-8, if the line holds all frames.
    pub const fn crc(&self) -> Option<Crc> {
        self.crc
    }

    /// The whole frames of the line on its grid, at most as many as the response has.
    pub fn frames(&self) -> &[RawFrame] {
        self.frames.get(..usize::from(self.len)).unwrap_or(&self.frames)
    }
}

/// Inspects line bits that should hold the response to `request`.
pub fn inspect(request: Request, resolution: Resolution, line: Window) -> Report {
    let expected = request.expected(resolution);
    let outcome = Response::parse_line(&expected, line);
    let (cause, response) = match outcome {
        Ok(response) => (None, Some(response)),
        Err(error) => diagnose(request, &expected, line, error),
    };
    let (frames, len) = raw_frames(line, expected.layout());
    let raw = whole(&frames, len, expected.layout());
    let (crc, error) = (raw.map(|raw| raw.crc()), outcome.err());
    let mut report = Report { error, findings: Findings::NONE, cause, response, crc, frames, len };
    report.findings = findings(&report, &expected);
    report
}

/// Looks for the usual mistakes: those of the line, and the response of another encoder.
fn diagnose(request: Request, expected: &Expected, line: Window, error: Error) -> (Option<Cause>, Option<Response>) {
    if let Some(stuck) = LineCause::stuck(line) {
        return (Some(stuck.into()), None);
    }
    if let Some((cause, response)) = other_party(expected, line) {
        return (Some(cause), Some(response));
    }
    let frames = request.emit();
    let sent = match frames.as_slice() {
        [frame] => Some(frame.line()),
        _ => None,
    };
    // The first bits are a start bit and two bits of the sync code, all 0, so up to three can be put back.
    let search = Search::new().with_sent(sent).with_late_bits(20).with_early_bits(3);
    if let Some(found) = search.find(line, |line| Response::parse_line(expected, line).ok()) {
        return (Some(found.cause.into()), found.message);
    }
    (matches!(error, Error::Crc { .. }).then_some(LineCause::Disturbed.into()), None)
}

/// Looks for a sound response from another encoder, to something else or in another layout. The CRC-8 is checked in any case.
fn other_party(expected: &Expected, line: Window) -> Option<(Cause, Response)> {
    let any = expected.any_address();
    if let Ok(response) = Response::parse_line(&any, line) {
        return Some((Cause::OtherEncoder { ea: response.ea }, response));
    }
    let code = line.bits() >> 7 & 31;
    let answered = u8::try_from(code).ok().and_then(Command::from_code)?;
    answered.layouts().into_iter().find_map(|layout| {
        // The short form does not say what it answers.
        let layout = Some(layout).filter(|layout| *layout != Layout::Abs17)?;
        let response = Response::parse_line(&Expected::new(layout, answered), line).ok()?;
        let same = answered == expected.command();
        let cause = if same { Cause::OtherLayout { layout } } else { Cause::OtherCommand { answered } };
        Some((cause, response))
    })
}

#[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
fn raw_frames(line: Window, layout: Layout) -> ([RawFrame; RawResponse::MAX_FRAMES], u8) {
    let mut frames = [RawFrame { content: 0, start_ok: false, delimiter_ok: false }; RawResponse::MAX_FRAMES];
    let mut len = 0_u8;
    for frame in frames.iter_mut().take(usize::from(layout.frames())) {
        let at = u32::from(len).wrapping_mul(FRAME_BITS);
        let Some(delimiter) = line.get(at.wrapping_add(17)) else { break };
        let content = (line.bits() >> at.wrapping_add(1)) as u16;
        *frame = RawFrame { content, start_ok: line.get(at) == Some(false), delimiter_ok: delimiter };
        len = len.wrapping_add(1);
    }
    (frames, len)
}

/// Returns the frames as a response, whatever their framing.
fn whole(frames: &[RawFrame; RawResponse::MAX_FRAMES], len: u8, layout: Layout) -> Option<RawResponse> {
    let words = frames.map(|frame| frame.content);
    let words = words.get(..usize::from(len))?;
    RawResponse::from_words(layout, words, BitOrder::LsbFirst).ok()
}

fn findings(report: &Report, expected: &Expected) -> Findings {
    let mut set = Findings::default();
    let mut add = |class, found: bool| {
        if found {
            set.insert(class);
        }
    };
    add(ErrorClass::Truncated, report.len < expected.layout().frames());
    add(ErrorClass::StartBit, report.frames().iter().any(|frame| !frame.start_ok));
    add(ErrorClass::Delimiter, report.frames().iter().any(|frame| !frame.delimiter_ok));
    add(ErrorClass::Crc, report.crc.is_some_and(|crc| crc.got != crc.want));
    if let Some(first) = report.frames().first().map(|frame| frame.content) {
        let full = expected.layout() != Layout::Abs17;
        let (ea, code) = (first >> 3 & 7, first >> 6 & 31);
        add(ErrorClass::SyncCode, Kind::of(first) != Kind::Response);
        add(ErrorClass::FixedBit, full && first >> 11 & 1 == 1);
        add(ErrorClass::AddressMismatch, expected.ea().is_some_and(|want| u16::from(want.get()) != ea));
        add(ErrorClass::CommandMismatch, full && u16::from(expected.command().code()) != code);
    }
    if let Some(error @ (Error::BankError | Error::EchoMismatch { .. })) = report.error {
        add(error.class(), true);
    }
    set
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::tests::exchanges;
    use proptest::prelude::*;
    use std::string::ToString;

    fn cause(request: Request, line: Window) -> Option<Cause> {
        inspect(request, Resolution::default(), line).cause()
    }

    fn plain() -> impl Strategy<Value = (Request, Response)> {
        exchanges().prop_filter_map("as the default resolution answers", |(request, expected, response)| {
            (request.expected(Resolution::default()) == expected).then_some((request, response))
        })
    }

    fn window(bits: u128, len: u32) -> Window {
        Window::from_bits(bits, len.min(128)).unwrap()
    }

    /// A response that is cut off, and one whose fixed bit, bit 11 of the first frame, is 1.
    #[test]
    fn what_is_missing_and_what_is_fixed_is_listed() {
        let request = Request::new(crate::EncoderAddress::ZERO, crate::Operation::Abs40);
        let data = crate::Data::Abs40 { abs: crate::U40::truncate(1) };
        let status = crate::EncoderStatus::empty();
        let line = Response::new(request.ea, crate::Command::Abs40, status, data).emit().line();
        let findings = |line| inspect(request, Resolution::default(), line).findings();
        assert!(findings(window(line.bits(), 54)).iter().any(|class| class == ErrorClass::Truncated));
        assert!(!findings(line).iter().any(|class| class == ErrorClass::Truncated));
        // One start bit is before it.
        let fixed = window(line.bits() | 1 << 12, line.len());
        assert!(findings(fixed).iter().any(|class| class == ErrorClass::FixedBit));
    }

    proptest! {
        #[test]
        fn a_good_response_has_no_findings((request, response) in plain()) {
            let report = inspect(request, Resolution::default(), response.emit().line());
            prop_assert!(report.findings().is_empty() && report.error().is_none() && report.cause().is_none());
            prop_assert_eq!(report.response(), Some(response));
            prop_assert_eq!(report.frames().len(), usize::from(response.layout().frames()));
        }

        #[test]
        fn usual_mistakes_are_named((request, response) in plain(), idle in 1..20_u32) {
            let line = response.emit().line();
            prop_assert_eq!(cause(request, line.inverted()), Some(Cause::Line(LineCause::LineInverted)));
            let late = window(line.bits() << idle | ((1 << idle) - 1), line.len() + idle);
            let early = line.skip(2).unwrap();
            let early = window(early.bits() | u128::MAX << early.len(), line.len());
            // One in some 100,000 is sound inverted or in the other order too, which is named first.
            let is_sound = |line| inspect(request, Resolution::default(), line).error().is_none();
            for (line, bits) in [(late, idle as i8), (early, -2)] {
                let want = match () {
                    () if is_sound(line.inverted()) => Cause::Line(LineCause::LineInverted),
                    () if is_sound(line.reordered()) => Cause::Line(LineCause::WrongBitOrder),
                    () => Cause::Line(LineCause::Shifted { bits }),
                };
                prop_assert_eq!(cause(request, line), Some(want));
            }
            for at in 1..17 {
                let report = inspect(request, Resolution::default(), window(line.bits() ^ 1 << at, line.len()));
                prop_assert!(report.findings().contains(ErrorClass::Crc));
            }
        }

        #[test]
        fn other_parties((request, response) in plain()) {
            prop_assume!(request.expected(Resolution::default()).ea().is_some());
            let ea = EncoderAddress::truncate(request.ea.get() + 1);
            let other = Response { ea, ..response };
            let report = inspect(request, Resolution::default(), other.emit().line());
            prop_assert_eq!((report.cause(), report.response()), (Some(Cause::OtherEncoder { ea }), Some(other)));
        }

        /// Whatever is on the line, there is a report, and a value in it only with a sound CRC-8.
        #[test]
        fn anything_goes((request, _) in plain(), bits: u128, len in 0..=128_u32) {
            let report = inspect(request, Resolution::default(), window(bits, len));
            prop_assert_eq!(report.error().is_none(), report.cause().is_none() && report.response().is_some());
        }
    }

    #[test]
    fn echo_layout_and_dead_lines() {
        use crate::data::Data;
        use crate::number::U40;
        use crate::operation::Operation;
        use crate::status::EncoderStatus;
        use servowire_core::U24;
        let request = Request::new(EncoderAddress::ZERO, Operation::Abs24Low);
        let answer =
            |data| Response::new(EncoderAddress::ZERO, request.command(), EncoderStatus::empty(), data).emit().line();
        let line = answer(Data::Abs24 { abs: U24::truncate(77) });
        let frames = request.emit();
        let echo = frames.as_slice()[0].line();
        let both = echo.bits() | 0b1_1111 << 18 | line.bits() << 23;
        assert_eq!(cause(request, window(both, 77)), Some(Cause::Line(LineCause::OwnEcho)));
        assert_eq!(cause(request, window(echo.bits() | u128::MAX << 18, 60)), Some(Cause::Line(LineCause::OnlyEcho)));
        let wide = answer(Data::Abs40Vel { abs: U40::truncate(5), velocity: -1 });
        assert_eq!(cause(request, wide), Some(Cause::OtherLayout { layout: Layout::Abs40Vel }));
        assert_eq!(cause(request, window(0, 54)), Some(Cause::Line(LineCause::StuckLow)));
        assert_eq!(cause(request, window(u128::MAX, 54)), Some(Cause::Line(LineCause::StuckHigh)));
        let double = (0..54).fold(0_u128, |bits, at| bits | ((line.bits() >> at & 1) * 3) << (2 * at));
        assert_eq!(cause(request, window(double, 108)), Some(Cause::Line(LineCause::HalfRate)));
        assert!(Cause::OtherEncoder { ea: EncoderAddress::MAX }.to_string().ends_with("encoder 7"));
        assert_eq!(
            (Kind::of(echo.bits() as u16 >> 1), Kind::of(line.bits() as u16 >> 1)),
            (Kind::Request, Kind::Response)
        );
    }
}
