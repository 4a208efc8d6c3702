use core::fmt;

use crate::block::join;
use crate::code::NonCyclicCode;
use crate::error::Error;
use crate::type_code::{Nibble, TypeCode, homing, parameter};

/// Bytes 8-15 of a command with the layout that five non-cyclic commands share.
///
/// ```text
/// byte  8            9                    10        11       12 .. 15
///       Type_Code    7-4: 0               Index L   Index H  data, L first
///       bits 7-0     3-0: bits 11-8
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Arguments {
    /// The object of the command.
    pub type_code: TypeCode,
    /// The index within the object.
    pub index: u16,
    /// Setting_Data of a parameter command, otherwise Command_Data3 (feed-forward by Pr7.35, else 0).
    pub data: i32,
}

/// The non-cyclic half of a command, bytes 8-15, by the non-cyclic code.
///
/// SX-DSV02310, chapter 6, a section for each command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum NonCyclicCommand {
    /// 0h: the normal command, without a request.
    Normal {
        /// Bytes 8-11, free.
        command_data2: i32,
        /// Bytes 12-15: feed-forward by Pr7.35, else 0.
        command_data3: i32,
    },
    /// 1h: reset; the index must be 0.
    Reset(Arguments),
    /// 2h: reads a group of four characters; the index is the number of the group.
    SystemId(Arguments),
    /// 4h: homing, position setting, latch.
    Homing {
        /// Byte 8.
        type_code: u8,
        /// Byte 10 bits 3-0; 0 outside latch mode.
        latch_sel1: Nibble,
        /// Byte 10 bits 7-4; 0 outside latch mode.
        latch_sel2: Nibble,
        /// Byte 11: type code of the monitor value wanted; 0 outside latch mode.
        monitor_sel: u8,
        /// Bytes 12-15: the position for types 21h and 22h, otherwise feed-forward or 0.
        setting_data: i32,
    },
    /// 5h: reads or clears alarms.
    Alarm(Arguments),
    /// 6h: reads or writes a parameter; the index is a [`Pr`](crate::type_code::Pr).
    Parameter(Arguments),
    /// 7h: profile motion; only with [`CyclicCode::ProfilePosition`](crate::CyclicCode::ProfilePosition).
    Profile {
        /// Byte 8: absolute, relative, ...
        type_code: u8,
        /// Byte 10 bits 3-0.
        latch_sel1: Nibble,
        /// Byte 11: type code of the monitor value wanted.
        monitor_sel: u8,
        /// Bytes 12-15: TSPD, in the unit set by Pr7.25.
        target_speed: i32,
    },
    /// Ah: reads a monitor value; it is refreshed in every exchange while the command is held.
    Monitor(Arguments),
}

impl NonCyclicCommand {
    /// No request and no feed-forward.
    pub const IDLE: Self = Self::Normal { command_data2: 0, command_data3: 0 };

    /// Returns the code for bits 3-0 of byte 1.
    pub const fn code(&self) -> NonCyclicCode {
        match self {
            Self::Normal { .. } => NonCyclicCode::Normal,
            Self::Reset(_) => NonCyclicCode::Reset,
            Self::SystemId(_) => NonCyclicCode::SystemId,
            Self::Homing { .. } => NonCyclicCode::Homing,
            Self::Alarm(_) => NonCyclicCode::Alarm,
            Self::Parameter(_) => NonCyclicCode::Parameter,
            Self::Profile { .. } => NonCyclicCode::Profile,
            Self::Monitor(_) => NonCyclicCode::Monitor,
        }
    }

    /// Returns whether bytes 12-15 belong to the command itself, so that no feed-forward can be sent: homing types 21h and
    /// 22h, parameter write (011h), profile. SX-DSV02310, "Feed-forward".
    pub(crate) const fn needs_data3(&self) -> bool {
        match self {
            Self::Homing { type_code: homing::SET_ACTUAL_POSITION | homing::SET_COMMAND_POSITION, .. }
            | Self::Profile { .. } => true,
            Self::Parameter(a) => a.type_code.get() == parameter::WRITE.get(),
            _ => false,
        }
    }

