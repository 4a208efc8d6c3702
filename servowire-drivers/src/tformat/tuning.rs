//! The search for an encoder, as a procedure whose requests carry the rate at which they are sent.

use servowire_core::{Procedure, Step};
use tformat::master::{Detection, Line};
use tformat::{AllData, Error, Request, Response};

/// A request, and the settings of the line for it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tuned {
    pub(super) request: Request,
    pub(super) line: Line,
}

#[derive(Debug)]
pub(super) struct Tuning<'a>(pub(super) &'a mut Detection);

impl Tuning<'_> {
    fn tune(&self, step: Step<Request, AllData, Error>) -> Step<Tuned, AllData, Error> {
        match step {
            Step::Send { request, not_before_ns } => {
                Step::Send { request: Tuned { request, line: self.0.line() }, not_before_ns }
            }
            Step::Done { value, ready_ns } => Step::Done { value, ready_ns },
            Step::Failed { error, ready_ns } => Step::Failed { error, ready_ns },
        }
    }
}

impl Procedure for Tuning<'_> {
    type Request = Tuned;
    type Response = Response;
    type Value = AllData;
    type Error = Error;

    fn start(&mut self, now_ns: u64) -> Step<Tuned, AllData, Error> {
        let step = self.0.start(now_ns);
        self.tune(step)
    }

    fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<Tuned, AllData, Error> {
        let step = self.0.receive(outcome, ready_ns);
        self.tune(step)
    }
}
