//! The first line of a console.

use core::fmt;

use crate::oscillator::Source;
use crate::pins::Board;

/// The first output of an image: its name and version, its clock source, its rates, and the board with its pins.
#[derive(Debug, Clone, Copy)]
pub struct FirstLine {
    /// The name of the image.
    pub image: &'static str,
    /// Its version.
    pub version: &'static str,
    /// The board.
    pub board: &'static Board,
    /// Core clock, Hz.
    pub core_hz: u32,
    /// Source of the clock.
    pub source: Source,
    /// Bit rate of the encoder's line, bit/s.
    pub bits_per_second: u32,
}

impl fmt::Display for FirstLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { image, version, board, core_hz, source, bits_per_second } = self;
        write!(f, "{image} {version}, {bits_per_second} bit/s, core {core_hz} Hz ")?;
        match source {
            Source::Crystal => write!(f, "of the crystal of {} Hz", board.crystal_hz)?,
            Source::Internal => {
                write!(f, "NOT of the crystal of {} Hz, which does not start: rates may be 1 % off", board.crystal_hz)?;
            }
        }
        write!(f, ", {board}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pins::Pin;
    use std::string::ToString;

    const PINS: &[Pin] = &[Pin { name: "PB3", signal: "DI", at: "D3" }];
    static BOARD: Board = Board { name: "TEST", crystal_hz: 24_000_000, pins: PINS, power_stage: &[] };

    #[test]
    fn a_missing_crystal_is_said() {
        let line = FirstLine {
            image: "tformat",
            version: "0.1.0",
            board: &BOARD,
            core_hz: 160_000_000,
            source: Source::Crystal,
            bits_per_second: 2_500_000,
        };
        let said = "tformat 0.1.0, 2500000 bit/s, core 160000000 Hz of the crystal of 24000000 Hz, TEST, DI PB3 (D3)";
        assert_eq!(line.to_string(), said);
        let said = FirstLine { source: Source::Internal, ..line }.to_string();
        assert!(said.contains("NOT of the crystal of 24000000 Hz, which does not start"), "{said}");
    }
}
