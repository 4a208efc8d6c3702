//! The controller's side as state machines without I/O. You tell them what arrived and what time it is; they say what to do
//! next. Time is a count of nanoseconds from any origin.
//!
//! * [`Transaction`] handles one request and its response, [`BusTransaction`] one request and the responses of several encoders,
//!   with time-outs and all checks.
//! * [`GuardedReset`] and [`VerifiedWrite`] do once what cannot be undone, and end as done, not done, or with an unknown effect;
//!   they are built on [`Reset`], [`Write`] and [`EepromRead`].
//! * [`Detection`] finds an encoder and its widths. All of these consist of several transactions and drive them by [`Step`];
//!   `servowire_core::run` runs any of them to its end.
//! * [`Cycle`] repeats a readout at a fixed period.
//! * [`Counters`] and [`ErrorRate`] keep track of what was refused.
//!
//! ```
//! use nikon_aformat::master::{Line, Progress, Transaction};
//! use nikon_aformat::{BitOrder, BitRate, EncoderAddress, Operation, Request, Resolution};
//!
//! let request = Request::new(EncoderAddress::ZERO, Operation::Abs40Mt);
//! let mut transaction = Transaction::start(request, Resolution::new(17, 16)?, Line::new(BitRate::Mbit4), 0);
//! let sent = transaction.transmission();
//! assert_eq!((sent.frames.to_string().as_str(), sent.end_ns), ("4027", 4_500));
//!
//! // The response comes in one block, 3 us after the request; its last delimiter ends at 25.5 us.
//! let heard = [0x2085_u16, 0xf64a, 0x8009, 0x80a1].map(|word| Some(word.reverse_bits()));
//! let progress = transaction.hear(&heard, 25_500);
//! // Command 4 asks all encoders: seven others may have their turn of 23.5 us, and the next request is 10 us later.
//! let Progress::Done { value, ready_ns: 200_500 } = progress else { panic!("{progress:?}") };
//! assert_eq!(value.response.abs(), Some(51_200 << 17 | 86_639));
//! assert_eq!((value.sampled_ns, value.began_ns), (4_500, 7_500));
//! # Ok::<(), nikon_aformat::OutOfRange>(())
//! ```

mod cycle;
mod detection;
mod eeprom;
mod guarded;
mod hunt;
mod line;
mod reset;
mod transaction;
mod verified;
mod write;

pub use cycle::{Cycle, PeriodTooShort};
pub use detection::{Detected, Detection};
pub use eeprom::{EepromRead, READ_POLLING, WRITE_POLLING};
pub use guarded::GuardedReset;
pub use line::Line;
pub use reset::Reset;
pub use servowire_core::{ErrorRate, Polling};
pub use transaction::{BusTransaction, Exchange, Transaction, Transmission};
pub use verified::VerifiedWrite;
pub use write::Write;

use crate::error::{Error, ErrorClass};
use crate::request::Request;
use crate::response::Response;

/// What a procedure of several transactions asks for next.
pub type Step<T> = servowire_core::Step<Request, T, Error>;

servowire_core::procedures!(Request => Response, Error {
    Reset => Response;
    GuardedReset => Response;
    Write => Response;
    VerifiedWrite => ();
    EepromRead => u16;
    Detection => Detected;
});

/// The state of a transaction.
pub type Progress<T> = servowire_core::Progress<T, Error>;

/// How many transactions succeeded, and how many failed with each [`ErrorClass`].
pub type Counters = servowire_core::Counters<{ ErrorClass::ALL.len() }>;
