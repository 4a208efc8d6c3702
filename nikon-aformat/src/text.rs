//! How messages are written for the person who reads a log.

use core::fmt;

/// Words as vendor documents print them, the first bit of the line in bit 15.
pub(crate) fn write_words(f: &mut fmt::Formatter<'_>, words: impl IntoIterator<Item = u16>) -> fmt::Result {
    for (at, word) in words.into_iter().enumerate() {
        let space = if at > 0 { " " } else { "" };
        write!(f, "{space}{word:04X}")?;
    }
    Ok(())
}
