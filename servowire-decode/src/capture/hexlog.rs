//! Bytes as text: a log of a serial monitor or a debugger, a dump, an array of C or Rust.
//!
//! `1A 20 29 C0`, `1a2029c0`, `0x1A, 0x20` and `TX: 1A -> RX: 1A 20` are all read; text after `#` or `//` is a comment.
//! The bytes of a log line are taken as one burst without pauses; so is a dump or an array as a whole.

mod dump;
pub(super) mod words;

use std::collections::VecDeque;

use super::input::{HEAD, Input};
use crate::event::Direction;
use crate::fault::{At, Fault};
use crate::time::Time;
use dump::{Dump, Row};

/// Maximum length of a line; a file with longer ones is not a log of a servo line.
const LONGEST: usize = 1 << 16;
/// Maximum number of bytes of a dump, or characters of an array, that are returned at once: a frame that crosses the end is
/// lost.
const MOST: usize = 1 << 24;
/// Number of lines by which a log is recognised if nothing else identifies it.
const SEEN: usize = 24;
/// Minimum number of lines of bytes for each other line, if nothing else identifies a log.
const SOUND: usize = 8;

/// A log of bytes.
pub struct HexLog {
    input: Input,
    text: Vec<u8>,
    line: u64,
    /// Bytes were read, so the file is a log.
    good: bool,
    shape: Shape,
    ready: VecDeque<Burst>,
    over: bool,
}

/// The kind of text, judged by its beginning.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Shape {
    Unknown,
    Lines,
    Dump { dump: Dump, gathered: Gathered, last: Vec<u8>, again: bool },
    Array { open: bool, cells: String, from: u64 },
}

/// Bytes of a dump so far, with the line and address of the first.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
struct Gathered {
    line: u64,
    next: u64,
    bytes: Vec<u8>,
}

/// The bytes of one line of the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Burst {
    /// Its number, from 1.
    pub line: u64,
    /// When it was sent, if the log gives a time.
    pub time: Option<Time>,
    /// Who sent it, if the log names the sender.
    pub direction: Option<Direction>,
    /// Its content; at least one byte, unless it is damaged.
    pub bytes: Vec<u8>,
    /// Why the line could not be read as bytes.
    pub spoilt: Option<String>,
}

impl Burst {
    /// Creates a burst of the bytes in `line`.
    pub fn new(line: u64, bytes: Vec<u8>) -> Self {
        Self { line, time: None, direction: None, bytes, spoilt: None }
    }

    /// Creates a burst from the content of `line`.
    pub(super) fn of(line: u64, said: words::Said) -> Self {
        Self { time: said.time, direction: said.direction, ..Self::new(line, said.bytes) }
    }

    /// Creates the entry for a line that could not be read as bytes, with the reason.
    pub(super) fn spoilt(line: u64, what: String) -> Self {
        Self { spoilt: Some(what), ..Self::new(line, Vec::new()) }
    }
}

/// Returns whether a file looks like a log of bytes.
pub(super) fn looks_like(head: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(head.get(..head.len().min(1 << 12)).unwrap_or(head)) else { return false };
    if text.bytes().any(|byte| byte < b' ' && !matches!(byte, b'\t' | b'\r' | b'\n')) {
        return false;
    }
    if array_begins(text) || Dump::of(text, false).is_some() {
        return true;
    }
    let Sample { good, bad, bytes, .. } = Sample::of(text);
    bad.saturating_mul(SOUND) <= good && bytes > 1
}

/// Classifies the first lines of a text.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Sample {
    /// Lines with bytes.
    good: usize,
    /// Other lines.
    bad: usize,
    bytes: usize,
    /// At least one line has a time.
    timed: bool,
}

impl Sample {
    fn of(text: &str) -> Self {
        let mut lines: Vec<&str> = text.lines().collect();
        if lines.len() > 1 && !text.ends_with('\n') {
            lines.pop();
        }
        let mut sample = Self::default();
        for line in lines.into_iter().take(SEEN) {
            match words::line(line) {
                Ok(said) => {
                    let bytes: usize = said.iter().map(|said| said.bytes.len()).sum();
                    sample.good += usize::from(bytes > 0);
                    sample.timed |= said.iter().any(|said| said.time.is_some());
                    sample.bytes += bytes;
                }
                Err(_) => sample.bad += 1,
            }
        }
        sample
    }
}

/// `= {` or `= [` after a name.
fn array_begins(text: &str) -> bool {
    text.split_once('=').is_some_and(|(before, after)| {
        let after = after.trim_start().trim_start_matches('&');
        before.contains([']', ':']) && after.starts_with(['{', '['])
    })
}

impl HexLog {
    /// Reads a log from its beginning.
    pub fn new(input: Input) -> Self {
        Self {
            input,
            text: Vec::new(),
            line: 0,
            good: false,
            shape: Shape::Unknown,
            ready: VecDeque::new(),
            over: false,
        }
    }

    /// The file that is read.
    pub(super) fn input(&mut self) -> &mut Input {
        &mut self.input
    }

    /// Returns whether its first lines have times. Call it before anything is read.
    pub(super) fn has_times(&mut self) -> bool {
        self.input.peek().is_ok_and(|head| Sample::of(&String::from_utf8_lossy(head)).timed)
    }

