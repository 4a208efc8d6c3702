//! Why talking to an encoder failed.

use std::io;
use std::path::Path;

/// Why something could not be done.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    /// A port could not be opened; it is named.
    #[error("{0}")]
    Port(String),
    /// A file could not be read or written; it is named.
    #[error("{0}")]
    File(String),
    /// What was to be said could not be.
    #[error("the output cannot be written: {0}")]
    Output(io::Error),
    /// The port failed.
    #[error("the port is gone or refused: {0}")]
    Io(#[from] io::Error),
    /// Nobody has answered well, not even once.
    #[error("{0}: is the encoder's power on, is {1} Mbit/s its rate, are A and B the right way round?")]
    Nobody(tformat::Error, f64),
    /// The answer was refused or missing.
    #[error("{0}")]
    Encoder(#[from] tformat::Error),
    /// The request came back, and nothing else.
    #[error("only our own request came back: no encoder is connected, it has no power, or A and B are swapped")]
    OnlyEcho,
    /// The page register holds another page than before, and could not be put back.
    #[error("{because}; the page register could not be restored; it held {page}")]
    PageLeft {
        /// What it held.
        page: u8,
        /// What happened first.
        because: Box<Fault>,
    },
    /// The input is not what it has to be.
    #[error("{0}")]
    Input(String),
}

impl Fault {
    /// A fault of this file.
    pub fn file(path: &Path) -> impl Fn(io::Error) -> Self {
        move |error| Self::File(format!("{}: {error}", path.display()))
    }

    /// Whether it names what has failed itself; all others are of the port.
    pub const fn names_itself(&self) -> bool {
        matches!(self, Self::Port(_) | Self::File(_) | Self::Output(_))
    }
}
