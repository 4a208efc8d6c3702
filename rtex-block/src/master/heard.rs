use crate::block::{BlockSize, LEN32};
use crate::error::{Error, wrong_length};
use crate::pack::{self, Word};
use crate::response::Response;
use crate::sub::{Response32, SubResponse};

/// What one drive sent in an update period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Heard {
    /// No block.
    Nothing,
    /// A block that was refused.
    Refused(Error),
    /// A block of the 16-byte mode.
    Main(Response),
    /// A block of the 32-byte mode.
    Both(Response32),
}

impl Heard {
    /// Decodes a block as it is in the memory of the ASIC.
    pub fn parse<W: Word>(size: BlockSize, words: &[W]) -> Self {
        let mut memory = [0; LEN32];
        let len = words.len().saturating_mul(W::BYTES);
        let bytes = memory.get_mut(..len).unwrap_or_default();
        match (pack::from_words(words, bytes), size) {
            (Err(_), BlockSize::Bytes16) => Self::Refused(wrong_length(len, 16)),
            (Err(_), BlockSize::Bytes32) => Self::Refused(wrong_length(len, 32)),
            (Ok(()), BlockSize::Bytes16) => Response::parse(bytes).into(),
            (Ok(()), BlockSize::Bytes32) => Response32::parse(bytes).into(),
        }
    }

    /// The main half of a good block.
    pub const fn response(&self) -> Option<&Response> {
        match self {
            Self::Main(main) | Self::Both(Response32 { main, .. }) => Some(main),
            Self::Nothing | Self::Refused(_) => None,
        }
    }

    /// The sub half of a good block of the 32-byte mode.
    pub const fn sub(&self) -> Option<&SubResponse> {
        match self {
            Self::Both(Response32 { sub, .. }) => Some(sub),
            _ => None,
        }
    }
}

servowire_core::one_line!(Heard {
    Self::Nothing => "nothing";
    Self::Refused(error) => "refused: {}", error;
    Self::Main(response) => "{}", response;
    Self::Both(Response32 { main, sub }) => "{}; {}", main, sub;
});

impl From<Result<Response, Error>> for Heard {
    fn from(parsed: Result<Response, Error>) -> Self {
        parsed.map_or_else(Self::Refused, Self::Main)
    }
}

impl From<Result<Response32, Error>> for Heard {
    fn from(parsed: Result<Response32, Error>) -> Self {
        parsed.map_or_else(Self::Refused, Self::Both)
    }
}
