//! The tables of the 8b/10b code, and the look-up tables generated from them.
//!
//! The literals are written as the tables are printed, with `a` (or `f`) on the left; [`line`] turns them into line
//! order with the first bit in bit 0. Encoding and decoding are then plain look-ups without any bit reversal.
#![expect(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    reason = "all but one function run at compile time, where a slip is a compiler error; that one masks its indices"
)]

use super::{Entry, Word};

/// `abcdei` of D.0..D.31, column RD-.
const SIX: [u16; 32] = [
    0b10_0111, 0b01_1101, 0b10_1101, 0b11_0001, 0b11_0101, 0b10_1001, 0b01_1001, 0b11_1000, // 0..=7
    0b11_1001, 0b10_0101, 0b01_0101, 0b11_0100, 0b00_1101, 0b10_1100, 0b01_1100, 0b01_0111, // 8..=15
    0b01_1011, 0b10_0011, 0b01_0011, 0b11_0010, 0b00_1011, 0b10_1010, 0b01_1010, 0b11_1010, // 16..=23
    0b11_0011, 0b10_0110, 0b01_0110, 0b11_0110, 0b00_1110, 0b10_1110, 0b01_1110, 0b10_1011, // 24..=31
];
/// `abcdei` of K.28, column RD-.
const SIX_K28: u16 = 0b00_1111;
/// `fghj` of D.x.0..D.x.7, column RD-.
const FOUR: [u16; 8] = [0b1011, 0b1001, 0b0101, 0b1100, 0b1101, 0b1010, 0b0110, 0b1110];
/// `fghj` of D.x.A7, column RD-.
const FOUR_A7: u16 = 0b0111;
/// `fghj` of K.28.0..K.28.7, column RD-.
const FOUR_K28: [u16; 8] = [0b1011, 0b0110, 0b1010, 0b1100, 0b1101, 0b0101, 0b1001, 0b0111];

/// The twelve special characters.
pub(super) const CONTROLS: [u8; 12] = [0x1c, 0x3c, 0x5c, 0x7c, 0x9c, 0xbc, 0xdc, 0xfc, 0xf7, 0xfb, 0xfd, 0xfe];

/// Converts `len` printed bits to line order: the leftmost becomes bit 0.
const fn line(printed: u16, len: u32) -> u16 {
    printed.reverse_bits() >> (16 - len)
}

/// Converts a printed 6-bit and 4-bit block to line order.
const fn word(six: u16, four: u16) -> u16 {
    line(six, 6) | line(four, 4) << 6
}

/// Returns the word for a character in a column; `plus` selects the column RD+.
const fn encode(byte: u8, k: bool, plus: bool) -> u16 {
    let x = (byte & 31) as usize;
    let y = (byte >> 5) as usize;
    let mut six = if k && x == 28 { SIX_K28 } else { SIX[x] };
    let neutral = six.count_ones() == 3;
    if plus && (!neutral || x == 7) {
        six ^= 0b11_1111;
    }
    let plus = plus ^ !neutral;
    let alternate = y == 7 && (k || if plus { matches!(x, 11 | 13 | 14) } else { matches!(x, 17 | 18 | 20) });
    let mut four = if k && x == 28 {
        FOUR_K28[y]
    } else if alternate {
        FOUR_A7
    } else {
        FOUR[y]
    };
    if plus && (k || y == 3 || four.count_ones() != 2) {
        four ^= 0b1111;
    }
    word(six, four)
}

/// Words of the 256 data characters, columns RD- and RD+.
pub(super) static DATA: [[u16; 256]; 2] = {
    let mut table = [[0; 256]; 2];
    let mut byte: usize = 0;
    while byte < 256 {
        table[0][byte] = encode(byte as u8, false, false);
        table[1][byte] = encode(byte as u8, false, true);
        byte += 1;
    }
    table
};

/// Words of the twelve special characters in the order of [`CONTROLS`], columns RD- and RD+.
pub(super) static CONTROL: [[u16; 12]; 2] = {
    let mut table = [[0; 12]; 2];
    let mut k = 0;
    while k < 12 {
        table[0][k] = encode(CONTROLS[k], true, false);
        table[1][k] = encode(CONTROLS[k], true, true);
        k += 1;
    }
    table
};

/// The word stands for a special character.
pub(super) const SPECIAL: u16 = 1 << 8;
/// The word is in neither column.
pub(super) const INVALID: u16 = 1 << 9;
/// The word is in column RD-.
pub(super) const MINUS: u16 = 1 << 10;
/// The word is in column RD+.
pub(super) const PLUS: u16 = 1 << 11;

/// The meaning of each of the 1024 words under a rule.
pub(crate) struct Table([u16; 1024]);

impl Table {
    #[inline]
    pub(crate) const fn entry(&self, word: Word) -> Entry {
        Entry(self.0[(word.get() & 0x3ff) as usize])
    }
}

