//! The kinds of files.

use super::byte_table::ByteTable;
use super::hexlog::{Burst, HexLog};
use super::input::Input;
use super::pcapng::Pcapng;
use super::raw::Raw;
use super::recording::Line;
use super::records::Records;
use crate::fault::Fault;

/// An opened file.
pub enum Capture {
    /// Changes with their times: VCD, Saleae.
    Edges(Box<dyn Line>),
    /// Samples at a fixed rate.
    Samples(Raw),
    /// Logged bytes, with or without times.
    Bytes(ByteLog),
    /// Packets of a network.
    Packets(Pcapng),
}

/// Logged bytes, in bursts.
pub enum ByteLog {
    /// Hex digits, one burst per line.
    Hex(HexLog),
    /// Records of one size.
    Records(Records),
    /// A table with one burst per row.
    Table(ByteTable),
}

impl Capture {
    /// When it was recorded, in the words of the file.
    pub fn date(&self) -> Option<&str> {
        match self {
            Self::Edges(line) => line.date(),
            _ => None,
        }
    }
}

impl ByteLog {
    /// Returns the next burst; `None` at the end.
    pub fn burst(&mut self) -> Result<Option<Burst>, Fault> {
        match self {
            Self::Hex(log) => log.burst(),
            Self::Records(log) => log.burst(),
            Self::Table(log) => log.burst(),
        }
    }

    /// Returns whether the log says when its bytes were sent. Call it before anything is read.
    pub fn has_times(&mut self) -> bool {
        match self {
            Self::Hex(log) => log.has_times(),
            Self::Records(_) => false,
            Self::Table(log) => log.has_times(),
        }
    }

    /// Returns whether reading the next burst would have to wait.
    pub(crate) fn pauses(&mut self) -> bool {
        self.input().pauses()
    }

    /// Returns whether complete events should be shown now.
    pub(crate) fn is_due(&mut self) -> bool {
        self.input().is_due()
    }

    fn input(&mut self) -> &mut Input {
        match self {
            Self::Hex(log) => log.input(),
            Self::Records(log) => log.input(),
            Self::Table(log) => log.input(),
        }
    }
}
