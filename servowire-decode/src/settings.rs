//! The user's settings for line and protocol.

use rtex_block::position::Gear;

/// The user's settings for line and protocol.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Settings {
    /// Settings of the line.
    pub line: Options,
    /// Settings of the encoder.
    pub widths: Widths,
    /// About RTEX.
    pub rtex: Rtex,
    /// Whether network packets end with their frame check sequence; if unset, as the file says.
    pub fcs: Option<bool>,
}

/// The user's settings for the line.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Options {
    /// The channel by name or number.
    pub channel: Option<String>,
    /// The channels of the requests and of the answers, if they are separate.
    pub pair: Option<(String, String)>,
    /// Bits per second.
    pub bit_rate: Option<u32>,
    /// Whether the line idles low.
    pub inverted: Option<bool>,
}

/// Properties of an encoder that its frames do not carry.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Widths {
    /// Bits within a turn; if unset, as the encoder says, provided that this was seen on the line.
    pub single_turn_bits: Option<u8>,
    /// Bits that count turns; if unset, as the encoder says, otherwise 16.
    pub multi_turn_bits: Option<u8>,
}

impl Widths {
    /// The widths as given by the user, otherwise as the encoder `said`.
    pub(crate) fn or(self, said: Option<(u8, u8)>) -> Option<(u8, u8)> {
        let single_turn = self.single_turn_bits.or(said.map(|said| said.0))?;
        Some((single_turn, self.multi_turn_bits.or(said.map(|said| said.1)).unwrap_or(16)))
    }
}

/// Properties of a system that RTEX blocks do not carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rtex {
    /// Bytes of a block, 16 or 32; if unset, the size that most of the first blocks appear to have.
    pub block_size: Option<usize>,
    /// Only the blocks of this drive.
    pub mac_id: Option<u8>,
    /// Update period, ns: gives the log a time axis and sets the limit of the position step.
    pub period_ns: Option<u32>,
    /// Electronic gear of the drives, for the same limit.
    pub gear: Gear,
    /// Show every block whole, instead of only what changed in it.
    pub whole: bool,
}

impl Default for Rtex {
    fn default() -> Self {
        Self { block_size: None, mac_id: None, period_ns: None, gear: Gear::UNITY, whole: false }
    }
}
