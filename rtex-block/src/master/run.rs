//! The common jobs of a ring, one update period after another.

use super::axis::Axis;
use super::procedure::{Home, Procedure, Request};
use super::profile_move::CommandEnded;
use super::progress::{Failure, Progress};
use super::ring::{Ring, RingFailure};
use super::state::{AxisState, RingSwitchOnError, SetpointError, SwitchOnError};
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;
use crate::status::StatusFlags;

/// Why a job of a [runner](Run) ended before it was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Ended<E> {
    /// The exchange failed.
    Line(E),
    /// An axis has stopped.
    Ring(RingFailure),
    /// An axis does not become ready because it reports an alarm.
    Alarm {
        /// Its place in the ring.
        place: u8,
    },
    /// The limit of update periods has passed.
    Limit,
    /// The ring has no axis in this place.
    Place,
    /// The axes cannot be switched on.
    SwitchOn(RingSwitchOnError),
    /// A set-point was not accepted.
    Setpoint(SetpointError),
    /// A request, a procedure or a motion failed.
    Failed(Failure),
}

impl<E: core::fmt::Display> core::fmt::Display for Ended<E> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Line(error) => write!(f, "the exchange failed: {error}"),
            Self::Ring(failure) => write!(f, "{failure}"),
            Self::Alarm { place } => write!(f, "axis {place} reports an alarm"),
            Self::Limit => f.write_str("not within its limit"),
            Self::Place => f.write_str("the ring has no such axis"),
            Self::SwitchOn(error) => write!(f, "{error}"),
            Self::Setpoint(error) => write!(f, "{error}"),
            Self::Failed(failure) => write!(f, "{failure}"),
        }
    }
}

impl<E: core::fmt::Debug + core::fmt::Display> core::error::Error for Ended<E> {}

/// Keeps a ring in step and does common jobs on it, one at a time: for the start-up of a machine, for tests and for tools.
/// Each call returns when its job is done, and the other axes hold their set-points meanwhile; a program that moves several
/// axes at once runs the [procedures](super::procedure) itself and calls [`update`](Self::update).
///
/// ```
/// use rtex_block::device::{Drive, DriveConfig, OpenCodes};
/// use rtex_block::master::{ActiveCode, Axis, AxisConfig, Heard, Limits, Ring, Run};
/// use rtex_block::type_code::profile;
/// use rtex_block::{MacId, Response};
///
/// struct Bench { ring: Ring<1>, drive: Drive, heard: [Heard; 1], now_ns: u64 }
///
/// impl Run<1> for Bench {
///     type Error = core::convert::Infallible;
///
///     fn ring_mut(&mut self) -> &mut Ring<1> {
///         &mut self.ring
///     }
///
///     fn update(&mut self) -> Result<u64, Self::Error> {
///         self.now_ns += 500_000;
///         let [command] = self.ring.update(&self.heard, self.now_ns);
///         self.heard = self.drive.hear(&command.main.emit()).map_or([Heard::Nothing], |block| [Response::parse(&block).into()]);
///         Ok(self.now_ns)
///     }
/// }
///
/// let (mac_id, codes) = (MacId::new(5).unwrap(), OpenCodes::INVENTED);
/// let limits = Limits::new(core::num::NonZeroU16::new(8).unwrap(), 200);
/// let axis = Axis::new(AxisConfig::new(mac_id, ActiveCode::ProfilePosition, 500_000, limits));
/// let drive = Drive::new(DriveConfig::new(mac_id, codes));
/// let mut bench = Bench { ring: Ring::new([axis], 4)?, drive, heard: [Heard::Nothing], now_ns: 0 };
///
/// bench.switch_on()?;
/// bench.home(0, codes.homing, 5_000)?;
/// bench.go(0, profile::RELATIVE, 20_000, 1_000_000)?;
/// assert!((bench.drive.position() - 20_000).abs() < 100);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Run<const N: usize> {
    /// Why an exchange failed.
    type Error;

    /// The ring.
    fn ring_mut(&mut self) -> &mut Ring<N>;

    /// Waits for the next update period and makes its exchange; returns when the period began, in ns.
    ///
    /// # Errors
    /// The errors of the line.
    fn update(&mut self) -> Result<u64, Self::Error>;

    /// Lets this many update periods pass.
    ///
    /// # Errors
    /// [`Ended::Line`], [`Ended::Ring`]
    fn run(&mut self, updates: u32) -> Result<(), Ended<Self::Error>> {
        (0..updates).try_for_each(|_| step(self).map(|_| ()))
    }

    /// Runs update periods until `done`; a limit of `None` means no limit.
    ///
    /// # Errors
    /// [`Ended::Line`], [`Ended::Ring`], [`Ended::Limit`]
    fn until(
        &mut self,
        limit: Option<u32>,
        mut done: impl FnMut(&mut Ring<N>) -> bool,
    ) -> Result<(), Ended<Self::Error>> {
        let mut passed = 0_u32;
        while !done(self.ring_mut()) {
            if limit.is_some_and(|limit| passed >= limit) {
                return Err(Ended::Limit);
            }
            step(self)?;
            passed = passed.saturating_add(1);
        }
        Ok(())
    }

    /// Waits for the main power of all drives, without a limit, and switches all axes on. Those that are on stay on, but the axes of
    /// a ring are switched on together: if only some are on, or one is held after a stop, that is an error. So is one that
    /// is switched off again, in [`update`](Self::update), before all are on.
    ///
    /// # Errors
    /// [`Ended::Line`], [`Ended::Ring`], [`Ended::Alarm`], [`Ended::SwitchOn`]
    fn switch_on(&mut self) -> Result<(), Ended<Self::Error>> {
        let mut commanded = false;
        loop {
            step(self)?;
            let ring = self.ring_mut();
            if ring.all_are(AxisState::On) {
                return Ok(());
            }
            if commanded {
                // The axes have limits of their own.
                off_again(ring).map_or(Ok(()), |error| Err(Ended::SwitchOn(error)))?;
                continue;
            }
            if ring.axes().iter().all(|axis| axis.can_switch_on().is_ok()) {
                ring.switch_on().map_err(Ended::SwitchOn)?;
                commanded = true;
                continue;
            }
            let alarmed = |axis: &Axis| axis.status().contains(StatusFlags::ALARM);
            if let Some((_, place)) = ring.axes().iter().zip(0..).find(|(axis, _)| alarmed(axis)) {
                return Err(Ended::Alarm { place });
            }
            if let Some(error) = stays(ring) {
                return Err(Ended::SwitchOn(error));
            }
        }
    }

    /// Runs a procedure on the axis at `place` to its end.
    ///
    /// # Errors
    /// [`Ended::Line`], [`Ended::Ring`], [`Ended::Place`], [`Ended::Failed`]
    fn procedure<P: Procedure>(&mut self, place: usize, mut procedure: P) -> Result<P::Value, Ended<Self::Error>> {
        let mut progress = procedure.start(axis(self, place)?);
        loop {
            match progress {
                Progress::Done { value } => return Ok(value),
                Progress::Failed { error } => return Err(Ended::Failed(error)),
                Progress::Pending { .. } => {}
            }
            // An axis that has stopped can be asked all the same: the procedure says what that means to it.
            self.update().map_err(Ended::Line)?;
            progress = procedure.receive(axis(self, place)?);
        }
    }

    /// Sends a request to the drive at `place` and waits for its answer.
    ///
    /// # Errors
    /// As [`procedure`](Self::procedure).
    fn ask(&mut self, place: usize, request: NonCyclicCommand) -> Result<NonCyclicResponse, Ended<Self::Error>> {
        self.procedure(place, Request::new(request))
    }

    /// Homes the drive at `place`, in PP: [`Home`].
    ///
    /// # Errors
    /// As [`procedure`](Self::procedure).
    fn home(&mut self, place: usize, type_code: u8, limit: u32) -> Result<(), Ended<Self::Error>> {
        self.procedure(place, Home::new(type_code, limit))
    }

    /// Makes a profile motion in PP, up to the end of the position command: [`Axis::start_move`]. It has no time limit: at a speed
    /// of 0 it waits until something else ends the motion.
    ///
    /// # Errors
    /// [`Ended::Line`], [`Ended::Place`], [`Ended::Setpoint`], [`Ended::Failed`]
    fn go(&mut self, place: usize, type_code: u8, target: i32, speed: i32) -> Result<CommandEnded, Ended<Self::Error>> {
        axis(self, place)?.start_move(type_code, target, speed).map_err(Ended::Setpoint)?;
        loop {
            self.update().map_err(Ended::Line)?;
            match axis(self, place)?.take_move() {
                Some(Progress::Done { value }) => return Ok(value),
                Some(Progress::Failed { error }) => return Err(Ended::Failed(error)),
                Some(Progress::Pending { .. }) | None => {}
            }
        }
    }

    /// Follows cyclic positions from any source, in CP. `position` is called with the instant of an update period and the place
    /// of an axis; it returns where the axis has to be, or `None` at the end of its motion. Ends when all motions have ended.
    ///
    /// # Errors
    /// [`Ended::Line`], [`Ended::Ring`], [`Ended::Setpoint`]
    fn follow(&mut self, mut position: impl FnMut(usize, u64) -> Option<i32>) -> Result<(), Ended<Self::Error>> {
        loop {
            let now_ns = step(self)?;
            let mut moving = false;
            for (place, axis) in self.ring_mut().axes_mut().iter_mut().enumerate() {
                if let Some(position) = position(place, now_ns) {
                    axis.set_position(position).map_err(Ended::Setpoint)?;
                    moving = true;
                }
            }
            if !moving {
                return Ok(());
            }
        }
    }
}

