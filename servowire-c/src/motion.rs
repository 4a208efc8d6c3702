//! Steps within limits of speed, acceleration and jerk: planned in the background, made in a timer interrupt.

mod homing;

pub use homing::*;

use core::mem::MaybeUninit;

use step_motion::{Axis, Clock, Direction, Error, Limits, Mover, Queue, StepTimer, Work};

use crate::border::{OK, Refused, border, in_range, state, there};
use crate::result::{Protocol, refused, sw_result_t};

/// Slots of a queue.
const SLOTS: usize = 129;

/// Refusals of motion, in the order of their numbers.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_motion_error_t {
    /// The axis is still moving.
    SW_E_MOTION_MOVING = -0x601,
    /// Two steps could fall into one tick of the clock.
    SW_E_MOTION_SPEED_ABOVE_CLOCK = -0x602,
    /// More steps than 31 bits can count.
    SW_E_MOTION_TOO_MANY_STEPS = -0x603,
    /// No room.
    SW_E_MOTION_QUEUE_FULL = -0x604,
    /// A target outside the soft limits.
    SW_E_MOTION_SOFT_LIMIT = -0x607,
    /// Too few steps for the change of speed.
    SW_E_MOTION_TOO_SHORT = -0x608,
}

/// What the background has left to do.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_motion_work_t {
    /// At rest at its target.
    SW_MOTION_REST = 0,
    /// Poll again.
    SW_MOTION_MORE = 1,
    /// Fire the interrupt now: it is stopped, and there is motion for it.
    SW_MOTION_START = 2,
    /// Nothing until the interrupt has progressed.
    SW_MOTION_LATER = 3,
    /// The stop needs more slots than the queue has: the axis comes to rest, and goes on at half of its greatest speed until
    /// sw_motion_set_limits().
    SW_MOTION_TOO_FEW_SLOTS = 4,
}

/// The queue between the background and the interrupt. It is `static`: both ends hold its address, and it
/// is never moved or copied.
#[repr(C)]
#[derive(Debug)]
pub struct sw_motion_queue_t {
    pub(crate) _private: [MaybeUninit<u64>; 656],
}
const _: () = assert!(size_of::<Queue<SLOTS>>() <= size_of::<sw_motion_queue_t>());
const _: () = assert!(align_of::<Queue<SLOTS>>() <= align_of::<sw_motion_queue_t>());

/// The background end. It belongs to its queue: it is not copied.
#[repr(C)]
#[derive(Debug)]
pub struct sw_motion_axis_t {
    pub(crate) _private: [MaybeUninit<u64>; 1248],
}
state!(pinned sw_motion_axis_t, Axis<'static, SLOTS>, 0x61);

/// The interrupt end. It belongs to its queue: it is not copied.
#[repr(C)]
#[derive(Debug)]
#[expect(missing_copy_implementations, reason = "it belongs to its queue")]
pub struct sw_motion_timer_t {
    pub(crate) _private: [MaybeUninit<u64>; 9],
}
state!(sw_motion_timer_t, StepTimer<'static, SLOTS>, 0x62);

/// How fast an axis may go.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_motion_limits_t {
    /// Steps/s³; 0 for a trapezoid.
    pub jerk: u64,
    /// Steps/s.
    pub speed: u32,
    /// Steps/s².
    pub acceleration: u32,
}

/// What an axis is. What is not needed is 0.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_motion_setup_t {
    /// How fast it may go.
    pub limits: sw_motion_limits_t,
    /// The range that no target may leave, both ends included, in steps; sw_motion_run() stops at its end. Both
    /// 0: there is none. They do not count in a homing.
    pub soft_low: i64,
    /// Its other end.
    pub soft_high: i64,
    /// Ticks of the timer in a second, 1000 to 2^30 - 1.
    pub clock_hz: u32,
    /// Ticks between two steps in different directions, at least.
    pub reversal_pause: u32,
    /// A request takes effect after at most twice so many ticks, at least 16. 0: 10 ms.
    pub reach: u32,
}

