//! Procedures of several transactions. Every row is a list of requests, each with its reply and the time that the master then
//! lets pass.

use nikon_aformat::BitOrder::MsbFirst;
use nikon_aformat::master::{EepromRead, Reset, Step, Write};
use nikon_aformat::{Error, Request, Resolution, Response, UserAddress};
use serde::Deserialize;

use super::reply::words;
use super::{address, class, command, or_unreadable};
use crate::hex::Hex;
use crate::row::{Fault, Verdict, same};

#[derive(Deserialize)]
#[serde(tag = "procedure", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum ProcedureRow {
    EepromRead { ea: u32, addr: u8, steps: Vec<StepRow>, expect: Outcome },
    EepromWrite { ea: u32, addr: u8, data: u16, steps: Vec<StepRow>, expect: Outcome },
    Reset { cmd: u8, ea: u32, steps: Vec<StepRow>, expect: Outcome },
    ResetInterrupted { cmd: u8, ea: u32, steps: Vec<StepRow>, expect: Outcome },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StepRow {
    tx: Vec<Hex>,
    rx: Option<Vec<Hex>>,
    es: Option<u8>,
    then: String,
}

/// What the procedure ends with.
#[derive(Deserialize, Debug, Default, PartialEq)]
#[serde(deny_unknown_fields)]
pub(super) struct Outcome {
    ok: Option<bool>,
    error: Option<String>,
    data: Option<u16>,
    alm_after: Option<u16>,
    requests_of_this_code: Option<usize>,
    consecutive_done: Option<u8>,
}

pub(super) fn procedure(_: &str, row: ProcedureRow) -> Verdict {
    match row {
        ProcedureRow::EepromRead { ea, addr, steps, expect } => {
            let mut read = EepromRead::new(address(ea)?, addr).knowing_that_none_was_broken_off();
            let end = drive(&steps, read.start(0), |outcome, now_ns| read.receive(outcome, now_ns))?;
            let real = match end {
                Ok(data) => Outcome { data: Some(data), ..Outcome::default() },
                Err(error) => failure(error),
            };
            same("outcome", &expect, &real)
        }
        ProcedureRow::EepromWrite { ea, addr, data, steps, expect } => {
            let mut write = Write::eeprom(address(ea)?, or_unreadable(UserAddress::try_from(addr))?, data);
            let end = drive(&steps, write.start(0), |outcome, now_ns| write.receive(outcome, now_ns))?;
            let real = match end {
                Ok(_) => Outcome { ok: Some(true), ..Outcome::default() },
                Err(error) => failure(error),
            };
            same("outcome", &expect, &real)
        }
        ProcedureRow::Reset { cmd, ea, steps, expect } | ProcedureRow::ResetInterrupted { cmd, ea, steps, expect } => {
            reset(cmd, ea, &steps, &expect)
        }
    }
}

/// The rows call an interrupted reset a time-out, and nothing else.
fn failure(error: Error) -> Outcome {
    match error {
        Error::Interrupted { done } => {
            Outcome { error: Some("timeout".to_owned()), consecutive_done: Some(done), ..Outcome::default() }
        }
        error => Outcome { error: Some(class(error).to_owned()), ..Outcome::default() },
    }
}

fn reset(cmd: u8, ea: u32, steps: &[StepRow], expect: &Outcome) -> Verdict {
    let ea = address(ea)?;
    let mut reset = match command(cmd)?.code() {
        8 => Reset::clear_status(ea),
        9 => Reset::clear_multiturn(ea),
        10 => Reset::clear_status_and_multiturn(ea),
        11 => Reset::set_address_of_the_only_encoder(ea),
        12 => Reset::set_single_turn_zero_and_shift_commutation_angle(ea),
        code => return Err(Fault::Unreadable(format!("command {code} is no reset"))),
    };
    let first = reset.start(0);
    let mut sent = 0;
    let end = drive(steps, first, |outcome, now_ns| {
        sent += usize::from(reset.done() < Reset::REQUESTS);
        reset.receive(outcome, now_ns)
    })?;
    let mut real = match end {
        Ok(status) => Outcome { alm_after: status.alm().map(|alm| alm.bits()), ..Outcome::default() },
        Err(error) => failure(error),
    };
    real.requests_of_this_code = expect.requests_of_this_code.map(|_| sent);
    same("outcome", expect, &real)
}

/// Plays the steps: each has to be the request that the procedure wants, sent after the wait that the step before names.
fn drive<T: std::fmt::Debug>(
    steps: &[StepRow],
    first: Step<T>,
    mut answer: impl FnMut(Result<Response, Error>, u64) -> Step<T>,
) -> Result<Result<T, Error>, Fault> {
    let mut step = first;
    for row in steps {
        let Step::Send { request, not_before_ns } = step else {
            return Err(Fault::Differs { what: "steps", expected: "more".to_owned(), real: format!("{step:?}") });
        };
        let sent: Vec<u16> = request.emit().as_slice().iter().map(|frame| frame.word(MsbFirst)).collect();
        same("tx", &words(&row.tx), &sent)?;
        let outcome = reply(row, request)?;
        let now_ns = not_before_ns + 100_000;
        step = answer(outcome, now_ns);
        let then = match step {
            Step::Send { not_before_ns, .. } => match not_before_ns - now_ns {
                300_000 => "wait_300us_and_repeat",
                30_000_000 => "wait_30ms",
                _ => "repeat",
            },
            Step::Done { .. } => "done",
            Step::Failed { .. } => "restart_count",
        };
        same("then", &row.then.as_str(), &then)?;
    }
    match step {
        Step::Done { value, .. } => Ok(Ok(value)),
        Step::Failed { error, .. } => Ok(Err(error)),
        Step::Send { .. } => {
            Err(Fault::Differs { what: "steps", expected: "the end".to_owned(), real: format!("{step:?}") })
        }
    }
}

fn reply(row: &StepRow, request: Request) -> Result<Result<Response, Error>, Fault> {
    let Some(rx) = &row.rx else { return Ok(Err(Error::NoResponse)) };
    let outcome = Response::parse_words(&request.expected(Resolution::default()), &words(rx), MsbFirst);
    if let (Some(es), Ok(response)) = (row.es, outcome) {
        same("es", &Some(es), &response.es().map(|es| es.bits()))?;
    }
    Ok(outcome)
}
