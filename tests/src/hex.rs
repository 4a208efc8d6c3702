//! Numbers and byte strings as the rows spell them.

use serde::{Deserialize, Deserializer, de::Error};

/// Bytes written as lower-case hex digits, two a byte.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bytes(pub(crate) Vec<u8>);

impl<'de> Deserialize<'de> for Bytes {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        if text.len() % 2 != 0 || !text.is_ascii() {
            return Err(D::Error::custom(format!("{text:?} is not a byte string in hex")));
        }
        let byte = |k| u8::from_str_radix(text.get(k..k + 2).unwrap_or(""), 16);
        let bytes: Result<_, _> = (0..text.len()).step_by(2).map(byte).collect();
        bytes.map(Self).map_err(|e| D::Error::custom(format!("{text:?}: {e}")))
    }
}

/// One number written as hex digits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Hex(pub(crate) u64);

impl<'de> Deserialize<'de> for Hex {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        u64::from_str_radix(&text, 16).map(Self).map_err(|e| D::Error::custom(format!("{text:?}: {e}")))
    }
}

/// Line bits in time order, written as `0` and `1`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Bits(pub(crate) Vec<bool>);

impl<'de> Deserialize<'de> for Bits {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let text = String::deserialize(from)?;
        let bit = |c| match c {
            '0' => Ok(false),
            '1' => Ok(true),
            other => Err(D::Error::custom(format!("{other:?} is not a line bit"))),
        };
        text.chars().map(bit).collect::<Result<_, _>>().map(Self)
    }
}
