//! A whole log of blocks: what no single block shows.

use core::fmt;

use crate::block::{BlockSize, LEN};
use crate::code::{Code, CyclicCode};
use crate::command::CommandBlock;
use crate::control::ControlBits;
use crate::execution::Execution;
use crate::header::{MacId, UpdateCounter};
use crate::noncyclic_response::NonCyclicResponse;
use crate::position::{Gear, max_step, step};
use crate::response::ResponseBlock;
use crate::status::StatusFlags;

/// Something that a log shows between its blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum LogFinding {
    /// The echo of the counter stands still for more than the two communications that an update period can have.
    EchoStands {
        /// Responses in a row with the same echo.
        responses: u32,
    },
    /// The echo of the counter stood still for longer than that, and goes on.
    EchoGoesOn {
        /// Responses in a row with the same echo.
        responses: u32,
    },
    /// The counter of the commands did not go on by one, nor stay for the second communication of an update period.
    CounterJumps {
        /// Before.
        from: UpdateCounter,
        /// Now.
        to: UpdateCounter,
    },
    /// The code of the commands has come back, later than one command after the other.
    CodeLate {
        /// Responses from the first command with this code to its echo.
        responses: u32,
    },
    /// A step of the command position above 400 M pulses per second after the electronic gear: Err27.4.
    PositionStep {
        /// The step, command units.
        step: i32,
        /// The largest, command units.
        max: u32,
    },
    /// A request was answered.
    Answered {
        /// Responses from the first command with the request to the first answer without Busy.
        responses: u32,
        /// Of these, with Busy.
        busy: u32,
    },
    /// An alarm command with Index 0 was answered with another index. Only the read-out of attributes does that: bytes 12-15 are
    /// no alarm and no warning.
    Attributes {
        /// Index_Echo: the alarm that is being issued.
        alarm: u16,
        /// Bytes 12-15, byte 12 in bits 7-0.
        bits: u32,
    },
    /// Another request, or the normal command, takes the place of a request that was not answered in more than three
    /// responses.
    GivenUp {
        /// The code of the request.
        code: Code,
        /// Responses since the first command with it.
        responses: u32,
        /// Of these, with Busy.
        busy: u32,
    },
    /// The drive has answered before, and not to the last commands: more than the two communications that an update period
    /// can have.
    NoAnswer {
        /// Commands without an answer.
        commands: u32,
    },
    /// The drive was silent for longer than that, and answers.
    AnswersAgain {
        /// Commands without an answer.
        commands: u32,
    },
    /// Drives were sent commands, and this one never answered.
    NeverAnswered(MacId),
    /// This drive answers and was never sent a command.
    NeverAsked(MacId),
    /// At the end of the log something of a drive goes on.
    AtEnd(MacId, Unfinished),
}

servowire_core::codes! {
    /// What a drive did that somebody has to look after.
    pub enum Trouble: u8 {
        /// It reported an alarm.
        Alarm = 1 => "reported an alarm",
        /// Its counter echo stood still: the communication, or the drive, did.
        EchoStood = 2 => "sent a counter echo that stood still",
        /// It did not answer.
        Silence = 3 => "did not answer",
    }
}

/// A drive that somebody has to look after.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DriveTrouble {
    /// Its address.
    pub mac_id: MacId,
    /// What it did.
    pub trouble: Trouble,
}

/// What goes on at the end of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Unfinished {
    /// The echo of the counter stands still.
    Echo {
        /// Responses in a row with the same echo.
        responses: u32,
    },
    /// The drive is silent.
    Silence {
        /// Commands without an answer.
        commands: u32,
    },
    /// A request is not answered.
    Request {
        /// The code of the request.
        code: Code,
        /// Responses since the first command with it.
        responses: u32,
        /// Of these, with Busy.
        busy: u32,
    },
    /// The code of the commands has not come back.
    Code {
        /// The code.
        code: Code,
        /// Responses since the first command with it.
        responses: u32,
    },
}

