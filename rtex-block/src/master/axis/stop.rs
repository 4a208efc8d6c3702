//! How an axis stops. A stop takes precedence over everything, and a later stop never makes the one in progress gentler.

use super::Axis;
use super::asking::{Quiet, Slot};
use crate::control::ControlBits;
use crate::master::config::StopCategory;
use crate::master::handshake::Handshake;
use crate::master::progress::{Failure, Progress};
use crate::master::servo_off::ActiveCode;
use crate::master::state::{AxisState, StopReason};
use crate::status::StatusFlags;

impl Axis {
    /// Stops the axis on request, in any state. An axis that is not energised goes to Stopped, servo off.
    pub fn stop(&mut self, category: StopCategory) {
        self.stop_for(StopReason::Requested, category);
    }

    /// The axis stays stopped, with the servo off, until [`clear`](Self::clear). The first reason is kept.
    pub(in crate::master) fn fail(&mut self, reason: StopReason) {
        if !matches!(self.state, AxisState::Stopped(_)) {
            self.enter(AxisState::Stopped(reason), 0);
        }
    }

    /// Stops the axis for this reason; a stop in progress is never made gentler.
    pub(in crate::master) fn stop_for(&mut self, reason: StopReason, category: StopCategory) {
        match self.state {
            AxisState::On if category > StopCategory::Zero && self.can_slow_down() => {
                self.category = category;
                self.enter(AxisState::Stopping(reason), self.config.limits.stop);
                self.slow_down(reason);
            }
            AxisState::Stopping(_) if category > StopCategory::Zero => self.category = self.category.min(category),
            AxisState::Held(_) if category == StopCategory::Two => {}
            AxisState::Stopping(first) | AxisState::Held(first) => self.fail(first),
            _ => self.fail(reason),
        }
    }

    /// Switches the servo off. A stopped axis stays stopped.
    pub fn switch_off(&mut self) {
        match self.state {
            AxisState::Stopping(reason) | AxisState::Held(reason) => self.fail(reason),
            AxisState::SwitchingOn | AxisState::On => {
                self.enter(AxisState::SwitchingOff, self.config.limits.inactive);
            }
            _ => {}
        }
    }

    /// Leaves `Stopped`, after which the axis waits for Servo_Ready again with the servo off; or leaves `Held`, after which it
    /// is on again.
    pub fn clear(&mut self) {
        match self.state {
            AxisState::Held(_) => self.enter(AxisState::On, 0),
            AxisState::Stopped(_) => {
                self.watch.reset();
                self.refused = 0;
                self.active_off = 0;
                self.disobeys = false;
                self.last_refusal = None;
                self.enter(AxisState::Starting, self.config.limits.ready.unwrap_or(0));
            }
            _ => {}
        }
    }

    /// Makes one update period of a controlled deceleration, starting from the last value sent.
    pub(super) fn slow_down(&mut self, reason: StopReason) {
        let moves = match self.mode {
            // Asked for and not yet sent: the axis stands, and the last block says nothing in this mode.
            mode if mode != self.wire.mode => false,
            ActiveCode::CyclicPosition => {
                let step = self.less(self.wire.step);
                self.setpoint = self.wire.value.wrapping_add(step);
                step != 0
            }
            ActiveCode::CyclicVelocity => {
                self.setpoint = self.less(self.wire.value);
                self.setpoint != 0
            }
            // A motion that was started may begin yet.
            ActiveCode::ProfilePosition => {
                self.status().contains(StatusFlags::IN_PROGRESS)
                    || self.category == StopCategory::Two && self.is_moving()
            }
            ActiveCode::CyclicTorque => false,
        };
        if !moves {
            match self.category {
                StopCategory::Two => self.enter(AxisState::Held(reason), 0),
                _ => self.fail(reason),
            }
        }
    }

    /// Returns whether the deceleration is known, in case the host makes it.
    pub(super) const fn can_slow_down(&self) -> bool {
        match self.mode {
            ActiveCode::CyclicPosition | ActiveCode::CyclicVelocity => self.config.deceleration > 0,
            ActiveCode::ProfilePosition => true,
            ActiveCode::CyclicTorque => false,
        }
    }

    /// Returns a step or a speed one deceleration closer to 0.
    fn less(&self, value: i32) -> i32 {
        let magnitude = value.unsigned_abs().saturating_sub(self.config.deceleration);
        // No larger in magnitude than it was.
        i32::try_from(magnitude).unwrap_or(i32::MAX).saturating_mul(value.signum())
    }

    /// Servo_On, and the bit that ends a profile motion.
    pub(super) fn servo_bits(&self) -> ControlBits {
        match (self.state, self.mode) {
            (AxisState::Stopping(_) | AxisState::Held(_), ActiveCode::ProfilePosition) => {
                ControlBits::SERVO_ON.union(ControlBits::SMOOTH_STOP)
            }
            _ => ControlBits::SERVO_ON,
        }
    }

    /// Returns whether the motor follows the block.
    pub(super) const fn is_energised(&self) -> bool {
        matches!(self.state, AxisState::On | AxisState::Stopping(_) | AxisState::Held(_))
    }

    /// Returns the set-point of an axis that is not commanded to move.
    pub(super) fn rest(&mut self) {
        self.setpoint = if self.mode == ActiveCode::CyclicPosition { self.evidence.last().position() } else { 0 };
    }

    pub(super) fn enter(&mut self, state: AxisState, limit: u32) {
        self.state = state;
        self.left = limit;
        if state == AxisState::On {
            return;
        }
        self.feed_forward = [0; 3];
        let reason = match state {
            AxisState::Stopped(reason) | AxisState::Stopping(reason) | AxisState::Held(reason) => Some(reason),
            _ => None,
        };
        if self.main.slot.asking().is_some_and(Handshake::is_patient) {
            self.withdraw(reason);
        }
        let confirmed = self.main.quiet.is_kept();
        if let Some(profile) = &mut self.profile {
            // While it slows down the drive keeps the code of the motion, and its end is awaited.
            profile.break_off(reason, confirmed, matches!(state, AxisState::Stopping(_)));
        }
        if !state.is_servo_on() {
            self.rest();
        }
    }

    /// Ends a request with which the drive moves the axis: it must not begin again with the next servo-on.
    #[cold]
    #[inline(never)]
    const fn withdraw(&mut self, reason: Option<StopReason>) {
        let error = match reason {
            Some(reason) => Failure::Stopped(reason),
            None => Failure::ServoOff,
        };
        (self.main.slot, self.main.quiet) = (Slot::Ended(Progress::Failed { error }), Quiet::BROKEN);
    }
}
