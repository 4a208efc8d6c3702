//! For tools: looks at a frame that was refused, lists every fault and guesses the cause.
//!
//! Decoders stop at the first fault and return no value, which is right for a master and unhelpful at a bench. This module
//! examines everything it can, and the usual mistakes (the network card has taken the FCS, padded the frame, cut it, the
//! bytes are inverted, the preamble is still there) are undone one by one; the one whose removal makes the frame sound is
//! the cause.
//!
//! Frames of the IO exchange have no type and no addresses, so the caller has to know what the line was doing: [`During`].
//!
//! ```
//! use sorte_proto::inspect::{Cause, During, inspect};
//! use sorte_proto::{Place, Sync};
//! let sync = Sync::of_master(500, 76, Place::Inner).emit();
//! // A network card takes the FCS off.
//! let report = inspect(During::StartUp, &sync[..10]);
//! assert_eq!(report.cause(), Some(Cause::FcsMissing));
//! assert!(report.to_string().starts_with("SYNC refused: FCS is") && report.to_string().ends_with("the FCS is missing"));
//! assert_eq!(report.frame().map(|frame| frame.to_string()), Some("SYNC at 856 ns, delay 76 ns, STATUS 40h".into()));
//! ```

mod cause;
mod frame;

pub use cause::Cause;
pub use frame::{During, Frame, Kind};

use frame::cnc_slices;

use crate::crc::fcs;
use crate::discovery::{DiscoveryView, MAX_DEVICES, Network};
use crate::error::{Error, ErrorClass};
use crate::frame::{LongFrame, MULTICAST};
use crate::frame_type::FrameType;
use crate::pto::Pto;

/// The kinds of faults found, as a set.
pub type Findings = servowire_core::Findings<ErrorClass>;

/// The result of an inspection of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Report<'a> {
    kind: Kind,
    frame: Option<Frame<'a>>,
    error: Option<Error>,
    findings: Findings,
    cause: Option<Cause>,
}

impl<'a> Report<'a> {
    /// What the frame is, or was meant to be.
    pub const fn kind(&self) -> Kind {
        self.kind
    }

    /// Why a decoder refuses the frame.
    pub const fn error(&self) -> Option<Error> {
        self.error
    }

    /// Every kind of fault in the frame as given, including faults of its contents, which a decoder does not check: totals
    /// of DISCOVERY that are not the sums of the entries, more devices than there can be, undefined PTO words.
    pub const fn findings(&self) -> Findings {
        self.findings
    }

    /// The most likely cause of the refusal.
    pub const fn cause(&self) -> Option<Cause> {
        self.cause
    }

    /// The values as received if the frame is not refused, otherwise as they would be with the cause removed. They are for
    /// display only.
    pub const fn frame(&self) -> Option<Frame<'a>> {
        self.frame
    }
}

servowire_core::one_line!(Report<'_> {
    Self { frame: Some(frame), error: None, findings, .. } if findings.is_empty() => "{}", frame;
    Self { frame: Some(frame), error: None, findings, .. } => "{}, with {}", frame, findings;
    Self { kind, error: Some(error), cause: Some(cause), .. } => "{} refused: {}; {}", kind, error, cause;
    Self { kind, error: Some(error), cause: None, .. } => "{} refused: {}", kind, error;
    Self { kind, .. } => "{}", kind;
});

/// Examines a frame without its preamble.
pub fn inspect(during: During, bytes: &[u8]) -> Report<'_> {
    let decoded = Frame::parse(during, bytes);
    let (cause, frame) = match decoded {
        Ok(frame) => (None, Some(frame)),
        Err(error) => cause::of(during, bytes, error),
    };
    let mut findings = Findings::NONE;
    if let Err(error) = decoded {
        findings.insert(error.class());
    }
    match during {
        During::StartUp => of_start_up(bytes, &mut findings),
        During::Exchange => of_exchange(bytes, &mut findings),
    }
    Report { kind: Kind::of(during, bytes), frame, error: decoded.err(), findings, cause }
}

/// Finds all faults of a long-header frame, not just the first.
fn of_start_up(bytes: &[u8], findings: &mut Findings) {
    let (Some((body, trailer)), &[da, _, code, ..]) = (bytes.split_last_chunk(), bytes) else { return };
    if u32::from_le_bytes(*trailer) != fcs(body) {
        findings.insert(ErrorClass::BadFcs);
    }
    if da != MULTICAST {
        findings.insert(ErrorClass::WrongDestination);
    }
    match FrameType::from_code(code).map(FrameType::frame_len) {
        None => findings.insert(ErrorClass::UnknownType),
        Some(Some(want)) if bytes.len() < want => findings.insert(ErrorClass::Truncated),
        Some(Some(want)) if bytes.len() > want => findings.insert(ErrorClass::TooLong),
        Some(_) => {}
    }
    let Ok(answer) = LongFrame::parse(bytes).and_then(DiscoveryView::of) else { return };
    if usize::from(answer.count()) > MAX_DEVICES {
        findings.insert(ErrorClass::TooManyDevices);
    } else if let Err(error) = Network::new(answer) {
        findings.insert(error.class());
    }
}

/// Finds all faults of a frame of the exchange. Four bytes for each of at most four devices are those of the CNC machine, whose
/// words have a meaning; anything else is opaque.
fn of_exchange(bytes: &[u8], findings: &mut Findings) {
    let Ok(Frame::Master(frame)) = Frame::parse(During::Exchange, bytes) else { return };
    let words = cnc_slices(frame.output()).map(|slice| slice.pto);
    if words.into_iter().any(|word| matches!(word, Pto::Reserved(_))) {
        findings.insert(ErrorClass::ReservedPtoValue);
    }
}

#[cfg(test)]
mod tests;
