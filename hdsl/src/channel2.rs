//! What can be checked in safe channel 2 without knowing the encoder's scaling.

use crate::error::Error;
use crate::frame::V_FRAME;
use crate::master::HFrame;
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

/// Watches safe channel 2.
///
/// It checks only what the documents say about the channel. The application has to compare the two safe positions, because the
/// scaling and the complement of the second one depend on the encoder.
///
/// ```
/// use hdsl::device::{Device, Fault};
/// use hdsl::master::Master;
/// use hdsl::{Channel2Findings, Channel2Monitor, Dialect, EncoderId};
///
/// let (mut master, mut encoder) = (Master::new(Dialect::SICK), Device::new(EncoderId::try_from(0x00153)?));
/// let mut monitor = Channel2Monitor::new();
/// let mut findings = Channel2Findings::empty();
/// for frame in 0..200_u64 {
///     if frame == 150 {
///         encoder.set_fault(Fault::StuckToggle);
///     }
///     let answer = encoder.set_position(0).hear(master.transmission().head.bits());
///     let h_frame = master.hear_bits(answer.map_or(u64::MAX, |answer| answer.bits), None, 11_520 * frame);
///     findings |= monitor.h_frame(h_frame).unwrap_or_default();
/// }
/// assert_eq!((findings, monitor.age()), (Channel2Findings::TOG2, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Channel2Monitor {
    /// TOG2 of the V-frame before, if its block was sound.
    toggle: Option<bool>,
    /// Number of the H-frame before.
    number: Option<u32>,
    /// Number of H-frames since the last sound block.
    frames: u32,
}

impl Channel2Monitor {
    /// Creates the state before the first H-frame.
    pub const fn new() -> Self {
        Self { toggle: None, number: None, frames: 0 }
    }

    /// Takes every H-frame; returns the faults of the V-frame that ended with it, if one did. Lost frames and restarts of
    /// the link are taken into account: TOG2 is compared in neighbouring V-frames only.
    pub fn h_frame(&mut self, frame: &HFrame) -> Option<Channel2Findings> {
        let passed = self.number.map_or(1, |before| frame.number.wrapping_sub(before));
        self.number = Some(frame.number);
        self.frames = self.frames.saturating_add(passed);
        if frame.gap {
            self.toggle = None;
        }
        let findings = frame.v_frame.as_ref().map(|blocks| self.judge(blocks));
        if frame.restarted.is_some() {
            self.toggle = None;
        }
        findings
    }

    /// Takes the blocks of the next V-frame, if there are no H-frames to take; none may be left out.
    pub fn v_frame(&mut self, frame: &VFrame) -> Channel2Findings {
        self.frames = self.frames.saturating_add(V_FRAME.into());
        self.judge(frame)
    }

    fn judge(&mut self, frame: &VFrame) -> Channel2Findings {
        let block = frame.safe2;
        let before = self.toggle.take();
        if !block.is_sound() {
            return Channel2Findings::STALE;
        }
        self.frames = 0;
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

    /// Number of whole V-frames, of eight H-frames each, since the last sound block; since the first H-frame if there was none.
    /// Lost frames count if they were [reported](crate::master::Master::skip).
    pub const fn age(&self) -> u32 {
        self.frames / 8
    }
}
