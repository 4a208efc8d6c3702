//! Waits by spinning.

use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_core::run;

use crate::Clock;
use crate::quiet::spin;

driver!(spun, [Read, ReadReady, Write], Clock);

/// Waits for data until a given time; returns the data or an error of the UART.
#[inline(always)]
fn read<U: Read + ReadReady>(
    uart: &mut U,
    bytes: &mut [u8],
    line: &mut quiet::Line,
    clock: &mut impl Clock,
    until_ns: u64,
) -> Result<Heard<Result<usize, U::Error>>, ClockError> {
    spin(line, clock, until_ns, || match uart.read_ready() {
        Ok(true) => Some(uart.read(bytes)),
        Ok(false) => None,
        Err(error) => Some(Err(error)),
    })
}

fn sleep(line: &mut quiet::Line, clock: &mut impl Clock, until_ns: u64) -> Result<(), ClockError> {
    line.wait_until(clock, until_ns)
}
