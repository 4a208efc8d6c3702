//! What every protocol provides: one row of the table in `protocols.rs`.

use std::fmt;
use std::io;
use std::ops::Deref;

use crate::capture::hexlog::Burst;
use crate::capture::pcapng::Packet;
use crate::event::{Event, Place, Refusal};
use crate::line::evidence::Weights;
use crate::line::lane::LineDecoder;
use crate::settings::Settings;
use crate::sink::Sink;

/// What is known about a protocol without decoding anything.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Facts {
    /// Its name on a command line.
    pub name: &'static str,
    /// Its name as people write it.
    pub title: &'static str,
    /// A line about it, for the help text of a program.
    pub about: &'static str,
    /// The input from which it is decoded, for a message to users who have something else.
    pub needs: &'static str,
    /// The names of all fields that its events on a line or in packets may have.
    pub fields: &'static [&'static str],
    /// Its nominal bit rates on a recorded line; empty if there is no such line.
    pub rates: &'static [u32],
    /// How strongly its frames prove the protocol on a recorded line.
    pub weights: Weights,
    /// It has one rate, set by the clock of its master: a recording may have one sample per bit.
    pub clocked: bool,
    /// An answer can be identified without its request.
    pub answers_alone: bool,
    /// A frame in a log carries a check, so other bytes are not mistaken for a frame.
    pub checked: bool,
    /// Published recordings: names and contents, each a VCD.
    pub captures: &'static [(&'static str, &'static [u8])],
}

impl Facts {
    /// Creates the description of a protocol that has neither a line nor captures.
    pub const NONE: Self = Self {
        name: "",
        title: "",
        about: "",
        needs: "",
        fields: &[],
        rates: &[],
        weights: Weights { request: 0, answer: 0, alone: 0 },
        clocked: false,
        answers_alone: true,
        checked: true,
        captures: &[],
    };
}

/// A protocol: its description and its decoders.
pub trait Codec: Sync {
    /// Its description; the fields are those of the codec itself.
    fn facts(&self) -> &'static Facts;

    /// Returns a decoder for one idle-high line at `rate` bits per second.
    fn line(&self, _rate: u32, _settings: &Settings) -> Option<Box<dyn LineDecoder>> {
        None
    }

    /// Returns a decoder for a log of bytes that begins with `sample`.
    fn log(&self, _settings: &Settings, _sample: &[Burst]) -> Option<Box<dyn LogDecoder>> {
        None
    }

    /// Decodes a network packet to an event.
    fn packet(&self, _packet: &Packet) -> Option<Event> {
        None
    }
}

impl Deref for dyn Codec + '_ {
    type Target = Facts;

    fn deref(&self) -> &Facts {
        self.facts()
    }
}

/// Two protocols are the same if their names are.
impl PartialEq for dyn Codec {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for dyn Codec {}

impl fmt::Debug for dyn Codec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Turns a log of bytes into events.
pub trait LogDecoder {
    /// Returns remarks about the log as a whole, before its frames.
    fn note(&self) -> Option<String> {
        None
    }

    /// Bytes that followed each other, without times.
    fn burst(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()>;

    /// Takes a burst, or what the log has in its place.
    fn take(&mut self, burst: &Burst, out: &mut dyn Sink) -> io::Result<()> {
        let Some(what) = &burst.spoilt else { return self.burst(burst, out) };
        self.spoilt(out)?;
        out.event(&Event::new(Place::Line(burst.line), None, "line", Vec::new(), Refusal::new("hex", what).into()))
    }

    /// Reports that a line of the log could not be read: it may have been the awaited answer.
    fn spoilt(&mut self, out: &mut dyn Sink) -> io::Result<()>;

    /// Ends the log.
    fn end(&mut self, out: &mut dyn Sink) -> io::Result<()>;

    /// Returns the findings about the log as a whole.
    fn found(&self) -> Found {
        Found::default()
    }
}

/// Findings about a log as a whole, at its end.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Found {
    /// Why the log cannot be read as it is written.
    pub misread: Option<String>,
    /// Anything that needs attention although every frame is good.
    pub trouble: Option<String>,
}
