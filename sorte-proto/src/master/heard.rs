//! What a master has heard.

use crate::evidence::{Evidence, Positions};
use crate::exchange::DeviceFrameView;

/// What a good frame was.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Heard<'a> {
    /// A start-up frame that has come back.
    StartUp,
    /// A device's frame of the IO exchange.
    Device {
        /// The frame.
        frame: DeviceFrameView<'a>,
        /// The cycle to which it belongs by its time; `None` for a cycle that the host has skipped.
        cycle: Option<u64>,
        /// Capture of its start, in ns.
        sof_ns: u64,
    },
}

servowire_core::one_line!(Heard<'_> {
    Self::StartUp => "start-up frame";
    Self::Device { frame, sof_ns, .. } => "{} at {} ns", frame, sof_ns;
});

impl<'a> Heard<'a> {
    /// The device's frame, if it is one.
    pub const fn device(self) -> Option<DeviceFrameView<'a>> {
        match self {
            Self::StartUp => None,
            Self::Device { frame, .. } => Some(frame),
        }
    }

    /// Returns the evidence in it for a control loop; [`Evidence::NEVER`] if it is not a device's frame. The caller
    /// has to know that the line carries positions.
    pub fn evidence(self, positions: Positions) -> Evidence {
        match self {
            Self::StartUp => Evidence::NEVER,
            Self::Device { frame, sof_ns, .. } => Evidence::of(frame, positions, sof_ns),
        }
    }
}