impl fmt::Display for LogFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::EchoStands { responses } => write!(f, "the counter echo stands still for {responses} responses"),
            Self::EchoGoesOn { responses } => write!(f, "the counter echo goes on after {responses} responses"),
            Self::CounterJumps { from, to } => write!(f, "the counter goes from {from} to {to}"),
            Self::CodeLate { responses } => write!(f, "the code came back after {responses} responses"),
            Self::PositionStep { step, max } => write!(f, "position step {step}, at most {max}: Err27.4"),
            Self::Answered { responses, busy } => {
                write!(f, "answered after {responses} responses, {busy} of them busy")
            }
            Self::Attributes { alarm, bits } => {
                write!(f, "attributes {bits:08X}h of the alarm with index {alarm:04X}h")
            }
            Self::GivenUp { code, responses, busy } => {
                code.write(f)?;
                write!(f, " is given up after {responses} responses, {busy} of them busy")
            }
            Self::NoAnswer { commands } => write!(f, "no answer to the last {commands} commands"),
            Self::AnswersAgain { commands } => write!(f, "answers again after {commands} commands"),
            Self::NeverAnswered(mac_id) => write!(f, "drive {mac_id} never answered"),
            Self::NeverAsked(mac_id) => write!(f, "drive {mac_id} answers and was never sent a command"),
            Self::AtEnd(mac_id, unfinished) => write!(f, "at the end drive {mac_id} {unfinished}"),
        }
    }
}

impl fmt::Display for Unfinished {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Echo { responses } => write!(f, "has sent the same counter echo in {responses} responses"),
            Self::Silence { commands } => write!(f, "has not answered the last {commands} commands"),
            Self::Request { code, responses, busy } => {
                f.write_str("has not answered ")?;
                code.write(f)?;
                write!(f, " in {responses} responses, {busy} of them busy")
            }
            Self::Code { code, responses } => {
                f.write_str("has not sent back ")?;
                code.write(f)?;
                write!(f, " in {responses} responses")
            }
        }
    }
}

/// Responses, or commands, that are normal between cause and effect: two communications in an update period, and one of delay.
const NORMAL: u32 = 3;

/// What is asked: the code and bytes 8, 10 and 11.
type Request = (Code, [u8; 3]);

/// What is kept of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Track {
    commands: u32,
    responses: u32,
    /// Commands since the last response.
    unanswered: u32,
    counter: Option<UpdateCounter>,
    sent_twice: bool,
    echo: Option<UpdateCounter>,
    /// Responses in a row with this echo, and whether that was said.
    same: u32,
    stands: bool,
    position: Option<i32>,
    /// The code of the commands, and the responses since it is that; `None` once it has come back.
    code: Option<Code>,
    awaited: Option<u32>,
    /// The request that is out, and, until it is answered, the responses and the busy ones of them.
    request: Option<Request>,
    open: Option<(u32, u32)>,
    /// Alarm was 1, the echo stood still, and commands had no answer, at any time.
    alarmed: bool,
    stood: bool,
    fell_silent: bool,
}

