use super::reset::mismatch;
use super::{Reset, Step};
use crate::error::{Error, ErrorClass};
use crate::message::SingleTurn;
use crate::request::Request;
use crate::response::Response;
use crate::status::StatusField;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    /// Reads the value before the reset.
    Before,
    /// Sends the ten requests of the reset.
    Act,
    /// Reads the value afterwards; holds how the ten requests ended.
    After(Result<(), ErrorClass>),
}

/// A reset that sets a value to 0, between two readings of the value that show its effect. The number of requests sent and
/// answered proves nothing: the encoder may have counted earlier ones, or may have restarted.
///
/// Nor does one reading: the check field misses two wrong bits in one column. A reading counts once the next one agrees with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Witness {
    reset: Reset,
    /// Reads the value.
    request: Request,
    phase: Phase,
    before: u32,
    /// What was read last in this phase.
    seen: Option<u32>,
    sent: u8,
    tries: u8,
}

impl Witness {
    /// How many readings may fail, or contradict the one before, until it is given up.
    pub(super) const MAX_READS: u8 = 3;

    pub(super) const fn new(reset: Reset, request: Request) -> Self {
        Self { reset, request, phase: Phase::Before, before: 0, seen: None, sent: 0, tries: 0 }
    }

    /// Returns the first request, to be sent at once.
    pub(super) const fn start<T>(&mut self, now_ns: u64) -> Step<T> {
        self.sent = 0;
        self.enter(Phase::Before, now_ns)
    }

    /// Takes the outcome of a transaction; the line is free from `ready_ns`. `value` extracts the message and the value
    /// from a response, and `near` says whether two values may be the same.
    pub(super) fn receive<T>(
        &mut self,
        outcome: Result<Response, Error>,
        ready_ns: u64,
        value: impl Fn(Response) -> Option<Result<(T, u32), Error>>,
        near: impl Fn(u32, u32) -> bool,
    ) -> Step<T> {
        if self.phase == Phase::Act {
            let step = self.reset.receive(outcome, ready_ns);
            return self.act(step, ready_ns);
        }
        let read_out = outcome.and_then(|response| match response.status() {
            Some(sf) if sf.intersects(StatusField::REQUEST_DAMAGED) => Err(Error::Rejected { sf }),
            _ => value(response).unwrap_or(Err(mismatch(response, self.request))),
        });
        let (message, now) = match read_out {
            Ok(read_out) => read_out,
            Err(error) => return self.unread(error, ready_ns),
        };
        match self.seen.replace(now) {
            None => return self.read(ready_ns),
            // Nothing is sent while the shaft turns.
            Some(seen) if !near(seen, now) => {
                let error = Error::NotDone { sent: self.sent, because: ErrorClass::DataMismatch };
                return self.unread(error, ready_ns);
            }
            Some(_) => {}
        }
        match self.phase {
            Phase::After(act) => match self.judge(act, now, near) {
                Ok(()) => Step::Done { value: message, ready_ns },
                Err(error) => Step::Failed { error, ready_ns },
            },
            Phase::Before | Phase::Act => {
                self.before = now;
                self.phase = Phase::Act;
                let step = self.reset.start(ready_ns.saturating_add(Reset::SPACING_NS.into()));
                self.act(step, ready_ns)
            }
        }
    }

    /// Takes the next step of the reset. However the reset ends, begins the second reading 18 ms later, because an encoder may
    /// be storing for that long.
    fn act<T>(&mut self, step: Step<SingleTurn>, ready_ns: u64) -> Step<T> {
        let act = match step {
            Step::Send { request, not_before_ns } => {
                self.sent = self.sent.saturating_add(1);
                return Step::Send { request, not_before_ns };
            }
            Step::Done { .. } => Ok(()),
            Step::Failed { error: Error::EffectUnknown { because }, .. } => Err(because),
            Step::Failed { error, .. } => Err(error.class()),
        };
        self.enter(Phase::After(act), ready_ns.saturating_add(Reset::ZERO_WAIT_NS.into()))
    }

    const fn enter<T>(&mut self, phase: Phase, not_before_ns: u64) -> Step<T> {
        self.phase = phase;
        self.seen = None;
        self.tries = 0;
        self.read(not_before_ns)
    }

    const fn read<T>(&self, not_before_ns: u64) -> Step<T> {
        Step::Send { request: self.request, not_before_ns }
    }

    /// Handles a value that could not be read. Before the reset, the encoder may still be storing the result of an earlier one.
    fn unread<T>(&mut self, error: Error, ready_ns: u64) -> Step<T> {
        self.tries = self.tries.saturating_add(1);
        let before = self.phase == Phase::Before;
        if self.tries < Self::MAX_READS {
            return self.read(if before { ready_ns.saturating_add(Reset::ZERO_WAIT_NS.into()) } else { ready_ns });
        }
        let error = match error {
            error if before => error,
            Error::NotDone { because, .. } => Error::EffectUnknown { because },
            error => Error::EffectUnknown { because: error.class() },
        };
        Step::Failed { error, ready_ns }
    }

    /// Returns what the value after the requests shows about their effect.
    fn judge(&self, act: Result<(), ErrorClass>, now: u32, near: impl Fn(u32, u32) -> bool) -> Result<(), Error> {
        let because = act.err().unwrap_or(ErrorClass::DataMismatch);
        let unmoved = near(self.before, now);
        match near(0, now) {
            true if act.is_ok() || !unmoved && !near(0, self.before) => Ok(()),
            false if unmoved => Err(Error::NotDone { sent: self.sent, because }),
            _ => Err(Error::EffectUnknown { because }),
        }
    }
}