/// Returns an axis that was switched on and is not on its way there any more.
fn off_again<const N: usize>(ring: &Ring<N>) -> Option<RingSwitchOnError> {
    let mut states = ring.axes().iter().map(Axis::state).zip(0..);
    let (state, place) = states.find(|(state, _)| !matches!(state, AxisState::SwitchingOn | AxisState::On))?;
    Some(RingSwitchOnError { place, error: SwitchOnError::State(state) })
}

/// Returns an axis that stays energised and so is never off, one that is held before one that is on; `None` if all are on or on
/// their way there.
fn stays<const N: usize>(ring: &Ring<N>) -> Option<RingSwitchOnError> {
    let states = ring.axes().iter().map(Axis::state).zip(0..);
    if states.clone().all(|(state, _)| matches!(state, AxisState::SwitchingOn | AxisState::On)) {
        return None;
    }
    let held = states.clone().find(|(state, _)| matches!(state, AxisState::Held(_)));
    let (state, place) = held.or_else(|| states.clone().find(|(state, _)| *state == AxisState::On))?;
    Some(RingSwitchOnError { place, error: SwitchOnError::State(state) })
}

/// Runs one update period; an axis that has stopped ends the job.
fn step<const N: usize, R: Run<N> + ?Sized>(run: &mut R) -> Result<u64, Ended<R::Error>> {
    let now_ns = run.update().map_err(Ended::Line)?;
    match run.ring_mut().failure() {
        Some(failure) => Err(Ended::Ring(failure)),
        None => Ok(now_ns),
    }
}

fn axis<const N: usize, R: Run<N> + ?Sized>(run: &mut R, place: usize) -> Result<&mut Axis, Ended<R::Error>> {
    run.ring_mut().axes_mut().get_mut(place).ok_or(Ended::Place)
}