    /// Puts a feed-forward into bytes 12-15, unless it is 0 or the command uses them itself.
    #[must_use]
    pub fn with_feed_forward(self, value: i32) -> Self {
        if value == 0 || self.needs_data3() {
            return self;
        }
        let with = |a: Arguments| Arguments { data: value, ..a };
        match self {
            Self::Normal { command_data2, .. } => Self::Normal { command_data2, command_data3: value },
            Self::Reset(a) => Self::Reset(with(a)),
            Self::SystemId(a) => Self::SystemId(with(a)),
            Self::Alarm(a) => Self::Alarm(with(a)),
            Self::Parameter(a) => Self::Parameter(with(a)),
            Self::Monitor(a) => Self::Monitor(with(a)),
            Self::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, .. } => {
                Self::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data: value }
            }
            // Never: it needs them itself.
            Self::Profile { .. } => self,
        }
    }

    /// Bytes 8-15; reserved bits are 0.
    pub const fn emit(&self) -> [u8; 8] {
        match *self {
            Self::Normal { command_data2, command_data3 } => join(command_data2.to_le_bytes(), command_data3),
            Self::Reset(a) | Self::SystemId(a) | Self::Alarm(a) | Self::Parameter(a) | Self::Monitor(a) => {
                let [type_low, type_high] = a.type_code.get().to_le_bytes();
                let [index_low, index_high] = a.index.to_le_bytes();
                join([type_low, type_high, index_low, index_high], a.data)
            }
            Self::Homing { type_code, latch_sel1, latch_sel2, monitor_sel, setting_data } => {
                join([type_code, 0, latch_sel2.get() << 4 | latch_sel1.get(), monitor_sel], setting_data)
            }
            Self::Profile { type_code, latch_sel1, monitor_sel, target_speed } => {
                join([type_code, 0, latch_sel1.get(), monitor_sel], target_speed)
            }
        }
    }

    /// Reads bytes 8-15 by the code; reserved bits are ignored.
    pub const fn parse(code: NonCyclicCode, bytes: [u8; 8]) -> Self {
        let [b8, b9, b10, b11, d @ ..] = bytes;
        let data = i32::from_le_bytes(d);
        let arguments = Arguments {
            type_code: TypeCode::truncate(u16::from_le_bytes([b8, b9])),
            index: u16::from_le_bytes([b10, b11]),
            data,
        };
        match code {
            NonCyclicCode::Normal => {
                Self::Normal { command_data2: i32::from_le_bytes([b8, b9, b10, b11]), command_data3: data }
            }
            NonCyclicCode::Reset => Self::Reset(arguments),
            NonCyclicCode::SystemId => Self::SystemId(arguments),
            NonCyclicCode::Homing => Self::Homing {
                type_code: b8,
                latch_sel1: Nibble::truncate(b10),
                latch_sel2: Nibble::truncate(b10 >> 4),
                monitor_sel: b11,
                setting_data: data,
            },
            NonCyclicCode::Alarm => Self::Alarm(arguments),
            NonCyclicCode::Parameter => Self::Parameter(arguments),
            NonCyclicCode::Profile => {
                Self::Profile { type_code: b8, latch_sel1: Nibble::truncate(b10), monitor_sel: b11, target_speed: data }
            }
            NonCyclicCode::Monitor => Self::Monitor(arguments),
        }
    }

    /// Refuses the first reserved bit of bytes 8-15 that is 1.
    pub(crate) const fn check_reserved(code: NonCyclicCode, bytes: [u8; 8]) -> Result<(), Error> {
        let [_, b9, b10, ..] = bytes;
        let (nine, ten) = match code {
            NonCyclicCode::Normal => (0, 0),
            NonCyclicCode::Homing => (0xff, 0),
            NonCyclicCode::Profile => (0xff, 0xf0),
            _ => (0xf0, 0),
        };
        match (b9 & nine, b10 & ten) {
            (0, 0) => Ok(()),
            (0, bits) => Err(Error::Reserved { byte: 10, bits }),
            (bits, _) => Err(Error::Reserved { byte: 9, bits }),
        }
    }
}

impl fmt::Display for Arguments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "type {:02X}h index {} data {}", self.type_code.get(), self.index, self.data)
    }
}

impl fmt::Display for NonCyclicCommand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Normal { command_data2, command_data3 } => write!(f, "{command_data2} {command_data3}"),
            Self::Reset(a) | Self::SystemId(a) | Self::Alarm(a) | Self::Monitor(a) => a.fmt(f),
            Self::Parameter(a) => {
                let pr = crate::type_code::Pr::from_index(a.index);
                write!(f, "type {:02X}h {pr} data {}", a.type_code.get(), a.data)
            }
            Self::Homing { type_code, setting_data, .. } => write!(f, "type {type_code:02X}h data {setting_data}"),
            Self::Profile { type_code, target_speed, .. } => write!(f, "type {type_code:02X}h speed {target_speed}"),
        }
    }
}
