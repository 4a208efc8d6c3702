//! Bytes 16-31 of the 32-byte mode.

use core::fmt;

use crate::block::{LEN, LEN32};
use crate::command::{Command, CommandBlock};
use crate::error::{Error, wrong_length};
use crate::error_code::ErrorCode;
use crate::execution::Execution;
use crate::response::{Response, ResponseBlock};
use crate::type_code::Nibble;

servowire_core::codes! {
    /// Sub_Command_Code, bits 3-0 of byte 16. The names are the vendor's, in lower case.
    pub enum SubCode: u8 {
        /// 0h: normal.
        Normal = 0 => "normal",
        /// 2h: system ID.
        SystemId = 2 => "system ID",
        /// Ah: monitor.
        Monitor = 10 => "monitor",
    }
}

/// The sub block of a command, bytes 16-31.
///
/// ```text
/// byte 16               17              18 19      20 .. 23            24 .. 27            28 .. 31
///  Sub_Chk = 1 | code   Sub_Type_Code   Sub_Index  Sub_Command_Data1   Sub_Command_Data2   Sub_Command_Data3
/// ```
/// SX-DSV02310, "Command data block, 32-byte mode". There is no view of it: all fields are at fixed places, so decoding
/// costs only the loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SubCommand {
    /// The request.
    pub code: SubCode,
    /// Sub_Type_Code: new codes only.
    pub type_code: u8,
    /// Sub_Index.
    pub index: u16,
    /// Sub_Command_Data1.
    pub data1: i32,
    /// Sub_Command_Data2: feed-forward, valid even when the sub-command is refused.
    pub data2: i32,
    /// Sub_Command_Data3: feed-forward, valid even when the sub-command is refused.
    pub data3: i32,
}

impl SubCommand {
    /// No request.
    pub const IDLE: Self = Self { code: SubCode::Normal, type_code: 0, index: 0, data1: 0, data2: 0, data3: 0 };

    /// Reads bytes 16-31.
    ///
    /// # Errors
    /// [`Error::SubChk`], [`Error::SubCommandCode`], in this order.
    pub const fn parse(bytes: &[u8; LEN]) -> Result<Self, Error> {
        let byte16 = bytes[0];
        if byte16 & 0x80 == 0 {
            return Err(Error::SubChk { byte16 });
        }
        let Some(code) = SubCode::from_code(byte16 & 15) else {
            return Err(Error::SubCommandCode { code: byte16 & 15 });
        };
        let [data1, data2, data3] = words(bytes);
        let index = u16::from_le_bytes([bytes[2], bytes[3]]);
        Ok(Self { code, type_code: bytes[1], index, data1, data2, data3 })
    }

    /// Bytes 16-31, with Sub_Chk and without reserved bits.
    pub const fn emit(&self) -> [u8; LEN] {
        bytes(0x80 | self.code as u8, self.type_code, self.index, [self.data1, self.data2, self.data3])
    }
}

/// The sub block of a response, bytes 16-31.
///
/// ```text
/// byte 16                          17           18 19           20 .. 31
///  7 Sub_CMD_Err 6 Sub_ERR         Type echo    Index echo, or  Sub_Response_Data1, 2, 3
///  5 Sub_WNG 4 Sub_Busy 3-0 code                Sub_Error_Code
/// ```
/// SX-DSV02310, "Response data block, 32-byte mode". With Sub_CMD_Err the type echo and Sub_Response_Data1 are
/// 0 and bytes 18-19 are Sub_Error_Code.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct SubResponse {
    /// Sub_CMD_Err: the sub-command was not accepted.
    pub cmd_error: bool,
    /// Sub_ERR, Sub_WNG, Sub_Busy.
    pub execution: Execution,
    /// Echo of the code, defined or not.
    pub code: Nibble,
    /// Echo of Sub_Type_Code; 0 with Sub_CMD_Err.
    pub type_code: u8,
    /// Echo of Sub_Index; with Sub_CMD_Err see [`error_code`](Self::error_code).
    pub index: u16,
    /// Sub_Response_Data1; 0 with Sub_CMD_Err.
    pub data1: i32,
    /// Sub_Response_Data2: value chosen by Pr7.33.
    pub data2: i32,
    /// Sub_Response_Data3: value chosen by Pr7.34.
    pub data3: i32,
}

impl SubResponse {
    /// Reads bytes 16-31; every value is a sub block.
    pub const fn parse(bytes: &[u8; LEN]) -> Self {
        let [data1, data2, data3] = words(bytes);
        let flags = bytes[0];
        Self {
            cmd_error: flags & 0x80 != 0,
            execution: Execution::from_sub(flags),
            code: Nibble::truncate(flags),
            type_code: bytes[1],
            index: u16::from_le_bytes([bytes[2], bytes[3]]),
            data1,
            data2,
            data3,
        }
    }

    /// Bytes 16-31.
    pub const fn emit(&self) -> [u8; LEN] {
        let flags = (self.cmd_error as u8) << 7 | self.execution.to_sub();
        bytes(flags | self.code.get(), self.type_code, self.index, [self.data1, self.data2, self.data3])
    }

    /// Returns the Sub_Error_Code, if there is one.
    pub const fn error_code(&self) -> Option<ErrorCode> {
        if self.cmd_error { Some(ErrorCode(self.index)) } else { None }
    }
}

const fn words(bytes: &[u8; LEN]) -> [i32; 3] {
    let [_, _, _, _, b20, b21, b22, b23, b24, b25, b26, b27, b28, b29, b30, b31] = *bytes;
    [
        i32::from_le_bytes([b20, b21, b22, b23]),
        i32::from_le_bytes([b24, b25, b26, b27]),
        i32::from_le_bytes([b28, b29, b30, b31]),
    ]
}

