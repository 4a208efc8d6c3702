//! What the user said about line and protocol.

use rtex_block::position::Gear;

/// What the user said about line and protocol.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Settings {
    /// About the line.
    pub line: Options,
    /// About the encoder.
    pub widths: Widths,
    /// About RTEX.
    pub rtex: Rtex,
    /// Whether the packets of a network end with their frame check sequence; otherwise as the file says.
    pub fcs: Option<bool>,
}

/// What the user said about the line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    /// The channel by name or number.
    pub channel: Option<String>,
    /// The channels of the requests and of the answers, where they are two.
    pub pair: Option<(String, String)>,
    /// Bits a second.
    pub bit_rate: Option<u32>,
    /// Whether the line idles low.
    pub inverted: Option<bool>,
}

/// What the frames do not tell about an encoder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Widths {
    /// Bits of a turn; otherwise as the encoder says, if the line carries it.
    pub single_turn_bits: Option<u8>,
    /// Bits that count turns; otherwise as the encoder says, else 16.
    pub multi_turn_bits: Option<u8>,
}

impl Widths {
    /// The widths as the user gave them, else as the encoder `said`.
    pub(crate) fn or(self, said: Option<(u8, u8)>) -> Option<(u8, u8)> {
        let single_turn = self.single_turn_bits.or(said.map(|said| said.0))?;
        Some((single_turn, self.multi_turn_bits.or(said.map(|said| said.1)).unwrap_or(16)))
    }
}

/// What blocks of RTEX do not tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rtex {
    /// Bytes of a block, 16 or 32; otherwise what most of the first blocks look like.
    pub block_size: Option<usize>,
    /// Only the blocks of this drive.
    pub mac_id: Option<u8>,
    /// Update period, ns: gives the log a time axis and the position step its limit.
    pub period_ns: Option<u32>,
    /// Electronic gear of the drives, for the same limit.
    pub gear: Gear,
    /// Show every block whole, instead of what changed in it.
    pub whole: bool,
}

impl Default for Rtex {
    fn default() -> Self {
        Self { block_size: None, mac_id: None, period_ns: None, gear: Gear::UNITY, whole: false }
    }
}
