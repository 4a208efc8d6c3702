//! A UART's report of a damaged byte.

use core::fmt;

use embedded_io::ErrorKind;

/// A unit on the line that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LineFault {
    /// Its stop bit is 0.
    Framing,
    /// A wrong stop bit, noise, or units that were lost: the UART does not say which.
    Damaged,
}

impl fmt::Display for LineFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Framing => "a stop bit is 0",
            Self::Damaged => "framing, noise or overrun",
        })
    }
}

impl core::error::Error for LineFault {}

impl embedded_io::Error for LineFault {
    fn kind(&self) -> ErrorKind {
        ErrorKind::InvalidData
    }
}
