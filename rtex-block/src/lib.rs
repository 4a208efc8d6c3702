#![doc = include_str!("../README.md")]
#![no_std]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![cfg_attr(test, allow(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

#[cfg(any(test, feature = "std"))]
extern crate std;

mod answer;
mod bits;
mod code;
mod command;
mod control;
pub mod device;
mod error;
mod error_code;
mod header;
pub mod inspect;
pub mod master;
mod narrow;
pub mod pack;
pub mod position;
mod request;
mod response;
mod status;
pub mod stream;
mod sub;
pub mod timing;
pub mod type_code;

pub use answer::{Answer, Execution, Reply};
pub use code::{Code, CyclicCode, NonCyclicCode};
pub use command::{Command, CommandBlock};
pub use control::ControlBits;
pub use error::{Error, ErrorClass};
pub use error_code::{Alarm, ErrorCode};
pub use header::{Header, MacId, UpdateCounter};
pub use narrow::OutOfRange;
pub use request::{Arguments, Request};
pub use response::{Response, ResponseBlock};
pub use status::StatusFlags;
pub use sub::{Command32, Response32, SubCode, SubCommand, SubResponse, split32};
pub use type_code::{Nibble, Pr, TypeCode};

/// Bytes of a block.
pub const LEN: usize = 16;
/// Bytes of a block in the 32-byte mode.
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

/// TMG_CNT in a command, CMD_Error in a response.
const CODE_BIT7: u8 = 0x80;

/// A slice of 16 bytes as a block.
const fn exact(bytes: &[u8]) -> Result<&[u8; LEN], Error> {
    match bytes.split_first_chunk::<LEN>() {
        Some((block, [])) => Ok(block),
        _ => Err(Error::Length { got: bytes.len(), want: 16 }),
    }
}
