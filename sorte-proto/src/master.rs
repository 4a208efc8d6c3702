//! The controller's side: the start-up sequence, then the IO exchange.
//!
//! Sans-IO. [`Master::poll`] says what to send and when; [`Master::hear`] takes what comes back. Every wait ends:
//! an answer that does not come, devices that fall silent, or a line that changes takes the master back to IDLE with an
//! [`Action::Restart`] that says why; after a pause it restarts. (The published master waits for ever.)
//!
//! ```text
//!  IDLE -> DISCOVERY -> PARAM -> LINE_DELAY -> SYNC -> IO_EXCHANGE
//!           10 x 1 ms   10 x 1 ms  16 x 1 ms  1024 x 10 us   every 4 us
//! ```

mod action;
mod answers;
mod config;
mod cycle;
mod heard;
mod machine;

pub use action::{Action, Outgoing};
pub use config::{Config, Counters, State};
pub use heard::Heard;
pub use machine::Master;
