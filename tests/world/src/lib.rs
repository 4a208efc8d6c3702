#![doc = include_str!("../README.md")]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    clippy::std_instead_of_core
)]

mod bits;
mod cable;
mod draw;
mod fault;
mod host;
mod layout;
mod scenario;
mod tally;
mod truth;
mod wanted;
mod world;

pub use bits::{Bits, Framing, Message};
pub use cable::{Arrival, Cable};
pub use draw::Draw;
pub use fault::{Fault, Kind, Planned, Rates, Script};
pub use host::{Delivery, Host, Stamp};
pub use scenario::Scenario;
#[cfg(feature = "proptest")]
pub use scenario::strategy::{faults, scenarios};
pub use tally::Tally;
pub use truth::{Act, Handed, Id, Origin, Speaker, Transmission, Truth, Verdict};
pub use wanted::{Seed, first_seed, wanted_events};
pub use world::{Block, Event, Unit, Wire, World};
