//! The encoder's UART. It has no FIFO switched on, for the HAL's would tell of two bytes and not of one; the driver reads faster than
//! bytes come.

use core::fmt;

use embedded_io::{Error, ErrorKind, ErrorType, Read, ReadReady, Write};
use teensy4_bsp::hal::lpuart::{Lpuart, Status};

/// A UART that goes on after an overrun.
pub struct Uart(pub Lpuart);

/// A byte with a wrong stop bit, noise, or bytes that were lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineFault;

impl fmt::Display for LineFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("framing, noise or overrun")
    }
}

impl core::error::Error for LineFault {}

impl Error for LineFault {
    fn kind(&self) -> ErrorKind {
        ErrorKind::InvalidData
    }
}

impl ErrorType for Uart {
    type Error = LineFault;
}

impl ReadReady for Uart {
    #[inline]
    fn read_ready(&mut self) -> Result<bool, LineFault> {
        let status = self.0.status();
        if status.contains(Status::OVERRUN) {
            // Until it is cleared nothing is received.
            self.0.clear_status(Status::OVERRUN);
            return Err(LineFault);
        }
        Ok(status.contains(Status::RECEIVE_FULL))
    }
}

impl Read for Uart {
    #[inline]
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, LineFault> {
        let Some(first) = bytes.first_mut() else { return Ok(0) };
        while !self.read_ready()? {}
        let read = self.0.try_read();
        self.0.clear_status(Status::NOISY | Status::FRAME_ERROR | Status::PARITY_ERROR);
        *first = read.ok().flatten().ok_or(LineFault)?;
        Ok(1)
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, LineFault> {
        self.0.write(bytes).map_err(|_| LineFault)
    }

    fn flush(&mut self) -> Result<(), LineFault> {
        self.0.flush().map_err(|_| LineFault)
    }
}
