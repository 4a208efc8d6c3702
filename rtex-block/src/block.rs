//! The two sizes of a block.

use crate::error::{Error, wrong_length};

/// Number of bytes in a block.
pub const LEN: usize = 16;
/// Number of bytes in a block in the 32-byte mode.
pub const LEN32: usize = 32;

/// Which of the two sizes a drive is set to (by a parameter; Pr7.22 is suspected).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum BlockSize {
    /// 16 bytes: the main block.
    Bytes16,
    /// 32 bytes: main and sub block.
    Bytes32,
}

impl BlockSize {
    /// The number of bytes.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Bytes16 => LEN,
            Self::Bytes32 => LEN32,
        }
    }
}

/// TMG_CNT in a command, CMD_Error in a response.
pub(crate) const CODE_BIT7: u8 = 0x80;

/// Takes a slice of exactly 16 bytes as a block.
pub(crate) const fn exact(bytes: &[u8]) -> Result<&[u8; LEN], Error> {
    match bytes.split_first_chunk::<LEN>() {
        Some((block, [])) => Ok(block),
        _ => Err(wrong_length(bytes.len(), 16)),
    }
}

/// Splits eight bytes into two four-byte halves.
pub(crate) const fn join([b8, b9, b10, b11]: [u8; 4], data: i32) -> [u8; 8] {
    let [b12, b13, b14, b15] = data.to_le_bytes();
    [b8, b9, b10, b11, b12, b13, b14, b15]
}
