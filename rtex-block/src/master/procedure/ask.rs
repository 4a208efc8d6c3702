//! Code common to all procedures.

use crate::master::axis::Axis;
use crate::master::progress::{Failure, Progress};
use crate::master::state::AskError;
use crate::noncyclic_command::NonCyclicCommand;
use crate::noncyclic_response::NonCyclicResponse;

/// What a [runner](crate::master::Run) runs; it forwards to the inherent methods of a procedure, which have the same names.
pub trait Procedure {
    /// The value that it produces.
    type Value;

    /// Restarts the procedure; call it after the exchange of an update period.
    fn start(&mut self, axis: &mut Axis) -> Progress<Self::Value>;

    /// Continues the procedure; call it after every later exchange, until it has ended.
    fn receive(&mut self, axis: &mut Axis) -> Progress<Self::Value>;
}

/// One request of a procedure: it is sent as soon as the axis accepts it, and then its answer is awaited. Both waits are
/// limited to the time allowed for an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Ask {
    pub(super) asked: bool,
    waited: u32,
}

impl Ask {
    pub(super) const NEW: Self = Self { asked: false, waited: 0 };

    /// Returns the answer to `request`, once it has come.
    pub(super) fn receive(&mut self, axis: &mut Axis, request: NonCyclicCommand) -> Progress<NonCyclicResponse> {
        self.receive_with(axis, |axis| axis.ask(request))
    }

    /// Returns the answer to the request made by `send`, once it has come.
    pub(super) fn receive_with(
        &mut self,
        axis: &mut Axis,
        send: impl FnOnce(&mut Axis) -> Result<(), AskError>,
    ) -> Progress<NonCyclicResponse> {
        let pending = Progress::Pending { left: axis.answer_left() };
        if self.asked {
            let Some(outcome) = axis.take_outcome() else { return pending };
            *self = Self::NEW;
            return outcome;
        }
        let sent = if axis.can_ask() { send(axis) } else { Err(AskError::Busy) };
        match sent {
            Ok(()) => self.asked = true,
            Err(AskError::Busy) if axis.is_moving() => {}
            Err(AskError::Busy) if self.waited < axis.config().limits.answer => {
                self.waited = self.waited.saturating_add(1);
            }
            Err(error) => return Progress::Failed { error: Failure::NotSent(error) },
        }
        pending
    }
}

/// Reads back what a command has set, and compares it with `read`. If that fails, the end is that of the command, whose answer was `set`:
/// it was sent, so a reading that was not sent leaves its effect unknown.
pub(super) fn read_back<T: Copy>(
    progress: Progress<NonCyclicResponse>,
    set: Result<(), Failure>,
    read: impl FnOnce(NonCyclicResponse) -> Progress<T>,
) -> Progress<T> {
    match (progress, set) {
        (Progress::Failed { .. }, Err(error)) => Progress::Failed { error },
        (Progress::Failed { error: Failure::NotSent(_) }, Ok(())) => Progress::Failed { error: Failure::TimedOut },
        (progress, _) => progress.and_then(read),
    }
}

/// Defines `start` and `receive` of a procedure from its `next`, which returns the progress of one update period, its
/// `reset`, and its `end`.
macro_rules! procedure {
    ($procedure:ident $(<$life:lifetime>)?, $value:ty) => {
        impl $(<$life>)? $procedure $(<$life>)? {
            /// Restarts the procedure; call it after the exchange of an update period.
            pub fn start(&mut self, axis: &mut $crate::master::Axis) -> $crate::master::Progress<$value> {
                self.reset();
                self.end = None;
                self.receive(axis)
            }

            /// Continues the procedure; call it after the exchange of every later update period. Once it is done or has failed,
            /// it stays in that state.
            pub fn receive(&mut self, axis: &mut $crate::master::Axis) -> $crate::master::Progress<$value> {
                let progress = match self.end {
                    Some(end) => end,
                    None => self.next(axis),
                };
                self.end = progress.ended();
                progress
            }
        }

        impl $(<$life>)? $crate::master::procedure::Procedure for $procedure $(<$life>)? {
            type Value = $value;

            fn start(&mut self, axis: &mut $crate::master::Axis) -> $crate::master::Progress<$value> {
                self.start(axis)
            }

            fn receive(&mut self, axis: &mut $crate::master::Axis) -> $crate::master::Progress<$value> {
                self.receive(axis)
            }
        }
    };
}
pub(super) use procedure;

/// One request, with its answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Request {
    ask: Ask,
    sent: NonCyclicCommand,
    end: Option<Progress<NonCyclicResponse>>,
}

procedure!(Request, NonCyclicResponse);

impl Request {
    /// Creates the procedure for any request that [`Axis::ask`] sends.
    pub const fn new(request: NonCyclicCommand) -> Self {
        Self { ask: Ask::NEW, sent: request, end: None }
    }

    const fn reset(&mut self) {
        self.ask = Ask::NEW;
    }

    fn next(&mut self, axis: &mut Axis) -> Progress<NonCyclicResponse> {
        self.ask.receive(axis, self.sent)
    }
}
