//! Value change dumps (IEEE 1364): sigrok, PulseView, Logic 2, GTKWave, simulators.
//!
//! The header is read as words, ignoring types and attributes; the body by its first letters, with or without line ends.

mod codes;
mod header;
mod tick;

use std::io::{self, Read};

use memchr::memchr_iter;

use super::input::Input;
use super::recording::{Change, Line};
use crate::fault::{At, Fault};
use crate::time::Time;
use codes::{Code, Codes};
use header::Header;
use tick::Tick;

/// Changes returned at once.
const BLOCK: usize = 4096;
/// Bytes read at once. Maximum length of a word.
const BUFFER: usize = 1 << 18;

/// A VCD file after its header. Channels are the variables of one bit, and the bits of small vectors.
pub struct Vcd {
    input: Input,
    buffer: Vec<u8>,
    /// Returns the unread part of the buffer.
    from: usize,
    to: usize,
    /// The line at the beginning of the buffer.
    line: u64,
    date: Option<String>,
    channels: Vec<String>,
    codes: Codes,
    tick: Tick,
    now: Time,
    /// Time of the file's last time stamp in its own unit.
    stamp: u64,
    /// Words to skip up to `$end`.
    skipping: bool,
    ended: bool,
}

/// How to continue after a piece of the body.
enum Next {
    /// The piece was taken; continue after it.
    Taken(usize),
    /// The piece may continue after the buffer.
    More,
}

impl Vcd {
    /// Reads the header.
    pub fn new(mut input: Input) -> Result<Self, Fault> {
        let header = Header::read(&mut input)?;
        let (channels, codes) = header.channels(&input)?;
        let Header { tick, line, date, .. } = header;
        Ok(Self {
            input,
            buffer: vec![0; BUFFER],
            from: 0,
            to: 0,
            line,
            date,
            channels,
            codes,
            tick: Tick::new(tick),
            now: Time::ZERO,
            stamp: 0,
            skipping: false,
            ended: false,
        })
    }

    /// Returns the line of the next piece.
    fn here(&self) -> At {
        let read = self.buffer.get(..self.from).unwrap_or_default();
        At::Line(self.line + memchr_iter(b'\n', read).count() as u64)
    }

    fn fault(&self, what: impl Into<String>) -> Fault {
        self.input.fault(self.here(), what)
    }

    /// Moves the rest to the front and reads more.
    fn fill(&mut self) -> Result<(), Fault> {
        let At::Line(line) = self.here() else { return Ok(()) };
        self.line = line;
        self.buffer.copy_within(self.from..self.to, 0);
        self.to -= self.from;
        self.from = 0;
        if self.to == self.buffer.len() {
            return Err(self.fault("not VCD in the middle of a value change: an unterminated word"));
        }
        let free = self.buffer.get_mut(self.to..).unwrap_or_default();
        match self.input.read(free) {
            Ok(0) => self.ended = true,
            Ok(n) => self.to += n,
            Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
            Err(e) => return Err(self.input.io_fault(At::Line(self.line), &e)),
        }
        Ok(())
    }

    /// Takes pieces until there are enough changes or the buffer is used up.
    fn scan(&mut self, changes: &mut Vec<Change>, enough: usize) -> Result<(), Fault> {
        let buffer = std::mem::take(&mut self.buffer);
        let result = loop {
            let rest = buffer.get(self.from..self.to).unwrap_or_default();
            if !self.skipping {
                let left = self.plain(rest, changes, enough);
                self.from = self.to - left;
            }
            let rest = buffer.get(self.from..self.to).unwrap_or_default();
            let Some(first) = rest.first() else { break Ok(()) };
            if *first <= b' ' {
                self.from += 1;
                continue;
            }
            if changes.len() >= enough {
                break Ok(());
            }
            match self.piece(rest, changes) {
                Ok(Next::Taken(length)) => self.from += length,
                Ok(Next::More) => break Ok(()),
                Err(what) => break Err(what),
            }
        };
        self.buffer = buffer;
        result.map_err(|what| self.fault(what))
    }

