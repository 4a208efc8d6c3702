//! For tools: looks at a line that was refused, lists every fault and guesses the cause.
//!
//! Decoders stop at the first fault and return no value, which is right for a drive and unhelpful at a bench. Here all fields
//! are read whatever their framing, and the usual mistakes (swapped wires, wrong bit order, one bit early or
//! late, own echo, wrong rate, wrong data ID) are undone one by one: the one that makes the frame sound is the cause.
//!
//! ```
//! use tformat::inspect::{Cause, LineCause, inspect};
//! use tformat::{Abs, Request, Response, SingleTurn, StatusField};
//!
//! let answer = Response::ReadSingleTurn(SingleTurn { sf: StatusField::empty(), abs: Abs::truncate(0x1d4b) });
//! // A and B exchanged: every level is inverted
//! let report = inspect(Request::ReadSingleTurn, answer.emit().line().inverted());
//! assert_eq!(report.cause(), Some(Cause::Line(LineCause::LineInverted)));
//! assert_eq!(report.response(), Some(answer));
//! ```

use nrz_line::{Search, Window};

use crate::crc::crc;
use crate::data_id::{ControlField, DataId};
use crate::error::{Error, ErrorClass};
use crate::frame::Frame;
use crate::master::parse_echoed;
use crate::request::Request;
use crate::response::Response;

pub use nrz_line::Cause as LineCause;

/// One field, read without judging it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RawField {
    /// The data bits.
    pub byte: u8,
    /// Whether the start bit reads 0.
    pub start_ok: bool,
    /// Whether the delimiter reads 1.
    pub delimiter_ok: bool,
}

/// What most likely went wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// The line itself was damaged, or is connected or read in the wrong way.
    Line(LineCause),
    /// A sound response to another data ID.
    OtherDataId {
        /// The data ID that was answered.
        answered: DataId,
    },
    /// A sound ID 3 frame that was not requested: the encoder found the request damaged.
    RequestRefused,
}

servowire_core::one_line!(Cause {
    // The vendor calls a whole response a frame.
    Self::Line(LineCause::Shifted { bits }) if *bits > 0 => "the frame begins {} bit(s) later than it was taken", bits;
    Self::Line(LineCause::Shifted { bits }) => "{} bit(s) at the beginning of the frame are missing", bits.unsigned_abs();
    Self::Line(LineCause::OwnEcho) => "our own request came back before the answer: remove the echo";
    Self::Line(cause) => "{}", cause;
    Self::OtherDataId { answered } => "this is a sound response to {}", answered;
    Self::RequestRefused => "the encoder found the request damaged and answered with ID 3";
});

/// The result of an inspection of a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report {
    error: Option<Error>,
    findings: Findings,
    cause: Option<Cause>,
    response: Option<Response>,
    #[cfg_attr(feature = "serde", serde(skip))]
    fields: [RawField; Frame::MAX_FIELDS],
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

    /// The whole fields of the line on its grid, at most as many as the response has.
    pub fn fields(&self) -> &[RawField] {
        self.fields.get(..usize::from(self.len)).unwrap_or(&self.fields)
    }
}

/// Inspects line bits that should hold the response to `request`.
pub fn inspect(request: Request, line: Window) -> Report {
    let outcome = Response::parse_line(request, line);
    let (cause, response) = match outcome {
        Ok(response) => (None, Some(response)),
        Err(error) => diagnose(request, line, error),
    };
    let (fields, len) = raw_fields(line, request.data_id().response_fields());
    let mut report = Report { error: outcome.err(), findings: Findings::NONE, cause, response, fields, len };
    report.findings = findings(request, &report);
    report
}

/// Inspects UART bytes that should hold the response to `request`.
pub fn inspect_bytes(request: Request, bytes: &[u8]) -> Report {
    let end = bytes.len().min(Frame::MAX_FIELDS);
    let line = bytes.get(..end).and_then(Frame::new).map_or(Window::EMPTY, Frame::line);
    let mut report = inspect(request, line);
    // An echo in front pushes the end of the response out of the eleven fields.
    if let Ok(response) = parse_echoed(request, bytes) {
        report.cause = Some(LineCause::OwnEcho.into());
        report.response = Some(response);
    }
    report
}

/// Looks for the usual mistakes: those of the line, and a response to something else.
fn diagnose(request: Request, line: Window, error: Error) -> (Option<Cause>, Option<Response>) {
    if let Error::Rejected { .. } = error {
        let response = Response::parse_line(Request::ReadAll, line).ok();
        return (Some(Cause::RequestRefused), response);
    }
    if let Some(stuck) = LineCause::stuck(line) {
        return (Some(stuck.into()), None);
    }
    let need = u32::from(request.data_id().response_fields()).wrapping_mul(Frame::FIELD_BITS);
    // Missing bits are completed with idle line at the end; one bit missing was the start bit.
    let search = Search::new()
        .with_sent(Some(request.emit().line()))
        .with_late_bits(9)
        .with_early_bits(1)
        .with_complete_to(need);
    if let Some(found) = search.find(line, |line| Response::parse_line(request, line).ok()) {
        return (Some(found.cause.into()), found.message);
    }
    if let Some((answered, response)) = other_data_id(request, line) {
        return (Some(Cause::OtherDataId { answered }), Some(response));
    }
    let disturbed = matches!(error, Error::Crc { .. } | Error::Parity { .. } | Error::SinkCode { .. });
    (disturbed.then_some(LineCause::Disturbed.into()), None)
}

