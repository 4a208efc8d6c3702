use nrz_line::Window;

use crate::layout::FRAME_BITS;
use crate::raw_response::RawResponse;
use crate::units::Units;

/// A fault that the encoder or its line can be made to have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[non_exhaustive]
pub enum Fault {
    /// None.
    #[default]
    None,
    /// The encoder does not answer.
    Silent,
    /// Bit `at` of the response's line bits is inverted; nothing happens if the response is shorter.
    FlipBit {
        /// Index, 0..=107.
        at: u8,
    },
    /// The line ends after this many bits of the response.
    CutAfter {
        /// Number of bits that are sent.
        bits: u8,
    },
    /// The CRC-8 of the response is inverted.
    BadCrc,
}

/// What an encoder sends, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmission {
    /// The frames without the fault.
    pub frames: RawResponse,
    /// The line bits, with the fault.
    pub line: Window,
    /// When the first start bit is on the line, in ns.
    pub start_ns: u64,
    /// When the last bit ends, in ns.
    pub end_ns: u64,
}

impl Transmission {
    /// Returns the whole frames of the line as a receiver on their grid sees them, including the fault: a wrong start bit or
    /// delimiter makes a framing error.
    #[expect(clippy::cast_possible_truncation, reason = "sixteen bits")]
    pub fn units(&self) -> Units {
        let frame = |at: u32| {
            let framed = !self.line.get(at)? && self.line.get(at.checked_add(17)?)?;
            Some(framed.then_some((self.line.bits() >> at.wrapping_add(1)) as u16))
        };
        (0..u32::from(self.frames.frames())).map_while(|number| frame(number.wrapping_mul(FRAME_BITS))).collect()
    }
}
