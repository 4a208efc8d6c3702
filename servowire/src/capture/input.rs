//! The file below a reader: buffered, metered for the progress bar, with faults that carry its name.

use std::cell::{Cell, RefCell};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, IsTerminal, Read, Seek};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;

use flate2::read::MultiGzDecoder;
use ruzstd::decoding::StreamingDecoder;

use super::pipe::Pipe;
use super::utf16::{self, Utf16};
use crate::fault::{At, Fault};

const BUFFER: usize = 1 << 18;

/// Bytes by which a file is known.
pub(super) const HEAD: usize = 1 << 12;

/// Files inside files are unpacked so deep.
const DEEPEST: u8 = 4;
/// What has to be read backwards and is no file on disk is held in memory, up to so many bytes.
const MOST_HELD: u64 = 1 << 28;

/// How long a pipe that nobody asked for may be silent.
const PATIENCE: Duration = Duration::from_millis(400);
/// A source that gives nothing for so long has nothing for now.
const PAUSE: Duration = Duration::from_millis(60);

/// A reader that can go back.
pub trait SeekRead: BufRead + Seek + Send + Sync {}

impl<R: BufRead + Seek + Send + Sync> SeekRead for R {}

/// An open file.
pub struct Input {
    name: String,
    /// The file itself, where it can be opened once more.
    path: Option<PathBuf>,
    depth: u8,
    reader: BufReader<Box<dyn Read>>,
    /// The beginning, gathered to see what it is, and how much of it was taken.
    head: Vec<u8>,
    head_taken: usize,
    taken: Rc<Cell<u64>>,
    /// Somebody else counts.
    quiet: bool,
    /// What is below the reader, if it may be silent for a while.
    pipe: Option<Rc<RefCell<Pipe>>>,
}

/// What the standard input is where nobody asked for it.
pub enum Piped {
    /// A terminal, or at its end.
    Nothing,
    /// A pipe that is open and gives nothing for a moment.
    Silence,
    /// Something to read.
    Content(Input),
}

/// A pipe that somebody else looks at too.
struct Shared(Rc<RefCell<Pipe>>);

impl Read for Shared {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.0.borrow_mut().read(buffer)
    }
}

impl Input {
    /// Opens `path`, or the standard input for `-`. `grows`: its end is waited for.
    pub fn open(path: &Path, grows: bool) -> Result<Self, Fault> {
        let name = path.display().to_string();
        if path.as_os_str() == "-" {
            return Ok(Self::over_pipe("standard input", Pipe::over(io::stdin(), false)));
        }
        let fault = |e: &io::Error| Fault::new(&name, At::File, format!("cannot be opened: {}", plain(e)));
        let file = File::open(path).map_err(|e| fault(&e))?;
        if file.metadata().map_err(|e| fault(&e))?.is_dir() {
            return Err(Fault::new(&name, At::File, "is a folder; name the capture files in it"));
        }
        let regular = file.metadata().is_ok_and(|data| data.is_file());
        if grows || !regular {
            return Ok(Self::over_pipe(&name, Pipe::over(file, grows)));
        }
        Ok(Self { path: Some(path.to_path_buf()), ..Self::over(&name, Box::new(file)) })
    }

    /// What comes through a pipe or from a redirected file. `wanted`: it is waited for, however long it takes.
    pub fn piped(wanted: bool) -> Piped {
        if io::stdin().is_terminal() {
            return Piped::Nothing;
        }
        let mut pipe = Pipe::over(io::stdin(), false);
        loop {
            match (pipe.is_ready(PATIENCE), pipe.is_over()) {
                (true, true) => return Piped::Nothing,
                (true, false) => return Piped::Content(Self::over_pipe("standard input", pipe)),
                (false, _) if wanted => {}
                (false, _) => return Piped::Silence,
            }
        }
    }

    fn over_pipe(name: &str, pipe: Pipe) -> Self {
        let pipe = Rc::new(RefCell::new(pipe));
        Self { pipe: Some(Rc::clone(&pipe)), ..Self::over(name, Box::new(Shared(pipe))) }
    }

    /// Whether it may be silent for a while.
    pub fn is_live(&self) -> bool {
        self.pipe.is_some()
    }

    /// Whether a read would have to wait: nothing is there, and nothing comes for a moment.
    pub fn pauses(&self) -> bool {
        self.head_taken == self.head.len() && self.waits()
    }

    /// Unpacks gzip and zstd, as often as they are packed.
    pub fn unpacked(mut self) -> Result<Self, Fault> {
        let head = self.peek()?;
        let packed = match head {
            [0x1f, 0x8b, 0x08, ..] => Some(true),
            [0x28, 0xb5, 0x2f, 0xfd, ..] | [0x50..=0x5f, 0x2a, 0x4d, 0x18, ..] => Some(false),
            _ => None,
        };
        let Some(gzip) = packed else { return Ok(self) };
        if self.depth >= DEEPEST {
            return Err(self.fault(At::File, "is packed into itself too often"));
        }
        let (name, depth, meter) = (self.name.clone(), self.depth + 1, self.meter());
        let reader: Box<dyn Read> = if gzip {
            Box::new(MultiGzDecoder::new(self))
        } else {
            match StreamingDecoder::new(self) {
                Ok(decoder) => Box::new(decoder),
                Err(e) => return Err(Fault::new(&name, At::File, format!("cannot be unpacked (zstd): {e}"))),
            }
        };
        // The progress bar counts what was read of the file.
        let unpacked = Self { depth, quiet: true, taken: meter, ..Self::over(&name, reader) };
        unpacked.unpacked()
    }

