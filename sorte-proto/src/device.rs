//! The device's side: two ports, and what a device learns from the frames that pass.
//!
//! Sans-IO. The caller moves bytes between the ports as [`Reaction::path`] says, sends the delay requests and device
//! frames that are asked for, and writes the corrections into its counter. A frame in a buffer goes through
//! [`Device::hear`]; a port that forwards byte by byte takes a [`Passage`].
//!
//! Data are used only after their checksum was found right. (The published device uses them in any case.)

mod config;
mod heard;
mod machine;
mod mode;
mod passage;
mod port;

pub use config::{Config, Counters, PortCounters};
pub use heard::{FrameTimes, HeardSync, Output, Path, PortId, Reaction};
pub use machine::Device;
pub use mode::Forwarding;
pub use passage::Passage;
pub use port::{Port, PortFlags, Seen, State, Trigger};
