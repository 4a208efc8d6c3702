//! A recording of lines, in any file format.

use super::input::Input;
use super::samples::Samples;
use crate::fault::Fault;
use crate::time::Time;

/// A change of a channel to a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// When it happens, in picoseconds of the capture's own time (negative before its trigger).
    pub time: Time,
    /// Index into [`Line::channels`].
    pub channel: u16,
    /// The level from here onwards.
    pub level: bool,
}

/// A part of a recording in which the lines are unknown; times in picoseconds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hole {
    /// Where the recording stops.
    pub from: Time,
    /// Where it continues.
    pub to: Time,
}

/// A recording of lines.
pub trait Line {
    /// The names of the channels. A change refers to them by index.
    fn channels(&self) -> &[String];

    /// Appends the next changes, in the order of time, and returns whether there may be more.
    ///
    /// The first change of a channel is its level at the beginning. After a fault, the changes before it have been
    /// appended, and nothing more will come.
    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault>;

    /// Returns the next samples of a channel instead of the next changes, if this is a recording of samples and no other
    /// channel moves meanwhile; otherwise nothing, nor before the first levels have been read. Anything it does not return
    /// comes from [`read`](Self::read).
    fn samples(&mut self, channel: u16) -> Option<Result<Samples<'_>, Fault>> {
        let _ = channel;
        None
    }

    /// Returns the time up to which the recording was read, in picoseconds.
    fn reached(&self) -> Time;

    /// Returns the hole in the recording before the last data read, if there is one.
    fn hole(&mut self) -> Option<Hole> {
        None
    }

    /// When it was recorded, in the words of the file, which rarely name the time zone.
    fn date(&self) -> Option<&str> {
        None
    }

    /// Skips to a time without reading what comes before it, if possible; the levels of the channels at that time come next.
    fn skip(&mut self, _to: Time) -> Result<bool, Fault> {
        Ok(false)
    }

    /// Returns the input, if it is read as it arrives.
    fn input(&mut self) -> Option<&mut Input> {
        None
    }
}
