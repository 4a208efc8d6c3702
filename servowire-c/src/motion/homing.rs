//! Finding the reference switch of an axis.

use core::mem::MaybeUninit;

use step_motion::{Direction, Homing, HomingConfig, HomingState, Switch};

use super::{error, limits, sw_motion_axis_t, sw_motion_limits_t};
use crate::border::{OK, Refused, border, in_range, state, there};
use crate::result::sw_result_t;

/// The progress of a homing.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_motion_homing_state_t {
    /// At rest; position 0 is the place where the switch closed.
    SW_MOTION_HOMING_DONE = 0,
    /// Looking for the switch.
    SW_MOTION_HOMING_SEEKING = 1,
    /// On the switch, slowing down.
    SW_MOTION_HOMING_STOPPING = 2,
    /// Backing off from the switch.
    SW_MOTION_HOMING_BACKING_OFF = 3,
    /// Approaching the switch slowly.
    SW_MOTION_HOMING_APPROACHING = 4,
    /// On the switch again, slowing down.
    SW_MOTION_HOMING_SETTLING = 5,
    /// No switch was found within the range, or it stays closed, and the axis is stopped; or somebody else has
    /// asked it for something, and it does that. Its position is not a reference.
    SW_MOTION_HOMING_FAILED = 6,
}

/// How an axis looks for its switch.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_motion_homing_setup_t {
    /// Limits for the stop at the switch, beyond which there must be room to come to rest.
    pub stop: sw_motion_limits_t,
    /// Speed of the search, in steps/s.
    pub seek: u32,
    /// Speed of the second, exact approach, in steps/s.
    pub approach: u32,
    /// How far to back off before that, in steps: farther than the stop at the switch takes and what the axis makes
    /// in twice its reach before, or the switch stays closed.
    pub back_off: u32,
    /// After this many steps without a switch the search is abandoned.
    pub range: u32,
    /// Where the switch is: 1 in reverse, 0 forward.
    pub reverse: u8,
}

/// A homing.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_motion_homing_t {
    pub(crate) _private: [MaybeUninit<u64>; 16],
}
state!(sw_motion_homing_t, Homing, 0x63);

fn switch(closed: u8) -> Result<Switch, Refused> {
    in_range(match closed {
        0 => Some(Switch::Open),
        1 => Some(Switch::Closed),
        _ => None,
    })
}

/// Starts the homing of an axis at rest: fast towards its switch, back, and slowly towards it again. `closed`
/// is the level of the switch, 1 for an axis at the switch or beyond it; such an axis moves off it first.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_home(
    homing: Option<&mut MaybeUninit<sw_motion_homing_t>>,
    axis: Option<&mut sw_motion_axis_t>,
    setup: Option<&sw_motion_homing_setup_t>,
    closed: u8,
) -> sw_result_t {
    border(|| {
        let (homing, axis, setup) = (there(homing)?, sw_motion_axis_t::get(axis)?, there(setup)?);
        let direction = in_range(Direction::from_code(setup.reverse))?;
        let config = HomingConfig::new(direction, setup.seek, setup.approach, setup.range, limits(&setup.stop)?)
            .with_back_off(setup.back_off);
        let started = Homing::start_axis(config, axis, switch(closed)?).map_err(error)?;
        sw_motion_homing_t::start(Some(homing), started)?;
        OK
    })
}

/// Looks at the switch, and asks the axis for what comes next. Call it often, at least once a step of the
/// approach, beside sw_motion_poll(). A hold and an override act on a homing as on any motion; a move, a stop
/// or a halt ends it. Returns sw_motion_homing_state_t, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_homing_poll(
    homing: Option<&mut sw_motion_homing_t>,
    axis: Option<&mut sw_motion_axis_t>,
    closed: u8,
) -> sw_result_t {
    border(|| {
        let (homing, axis) = (sw_motion_homing_t::get(homing)?, sw_motion_axis_t::get(axis)?);
        Ok(match homing.poll_axis(axis, switch(closed)?).map_err(error)? {
            HomingState::Done => sw_motion_homing_state_t::SW_MOTION_HOMING_DONE,
            HomingState::Seeking => sw_motion_homing_state_t::SW_MOTION_HOMING_SEEKING,
            HomingState::Stopping => sw_motion_homing_state_t::SW_MOTION_HOMING_STOPPING,
            HomingState::BackingOff => sw_motion_homing_state_t::SW_MOTION_HOMING_BACKING_OFF,
            HomingState::Approaching => sw_motion_homing_state_t::SW_MOTION_HOMING_APPROACHING,
            HomingState::Settling => sw_motion_homing_state_t::SW_MOTION_HOMING_SETTLING,
            _ => sw_motion_homing_state_t::SW_MOTION_HOMING_FAILED,
        } as sw_result_t)
    })
}
