//! `servowire decode --serial`: listens to a T-Format line at a serial port, without sending anything.
//!
//! A port delivers bytes without times, and an adapter hands over many exchanges at once: a pause does not show where a frame
//! ends. An exchange is therefore found by its content: a request, its control field once more, and a valid check. The
//! bytes heard become a log, with one frame per line.

use std::fmt::Write as _;
use std::io::{self, Read};
use std::time::Duration;

use servowire_decode::capture::Input;
use tformat::{BitRate, ControlField, DataId, Error, Request, Response};

use crate::pipe::Pipe;
use crate::talk::fault::Fault;
use crate::talk::port;

/// A port that delivers nothing for this long counts as quiet.
const QUIET: Duration = Duration::from_millis(50);
/// Bytes without an exchange are passed on when there are more than this.
const MOST_KEPT: usize = 256;
/// This many of them are kept, because an exchange may have begun.
const LONGEST: usize = 16;

/// Opens a port for listening.
pub(crate) fn listen(name: &str, rate: BitRate) -> Result<Input, Fault> {
    let mut port = port::open(name, rate)?;
    port.set_timeout(QUIET).map_err(|error| Fault::Port(format!("{name}: {error}")))?;
    Ok(Input::live(name, Pipe::over(Listener::new(port), false)))
}

/// What begins at a byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Begin {
    /// A request and its sound answer: bytes of the request, and bytes in total.
    Exchange {
        request: usize,
        whole: usize,
    },
    /// The beginning of an exchange, as far as it has arrived.
    Open,
    Nothing,
}

impl Begin {
    fn of(bytes: &[u8]) -> Self {
        let Some((first, _)) = bytes.split_first() else { return Self::Open };
        let Ok(id) = ControlField::parse(*first).and_then(ControlField::data_id) else { return Self::Nothing };
        let fields = |count: u8| usize::from(count);
        let (request, whole) = (fields(id.request_fields()), fields(id.request_fields() + id.response_fields()));
        let Some((asked, rest)) = bytes.split_at_checked(request) else { return Self::Open };
        let Ok(asked) = Request::parse(asked) else { return Self::Nothing };
        match rest.split_at_checked(whole - request) {
            Some((answer, _)) => match Response::parse(asked, answer) {
                Ok(_) | Err(Error::Rejected { .. }) => Self::Exchange { request, whole },
                Err(_) => Self::rejected(asked.data_id(), request, rest),
            },
            None if rest.first().is_some_and(|cf| cf != first) => Self::rejected(id, request, rest),
            None => Self::Open,
        }
    }

    /// An encoder refuses any damaged request with an ID 3 frame, whatever was requested.
    fn rejected(asked: DataId, request: usize, rest: &[u8]) -> Self {
        let length = usize::from(DataId::ReadAll.response_fields());
        match rest.get(..length).map(|answer| Response::parse(Request::ReadAll, answer)) {
            Some(Err(Error::Rejected { .. })) if asked != DataId::ReadAll => {
                Self::Exchange { request, whole: request + length }
            }
            _ => Self::Nothing,
        }
    }
}

/// Turns the bytes of a port into a log.
struct Listener<P> {
    port: P,
    /// Bytes in which no exchange was found yet.
    kept: Vec<u8>,
    /// Whether an exchange was found before them: bytes before the first exchange are part of one.
    begun: bool,
    /// Lines of the log, and how much of them has been taken.
    lines: String,
    taken: usize,
}

impl<P: Read> Listener<P> {
    const fn new(port: P) -> Self {
        Self { port, kept: Vec::new(), begun: false, lines: String::new(), taken: 0 }
    }

    /// Writes `count` bytes as a line, and forgets them.
    fn line(&mut self, who: &str, count: usize) {
        self.lines.push_str(who);
        for byte in self.kept.drain(..count.min(self.kept.len())) {
            // A string takes whatever comes.
            let _ = write!(self.lines, " {byte:02X}");
        }
        self.lines.push('\n');
    }

    /// Writes bytes that hold no exchange; before the first exchange it is unknown how a frame was cut.
    fn rubbish(&mut self, count: usize) {
        if count > LONGEST || self.begun && count > 0 {
            self.line("", count);
        } else {
            self.kept.drain(..count);
        }
    }

