//! Waits by spinning.

use core::ops::ControlFlow;

use embedded_io::{ErrorType, Read, ReadReady, Write};
use servowire_core::{ClockError, Procedure, run};
use tformat::master::{Detection, EEPROM_POLLING, EepromAccess, Exchange, Line, Reset, Transaction};
use tformat::{
    Address, AllData, BitRate, Doubt, Evidence, Page, Policy, Request, Resolution, Response, Sample, SingleTurn,
};

use super::tuning::{Tuned, Tuning};
use super::{LOST, MAX_BYTES, Released, all_data, longest_ns, refused, silence_ns, times};
use crate::direction::Switch;
use crate::exchange;
use crate::quiet::{self, Settle, spin};
use crate::sending::Sending;
use crate::{Clock, Direction, Error, PinTooSlow};

driver!(spun, [Read, ReadReady, Write], Clock);

/// What comes until a time, or an error of the UART.
fn read<U: Read + ReadReady>(
    uart: &mut U,
    bytes: &mut [u8],
    line: &mut quiet::Line,
    clock: &mut impl Clock,
    until_ns: u64,
) -> Result<Option<Result<usize, U::Error>>, ClockError> {
    spin(line, clock, until_ns, || match uart.read_ready() {
        Ok(true) => Some(uart.read(bytes)),
        Ok(false) => None,
        Err(error) => Some(Err(error)),
    })
}

fn sleep(line: &mut quiet::Line, clock: &mut impl Clock, until_ns: u64) -> Result<(), ClockError> {
    line.wait_until(clock, until_ns)
}
