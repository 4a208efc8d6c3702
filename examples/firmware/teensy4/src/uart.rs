//! The encoder's UART. Its FIFO is off, because the HAL's FIFO would report two bytes but not one; the driver reads faster
//! than bytes arrive.

use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_boards::LineFault;
use teensy4_bsp::hal::lpuart::{Lpuart, Status};

/// A UART that continues after an overrun.
pub struct Uart(pub Lpuart);

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
            return Err(LineFault::Damaged);
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
        *first = read.ok().flatten().ok_or(LineFault::Damaged)?;
        Ok(1)
    }
}

impl Write for Uart {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, LineFault> {
        self.0.write(bytes).map_err(|_| LineFault::Damaged)
    }

    fn flush(&mut self) -> Result<(), LineFault> {
        self.0.flush().map_err(|_| LineFault::Damaged)
    }
}
