//! The port as a UART of 8N1, for the T-Format drivers: the PIO switches the line driver.

use core::iter;

use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_boards::LineFault;

use crate::port::{Prepared, RingReceiver, Transmitter, Unit};

/// Bits of a unit.
pub const BITS: u8 = 8;

/// Transmitter and receiver of units of [`BITS`] bits.
pub struct Uart {
    transmitter: Transmitter,
    receiver: RingReceiver,
    /// Units taken from the ring but not read yet.
    next: Option<Unit>,
}

impl Uart {
    /// Creates a UART from these.
    pub const fn new(transmitter: Transmitter, receiver: RingReceiver) -> Self {
        Self { transmitter, receiver, next: None }
    }

    fn peek(&mut self) -> Option<Unit> {
        self.next = self.next.or_else(|| self.receiver.take());
        self.next
    }
}

impl ErrorType for Uart {
    type Error = LineFault;
}

impl ReadReady for Uart {
    #[inline]
    fn read_ready(&mut self) -> Result<bool, LineFault> {
        Ok(self.peek().is_some())
    }
}

impl Read for Uart {
    #[inline]
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LineFault> {
        let Some(first) = bytes.first_mut() else { return Ok(0) };
        let Unit { content, framed } = loop {
            if let Some(unit) = self.peek() {
                break unit;
            }
        };
        self.next = None;
        *first = content as u8;
        if framed { Ok(1) } else { Err(LineFault::Framing) }
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, LineFault> {
        self.transmitter.send(&prepared(bytes, 0));
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), LineFault> {
        Ok(())
    }
}

/// Fields of a frame as a message; it begins `wait_cycles` after its start.
pub fn prepared(fields: &[u8], wait_cycles: u32) -> Prepared {
    let mut fields = fields.iter();
    Prepared::new(iter::from_fn(|| fields.next().copied().map(u16::from)), BITS.into(), 0, wait_cycles)
}
