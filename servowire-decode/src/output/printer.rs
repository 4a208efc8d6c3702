//! A form of output, and what it is told beside the events.

use std::io;

use crate::capture::Change;
use crate::codec::Codec;
use crate::event::Event;

/// A line of a capture that is decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lane {
    /// The name of its channel, or of its two.
    pub channel: String,
    /// Its channels by index.
    pub channels: Vec<u16>,
    /// Its protocol.
    pub protocol: &'static dyn Codec,
    /// Bits per second, by the protocol.
    pub rate: u32,
}

/// Where events come from: the file, its lines that are decoded, and the one that speaks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origin {
    /// The name of the file.
    pub file: String,
    /// The lines found so far.
    pub lanes: Vec<Lane>,
    /// The number of the line that speaks, from 0; a log of bytes has none.
    pub speaks: usize,
}

impl Origin {
    /// The line that speaks; none in a log of bytes.
    pub fn lane(&self) -> Option<&Lane> {
        self.lanes.get(self.speaks)
    }

    /// Who sends an event, or is addressed by it.
    pub fn speaker(&self, event: &Event) -> Speaker {
        Speaker { lane: self.speaks, address: event.address }
    }

    /// Whether a speaker is meant by what a person wrote: its name, its channel, its address, or both as `A/3`.
    pub(crate) fn is_meant(&self, speaker: Speaker, what: &str) -> bool {
        let channel = self.lanes.get(speaker.lane).map_or("", |lane| lane.channel.as_str());
        let address = speaker.address.map(|address| address.to_string());
        let both = what.rsplit_once('/').is_some_and(|(a, b)| a == channel && address.as_deref() == Some(b));
        what == channel || address.as_deref() == Some(what) || both || what == self.name(speaker)
    }

    /// A readable name of a speaker: its channel, if there are several, and its address. Empty if there is no other speaker.
    pub fn name(&self, speaker: Speaker) -> String {
        let lane = self.lanes.get(speaker.lane).filter(|_| self.lanes.len() > 1);
        let address = speaker.address.map(|address| format!("address {address}"));
        [lane.map(|lane| lane.channel.clone()), address].into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

/// An encoder, drive or device, whose events belong together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Speaker {
    /// The number of its line, from 0.
    pub lane: usize,
    /// Its address, if the protocol has one.
    pub address: Option<u32>,
}

/// A form of output that is written file by file.
pub trait Printer {
    /// A file begins.
    fn begin(&mut self, _origin: &Origin) -> io::Result<()> {
        Ok(())
    }

    /// The channels of the capture; the lines that `origin` names so far are decoded.
    fn channels(&mut self, _origin: &Origin, _channels: &[String]) -> io::Result<()> {
        Ok(())
    }

    /// Whether it takes the changes of the channels: they cost time.
    fn wants_changes(&self) -> bool {
        false
    }

    /// A change of any channel. The events made of it come later.
    fn change(&mut self, _change: &Change) -> io::Result<()> {
        Ok(())
    }

    /// The next event.
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()>;

    /// Nothing comes for a while: what is complete is shown.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// The file is at its end.
    fn end(&mut self, _origin: &Origin) -> io::Result<()> {
        Ok(())
    }
}
