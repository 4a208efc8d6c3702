use core::fmt;

use crate::block::{CODE_BIT7, LEN, exact};
use crate::code::Code;
use crate::error::{Error, wrong_direction};
use crate::header::{Header, MacId, UpdateCounter};
use crate::noncyclic_response::NonCyclicResponse;
use crate::status::StatusFlags;

/// A response block, borrowed: every getter is a load and a mask.
///
/// ```text
/// byte 0        1                   2   3         4 .. 7           8 .. 15
///      header   CMD_Error | code    Status_Flags  Response_Data1   by CMD_Error, then the code: [`NonCyclicResponse`]
/// ```
/// The constructor checks length and direction; after that no getter can fail. System Design Guide for Master,
/// "Data structure"; SX-DSV02310, "Response data block".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ResponseBlock<'a>(&'a [u8; LEN]);

impl<'a> ResponseBlock<'a> {
    /// # Errors
    /// [`Error::Truncated`] or [`Error::TooLong`] unless there are exactly 16 bytes, [`Error::Direction`] if C/R is 0.
    pub const fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        match exact(bytes) {
            Ok(block) => Self::of(block),
            Err(e) => Err(e),
        }
    }

    /// Like [`new`](Self::new), for a block of the right size.
    ///
    /// # Errors
    /// [`Error::Direction`] if C/R is 0.
    pub const fn of(block: &'a [u8; LEN]) -> Result<Self, Error> {
        if block[0] & 0x80 != 0 { Ok(Self(block)) } else { Err(wrong_direction(block[0])) }
    }

    /// The bytes.
    pub const fn bytes(self) -> &'a [u8; LEN] {
        self.0
    }

    /// Actual_MAC-ID: not an echo, but the address that the drive read from its switches at power-up.
    pub const fn mac_id(self) -> MacId {
        Header::parse(self.0[0]).mac_id
    }

    /// Update_Counter_Echo; it comes back with the next reception, one command earlier than the echo of the code.
    pub const fn update_counter_echo(self) -> UpdateCounter {
        Header::parse(self.0[0]).update_counter
    }

    /// CMD_Error: the command was not accepted.
    pub const fn cmd_error(self) -> bool {
        self.0[1] & CODE_BIT7 != 0
    }

    /// Echo of the code, defined or not.
    pub const fn code(self) -> Code {
        Code::truncate(self.0[1])
    }

    /// Status_Flags.
    pub const fn status(self) -> StatusFlags {
        StatusFlags::from_bytes([self.0[2], self.0[3]])
    }

    /// Bytes 4-7: actual position in command units, or the value chosen by Pr7.29; valid with every command.
    pub const fn response_data1(self) -> i32 {
        let [_, _, _, _, a, b, c, d, ..] = *self.0;
        i32::from_le_bytes([a, b, c, d])
    }

    /// Bytes 8-15.
    pub(crate) const fn noncyclic_bytes(self) -> [u8; 8] {
        let [_, _, _, _, _, _, _, _, tail @ ..] = *self.0;
        tail
    }

    /// Bytes 8-15, decoded.
    pub const fn noncyclic(self) -> NonCyclicResponse {
        NonCyclicResponse::parse(self.cmd_error(), self.code().noncyclic_bits(), self.noncyclic_bytes())
    }

    /// Decodes everything at once.
    pub const fn to_owned(self) -> Response {
        let [_, _, _, _, d4, d5, d6, d7, d8, d9, d10, d11, d12, d13, d14, d15] = *self.0;
        Response {
            mac_id: self.mac_id(),
            update_counter_echo: self.update_counter_echo(),
            cmd_error: self.cmd_error(),
            code: self.code(),
            status: self.status(),
            response_data1: i32::from_le_bytes([d4, d5, d6, d7]),
            response_data2: i32::from_le_bytes([d8, d9, d10, d11]),
            response_data3: i32::from_le_bytes([d12, d13, d14, d15]),
        }
    }

    /// Refuses an undefined code without CMD_Error, and reserved bits of bytes 8-15 that are 1.
    ///
    /// # Errors
    /// [`Error::CyclicCode`], [`Error::NonCyclicCode`] or the first [`Error::Reserved`].
    pub(crate) fn check_strict(self) -> Result<(), Error> {
        if !self.cmd_error() {
            self.code().codes()?;
        }
        NonCyclicResponse::check_reserved(self.cmd_error(), self.code().noncyclic_bits(), self.noncyclic_bytes())
    }
}

