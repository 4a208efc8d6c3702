//! Master, device and line, from outside.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod both_ends;
mod common;
mod device_rules;
mod event_order;
mod exchange_rules;
mod hostile;
mod master_bench;
mod master_rules;
mod one_check;
mod patient_discovery;
#[cfg(feature = "serde")]
mod serde;
mod times;
mod values;
