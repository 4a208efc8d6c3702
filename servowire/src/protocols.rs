//! The protocols that can be decoded.
//!
//! To add one: a file below `protocols/` that turns what its line delivers into [`Event`](crate::event::Event)s, a
//! variant of [`Protocol`], and a line in each of its methods. A start-stop protocol implements
//! [`StartStop`](crate::line::StartStop) and is done; another kind takes the [`Capture`] itself.

pub mod hdsl;
pub mod nikon;
pub mod rtex;
pub mod sorte;
pub mod tformat;

use crate::capture::Capture;
use crate::fault::{At, Fault};
use crate::line::{self, Stop};
use crate::output::Output;

/// A protocol by its name on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Protocol {
    /// Tamagawa T-Format.
    Tformat,
    /// Panasonic RTEX data blocks, from logs of bytes.
    Rtex,
    /// TI SORTE, from a network capture.
    Sorte,
    /// HIPERFACE DSL, from edges or samples of the pair.
    Hdsl,
    /// Nikon A-format.
    Nikon,
}

/// What the user said about line and protocol.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Settings {
    /// About the line.
    pub line: line::Options,
    /// About T-Format.
    pub tformat: tformat::Settings,
    /// About RTEX.
    pub rtex: rtex::Settings,
    /// About A-format.
    pub nikon: nikon::Settings,
}

impl Protocol {
    /// The names of all fields that its events may have.
    pub fn field_names(self) -> &'static [&'static str] {
        match self {
            Self::Tformat => tformat::FIELDS,
            // A log of blocks has no times, so there is no VCD to hold its fields.
            Self::Rtex => &[],
            Self::Sorte => sorte::FIELDS,
            Self::Hdsl => hdsl::FIELDS,
            Self::Nikon => nikon::FIELDS,
        }
    }

    /// Decodes a capture to its end. What comes out before a fault has been given to `out`.
    pub fn decode(self, file: &str, capture: Capture, settings: &Settings, out: &mut Output<'_>) -> Result<(), Stop> {
        match (self, capture) {
            // Whatever was asked for: the only protocol that has packets.
            (_, Capture::Packets(packets)) => sorte::decode(packets, out),
            (Self::Sorte, _) => Err(Fault::new(file, At::File, "SORTE is decoded from a pcapng file").into()),
            (Self::Tformat, capture) => {
                let make = |bit| tformat::Decoder::new(bit, settings.tformat);
                line::decode(file, capture, &settings.line, &make, out)
            }
            (Self::Hdsl, capture) => hdsl::decode(file, capture, &settings.line, out),
            (Self::Rtex, capture) => rtex::decode(file, capture, &settings.rtex, out),
            (Self::Nikon, capture) => {
                let make = |bit| nikon::Decoder::new(bit, settings.nikon);
                line::decode(file, capture, &settings.line, &make, out)
            }
        }
    }
}
