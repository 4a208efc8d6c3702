//! Faults of an input file, each as a sentence that a person can act on.

use std::borrow::Cow;
use std::fmt;
use std::io;

/// A file that could not be read, or only in part. What its message quotes of the file is [`printable`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{at}: {}", printable(file), printable(what))]
pub struct Fault {
    /// The name of the file as given by the user.
    pub file: String,
    /// Where in the file.
    pub at: At,
    /// What is wrong and, if known, what to do.
    pub what: String,
}

/// A place in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum At {
    /// The file as a whole.
    File,
    /// A line of a text file, counted from 1.
    Line(u64),
    /// An offset in a binary file, counted from 0.
    Byte(u64),
}

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File => Ok(()),
            Self::Line(line) => write!(f, ", line {line}"),
            Self::Byte(byte) => write!(f, ", byte {byte}"),
        }
    }
}

/// Returns a text with `\x1b` and the like for control characters, which a terminal would obey; lines and tabs stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if !text.contains(obeyed) {
        return Cow::Borrowed(text);
    }
    let shown = |c| if obeyed(c) { format!("\\x{:02x}", u32::from(c)) } else { c.to_string() };
    text.chars().map(shown).collect::<String>().into()
}

impl Fault {
    /// Creates a fault of `file`.
    pub fn new(file: &str, at: At, what: impl Into<String>) -> Self {
        Self { file: file.to_owned(), at, what: what.into() }
    }
}

/// Why decoding ended early.
#[derive(Debug)]
pub enum Stop {
    /// The input is broken from here on, or nothing in it can be decoded.
    Fault(Fault),
    /// What was decoded shows something that needs attention.
    Trouble {
        /// All that is to be said.
        fault: Fault,
        /// Whether the input is broken too, or not as it should be.
        broken: bool,
    },
    /// The output accepts nothing more.
    Output(io::Error),
}

impl From<Fault> for Stop {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl From<io::Error> for Stop {
    fn from(error: io::Error) -> Self {
        Self::Output(error)
    }
}

impl std::error::Error for Stop {}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault(fault) | Self::Trouble { fault, .. } => fault.fmt(f),
            Self::Output(error) => write!(f, "cannot write: {error}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_that_a_terminal_obeys() {
        for (text, want) in [
            ("a\tb\nc", "a\tb\nc"),
            ("\x1b[31m", "\\x1b[31m"),
            ("\r\0\x7f\u{9b}", "\\x0d\\x00\\x7f\\x9b"),
            ("s², °", "s², °"),
        ] {
            assert_eq!(printable(text), want);
            let fault = Fault::new(text, At::Line(3), text).to_string();
            assert_eq!(fault, format!("{want}, line 3: {want}"));
        }
    }
}
