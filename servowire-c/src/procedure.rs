//! What the procedures of all protocols have in common: they end with a number.

use core::mem::MaybeUninit;

use servowire_core::Step;

use crate::border::{OK, Refused, there};
use crate::result::{sw_code_t, sw_result_t};

/// The value of a step, as a number for C.
pub(crate) fn plain<Q, T, E>(step: Step<Q, T, E>, number: impl FnOnce(T) -> u32) -> Step<Q, u32, E> {
    step.and_then(|value, ready_ns| Step::Done { value: number(value), ready_ns })
}

/// Writes down what a procedure has ended with, and from when on its line is free.
pub(crate) fn ended<Q, E: Copy>(
    next: &Step<Q, u32, E>,
    value: Option<&mut MaybeUninit<u32>>,
    ready_ns: Option<&mut MaybeUninit<u64>>,
    error: impl FnOnce(E) -> Refused,
) -> Result<sw_result_t, Refused> {
    let value = there(value)?;
    let (result, end_ns) = match next {
        Step::Send { .. } => return Ok(sw_code_t::SW_PENDING as sw_result_t),
        Step::Done { value: it, ready_ns } => {
            value.write(*it);
            (OK, ready_ns)
        }
        Step::Failed { error: refusal, ready_ns } => (Err(error(*refusal)), ready_ns),
    };
    if let Some(ready_ns) = ready_ns {
        ready_ns.write(*end_ns);
    }
    result
}
