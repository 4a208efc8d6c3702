use core::fmt;

use crate::block::join;
use crate::code::NonCyclicCode;
use crate::error::Error;
use crate::error_code::{Alarm, ErrorCode};
use crate::execution::{Execution, LatchFlags, ProfileFlags};
use crate::type_code::{Nibble, TypeCode};

/// Bytes 8-15 of a response with the layout that reset, system ID, parameter and monitor share.
///
/// ```text
/// byte  8            9                     10           11           12 .. 15
///       Type_Code    ERR WNG 0 Busy        Index_Echo   Index_Echo   Monitor_Data, L first
///       bits 7-0     3-0: bits 11-8        L            H
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Results {
    /// The progress of the command.
    pub execution: Execution,
    /// Echo of the type code.
    pub type_code: TypeCode,
    /// Index_Echo.
    pub index: u16,
    /// Monitor_Data; for a system ID see [`Results::characters`].
    pub data: i32,
}

impl Results {
    /// The four characters of a system ID answer, byte 12 first.
    pub const fn characters(&self) -> [u8; 4] {
        self.data.to_le_bytes()
    }

    /// Alarm and warning of an alarm answer: byte 12 main code, 13 sub code, 14-15 warning code. (If attributes were requested,
    /// the four bytes carry those instead.)
    pub const fn alarm(&self) -> AlarmAndWarning {
        let [main, sub, low, high] = self.data.to_le_bytes();
        AlarmAndWarning { alarm: Alarm { main, sub }, warning: u16::from_le_bytes([low, high]) }
    }

    /// Returns the data of an alarm answer, which [`alarm`](Self::alarm) reads.
    ///
    /// ```
    /// use rtex_block::{Alarm, Results};
    /// assert_eq!(Results::alarm_data(Alarm { main: 38, sub: 1 }, 0xa0).to_le_bytes(), [38, 1, 0xa0, 0]);
    /// ```
    pub const fn alarm_data(alarm: Alarm, warning: u16) -> i32 {
        let [low, high] = warning.to_le_bytes();
        i32::from_le_bytes([alarm.main, alarm.sub, low, high])
    }
}

/// The content of bytes 12-15 of an alarm answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct AlarmAndWarning {
    /// Main and sub code, bytes 12 and 13.
    pub alarm: Alarm,
    /// Warning code, bytes 14-15; 0 for none.
    pub warning: u16,
}

servowire_core::one_line!(AlarmAndWarning { Self { alarm, warning } => "{} warning {:X}h", alarm, warning; });

/// The non-cyclic half of a response, bytes 8-15.
///
/// Its layout depends first on CMD_Error and only then on the echo of the non-cyclic code.
/// SX-DSV02310, chapter 6; System Design Guide for Master, "Profile position response".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum NonCyclicResponse {
    /// CMD_Error: the command was not accepted. Bytes 8-9 are Error_Code, bytes 10-15 are 0.
    CommandError(ErrorCode),
    /// 0h: normal.
    Normal {
        /// Bytes 8-11: actual speed, or the value chosen by Pr7.30.
        response_data2: i32,
        /// Bytes 12-15: torque, or the value chosen by Pr7.31.
        response_data3: i32,
    },
    /// 1h: reset.
    Reset(Results),
    /// 2h: four characters.
    SystemId(Results),
    /// 4h: homing, position setting, latch.
    Homing {
        /// Byte 9 bits 7, 6, 4.
        execution: Execution,
        /// Echo of byte 8.
        type_code: u8,
        /// Byte 9 bits 1 and 0: which latches have caught a position.
        latch: LatchFlags,
        /// Echo of byte 10 bits 3-0.
        latch_sel1: Nibble,
        /// Echo of byte 10 bits 7-4.
        latch_sel2: Nibble,
        /// Echo of byte 11.
        monitor_sel: u8,
        /// Bytes 12-15: the monitor value chosen by Monitor_Sel.
        monitor_data: i32,
    },
    /// 5h: alarm; see [`Results::alarm`].
    Alarm(Results),
    /// 6h: parameter.
    Parameter(Results),
    /// 7h: profile motion.
    Profile {
        /// Byte 9 bits 7, 6, 4.
        execution: Execution,
        /// Echo of byte 8.
        type_code: u8,
        /// Byte 9 bits 3-0: software limits, near window, latch.
        flags: ProfileFlags,
        /// Echo of byte 10 bits 3-0.
        latch_sel1: Nibble,
        /// Echo of byte 11.
        monitor_sel: u8,
        /// Bytes 12-15: the monitor value chosen by Monitor_Sel.
        monitor_data: i32,
    },
    /// Ah: monitor.
    Monitor(Results),
    /// The echo of a code that is not defined, without CMD_Error.
    Undefined {
        /// Bits 3-0 of byte 1.
        code: u8,
        /// Bytes 8-15.
        bytes: [u8; 8],
    },
}

