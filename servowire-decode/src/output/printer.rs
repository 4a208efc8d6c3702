//! A form of output, and the information that it gets besides the events.

use std::io;

use crate::capture::Change;
use crate::codec::Codec;
use crate::event::Event;

/// A line of a capture that is decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lane {
    /// The name of its channel, or of both its channels.
    pub channel: String,
    /// Its channels by index.
    pub channels: Vec<u16>,
    /// Its protocol.
    pub protocol: &'static dyn Codec,
    /// Nominal bits per second of the protocol.
    pub rate: u32,
}

/// Where events come from: the file, its decoded lines, and the line of the present event.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origin {
    /// The name of the file.
    pub file: String,
    /// The lines found so far.
    pub lanes: Vec<Lane>,
    /// Returns the number of the line of the present event, from 0; a log of bytes has none.
    pub speaks: usize,
}

impl Origin {
    /// Returns the line of the present event; `None` in a log of bytes.
    pub fn lane(&self) -> Option<&Lane> {
        self.lanes.get(self.speaks)
    }

    /// Returns the sender of an event, or the one addressed by it.
    pub fn speaker(&self, event: &Event) -> Speaker {
        Speaker { lane: self.speaks, address: event.address }
    }

    /// Returns whether a text from the user means this speaker: its name, its channel, its address, or both as `A/3`.
    pub(crate) fn is_meant(&self, speaker: Speaker, what: &str) -> bool {
        let channel = self.lanes.get(speaker.lane).map_or("", |lane| lane.channel.as_str());
        let address = speaker.address.map(|address| address.to_string());
        let both = what.rsplit_once('/').is_some_and(|(a, b)| a == channel && address.as_deref() == Some(b));
        what == channel || address.as_deref() == Some(what) || both || what == self.name(speaker)
    }

    /// Returns a readable name of a speaker: its channel, if there are several, and its address. Empty if there is no other
    /// speaker.
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
    /// Begins a file.
    fn begin(&mut self, _origin: &Origin) -> io::Result<()> {
        Ok(())
    }

    /// Takes the channels of the capture; the lines named by `origin` so far are decoded.
    fn channels(&mut self, _origin: &Origin, _channels: &[String]) -> io::Result<()> {
        Ok(())
    }

    /// Returns whether it takes the changes of the channels, which cost time.
    fn wants_changes(&self) -> bool {
        false
    }

    /// Takes a change of any channel. The events made from it come later.
    fn change(&mut self, _change: &Change) -> io::Result<()> {
        Ok(())
    }

    /// Takes the next event.
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()>;

    /// Nothing arrives for a while: shows whatever is complete.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Ends the file.
    fn end(&mut self, _origin: &Origin) -> io::Result<()> {
        Ok(())
    }
}
