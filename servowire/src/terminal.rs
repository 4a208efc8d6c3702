//! The standard output.

use std::fmt;
use std::io::{self, Write};

/// Columns of the terminal at the standard output; `None` if it is a file or a pipe.
pub(crate) fn columns() -> Option<usize> {
    let (width, _) = terminal_size::terminal_size_of(io::stdout())?;
    Some(width.0.into())
}

/// Writes to the standard output at once; it is not a fault if the reader closes the pipe.
pub(crate) fn say(text: fmt::Arguments) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_fmt(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}
