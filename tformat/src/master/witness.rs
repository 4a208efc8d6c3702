use super::reset::mismatch;
use super::{Reset, Step};
use crate::error::{Error, ErrorClass};
use crate::request::Request;
use crate::response::Response;
use crate::status::StatusField;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    /// The value before.
    Before,
    /// Ten requests of the reset.
    Act,
    /// The value after; how the ten ended.
    After(Result<(), ErrorClass>),
}

/// A reset that makes a value 0, between two readings of the value that tell what became of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Witness {
    reset: Reset,
    /// Reads the value.
    request: Request,
    /// From the end of the reset to the second reading, beyond what the reset waits itself.
    settling_ns: u32,
    phase: Phase,
    before: u32,
    tries: u8,
}

impl Witness {
    /// Times that the value is read before it is given up.
    pub(super) const MAX_READS: u8 = 3;

    pub(super) const fn new(reset: Reset, request: Request, settling_ns: u32) -> Self {
        Self { reset, request, settling_ns, phase: Phase::Before, before: 0, tries: 0 }
    }

    /// The first request, at once.
    pub(super) const fn start<T>(&mut self, now_ns: u64) -> Step<T> {
        self.enter(Phase::Before, now_ns)
    }

    /// A transaction ended with this outcome; the line is free from `ready_ns` on. `value` takes the message and the value
    /// out of a response, and `near` tells whether two values may be the same.
    pub(super) fn receive<T>(
        &mut self,
        outcome: Result<Response, Error>,
        ready_ns: u64,
        value: impl Fn(Response) -> Option<Result<(T, u32), Error>>,
        near: impl Fn(u32, u32) -> bool,
    ) -> Step<T> {
        if self.phase == Phase::Act {
            return self.act(outcome, ready_ns);
        }
        let read_out = outcome.and_then(|response| match response.status() {
            Some(sf) if sf.intersects(StatusField::REQUEST_DAMAGED) => Err(Error::Rejected { sf }),
            _ => value(response).unwrap_or(Err(mismatch(response, self.request))),
        });
        match (read_out, self.phase) {
            (Err(error), _) => self.unread(error, ready_ns),
            (Ok((message, now)), Phase::After(act)) => match self.judge(act, now, near) {
                Ok(()) => Step::Done { value: message, ready_ns },
                Err(error) => Step::Failed { error, ready_ns },
            },
            (Ok((_, now)), _) => {
                self.before = now;
                self.phase = Phase::Act;
                match self.reset.start(ready_ns.saturating_add(Reset::SPACING_NS.into())) {
                    Step::Send { request, not_before_ns } => Step::Send { request, not_before_ns },
                    // Never: a reset begins with a request.
                    Step::Done { ready_ns, .. } => self.enter(Phase::After(Ok(())), ready_ns),
                    Step::Failed { error, ready_ns } => Step::Failed { error, ready_ns },
                }
            }
        }
    }

    fn act<T>(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<T> {
        match self.reset.receive(outcome, ready_ns) {
            Step::Send { request, not_before_ns } => Step::Send { request, not_before_ns },
            Step::Done { ready_ns, .. } => self.look(Ok(()), ready_ns),
            Step::Failed { error: Error::EffectUnknown { because }, ready_ns } => self.look(Err(because), ready_ns),
            Step::Failed { error, ready_ns } => Step::Failed { error, ready_ns },
        }
    }

    fn look<T>(&mut self, act: Result<(), ErrorClass>, ready_ns: u64) -> Step<T> {
        self.enter(Phase::After(act), ready_ns.saturating_add(self.settling_ns.into()))
    }

    const fn enter<T>(&mut self, phase: Phase, not_before_ns: u64) -> Step<T> {
        self.phase = phase;
        self.tries = 0;
        self.read(not_before_ns)
    }

    const fn read<T>(&self, not_before_ns: u64) -> Step<T> {
        Step::Send { request: self.request, not_before_ns }
    }

    /// The value could not be read.
    fn unread<T>(&mut self, error: Error, ready_ns: u64) -> Step<T> {
        self.tries = self.tries.saturating_add(1);
        if self.tries < Self::MAX_READS {
            return self.read(ready_ns);
        }
        let because = error.class();
        let error = match self.phase {
            Phase::After(_) => Error::EffectUnknown { because },
            _ => Error::NotDone { sent: 0, because },
        };
        Step::Failed { error, ready_ns }
    }

    /// What the value after the ten requests says of them.
    fn judge(&self, act: Result<(), ErrorClass>, now: u32, near: impl Fn(u32, u32) -> bool) -> Result<(), Error> {
        match act {
            _ if near(0, now) && (act.is_ok() || !near(0, self.before)) => Ok(()),
            Ok(()) => Err(Error::NotDone { sent: Reset::REQUESTS, because: ErrorClass::DataMismatch }),
            Err(because) if near(self.before, now) && !near(0, now) => {
                Err(Error::NotDone { sent: Reset::REQUESTS, because })
            }
            Err(because) => Err(Error::EffectUnknown { because }),
        }
    }
}
