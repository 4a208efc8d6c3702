//! What can be checked in safe channel 2 without knowing the encoder's scaling.

use crate::error::Error;
use crate::registers::Status2;
use crate::vframe::VFrame;

/// The faults of safe channel 2, according to the SICK manual (p. 55-58) and the HDSL register list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Channel2Findings(u8);

bitflags::bitflags! {
    impl Channel2Findings: u8 {
        /// The block has a bad word or a wrong CRC: nothing new is known.
        const STALE = 1 << 0;
        /// FIX2 is not 11100b.
        const FIX2 = 1 << 1;
        /// TOG2 did not alternate between two sound blocks of neighbouring V-frames.
        const TOG2 = 1 << 2;
        /// ERR2: the encoder reports an error of channel 2.
        const ERR2 = 1 << 3;
        /// TEST2: a test is running.
        const TEST2 = 1 << 4;
        /// The encoder says that it has no second position (K27.7).
        const VPOS2 = 1 << 5;
        const _ = !0;
    }
}

servowire_core::show_flags!(Channel2Findings);

/// Watches safe channel 2, V-frame by V-frame.
///
/// It checks only what the documents say about the channel. The application has to compare the two safe positions, because
/// scaling and complement of the second one depend on the encoder.
///
/// ```
/// use hdsl::{Channel2Findings, Channel2Monitor, VFrame};
/// let mut monitor = Channel2Monitor::new();
/// // with every H-frame that has one: monitor.v_frame(&h_frame.v_frame)
/// assert_eq!(monitor.v_frame(&VFrame::default()), Channel2Findings::STALE);
/// assert_eq!(monitor.age(), 1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Channel2Monitor {
    /// TOG2 of the V-frame before, if its block was sound.
    toggle: Option<bool>,
    age: u32,
}

impl Channel2Monitor {
    /// Creates the state at the beginning of a link; use it again after a restart.
    pub const fn new() -> Self {
        Self { toggle: None, age: 0 }
    }

    /// Takes the blocks of the next V-frame.
    pub fn v_frame(&mut self, frame: &VFrame) -> Channel2Findings {
        let block = frame.safe2;
        let before = self.toggle.take();
        if !block.is_sound() {
            self.age = self.age.saturating_add(1);
            return Channel2Findings::STALE;
        }
        self.age = 0;
        let status = Status2::from_bits_retain(block.status());
        let toggle = status.contains(Status2::TOG2);
        self.toggle = Some(toggle);
        let mut findings = Channel2Findings::empty();
        findings.set(Channel2Findings::FIX2, !status.is_fixed_part_right());
        findings.set(Channel2Findings::TOG2, before == Some(toggle));
        findings.set(Channel2Findings::ERR2, status.contains(Status2::ERR2));
        findings.set(Channel2Findings::TEST2, status.contains(Status2::TEST2));
        findings.set(Channel2Findings::VPOS2, matches!(block.vpos(), Err(Error::PositionInvalid { .. })));
        findings
    }

    /// Number of V-frames since the last sound block.
    pub const fn age(&self) -> u32 {
        self.age
    }
}