    /// Takes the common pieces of a body (stamps that do not decrease, and levels with codes of one or two letters) as long
    /// as they are complete; returns how much of `rest` is left.
    fn plain(&mut self, mut rest: &[u8], changes: &mut Vec<Change>, enough: usize) -> usize {
        while changes.len() < enough {
            let (level, code) = match *rest {
                [0..=b' ', ref after @ ..] => {
                    rest = after;
                    continue;
                }
                [b'#', ref digits @ ..] => {
                    let Some((stamp, after)) = stamp(digits) else { break };
                    let Some(now) = self.tick.time(stamp).filter(|_| stamp >= self.stamp) else { break };
                    (self.stamp, self.now, rest) = (stamp, now, after);
                    continue;
                }
                [level @ (b'0' | b'1'), code @ b'!'..=b'~', 0..=b' ', ref after @ ..] => {
                    rest = after;
                    (level, usize::from(code))
                }
                [level @ (b'0' | b'1'), a @ b'!'..=b'~', b @ b'!'..=b'~', 0..=b' ', ref after @ ..] => {
                    rest = after;
                    (level, usize::from(a) | usize::from(b) << 8)
                }
                _ => break,
            };
            if let Some(Code { first, width: 1 }) = self.codes.short.get(code).copied().flatten() {
                changes.push(Change { time: self.now, channel: first, level: level == b'1' });
            }
        }
        rest.len()
    }

    /// Takes one stamp, value change or command. At the end of the file a word ends as well.
    fn piece(&mut self, rest: &[u8], changes: &mut Vec<Change>) -> Result<Next, String> {
        let length = word(rest);
        let (text, after) = rest.split_at(length);
        if after.is_empty() && !self.ended {
            return Ok(Next::More);
        }
        if self.skipping {
            self.skipping = text != b"$end";
            return Ok(Next::Taken(length));
        }
        let cut = after.is_empty();
        let Some((first, tail)) = text.split_first() else { return Ok(Next::Taken(0)) };
        match first {
            b'#' => self.time(tail, cut)?,
            b'$' => self.skipping = matches!(text, b"$comment" | b"$dumpoff" | b"$attrbegin"),
            b'b' | b'B' | b'r' | b'R' | b's' | b'S' | b'p' => return self.vector(*first, tail, rest, length, changes),
            b'0' | b'1' | b'x' | b'X' | b'z' | b'Z' | b'U' | b'W' | b'L' | b'H' | b'-' | b'h' | b'l' | b'u' | b'w' => {
                // A blank may stand between value and code.
                let Some((code, length)) = (if tail.is_empty() { second(rest, length) } else { Some((tail, length)) })
                else {
                    return self.open();
                };
                if length == rest.len() && !self.ended {
                    return Ok(Next::More);
                }
                self.value(*first, self.codes.get(code), changes);
                return Ok(Next::Taken(length));
            }
            _ => {
                let what = format!("unexpected character {:?}", char::from(*first));
                return Err(format!("not VCD in the middle of a value change: {what}"));
            }
        }
        Ok(Next::Taken(length))
    }

    /// The word continues after the buffer, or the file ends in it.
    fn open(&self) -> Result<Next, String> {
        if self.ended {
            return Err("the file ends in the middle of a value change: it was cut off".to_owned());
        }
        Ok(Next::More)
    }

    fn time(&mut self, digits: &[u8], cut: bool) -> Result<(), String> {
        let point = digits.iter().position(|byte| *byte == b'.').unwrap_or(digits.len());
        let (whole, fraction) = digits.split_at(point);
        let fraction = fraction.get(1..).unwrap_or_default();
        let mut stamp = Some(0_u64);
        for digit in whole {
            let digit = digit.wrapping_sub(b'0');
            stamp = stamp.filter(|_| digit < 10).and_then(|s| s.checked_mul(10)?.checked_add(digit.into()));
        }
        let Some(stamp) = stamp.filter(|_| !whole.is_empty() && fraction.iter().all(u8::is_ascii_digit)) else {
            let text = String::from_utf8_lossy(digits).into_owned();
            return Err(format!("not VCD in the middle of a value change: #{text} is not a time"));
        };
        let time = self.tick.time_between(stamp, fraction);
        let (now, between) = time.ok_or_else(|| format!("time #{stamp} is too large"))?;
        if now < self.now {
            // The last word of a file that was cut off.
            if cut {
                return Err("the file ends in the middle of a time: it was cut off".to_owned());
            }
            return Err(format!("time goes back from #{} to #{stamp}", self.stamp));
        }
        // What comes next must not be before it: nothing without a fraction until the next unit.
        (self.now, self.stamp) = (now, stamp.saturating_add(between.into()));
        Ok(())
    }