impl NonCyclicResponse {
    /// Reads bytes 8-15 by CMD_Error and the echoed code; reserved bits are ignored.
    pub(crate) const fn parse(cmd_error: bool, noncyclic_bits: u8, bytes: [u8; 8]) -> Self {
        let [b8, b9, b10, b11, d @ ..] = bytes;
        if cmd_error {
            return Self::CommandError(ErrorCode(u16::from_le_bytes([b8, b9])));
        }
        let data = i32::from_le_bytes(d);
        let execution = Execution::from_bits_truncate(b9);
        let results = Results {
            execution,
            type_code: TypeCode::truncate(u16::from_le_bytes([b8, b9])),
            index: u16::from_le_bytes([b10, b11]),
            data,
        };
        let Some(code) = NonCyclicCode::from_code(noncyclic_bits) else {
            return Self::Undefined { code: noncyclic_bits, bytes };
        };
        match code {
            NonCyclicCode::Normal => {
                Self::Normal { response_data2: i32::from_le_bytes([b8, b9, b10, b11]), response_data3: data }
            }
            NonCyclicCode::Reset => Self::Reset(results),
            NonCyclicCode::SystemId => Self::SystemId(results),
            NonCyclicCode::Homing => Self::Homing {
                execution,
                type_code: b8,
                latch: LatchFlags::from_bits_truncate(b9),
                latch_sel1: Nibble::truncate(b10),
                latch_sel2: Nibble::truncate(b10 >> 4),
                monitor_sel: b11,
                monitor_data: data,
            },
            NonCyclicCode::Alarm => Self::Alarm(results),
            NonCyclicCode::Parameter => Self::Parameter(results),
            NonCyclicCode::Profile => Self::Profile {
                execution,
                type_code: b8,
                flags: ProfileFlags::from_bits_truncate(b9),
                latch_sel1: Nibble::truncate(b10),
                monitor_sel: b11,
                monitor_data: data,
            },
            NonCyclicCode::Monitor => Self::Monitor(results),
        }
    }

    /// Bytes 8-15; reserved bits are 0.
    pub const fn emit(&self) -> [u8; 8] {
        match *self {
            Self::CommandError(code) => {
                let [low, high] = code.0.to_le_bytes();
                [low, high, 0, 0, 0, 0, 0, 0]
            }
            Self::Normal { response_data2, response_data3 } => join(response_data2.to_le_bytes(), response_data3),
            Self::Reset(r) | Self::SystemId(r) | Self::Alarm(r) | Self::Parameter(r) | Self::Monitor(r) => {
                let [type_low, type_high] = r.type_code.get().to_le_bytes();
                let [index_low, index_high] = r.index.to_le_bytes();
                join([type_low, r.execution.to_byte() | type_high, index_low, index_high], r.data)
            }
            Self::Homing { execution, type_code, latch, latch_sel1, latch_sel2, monitor_sel, monitor_data } => {
                let selections = latch_sel2.get() << 4 | latch_sel1.get();
                join([type_code, execution.to_byte() | latch.to_byte(), selections, monitor_sel], monitor_data)
            }
            Self::Profile { execution, type_code, flags, latch_sel1, monitor_sel, monitor_data } => {
                let nine = execution.to_byte() | flags.to_byte();
                join([type_code, nine, latch_sel1.get(), monitor_sel], monitor_data)
            }
            Self::Undefined { bytes, .. } => bytes,
        }
    }

