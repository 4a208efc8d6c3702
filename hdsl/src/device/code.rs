//! The encoder's own 8b/10b code and its own reading of the master's head, written from the printed tables; nothing is shared
//! with the receiver.

use nrz_line::Window;

/// `abcdei` of D.0 to D.31, column RD-, as printed.
const SIX: [&[u8; 6]; 32] = [
    b"100111", b"011101", b"101101", b"110001", b"110101", b"101001", b"011001", b"111000", b"111001", b"100101",
    b"010101", b"110100", b"001101", b"101100", b"011100", b"010111", b"011011", b"100011", b"010011", b"110010",
    b"001011", b"101010", b"011010", b"111010", b"110011", b"100110", b"010110", b"110110", b"001110", b"101110",
    b"011110", b"101011",
];
/// `fghj` of D.x.0 to D.x.7 and of D.x.A7, column RD-.
const FOUR: [&[u8; 4]; 9] = [b"1011", b"1001", b"0101", b"1100", b"1101", b"1010", b"0110", b"1110", b"0111"];
/// `fghj` of K.28.0 to K.28.7, column RD-; column RD+ has their inverses.
const FOUR_K28: [&[u8; 4]; 8] = [b"1011", b"0110", b"1010", b"1100", b"1101", b"0101", b"1001", b"0111"];

/// A byte to send; `special` marks a K character.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Symbol {
    pub(super) byte: u8,
    pub(super) special: bool,
}

impl Symbol {
    pub(super) const fn data(byte: u8) -> Self {
        Self { byte, special: false }
    }

    pub(super) const fn special(byte: u8) -> Self {
        Self { byte, special: true }
    }
}

/// Line bits as they are assembled, the first in bit 0, and the running disparity: true for RD+.
#[derive(Clone, Copy)]
struct Writer {
    bits: u64,
    len: u32,
    plus: bool,
}

impl Writer {
    fn bit(&mut self, one: bool) {
        self.bits |= u64::from(one) << self.len;
        self.len = self.len.saturating_add(1);
    }

    /// Appends a block, given as printed for RD-. Unbalanced blocks are inverted for RD+ and change the running disparity; some
    /// balanced ones are inverted too.
    fn block(&mut self, printed: &[u8], inverted_when_balanced: bool) {
        let balanced = is_balanced(printed);
        let invert = self.plus && (!balanced || inverted_when_balanced);
        for bit in printed {
            self.bit((*bit == b'1') != invert);
        }
        self.plus = self.plus == balanced;
    }

    fn symbol(&mut self, Symbol { byte, special }: Symbol) {
        let (x, y) = (byte & 31, byte >> 5);
        let k28 = special && x == 28;
        let six = if k28 { b"001111" } else { SIX.get(usize::from(x)).copied().unwrap_or(b"000000") };
        self.block(six, x == 7);
        let alternate = match (special, self.plus) {
            (true, _) => true,
            (false, false) => [17, 18, 20].contains(&x),
            (false, true) => [11, 13, 14].contains(&x),
        };
        let four = match y {
            _ if k28 => FOUR_K28.get(usize::from(y)),
            7 if alternate => FOUR.get(8),
            _ => FOUR.get(usize::from(y)),
        };
        self.block(four.copied().unwrap_or(b"0000"), k28 || y == 3);
    }
}

/// Returns whether there are as many ones as zeros.
fn is_balanced(printed: &[u8]) -> bool {
    printed.iter().map(|bit| if *bit == b'1' { 1 } else { -1_i32 }).sum::<i32>() == 0
}

/// Returns the 61 bits of an answer and the running disparity after it. The switch bit after the fifth word is the inverse of
/// the bit before it and is not counted.
pub(super) fn answer(symbols: [Symbol; 6], plus: bool) -> (u64, bool) {
    let mut writer = Writer { bits: 0, len: 0, plus };
    for (at, symbol) in (0_u8..).zip(symbols) {
        if at == 5 {
            let last = writer.bits >> 49 & 1 == 1;
            writer.bit(!last);
        }
        writer.symbol(symbol);
    }
    (writer.bits, writer.plus)
}

