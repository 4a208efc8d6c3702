//! The parameters channel: one byte per H-frame in each direction.

use crate::error::Error;

servowire_core::number! {
    /// Half a byte, 0..=15: one symbol of a message.
    pub struct Nibble(u8, 4);
}

/// Declares what one end can send in bits 4:0 of its parameter byte: four bits of a message, or a named code.
macro_rules! symbols {
    ($(#[$meta:meta])* pub enum $name:ident { $($(#[$doc:meta])* $symbol:ident = $code:literal => $text:literal,)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        pub enum $name {
            /// 00h..0Fh: four bits of a message.
            Data(Nibble),
            $($(#[$doc])* $symbol,)*
        }

        impl $name {
            /// The five bits.
            pub const fn code(self) -> u8 {
                match self {
                    Self::Data(nibble) => nibble.get(),
                    $(Self::$symbol => $code,)*
                }
            }

            /// Decodes the five bits; `None` for a code without a meaning, and for more than five bits.
            pub const fn from_code(code: u8) -> Option<Self> {
                Some(match code {
                    nibble @ 0..=15 => Self::Data(Nibble::truncate(nibble)),
                    $($code => Self::$symbol,)*
                    _ => return None,
                })
            }
        }

        servowire_core::one_line!($name {
            Self::Data(nibble) => "{:X}", nibble.get();
            $(Self::$symbol => $text;)*
        });
    };
}

symbols! {
    /// What the master sends in bits 4:0 of its parameter byte.
    pub enum MasterSymbol {
        /// 10h: nothing to send.
        Idle = 0x10 => "IDLE",
        /// 19h: synchronise; no answer.
        Sync = 0x19 => "SYNC",
        /// 1Ah: answer with the test pattern; the delay is being searched for.
        Start = 0x1a => "START",
        /// 1Bh: answer with the test pattern at the learned delay.
        Learn = 0x1b => "LEARN",
        /// 1Ch: line check; answer with the test pattern.
        Check = 0x1c => "CHECK",
        /// 1Dh: answer with the encoder identifier.
        IdReq = 0x1d => "IDREQ",
        /// 1Eh: drop all messages; during start-up, also wait for VSYNC.
        Init = 0x1e => "INIT",
        /// 1Fh: reset the link; no answer.
        Reset = 0x1f => "RESET",
    }
}

impl MasterSymbol {
    /// Returns whether it is the symbol of a start-up frame, which is answered with the test pattern or the identifier.
    pub const fn is_start_up(self) -> bool {
        matches!(self, Self::Start | Self::Learn | Self::Check | Self::IdReq)
    }

    /// Returns whether an encoder answers a frame with this symbol.
    pub const fn is_answered(self) -> bool {
        !matches!(self, Self::Reset | Self::Sync)
    }
}

/// The parameter byte of the master.
///
/// ```text
///  bit    7       6       5       4 3 2 1 0
///       FIRST | MSYNC | reserved | symbol
///         |       |        0
///         |       inverted from V-frame to V-frame, 1 in the first one
///         0 during the start-up up to IDREQ, then 1
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct ParameterByte(u8);

impl ParameterByte {
    const FIRST: u8 = 0x80;
    const MSYNC: u8 = 0x40;

    /// Creates a parameter byte from any byte.
    pub const fn new(raw: u8) -> Self {
        Self(raw)
    }

    /// Creates the byte for a symbol, with its other bits 0.
    pub const fn of(symbol: MasterSymbol) -> Self {
        Self(symbol.code())
    }

    /// With FIRST.
    #[must_use]
    pub(crate) const fn with_first(self) -> Self {
        Self(self.0 | Self::FIRST)
    }

    /// With MSYNC.
    #[must_use]
    pub(crate) const fn with_msync(self) -> Self {
        Self(self.0 | Self::MSYNC)
    }

    /// The byte.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// FIRST: 0 from RESET to IDREQ, 1 in all frames after that.
    pub const fn first(self) -> bool {
        self.0 & Self::FIRST != 0
    }

    /// MSYNC: constant during the eight frames of a V-frame.
    pub const fn msync(self) -> bool {
        self.0 & Self::MSYNC != 0
    }

    /// The symbol.
    ///
    /// # Errors
    /// [`Error::UndefinedSymbol`].
    pub const fn symbol(self) -> Result<MasterSymbol, Error> {
        match MasterSymbol::from_code(self.0 & 31) {
            Some(symbol) => Ok(symbol),
            None => Err(Error::UndefinedSymbol { symbol: self.0 & 31 }),
        }
    }
}

symbols! {
    /// What the encoder sends in bits 4:0 of its parameter byte.
    pub enum EncoderSymbol {
        /// 10h: nothing to send.
        Idle = 0x10 => "IDLE",
        /// 15h: the short message was not understood.
        Snak = 0x15 => "SNAK",
        /// 1Ah: the long message was not understood.
        Lnak = 0x1a => "LNAK",
        /// 1Fh: the message state was reset.
        Init = 0x1f => "INIT",
    }
}

/// The parameter byte of the encoder.
///
/// ```text
///  bit    7      6 5    4 3 2 1 0
///       VSYNC |  0 0  |  symbol
/// ```
///
/// VSYNC is 1 in the last of the eight answers of a V-frame. Bits 6:5 are not documented; this crate sends 0 and
/// ignores them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct EncoderByte(u8);

impl EncoderByte {
    const VSYNC: u8 = 0x80;

    /// Creates a parameter byte from any byte.
    pub const fn new(raw: u8) -> Self {
        Self(raw)
    }

    /// Creates the byte for a symbol, with its other bits 0.
    pub const fn of(symbol: EncoderSymbol) -> Self {
        Self(symbol.code())
    }

    /// With VSYNC.
    #[must_use]
    pub const fn with_vsync(self) -> Self {
        Self(self.0 | Self::VSYNC)
    }

    /// The byte.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// VSYNC.
    pub const fn vsync(self) -> bool {
        self.0 & Self::VSYNC != 0
    }

    /// The symbol.
    ///
    /// # Errors
    /// [`Error::UndefinedSymbol`].
    pub const fn symbol(self) -> Result<EncoderSymbol, Error> {
        match EncoderSymbol::from_code(self.0 & 31) {
            Some(symbol) => Ok(symbol),
            None => Err(Error::UndefinedSymbol { symbol: self.0 & 31 }),
        }
    }
}

/// Names a bit that is set.
const fn flag(set: bool, name: &'static str) -> &'static str {
    if set { name } else { "" }
}

// The symbol, or the five bits of one without a meaning.
servowire_core::one_line!(ParameterByte {
    byte if byte.symbol().is_err() =>
        "{:02X}h{}{}", byte.0 & 31, flag(byte.first(), " FIRST"), flag(byte.msync(), " MSYNC");
    byte =>
        "{}{}{}", byte.symbol().unwrap_or(MasterSymbol::Idle), flag(byte.first(), " FIRST"), flag(byte.msync(), " MSYNC");
});

servowire_core::one_line!(EncoderByte {
    byte if byte.symbol().is_err() => "{:02X}h{}", byte.0 & 31, flag(byte.vsync(), " VSYNC");
    byte => "{}{}", byte.symbol().unwrap_or(EncoderSymbol::Idle), flag(byte.vsync(), " VSYNC");
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_a_log_shows_them() {
        use std::string::ToString;
        assert_eq!(ParameterByte::new(0xd0).to_string(), "IDLE FIRST MSYNC");
        assert_eq!(ParameterByte::new(0x1f).to_string(), "RESET");
        assert_eq!(
            (ParameterByte::new(0x8a).to_string(), ParameterByte::new(0x12).to_string()),
            ("A FIRST".into(), "12h".into())
        );
        assert_eq!(
            (EncoderByte::new(0x95).to_string(), EncoderByte::new(0x1a).to_string()),
            ("SNAK VSYNC".into(), "LNAK".into())
        );
    }

    /// What is no symbol is told by its five bits.
    #[test]
    fn undefined_symbols() {
        assert_eq!(ParameterByte::new(0xf2).symbol(), Err(Error::UndefinedSymbol { symbol: 0x12 }));
        assert_eq!(EncoderByte::new(0xf2).symbol(), Err(Error::UndefinedSymbol { symbol: 0x12 }));
    }

    /// A bit that is set stays so.
    #[test]
    fn bits_that_are_set_twice() {
        assert_eq!(ParameterByte::new(0x90).with_first().with_msync().with_msync().raw(), 0xd0);
        assert_eq!(EncoderByte::new(0x10).with_vsync().with_vsync().raw(), 0x90);
    }

    /// RESET and SYNC are not answered; from START to IDREQ an encoder answers with the pattern or its identifier.
    #[test]
    fn what_is_answered_with_what() {
        for symbol in (0..32).filter_map(MasterSymbol::from_code) {
            let start_up = [MasterSymbol::Start, MasterSymbol::Learn, MasterSymbol::Check, MasterSymbol::IdReq];
            assert_eq!(symbol.is_start_up(), start_up.contains(&symbol), "{symbol:?}");
            let silent = [MasterSymbol::Reset, MasterSymbol::Sync].contains(&symbol);
            assert_eq!(symbol.is_answered(), !silent, "{symbol:?}");
        }
    }

    #[test]
    fn every_byte_of_both_directions() {
        let (mut master, mut encoder) = (0, 0);
        for raw in 0..=255 {
            let byte = ParameterByte::new(raw);
            assert_eq!((byte.first(), byte.msync()), (raw >= 128, raw & 64 != 0));
            if let Ok(symbol) = byte.symbol() {
                let mut made = ParameterByte::of(symbol);
                made = if raw & 0x80 != 0 { made.with_first() } else { made };
                made = if raw & 0x40 != 0 { made.with_msync() } else { made };
                assert_eq!(made.raw(), raw & 0xdf);
                master += 1;
            }
            let byte = EncoderByte::new(raw);
            if let Ok(symbol) = byte.symbol() {
                let made = EncoderByte::of(symbol);
                let made = if raw & 0x80 != 0 { made.with_vsync() } else { made };
                assert_eq!(made.raw(), raw & 0x9f);
                encoder += 1;
            }
        }
        assert_eq!((master / 8, encoder / 8), (24, 20));
    }
}
