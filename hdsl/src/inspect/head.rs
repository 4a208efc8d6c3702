//! Heads of H-frames on a line that was read bit by bit.

use nrz_line::Window;

use crate::error::Error;
use crate::frame::{Head, ParsedHead, STUFFING_BITS};
use crate::line_code::LineDisparity;

/// SYNC and the two ones of SAMPLE, the first bit in bit 0.
const PATTERN: u128 = 0b1111_0100;
/// A block of stuffing, the first bit in bit 0: 0 0 1 0 1 1.
const STUFFING: u128 = 0b11_0100;
/// SYNC, SAMPLE and CYCLE RESET: 0 0 1 0 1 1, 1 1 0, 1 1 0.
const WHOLE: u128 = 0b0110_1111_0100;
/// Number of bits of TRAILER and of the longest stuffing before a head that [`ends_with_trailer`] looks at.
pub const FRONT_BITS: u32 = 120;

/// A head on a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FoundHead {
    /// What an encoder reads from it.
    pub head: ParsedHead,
    /// Number of bits that it takes on this line.
    pub len: u32,
}

/// Returns the head at the start of the line, if there is one. The partly high last bit of an EXTRA window may have been rounded
/// up, which makes the head one bit longer.
pub fn find_head(line: Window) -> Option<FoundHead> {
    let raw = line.bits();
    if raw & 0xff != PATTERN {
        return None;
    }
    if let Ok(head) = Head::parse(line) {
        return Some(FoundHead { head, len: head.len });
    }
    let ones = (raw >> 8).trailing_ones();
    if !(3..=10).contains(&ones) || (raw >> ones.wrapping_add(8)).trailing_zeros() != 2 {
        return None;
    }
    let low = raw & !(u128::MAX << ones.wrapping_add(8));
    let rest = raw >> ones.wrapping_add(9) << ones.wrapping_add(8);
    let shorter = Window::from_bits(low | rest, line.len().checked_sub(1)?)?;
    let head = Head::parse(shorter).ok()?;
    Some(FoundHead { head, len: head.len.wrapping_add(1) })
}

/// The fault found where the head of a frame was expected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum HeadDamage {
    /// SYNC, SAMPLE and CYCLE RESET are correct, but the word of the parameter byte is in no table.
    Parameter,
    /// One of the twelve fixed bits is wrong.
    OneBit,
    /// Two of the twelve fixed bits are wrong.
    TwoBits,
    /// No head.
    Missing,
}

servowire_core::one_line!(HeadDamage {
    Self::Parameter => "the parameter word of the head is in no table";
    Self::OneBit => "a bit of the frame's head is wrong";
    Self::TwoBits => "two bits of the frame's head are wrong";
    Self::Missing => "a frame is missing";
});

impl HeadDamage {
    /// The class of the check, for statistics.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Parameter => "invalid_word",
            Self::OneBit | Self::TwoBits => "head",
            Self::Missing => "missing",
        }
    }
}

/// Examines the place where the head of a frame was expected: `line` begins three bits before it, and the head may be up to
/// three bits off in either direction.
pub fn head_damage(line: Window) -> HeadDamage {
    let wrong = |at: u32| ((line.bits() >> at & 0xfff) ^ WHOLE).count_ones();
    match (0..=6).map(wrong).min() {
        Some(0) => HeadDamage::Parameter,
        Some(1) => HeadDamage::OneBit,
        Some(2) => HeadDamage::TwoBits,
        _ => HeadDamage::Missing,
    }
}

/// The faults of a head on its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum HeadFault {
    /// The symbol has no meaning.
    UndefinedSymbol {
        /// Bits 4:0 of the parameter byte.
        symbol: u8,
    },
    /// Bit 5 of the parameter byte is reserved, and it is 1.
    Reserved,
}

servowire_core::one_line!(HeadFault {
    Self::UndefinedSymbol { symbol } => "{}", Error::UndefinedSymbol { symbol: *symbol };
    Self::Reserved => "bit 5 of the parameter byte is 1, and it is reserved";
});

/// Returns what is wrong with the parameter byte of a head, if anything.
pub(crate) const fn head_fault(head: ParsedHead) -> Option<HeadFault> {
    match head.byte.symbol() {
        Err(_) => Some(HeadFault::UndefinedSymbol { symbol: head.byte.raw() & 31 }),
        Ok(_) if head.byte.raw() & 0x20 != 0 => Some(HeadFault::Reserved),
        Ok(_) => None,
    }
}

/// Returns whether EQUALISATION and PARA, the last 14 bits of a head, are coded as for a balanced line. This is so for every
/// head without an EXTRA window that follows an answered frame.
pub(crate) fn is_coded_for_balance(head: ParsedHead, line: Window) -> bool {
    let due = Head::new(head.byte, None, LineDisparity::ZERO);
    let coded = line.bits() >> head.len.saturating_sub(14) & 0x3fff;
    coded == u128::from(due.equalisation()) | u128::from(due.para().get()) << 4
}