/// The meaning of each word by the tables of the code: value in bits 7:0, flags above. Words in neither column
/// carry the value of the two sub-block look-ups.
pub(super) static DECODE: Table = {
    let mut table = [0; 1024];
    let mut word = 0;
    while word < 1024 {
        table[word] = INVALID | sub_blocks(word as u16) as u16;
        word += 1;
    }
    let mut column = 0;
    while column < 2 {
        let flag = if column == 0 { MINUS } else { PLUS };
        let mut byte: u16 = 0;
        while byte < 256 {
            let at = encode(byte as u8, false, column == 1) as usize;
            table[at] = table[at] & (MINUS | PLUS) | flag | byte;
            byte += 1;
        }
        let mut k = 0;
        while k < 12 {
            let at = encode(CONTROLS[k], true, column == 1) as usize;
            table[at] = table[at] & (MINUS | PLUS) | flag | SPECIAL | CONTROLS[k] as u16;
            k += 1;
        }
        column += 1;
    }
    Table(table)
};

/// Maps the 6-bit block in line order to x; FFh if no column has it.
pub(super) static SIX_TO_X: [u8; 64] = {
    let mut table = [0xff; 64];
    let mut x = 0;
    while x < 32 {
        let block = line(SIX[x], 6) as usize;
        table[block] = x as u8;
        if SIX[x].count_ones() != 3 || x == 7 {
            table[block ^ 0b11_1111] = x as u8;
        }
        x += 1;
    }
    table[line(SIX_K28, 6) as usize] = 28;
    table[line(SIX_K28, 6) as usize ^ 0b11_1111] = 28;
    table
};

/// Maps the 4-bit block of a data character in line order to y; FFh if no column has it.
pub(super) static FOUR_TO_Y: [u8; 16] = {
    let mut table = [0xff; 16];
    let mut y = 0;
    while y < 8 {
        let block = line(FOUR[y], 4) as usize;
        table[block] = y as u8;
        if FOUR[y].count_ones() != 2 || y == 3 {
            table[block ^ 0b1111] = y as u8;
        }
        y += 1;
    }
    table[line(FOUR_A7, 4) as usize] = 7;
    table[line(FOUR_A7, 4) as usize ^ 0b1111] = 7;
    table
};

/// Returns the value of the two sub-block look-ups without regard to disparity; FFh if either fails.
pub(super) const fn sub_blocks(word: u16) -> u8 {
    let (x, y) = (SIX_TO_X[(word & 63) as usize], FOUR_TO_Y[(word >> 6 & 15) as usize]);
    if x == 0xff || y == 0xff { 0xff } else { y << 5 | x }
}

/// Marks a block with equally many ones and zeros.
pub(crate) const NEUTRAL: u8 = 0x80;

/// 6-bit blocks for the line disparity code in line order: x = 0..=31, the version with more zeros, or [`NEUTRAL`].
pub(crate) static SIX_MORE_ZEROS: [u8; 32] = {
    let mut table = [0; 32];
    let mut x = 0;
    while x < 32 {
        let block = if x == 28 { SIX_K28 } else { SIX[x] };
        let invert = block.count_ones() > 3 || x == 7;
        let neutral = if block.count_ones() == 3 { NEUTRAL } else { 0 };
        table[x] = line(if invert { block ^ 0b11_1111 } else { block }, 6) as u8 | neutral;
        x += 1;
    }
    table
};

/// 4-bit blocks for the line disparity code in line order: y = 0..=7, the version with more zeros, or [`NEUTRAL`].
pub(crate) static FOUR_MORE_ZEROS: [u8; 8] = {
    let mut table = [0; 8];
    let mut y = 0;
    while y < 8 {
        let invert = FOUR[y].count_ones() > 2 || y == 3;
        let neutral = if FOUR[y].count_ones() == 2 { NEUTRAL } else { 0 };
        table[y] = line(if invert { FOUR[y] ^ 0b1111 } else { FOUR[y] }, 4) as u8 | neutral;
        y += 1;
    }
    table
};

/// All words by the reduced rule: value, [`INVALID`] and [`SPECIAL`].
pub(super) static REDUCED: Table = {
    let mut table = [0; 1024];
    let mut bits: u16 = 0;
    while bits < 1024 {
        let run_abcd = matches!(bits & 0b1111, 0 | 0b1111);
        // e i f g h are bits 4..=8.
        let run_eifgh = matches!(bits >> 4 & 0b1_1111, 0 | 0b1_1111);
        let run_cdei = matches!(bits >> 2 & 0b1111, 0 | 0b1111);
        // e in bit 4, i g h j in bits 5, 7, 8, 9.
        let eighj = bits & 0b11_1011_0000;
        let special = run_cdei || eighj == 0b11_1010_0000 || eighj == 0b00_0001_0000;
        let mut entry = sub_blocks(bits) as u16;
        if run_abcd || run_eifgh {
            entry |= INVALID;
        }
        if special {
            entry |= SPECIAL;
        }
        table[bits as usize] = entry;
        bits += 1;
    }
    Table(table)
};
