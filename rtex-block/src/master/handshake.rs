use super::progress::{Failure, Progress};
use crate::code::{Code, CyclicCode};
use crate::execution::Execution;
use crate::header::MacId;
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::response::Response;

/// One non-cyclic command from the request to its answer.
///
/// ```text
///  put code, type, index, data and hold them
///      each response:  C/R or MAC-ID wrong           discard
///                      code echo not this code       pending
///                      CMD_Error                     rejected
///                      type or index echo differs    pending: answer to an older request
///                      ERR                           failed
///                      Busy                          pending
///                      else                          done
///  go back to the normal command (0h)
/// ```
/// Going back is needed before the same command is *executed* again; a monitor value is refreshed while the
/// command is held, so [`receive`](Self::receive) may be called on after `Done`. The rules follow from the meaning of the
/// flags in SX-DSV02310; how echoes are matched is this crate's reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Handshake {
    mac_id: MacId,
    code: Code,
    request: NonCyclicCommand,
    left: u32,
}

impl Handshake {
    /// A handshake for `request`, sent to `mac_id` with `cyclic`; it times out when `limit` responses have left it pending.
    ///
    /// `None` for [`NonCyclicCommand::Normal`], which has no answer, and for [`NonCyclicCommand::Profile`], which is a motion:
    /// see [`ProfileMove`](super::ProfileMove).
    pub const fn new(mac_id: MacId, cyclic: CyclicCode, request: NonCyclicCommand, limit: u32) -> Option<Self> {
        match request {
            NonCyclicCommand::Normal { .. } | NonCyclicCommand::Profile { .. } => None,
            _ => Some(Self { mac_id, code: Code::of(cyclic, request.code()), request, left: limit }),
        }
    }

    /// What to send while the handshake is pending.
    pub const fn request(&self) -> NonCyclicCommand {
        self.request
    }

    /// Takes what one update period brought: the drive's response, `None` if there was none or it was refused.
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

    /// `None` while the answer is due.
    fn read(&self, response: NonCyclicResponse) -> Option<Progress<NonCyclicResponse>> {
        if let NonCyclicResponse::CommandError(code) = response {
            return Some(Progress::Failed { error: Failure::CommandError(code) });
        }
        let execution = response.execution().filter(|_| self.is_echo(&response))?;
        if execution.contains(Execution::ERR) {
            Some(Progress::Failed { error: Failure::Execution })
        } else if execution.contains(Execution::BUSY) {
            None
        } else {
            Some(Progress::Done { value: response })
        }
    }

    /// Whether type code and index are those of the request.
    fn is_echo(&self, response: &NonCyclicResponse) -> bool {
        match (self.request, *response) {
            (NonCyclicCommand::Reset(sent), NonCyclicResponse::Reset(results))
            | (NonCyclicCommand::SystemId(sent), NonCyclicResponse::SystemId(results))
            | (NonCyclicCommand::Alarm(sent), NonCyclicResponse::Alarm(results))
            | (NonCyclicCommand::Parameter(sent), NonCyclicResponse::Parameter(results))
            | (NonCyclicCommand::Monitor(sent), NonCyclicResponse::Monitor(results)) => {
                results.type_code == sent.type_code && results.index == sent.index
            }
            (NonCyclicCommand::Homing { type_code: sent, .. }, NonCyclicResponse::Homing { type_code, .. }) => {
                type_code == sent
            }
            _ => false,
        }
    }
}