/// Looks for a sound response to something else.
fn other_data_id(request: Request, line: Window) -> Option<(DataId, Response)> {
    let cf = Frame::from_line(line, 1).ok()?;
    let answered = ControlField::parse(*cf.as_bytes().first()?).ok()?.data_id().ok()?;
    let frame = Frame::from_line(line, answered.response_fields()).ok()?;
    let asked = Request::answered_by(frame.as_bytes()).ok()?;
    let response = Response::parse(asked, frame.as_bytes()).ok()?;
    (answered != request.data_id()).then_some((answered, response))
}

fn raw_fields(line: Window, want: u8) -> ([RawField; Frame::MAX_FIELDS], u8) {
    let mut fields = [RawField { byte: 0, start_ok: false, delimiter_ok: false }; Frame::MAX_FIELDS];
    let mut len = 0;
    for (field, raw) in (0..want).zip(fields.iter_mut()) {
        let at = u32::from(field).wrapping_mul(Frame::FIELD_BITS);
        let (Some(start), Some(delimiter)) = (line.get(at), line.get(at.wrapping_add(9))) else { break };
        let [byte, ..] = (line.bits() >> at.wrapping_add(1)).to_le_bytes();
        *raw = RawField { byte, start_ok: !start, delimiter_ok: delimiter };
        len = field.wrapping_add(1);
    }
    (fields, len)
}

