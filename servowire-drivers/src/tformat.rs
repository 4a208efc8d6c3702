//! T-Format encoders: Tamagawa and others, 2.5 or 5 Mbit/s, at a plain UART (8N1).
//!
//! [`blocking`] spins while it waits, some tens of microseconds a call; [`asynch`] gives the time back. Both have the same
//! `Driver` with the same calls.

#[cfg(feature = "async")]
pub mod asynch;
pub mod blocking;

use tformat::master::Line;
use tformat::{Error, Request};

/// What a `Driver` was made of.
#[derive(Debug, Clone, Copy)]
pub struct Released<U, D, C> {
    /// The UART.
    pub uart: U,
    /// Who switches the line driver.
    pub direction: D,
    /// The clock or timer.
    pub clock: C,
}

/// What a lost answer is to a procedure.
const LOST: Error = Error::NoResponse { echo: false };

/// Longest request and longest answer together.
const MAX_BYTES: usize = 16;

/// How long this request and the longest answer to it take.
fn longest_ns(line: &Line, request: Request) -> u64 {
    let fields = request.emit().fields().saturating_add(12);
    u64::from(line.response_timeout_ns).saturating_add(line.rate.fields_ns(fields).into())
}

/// When the last bit of the request has left, with a start bit not before `start_ns`, so that the line driver may go off.
///
/// What `flush` means differs between UARTs, so the clock says it. A UART that had taken all bytes at `taken_ns`, less than a field
/// later, may have begun as late as that: a request of which the end is cut off may be another one. One that took longer has waited
/// for the line.
fn driver_off_ns(line: &Line, request_end_ns: u64, start_ns: u64, taken_ns: u64) -> u64 {
    let taking_ns = taken_ns.saturating_sub(start_ns);
    if taking_ns < line.rate.fields_ns(1).into() { request_end_ns.saturating_add(taking_ns) } else { request_end_ns }
}

/// The line has to be silent for two fields after something that nobody has asked for.
fn silence_ns(line: &Line) -> u32 {
    line.rate.fields_ns(2)
}

/// The answer to another request than was sent. Never: the transaction checks it.
fn other(request: Request) -> Error {
    let want = request.data_id().control_field().get();
    Error::CfMismatch { got: want, want }
}
