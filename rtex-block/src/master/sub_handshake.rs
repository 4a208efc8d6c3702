use super::progress::{Failure, Progress};
use crate::execution::Execution;
use crate::sub::{SubCode, SubCommand, SubResponse};

/// One sub-command of the 32-byte mode, from the request to its answer; it runs in parallel with the main command.
///
/// The rules are those of [`Handshake`](super::Handshake), with the flags and echoes of bytes 16-19.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SubHandshake {
    code: SubCode,
    type_code: u8,
    index: u16,
    left: u32,
}

impl SubHandshake {
    /// Creates a request for `code` (system ID or monitor), which times out after `limit` responses without an answer.
    /// `None` for the normal sub-command, which has no answer.
    pub const fn new(code: SubCode, type_code: u8, index: u16, limit: u32) -> Option<Self> {
        match code {
            SubCode::Normal => None,
            _ => Some(Self { code, type_code, index, left: limit }),
        }
    }

    /// Returns what to send while the handshake is pending.
    pub const fn command(&self) -> SubCommand {
        SubCommand { code: self.code, type_code: self.type_code, index: self.index, ..SubCommand::IDLE }
    }

    /// Takes the result of one update period: the sub block of the drive's response, `None` if there was none.
    pub fn receive(&mut self, response: Option<&SubResponse>) -> Progress<SubResponse> {
        let progress = response.filter(|r| r.code.get() == self.code.code()).and_then(|r| self.read(r));
        progress.unwrap_or_else(|| match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Progress::Pending { left }
            }
            None => Progress::Failed { error: Failure::TimedOut },
        })
    }

    /// `None` while the answer is awaited.
    fn read(self, response: &SubResponse) -> Option<Progress<SubResponse>> {
        if let Some(code) = response.error_code() {
            return Some(Progress::Failed { error: Failure::CommandError(code) });
        }
        if response.type_code != self.type_code || response.index != self.index {
            return None;
        }
        if response.execution.contains(Execution::ERR) {
            Some(Progress::Failed { error: Failure::Execution })
        } else if response.execution.contains(Execution::BUSY) {
            None
        } else {
            Some(Progress::Done { value: *response })
        }
    }
}
