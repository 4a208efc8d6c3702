//! Waits by giving the time back. Every future may be dropped at any point: a request that has begun goes out whole, for which the
//! destructor waits some microseconds if software switches the line driver, and the next call waits until the line is free.
//! Whether a request that changes the encoder has had its effect is not known then.
//!
//! The UART's `read` should be free of side effects when it is dropped, as that of buffered UARTs is; otherwise bytes are lost,
//! which costs the exchange in which it happens. Its `write` should take all bytes or none when it is dropped.

use embedded_io_async::{ErrorType, Read, Write};
use servowire_core::run_async as run;

use crate::Timer;
use crate::race::{self, race};

driver!(awaited, [Read, Write], Timer, async);

/// What comes until a time, or an error of the UART.
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