impl Track {
    const NEW: Self = Self {
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

    /// The counter of a command.
    fn count(&mut self, to: UpdateCounter, nop: bool) -> Option<LogFinding> {
        let last = self.counter.replace(to);
        let repeated = last == Some(to) && !self.sent_twice;
        self.sent_twice = last == Some(to);
        let from = last.filter(|_| !nop && !repeated)?;
        (from.next() != to).then_some(LogFinding::CounterJumps { from, to })
    }

    /// The command position. Without Servo_On the drive follows nothing.
    fn go(&mut self, block: CommandBlock<'_>, limit: Option<u32>) -> Option<LogFinding> {
        let at = (block.code().cyclic() == Some(CyclicCode::CyclicPosition)).then(|| block.command_data1());
        let last = core::mem::replace(&mut self.position, at);
        let (step, max) = (step(last?, at?), limit?);
        let on = block.control().contains(ControlBits::SERVO_ON);
        (on && step.unsigned_abs() > max).then_some(LogFinding::PositionStep { step, max })
    }

    /// Code and request of a command.
    fn ask(&mut self, block: CommandBlock<'_>) -> Option<LogFinding> {
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

    /// The counter of a response. Counters that stand at 0 go out before the start.
    fn echo(&mut self, echo: UpdateCounter) -> Option<LogFinding> {
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

    /// The code of a response.
    fn come_back(&mut self, code: Code) -> Option<LogFinding> {
        let responses = self.awaited?.saturating_add(1);
        if self.code != Some(code) {
            self.awaited = Some(responses);
            return None;
        }
        self.awaited = None;
        (responses > NORMAL).then_some(LogFinding::CodeLate { responses })
    }

    /// The answer in a response, if it is one to the request that is out: with its type code, or an error answer.
    fn answer(&mut self, block: ResponseBlock<'_>) -> Option<LogFinding> {
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

    /// The attributes of an alarm, if that is what the answer to the request that is out says.
    fn attributes(&self, block: ResponseBlock<'_>) -> Option<LogFinding> {
        let ((_, [_, 0, 0]), NonCyclicResponse::Alarm(results)) = (self.request?, block.noncyclic()) else {
            return None;
        };
        let bits = u32::from_le_bytes(results.data.to_le_bytes());
        (results.index != 0).then_some(LogFinding::Attributes { alarm: results.index, bits })
    }

    /// What goes on at the end; a request that is open says more than its code.
    fn unfinished(&self) -> [Option<Unfinished>; 3] {
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

/// Looks at the blocks of a log one after the other, of all drives and both directions, 16 or 32 bytes each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LogAnalysis {
    /// Largest step of the command position; `None` if the update period is not known.
    max_step: Option<u32>,
    tracks: [Track; MacId::COUNT],
}

impl LogAnalysis {
    /// With the update period in ns, if it is known: for the limit of the position step at this gear.
    pub const fn new(update_ns: Option<u32>, gear: Gear) -> Self {
        let max_step = match update_ns {
            Some(update_ns) => Some(max_step(update_ns, gear)),
            None => None,
        };
        Self { max_step, tracks: [Track::NEW; MacId::COUNT] }
    }

    /// Takes the next block; of 32 bytes the main half is looked at. Gives what it shows, in at most five findings.
    pub fn block(&mut self, bytes: &[u8]) -> impl Iterator<Item = LogFinding> + use<> {
        let mut found = [None; 5];
        if let Some(main) = bytes.first_chunk::<LEN>() {
            if let Ok(command) = CommandBlock::of(main) {
                found = self.command(command);
            } else if let Ok(response) = ResponseBlock::of(main) {
                found = self.response(response);
            }
        }
        found.into_iter().flatten()
    }

    /// What the log holds that somebody has to look after, drive by drive.
    pub fn troubles(&self) -> impl Iterator<Item = DriveTrouble> {
        let answered = self.tracks.iter().any(|track| track.responses > 0);
        (0..).zip(&self.tracks).flat_map(move |(number, track)| {
            let mac_id = MacId::truncate(number);
            let silent = track.fell_silent || answered && track.responses == 0 && track.commands > 0;
            let found =
                [(track.alarmed, Trouble::Alarm), (track.stood, Trouble::EchoStood), (silent, Trouble::Silence)];
            found.into_iter().filter(|(is, _)| *is).map(move |(_, trouble)| DriveTrouble { mac_id, trouble })
        })
    }

    /// At the end of the log: drives that were only on one side of it, and what goes on.
    pub fn end(&self) -> impl Iterator<Item = LogFinding> {
        let both = self.tracks.iter().any(|t| t.commands > 0) && self.tracks.iter().any(|t| t.responses > 0);
        (0..).zip(&self.tracks).flat_map(move |(number, track)| {
            let mac_id = MacId::truncate(number);
            let one_side = match (track.commands, track.responses) {
                (1.., 0) if both => Some(LogFinding::NeverAnswered(mac_id)),
                (0, 1..) if both => Some(LogFinding::NeverAsked(mac_id)),
                _ => None,
            };
            let unfinished = track.unfinished().into_iter().flatten();
            one_side.into_iter().chain(unfinished.map(move |what| LogFinding::AtEnd(mac_id, what)))
        })
    }

    fn track(&mut self, mac_id: MacId) -> Option<&mut Track> {
        self.tracks.get_mut(usize::from(mac_id.get()))
    }

    fn command(&mut self, block: CommandBlock<'_>) -> [Option<LogFinding>; 5] {
        let limit = self.max_step;
        let Some(track) = self.track(block.mac_id()) else { return [None; 5] };
        track.commands = track.commands.saturating_add(1);
        track.unanswered = track.unanswered.saturating_add(1);
        let silent = track.responses > 0 && track.unanswered == NORMAL;
        track.fell_silent |= silent;
        let jump = track.count(block.update_counter(), block.code() == Code::NOP);
        let too_far = track.go(block, limit);
        let given_up = track.ask(block);
        [jump, too_far, given_up, silent.then_some(LogFinding::NoAnswer { commands: NORMAL }), None]
    }

    fn response(&mut self, block: ResponseBlock<'_>) -> [Option<LogFinding>; 5] {
        let Some(track) = self.track(block.mac_id()) else { return [None; 5] };
        let commands = core::mem::replace(&mut track.unanswered, 0);
        let again = track.responses > 0 && commands > NORMAL;
        track.responses = track.responses.saturating_add(1);
        track.alarmed |= block.status().contains(StatusFlags::ALARM);
        let stands = track.echo(block.update_counter_echo());
        let late = track.come_back(block.code());
        let answered = track.answer(block);
        let attributes = answered.and_then(|_| track.attributes(block));
        [again.then_some(LogFinding::AnswersAgain { commands }), stands, late, answered, attributes]
    }
}

/// What the whole of a log looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct LogShape {
    /// The size of the blocks.
    pub size: BlockSize,
    /// How many bytes of each word are turned round: 1 none, 2 or 4.
    pub word: usize,
    /// Bytes before the first whole block: not 0 where the log begins in the middle of one.
    pub skip: usize,
}

impl LogShape {
    /// The size, byte order and beginning with which most of the blocks make sense. `None` where nothing does, or where there are less
    /// than four blocks after the NOPs from before the start: they look alike in every shape, so give more of the log then.
    ///
    /// In a log of 32-byte blocks every second piece of 16 bytes is a sub block: a command's begins with 80h, 82h or 8Ah, which
    /// read as a main block would be a response of drive 0, 2 or 10.
    pub fn guess(bytes: &[u8]) -> Option<Self> {
        let shapes = || {
            let sizes = [BlockSize::Bytes16, BlockSize::Bytes32];
            [1, 2, 4].into_iter().flat_map(move |word| sizes.map(|size| Self { size, word, skip: 0 }))
        };
        // More than half.
        let aligned = Self::best(shapes(), bytes, 501);
        if aligned.is_some() {
            return aligned;
        }
        let shifted = shapes().flat_map(|shape| (1..shape.size.bytes()).map(move |skip| Self { skip, ..shape }));
        Self::best(shifted, bytes, 900)
    }

    /// The first of those that score best, and `least` at the least; a larger size only where it explains more.
    fn best(shapes: impl Iterator<Item = Self>, bytes: &[u8], least: usize) -> Option<Self> {
        let mut best: Option<(Self, usize)> = None;
        for shape in shapes {
            let score = shape.score(bytes).filter(|score| *score >= least);
            if let Some(score) = score.filter(|score| best.is_none_or(|(_, other)| *score > other)) {
                best = Some((shape, score));
            }
        }
        best.map(|(shape, _)| shape)
    }

    /// Sound blocks after the first ones that are NOPs, in thousandths.
    fn score(self, bytes: &[u8]) -> Option<usize> {
        let (mut good, mut all) = (0_usize, 0_usize);
        let blocks = bytes.get(self.skip..)?.chunks_exact(self.size.bytes());
        for block in blocks.skip_while(|block| self.is_nop(block)).take(256) {
            all = all.saturating_add(1);
            good = good.saturating_add(usize::from(self.is_sound(block) && !self.is_nop(block)));
        }
        good.saturating_mul(1_000).checked_div(all).filter(|_| all >= 4)
    }

    /// A block with its bytes in order.
    fn turned(self, block: &[u8]) -> [u8; 32] {
        let mut turned = [0; 32];
        for (to, from) in turned.chunks_exact_mut(self.word).zip(block.chunks_exact(self.word)) {
            for (to, from) in to.iter_mut().zip(from.iter().rev()) {
                *to = *from;
            }
        }
        turned
    }

    /// Code 00h: nothing else in the block is sure to tell anything.
    fn is_nop(self, block: &[u8]) -> bool {
        self.turned(block).get(1).is_some_and(|byte1| byte1 & 0x7f == 0)
    }

    /// Whether a block of this shape is what an encoder writes.
    fn is_sound(self, block: &[u8]) -> bool {
        self.turned(block).get(..self.size.bytes()).is_some_and(|turned| super::strict(turned).is_ok())
    }
}
