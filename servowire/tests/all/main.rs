//! The program run as a user runs it, and its inside where the outside does not tell.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::too_many_lines,
    clippy::unwrap_used,
    unreachable_pub
)]

mod answers;
mod bad_input;
mod bundled;
mod bytes;
mod causes;
mod cmd;
mod cnc;
mod common;
mod costs;
mod explain;
mod formats;
mod frames;
mod full;
mod hdsl;
mod holes;
mod hostile;
mod laws;
mod lines;
mod live;
mod misplaced;
mod nikon;
mod outputs;
mod overwrite;
mod packed;
#[path = "../random/mod.rs"]
mod random;
mod read_position;
mod recognise;
mod rtex;
mod samples;
mod scopes;
mod serial;
mod surfer;
mod talk;
mod talk_memory;
mod talk_ports;
mod talk_relay;
