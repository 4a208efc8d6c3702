//! A recording that is already in memory.

use super::recording::{Change, Line};
use crate::fault::Fault;
use crate::time::Time;

/// Number of changes passed on at once.
const PIECE: usize = 4096;

/// Changes of channels that a program has measured or generated, without a file.
#[derive(Debug, Clone)]
pub struct Memory {
    names: Vec<String>,
    changes: Vec<Change>,
    end: Time,
    next: usize,
}

impl Memory {
    /// Creates a recording of channels called `names`, with their `changes` in the order of time; the first of a channel is
    /// its level at the beginning. The recording ends at `end`.
    pub fn new(names: Vec<String>, changes: Vec<Change>, end: Time) -> Self {
        Self { names, changes, end, next: 0 }
    }

    fn rest(&self) -> &[Change] {
        self.changes.get(self.next..).unwrap_or_default()
    }
}

impl Line for Memory {
    fn channels(&self) -> &[String] {
        &self.names
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let piece = self.rest().get(..PIECE).unwrap_or(self.rest());
        changes.extend_from_slice(piece);
        self.next += piece.len();
        Ok(!self.rest().is_empty())
    }

    fn reached(&self) -> Time {
        self.rest().first().map_or(self.end, |next| next.time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_changes_come_once_and_the_end_last() {
        let change = |at: u32| Change { time: Time::from_ps(at.into()), channel: 0, level: at % 2 == 0 };
        let all: Vec<Change> = (0..5000).map(change).collect();
        let mut memory = Memory::new(vec!["A".to_owned()], all.clone(), Time::from_ps(7000));
        assert_eq!(memory.channels(), ["A"]);
        let mut read = Vec::new();
        assert!(memory.read(&mut read).unwrap());
        assert_eq!((read.len(), memory.reached()), (4096, Time::from_ps(4096)));
        assert!(!memory.read(&mut read).unwrap());
        assert_eq!((read == all, memory.reached()), (true, Time::from_ps(7000)));
        assert!(!memory.read(&mut read).unwrap());
        assert_eq!(read.len(), 5000);
    }
}