    /// Writes all exchanges that are certain. `quiet`: nothing follows for now.
    fn cut(&mut self, quiet: bool) {
        while let Some((at, request, whole)) = self.exchange() {
            let inside = (at + 1..at + whole).map(|from| (from, self.begins(from)));
            let second = inside.clone().find_map(|(from, begin)| match begin {
                Begin::Exchange { whole, .. } => Some(from + whole - at),
                Begin::Open | Begin::Nothing => None,
            });
            let more = !quiet && self.kept.len() < at + whole + LONGEST;
            if second.is_none() && more && inside.into_iter().any(|(_, begin)| begin == Begin::Open) {
                return;
            }
            self.rubbish(at);
            self.begun = true;
            if let Some(both) = second {
                // An answer is missing, and a check is valid by chance: it is impossible to tell which one.
                self.kept.drain(..both);
                self.lines.push_str("readable-in-two-ways\n");
            } else {
                self.line("TX:", request);
                self.line("RX:", whole - request);
            }
        }
        if quiet {
            self.rubbish(self.kept.len());
        } else if self.kept.len() > MOST_KEPT {
            self.rubbish(self.kept.len() - LONGEST);
        }
    }

    fn begins(&self, at: usize) -> Begin {
        self.kept.get(at..).map_or(Begin::Open, Begin::of)
    }

    /// Returns the first exchange: where it begins, the length of its request, and its total length.
    fn exchange(&self) -> Option<(usize, usize, usize)> {
        (0..self.kept.len()).find_map(|at| match self.begins(at) {
            Begin::Exchange { request, whole } => Some((at, request, whole)),
            Begin::Open | Begin::Nothing => None,
        })
    }
}

impl<P: Read> Read for Listener<P> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut bytes = [0; 4096];
        while self.taken == self.lines.len() {
            (self.taken, self.lines) = (0, String::new());
            match self.port.read(&mut bytes) {
                Ok(0) => {
                    self.cut(true);
                    if self.lines.is_empty() {
                        return Ok(0);
                    }
                }
                Ok(count) => {
                    self.kept.extend_from_slice(bytes.get(..count).unwrap_or_default());
                    self.cut(false);
                }
                Err(error) if error.kind() == io::ErrorKind::TimedOut => self.cut(true),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        let rest = self.lines.as_bytes().get(self.taken..).unwrap_or_default();
        let count = rest.len().min(buffer.len());
        if let (Some(to), Some(from)) = (buffer.get_mut(..count), rest.get(..count)) {
            to.copy_from_slice(from);
        }
        self.taken += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An answer of ID 3 with this position, checked.
    fn answer(abs: u8, last: u8) -> Vec<u8> {
        let mut answer = vec![0x1a, 0, abs, 0, 0, 23, 0, 0, last, 0];
        answer.push(answer.iter().fold(0, |sum, byte| sum ^ byte));
        answer
    }

    /// Returns the log made from the bytes, taken `chunk` at a time.
    fn log(bytes: &[u8], chunk: usize) -> String {
        let mut listener = Listener::new(io::empty());
        for bytes in bytes.chunks(chunk) {
            listener.kept.extend_from_slice(bytes);
            listener.cut(false);
        }
        listener.cut(true);
        listener.lines
    }

    #[test]
    fn exchanges_are_found_wherever_the_port_cuts() {
        let request = vec![0x1a];
        let first = [request.clone(), answer(1, 0)].concat();
        // Half an exchange, three whole ones, a request without its answer, one whole, a damaged one, one whole.
        let mut damaged = [request.clone(), answer(6, 0)].concat();
        damaged[4] ^= 8;
        let all = [&first[5..], &first, &first, &first, &request, &first, &damaged, &first].concat();
        let whole = "TX: 1A\nRX: 1A 00 01 00 00 17 00 00 00 00 0C\n";
        let want = format!("{whole}{whole}{whole} 1A\n{whole} 1A 1A 00 06 08 00 17 00 00 00 00 0B\n{whole}");
        for chunk in [1, 2, 5, 12, 64, 4096] {
            assert_eq!(log(&all, chunk), want, "{chunk}");
        }
    }

    #[test]
    fn what_can_be_read_in_two_ways_is_not_read() {
        // After a request without an answer, its control field passes for the one of an answer: the check field is 1A.
        let tricky = answer(0x17, 0);
        assert_eq!(tricky.last(), Some(&0x1a));
        let next = [vec![0x1a], answer(2, 0)].concat();
        let all = [&[0x1a, 0x1a][..], &tricky, &next].concat();
        for chunk in [1, 3, 4096] {
            let log = log(&all, chunk);
            assert!(log.starts_with("readable-in-two-ways\n"), "{log}");
            assert!(log.ends_with("RX: 1A 00 02 00 00 17 00 00 00 00 0F\n"), "{log}");
        }
    }

    #[test]
    fn what_is_no_traffic_is_passed_on_and_not_kept() {
        let log = log(&[0x55; 2000], 100);
        assert_eq!(log.matches("55").count(), 2000);
        assert!(log.lines().count() > 4);
    }
}
