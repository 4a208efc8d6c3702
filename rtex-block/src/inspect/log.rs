//! A whole log of blocks: what no single block shows.

use core::fmt;

use crate::block::{BlockSize, LEN};
use crate::code::{Code, CyclicCode};
use crate::command::CommandBlock;
use crate::execution::Execution;
use crate::header::{MacId, UpdateCounter};
use crate::position::{Gear, max_step, step};
use crate::response::ResponseBlock;

/// Something that a log shows between its blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LogFinding {
    /// The echo of the counter stands still for more than the two communications that an update period can have.
    EchoStands {
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
    /// The drive has answered before, and not to the last commands: more than the two communications that an update period
    /// can have.
    NoAnswer {
        /// Commands without an answer.
        commands: u32,
    },
    /// Drives were sent commands, and this one never answered.
    NeverAnswered(MacId),
    /// This drive answers and was never sent a command.
    NeverAsked(MacId),
}

impl fmt::Display for LogFinding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::EchoStands { responses } => write!(f, "the counter echo stands still for {responses} responses"),
            Self::CounterJumps { from, to } => write!(f, "the counter goes from {from} to {to}"),
            Self::CodeLate { responses } => write!(f, "the code came back after {responses} responses"),
            Self::PositionStep { step, max } => write!(f, "position step {step}, at most {max}: Err27.4"),
            Self::Answered { responses, busy } => {
                write!(f, "answered after {responses} responses, {busy} of them busy")
            }
            Self::NoAnswer { commands } => write!(f, "no answer to the last {commands} commands"),
            Self::NeverAnswered(mac_id) => write!(f, "drive {mac_id} never answered"),
            Self::NeverAsked(mac_id) => write!(f, "drive {mac_id} answers and was never sent a command"),
        }
    }
}

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
    still: u32,
    position: Option<i32>,
    /// The code of the commands, and the responses since it is that; `None` once it has come back.
    code: Option<Code>,
    awaited: Option<u32>,
    /// Responses, and busy ones, since a request is out.
    request: Option<(u32, u32)>,
}

impl Track {
    const NEW: Self = Self {
        commands: 0,
        responses: 0,
        unanswered: 0,
        counter: None,
        sent_twice: false,
        echo: None,
        still: 0,
        position: None,
        code: None,
        awaited: None,
        request: None,
    };
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

    /// Takes the next block; of 32 bytes the main half is looked at. Gives what it shows, in no more than three findings.
    pub fn block(&mut self, bytes: &[u8]) -> impl Iterator<Item = LogFinding> + use<> {
        let mut found = [None; 3];
        if let Some(main) = bytes.first_chunk::<LEN>() {
            if let Ok(command) = CommandBlock::of(main) {
                found = self.command(command);
            } else if let Ok(response) = ResponseBlock::of(main) {
                found = self.response(response);
            }
        }
        found.into_iter().flatten()
    }

    /// At the end of the log: drives that were only on one side of it.
    pub fn end(&self) -> impl Iterator<Item = LogFinding> {
        let both = self.tracks.iter().any(|t| t.commands > 0) && self.tracks.iter().any(|t| t.responses > 0);
        (0..).zip(&self.tracks).filter(move |_| both).filter_map(|(number, track)| {
            match (track.commands, track.responses) {
                (0, 0) => None,
                (_, 0) => Some(LogFinding::NeverAnswered(MacId::truncate(number))),
                (0, _) => Some(LogFinding::NeverAsked(MacId::truncate(number))),
                _ => None,
            }
        })
    }

    fn track(&mut self, mac_id: MacId) -> Option<&mut Track> {
        self.tracks.get_mut(usize::from(mac_id.get()))
    }

