//! Waits by giving the time back. Every future may be dropped at any point: a request that has begun goes out whole, for which the
//! destructor waits some microseconds if software switches the line driver, and the next call waits until the line is free.
//! Whether a request that changes the encoder has had its effect is not known then.
//!
//! The UART's `read` should be free of side effects when it is dropped, as that of buffered UARTs is; otherwise bytes are lost,
//! which costs the exchange in which it happens. Its `write` should take all bytes or none when it is dropped.

use core::ops::ControlFlow;

use embedded_io_async::{ErrorType, Read, Write};
use servowire_core::{ClockError, Procedure, run_async as run};
use tformat::master::{Detection, EEPROM_POLLING, EepromAccess, Exchange, Line, Reset, Transaction};
use tformat::{
    Address, AllData, BitRate, Doubt, Evidence, Page, Policy, Request, Resolution, Response, Sample, SingleTurn,
};

use super::tuning::{Tuned, Tuning};
use super::{LOST, MAX_BYTES, Released, all_data, longest_ns, refused, silence_ns, times};
use crate::direction::Switch;
use crate::exchange;
use crate::quiet::{self, Settle};
use crate::race::race;
use crate::sending::Sending;
use crate::{Direction, Error, PinTooSlow, Timer};

driver!(awaited, [Read, Write], Timer, async);

/// What comes until a time, or an error of the UART.
async fn read<U: Read>(
    uart: &mut U,
    bytes: &mut [u8],
    _: &mut quiet::Line,
    timer: &mut impl Timer,
    until_ns: u64,
) -> Result<Option<Result<usize, U::Error>>, ClockError> {
    race(uart.read(bytes), timer.wait_until(until_ns)).await
}

async fn sleep(_: &mut quiet::Line, timer: &mut impl Timer, until_ns: u64) -> Result<(), ClockError> {
    timer.wait_until(until_ns).await
}
