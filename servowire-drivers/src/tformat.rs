//! T-Format encoders: Tamagawa and others, 2.5 or 5 Mbit/s, at a plain UART (8N1).
//!
//! [`blocking`] spins while it waits, some tens of microseconds a call; `asynch` (feature `async`) gives the time back. Both have the same
//! `Driver` with the same calls.

#[macro_use]
mod driver;
mod tuning;

#[cfg(feature = "async")]
pub mod asynch;
pub mod blocking;

use tformat::master::Line;
use tformat::{AllData, Error, Frame, Request, Response};

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

/// How long this request and the longest answer to it take, until that is handed over.
fn longest_ns(line: &Line, request: &Frame) -> u64 {
    let fields = request.fields().saturating_add(12);
    let answered_ns = u64::from(line.response_timeout_ns).saturating_add(line.rate.fields_ns(fields).into());
    answered_ns.saturating_add(line.hand_over_ns.into())
}

/// Why there was no answer: not for a reason of the encoder, if the line was still driven when it began to answer.
fn refused<IO, PIN, D>(error: Error, late_ns: u64) -> crate::Error<IO, PIN, Error, D> {
    match late_ns {
        0 => crate::Error::Protocol(error),
        by_ns => crate::Error::DriverLate { by_ns },
    }
}

/// The line has to be silent for two fields after something that nobody has asked for.
fn silence_ns(line: &Line) -> u32 {
    line.rate.fields_ns(2)
}

fn all_data(response: Response) -> Result<AllData, Error> {
    match response {
        Response::ReadAll(all) => Ok(all),
        // Never: the transaction checks it.
        other => Err(Error::CfMismatch {
            got: other.data_id().control_field().get(),
            want: Request::ReadAll.data_id().control_field().get(),
        }),
    }
}
