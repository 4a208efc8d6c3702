use core::fmt;

use crate::block::{CODE_BIT7, LEN, exact};
use crate::code::{Code, Codes, CyclicCode};
use crate::control::ControlBits;
use crate::error::{Error, wrong_direction};
use crate::header::{Header, MacId, UpdateCounter};
use crate::noncyclic_command::NonCyclicCommand;

/// A command block, borrowed, as a drive reads it from its reception memory.
///
/// ```text
/// byte 0        1                 2   3         4 .. 7          8 .. 15
///      header   TMG_CNT | code    Control_Bits  Command_Data1   by the non-cyclic code: [`NonCyclicCommand`]
/// ```
/// The constructor checks length and direction; after that no getter can fail. Codes are returned as they are, defined or
/// not. System Design Guide for Master, "Data structure"; SX-DSV02310, "Command data block".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandBlock<'a>(&'a [u8; LEN]);

impl<'a> CommandBlock<'a> {
    /// # Errors
    /// [`Error::Truncated`] or [`Error::TooLong`] unless there are exactly 16 bytes, [`Error::Direction`] if C/R is 1.
    pub const fn new(bytes: &'a [u8]) -> Result<Self, Error> {
        match exact(bytes) {
            Ok(block) => Self::of(block),
            Err(e) => Err(e),
        }
    }

    /// Like [`new`](Self::new), for a block of the right size.
    ///
    /// # Errors
    /// [`Error::Direction`] if C/R is 1.
    pub const fn of(block: &'a [u8; LEN]) -> Result<Self, Error> {
        if block[0] & 0x80 == 0 { Ok(Self(block)) } else { Err(wrong_direction(block[0])) }
    }

    /// The bytes.
    pub const fn bytes(self) -> &'a [u8; LEN] {
        self.0
    }

    /// Byte 0 bits 4-0: the drive that is addressed.
    pub const fn mac_id(self) -> MacId {
        Header::parse(self.0[0]).mac_id
    }

    /// Byte 0 bits 6-5.
    pub const fn update_counter(self) -> UpdateCounter {
        Header::parse(self.0[0]).update_counter
    }

    /// Byte 1 bit 7, used in the inter-axis full-synchronous mode only.
    pub const fn tmg_cnt(self) -> bool {
        self.0[1] & CODE_BIT7 != 0
    }

    /// Byte 1 bits 6-0.
    pub const fn code(self) -> Code {
        Code::truncate(self.0[1])
    }

    /// Bytes 2-3 without the reserved bits.
    pub const fn control(self) -> ControlBits {
        ControlBits::from_bytes([self.0[2], self.0[3]])
    }

    /// Bytes 4-7, by the cyclic code.
    pub const fn command_data1(self) -> i32 {
        let [_, _, _, _, a, b, c, d, ..] = *self.0;
        i32::from_le_bytes([a, b, c, d])
    }

    /// Bytes 8-15, by the non-cyclic code.
    pub(crate) const fn noncyclic_bytes(self) -> [u8; 8] {
        let [_, _, _, _, _, _, _, _, tail @ ..] = *self.0;
        tail
    }

    /// Returns whether this block makes its drive switch the servo off.
    ///
    /// That is so if Servo_On is 0 **and** the code is one for which the drive evaluates Servo_On. A NOP does not do that: a
    /// block of zeros leaves the servo as it is. Nor does a block that the drive refuses for its code.
    pub const fn is_servo_off(self) -> bool {
        !self.control().contains(ControlBits::SERVO_ON) && self.obeys_control()
    }

    /// Returns whether a drive certainly evaluates the Control_Bits of this block: its codes may be combined
    /// ([`Code::is_allowed`]) and are not the NOP command.
    pub const fn obeys_control(self) -> bool {
        self.code().is_allowed() && self.code().get() != Code::NOP.get()
    }

    /// Decodes everything at once.
    ///
    /// # Errors
    /// [`Error::CyclicCode`] or [`Error::NonCyclicCode`] for a code that is not defined.
    pub const fn to_owned(self) -> Result<Command, Error> {
        match self.code().codes() {
            Ok(Codes { cyclic, noncyclic }) => Ok(Command {
                mac_id: self.mac_id(),
                update_counter: self.update_counter(),
                tmg_cnt: self.tmg_cnt(),
                cyclic,
                control: self.control(),
                command_data1: self.command_data1(),
                noncyclic: NonCyclicCommand::parse(noncyclic, self.noncyclic_bytes()),
            }),
            Err(e) => Err(e),
        }
    }

    /// Makes the checks of strict decoding that [`to_owned`](Self::to_owned) does not make.
    ///
    /// # Errors
    /// [`Error::CyclicCode`], [`Error::NonCyclicCode`], [`Error::CodePair`] or the first [`Error::Reserved`].
    pub(crate) const fn check_strict(self) -> Result<(), Error> {
        let code = self.code();
        let noncyclic = match code.codes() {
            Ok(Codes { noncyclic, .. }) => noncyclic,
            Err(e) => return Err(e),
        };
        if !code.is_allowed() {
            return Err(Error::CodePair { code: code.get() });
        }
        match ControlBits::reserved([self.0[2], self.0[3]]) {
            [0, 0] => NonCyclicCommand::check_reserved(noncyclic, self.noncyclic_bytes()),
            [0, bits] => Err(Error::Reserved { byte: 3, bits }),
            [bits, _] => Err(Error::Reserved { byte: 2, bits }),
        }
    }
}

