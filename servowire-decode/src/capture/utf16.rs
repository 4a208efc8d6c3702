//! Text as Windows shells redirect it: UTF-16 after a byte order mark, read as UTF-8.

use std::io::{self, Read};

/// Bytes read at once.
const BLOCK: usize = 1 << 14;

/// Returns whether text with two bytes per character begins here, and which byte comes first.
pub(super) fn mark(head: &[u8]) -> Option<fn([u8; 2]) -> u16> {
    match head {
        [0xff, 0xfe, ..] => Some(u16::from_le_bytes),
        [0xfe, 0xff, ..] => Some(u16::from_be_bytes),
        _ => None,
    }
}

/// Reads this text as UTF-8. The byte order mark is kept; half a character becomes the replacement character.
pub(super) struct Utf16<R> {
    text: R,
    unit: fn([u8; 2]) -> u16,
    /// Bytes of an incomplete character.
    kept: Vec<u8>,
    out: Vec<u8>,
    taken: usize,
}

impl<R: Read> Utf16<R> {
    pub(super) fn new(text: R, unit: fn([u8; 2]) -> u16) -> Self {
        Self { text, unit, kept: Vec::new(), out: Vec::new(), taken: 0 }
    }

    /// Converts the next bytes; returns whether there were any.
    fn turn(&mut self) -> io::Result<bool> {
        let from = self.kept.len();
        self.kept.resize(from + BLOCK, 0);
        let got = self.text.read(self.kept.get_mut(from..).unwrap_or_default());
        self.kept.truncate(from + got.as_ref().copied().unwrap_or(0));
        let ended = got? == 0;
        let mut whole = self.kept.len() / 2 * 2;
        let unit = |pair: &[u8]| if let [a, b] = *pair { (self.unit)([a, b]) } else { 0 };
        // The first half of a pair waits for the second.
        let last = self.kept.get(whole.saturating_sub(2)..whole).unwrap_or_default();
        if !ended && (0xd800..0xdc00).contains(&unit(last)) {
            whole -= 2;
        }
        let units = self.kept.get(..whole).unwrap_or_default().chunks_exact(2).map(unit);
        let letters = char::decode_utf16(units).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER));
        self.out = letters.collect::<String>().into_bytes();
        self.taken = 0;
        self.kept.drain(..whole);
        Ok(!ended)
    }
}

impl<R: Read> Read for Utf16<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.out.len() {
            if !self.turn()? && self.out.is_empty() {
                return Ok(0);
            }
        }
        let mut rest = self.out.get(self.taken..).unwrap_or_default();
        let n = rest.read(buffer)?;
        self.taken += n;
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gives this many bytes at a time.
    struct Slow<'a>(&'a [u8], usize);

    impl Read for Slow<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let n = self.1.min(buffer.len());
            self.0.read(&mut buffer[..n])
        }
    }

    #[test]
    fn both_byte_orders_in_pieces_of_any_length() {
        // U+1F40C, a snail, is a pair: D83D DC0C.
        let units = [0xfeff_u16, 0x31, 0x41, 0xe4, 0x20ac, 0xd83d, 0xdc0c, 0x0a];
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for length in 1..=16 {
            for text in [&little, &big] {
                let mut out = String::new();
                Utf16::new(Slow(text, length), mark(text).unwrap()).read_to_string(&mut out).unwrap();
                assert_eq!(out, "\u{feff}1A\u{e4}\u{20ac}\u{1f40c}\n", "{length}");
            }
        }
    }

    #[test]
    fn halves_and_odd_ends() {
        let text = [0xff, 0xfe, 0x3d, 0xd8, 0x31, 0x00, 0x3d, 0xd8, 0x00];
        let mut out = String::new();
        Utf16::new(text.as_slice(), u16::from_le_bytes).read_to_string(&mut out).unwrap();
        assert_eq!(out, "\u{feff}\u{fffd}1\u{fffd}");
        assert!(mark(b"\xef\xbb\xbf").is_none() && mark(b"").is_none());
    }
}