    /// Bytes 12-15; `None` for an error and for the echo of an undefined code.
    pub const fn data(&self) -> Option<i32> {
        match self {
            Self::Reset(r) | Self::SystemId(r) | Self::Alarm(r) | Self::Parameter(r) | Self::Monitor(r) => Some(r.data),
            Self::Homing { monitor_data: data, .. }
            | Self::Profile { monitor_data: data, .. }
            | Self::Normal { response_data3: data, .. } => Some(*data),
            Self::CommandError(_) | Self::Undefined { .. } => None,
        }
    }

    /// ERR, WNG and Busy; `None` for the layouts that do not have them.
    pub const fn execution(&self) -> Option<Execution> {
        match self {
            Self::Reset(r) | Self::SystemId(r) | Self::Alarm(r) | Self::Parameter(r) | Self::Monitor(r) => {
                Some(r.execution)
            }
            Self::Homing { execution, .. } | Self::Profile { execution, .. } => Some(*execution),
            Self::CommandError(_) | Self::Normal { .. } | Self::Undefined { .. } => None,
        }
    }

    /// Refuses the first reserved bit of bytes 8-15 that is 1.
    pub(crate) fn check_reserved(cmd_error: bool, noncyclic_bits: u8, bytes: [u8; 8]) -> Result<(), Error> {
        let masks: [u8; 8] = match (cmd_error, NonCyclicCode::from_code(noncyclic_bits)) {
            (true, _) => [0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff],
            (false, None | Some(NonCyclicCode::Normal)) => [0; 8],
            (false, Some(NonCyclicCode::Homing)) => [0, 0x2c, 0, 0, 0, 0, 0, 0],
            (false, Some(NonCyclicCode::Profile)) => [0, 0x20, 0xf0, 0, 0, 0, 0, 0],
            (false, Some(_)) => [0, 0x20, 0, 0, 0, 0, 0, 0],
        };
        for ((number, byte), mask) in (8..).zip(bytes).zip(masks) {
            if byte & mask != 0 {
                return Err(Error::Reserved { byte: number, bits: byte & mask });
            }
        }
        Ok(())
    }
}

impl fmt::Display for Results {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "type {:02X}h index {} data {}", self.type_code.get(), self.index, self.data)?;
        suffix(f, &self.execution)
    }
}

impl fmt::Display for NonCyclicResponse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::CommandError(code) => write!(f, "not accepted: {code}"),
            Self::Normal { response_data2, response_data3 } => write!(f, "{response_data2} {response_data3}"),
            Self::Alarm(r) => {
                let AlarmAndWarning { alarm, warning } = r.alarm();
                write!(f, "type {:02X}h index {} {alarm} warning {warning:X}h", r.type_code.get(), r.index)?;
                write!(f, " (or attributes {:08X}h)", r.data)?;
                suffix(f, &r.execution)
            }
            Self::SystemId(r) => {
                let text = r.characters();
                write!(f, "type {:02X}h index {} \"{}\"", r.type_code.get(), r.index, text.escape_ascii())?;
                suffix(f, &r.execution)
            }
            Self::Reset(r) | Self::Parameter(r) | Self::Monitor(r) => r.fmt(f),
            Self::Homing { execution, type_code, latch, monitor_data, .. } => {
                write!(f, "type {type_code:02X}h data {monitor_data}")?;
                suffix(f, execution)?;
                suffix(f, latch)
            }
            Self::Profile { execution, type_code, flags, monitor_data, .. } => {
                write!(f, "type {type_code:02X}h data {monitor_data}")?;
                suffix(f, execution)?;
                suffix(f, flags)
            }
            Self::Undefined { code, .. } => write!(f, "echo of {code:X}h, which is not defined"),
        }
    }
}

/// Writes a space and the flags, if any is set.
fn suffix(f: &mut fmt::Formatter<'_>, flags: &(impl fmt::Display + bitflags::Flags)) -> fmt::Result {
    if flags.is_empty() { Ok(()) } else { write!(f, " {flags}") }
}
