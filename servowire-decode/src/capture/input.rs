//! The file behind a reader: buffered, with a byte count for the progress bar, and with faults that carry its name.

use std::cell::Cell;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::rc::Rc;

use flate2::read::MultiGzDecoder;
use ruzstd::decoding::StreamingDecoder;

use super::utf16::{self, Utf16};
use crate::fault::{At, Fault};

const BUFFER: usize = 1 << 18;

/// Bytes from which a file is recognised.
pub(super) const HEAD: usize = 1 << 12;

/// If events were due this often, the first lines have to be enough. The first time may count from before they arrived.
const SLOW: u32 = 2;

/// Maximum depth to which packed files inside packed files are unpacked.
const DEEPEST: u8 = 4;
/// Input that must be read backwards but cannot be is held in memory, up to this many bytes.
const MOST_HELD: u64 = 1 << 28;

/// A reader that can go back.
pub trait SeekRead: BufRead + Seek {}

impl<R: BufRead + Seek> SeekRead for R {}

/// Input that is recorded while it is read: a pipe, or a file that is still growing.
pub trait Live: Read {
    /// Returns whether data, or the end, are available; may wait for a moment.
    fn is_ready(&mut self) -> bool;

    /// Returns whether complete events should be shown although more data keep coming; called after each block.
    fn is_overdue(&mut self) -> bool;
}

/// The source of a file.
enum Source {
    Stream(Box<dyn Read>),
    File(Box<dyn SeekRead>),
    Live(Box<dyn Live>),
}

impl Source {
    fn live(&mut self) -> Option<&mut dyn Live> {
        if let Self::Live(source) = self { Some(source.as_mut()) } else { None }
    }
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Stream(source) => source.read(buffer),
            Self::File(source) => source.read(buffer),
            Self::Live(source) => source.read(buffer),
        }
    }
}

/// An open file.
pub struct Input {
    name: String,
    depth: u8,
    reader: BufReader<Source>,
    /// The beginning, read ahead to recognise the file, and how much of it has been taken.
    head: Vec<u8>,
    head_taken: usize,
    /// How often events were due while the beginning of a slow input was awaited.
    overdue: u32,
    taken: Rc<Cell<u64>>,
    /// A reader whose bytes are counted elsewhere.
    quiet: bool,
}

impl Input {
    /// Reads from any reader.
    pub fn over(name: &str, reader: impl Read + 'static) -> Self {
        Self::of(name, Source::Stream(Box::new(reader)))
    }

    /// Reads from a reader that can seek: formats that are read backwards need not be held in memory.
    pub fn seeking(name: &str, reader: impl SeekRead + 'static) -> Self {
        Self::of(name, Source::File(Box::new(reader)))
    }

    /// Reads input that is recorded while it is read.
    pub fn live(name: &str, source: impl Live + 'static) -> Self {
        Self::of(name, Source::Live(Box::new(source)))
    }

    fn of(name: &str, source: Source) -> Self {
        Self {
            name: name.to_owned(),
            depth: 0,
            quiet: false,
            reader: BufReader::with_capacity(BUFFER, source),
            head: Vec::new(),
            head_taken: 0,
            overdue: 0,
            taken: Rc::default(),
        }
    }

    /// Returns whether it may deliver nothing for a while.
    pub(crate) fn is_live(&self) -> bool {
        matches!(self.reader.get_ref(), Source::Live(_))
    }

    /// Returns whether complete events should be shown now.
    pub(crate) fn is_due(&mut self) -> bool {
        self.reader.get_mut().live().is_some_and(Live::is_overdue) || self.pauses()
    }

    /// Returns whether a read would have to wait: nothing is available, and nothing arrives for a moment.
    pub(crate) fn pauses(&mut self) -> bool {
        self.head_taken == self.head.len() && self.waits()
    }

    /// Unpacks gzip and zstd, repeatedly if they are nested.
    pub(crate) fn unpacked(mut self) -> Result<Self, Fault> {
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
        let unpacked = if gzip {
            Self::over(&name, MultiGzDecoder::new(self))
        } else {
            match StreamingDecoder::new(self) {
                Ok(decoder) => Self::over(&name, decoder),
                Err(e) => return Err(Fault::new(&name, At::File, format!("cannot be unpacked (zstd): {e}"))),
            }
        };
        // The progress bar counts what was read of the file.
        Self { depth, quiet: true, taken: meter, ..unpacked }.unpacked()
    }

    /// Converts text with two bytes per character to UTF-8.
    pub(crate) fn in_utf8(mut self) -> Result<Self, Fault> {
        let Some(unit) = utf16::mark(self.peek()?) else { return Ok(self) };
        let (name, meter) = (self.name.clone(), self.meter());
        let text = Self::over(&name, Utf16::new(self, unit));
        Ok(Self { quiet: true, taken: meter, ..text })
    }

