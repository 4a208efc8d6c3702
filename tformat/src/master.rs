//! The controller's side as state machines without I/O. You tell them what arrived and what time it is; they say what to do
//! next. Time is a count of nanoseconds from any origin.
//!
//! * [`Transaction`] handles one request and its response: time-outs, echoes, late interrupts, all checks.
//! * [`Reset`], [`SingleTurnZero`], [`MultiTurnZero`], [`EepromAccess`] and [`Detection`] consist of several transactions and
//!   drive them by [`Step`].
//! * [`Counters`] and [`ErrorRate`] keep track of what was refused.
//!
//! ```
//! use tformat::master::{Line, Progress, Transaction};
//! use tformat::{BitRate, Request, Response};
//!
//! // The receiver is on all the time, and a block is handed over when the line has been idle for a while.
//! let line = Line::new(BitRate::Mbit2_5).with_hand_over_ns(40_000);
//! let mut transaction = Transaction::start(Request::ReadSingleTurn, line, 0);
//! assert_eq!(transaction.transmission().frame.as_bytes(), [0x02]);
//!
//! // Nothing was handed over yet when it is polled; it wants to be polled again at 58 us.
//! assert_eq!(transaction.poll(30_000), Progress::Pending { until_ns: 58_001 });
//! // The request as it was heard and, 3 us later, the six fields of the response; the last byte ended at 31 us.
//! let progress = transaction.hear(&[0x02, 0x02, 0x20, 0xb4, 0xbd, 0x1c, 0x37], 31_000);
//! let Progress::Done { value, ready_ns: 31_000 } = progress else { panic!("{progress:?}") };
//! assert_eq!(value.response.abs().unwrap().get(), 1_883_572);
//! assert_eq!((value.sampled_ns, value.began_ns), (4_480, 7_000));
//! ```

mod detection;
mod echo;
mod eeprom;
mod line;
mod reset;
mod transaction;
mod turns;
mod witness;
mod zero;

use crate::error::{Error, ErrorClass};
use crate::message::{AllData, MultiTurn, SingleTurn};
use crate::request::Request;
use crate::response::Response;

pub use detection::Detection;
pub use echo::parse_echoed;
pub use eeprom::EepromAccess;
pub use line::Line;
pub use reset::Reset;
pub use servowire_core::{ErrorRate, Polling};
pub use transaction::{DriverOff, Exchange, Progress, Transaction, Transmission};
pub use turns::MultiTurnZero;
pub use zero::SingleTurnZero;

/// What a procedure of several transactions asks for next.
pub type Step<T> = servowire_core::Step<Request, T, Error>;

servowire_core::procedures!(Request => Response, Error {
    Reset => SingleTurn;
    SingleTurnZero => SingleTurn;
    MultiTurnZero => MultiTurn;
    EepromAccess => u8;
    Detection => AllData;
});

/// How many transactions succeeded, and how many failed with each [`ErrorClass`].
pub type Counters = servowire_core::Counters<{ ErrorClass::ALL.len() }>;

/// How often a busy EEPROM is polled: every millisecond, 40 times, which is twice the 18 ms that an encoder takes to write
/// a byte.
pub const EEPROM_POLLING: Polling = Polling { interval_ns: 1_000_000, max_tries: 40 };
