//! What a device hears, and what it makes of it.

use super::port::Trigger;
use crate::clock::Correction;
use crate::error::Error;
use crate::hex::Hex;
use crate::sync::Sync;

/// One of the two ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PortId {
    /// The first.
    A,
    /// The second.
    B,
}

impl PortId {
    /// The other one.
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Where a frame goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Path {
    /// Out of the other port.
    Forward,
    /// Out of the port it came in.
    Reflect,
    /// Nowhere.
    Absorb,
}

/// When a start-up frame was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FrameTimes {
    /// The device's counter at the start of the frame, in ns.
    pub sof_ns: u32,
    /// The device's counter now, in ns.
    pub counter_ns: u32,
    /// A clock for the time-outs that nobody sets, in ns.
    pub now_ns: u64,
}

/// What a device makes of a start-up frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use = "the correction and the delay request are left to the caller"]
pub struct Reaction {
    /// Where it goes.
    pub path: Path,
    /// Whether it was good, and if not, why it was not used.
    pub result: Result<(), Error>,
    /// Delay request to send on the reverse port; a last device sends none.
    pub trigger: Trigger,
    /// What to do to the counter.
    pub correction: Correction,
}

/// What the IO exchange gave a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Output<'a> {
    /// Its output bytes.
    pub data: &'a [u8],
    /// The master's time at the start of the frame, seen here, in ns.
    pub reference_ns: u32,
    /// What to do to the counter.
    pub correction: Correction,
}

/// A SYNC frame, and when it was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeardSync {
    /// The frame as it came.
    pub sync: Sync,
    /// The device's counter at its start, in ns.
    pub sof_ns: u32,
}

servowire_core::one_line!(PortId {
    Self::A => "A";
    Self::B => "B";
});
servowire_core::one_line!(Path {
    Self::Forward => "forward";
    Self::Reflect => "reflect";
    Self::Absorb => "absorb";
});
servowire_core::one_line!(Reaction {
    Self { path, result: Ok(()), trigger, correction } => "{}, trigger {}, {}", path, trigger, correction;
    Self { path, result: Err(error), .. } => "{}, not used: {}", path, error;
});
servowire_core::one_line!(Output<'_> {
    Self { data, reference_ns, correction } => "{} at {} ns, {}", Hex(data), reference_ns, correction;
});
servowire_core::one_line!(HeardSync { Self { sync, sof_ns } => "{}, heard at {} ns", sync, sof_ns; });
