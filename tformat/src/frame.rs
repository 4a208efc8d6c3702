use core::fmt;

use nrz_line::{BitOrder, Window};

use crate::error::Error;

/// The fields of one frame, 1 to 11 data bytes.
///
/// A field is ten bits on the line, a plain 8N1 character; fields follow each other without a gap
/// (TIDM-1011, table 2-3).
///
/// ```text
///  line, time →   0 | d0 d1 d2 d3 d4 d5 d6 d7 | 1 | 0 | d0 ...
///             start        data, LSB first   delimiter
///  frame bit      0   1                    8   9   10  11        field k begins at bit 10 k
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    bytes: [u8; Frame::MAX_FIELDS],
    len: u8,
}

const START: u128 = {
    let mut mask = 0;
    let mut field = 0;
    while field < Frame::MAX_FIELDS {
        mask |= 1 << (10 * field);
        field += 1;
    }
    mask
};
const DELIMITER: u128 = START << 9;
const _: () = {
    let data = START * 0x1fe;
    assert!(
        START & DELIMITER == 0 && (START | DELIMITER) & data == 0 && START | DELIMITER | data == (1 << 110) - 1,
        "start bits, data bits and delimiters partition the longest frame"
    );
};

impl Frame {
    /// Fields of the longest frame, the ID 3 response.
    pub const MAX_FIELDS: usize = 11;
    /// Bits of one field on the line.
    pub const FIELD_BITS: u32 = 10;
    /// Bytes that hold the line bits of the longest frame: 110 bits in 14 bytes.
    pub const MAX_LINE_BYTES: usize = 14;

    /// A frame without fields, which never occurs on a line.
    pub(crate) const NONE: Self = Self { bytes: [0; Self::MAX_FIELDS], len: 0 };

    /// Creates a frame of one field.
    pub(crate) const fn of1(a: u8) -> Self {
        Self { bytes: [a, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], len: 1 }
    }

    /// Creates a frame of 3 fields.
    pub(crate) const fn of3([a, b, c]: [u8; 3]) -> Self {
        Self { bytes: [a, b, c, 0, 0, 0, 0, 0, 0, 0, 0], len: 3 }
    }

    /// Creates a frame of 4 fields.
    pub(crate) const fn of4([a, b, c, d]: [u8; 4]) -> Self {
        Self { bytes: [a, b, c, d, 0, 0, 0, 0, 0, 0, 0], len: 4 }
    }

    /// Creates a frame of 6 fields.
    pub(crate) const fn of6([a, b, c, d, e, f]: [u8; 6]) -> Self {
        Self { bytes: [a, b, c, d, e, f, 0, 0, 0, 0, 0], len: 6 }
    }

    /// Creates a frame of 11 fields.
    pub(crate) const fn of11(bytes: [u8; 11]) -> Self {
        Self { bytes, len: 11 }
    }

    /// Creates a frame of these data bytes; `None` if there are none or more than 11.
    pub fn new(bytes: &[u8]) -> Option<Self> {
        let len = u8::try_from(bytes.len()).ok().filter(|len| *len > 0)?;
        let mut frame = Self { bytes: [0; Self::MAX_FIELDS], len };
        frame.bytes.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(frame)
    }

    /// The data bytes, as a UART sends and receives them, in line order.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..usize::from(self.len)).unwrap_or(&self.bytes)
    }

    /// Returns all eleven bytes: the data bytes, then zeros. This copies a constant length, which suits firmware.
    pub const fn to_array(self) -> [u8; Self::MAX_FIELDS] {
        self.bytes
    }

    /// The first data byte: the control field.
    pub(crate) const fn first(&self) -> u8 {
        let [first, ..] = self.bytes;
        first
    }

    /// Number of fields, 1..=11.
    pub const fn fields(self) -> u8 {
        self.len
    }

    /// Length on the line in bits, 10 per field.
    pub const fn line_bits(self) -> u32 {
        (self.len as u32).wrapping_mul(Self::FIELD_BITS)
    }

    /// The line bits, start bits and delimiters included, fields back to back.
    pub const fn line(self) -> Window {
        let len = self.line_bits();
        match Window::from_bits(pack(&self.bytes), len) {
            Some(line) => line,
            // Never: 11 fields are 110 bits.
            None => Window::EMPTY,
        }
    }

    /// Reads `fields` fields from the beginning of `line`, a grid of ten bits per field, and checks their framing.
    ///
    /// # Errors
    /// The first of [`Error::StartBit`], [`Error::Delimiter`] and [`Error::Truncated`] in the order of the line.
    pub fn from_line(line: Window, fields: u8) -> Result<Self, Error> {
        let len = fields.min(11);
        let bits = u32::from(len).wrapping_mul(Self::FIELD_BITS);
        if line.len() < bits || !is_framed(line.bits(), bits) {
            return Err(framing(line, len));
        }
        Ok(Self { bytes: unpack(line.bits() & first(bits)), len })
    }
}

