//! The device's side: two ports, and what a device learns from the frames that pass.
//!
//! Sans-IO: frames and the time go in, and actions come out. The caller moves bytes between the ports as [`Reaction::path`]
//! says, sends the delay requests that are asked for, and writes the corrections into its counter. A frame in a buffer goes
//! through [`Device::hear`]; a port that forwards byte by byte takes a [`Passage`]. In the IO exchange [`Device::poll`]
//! says when a cycle begins, when the device must send its own frame and in which cycle no frame arrived;
//! [`Device::hear_exchange`] returns the data of a frame that belongs to the present cycle. The device is silent until the
//! first master frame of the exchange.
//!
//! Data are used only if their checksum is right. (The published device uses them in any case.)

mod config;
mod exchange;
mod heard;
mod machine;
mod mode;
mod passage;
mod port;
mod raster;

pub use config::{Config, Counters, PortCounters};
pub use heard::{Action, FrameTimes, HeardSync, Output, Path, PortId, Reaction};
pub use machine::Device;
pub use mode::Forwarding;
pub use passage::Passage;
pub use port::{Port, PortFlags, Seen, State, Trigger};
