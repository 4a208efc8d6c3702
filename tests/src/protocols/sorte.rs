//! SORTE: frames, what devices do to them, time, state machines, SYNC0, DRV8711.

mod chain;
mod device;
mod drv8711;
mod exchange;
mod frames;
mod startup;
mod sync0;
mod time;

use sorte_proto::Error;

use crate::row::{Check, Fault};

pub(super) const TOPICS: &[(&str, Check)] = &[
    ("crc8", frames::crc8),
    ("device_state", device::device_state),
    ("discovery_chain", chain::discovery),
    ("drv8711", drv8711::drv8711),
    ("ioex_device", exchange::device),
    ("ioex_master", exchange::master),
    ("ioex_master_negative", exchange::master_negative),
    ("line_delay", time::line_delay),
    ("master_startup", startup::master_startup),
    ("negative", frames::negative),
    ("param", frames::param),
    ("process_data_slice", exchange::process_data_slice),
    ("sync0_closed_loop", sync0::closed_loop),
    ("sync0_figures", sync0::figures),
    ("sync0_fsm", sync0::fsm),
    ("sync_chain", chain::sync),
    ("time_sync", time::time_sync),
    ("timing_budget", time::timing_budget),
];

/// Where a row comes from. It says how much the row is worth, not what to check.
#[derive(serde::Deserialize)]
enum Origin {
    #[serde(rename = "vendor-firmware")]
    VendorFirmware,
    #[serde(rename = "both")]
    Both,
    #[serde(rename = "model")]
    Model,
}

/// A frame of a row that is refused where it should be read.
fn refused(error: Error) -> Fault {
    Fault::Differs { what: "parse", expected: "a frame".to_owned(), real: error.to_string() }
}

/// The class of a refusal as the rows name it, or "Ok". They have one word for a frame that is too long and for one that
/// is too short for its type, and another for less than a header of 8 bytes, or less than a frame of the exchange.
fn outcome<T>(result: &Result<T, Error>) -> String {
    match result {
        Ok(_) => "Ok".to_owned(),
        Err(Error::TooLong { .. } | Error::Truncated { got: 8.., want: 14 | 40 | 1030 }) => "LengthMismatch".to_owned(),
        Err(error) => format!("{:?}", error.class()),
    }
}
