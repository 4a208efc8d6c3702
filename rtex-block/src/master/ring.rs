use super::axis::Axis;
use super::config::StopCategory;
use super::counter::{CommandCounter, Turn};
use super::heard::Heard;
use super::state::{AxisState, RingSwitchOnError, StopReason};
use crate::header::MacId;
use crate::sub::Command32;

/// All axes of a ring, in step: one call in every update period.
///
/// As soon as one axis fails the others stop in the same call: at once if the communication has failed (no block comes on
/// time), as the System Design Guide for Master requires; otherwise each as its [configuration](super::AxisConfig::stop)
/// says, which is at once unless changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ring<const N: usize> {
    counter: CommandCounter,
    sent: Turn,
    axes: [Axis; N],
    fellows: Fellows,
}

/// Passes failures between the axes of a ring, for axes that are not stored in a [`Ring`].
///
/// In every update period each axis is [looked at](Self::look) after it has heard its block, and then
/// each is [told](Self::tell), before it transmits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fellows {
    failed: Option<u8>,
    timed_out: bool,
    /// An axis has failed by itself, rather than having been stopped on request or with others.
    faulty: bool,
}

impl Fellows {
    /// No axis has failed.
    pub const fn new() -> Self {
        Self { failed: None, timed_out: false, faulty: false }
    }

    /// Begins a round, in which each axis is looked at.
    pub const fn begin(&mut self) {
        self.timed_out = false;
    }

    /// Looks at the axis at a place of the ring.
    pub const fn look(&mut self, place: u8, axis: &Axis) {
        if let AxisState::Stopped(reason) = axis.state() {
            if self.failed.is_none() {
                self.failed = Some(place);
            }
            self.faulty |= !matches!(reason, StopReason::Requested | StopReason::OtherAxis { .. });
        }
        self.timed_out |= axis.has_lost_its_drive();
    }

    /// Tells an axis about a failure: the others stop as configured, and all are switched off if the communication has
    /// failed.
    pub fn tell(&self, axis: &mut Axis) {
        let Some(place) = self.failed else { return };
        let reason = StopReason::OtherAxis { place };
        match axis.config().stop {
            _ if self.timed_out => axis.fail(reason),
            // A stop on request ends on each axis in its own time, but not beside a fault.
            Some(category) if self.faulty || !matches!(axis.state(), AxisState::Stopping(_)) => {
                axis.stop_for(reason, category);
            }
            _ => {}
        }
    }

    /// Returns the place of the axis that failed first.
    pub const fn failed(&self) -> Option<u8> {
        self.failed
    }
}

/// Two axes of a ring have the same address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SameMacId {
    /// The address.
    pub mac_id: MacId,
}

servowire_core::one_line!(SameMacId { Self { mac_id } => "two axes have the MAC-ID {}", mac_id; });

impl core::error::Error for SameMacId {}

/// The axis that stopped a ring.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct RingFailure {
    /// The place of the axis in the ring.
    pub place: u8,
    /// Why the axis stopped.
    pub reason: StopReason,
}

servowire_core::one_line!(RingFailure { Self { place, reason } => "axis {}: {}", place, reason; });

impl core::error::Error for RingFailure {}

impl<const N: usize> Ring<N> {
    /// Creates a ring that sends `invalid` update periods of invalid data (00h) before the first valid commands. It has 1
    /// to 32 axes; any other number does not compile.
    ///
    /// ```compile_fail,E0080
    /// # use core::num::NonZeroU16;
    /// # use rtex_block::{MacId, master::{ActiveCode, Axis, AxisConfig, Limits, Ring}};
    /// # let limits = Limits::new(NonZeroU16::MIN, 50);
    /// # let axis = Axis::new(AxisConfig::new(MacId::new(0).unwrap(), ActiveCode::CyclicPosition, 500_000, limits));
    /// let ring = Ring::new([axis; 33], 4);
    /// ```
    ///
    /// # Errors
    /// [`SameMacId`]
    pub fn new(axes: [Axis; N], invalid: u32) -> Result<Self, SameMacId> {
        const { assert!(N > 0 && N <= MacId::COUNT, "a ring has 1 to 32 drives") };
        let mut seen = 0_u32;
        for axis in &axes {
            let mac_id = axis.config().mac_id;
            let bit = 1_u32.wrapping_shl(mac_id.get().into());
            if seen & bit != 0 {
                return Err(SameMacId { mac_id });
            }
            seen |= bit;
        }
        Ok(Self { counter: CommandCounter::new(invalid), sent: Turn::Invalid, axes, fellows: Fellows::new() })
    }

