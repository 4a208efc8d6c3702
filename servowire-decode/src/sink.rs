//! The receiver of single events, and the simplest one: a tally.

use std::io;

use crate::event::{Event, Verdict};

/// Takes events in the order of the line.
pub trait Sink {
    /// Takes the next event.
    fn event(&mut self, event: &Event) -> io::Result<()>;
}

/// Counts frames by their verdict.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Good frames.
    pub ok: u64,
    /// Frames refused.
    pub refused: u64,
    /// Answers that did not come.
    pub missing: u64,
}

impl Tally {
    /// The number of faults: refused frames and missing answers.
    pub fn faults(self) -> u64 {
        self.refused + self.missing
    }
}

impl Sink for Tally {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        match event.verdict {
            _ if event.remark => {}
            Verdict::Ok => self.ok += 1,
            Verdict::Refused(_) if event.verdict.is_silence() => self.missing += 1,
            Verdict::Refused(_) => self.refused += 1,
        }
        Ok(())
    }
}
