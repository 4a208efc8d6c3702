//! Why talking to an encoder failed.

use std::io;
use std::path::Path;

/// Why something could not be done.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// A port could not be opened; the fault names it.
    #[error("{0}")]
    Port(String),
    /// A file could not be read or written; the fault names it.
    #[error("{0}")]
    File(String),
    /// Output to the user failed.
    #[error("the output cannot be written: {0}")]
    Output(io::Error),
    /// The port failed.
    #[error("the port is gone or refused: {0}")]
    Io(#[from] io::Error),
    /// There was no good answer at all.
    #[error("{0}: is the encoder's power on, is {1} Mbit/s its rate, are A and B the right way round?")]
    Nobody(tformat::Error, f64),
    /// The answer was refused or missing.
    #[error("{0}")]
    Encoder(#[from] tformat::Error),
    /// Only the request itself came back.
    #[error("only our own request came back: no encoder is connected, it has no power, or A and B are swapped")]
    OnlyEcho,
    /// The page register has changed and could not be restored.
    #[error("{because}; the page register could not be restored; it held {page}")]
    PageLeft {
        /// Its previous value.
        page: u8,
        /// The fault that occurred first.
        because: Box<Fault>,
    },
    /// The input is not valid.
    #[error("{0}")]
    Input(String),
}

impl Fault {
    /// A fault of this file.
    pub fn file(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::File(format!("{}: {error}", path.display()))
    }

    /// Returns whether it names the failed object itself; all other faults concern the port.
    pub const fn names_itself(&self) -> bool {
        matches!(self, Self::Port(_) | Self::File(_) | Self::Output(_))
    }
}