impl fmt::Display for Frame {
    /// Writes the bytes in hexadecimal: `1A 20 29`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, byte) in self.as_bytes().iter().enumerate() {
            write!(f, "{}{byte:02X}", if at > 0 { " " } else { "" })?;
        }
        Ok(())
    }
}

#[cfg(feature = "defmt")]
#[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
impl defmt::Format for Frame {
    fn format(&self, f: defmt::Formatter<'_>) {
        for (at, byte) in self.as_bytes().iter().enumerate() {
            defmt::write!(f, "{=str}{=u8:02X}", if at > 0 { " " } else { "" }, byte);
        }
    }
}

/// Returns the mask of the first `bits` bits.
const fn first(bits: u32) -> u128 {
    match 1_u128.checked_shl(bits) {
        Some(one) => one.wrapping_sub(1),
        None => u128::MAX,
    }
}

/// Returns whether the start bits and delimiters among the first `bits` bits are right.
pub(crate) const fn is_framed(line: u128, bits: u32) -> bool {
    (line ^ DELIMITER) & (START | DELIMITER) & first(bits) == 0
}

/// The line bits of eleven fields in four groups of three, 30 bits each: every field has the same place in each group.
///
/// In place of a twelfth field there is a correctly framed one whose data bits are 0.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "a group is the low 30 bits")]
const fn groups(line: u128) -> [u32; 4] {
    let last = (line >> 90) as u32 & 0x000f_ffff | 1 << 29;
    [line as u32, (line >> 30) as u32, (line >> 60) as u32, last]
}

const START3: u32 = 1 | 1 << 10 | 1 << 20;
const DELIMITER3: u32 = START3 << 9;

/// Returns 0 if eleven fields are framed and their XOR is 0, as it is over a whole frame with its check field.
///
/// All groups are tested at once, which takes the fewest constants on a 32-bit core.
#[inline(always)]
pub(crate) const fn faults11(line: u128) -> u32 {
    let [a, b, c, d] = groups(line);
    let starts = (a | b | c | d) & START3;
    let delimiters = !(a & b & c & d) & DELIMITER3;
    let sum = a ^ b ^ c ^ d;
    let crc = (sum >> 1 ^ sum >> 11 ^ sum >> 21) & 0xff;
    starts | delimiters | crc
}

/// Like [`faults11`], for the six fields in the low 60 bits.
#[inline(always)]
pub(crate) const fn faults6(line: u128) -> u32 {
    let [a, b, ..] = groups(line);
    let sum = a ^ b;
    let crc = (sum >> 1 ^ sum >> 11 ^ sum >> 21) & 0xff;
    (a | b) & START3 | !(a & b) & DELIMITER3 | crc
}

/// Like [`faults11`], for the four fields in the low 40 bits.
#[inline(always)]
pub(crate) const fn faults4(line: u128) -> u32 {
    // In place of the fifth and sixth field there are framed ones with the data bits 0.
    faults6(line & first(40) | (1 << 9 | 1 << 19) << 40)
}

/// Extracts the data bytes of eleven fields, each with a constant shift.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "each shift brings a field's data bits to bits 0..=7")]
pub(crate) const fn unpack(line: u128) -> [u8; Frame::MAX_FIELDS] {
    let [a, b, c, d] = groups(line);
    [
        (a >> 1) as u8,
        (a >> 11) as u8,
        (a >> 21) as u8,
        (b >> 1) as u8,
        (b >> 11) as u8,
        (b >> 21) as u8,
        (c >> 1) as u8,
        (c >> 11) as u8,
        (c >> 21) as u8,
        (d >> 1) as u8,
        (d >> 11) as u8,
    ]
}

/// The line bits of eleven fields.
pub(crate) const fn pack(b: &[u8; Frame::MAX_FIELDS]) -> u128 {
    let [b0, b1, b2, b3, b4, b5, b6, b7, b8, b9, b10] = *b;
    DELIMITER
        | (b0 as u128) << 1
        | (b1 as u128) << 11
        | (b2 as u128) << 21
        | (b3 as u128) << 31
        | (b4 as u128) << 41
        | (b5 as u128) << 51
        | (b6 as u128) << 61
        | (b7 as u128) << 71
        | (b8 as u128) << 81
        | (b9 as u128) << 91
        | (b10 as u128) << 101
}

