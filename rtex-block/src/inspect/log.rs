//! Inspects a whole log, for findings that no single block shows.

mod finding;
mod shape;
mod track;

pub use finding::{DriveTrouble, LogFinding, Trouble, Unfinished};
pub use shape::{LogShape, ShapeDoubt};

use crate::block::LEN;
use crate::code::Code;
use crate::command::CommandBlock;
use crate::header::MacId;
use crate::position::{Gear, max_step};
use crate::response::ResponseBlock;
use crate::status::StatusFlags;
use track::{NORMAL, Track};

/// Inspects the blocks of a log in order, of all drives and both directions, 16 or 32 bytes each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LogAnalysis {
    /// Largest step of the command position; `None` if the update period is not known.
    max_step: Option<u32>,
    tracks: [Track; MacId::COUNT],
}

impl LogAnalysis {
    /// Starts a log. `update_ns` is the update period, if it is known; together with `gear` it determines the limit of the
    /// position step.
    pub const fn new(update_ns: Option<u32>, gear: Gear) -> Self {
        let max_step = match update_ns {
            Some(update_ns) => Some(max_step(update_ns, gear)),
            None => None,
        };
        Self { max_step, tracks: [Track::NEW; MacId::COUNT] }
    }

    /// Takes the next block; of 32 bytes, the main half is inspected. Returns at most five findings.
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

    /// Returns what needs attention in the log, drive by drive.
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

    /// Returns the findings at the end of the log: drives that appeared on only one side, and what is still in progress.
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

    /// Forgets a drive: the blocks in which it was seen were misread.
    pub fn forget(&mut self, mac_id: MacId) {
        if let Some(track) = self.track(mac_id) {
            *track = Track::NEW;
        }
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
