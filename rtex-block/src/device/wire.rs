//! The blocks as the drive reads and writes them, byte by byte: it shares nothing with the master's codec.

use super::literals::{BUSY, ERR, HOMING, PROFILE, WNG};

/// A command's non-cyclic code, and its bytes 8-15.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Request {
    pub(super) code: u8,
    pub(super) bytes: [u8; 8],
}

impl Request {
    /// Homing and profile commands have a type code of 8 bits and flags next to it; the other commands have a type code of
    /// 12 bits.
    const fn is_short(&self) -> bool {
        matches!(self.code, HOMING | PROFILE)
    }

    pub(super) const fn type_code(&self) -> u16 {
        let [low, high, ..] = self.bytes;
        u16::from_le_bytes([low, if self.is_short() { 0 } else { high & 0x0f }])
    }

    pub(super) const fn index(&self) -> u16 {
        let [_, _, low, high, ..] = self.bytes;
        u16::from_le_bytes([low, high])
    }

    /// The flags of homing and profile commands.
    pub(super) const fn monitor_sel(&self) -> u8 {
        let [_, _, _, monitor_sel, ..] = self.bytes;
        monitor_sel
    }

    pub(super) const fn data(&self) -> i32 {
        let [.., a, b, c, d] = self.bytes;
        i32::from_le_bytes([a, b, c, d])
    }

    /// Returns the same command for a different object.
    pub(super) const fn other(mut self, by_index: bool) -> Self {
        if by_index {
            self.bytes[2] ^= 1;
        } else {
            self.bytes[0] ^= 1;
        }
        self
    }

    /// Bytes 8-15 of the answer. `flags` are Latch_Comp and the profile flags, if the layout has them.
    pub(super) const fn answer(&self, execution: Execution, index: u16, flags: u8, data: i32) -> [u8; 8] {
        let [type_low, type_high, ..] = self.bytes;
        let low_nibble = if self.is_short() { flags } else { type_high & 0x0f };
        // Of homing and profile these are the selections; profile has no Latch_Sel2.
        let [index_low, three] = index.to_le_bytes();
        let two = if self.code == PROFILE { index_low & 0x0f } else { index_low };
        let [a, b, c, d] = data.to_le_bytes();
        [type_low, execution.bits() | low_nibble, two, three, a, b, c, d]
    }
}

/// Bits 7-4 of byte 9.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Execution {
    pub(super) err: bool,
    pub(super) wng: bool,
    pub(super) busy: bool,
}

impl Execution {
    const fn bits(self) -> u8 {
        (if self.err { ERR } else { 0 }) | (if self.wng { WNG } else { 0 }) | (if self.busy { BUSY } else { 0 })
    }
}

/// Returns two numbers as bytes 8-15.
pub(super) const fn pair(one: i32, two: i32) -> [u8; 8] {
    let ([a, b, c, d], [e, f, g, h]) = (one.to_le_bytes(), two.to_le_bytes());
    [a, b, c, d, e, f, g, h]
}

/// Bytes 8-15 of an error answer.
pub(super) const fn error(code: u16) -> [u8; 8] {
    let [low, high] = code.to_le_bytes();
    [low, high, 0, 0, 0, 0, 0, 0]
}

/// A response of 16 bytes, with a counter echo of 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Block([u8; 16]);

impl Block {
    pub(super) const fn new(mac_id: u8, byte1: u8, status: [u8; 2], data1: i32, tail: [u8; 8]) -> Self {
        let [two, three] = status;
        let [a, b, c, d] = data1.to_le_bytes();
        let [e, f, g, h, i, j, k, l] = tail;
        Self([0x80 | mac_id, byte1, two, three, a, b, c, d, e, f, g, h, i, j, k, l])
    }

    /// Sets the Update_Counter of a command's byte 0.
    pub(super) const fn with_counter_of(mut self, byte0: u8) -> [u8; 16] {
        self.0[0] |= byte0 & 0x60;
        self.0
    }
}

/// The content of the next response's sub block, except Sub_Response_Data2 and 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Sub {
    /// Code, Sub_Type_Code, Sub_Index, Sub_Response_Data1.
    Done(u8, u8, u16, i32),
    /// Code, Sub_Error_Code.
    Refused(u8, u16),
}

impl Sub {
    pub(super) fn emit(self, data2: i32, data3: i32) -> [u8; 16] {
        let (byte16, type_code, index, data1) = match self {
            Self::Done(code, type_code, index, data1) => (code, type_code, index, data1),
            Self::Refused(code, error) => (0x80 | code, 0, error, 0),
        };
        let mut block = [0; 16];
        let numbers = [data1, data2, data3].into_iter().flat_map(i32::to_le_bytes);
        let bytes = [byte16, type_code].into_iter().chain(index.to_le_bytes()).chain(numbers);
        block.iter_mut().zip(bytes).for_each(|(to, from)| *to = from);
        block
    }
}