/// What the interrupt has to do.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_motion_fired_t {
    /// Ticks until the next interrupt, at least 1: add them to the compare register. 0: there is none; stop
    /// the timer.
    pub wait: u32,
    /// 1: make a step now. DIR has been valid for the time that the driver needs.
    pub step: u8,
    /// The level of DIR from now on, 1 for reverse. It never changes together with a step.
    pub reverse: u8,
}

#[inline(always)]
pub(crate) fn error(error: Error) -> Refused {
    refused(Protocol::Motion, error.class().number())
}

pub(crate) fn limits(it: &sw_motion_limits_t) -> Result<Limits, Refused> {
    let limits = in_range(Limits::new(it.speed, it.acceleration).ok())?;
    if it.jerk == 0 { Ok(limits) } else { in_range(limits.with_jerk(it.jerk).ok()) }
}

/// Prepares an axis at rest at position 0: its two ends, and the `static` queue between them. Neither end may
/// be in use during this call.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_start(
    axis: Option<&mut MaybeUninit<sw_motion_axis_t>>,
    timer: Option<&mut MaybeUninit<sw_motion_timer_t>>,
    queue: Option<&'static mut MaybeUninit<sw_motion_queue_t>>,
    setup: Option<&sw_motion_setup_t>,
) -> sw_result_t {
    border(|| {
        let (axis, timer, place) = (there(axis)?, there(timer)?, there(queue)?.as_mut_ptr().cast::<Queue<SLOTS>>());
        let setup = there(setup)?;
        let (clock, limits) = (in_range(Clock::new(setup.clock_hz))?, limits(&setup.limits)?);
        let soft = in_range((setup.soft_low <= setup.soft_high).then_some((setup.soft_low, setup.soft_high)))?;
        // What is refused leaves an axis as it was that has been started.
        Mover::new(clock, limits).map_err(error)?;
        // SAFETY: large enough and aligned, as asserted above; nobody uses it.
        unsafe { place.write(Queue::new()) };
        // SAFETY: it was written, and the caller leaves it where it is for ever; from now on it is only shared.
        let queue: &'static Queue<SLOTS> = unsafe { &*place };
        let (background, interrupt) = Axis::new(queue, clock, limits).map_err(error)?;
        let background = background.with_reversal_pause(setup.reversal_pause);
        let background = if soft == (0, 0) { background } else { background.with_soft_limits(soft.0, soft.1) };
        let background = if setup.reach == 0 { background } else { background.with_reach(setup.reach) };
        sw_motion_axis_t::start(Some(axis), background)?;
        sw_motion_timer_t::start(Some(timer), interrupt)?;
        OK
    })
}

/// Returns the event that is due now. Call it in the interrupt of the timer, and once when sw_motion_poll()
/// returns SW_MOTION_START.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_fire(
    timer: Option<&mut sw_motion_timer_t>,
    fired: Option<&mut MaybeUninit<sw_motion_fired_t>>,
) -> sw_result_t {
    border(|| {
        let (timer, out) = (sw_motion_timer_t::get(timer)?, there(fired)?);
        let fired = timer.fire();
        let reverse = u8::from(fired.direction() == Direction::Reverse);
        out.write(sw_motion_fired_t { wait: fired.wait(), step: fired.is_step().into(), reverse });
        OK
    })
}

/// Does a slice of planning, in the background. Returns sw_motion_work_t, or a refusal. Call it until it returns anything but
/// SW_MOTION_MORE, again after each request, and every half of the reach: less often, the axis comes to rest again and again. Each
/// step of the stop that it makes then is within a sixteenth of an interval.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_poll(axis: Option<&mut sw_motion_axis_t>) -> sw_result_t {
    border(|| {
        Ok(match sw_motion_axis_t::get(axis)?.poll() {
            Work::Rest => sw_motion_work_t::SW_MOTION_REST,
            Work::More => sw_motion_work_t::SW_MOTION_MORE,
            Work::Start => sw_motion_work_t::SW_MOTION_START,
            Work::Later => sw_motion_work_t::SW_MOTION_LATER,
            Work::TooFewSlots => sw_motion_work_t::SW_MOTION_TOO_FEW_SLOTS,
        } as sw_result_t)
    })
}

