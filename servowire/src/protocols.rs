//! The protocols that can be decoded.
//!
//! To add one: a file below `protocols/` that turns what its line delivers into [`Event`](crate::event::Event)s, a
//! variant of [`Protocol`], and a line in each of its methods. A start-stop protocol implements
//! [`StartStop`](crate::line::StartStop), another one on a pair of wires [`LineDecoder`]; the survey then finds it by
//! itself. Another kind takes the [`Capture`].

mod bytes;
mod group;
pub mod hdsl;
pub mod nikon;
mod plausible;
pub mod rtex;
pub mod sorte;
pub mod tformat;

use crate::capture::Capture;
use crate::fault::{At, Fault};
use crate::line::{self, LineDecoder, StartStopLine, Stop, Weights};
use crate::output::Output;

pub use group::Widths;

/// A protocol by its name on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Protocol {
    /// Whatever the capture holds.
    Auto,
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
    /// About the encoder.
    pub widths: Widths,
    /// About RTEX.
    pub rtex: rtex::Settings,
}

impl Protocol {
    /// The name as people write it.
    pub fn title(self) -> &'static str {
        match self {
            Self::Auto => "any protocol",
            Self::Tformat => "T-Format",
            Self::Rtex => "RTEX",
            Self::Sorte => "SORTE",
            Self::Hdsl => "HIPERFACE DSL",
            Self::Nikon => "A-format",
        }
    }

    /// The protocols of recorded lines that are meant.
    pub fn of_lines(self) -> &'static [Self] {
        match self {
            Self::Auto => &[Self::Tformat, Self::Nikon, Self::Hdsl],
            Self::Tformat => &[Self::Tformat],
            Self::Nikon => &[Self::Nikon],
            Self::Hdsl => &[Self::Hdsl],
            Self::Rtex | Self::Sorte => &[],
        }
    }

    /// Its nominal bit rates on a recorded line.
    pub fn rates(self) -> &'static [u32] {
        match self {
            Self::Tformat => tformat::RATES,
            Self::Nikon => nikon::RATES,
            Self::Hdsl => hdsl::RATES,
            Self::Auto | Self::Rtex | Self::Sorte => &[],
        }
    }

    /// What its frames prove on a recorded line.
    pub(crate) fn weights(self) -> Weights {
        match self {
            // 9 of 256 control fields; with the echo and the check field of the answer.
            Self::Tformat => Weights { request: 4, answer: 24, alone: 16 },
            // Sync and frame code, CRC-3; sync code, fixed bit, echo and CRC-8.
            Self::Nikon => Weights { request: 6, answer: 22, alone: 14 },
            // Twelve fixed bits and a word of the code; six words and two checks.
            _ => Weights { request: 8, answer: 16, alone: 16 },
        }
    }

    /// A decoder for one idle-high line at `rate` bits a second; none where it has no line.
    pub(crate) fn line_decoder(self, rate: u32, settings: &Settings) -> Option<Box<dyn LineDecoder>> {
        let bit = 1e12 / f64::from(rate.max(1));
        match self {
            Self::Tformat => {
                let decoder = tformat::Decoder::new(bit as i64, settings.widths);
                Some(Box::new(StartStopLine::new(bit, decoder, self.weights())))
            }
            Self::Nikon => {
                let decoder = nikon::Decoder::new(bit as i64, settings.widths);
                Some(Box::new(StartStopLine::new(bit, decoder, self.weights())))
            }
            Self::Hdsl => Some(Box::new(hdsl::DslLine::new(bit))),
            Self::Auto | Self::Rtex | Self::Sorte => None,
        }
    }

    /// The names of all fields that its events may have.
    pub fn field_names(self) -> &'static [&'static str] {
        match self {
            Self::Tformat => tformat::FIELDS,
            // A log of blocks has no times, so there is no VCD to hold its fields.
            Self::Auto | Self::Rtex => &[],
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
            (_, Capture::Bytes(log)) => bytes::decode(file, log, self, settings, out),
            (Self::Sorte, _) => Err(Fault::new(file, At::File, "SORTE is decoded from a pcapng file").into()),
            (Self::Rtex, _) => Err(Fault::new(file, At::File, rtex::NO_LINE).into()),
            (_, Capture::Edges(mut line)) => line::decode(file, line.as_mut(), self, settings, out),
            (_, Capture::Samples(mut raw)) => line::samples(file, &mut raw, self, settings, out),
        }
    }
}
