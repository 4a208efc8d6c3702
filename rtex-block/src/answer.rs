use crate::request::join;
use crate::{Alarm, Error, ErrorCode, Nibble, NonCyclicCode, TypeCode};

/// How far a non-cyclic command has come: bits 7, 6 and 4 of byte 9 of a response.
///
/// SX-DSV02310, "Response of non-cyclic commands".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Execution {
    /// ERR: the command was accepted and failed while it was executed.
    pub err: bool,
    /// WNG: executed with a restriction.
    pub wng: bool,
    /// Busy: still executing.
    pub busy: bool,
}

impl Execution {
    /// Bits 7, 6 and 4 of a byte.
    pub const fn from_byte(byte: u8) -> Self {
        Self { err: byte & 0x80 != 0, wng: byte & 0x40 != 0, busy: byte & 0x10 != 0 }
    }

    /// The three bits in their places.
    pub const fn to_byte(self) -> u8 {
        (self.err as u8) << 7 | (self.wng as u8) << 6 | (self.busy as u8) << 4
    }
}

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
pub struct Reply {
    /// How far the command has come.
    pub execution: Execution,
    /// Echo of the type code.
    pub type_code: TypeCode,
    /// Index_Echo.
    pub index: u16,
    /// Monitor_Data; of a system ID see [`Reply::characters`].
    pub data: i32,
}

impl Reply {
    /// The four characters of a system ID answer, byte 12 first.
    pub const fn characters(&self) -> [u8; 4] {
        self.data.to_le_bytes()
    }

    /// Alarm and warning of an alarm answer: byte 12 main code, 13 sub code, 14-15 warning code. (When attributes
    /// were asked for, the four bytes carry those instead.)
    pub const fn alarm(&self) -> (Alarm, u16) {
        let [main, sub, low, high] = self.data.to_le_bytes();
        (Alarm { main, sub }, u16::from_le_bytes([low, high]))
    }

    /// The data of an alarm answer.
    pub const fn alarm_data(alarm: Alarm, warning: u16) -> i32 {
        let [low, high] = warning.to_le_bytes();
        i32::from_le_bytes([alarm.main, alarm.sub, low, high])
    }
}

/// The non-cyclic half of a response, bytes 8-15.
///
/// Which layout it has depends on CMD_Error first and on the echo of the non-cyclic code only then.
/// SX-DSV02310, chapter 6; System Design Guide for Master, "Profile position response".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Answer {
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
    Reset(Reply),
    /// 2h: four characters.
    SystemId(Reply),
    /// 4h: homing, position setting, latch.
    Homing {
        /// Byte 9 bits 7, 6, 4.
        execution: Execution,
        /// Echo of byte 8.
        type_code: u8,
        /// Byte 9 bit 0: latch 1 has caught a position; before that LPOS1 is undefined.
        latch_comp1: bool,
        /// Byte 9 bit 1: latch 2 has caught a position; before that LPOS2 is undefined.
        latch_comp2: bool,
        /// Echo of byte 10 bits 3-0.
        latch_sel1: Nibble,
        /// Echo of byte 10 bits 7-4.
        latch_sel2: Nibble,
        /// Echo of byte 11.
        monitor_sel: u8,
        /// Bytes 12-15: the monitor value chosen by Monitor_Sel.
        monitor_data: i32,
    },
    /// 5h: alarm; see [`Reply::alarm`].
    Alarm(Reply),
    /// 6h: parameter.
    Parameter(Reply),
    /// 7h: profile motion.
    Profile {
        /// Byte 9 bits 7, 6, 4.
        execution: Execution,
        /// Echo of byte 8.
        type_code: u8,
        /// Byte 9 bit 3: positive software limit (exchangeable with NSL by parameter).
        psl: bool,
        /// Byte 9 bit 2: negative software limit (exchangeable with PSL by parameter).
        nsl: bool,
        /// Byte 9 bit 1: inside the near window.
        near: bool,
        /// Byte 9 bit 0: latch 1 has caught a position.
        latch_comp1: bool,
        /// Echo of byte 10 bits 3-0.
        latch_sel1: Nibble,
        /// Echo of byte 11.
        monitor_sel: u8,
        /// Bytes 12-15: the monitor value chosen by Monitor_Sel.
        monitor_data: i32,
    },
    /// Ah: monitor.
    Monitor(Reply),
    /// The echo of a code that is not defined, without CMD_Error.
    Undefined {
        /// Bits 3-0 of byte 1.
        code: u8,
        /// Bytes 8-15.
        bytes: [u8; 8],
    },
}

