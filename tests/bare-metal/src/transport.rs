//! Transports of the drivers without a line: what was sent is thrown away, and an answer is there when its time has come. Time goes on
//! by one field or frame with every look at the clock.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady, Write};
use nikon_aformat::RequestFrame;
use servowire_drivers::nikon::{Frame, blocking::FramePort};
use servowire_drivers::{Clock, ClockError};

/// A clock that steps on by so many ns.
pub(crate) struct Steps {
    now_ns: u64,
    step_ns: u64,
}

impl Steps {
    pub(crate) fn new(step_ns: u64) -> Self {
        Self { now_ns: 1_000_000, step_ns }
    }
}

impl Clock for Steps {
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.now_ns += self.step_ns;
        Ok(self.now_ns)
    }
}

/// Looks of the turn-around, in which nothing is there.
const LOOKS: u8 = 2;

/// A UART that answers every request with these bytes, one by one.
pub(crate) struct Uart {
    answer: &'static [u8],
    /// What of it is still to come.
    rest: &'static [u8],
    /// Looks until the first of them is there.
    looks: u8,
}

impl Uart {
    pub(crate) fn new(answer: &'static [u8]) -> Self {
        Self { answer, rest: &[], looks: 0 }
    }
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        (self.rest, self.looks) = (self.answer, LOOKS);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl ReadReady for Uart {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        let waits = self.looks > 0;
        self.looks = self.looks.saturating_sub(1);
        Ok(!waits && !self.rest.is_empty())
    }
}

impl Read for Uart {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, Infallible> {
        match (self.rest.split_first(), bytes.first_mut()) {
            (Some((first, rest)), Some(place)) => {
                *place = *first;
                self.rest = rest;
                Ok(1)
            }
            _ => Ok(0),
        }
    }
}

/// A port that answers every request with frames of these contents.
pub(crate) struct Port {
    answer: &'static [u16],
    rest: &'static [u16],
    looks: u8,
}

impl Port {
    pub(crate) fn new(answer: &'static [u16]) -> Self {
        Self { answer, rest: &[], looks: 0 }
    }
}

impl FramePort for Port {
    type Error = Infallible;

    fn send(&mut self, _: &[RequestFrame], _: u32) -> Result<(), Infallible> {
        (self.rest, self.looks) = (self.answer, LOOKS);
        Ok(())
    }

    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        if self.looks > 0 {
            self.looks -= 1;
            return Ok(None);
        }
        let Some((first, rest)) = self.rest.split_first() else { return Ok(None) };
        self.rest = rest;
        Ok(Some(Frame { content: *first, framed: true, end_ns: None }))
    }
}