/// Decodes the parameter byte of a head: SYNC 001011, SAMPLE 11, up to nine further ones and a zero, CYCLE RESET 110, four
/// meaningless bits, ten bits of PARA with either polarity of each block. `None` if it cannot be read.
pub(super) fn parameter(head: Window) -> Option<u8> {
    let mut bits = (0..head.len()).map_while(|at| head.get(at));
    for printed in *b"00101111" {
        if bits.next()? != (printed == b'1') {
            return None;
        }
    }
    let mut more = 0_u8;
    while bits.next()? {
        more = more.saturating_add(1);
        if more > 9 {
            return None;
        }
    }
    for printed in *b"110" {
        if bits.next()? != (printed == b'1') {
            return None;
        }
    }
    for _ in 0..4 {
        bits.next()?;
    }
    let mut block = [false; 10];
    for place in &mut block {
        *place = bits.next()?;
    }
    let (six, four) = block.split_at_checked(6)?;
    let is = |block: &[bool], printed: &[u8]| {
        let equal =
            |invert: bool| block.iter().zip(printed).all(|(bit, printed)| *bit == ((*printed == b'1') != invert));
        equal(false) || equal(true) && (!is_balanced(printed) || matches!(printed, b"111000" | b"1100"))
    };
    let x = if is(six, b"001111") { 28 } else { SIX.iter().position(|printed| is(six, *printed))? };
    // A7 stands for 7.
    let y = FOUR.iter().position(|printed| is(four, *printed))?.min(7);
    u8::try_from(y << 5 | x).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::emit;
    use crate::frame::{Extra, Head};
    use crate::line_code::LineDisparity;
    use crate::parameter::ParameterByte;
    use crate::symbol::{Character, Control, RunningDisparity};

    /// Words printed in the documents.
    #[test]
    fn printed_words() {
        let text = |symbol, plus| {
            let mut writer = Writer { bits: 0, len: 0, plus };
            writer.symbol(symbol);
            (0..10).map(|at| if writer.bits >> at & 1 == 1 { '1' } else { '0' }).collect::<std::string::String>()
        };
        assert_eq!(text(Symbol::special(0xbc), false), "0011111010");
        assert_eq!(text(Symbol::special(0xbc), true), "1100000101");
        assert_eq!(text(Symbol::data(0x00), false), "1001110100");
        assert_eq!(text(Symbol::data(0x10), false), "0110110100");
        assert_eq!(text(Symbol::special(0xfe), false), "0111101000");
    }

    /// Both ends have written down the same code.
    #[test]
    fn the_receivers_tables_say_the_same() {
        let both = (0..=255).map(Symbol::data).chain(Control::ALL.map(|control| Symbol::special(control as u8)));
        for symbol in both {
            for plus in [false, true] {
                let rd = if plus { RunningDisparity::Plus } else { RunningDisparity::Minus };
                let character = Character::new(symbol.byte, symbol.special).unwrap();
                let (bits, after) = answer([symbol; 6], plus);
                assert_eq!((bits, after), {
                    let coded = emit([character; 6], rd);
                    let (bits, rd) = (coded.bits, coded.disparity);
                    (bits, rd == RunningDisparity::Plus)
                });
            }
        }
    }

    #[test]
    fn every_head_is_read_and_a_wrong_one_is_not() {
        for raw in (0..=255).step_by(crate::thin(51)) {
            for edge in (23..=72).step_by(crate::thin(11)) {
                for d in [-4, -1, 0, 3] {
                    let head = Head::new(ParameterByte::new(raw), Extra::new(edge), LineDisparity::new(d));
                    assert_eq!(parameter(head.bits()), Some(raw));
                }
            }
        }
        let head = Head::new(ParameterByte::new(0xd0), None, LineDisparity::ZERO);
        let good = head.bits();
        for len in 0..26 {
            assert_eq!(parameter(Window::from_bits(good.bits(), len).unwrap()), None);
        }
        for at in (0..6).chain(9..12) {
            assert_eq!(parameter(Window::from_bits(good.bits() ^ 1 << at, 26).unwrap()), None, "{at}");
        }
    }
}