    /// Returns the next burst; `None` at the end.
    pub fn burst(&mut self) -> Result<Option<Burst>, Fault> {
        if self.shape == Shape::Unknown {
            let head = String::from_utf8_lossy(self.input.peek()?).into_owned();
            self.shape = Self::shape(&head);
            // The first line may be the spoilt one.
            let Sample { good, bad, .. } = Sample::of(&head);
            self.good = self.shape == Shape::Lines && good > bad;
        }
        loop {
            if let Some(burst) = self.ready.pop_front() {
                self.good |= burst.spoilt.is_none();
                return Ok(Some(burst));
            }
            if self.over {
                return Ok(None);
            }
            self.next_line()?;
        }
    }

    fn shape(head: &str) -> Shape {
        match Dump::of(head, head.len() < HEAD) {
            Some(dump) => Shape::Dump { dump, gathered: Gathered::default(), last: Vec::new(), again: false },
            None if array_begins(head) => Shape::Array { open: false, cells: String::new(), from: 0 },
            None => Shape::Lines,
        }
    }

    fn next_line(&mut self) -> Result<(), Fault> {
        self.text.clear();
        self.line += 1;
        let at = At::Line(self.line);
        let what = || format!("a line of more than {LONGEST} characters: not a log of hex bytes");
        let got = self.input.line(&mut self.text, at, LONGEST, what)?;
        self.over = got == 0;
        let text = String::from_utf8_lossy(&self.text).into_owned();
        let (number, ready) = (self.line, &mut self.ready);
        let taken = match &mut self.shape {
            Shape::Dump { dump, gathered, last, again } => {
                dump_line(*dump, &text, number, self.over, (gathered, last, again), ready)
            }
            Shape::Array { open, cells, from } => array_line(&text, number, (open, cells, from), ready),
            Shape::Unknown | Shape::Lines => words::line(&text).map(|said| {
                ready.extend(said.into_iter().map(|said| Burst::of(number, said)));
            }),
        };
        match taken {
            Ok(()) => Ok(()),
            // In a log a wrong digit costs its line; a file without any bytes before it is no log.
            Err(what) if self.good => {
                self.ready.push_back(Burst::spoilt(number, what));
                Ok(())
            }
            Err(what) => Err(self.input.fault(at, what)),
        }
    }
}

/// Takes a line of a dump; at the `end` the bytes gathered form a burst.
fn dump_line(
    dump: Dump,
    text: &str,
    number: u64,
    end: bool,
    (gathered, last, again): (&mut Gathered, &mut Vec<u8>, &mut bool),
    ready: &mut VecDeque<Burst>,
) -> Result<(), String> {
    if dump == Dump::Octal {
        return Err("octal words, whose byte order is unknown: dump with od -An -tx1, or xxd".to_owned());
    }
    let mut give = |gathered: &mut Gathered| {
        let bytes = std::mem::take(&mut gathered.bytes);
        if !bytes.is_empty() {
            ready.push_back(Burst::new(gathered.line, bytes));
        }
    };
    if end {
        give(gathered);
        return Ok(());
    }
    if text.trim().is_empty() {
        return Ok(());
    }
    match dump.row(text)? {
        (_, Row::Again) => *again = true,
        (at, row) => {
            if std::mem::take(again) && !last.is_empty() {
                while gathered.next < at && gathered.bytes.len() < MOST {
                    gathered.bytes.extend_from_slice(last);
                    gathered.next += last.len() as u64;
                }
            }
            if let Row::Bytes(bytes) = row {
                if gathered.bytes.len() + bytes.len() > MOST {
                    give(gathered);
                }
                if gathered.bytes.is_empty() {
                    gathered.line = number;
                }
                gathered.next = at.saturating_add(bytes.len() as u64);
                gathered.bytes.extend_from_slice(&bytes);
                *last = bytes;
            }
        }
    }
    Ok(())
}

/// Takes a line of an array in C or Rust: the bytes between the innermost brackets after a `=` form a burst.
fn array_line(
    text: &str,
    number: u64,
    (open, cells, from): (&mut bool, &mut String, &mut u64),
    ready: &mut VecDeque<Burst>,
) -> Result<(), String> {
    let text = text.split("//").next().unwrap_or_default();
    let mut rest = text;
    if !*open {
        let Some((_, after)) = text.split_once('=') else { return Ok(()) };
        (rest, *open) = (after, true);
    }
    for letter in rest.chars() {
        match letter {
            '{' | '[' => {
                cells.clear();
                *from = number;
            }
            '}' | ']' => {
                let inside = std::mem::take(cells);
                let bytes = match words::numbers(&inside) {
                    Some(bytes) => bytes,
                    None => words::line(&inside)?.into_iter().flat_map(|said| said.bytes).collect(),
                };
                if !bytes.is_empty() {
                    ready.push_back(Burst::new(*from, bytes));
                }
            }
            ';' => {
                *open = false;
                cells.clear();
                break;
            }
            letter if cells.len() < MOST => cells.push(letter),
            _ => return Err("an array of more than 16 million characters".to_owned()),
        }
    }
    Ok(())
}