    /// Text of two bytes a character as UTF-8.
    pub fn in_utf8(mut self) -> Result<Self, Fault> {
        let Some(unit) = utf16::mark(self.peek()?) else { return Ok(self) };
        let (name, meter) = (self.name.clone(), self.meter());
        let text = Self::over(&name, Box::new(Utf16::new(self, unit)));
        Ok(Self { quiet: true, taken: meter, ..text })
    }

    /// The same content in a form that can be read backwards.
    pub fn seekable(mut self) -> Result<Box<dyn SeekRead>, Fault> {
        if let Some(path) = self.path.take() {
            let file = File::open(path).map_err(|e| self.io_fault(At::File, &e))?;
            return Ok(Box::new(BufReader::new(file)));
        }
        let mut bytes = Vec::new();
        let read = self.by_ref().take(MOST_HELD + 1).read_to_end(&mut bytes);
        read.map_err(|e| self.io_fault(At::File, &e))?;
        if bytes.len() as u64 > MOST_HELD {
            let what = format!("more than {} MB of this format have to be a file, not a stream", MOST_HELD >> 20);
            return Err(self.fault(At::File, what));
        }
        Ok(Box::new(Cursor::new(bytes)))
    }

    /// Bytes that are part of the program.
    pub fn embedded(name: &str, bytes: &'static [u8]) -> Self {
        Self::over(name, Box::new(bytes))
    }

    /// Any reader.
    pub fn over(name: &str, reader: Box<dyn Read>) -> Self {
        Self {
            name: name.to_owned(),
            path: None,
            depth: 0,
            quiet: false,
            pipe: None,
            reader: BufReader::with_capacity(BUFFER, reader),
            head: Vec::new(),
            head_taken: 0,
            taken: Rc::default(),
        }
    }

    /// The beginning of the file without taking it: 4 KiB, or all there are.
    pub fn peek(&mut self) -> Result<&[u8], Fault> {
        while self.head.len() < HEAD && self.head_taken == 0 && (self.head.is_empty() || !self.waits()) {
            let name = &self.name;
            let more = self.reader.fill_buf();
            let more = more.map_err(|e| Fault::new(name, At::File, format!("cannot be read: {}", plain(&e))))?;
            let count = more.len().min(HEAD - self.head.len());
            self.head.extend_from_slice(more.get(..count).unwrap_or_default());
            self.reader.consume(count);
            if count == 0 {
                break;
            }
        }
        Ok(self.head.get(self.head_taken..).unwrap_or_default())
    }

    /// Whether nothing more than the head is there for a moment.
    fn waits(&self) -> bool {
        let silent = |pipe: &Rc<RefCell<Pipe>>| !pipe.borrow_mut().is_ready(PAUSE);
        self.reader.buffer().is_empty() && self.pipe.as_ref().is_some_and(silent)
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

    fn count(&self, bytes: usize) {
        if !self.quiet {
            self.taken.set(self.taken.get() + bytes as u64);
        }
    }

    /// Fills `buffer` as far as the file goes; of one that pauses, with the whole units of `unit` bytes that are there.
    pub fn read_full(&mut self, buffer: &mut [u8], unit: usize) -> io::Result<usize> {
        let mut filled = 0;
        while let Some(free) = buffer.get_mut(filled..).filter(|free| !free.is_empty()) {
            if filled > 0 && filled % unit == 0 && self.pauses() {
                break;
            }
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
        let mut head = self.head.get(self.head_taken..).unwrap_or_default();
        let n = if head.is_empty() { self.reader.read(buffer)? } else { head.read(buffer)? };
        self.head_taken = self.head.len().min(self.head_taken + n);
        self.count(n);
        Ok(n)
    }
}

impl BufRead for Input {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        match self.head.get(self.head_taken..) {
            Some(head) if !head.is_empty() => Ok(head),
            _ => self.reader.fill_buf(),
        }
    }

    fn consume(&mut self, amount: usize) {
        self.count(amount);
        if self.head_taken < self.head.len() {
            self.head_taken = self.head.len().min(self.head_taken + amount);
        } else {
            self.reader.consume(amount);
        }
    }
}

/// The system's words without its error number, and one sentence for all packed files that are not whole.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    if error.kind() == io::ErrorKind::UnexpectedEof || text.contains("UnexpectedEof") {
        return "what is packed in it ends too early: it was cut off".to_owned();
    }
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}
