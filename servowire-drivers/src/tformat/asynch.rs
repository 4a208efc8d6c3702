//! Waits by yielding to the executor. Every future may be dropped at any point. A request that has begun is sent completely,
//! for which the destructor waits some microseconds if software switches the line driver; the next call waits until the line is
//! free. After a drop it is not known whether a request that changes the encoder took effect.
//!
//! The UART's `read` should have no side effects when it is dropped, as with buffered UARTs; otherwise bytes are lost, which
//! costs the exchange in which it happens. Its `write` should take all bytes or none when it is dropped.

use embedded_io_async::{ErrorType, Read, Write};
use servowire_core::run_async as run;

use crate::Timer;
use crate::race::{self, race};

driver!(awaited, [Read, Write], Timer, async);

/// Waits for data until a given time; returns the data or an error of the UART.
async fn read<U: Read>(
    uart: &mut U,
    bytes: &mut [u8],
    line: &mut quiet::Line,
    timer: &mut impl Timer,
    until_ns: u64,
) -> Result<Heard<Result<usize, U::Error>>, ClockError> {
    let what = race(uart.read(bytes), sleep(line, timer, until_ns)).await?;
    Ok(Heard { what, now_ns: line.now_ns(timer)? })
}

async fn sleep(line: &mut quiet::Line, timer: &mut impl Timer, until_ns: u64) -> Result<(), ClockError> {
    race::sleep(timer, |timer| line.after_ns(timer, until_ns), until_ns).await
}