    /// Returns the same content in a form that can be read backwards.
    pub(crate) fn seekable(mut self) -> Result<Box<dyn SeekRead>, Fault> {
        if let Source::File(file) = self.reader.get_mut() {
            let mut file = std::mem::replace(file, Box::new(Cursor::new(Vec::new())));
            file.seek(SeekFrom::Start(0)).map_err(|e| self.io_fault(At::File, &e))?;
            return Ok(file);
        }
        let mut bytes = Vec::new();
        let read = self.by_ref().take(MOST_HELD + 1).read_to_end(&mut bytes);
        read.map_err(|e| self.io_fault(At::File, &e))?;
        if bytes.len() as u64 > MOST_HELD {
            let what = format!("more than {} MB of this format need a file, not a stream", MOST_HELD >> 20);
            return Err(self.fault(At::File, what));
        }
        Ok(Box::new(Cursor::new(bytes)))
    }

    /// Returns the beginning of the file without consuming it: 4 KiB, or the whole file if it is shorter; of input that
    /// arrives slowly, the first lines.
    pub fn peek(&mut self) -> Result<&[u8], Fault> {
        // What was taken of the beginning is no longer it.
        self.head.drain(..self.head_taken);
        self.head_taken = 0;
        while self.head.len() < HEAD && (self.head.is_empty() || self.overdue < SLOW && !self.waits()) {
            let name = &self.name;
            let more = self.reader.fill_buf();
            let more = more.map_err(|e| Fault::new(name, At::File, format!("cannot be read: {}", plain(&e))))?;
            let count = more.len().min(HEAD - self.head.len());
            self.head.extend_from_slice(more.get(..count).unwrap_or_default());
            self.reader.consume(count);
            if count == 0 {
                break;
            }
            if self.head.contains(&b'\n') && self.reader.get_mut().live().is_some_and(Live::is_overdue) {
                self.overdue += 1;
            }
        }
        Ok(&self.head)
    }

    /// Returns whether nothing but the beginning is available at the moment.
    fn waits(&mut self) -> bool {
        self.reader.buffer().is_empty() && self.reader.get_mut().live().is_some_and(|source| !source.is_ready())
    }

    /// The name for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Bytes taken so far, shared with the progress bar.
    pub fn meter(&self) -> Rc<Cell<u64>> {
        Rc::clone(&self.taken)
    }

    /// Creates a fault of this file.
    pub fn fault(&self, at: At, what: impl Into<String>) -> Fault {
        Fault::new(&self.name, at, what)
    }

    /// Creates the fault of a reader that ended with an error at `at`.
    pub(crate) fn io_fault(&self, at: At, error: &io::Error) -> Fault {
        self.fault(at, format!("cannot be read: {}", plain(error)))
    }

    /// Skips this many bytes of a file without reading them; not in a stream, nor in what has been read ahead.
    pub(super) fn skip(&mut self, bytes: u64) -> io::Result<bool> {
        let buffered = self.reader.buffer().len();
        let Some(rest) = bytes.checked_sub(buffered as u64).and_then(|rest| i64::try_from(rest).ok()) else {
            return Ok(false);
        };
        if self.head_taken < self.head.len() || !matches!(self.reader.get_ref(), Source::File(_)) {
            return Ok(false);
        }
        self.reader.consume(buffered);
        if let Source::File(file) = self.reader.get_mut() {
            file.seek(SeekFrom::Current(rest))?;
        }
        if !self.quiet {
            self.taken.set(self.taken.get().saturating_add(bytes));
        }
        Ok(true)
    }

    fn count(&self, bytes: usize) {
        if !self.quiet {
            self.taken.set(self.taken.get() + bytes as u64);
        }
    }

    /// Appends the next line, with its line end, to `text`; returns its length in bytes. A line of `most` bytes or more is
    /// refused with the message `what`.
    pub(super) fn line(
        &mut self,
        text: &mut Vec<u8>,
        at: At,
        most: usize,
        what: impl FnOnce() -> String,
    ) -> Result<usize, Fault> {
        let got = self.by_ref().take(most as u64).read_until(b'\n', text).map_err(|e| self.io_fault(at, &e))?;
        if got == most { Err(self.fault(at, what())) } else { Ok(got) }
    }

    /// Fills `buffer` as far as the file goes; if the input pauses, with the whole units of `unit` bytes that are available.
    pub(crate) fn read_full(&mut self, buffer: &mut [u8], unit: usize) -> io::Result<usize> {
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

/// Returns the system's message without its error number, and one sentence for all incomplete packed files.
fn plain(error: &io::Error) -> String {
    let text = error.to_string();
    if error.kind() == io::ErrorKind::UnexpectedEof || text.contains("UnexpectedEof") {
        return "its packed content ends too early: it was cut off".to_owned();
    }
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}