/// Moves to a position, in steps.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_move_to(axis: Option<&mut sw_motion_axis_t>, target: i64) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.move_to(target).map_err(error)?;
        OK
    })
}

/// Runs at this speed, in steps/s, until something else is asked for; `reverse` is 0 or 1.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_run(axis: Option<&mut sw_motion_axis_t>, reverse: u8, speed: u32) -> sw_result_t {
    border(|| {
        let direction = in_range(Direction::from_code(reverse))?;
        sw_motion_axis_t::get(axis)?.run(direction, speed).map_err(error)?;
        OK
    })
}

/// Slows down to rest within the limits; the target is dropped.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_stop(axis: Option<&mut sw_motion_axis_t>) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.stop();
        OK
    })
}

/// Slows down to rest within other limits, higher ones for a limit switch; the target is dropped. Moves are
/// refused until it is at rest. A quick stop is never longer than sw_motion_stop(), even one under way.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_quick_stop(
    axis: Option<&mut sw_motion_axis_t>,
    limit: Option<&sw_motion_limits_t>,
) -> sw_result_t {
    border(|| {
        let (axis, limits) = (sw_motion_axis_t::get(axis)?, limits(there(limit)?)?);
        axis.quick_stop(limits);
        OK
    })
}

/// Stops at once: no further step is made.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_halt(axis: Option<&mut sw_motion_axis_t>) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.halt();
        OK
    })
}

/// Slows down to rest within the limits; sw_motion_resume() continues the motion.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_hold(axis: Option<&mut sw_motion_axis_t>) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.hold();
        OK
    })
}

/// Continues the motion after sw_motion_hold().
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_resume(axis: Option<&mut sw_motion_axis_t>) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.resume();
        OK
    })
}

/// Sets the feed override, in percent of the speed; more than 100 counts as 100, and 0 holds.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_set_override(axis: Option<&mut sw_motion_axis_t>, percent: u16) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.set_override(percent);
        OK
    })
}

/// Sets other limits, at rest.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_set_limits(
    axis: Option<&mut sw_motion_axis_t>,
    limit: Option<&sw_motion_limits_t>,
) -> sw_result_t {
    border(|| {
        let (axis, limits) = (sw_motion_axis_t::get(axis)?, limits(there(limit)?)?);
        axis.set_limits(limits).map_err(error)?;
        OK
    })
}

/// Says, at rest, which position this is, in steps: 0 at a reference. The target is forgotten, on hold too.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_set_commanded(axis: Option<&mut sw_motion_axis_t>, position: i64) -> sw_result_t {
    border(|| {
        sw_motion_axis_t::get(axis)?.set_commanded(position).map_err(error)?;
        OK
    })
}

/// Tells the commanded position of the axis, in steps.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_commanded(
    axis: Option<&sw_motion_axis_t>,
    position: Option<&mut MaybeUninit<i64>>,
) -> sw_result_t {
    border(|| {
        let (axis, position) = (sw_motion_axis_t::look(axis)?, there(position)?);
        position.write(axis.commanded());
        OK
    })
}

/// Returns whether the axis is at rest; false for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_is_at_rest(axis: Option<&sw_motion_axis_t>) -> bool {
    sw_motion_axis_t::look(axis).is_ok_and(Axis::is_at_rest)
}

/// Returns whether the last stop was sw_motion_halt(): the steps are counted, but the motor may have run on.
/// False for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_motion_is_halted(axis: Option<&sw_motion_axis_t>) -> bool {
    sw_motion_axis_t::look(axis).is_ok_and(Axis::is_halted)
}