    /// Returns the axes, in the order in which they were passed.
    pub const fn axes(&self) -> &[Axis; N] {
        &self.axes
    }

    /// Returns the axes, for set-points and requests between two updates.
    pub const fn axes_mut(&mut self) -> &mut [Axis; N] {
        &mut self.axes
    }

    /// Returns the counter of the last commands.
    pub const fn counter(&self) -> &CommandCounter {
        &self.counter
    }

    /// Returns the axis that stopped the ring.
    pub fn failure(&self) -> Option<RingFailure> {
        let place = self.fellows.failed()?;
        match self.axes.get(usize::from(place))?.state() {
            AxisState::Stopped(reason) => Some(RingFailure { place, reason }),
            _ => None,
        }
    }

    /// Takes the responses to the last commands, heard until `end_ns`, and returns the next commands; in the 16-byte mode
    /// only their `main` halves are sent.
    pub fn update(&mut self, heard: &[Heard; N], end_ns: u64) -> [Command32; N] {
        for (axis, heard) in self.axes.iter_mut().zip(heard) {
            axis.hear(self.sent, heard, end_ns);
        }
        self.share_failures();
        self.sent = self.counter.next();
        let sent = self.sent;
        self.axes.each_mut().map(|axis| axis.transmission(sent))
    }

    /// Returns invalid data (00h, counter 0) for all drives.
    pub(super) fn invalid(&mut self) -> [Command32; N] {
        self.axes.each_mut().map(|axis| axis.transmission(Turn::Invalid))
    }

    /// Returns whether these blocks come from more than one frame: the echoes of one frame are equal. A drive whose
    /// processing has stopped looks the same.
    pub fn is_torn(&self, heard: &[Heard; N]) -> bool {
        let mut echoes = self.axes.iter().zip(heard).filter_map(|(axis, heard)| {
            let response = heard.response().filter(|response| response.mac_id == axis.config().mac_id)?;
            Some(response.update_counter_echo)
        });
        let first = echoes.next();
        echoes.any(|echo| Some(echo) != first)
    }

    /// Switches all axes on, if all of them are off and ready.
    ///
    /// # Errors
    /// [`RingSwitchOnError`]: the first axis that is not; no axis is switched on.
    pub fn switch_on(&mut self) -> Result<(), RingSwitchOnError> {
        for (axis, place) in self.axes.iter().zip(0..) {
            axis.can_switch_on().map_err(|error| RingSwitchOnError { place, error })?;
        }
        for (axis, place) in self.axes.iter_mut().zip(0..) {
            axis.switch_on().map_err(|error| RingSwitchOnError { place, error })?;
        }
        Ok(())
    }

    /// Switches all axes off.
    pub fn switch_off(&mut self) {
        self.axes.iter_mut().for_each(Axis::switch_off);
    }

    /// Stops all axes on request.
    pub fn stop(&mut self, category: StopCategory) {
        self.axes.iter_mut().for_each(|axis| axis.stop(category));
        self.share_failures();
    }

    /// Reports that the communication has failed for this reason; the [`update`](Self::update) that follows notes the failure.
    pub(super) fn fail(&mut self, reason: StopReason) {
        self.axes.iter_mut().for_each(|axis| axis.fail(reason));
    }

    /// Leaves the stop: every axis waits for Servo_Ready again, or continues from [`Held`](AxisState::Held).
    pub fn clear(&mut self) {
        self.fellows = Fellows::new();
        self.axes.iter_mut().for_each(Axis::clear);
    }

    /// Returns whether every axis is in this state.
    pub fn all_are(&self, state: AxisState) -> bool {
        self.axes.iter().all(|axis| axis.state() == state)
    }

    /// Returns whether the communication with an axis has failed, even if it was stopped for another reason before.
    pub fn is_timed_out(&self) -> bool {
        self.axes.iter().any(Axis::has_lost_its_drive)
    }

    /// Tells the others why one axis has failed.
    fn share_failures(&mut self) {
        self.fellows.begin();
        for (place, axis) in (0..).zip(&self.axes) {
            self.fellows.look(place, axis);
        }
        for axis in &mut self.axes {
            self.fellows.tell(axis);
        }
    }
}