    fn command(&mut self, block: CommandBlock<'_>) -> [Option<LogFinding>; 3] {
        let limit = self.max_step;
        let Some(track) = self.track(block.mac_id()) else { return [None; 3] };
        track.commands = track.commands.saturating_add(1);
        track.unanswered = track.unanswered.saturating_add(1);
        // Said once.
        let silent = (track.responses > 0 && track.unanswered == 3).then_some(LogFinding::NoAnswer { commands: 3 });
        let nop = block.code() == Code::NOP;
        let to = block.update_counter();
        let jump = track.counter.filter(|_| !nop).and_then(|from| {
            let repeated = from == to && !track.sent_twice;
            (!repeated && from.next() != to).then_some(LogFinding::CounterJumps { from, to })
        });
        track.sent_twice = track.counter == Some(to);
        track.counter = Some(to);

        let at = (block.code().cyclic() == Some(CyclicCode::CyclicPosition)).then(|| block.command_data1());
        let moved = track.position.zip(at).map(|(old, new)| step(old, new));
        // Without Servo_On the drive follows nothing.
        let on = block.control().contains(crate::control::ControlBits::SERVO_ON);
        let too_far = moved
            .filter(|_| on)
            .zip(limit)
            .and_then(|(step, max)| (step.unsigned_abs() > max).then_some(LogFinding::PositionStep { step, max }));
        track.position = at;

        if track.code != Some(block.code()) {
            track.code = Some(block.code());
            track.awaited = Some(0);
            let asks = !matches!(block.code().noncyclic_bits(), 0 | 7);
            track.request = asks.then_some((0, 0));
        }
        [jump, too_far, silent]
    }

    fn response(&mut self, block: ResponseBlock<'_>) -> [Option<LogFinding>; 3] {
        let Some(track) = self.track(block.mac_id()) else { return [None; 3] };
        track.responses = track.responses.saturating_add(1);
        track.unanswered = 0;
        let echo = block.update_counter_echo();
        track.still = if track.echo == Some(echo) { track.still.saturating_add(1) } else { 0 };
        track.echo = Some(echo);
        // Said once, when it is more than two communications; counters that stand at 0 go out before the start.
        let started = track.code.is_none_or(|code| code != Code::NOP);
        let stands = (track.still == 2 && started).then_some(LogFinding::EchoStands { responses: 3 });

        let mut late = None;
        if let (Some(waited), Some(code)) = (track.awaited, track.code) {
            let waited = waited.saturating_add(1);
            if block.code() == code {
                track.awaited = None;
                late = (waited > 3).then_some(LogFinding::CodeLate { responses: waited });
            } else {
                track.awaited = Some(waited);
            }
        }

        let mut answered = None;
        if let Some((responses, busy)) = track.request {
            let responses = responses.saturating_add(1);
            let own = Some(block.code()) == track.code;
            let is_busy = own && block.noncyclic().execution().is_some_and(|e| e.contains(Execution::BUSY));
            if own && !is_busy {
                track.request = None;
                answered = Some(LogFinding::Answered { responses, busy });
            } else {
                track.request = Some((responses, busy.saturating_add(is_busy.into())));
            }
        }
        [stands, late, answered]
    }
}

/// What the whole of a log looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LogShape {
    /// The size of the blocks.
    pub size: BlockSize,
    /// How many bytes of each word are turned round: 1 none, 2 or 4.
    pub word: usize,
}

impl LogShape {
    /// The size and byte order with which most of the blocks at the beginning make sense; `None` for less than four blocks, or
    /// where nothing does.
    ///
    /// In a log of 32-byte blocks every second piece of 16 bytes is a sub block: a command's begins with 80h, 82h or 8Ah, which
    /// read as a main block would be a response of drive 0, 2 or 10.
    pub fn guess(bytes: &[u8]) -> Option<Self> {
        let shapes = [1, 2, 4]
            .into_iter()
            .flat_map(|word| [BlockSize::Bytes16, BlockSize::Bytes32].map(|size| Self { size, word }));
        let mut best: Option<(Self, usize)> = None;
        for shape in shapes {
            let (mut good, mut all) = (0_usize, 0_usize);
            for block in bytes.chunks_exact(shape.size.bytes()).take(64) {
                all = all.saturating_add(1);
                good = good.saturating_add(usize::from(shape.is_sound(block)));
            }
            let score = good.saturating_mul(1_000).checked_div(all).unwrap_or(0);
            // More than half; a larger size only where it explains more.
            if all >= 4 && score > 500 && best.is_none_or(|(_, other)| score > other) {
                best = Some((shape, score));
            }
        }
        best.map(|(shape, _)| shape)
    }

    /// Whether a block of this shape is what an encoder writes, and no NOP: too little to go by.
    fn is_sound(self, block: &[u8]) -> bool {
        let mut turned = [0; 32];
        let Some(turned) = turned.get_mut(..self.size.bytes()) else { return false };
        for (to, from) in turned.chunks_exact_mut(self.word).zip(block.chunks_exact(self.word)) {
            for (to, from) in to.iter_mut().zip(from.iter().rev()) {
                *to = *from;
            }
        }
        let nop = turned.get(1).is_some_and(|byte1| byte1 & 0x7f == 0);
        super::strict(turned).is_ok() && !nop
    }
}
