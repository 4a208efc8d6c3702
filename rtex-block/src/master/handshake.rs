use crate::{Answer, Code, CyclicCode, ErrorCode, MacId, Reply, Request, Response};

/// How far a request has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Progress {
    /// No answer to this request yet, or the drive is busy: hold the command.
    Pending,
    /// Executed.
    Done {
        /// Bytes 12-15 of the answer.
        data: i32,
        /// WNG: executed with a restriction.
        warning: bool,
    },
    /// ERR: accepted, and failed while it was executed.
    Failed,
    /// CMD_Error: not accepted.
    Rejected(ErrorCode),
    /// No answer within the caller's limit.
    TimedOut,
}

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
/// command is held, so [`poll`](Self::poll) may be called on after `Done`. The rules follow from the meaning of the
/// flags in SX-DSV02310; how echoes are matched is this crate's reading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Handshake {
    mac_id: MacId,
    code: Code,
    request: Request,
    left: u32,
}

impl Handshake {
    /// A handshake for `request`, sent to `mac_id` with `cyclic`; it times out after `limit` pending polls.
    ///
    /// `None` for [`Request::Normal`], which has no answer, and for [`Request::Profile`], which is a motion:
    /// see [`ProfileMove`](super::ProfileMove).
    pub const fn new(mac_id: MacId, cyclic: CyclicCode, request: Request, limit: u32) -> Option<Self> {
        match request {
            Request::Normal { .. } | Request::Profile { .. } => None,
            _ => Some(Self { mac_id, code: Code::of(cyclic, request.code()), request, left: limit }),
        }
    }

    /// What to send while the handshake is pending.
    pub const fn request(&self) -> Request {
        self.request
    }

    /// Takes what one update period brought: the drive's response, `None` if there was none or it was refused.
    pub fn poll(&mut self, response: Option<&Response>) -> Progress {
        let progress = match response {
            Some(response) if response.mac_id == self.mac_id && response.code == self.code => {
                self.read(response.answer())
            }
            _ => Progress::Pending,
        };
        if progress != Progress::Pending {
            return progress;
        }
        match self.left.checked_sub(1) {
            Some(left) => {
                self.left = left;
                Progress::Pending
            }
            None => Progress::TimedOut,
        }
    }

    fn read(&self, answer: Answer) -> Progress {
        let (execution, data) = match (self.request, answer) {
            (_, Answer::CommandError(code)) => return Progress::Rejected(code),
            (Request::Reset(sent), Answer::Reset(reply))
            | (Request::SystemId(sent), Answer::SystemId(reply))
            | (Request::Alarm(sent), Answer::Alarm(reply))
            | (Request::Parameter(sent), Answer::Parameter(reply))
            | (Request::Monitor(sent), Answer::Monitor(reply)) => {
                let Reply { execution, type_code, index, data } = reply;
                if type_code != sent.type_code || index != sent.index {
                    return Progress::Pending;
                }
                (execution, data)
            }
            (Request::Homing { type_code: sent, .. }, Answer::Homing { execution, type_code, monitor_data, .. })
                if type_code == sent =>
            {
                (execution, monitor_data)
            }
            _ => return Progress::Pending,
        };
        if execution.err {
            Progress::Failed
        } else if execution.busy {
            Progress::Pending
        } else {
            Progress::Done { data, warning: execution.wng }
        }
    }
}