/// The line bits in 14 bytes as one integer, first bit in bit 0.
#[inline(always)]
pub(crate) fn load(bytes: &[u8; Frame::MAX_LINE_BYTES], order: BitOrder) -> u128 {
    let mut word = [0; 16];
    if let Some(head) = word.first_chunk_mut() {
        *head = *bytes;
    }
    match order {
        BitOrder::LsbFirst => u128::from_le_bytes(word),
        BitOrder::MsbFirst => u128::from_be_bytes(word).reverse_bits(),
    }
}

/// The number of fields, as used in an error.
pub(crate) fn count(bytes: &[u8]) -> u16 {
    u16::try_from(bytes.len()).unwrap_or(u16::MAX)
}

/// Names the first framing fault in a line that should hold `fields` fields; kept off the hot path.
#[cold]
pub(crate) fn framing(line: Window, fields: u8) -> Error {
    for field in 0..fields {
        let at = u32::from(field).wrapping_mul(Frame::FIELD_BITS);
        match (line.get(at), line.get(at.wrapping_add(9))) {
            (Some(true), _) => return Error::StartBit { field },
            (_, Some(false)) => return Error::Delimiter { field },
            (_, None) => return Error::Truncated { got: field.into(), want: fields.into() },
            _ => {}
        }
    }
    // Never: the caller saw a fault.
    Error::Truncated { got: fields.into(), want: fields.into() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    /// Line bits of a frame, field by field and bit by bit.
    fn slow_line(bytes: &[u8]) -> u128 {
        let mut line = 0;
        for (k, byte) in bytes.iter().enumerate() {
            for bit in 0..8 {
                line |= u128::from(byte >> bit & 1) << (10 * k + 1 + bit);
            }
            line |= 1 << (10 * k + 9);
        }
        line
    }

    proptest! {
        #[test]
        fn line_and_back(bytes in prop::collection::vec(any::<u8>(), 1..=11)) {
            let frame = Frame::new(&bytes).unwrap();
            prop_assert_eq!(frame.line().bits(), slow_line(&bytes));
            prop_assert_eq!(frame.line().len() as usize, bytes.len() * 10);
            prop_assert_eq!(Frame::from_line(frame.line(), frame.fields()), Ok(frame));
        }

        /// The test of all groups at once against the fields one by one, on sound frames with up to three wrong bits.
        #[test]
        fn groups_find_what_the_fields_show(data: [u8; 10], above: u8, flips in prop::collection::vec(0..110u32, 0..4)) {
            let mut bytes = [0; 11];
            bytes[..10].copy_from_slice(&data);
            bytes[10] = crate::crc(&data);
            let line = flips.iter().fold(slow_line(&bytes) | u128::from(above) << 110, |line, bit| line ^ 1 << bit);
            let window = Window::from_bits(line, 110).unwrap();
            let by_field = Frame::from_line(window, 11).is_ok_and(|frame| crate::crc(frame.as_bytes()) == 0);
            prop_assert_eq!(faults11(line) == 0, by_field);
            for (fields, found) in [(6, faults6(line)), (4, faults4(line))] {
                let by_field = Frame::from_line(window, fields).is_ok_and(|frame| crate::crc(frame.as_bytes()) == 0);
                prop_assert_eq!(found == 0, by_field);
            }
        }

        /// Every framing bit of every field, flipped alone, is named; every length short of the frame is told.
        #[test]
        fn framing_faults_are_named(bytes in prop::collection::vec(any::<u8>(), 1..=11)) {
            let frame = Frame::new(&bytes).unwrap();
            let (line, len) = (frame.line().bits(), frame.line_bits());
            for field in 0..frame.fields() {
                for (bit, want) in [(0, Error::StartBit { field }), (9, Error::Delimiter { field })] {
                    let bad = Window::from_bits(line ^ 1 << (u32::from(field) * 10 + bit), len).unwrap();
                    prop_assert_eq!(Frame::from_line(bad, frame.fields()), Err(want));
                }
            }
            for short in 0..len {
                let cut = Window::from_bits(line, short).unwrap();
                let want = Error::Truncated { got: (short / 10) as u16, want: frame.fields().into() };
                prop_assert_eq!(Frame::from_line(cut, frame.fields()), Err(want));
            }
        }
    }

    #[test]
    fn sizes() {
        assert_eq!((Frame::new(&[]), Frame::new(&[0; 12])), (None, None));
        assert_eq!(Frame::new(&[7; 11]).unwrap().as_bytes(), [7; 11]);
        assert_eq!(Frame::new(&[0x1a, 0, 0xc8]).unwrap().to_string(), "1A 00 C8");
    }
}