    /// Takes a value and a code with a blank between them; `length` is the length of the value with its letter.
    fn vector(
        &mut self,
        kind: u8,
        value: &[u8],
        rest: &[u8],
        length: usize,
        changes: &mut Vec<Change>,
    ) -> Result<Next, String> {
        let Some((mut code, mut end)) = second(rest, length) else { return self.open() };
        if kind == b'p' {
            // The strengths of both levels come before the code.
            for _ in 0..2 {
                let Some(next) = second(rest, end) else { return self.open() };
                (code, end) = next;
            }
        }
        if end == rest.len() && !self.ended {
            return Ok(Next::More);
        }
        match kind {
            b'b' | b'B' => {
                if let Some(code) = self.codes.get(code) {
                    for bit in 0..code.width {
                        // Short vectors are extended to the left: 1 with 0.
                        let at = value.len().checked_sub(1 + usize::from(bit)).and_then(|at| value.get(at));
                        let digit = at.or(value.first()).copied().unwrap_or(b'x');
                        let digit = if at.is_none() && digit == b'1' { b'0' } else { digit };
                        self.value(digit, Some(Code { first: code.first + bit, width: 1 }), changes);
                    }
                }
            }
            b'p' => {
                let Some(code) = self.codes.get(code) else { return Ok(Next::Taken(end)) };
                for (bit, state) in (0..code.width).zip(value.iter().rev()) {
                    self.value(level(*state), Some(Code { first: code.first + bit, width: 1 }), changes);
                }
            }
            _ => {}
        }
        Ok(Next::Taken(end))
    }

    fn value(&self, digit: u8, code: Option<Code>, changes: &mut Vec<Change>) {
        let level = match digit {
            b'0' | b'L' | b'l' => false,
            // A line that nobody drives is pulled high.
            b'1' | b'H' | b'h' | b'z' | b'Z' => true,
            // Unknown: the line keeps the level it had.
            _ => return,
        };
        if let Some(Code { first, width: 1 }) = code {
            changes.push(Change { time: self.now, channel: first, level });
        }
    }
}

/// Returns the level of a port's state: it does not matter which side drives it, but two sides that disagree make it
/// unknown.
fn level(state: u8) -> u8 {
    match state {
        b'D' | b'd' | b'L' | b'l' | b'0' => b'0',
        b'U' | b'u' | b'H' | b'h' | b'1' => b'1',
        b'Z' | b'T' | b'F' | b'f' => b'z',
        _ => b'x',
    }
}

/// Returns the leading digits as a number, and the rest after the blank that ends them; `None` for anything else.
fn stamp(digits: &[u8]) -> Option<(u64, &[u8])> {
    let (mut stamp, mut rest) = (0_u64, digits);
    while let [digit @ b'0'..=b'9', after @ ..] = rest {
        stamp = stamp.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
        rest = after;
    }
    // Nineteen digits fit.
    match rest {
        [0..=b' ', after @ ..] if (1..=19).contains(&(digits.len() - rest.len())) => Some((stamp, after)),
        _ => None,
    }
}

/// Returns the length of the first word.
fn word(text: &[u8]) -> usize {
    text.iter().position(|byte| *byte <= b' ').unwrap_or(text.len())
}

/// Returns the word after the one that ends at `from`, and where it ends.
fn second(text: &[u8], from: usize) -> Option<(&[u8], usize)> {
    let rest = text.get(from..)?;
    let blanks = rest.iter().position(|byte| *byte > b' ')?;
    let rest = rest.get(blanks..)?;
    let length = word(rest);
    Some((rest.get(..length)?, from + blanks + length))
}

impl Line for Vcd {
    fn input(&mut self) -> Option<&mut Input> {
        Some(&mut self.input)
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn date(&self) -> Option<&str> {
        self.date.as_deref()
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        let enough = changes.len() + BLOCK;
        loop {
            let before = (self.from, self.to);
            self.scan(changes, enough)?;
            if changes.len() >= enough || !self.ended && changes.len() > enough - BLOCK && self.input.pauses() {
                return Ok(true);
            }
            if self.ended && (self.from == self.to || before == (self.from, self.to)) {
                return Ok(false);
            }
            if !self.ended {
                self.fill()?;
            }
        }
    }

    fn reached(&self) -> Time {
        self.now
    }
}