/// Returns whether the line before a head ends with TRAILER as a master drives it, 000011, followed by stuffing blocks.
/// `front` holds at most [`FRONT_BITS`] bits, the last of which is just before the head; if all of them are stuffing, this
/// counts as good.
pub fn ends_with_trailer(front: Window) -> bool {
    // The first bit in bit 0.
    const TRAILER: u128 = 0b11_0000;
    let blocks =
        (1..=front.len() / 6).map(|back| front.bits() >> front.len().saturating_sub(6_u32.wrapping_mul(back)) & 0x3f);
    let last = blocks.into_iter().find(|block| *block != STUFFING);
    last.is_none_or(|block| block == TRAILER)
}

/// Returns whether the last six bits are a block of stuffing, 001011.
pub fn ends_with_stuffing(front: Window) -> bool {
    front.len() >= STUFFING_BITS && front.bits() >> front.len().saturating_sub(STUFFING_BITS) == STUFFING
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Extra;
    use crate::parameter::ParameterByte;

    fn line(text: &str) -> Window {
        let text: std::string::String = text.split_whitespace().collect();
        let bits = text.bytes().rev().fold(0, |bits, bit| bits << 1 | u128::from(bit == b'1'));
        Window::from_bits(bits, text.len() as u32).unwrap()
    }

    /// IDLE with FIRST and MSYNC, as printed; the last bit of the window is partly high and was read as 0, or as 1 and again.
    #[test]
    fn heads_are_found_on_the_grid_and_beside_it() {
        let free = find_head(line("001011 110 110 0000 1001000110 1111")).unwrap();
        assert_eq!((free.head.byte.raw(), free.head.extra_bits, free.len), (0xd0, 0, 26));
        let window = find_head(line("001011 11 1111 0 110 0000 1001000110 1111")).unwrap();
        assert_eq!((window.head.byte.raw(), window.head.extra_bits, window.len), (0xd0, 4, 30));
        let rounded = find_head(line("001011 11 1111 00 110 0000 1001000110 1111")).unwrap();
        assert_eq!((rounded.head.byte.raw(), rounded.head.extra_bits, rounded.len), (0xd0, 4, 31));
        assert_eq!(find_head(line("001011 11 11 00 110 0000 1001000110 1111")), None);
        assert_eq!(find_head(line("001011 10 110 110 0000 1001000110")), None);
        assert_eq!(find_head(Window::EMPTY), None);
    }

    #[test]
    fn damage_is_told_by_the_wrong_bits() {
        for (text, want) in [
            ("111 001011110110 1111111111", HeadDamage::Parameter),
            ("001011110110 111 1111111111", HeadDamage::Parameter),
            ("111 101011110110 1111111111", HeadDamage::OneBit),
            ("111 101011010110 1111111111", HeadDamage::TwoBits),
            ("111 111111111111 1111111111", HeadDamage::Missing),
        ] {
            assert_eq!(head_damage(line(text)), want, "{text}");
        }
    }

    #[test]
    fn classes_of_damage() {
        let all = [HeadDamage::Parameter, HeadDamage::OneBit, HeadDamage::TwoBits, HeadDamage::Missing];
        assert_eq!(all.map(HeadDamage::name), ["invalid_word", "head", "head", "missing"]);
    }

    #[test]
    fn a_parameter_byte_by_itself() {
        let fault = |raw| head_fault(ParsedHead { byte: ParameterByte::new(raw), extra_bits: 0, len: 26 });
        assert_eq!((fault(0xd0), fault(0xf0)), (None, Some(HeadFault::Reserved)));
        assert_eq!(fault(0x12), Some(HeadFault::UndefinedSymbol { symbol: 0x12 }));
    }

    #[test]
    fn heads_for_a_balanced_line() {
        let balanced = |text: &str| {
            let line = line(text);
            is_coded_for_balance(find_head(line).unwrap().head, line)
        };
        assert!(balanced("001011 110 110 0000 1001000110"));
        // The first bit of EQUALISATION; the inverse of the six-bit block for a line that has too many zeros.
        assert!(!balanced("001011 110 110 1000 1001000110"));
        assert!(!balanced("001011 110 110 0000 0110110110"));
        let window = Head::new(ParameterByte::new(0xd0), Extra::new(40), LineDisparity::ZERO).bits();
        assert!(is_coded_for_balance(find_head(window).unwrap().head, window));
    }

    #[test]
    fn trailers_in_front_of_a_head() {
        assert!(ends_with_stuffing(line("000011 001011")) && !ends_with_stuffing(line("001011 000011")));
        assert!(ends_with_stuffing(line("001011")) && !ends_with_stuffing(line("01011")));
        // What is left over in front of whole blocks says nothing.
        assert!(ends_with_trailer(line("01 001011 001011 001011")));
        assert!(ends_with_trailer(line("010101 000011")));
        assert!(ends_with_trailer(line("010101 000011 001011 001011")));
        assert!(ends_with_trailer(line("001011 001011")));
        assert!(!ends_with_trailer(line("010101 000111")));
        assert!(!ends_with_trailer(line("010101 000011 001010 001011")));
    }
}