/// A command as values. Any value of this type can be emitted; reserved bits are sent as 0.
///
/// ```
/// use rtex_block::*;
/// let command = Command {
///     control: ControlBits::SERVO_ON,
///     command_data1: 1_000,
///     ..Command::idle(MacId::new(5).unwrap(), UpdateCounter::new(2).unwrap())
/// };
/// assert_eq!(command.emit(), [0x45, 0x20, 0x80, 0, 0xe8, 0x03, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Command {
    /// The drive that is addressed.
    pub mac_id: MacId,
    /// Counts update periods.
    pub update_counter: UpdateCounter,
    /// TMG_CNT: `false` outside the inter-axis full-synchronous mode.
    pub tmg_cnt: bool,
    /// Selects the meaning of Command_Data1.
    pub cyclic: CyclicCode,
    /// Servo_On and the other control bits.
    pub control: ControlBits,
    /// Position, speed or torque by [`cyclic`](Self::cyclic).
    pub command_data1: i32,
    /// Bytes 8-15, and with them the non-cyclic code.
    pub noncyclic: NonCyclicCommand,
}

impl Command {
    /// Creates the command that a master sends to a drive that it does not move: 20h with Servo_On = 0 and all data 0.
    pub const fn idle(mac_id: MacId, update_counter: UpdateCounter) -> Self {
        Self {
            mac_id,
            update_counter,
            tmg_cnt: false,
            cyclic: CyclicCode::CyclicPosition,
            control: ControlBits::empty(),
            command_data1: 0,
            noncyclic: NonCyclicCommand::IDLE,
        }
    }

    /// Creates 00h, the invalid data that are sent with counter 0 before the first valid command.
    pub const fn nop(mac_id: MacId) -> Self {
        Self { cyclic: CyclicCode::Nop, ..Self::idle(mac_id, UpdateCounter::ZERO) }
    }

    /// Byte 1 without TMG_CNT.
    pub const fn code(&self) -> Code {
        Code::of(self.cyclic, self.noncyclic.code())
    }

    /// Decodes a slice that is exactly one block, as leniently as a drive does: reserved bits are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::TooLong`], [`Error::Direction`], [`Error::CyclicCode`], [`Error::NonCyclicCode`], in this order.
    pub const fn parse(bytes: &[u8]) -> Result<Self, Error> {
        match CommandBlock::new(bytes) {
            Ok(block) => block.to_owned(),
            Err(e) => Err(e),
        }
    }

    /// Decodes a slice that is exactly one block and refuses anything that an encoder must not write.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), then [`Error::CodePair`] and [`Error::Reserved`].
    pub const fn parse_strict(bytes: &[u8]) -> Result<Self, Error> {
        let block = match CommandBlock::new(bytes) {
            Ok(block) => block,
            Err(e) => return Err(e),
        };
        match block.check_strict() {
            Ok(()) => block.to_owned(),
            Err(e) => Err(e),
        }
    }

    /// The block.
    pub const fn emit(&self) -> [u8; LEN] {
        let header = Header { response: false, update_counter: self.update_counter, mac_id: self.mac_id };
        let [c2, c3] = self.control.to_bytes();
        let [d4, d5, d6, d7] = self.command_data1.to_le_bytes();
        let [d8, d9, d10, d11, d12, d13, d14, d15] = self.noncyclic.emit();
        let one = (self.tmg_cnt as u8) << 7 | self.code().get();
        [header.emit(), one, c2, c3, d4, d5, d6, d7, d8, d9, d10, d11, d12, d13, d14, d15]
    }
}

impl fmt::Display for Command {
    /// `to 5 #2 CP normal (20h) [SERVO_ON] 1000, 0 0`: drive, counter, codes, Control_Bits, Command_Data1, bytes 8-15.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "to {} #{} ", self.mac_id, self.update_counter)?;
        self.code().write(f)?;
        write!(f, " [{}] {}, {}", self.control, self.command_data1, self.noncyclic)
    }
}