impl Answer {
    /// Reads bytes 8-15 by CMD_Error and the echoed code; reserved bits are not looked at.
    pub const fn from_bytes(cmd_error: bool, noncyclic_bits: u8, bytes: [u8; 8]) -> Self {
        let [b8, b9, b10, b11, d @ ..] = bytes;
        if cmd_error {
            return Self::CommandError(ErrorCode(u16::from_le_bytes([b8, b9])));
        }
        let data = i32::from_le_bytes(d);
        let execution = Execution::from_byte(b9);
        let reply = Reply {
            execution,
            type_code: TypeCode::low(u32::from_le_bytes([b8, b9, 0, 0])),
            index: u16::from_le_bytes([b10, b11]),
            data,
        };
        let Some(code) = NonCyclicCode::new(noncyclic_bits) else {
            return Self::Undefined { code: noncyclic_bits, bytes };
        };
        match code {
            NonCyclicCode::Normal => {
                Self::Normal { response_data2: i32::from_le_bytes([b8, b9, b10, b11]), response_data3: data }
            }
            NonCyclicCode::Reset => Self::Reset(reply),
            NonCyclicCode::SystemId => Self::SystemId(reply),
            NonCyclicCode::Homing => Self::Homing {
                execution,
                type_code: b8,
                latch_comp1: b9 & 1 != 0,
                latch_comp2: b9 & 2 != 0,
                latch_sel1: Nibble::low(b10),
                latch_sel2: Nibble::low(b10 >> 4),
                monitor_sel: b11,
                monitor_data: data,
            },
            NonCyclicCode::Alarm => Self::Alarm(reply),
            NonCyclicCode::Parameter => Self::Parameter(reply),
            NonCyclicCode::Profile => Self::Profile {
                execution,
                type_code: b8,
                psl: b9 & 8 != 0,
                nsl: b9 & 4 != 0,
                near: b9 & 2 != 0,
                latch_comp1: b9 & 1 != 0,
                latch_sel1: Nibble::low(b10),
                monitor_sel: b11,
                monitor_data: data,
            },
            NonCyclicCode::Monitor => Self::Monitor(reply),
        }
    }

    /// Bytes 8-15; reserved bits are 0.
    pub const fn to_bytes(&self) -> [u8; 8] {
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
            Self::Homing {
                execution,
                type_code,
                latch_comp1,
                latch_comp2,
                latch_sel1,
                latch_sel2,
                monitor_sel,
                monitor_data,
            } => {
                let nine = execution.to_byte() | (latch_comp2 as u8) << 1 | latch_comp1 as u8;
                join([type_code, nine, latch_sel2.get() << 4 | latch_sel1.get(), monitor_sel], monitor_data)
            }
            Self::Profile {
                execution,
                type_code,
                psl,
                nsl,
                near,
                latch_comp1,
                latch_sel1,
                monitor_sel,
                monitor_data,
            } => {
                let low = (psl as u8) << 3 | (nsl as u8) << 2 | (near as u8) << 1 | latch_comp1 as u8;
                join([type_code, execution.to_byte() | low, latch_sel1.get(), monitor_sel], monitor_data)
            }
            Self::Undefined { bytes, .. } => bytes,
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
        let masks: [u8; 8] = match (cmd_error, NonCyclicCode::new(noncyclic_bits)) {
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
