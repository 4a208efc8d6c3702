//! T-Format encoders: Tamagawa and others, 2.5 or 5 Mbit/s, on a plain UART (8N1).
//!
//! [`blocking`] spins while it waits, some tens of microseconds per call; `asynch` (feature `async`) yields to the executor.
//! Both have the same `Driver` with the same calls.

#[macro_use]
mod driver;
mod tuning;

#[cfg(feature = "async")]
pub mod asynch;
pub mod blocking;

use tformat::master::Line;
use tformat::{AllData, Error, Frame, Request, Response};

/// The parts from which a `Driver` was created.
#[derive(Debug, Clone, Copy)]
pub struct Released<U, D, C> {
    /// The UART.
    pub uart: U,
    /// The direction, which switches the line driver.
    pub direction: D,
    /// The clock or timer.
    pub clock: C,
}

/// The error that tells a procedure of a lost answer.
const LOST: Error = Error::NoResponse { echo: false };

/// Bytes of the longest request and the longest answer together.
const MAX_BYTES: usize = 16;

/// Returns how long this request and the longest answer to it take, until the answer is handed over.
fn longest_ns(line: &Line, request: &Frame) -> u64 {
    answered_ns(line, request.fields())
}

/// Returns the same for an unknown request: the longest one.
fn unknown_ns(line: &Line) -> u64 {
    answered_ns(line, 4)
}

fn answered_ns(line: &Line, fields: u8) -> u64 {
    let fields = fields.saturating_add(12);
    let answered_ns = u64::from(line.response_timeout_ns).saturating_add(line.rate.fields_ns(fields).into());
    answered_ns.saturating_add(line.hand_over_ns.into())
}

/// Returns why there was no answer: the encoder is not at fault if the line was still driven when it began to answer.
fn refused<IO, PIN, D>(error: Error, late_ns: u64) -> crate::Error<IO, PIN, Error, D> {
    match late_ns {
        0 => crate::Error::Protocol(error),
        by_ns => crate::Error::DriverLate { by_ns },
    }
}

/// How long the line has to be silent after unexpected data: two fields.
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

#[cfg(test)]
mod tests {
    use super::*;
    use tformat::{Address, BitRate};

    /// A field lasts 4 us, the longest answer has eleven, which begin after 10 us; one more, and what the host needs.
    #[test]
    fn how_long_the_line_may_be_in_use() {
        let line = Line::new(BitRate::Mbit2_5).with_hand_over_ns(3_000);
        let write = Request::write_eeprom(Address::truncate(1), 2);
        assert_eq!(longest_ns(&line, &Request::ReadAll.emit()), 4_000 + 10_000 + 48_000 + 3_000);
        assert_eq!(longest_ns(&line, &write.emit()), 16_000 + 10_000 + 48_000 + 3_000);
        assert_eq!(unknown_ns(&line), 16_000 + 10_000 + 48_000 + 3_000);
    }
}
