use super::progress::{Failure, Progress};
use crate::code::{Code, CyclicCode};
use crate::execution::Execution;
use crate::header::MacId;
use crate::noncyclic_command::{Arguments, NonCyclicCommand};
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;
use crate::type_code::TypeCode;

/// One non-cyclic command from the request to its answer.
///
/// ```text
///  put code, type, index, data and hold them
///      each response:  C/R or MAC-ID wrong           discard
///                      code echo not this code       pending
///                      CMD_Error                     rejected
///                      echo of type, index or        pending: answer to an older request
///                        selections differs
///                      ERR                           failed
///                      Busy                          pending
///                      else                          done
///  go back to the normal command (0h)
/// ```
/// The handshake must go back before the same command can be *executed* again; a monitor value is refreshed while the
/// command is held, so [`receive`](Self::receive) may still be called after `Done`. The rules follow from the meaning of the
/// flags in SX-DSV02310; how echoes are matched is this crate's interpretation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Handshake {
    mac_id: MacId,
    code: Code,
    request: NonCyclicCommand,
    left: u32,
    /// Responses with Busy do not count: the drive moves the axis.
    patient: bool,
    /// The index echo is part of the answer.
    any_index: bool,
}

impl Handshake {
    /// Creates a handshake for `request`, sent to `mac_id` with `cyclic`; it times out after `limit` responses without an
    /// answer.
    ///
    /// `None` for [`NonCyclicCommand::Normal`], which has no answer, and for [`NonCyclicCommand::Profile`], which is a motion:
    /// see [`ProfileMove`](super::ProfileMove).
    pub const fn new(mac_id: MacId, cyclic: CyclicCode, request: NonCyclicCommand, limit: u32) -> Option<Self> {
        match request {
            NonCyclicCommand::Normal { .. } | NonCyclicCommand::Profile { .. } => None,
            _ => {
                let code = Code::of(cyclic, request.code());
                Some(Self { mac_id, code, request, left: limit, patient: false, any_index: false })
            }
        }
    }

    /// Creates a handshake for reading the attributes of the present alarm: Index 0, with the `type_code` given for
    /// attributes in the drive's manual.
    ///
    /// The answer carries the alarm as Index_Echo and its attributes in bytes 12-15, so only the echo of the type code is
    /// compared. SX-DSV02310, "Alarm command".
    pub const fn alarm_attributes(mac_id: MacId, cyclic: CyclicCode, type_code: TypeCode, limit: u32) -> Self {
        let request = NonCyclicCommand::Alarm(Arguments { type_code, index: 0, data: 0 });
        Self { mac_id, code: Code::of(cyclic, request.code()), request, left: limit, patient: false, any_index: true }
    }

    /// Lets the drive be Busy for as long as it likes: who asks has a limit of its own for that.
    pub(super) const fn patient(self) -> Self {
        Self { patient: true, ..self }
    }

    /// Whether the drive may be Busy for longer than an answer takes, because it moves the axis.
    pub(super) const fn is_patient(&self) -> bool {
        self.patient
    }

    /// Returns what to send while the handshake is pending.
    pub const fn request(&self) -> NonCyclicCommand {
        self.request
    }

    /// Number of update periods until it times out.
    pub const fn left(&self) -> u32 {
        self.left
    }

    /// Takes the result of one update period: the drive's response, `None` if there was none or it was refused.
    ///
    /// `Done` carries the whole response: the data, WNG, and the echoes.
    pub fn receive(&mut self, response: Option<&Response>) -> Progress<NonCyclicResponse> {
        let progress = match response {
            Some(response) if response.mac_id == self.mac_id && response.code == self.code => {
                self.read(response.noncyclic())
            }
            _ => None,
        };
        progress.unwrap_or_else(|| match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Progress::Pending { left }
            }
            None => Progress::Failed { error: Failure::TimedOut },
        })
    }

    /// `None` while the answer is awaited.
    fn read(&self, response: NonCyclicResponse) -> Option<Progress<NonCyclicResponse>> {
        if let NonCyclicResponse::CommandError(code) = response {
            return Some(Progress::Failed { error: Failure::CommandError(code) });
        }
        let execution = response.execution().filter(|_| self.is_echo(&response))?;
        if execution.contains(Execution::ERR) {
            Some(Progress::Failed { error: Failure::Execution })
        } else if execution.contains(Execution::BUSY) {
            self.patient.then_some(Progress::Pending { left: self.left })
        } else {
            Some(Progress::Done { value: response })
        }
    }

    /// Whether type code and index, or the selections of a latch, match the request.
    fn is_echo(&self, response: &NonCyclicResponse) -> bool {
        match (self.request, *response) {
            (NonCyclicCommand::Reset(sent), NonCyclicResponse::Reset(results))
            | (NonCyclicCommand::SystemId(sent), NonCyclicResponse::SystemId(results))
            | (NonCyclicCommand::Alarm(sent), NonCyclicResponse::Alarm(results))
            | (NonCyclicCommand::Parameter(sent), NonCyclicResponse::Parameter(results))
            | (NonCyclicCommand::Monitor(sent), NonCyclicResponse::Monitor(results)) => {
                results.type_code == sent.type_code && (self.any_index || results.index == sent.index)
            }
            (
                NonCyclicCommand::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, .. },
                NonCyclicResponse::Homing { type_code: a, latch_sel1: b, latch_sel2: c, monitor_sel: d, .. },
            ) => (a, b, c, d) == (type_code, latch_sel1, latch_sel2, monitor_sel),
            _ => false,
        }
    }
}
