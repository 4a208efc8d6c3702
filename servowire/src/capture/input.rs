//! The file below a reader: buffered, metered for the progress bar, with faults that carry its name.

use std::cell::Cell;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::rc::Rc;

use crate::fault::{At, Fault};

const BUFFER: usize = 1 << 18;

/// An open file.
pub struct Input {
    name: String,
    reader: BufReader<Box<dyn Read>>,
    taken: Rc<Cell<u64>>,
}

impl Input {
    /// Opens `path`, or the standard input for `-`.
    pub fn open(path: &Path) -> Result<Self, Fault> {
        let name = path.display().to_string();
        if path.as_os_str() == "-" {
            return Ok(Self::over("standard input", Box::new(io::stdin())));
        }
        let fault = |e: &io::Error| Fault::new(&name, At::File, format!("cannot be opened: {}", plain(e)));
        let file = File::open(path).map_err(|e| fault(&e))?;
        if file.metadata().map_err(|e| fault(&e))?.is_dir() {
            return Err(Fault::new(&name, At::File, "is a folder; name the capture files in it"));
        }
        Ok(Self::over(&name, Box::new(file)))
    }

    /// Bytes that are part of the program.
    pub fn embedded(name: &str, bytes: &'static [u8]) -> Self {
        Self::over(name, Box::new(bytes))
    }

    /// Any reader.
    pub fn over(name: &str, reader: Box<dyn Read>) -> Self {
        Self { name: name.to_owned(), reader: BufReader::with_capacity(BUFFER, reader), taken: Rc::default() }
    }

    /// The next bytes without taking them.
    pub fn peek(&mut self) -> Result<&[u8], Fault> {
        let name = &self.name;
        self.reader.fill_buf().map_err(|e| Fault::new(name, At::File, format!("cannot be read: {}", plain(&e))))
    }

    /// The name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bytes taken so far, shared with the progress bar.
    pub fn meter(&self) -> Rc<Cell<u64>> {
        Rc::clone(&self.taken)
    }

    /// A fault of this file.
    pub fn fault(&self, at: At, what: impl Into<String>) -> Fault {
        Fault::new(&self.name, at, what)
    }

    /// The reader ended with an error at `at`.
    pub fn io_fault(&self, at: At, error: &io::Error) -> Fault {
        self.fault(at, format!("cannot be read: {}", plain(error)))
    }

    /// Fills `buffer` as far as the file goes.
    pub fn read_full(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut filled = 0;
        while let Some(free) = buffer.get_mut(filled..).filter(|free| !free.is_empty()) {
            match self.read(free) {
                Ok(0) => break,
                Ok(n) => filled += n,
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(filled)
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n = self.reader.read(buffer)?;
        self.taken.set(self.taken.get() + n as u64);
        Ok(n)
    }
}

impl BufRead for Input {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, amount: usize) {
        self.taken.set(self.taken.get() + amount as u64);
        self.reader.consume(amount);
    }
}

/// The system's words without its error number.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}
