//! An encoder's end of the line: an answer that is ready, and the unit that starts it.

use crate::port::{Prepared, Receiver, Transmitter, Unit};

/// Answers made ahead, which the receiver starts whatever the processor does then.
pub struct Answering {
    transmitter: Transmitter,
    receiver: Receiver,
    /// The unit that starts what the transmitter holds.
    expected: Option<u16>,
}

impl Answering {
    /// Made of these.
    pub const fn new(transmitter: Transmitter, receiver: Receiver) -> Self {
        Self { transmitter, receiver, expected: None }
    }

    /// The next unit of the line, and whether what is held is on its way; if that waits for another unit it is gone.
    pub fn take(&mut self) -> Option<(Unit, bool)> {
        let unit = self.receiver.take()?;
        let Some(expected) = self.expected.take() else { return Some((unit, false)) };
        self.receiver.expect(None);
        let started = unit.framed && unit.content == expected;
        if started {
            // The receiver has started it, or was told too late to expect it.
            self.transmitter.start();
        } else {
            self.transmitter.discard();
        }
        Some((unit, started))
    }

    /// Whether an answer is ready.
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