/// Returns every kind of fault that the fields show.
fn findings(request: Request, report: &Report) -> Findings {
    let mut found = Findings::default();
    if let Some(error) = report.error {
        found.insert(error.class());
    }
    let mut bytes = [0; Frame::MAX_FIELDS];
    for (byte, field) in bytes.iter_mut().zip(report.fields()) {
        *byte = field.byte;
        if !field.start_ok {
            found.insert(ErrorClass::StartBit);
        }
        if !field.delimiter_ok {
            found.insert(ErrorClass::Delimiter);
        }
    }
    let bytes = bytes.get(..usize::from(report.len)).unwrap_or(&bytes);
    let id = request.data_id();
    match bytes.first().map(|cf| (*cf, ControlField::parse(*cf))) {
        Some((_, Err(error))) => found.insert(error.class()),
        Some((cf, Ok(_))) if cf != id.control_field().get() => found.insert(ErrorClass::CfMismatch),
        _ => {}
    }
    if report.len < id.response_fields() {
        found.insert(ErrorClass::Truncated);
    } else if crc(bytes) != 0 {
        found.insert(ErrorClass::Crc);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::tests::exchanges;
    use proptest::prelude::*;
    use std::string::ToString;

    fn window(bits: u128, len: u32) -> Window {
        Window::from_bits(bits, len).unwrap()
    }

    /// The line in its own length, then idle up to `len`.
    fn idle_after(line: Window, len: u32) -> Window {
        line.padded(len).unwrap()
    }

    proptest! {
        #[test]
        fn a_sound_answer_has_no_cause((request, response) in exchanges()) {
            let report = inspect(request, response.emit().line());
            prop_assert!(report.findings().is_empty());
            prop_assert_eq!((report.error(), report.cause(), report.response()), (None, None, Some(response)));
            let bytes = response.emit();
            prop_assert_eq!(report.fields().len(), bytes.as_bytes().len());
            prop_assert!(report.fields().iter().zip(bytes.as_bytes()).all(|(f, b)| f.byte == *b && f.start_ok && f.delimiter_ok));
        }

        #[test]
        fn the_usual_mistakes_are_found((request, response) in exchanges(), shift in 1..=9_u32) {
            let line = response.emit().line();
            let late = idle_after(window(line.bits() << shift | ((1 << shift) - 1), line.len() + shift), line.len() + 10);
            let early = idle_after(line.skip(1).unwrap(), line.len());
            let cases = [
                (line.inverted(), Cause::Line(LineCause::LineInverted)),
                (idle_after(line, line.len().next_multiple_of(8)).reordered(), Cause::Line(LineCause::WrongBitOrder)),
                (late, Cause::Line(LineCause::Shifted { bits: shift as i8 })),
                (early, Cause::Line(LineCause::Shifted { bits: -1 })),
            ];
            for (line, cause) in cases {
                let report = inspect(request, line);
                prop_assert!(report.error().is_some());
                // A few lines are sound both inverted and in the other order: the inversion is named.
                let want = match Response::parse_line(request, line.inverted()) {
                    Ok(inverted) => (Cause::Line(LineCause::LineInverted), inverted),
                    Err(_) => (cause, response),
                };
                prop_assert_eq!((report.cause(), report.response()), (Some(want.0), Some(want.1)));
            }
        }

        #[test]
        fn echoes_are_found((request, response) in exchanges()) {
            let (sent, line) = (request.emit().line(), response.emit().line());
            let only = inspect(request, idle_after(sent, line.len().max(sent.len() + 10)));
            // The echo of a write to the EEPROM is what its response looks like.
            if request.data_id() != DataId::WriteEeprom {
                prop_assert_eq!(only.cause(), Some(Cause::Line(LineCause::OnlyEcho)));
                let bytes = [request.emit().as_bytes(), response.emit().as_bytes()].concat();
                let both = inspect_bytes(request, &bytes);
                prop_assert_eq!((both.cause(), both.response()), (Some(Cause::Line(LineCause::OwnEcho)), Some(response)));
            }
        }

        #[test]
        fn half_the_rate((request, response) in exchanges()) {
            let line = response.emit().line();
            prop_assume!(line.len() <= 60);
            let doubled = (0..line.len()).fold(0, |bits, at| bits | ((line.bits() >> at & 1) * 3) << (2 * at));
            let report = inspect(request, window(doubled, 2 * line.len()));
            prop_assert_eq!((report.cause(), report.response()), (Some(Cause::Line(LineCause::HalfRate)), Some(response)));
        }

        #[test]
        fn answers_to_something_else((asked, response) in exchanges(), (other, _) in exchanges()) {
            prop_assume!(asked.data_id() != other.data_id());
            let report = inspect(other, idle_after(response.emit().line(), 120));
            let want = match response {
                Response::ReadAll(_) => Cause::RequestRefused,
                _ => Cause::OtherDataId { answered: asked.data_id() },
            };
            prop_assert_eq!((report.cause(), report.response()), (Some(want), Some(response)));
        }

        /// Any line at all gives a report.
        #[test]
        fn any_line(bits: u128, len in 0..=128_u32, (request, _) in exchanges()) {
            let report = inspect(request, window(bits, len));
            prop_assert_eq!(report.error().is_some(), !report.findings().is_empty());
        }
    }

    #[test]
    fn stuck_lines() {
        assert_eq!(inspect(Request::ReadSingleTurn, window(0, 110)).cause(), Some(Cause::Line(LineCause::StuckLow)));
        assert_eq!(
            inspect(Request::ReadSingleTurn, window(u128::MAX, 110)).cause(),
            Some(Cause::Line(LineCause::StuckHigh))
        );
        assert_eq!(inspect(Request::ReadSingleTurn, Window::EMPTY).cause(), Some(Cause::Line(LineCause::StuckHigh)));
    }

    #[test]
    fn all_faults_are_listed() {
        let mut line = Frame::new(&[0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x36]).unwrap().line().bits();
        line ^= 1 << 20 | 1 << 39;
        let report = inspect(Request::ReadSingleTurn, window(line, 60));
        assert!(report.findings().iter().eq([ErrorClass::StartBit, ErrorClass::Delimiter, ErrorClass::Crc]));
        assert_eq!(report.error(), Some(Error::StartBit { field: 2 }));
        assert!(!report.fields()[2].start_ok && !report.fields()[3].delimiter_ok);
    }

    /// The response to ID 1, one whose control field has a wrong parity, and one of which the last field is missing.
    #[test]
    fn what_is_wrong_with_the_first_field_and_the_length_is_listed() {
        let findings = |bytes: &[u8]| inspect(Request::ReadSingleTurn, Frame::new(bytes).unwrap().line()).findings();
        assert!(findings(&[0x8a, 0, 1, 2, 3, 0x8a]).iter().eq([ErrorClass::CfMismatch]));
        assert!(findings(&[0x0a, 0, 1, 2, 3, 0x0a]).iter().eq([ErrorClass::Parity]));
        assert!(findings(&[0x02, 0, 1, 2, 3]).iter().eq([ErrorClass::Truncated]));
        // And beside the start bit of field 2, which is the error.
        let also = |bytes: &[u8]| {
            let line = Frame::new(bytes).unwrap().line();
            inspect(Request::ReadSingleTurn, window(line.bits() ^ 1 << 20, line.len())).findings()
        };
        for (bytes, class) in [
            (&[0x8a, 0, 1, 2, 3, 0x8a][..], ErrorClass::CfMismatch),
            (&[0x0a, 0, 1, 2, 3, 0x0a], ErrorClass::Parity),
            (&[0x02, 0, 1, 2, 3], ErrorClass::Truncated),
        ] {
            assert!([ErrorClass::StartBit, class].iter().all(|class| also(bytes).contains(*class)), "{class:?}");
            assert_eq!(also(bytes).iter().count(), 2, "{class:?}");
        }
    }

    #[test]
    fn causes_are_sentences() {
        assert_eq!(
            Cause::Line(LineCause::Shifted { bits: -1 }).to_string(),
            "1 bit(s) at the beginning of the frame are missing"
        );
        assert_eq!(
            Cause::OtherDataId { answered: DataId::ResetTurnsAndErrors }.to_string(),
            "this is a sound response to ID C"
        );
    }
}
