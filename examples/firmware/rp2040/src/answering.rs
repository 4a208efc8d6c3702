//! An encoder's end of the line: an answer that is ready, and the unit that starts it.

use crate::port::{Prepared, Receiver, Transmitter, Unit};

/// Answers prepared ahead, which the receiver starts whatever the processor is doing then.
pub struct Answering {
    transmitter: Transmitter,
    receiver: Receiver,
    /// The unit that starts the transmission held.
    expected: Option<u16>,
}

impl Answering {
    /// Made of these.
    pub const fn new(transmitter: Transmitter, receiver: Receiver) -> Self {
        Self { transmitter, receiver, expected: None }
    }

    /// Returns the next unit of the line, and whether the held answer is on its way; an answer that waits for another unit
    /// is dropped.
    pub fn take(&mut self) -> Option<(Unit, bool)> {
        let unit = self.receiver.take()?;
        let Some(expected) = self.expected.take() else { return Some((unit, false)) };
        self.receiver.expect(None);
        let started = unit.framed && unit.content == expected;
        if started {
            // The receiver has started it, or was told about it too late.
            self.transmitter.start();
        } else {
            self.transmitter.discard();
        }
        Some((unit, started))
    }

    /// Returns whether an answer is ready.
    pub const fn is_ready(&self) -> bool {
        self.expected.is_some()
    }

    /// Holds an answer until this unit comes.
    pub fn hold(&mut self, answer: &Prepared, expected: u16) {
        self.transmitter.hold(answer);
        self.expected = Some(expected);
        self.receiver.expect(Some(expected));
    }

    /// Answers at once.
    pub fn send(&mut self, answer: &Prepared) {
        self.transmitter.send(answer);
    }
}
