//! The controller's side as state machines without I/O: they are told what arrived and what time it is, and say what
//! to do next. Time is a count of nanoseconds from any origin.
//!
//! * [`Transaction`] takes one request to its answer: own echo, time-outs, all checks.
//! * [`Reset`] and [`EepromAccess`] are made of several transactions and drive them by [`Step`].
//! * [`Counters`] and [`ErrorRate`] keep account of what was refused.
//!
//! ```
//! use tformat::master::{Line, Progress, Transaction};
//! use tformat::{BitRate, Request, Response};
//!
//! let line = Line::new(BitRate::Mbit2_5).with_echo();
//! let mut transaction = Transaction::start(Request::ReadSingleTurn, line, 0);
//! assert_eq!(transaction.frame().as_bytes(), [0x02]);
//!
//! // the UART receives the own request and, 3 us later, the six fields of the answer, 4 us each
//! let mut now_ns = 4_000;
//! let mut progress = transaction.byte(0x02, now_ns);
//! now_ns += 3_000;
//! for byte in [0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37] {
//!     now_ns += 4_000;
//!     progress = transaction.byte(byte, now_ns);
//! }
//! let Progress::Done { value: Response::ReadSingleTurn(single), .. } = progress else { panic!("{progress:?}") };
//! assert_eq!(single.abs.get(), 1_883_572);
//! ```

mod eeprom;
mod reset;
mod transaction;

use crate::error::{Error, ErrorClass};
use crate::request::Request;

pub use eeprom::EepromAccess;
pub use reset::Reset;
pub use servowire_core::{ErrorRate, Polling};
pub use transaction::{Line, Progress, Transaction, parse_echoed};

/// What a procedure of several transactions wants next.
pub type Step<T> = servowire_core::Step<Request, T, Error>;

/// How many transactions went well, and how many failed with which [`ErrorClass`].
pub type Counters = servowire_core::Counters<{ ErrorClass::ALL.len() }>;

/// How often a busy EEPROM is asked: every millisecond, 40 times, which is twice the 18 ms that an encoder takes to write
/// a byte.
pub const EEPROM_POLLING: Polling = Polling { interval_ns: 1_000_000, max_tries: 40 };
