//! T-Format encoders: Tamagawa and others, 2.5 or 5 Mbit/s, at a plain UART (8N1).
//!
//! [`blocking`] spins while it waits, some tens of microseconds a call; [`asynch`] gives the time back. Both have the same
//! `Encoder` with the same calls.

#[cfg(feature = "async")]
pub mod asynch;
pub mod blocking;

use tformat::master::{Line, Progress, Transaction};
use tformat::{Error, Request};

/// Longest request or answer.
const MAX_BYTES: usize = 16;

/// Feeds bytes that were received back to back, the last one ending at `end_ns`.
fn feed(transaction: &mut Transaction, line: &Line, bytes: &[u8], end_ns: u64) -> Progress {
    let field_ns = u64::from(line.rate.fields_ns(1));
    let mut progress = transaction.progress();
    for (behind, byte) in (0..bytes.len()).rev().zip(bytes) {
        let behind_ns = u64::try_from(behind).unwrap_or(0).saturating_mul(field_ns);
        progress = transaction.byte(*byte, end_ns.saturating_sub(behind_ns));
    }
    progress
}

/// When the longest answer to this request is over, if it began at `start_ns`.
fn worst_ns(line: &Line, request: Request, start_ns: u64) -> u64 {
    let fields = request.emit().fields().saturating_add(12);
    let wait = u64::from(line.response_timeout_ns).saturating_add(line.rate.fields_ns(fields).into());
    start_ns.saturating_add(wait)
}

/// When the last bit of the request has left.
fn sent_ns(line: &Line, request: Request, start_ns: u64) -> u64 {
    start_ns.saturating_add(line.rate.fields_ns(request.emit().fields()).into())
}

/// The line has to be silent for two fields after something that nobody has asked for.
fn silence_ns(line: &Line) -> u32 {
    line.rate.fields_ns(2)
}

/// The driver is on one bit before the start bit.
fn lead_ns(line: &Line) -> u64 {
    line.rate.bit_ns().into()
}

/// The answer to another request than was sent. Never: the transaction checks it.
fn other(request: Request) -> Error {
    let want = request.data_id().control_field().get();
    Error::CfMismatch { got: want, want }
}
