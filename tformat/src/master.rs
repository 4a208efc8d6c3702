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
//! let mut transaction = Transaction::start(Request::Id0, line, 0);
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
//! let Progress::Done(Response::Id0(single)) = progress else { panic!("{progress:?}") };
//! assert_eq!(single.abs.get(), 1_883_572);
//! ```

mod eeprom;
mod reset;
mod transaction;

pub use eeprom::{EepromAccess, Page};
pub use nrz_line::{ErrorRate, Polling};
pub use reset::Reset;
pub use transaction::{Line, Progress, Transaction, parse_echoed};

use crate::{Error, ErrorClass, Request};

/// What a procedure of several transactions wants next.
pub type Step<T> = nrz_line::Step<Request, T, Error>;

/// How many transactions went well, and how many failed with which [`ErrorClass`].
pub type Counters = nrz_line::Counters<{ ErrorClass::ALL.len() }>;
