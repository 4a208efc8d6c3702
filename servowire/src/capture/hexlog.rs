//! Bytes as hex digits, as a serial monitor or a debugger prints them: a burst a line.
//!
//! `1A 20 29 C0`, `1a2029c0`, `0x1A, 0x20` and `1A:20` are all read; what follows `#` or `//` is a remark.
//! There is no time in such a log, and a line of it is what followed without a pause.

use std::io::{BufRead, Read};

use super::Input;
use crate::fault::{At, Fault};

/// The longest line that is read; longer ones are not a log of a servo line.
const LONGEST: usize = 1 << 16;

/// A log of bytes.
pub struct HexLog {
    input: Input,
    text: Vec<u8>,
    line: u64,
    /// A line of bytes was read: this is a log.
    good: bool,
}

/// The bytes of one line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Burst {
    /// Its number, from 1.
    pub line: u64,
    /// What it holds; at least one byte, unless it is spoilt.
    pub bytes: Vec<u8>,
    /// Why the line is not bytes.
    pub spoilt: Option<String>,
}

impl HexLog {
    /// A log from its beginning.
    pub fn new(input: Input) -> Self {
        Self { input, text: Vec::new(), line: 0, good: false }
    }

    /// The file that is read.
    pub(super) fn input(&self) -> &Input {
        &self.input
    }

    /// The next line that holds bytes, or should; none at the end.
    pub fn burst(&mut self) -> Result<Option<Burst>, Fault> {
        loop {
            self.text.clear();
            self.line += 1;
            let at = At::Line(self.line);
            let mut limited = self.input.by_ref().take(LONGEST as u64);
            let got = limited.read_until(b'\n', &mut self.text).map_err(|e| self.input.io_fault(at, &e))?;
            if got == 0 {
                return Ok(None);
            }
            if got == LONGEST {
                return Err(self
                    .input
                    .fault(at, format!("a line of more than {LONGEST} characters: not a log of hex bytes")));
            }
            match parse(&self.text) {
                Ok(bytes) if bytes.is_empty() => {}
                Ok(bytes) => {
                    self.good = true;
                    return Ok(Some(Burst { line: self.line, bytes, spoilt: None }));
                }
                // In a log a wrong digit costs its line; a file without any bytes before it is no log.
                Err(what) if self.good => {
                    return Ok(Some(Burst { line: self.line, bytes: Vec::new(), spoilt: Some(what) }));
                }
                Err(what) => return Err(self.input.fault(at, what)),
            }
        }
    }
}

fn parse(text: &[u8]) -> Result<Vec<u8>, String> {
    let text = String::from_utf8_lossy(text);
    let text = text.trim_start_matches('\u{feff}');
    let text = text.split('#').next().unwrap_or_default();
    let text = text.split("//").next().unwrap_or_default();
    let mut bytes = Vec::new();
    let separator = |c: char| c.is_whitespace() || matches!(c, ',' | ';' | ':' | '-' | '[' | ']');
    for word in text.split(separator).filter(|word| !word.is_empty()) {
        let digits = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")).unwrap_or(word);
        if digits.is_empty() || digits.len() % 2 != 0 || !digits.bytes().all(|b| b.is_ascii_hexdigit()) {
            return Err(format!("\"{word}\" is not bytes in hex: two digits each, as in 1A 20 29"));
        }
        bytes.extend(digits.as_bytes().chunks(2).map(|pair| pair.iter().fold(0, |n, &d| n << 4 | nibble(d))));
    }
    Ok(bytes)
}

fn nibble(digit: u8) -> u8 {
    match digit {
        b'0'..=b'9' => digit - b'0',
        _ => (digit | 0x20) - b'a' + 10,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ways_to_write_bytes() {
        for text in ["1A 20 29", "1a2029", "0x1A, 0x20,0x29", "1a:20:29", "  [1A-20-29] # position", "1A20 29 // x"] {
            assert_eq!(parse(text.as_bytes()), Ok(vec![0x1a, 0x20, 0x29]), "{text}");
        }
        assert_eq!(parse(b"\r\n"), Ok(vec![]));
        for text in ["1A 2", "xyz", "1A 0x", "12 3g"] {
            assert!(parse(text.as_bytes()).is_err(), "{text}");
        }
    }
}