const fn bytes(b16: u8, type_code: u8, index: u16, data: [i32; 3]) -> [u8; LEN] {
    let [b18, b19] = index.to_le_bytes();
    let [b20, b21, b22, b23] = data[0].to_le_bytes();
    let [b24, b25, b26, b27] = data[1].to_le_bytes();
    let [b28, b29, b30, b31] = data[2].to_le_bytes();
    [b16, type_code, b18, b19, b20, b21, b22, b23, b24, b25, b26, b27, b28, b29, b30, b31]
}

/// Main and sub block of one 32-byte block.
///
/// # Errors
/// [`Error::Truncated`] or [`Error::TooLong`] unless there are exactly 32 bytes.
pub(crate) const fn split32(bytes: &[u8]) -> Result<(&[u8; LEN], &[u8; LEN]), Error> {
    if let Some((main, sub)) = bytes.split_first_chunk::<LEN>() {
        if let Some((sub, [])) = sub.split_first_chunk::<LEN>() {
            return Ok((main, sub));
        }
    }
    Err(wrong_length(bytes.len(), 32))
}

fn join32(main: &[u8; LEN], sub: &[u8; LEN]) -> [u8; LEN32] {
    let mut block = [0; LEN32];
    if let Some((first, rest)) = block.split_first_chunk_mut() {
        *first = *main;
        if let Some(second) = rest.first_chunk_mut() {
            *second = *sub;
        }
    }
    block
}

/// A command of the 32-byte mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Command32 {
    /// Bytes 0-15.
    pub main: Command,
    /// Bytes 16-31.
    pub sub: SubCommand,
}

impl Command32 {
    /// Decodes a slice that is exactly one block; reserved bits are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], then those of [`Command::parse`], [`Error::SubChk`], [`Error::SubCommandCode`].
    pub const fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let (main, sub) = match split32(bytes) {
            Ok(halves) => halves,
            Err(e) => return Err(e),
        };
        match (Command::parse(main), SubCommand::parse(sub)) {
            (Ok(main), Ok(sub)) => Ok(Self { main, sub }),
            (Err(e), _) | (_, Err(e)) => Err(e),
        }
    }

    /// Decodes a slice that is exactly one block and refuses anything that an encoder must not write.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), then [`Error::CodePair`] and [`Error::Reserved`].
    pub fn parse_strict(bytes: &[u8]) -> Result<Self, Error> {
        let command = Self::parse(bytes)?;
        let (main, sub) = split32(bytes)?;
        CommandBlock::of(main)?.check_strict()?;
        match sub[0] & 0x70 {
            0 => Ok(command),
            bits => Err(Error::Reserved { byte: 16, bits }),
        }
    }

    /// The block.
    pub fn emit(&self) -> [u8; LEN32] {
        join32(&self.main.emit(), &self.sub.emit())
    }
}

/// A response of the 32-byte mode, whose values correspond one to one to the 256 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Response32 {
    /// Bytes 0-15.
    pub main: Response,
    /// Bytes 16-31.
    pub sub: SubResponse,
}

impl Response32 {
    /// Decodes a slice that is exactly one block.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::Direction`], in this order.
    pub const fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let (main, sub) = match split32(bytes) {
            Ok(halves) => halves,
            Err(e) => return Err(e),
        };
        match ResponseBlock::of(main) {
            Ok(main) => Ok(Self { main: main.to_owned(), sub: SubResponse::parse(sub) }),
            Err(e) => Err(e),
        }
    }

    /// Decodes a slice that is exactly one block and refuses anything that no drive should send.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), then those of [`Response::parse_strict`], then [`Error::Reserved`] for bytes that must be
    /// 0 with Sub_CMD_Err and [`Error::SubCommandCode`] for an undefined code without Sub_CMD_Err.
    pub fn parse_strict(bytes: &[u8]) -> Result<Self, Error> {
        let response = Self::parse(bytes)?;
        let (main, sub) = split32(bytes)?;
        ResponseBlock::of(main)?.check_strict()?;
        if !response.sub.cmd_error {
            let code = response.sub.code.get();
            return if SubCode::from_code(code).is_some() { Ok(response) } else { Err(Error::SubCommandCode { code }) };
        }
        let zero = (16..).zip(sub).filter(|(byte, _)| matches!(byte, 17 | 20..=23));
        for (byte, &bits) in zero {
            if bits != 0 {
                return Err(Error::Reserved { byte, bits });
            }
        }
        Ok(response)
    }

    /// The block.
    pub fn emit(&self) -> [u8; LEN32] {
        join32(&self.main.emit(), &self.sub.emit())
    }
}

impl fmt::Display for SubCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "sub {} type {:02X}h index {}, ", self.code, self.type_code, self.index)?;
        write!(f, "{} {} {}", self.data1, self.data2, self.data3)
    }
}

impl fmt::Display for SubResponse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("sub ")?;
        f.write_str(SubCode::from_code(self.code.get()).map_or("undefined", SubCode::name))?;
        match self.error_code() {
            Some(code) => write!(f, " not accepted: {code}")?,
            None => write!(f, " type {:02X}h index {}", self.type_code, self.index)?,
        }
        write!(f, ", {} {} {}", self.data1, self.data2, self.data3)?;
        if self.execution.is_empty() { Ok(()) } else { write!(f, " {}", self.execution) }
    }
}

impl fmt::Display for Command32 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.main, self.sub)
    }
}

impl fmt::Display for Response32 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.main, self.sub)
    }
}
