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

/// `defmt::Format` that prints what `Display` prints.
macro_rules! format_as_displayed {
    ($($name:ty),+) => {
        $(
            #[cfg(feature = "defmt")]
            #[cfg_attr(docsrs, doc(cfg(feature = "defmt")))]
            impl defmt::Format for $name {
                fn format(&self, f: defmt::Formatter<'_>) {
                    defmt::write!(f, "{}", defmt::Display2Format(self));
                }
            }
        )+
    };
}

pub(crate) use format_as_displayed;