/// A response as values, which correspond one to one to the 128 bits: `emit` after `parse` returns the same bytes.
///
/// Bytes 8-15 stay two words, as with the normal command; [`noncyclic`](Self::noncyclic) reads them according to CMD_Error and
/// code.
///
/// ```
/// use rtex_block::*;
/// let block = [0xc5, 0x20, 0xc1, 0, 0xe8, 0x03, 0, 0, 0, 0, 0, 0, 0x9c, 0xff, 0xff, 0xff];
/// let response = Response::parse(&block)?;
/// assert_eq!((response.mac_id.get(), response.update_counter_echo.get()), (5, 2));
/// assert!(response.status.contains(StatusFlags::SERVO_ACTIVE | StatusFlags::SERVO_READY | StatusFlags::IN_POSITION));
/// assert_eq!((response.response_data1, response.response_data3), (1_000, -100));
/// # Ok::<(), Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Response {
    /// Actual_MAC-ID.
    pub mac_id: MacId,
    /// Update_Counter_Echo.
    pub update_counter_echo: UpdateCounter,
    /// CMD_Error.
    pub cmd_error: bool,
    /// Echo of the code.
    pub code: Code,
    /// Status_Flags.
    pub status: StatusFlags,
    /// Actual position, command units, or the value chosen by Pr7.29.
    pub response_data1: i32,
    /// With the normal command: actual speed, or the value chosen by Pr7.30. Otherwise see [`noncyclic`](Self::noncyclic).
    pub response_data2: i32,
    /// With the normal command: torque in 0.1 % of rated, or the value chosen by Pr7.31. Otherwise see
    /// [`noncyclic`](Self::noncyclic).
    pub response_data3: i32,
}

impl Response {
    /// Bytes 8-15, decoded.
    pub const fn noncyclic(&self) -> NonCyclicResponse {
        NonCyclicResponse::parse(self.cmd_error, self.code.noncyclic_bits(), self.noncyclic_bytes())
    }

    /// Replaces bytes 8-15, for a simulated drive. CMD_Error is set by [`NonCyclicResponse::CommandError`] and cleared by
    /// every other value, whose layout must be that of [`code`](Self::code).
    ///
    /// ```
    /// use rtex_block::{ErrorCode, NonCyclicResponse, Response};
    /// // Drive 5 refuses a monitor command in CP (2Ah): type code not known.
    /// let received = [0xc5, 0x2a, 0x40, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    /// let refused = Response::parse(&received)?.with_noncyclic(&NonCyclicResponse::CommandError(ErrorCode::TYPE_CODE));
    /// assert_eq!(refused.emit(), [0xc5, 0xaa, 0x40, 0, 0, 0, 0, 0, 0x31, 0, 0, 0, 0, 0, 0, 0]);
    /// # Ok::<(), rtex_block::Error>(())
    /// ```
    #[must_use]
    pub const fn with_noncyclic(self, noncyclic: &NonCyclicResponse) -> Self {
        let [d8, d9, d10, d11, d12, d13, d14, d15] = noncyclic.emit();
        Self {
            cmd_error: matches!(noncyclic, NonCyclicResponse::CommandError(_)),
            response_data2: i32::from_le_bytes([d8, d9, d10, d11]),
            response_data3: i32::from_le_bytes([d12, d13, d14, d15]),
            ..self
        }
    }

    const fn noncyclic_bytes(&self) -> [u8; 8] {
        let [d8, d9, d10, d11] = self.response_data2.to_le_bytes();
        let [d12, d13, d14, d15] = self.response_data3.to_le_bytes();
        [d8, d9, d10, d11, d12, d13, d14, d15]
    }

    /// Decodes a slice that is exactly one block.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::Direction`], in this order.
    pub const fn parse(bytes: &[u8]) -> Result<Self, Error> {
        match ResponseBlock::new(bytes) {
            Ok(block) => Ok(block.to_owned()),
            Err(e) => Err(e),
        }
    }

    /// Decodes a slice that is exactly one block and refuses anything that no drive should send.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), then [`Error::CyclicCode`] or [`Error::NonCyclicCode`] (without CMD_Error) and
    /// [`Error::Reserved`].
    pub fn parse_strict(bytes: &[u8]) -> Result<Self, Error> {
        let block = ResponseBlock::new(bytes)?;
        block.check_strict()?;
        Ok(block.to_owned())
    }

    /// The block.
    pub const fn emit(&self) -> [u8; LEN] {
        let header = Header { response: true, update_counter: self.update_counter_echo, mac_id: self.mac_id };
        let [s2, s3] = self.status.to_bytes();
        let [d4, d5, d6, d7] = self.response_data1.to_le_bytes();
        let [d8, d9, d10, d11, d12, d13, d14, d15] = self.noncyclic_bytes();
        let one = (self.cmd_error as u8) << 7 | self.code.get();
        [header.emit(), one, s2, s3, d4, d5, d6, d7, d8, d9, d10, d11, d12, d13, d14, d15]
    }
}

impl fmt::Display for Response {
    /// `from 5 #2 CP normal (20h) [SERVO_ACTIVE] 998, 10000 -100`: drive, counter, codes, Status_Flags, Response_Data1,
    /// bytes 8-15.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "from {} #{} ", self.mac_id, self.update_counter_echo)?;
        self.code.write(f)?;
        write!(f, " [{}] {}, {}", self.status, self.response_data1, self.noncyclic())
    }
}
