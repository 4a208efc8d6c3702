use super::axis::{Axis, AxisState, StopReason};
use super::counter::{CommandCounter, Turn};
use crate::command::Command;
use crate::response::Response;

/// All axes of a ring, in step: one call in every update period.
///
/// As soon as one axis fails (its echo stands still, it has an alarm, it does not obey) every other is stopped in
/// the same call, so the commands it gives back are servo-off for all. That is what the guide asks for on a
/// time-out; for an alarm it is this crate's choice, made for coordinated motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ring<const N: usize> {
    counter: CommandCounter,
    sent: Turn,
    axes: [Axis; N],
    failed: Option<u8>,
}

impl<const N: usize> Ring<N> {
    /// A ring that sends `invalid` update periods of invalid data (00h) before the first valid commands.
    pub const fn new(axes: [Axis; N], invalid: u32) -> Self {
        Self { counter: CommandCounter::new(invalid), sent: Turn::Invalid, axes, failed: None }
    }

    /// The axes, in the order they were given.
    pub const fn axes(&self) -> &[Axis; N] {
        &self.axes
    }

    /// The axes, for set-points and requests between two updates.
    pub const fn axes_mut(&mut self) -> &mut [Axis; N] {
        &mut self.axes
    }

    /// The counter that the last commands carried.
    pub const fn counter(&self) -> &CommandCounter {
        &self.counter
    }

    /// Place and reason of the axis that stopped the ring.
    pub fn failure(&self) -> Option<(usize, StopReason)> {
        let place = usize::from(self.failed?);
        match self.axes.get(place)?.state() {
            AxisState::Stopped(reason) => Some((place, reason)),
            _ => None,
        }
    }

    /// Takes the responses to the last commands and gives the next commands.
    pub fn update(&mut self, responses: &[Option<Response>; N]) -> [Command; N] {
        for (axis, response) in self.axes.iter_mut().zip(responses) {
            axis.receive(self.sent, response.as_ref());
        }
        self.stop_together();
        self.sent = self.counter.next();
        self.axes.each_ref().map(|axis| axis.send(self.sent))
    }

    /// Switches all axes on, if all of them are off and ready; gives whether they were.
    pub fn switch_on(&mut self) -> bool {
        let able = self.axes.iter().all(Axis::can_switch_on);
        if able {
            self.axes.iter_mut().for_each(|axis| {
                axis.switch_on();
            });
        }
        able
    }

    /// Switches all axes off.
    pub fn switch_off(&mut self) {
        self.axes.iter_mut().for_each(Axis::switch_off);
    }

    /// Leaves the stop: every axis waits for Servo_Ready again.
    pub fn clear(&mut self) {
        self.failed = None;
        self.axes.iter_mut().for_each(Axis::clear);
    }

    /// Whether every axis is in this state.
    pub fn all_are(&self, state: AxisState) -> bool {
        self.axes.iter().all(|axis| axis.state() == state)
    }

    fn stop_together(&mut self) {
        if self.failed.is_none() {
            let place = self.axes.iter().position(|axis| matches!(axis.state(), AxisState::Stopped(_)));
            self.failed = place.and_then(|place| u8::try_from(place).ok());
        }
        if let Some(place) = self.failed {
            self.axes.iter_mut().for_each(|axis| axis.stop(StopReason::OtherAxis(place)));
        }
    }
}
