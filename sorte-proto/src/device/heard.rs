//! What a device hears and how it reacts.

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
    /// Returns the other port.
    pub const fn other(self) -> Self {
        match self {
            Self::A => Self::B,
            Self::B => Self::A,
        }
    }
}

/// Where a frame is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Path {
    /// The frame leaves through the other port.
    Forward,
    /// The frame leaves through the port at which it came in.
    Reflect,
    /// Nowhere.
    Absorb,
}

/// When a start-up frame was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct FrameTimes {
    /// The device's counter at the capture of the frame's start, in ns: see
    /// [`Preamble::capture_ns`](crate::Preamble::capture_ns).
    pub sof_ns: u32,
    /// The device's counter now, in ns.
    pub counter_ns: u32,
    /// A free-running clock for the time-outs, in ns.
    pub now_ns: u64,
}

/// How a device reacts to a start-up frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use = "the correction and the delay request are left to the caller"]
pub struct Reaction {
    /// Where the frame is sent.
    pub path: Path,
    /// Whether the frame was good, and if not, why it was not used.
    pub result: Result<(), Error>,
    /// Delay request to send on the reverse port; the last device sends none.
    pub trigger: Trigger,
    /// The correction of the counter.
    pub correction: Correction,
}

/// The data that the IO exchange brought to a device, always from this cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Output<'a> {
    /// The device's output bytes.
    pub data: &'a [u8],
    /// The cycle to which they belong: cycle 0 begins 10 us after the last SYNC frame. On a long line the master sends its
    /// first frame in a later cycle, and it numbers only the cycles in which it sends.
    pub cycle: u64,
    /// The common time at which the master began to send them, in ns modulo 2^32.
    pub trigger_ns: u32,
    /// The sum of the frame's time stamp and the delay from the master, as the published device adds them, in ns.
    pub reference_ns: u32,
    /// The correction of the counter.
    pub correction: Correction,
}

impl Output<'_> {
    /// Returns how old the data are when the device's counter shows `counter_ns`, in ns.
    pub const fn age_ns(&self, counter_ns: u32) -> u32 {
        counter_ns.wrapping_sub(self.trigger_ns)
    }
}

/// What a device has to do now. Times are those of its counter, modulo 2^32.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[must_use]
pub enum Action {
    /// Nothing to do before `until_ns`, unless a frame comes.
    Wait {
        /// When to poll again.
        until_ns: u32,
    },
    /// A cycle of the exchange begins.
    CycleStart {
        /// Its number, from 0.
        cycle: u64,
        /// When it began; less than a cycle ago.
        start_ns: u32,
    },
    /// Send the device's own frame, see [`Device::answer`](super::Device::answer).
    Send {
        /// The cycle in which it is sent.
        cycle: u64,
        /// When the frame has to be sent; this time has not passed.
        at_ns: u32,
    },
    /// No good master frame has come in this cycle, and none will.
    Lost {
        /// Which.
        cycle: u64,
    },
    /// The device has waited too long and is in IDLE again: address, clock and line delay are forgotten.
    Restart,
}

/// A SYNC frame, and when it was heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeardSync {
    /// The frame as received.
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
    Self { data, cycle, reference_ns, correction, .. } =>
        "{} of cycle {} at {} ns, {}", Hex(data), cycle, reference_ns, correction;
});
servowire_core::one_line!(Action {
    Self::Wait { until_ns } => "wait until {} ns", until_ns;
    Self::CycleStart { cycle, start_ns } => "cycle {} begins at {} ns", cycle, start_ns;
    Self::Send { cycle, at_ns } => "send in cycle {} at {} ns", cycle, at_ns;
    Self::Lost { cycle } => "cycle {} has brought nothing", cycle;
    Self::Restart => "restart";
});
servowire_core::one_line!(HeardSync { Self { sync, sof_ns } => "{}, heard at {} ns", sync, sof_ns; });
