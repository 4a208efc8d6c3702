//! One drive of a log: its state from block to block.

use super::finding::{LogFinding, Unfinished};
use crate::code::{Code, CyclicCode};
use crate::command::CommandBlock;
use crate::control::ControlBits;
use crate::execution::Execution;
use crate::header::UpdateCounter;
use crate::noncyclic_response::NonCyclicResponse;
use crate::position::step;
use crate::response::ResponseBlock;

/// Normal number of responses or commands between cause and effect: two communications in an update period, and one of
/// delay.
pub(super) const NORMAL: u32 = 3;

/// A request: the code and bytes 8, 10 and 11.
type Request = (Code, [u8; 3]);

/// The state of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Track {
    pub(super) commands: u32,
    pub(super) responses: u32,
    /// Number of commands since the last response.
    pub(super) unanswered: u32,
    counter: Option<UpdateCounter>,
    sent_twice: bool,
    echo: Option<UpdateCounter>,
    /// Number of responses in a row with this echo, and whether this was reported.
    same: u32,
    stands: bool,
    position: Option<i32>,
    /// The code of the commands, and the number of responses since it was first sent; `None` once it has come back.
    code: Option<Code>,
    awaited: Option<u32>,
    /// The pending request and, until it is answered, the number of responses and of busy responses.
    request: Option<Request>,
    open: Option<(u32, u32)>,
    /// Whether, at any time, Alarm was 1; whether the echo did not change; and whether commands had no answer.
    pub(super) alarmed: bool,
    pub(super) stood: bool,
    pub(super) fell_silent: bool,
}

impl Track {
    pub(super) const NEW: Self = Self {
        commands: 0,
        responses: 0,
        unanswered: 0,
        counter: None,
        sent_twice: false,
        echo: None,
        same: 0,
        stands: false,
        position: None,
        code: None,
        awaited: None,
        request: None,
        open: None,
        alarmed: false,
        stood: false,
        fell_silent: false,
    };

    /// Takes the counter of a command.
    pub(super) fn count(&mut self, to: UpdateCounter, nop: bool) -> Option<LogFinding> {
        let last = self.counter.replace(to);
        let repeated = last == Some(to) && !self.sent_twice;
        self.sent_twice = last == Some(to);
        let from = last.filter(|_| !nop && !repeated)?;
        (from.next() != to).then_some(LogFinding::CounterJumps { from, to })
    }

    /// Takes the command position. Without Servo_On, the drive does not follow it.
    pub(super) fn go(&mut self, block: CommandBlock<'_>, limit: Option<u32>) -> Option<LogFinding> {
        let at = (block.code().cyclic() == Some(CyclicCode::CyclicPosition)).then(|| block.command_data1());
        let last = core::mem::replace(&mut self.position, at);
        let (step, max) = (step(last?, at?), limit?);
        let on = block.control().contains(ControlBits::SERVO_ON);
        (on && step.unsigned_abs() > max).then_some(LogFinding::PositionStep { step, max })
    }

    /// Takes code and request of a command.
    pub(super) fn ask(&mut self, block: CommandBlock<'_>) -> Option<LogFinding> {
        let code = block.code();
        if self.code.replace(code) != Some(code) {
            self.awaited = Some(0);
        }
        let [eight, _, ten, eleven, ..] = block.noncyclic_bytes();
        let request = (!matches!(code.noncyclic_bits(), 0 | 7)).then_some((code, [eight, ten, eleven]));
        let last = core::mem::replace(&mut self.request, request);
        if last == request {
            return None;
        }
        let open = core::mem::replace(&mut self.open, request.map(|_| (0, 0)));
        let ((code, _), (responses, busy)) = last.zip(open)?;
        (responses > NORMAL).then_some(LogFinding::GivenUp { code, responses, busy })
    }

    /// Takes the counter of a response. Before the start, the counters stay at 0.
    pub(super) fn echo(&mut self, echo: UpdateCounter) -> Option<LogFinding> {
        if self.echo.replace(echo) == Some(echo) {
            self.same = self.same.saturating_add(1);
            let started = self.code.is_none_or(|code| code != Code::NOP);
            let says = self.same == NORMAL && started;
            self.stands |= says;
            self.stood |= says;
            return says.then_some(LogFinding::EchoStands { responses: NORMAL });
        }
        let responses = core::mem::replace(&mut self.same, 1);
        let stood = core::mem::replace(&mut self.stands, false);
        (stood && responses > NORMAL).then_some(LogFinding::EchoGoesOn { responses })
    }

    /// Takes the code of a response.
    pub(super) fn come_back(&mut self, code: Code) -> Option<LogFinding> {
        let responses = self.awaited?.saturating_add(1);
        if self.code != Some(code) {
            self.awaited = Some(responses);
            return None;
        }
        self.awaited = None;
        (responses > NORMAL).then_some(LogFinding::CodeLate { responses })
    }

    /// Returns the answer in a response, if it belongs to the pending request: one with its type code, or an error answer.
    pub(super) fn answer(&mut self, block: ResponseBlock<'_>) -> Option<LogFinding> {
        let ((code, [type_code, ..]), (responses, busy)) = self.request.zip(self.open)?;
        let responses = responses.saturating_add(1);
        let [_, _, _, _, _, _, _, _, eight, ..] = *block.bytes();
        let own = block.code() == code && (block.cmd_error() || eight == type_code);
        let execution = block.noncyclic().execution().unwrap_or(Execution::empty());
        let is_busy = own && execution.contains(Execution::BUSY) && !execution.contains(Execution::ERR);
        if own && !is_busy {
            self.open = None;
            return Some(LogFinding::Answered { responses, busy });
        }
        self.open = Some((responses, busy.saturating_add(is_busy.into())));
        None
    }

    /// Returns the attributes of an alarm, if the answer to the pending request contains them.
    pub(super) fn attributes(&self, block: ResponseBlock<'_>) -> Option<LogFinding> {
        let ((_, [_, 0, 0]), NonCyclicResponse::Alarm(results)) = (self.request?, block.noncyclic()) else {
            return None;
        };
        let bits = u32::from_le_bytes(results.data.to_le_bytes());
        (results.index != 0).then_some(LogFinding::Attributes { alarm: results.index, bits })
    }

    /// Returns what is still in progress at the end; a pending request is reported rather than its code.
    pub(super) fn unfinished(&self) -> [Option<Unfinished>; 3] {
        let echo = (self.stands && self.same > NORMAL).then_some(Unfinished::Echo { responses: self.same });
        let silent = self.responses > 0 && self.unanswered > NORMAL;
        let request = self.request.zip(self.open).filter(|(_, (responses, _))| *responses > NORMAL);
        let late = match (request, self.code.zip(self.awaited)) {
            (Some(((code, _), (responses, busy))), _) => Some(Unfinished::Request { code, responses, busy }),
            (None, Some((code, responses))) if responses > NORMAL => Some(Unfinished::Code { code, responses }),
            _ => None,
        };
        [echo, late, silent.then_some(Unfinished::Silence { commands: self.unanswered })]
    }
}
