//! Procedures of several transactions. Every row is a list of requests, each with its reply and the time that the master then
//! lets pass.

use nikon_aformat::BitOrder::MsbFirst;
use nikon_aformat::master::{EepromRead, Reset, Write};
use nikon_aformat::{Error, Request, Resolution, Response, UserAddress};
use serde::Deserialize;
use servowire_core::{Ended, Procedure};

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
            let end = drive(&steps, &mut read)?;
            let real = match end {
                Ok(data) => Outcome { data: Some(data), ..Outcome::default() },
                Err(error) => failure(error),
            };
            same("outcome", &expect, &real)
        }
        ProcedureRow::EepromWrite { ea, addr, data, steps, expect } => {
            let mut write = Write::eeprom(address(ea)?, or_unreadable(UserAddress::try_from(addr))?, data);
            let end = drive(&steps, &mut write)?;
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
    let end = drive(steps, &mut reset)?;
    // All of the reset's requests were compared with the rows.
    let frames: Vec<_> = reset.request().emit().as_slice().iter().map(|frame| frame.word(MsbFirst)).collect();
    let sent = steps.iter().filter(|row| words(&row.tx) == frames).count();
    let mut real = match end {
        Ok(status) => Outcome { alm_after: status.alm().map(|alm| alm.bits()), ..Outcome::default() },
        Err(error) => failure(error),
    };
    real.requests_of_this_code = expect.requests_of_this_code.map(|_| sent);
    same("outcome", expect, &real)
}

/// Plays the steps: each has to be the request that the procedure wants, sent after the wait that the step before names.
fn drive<P>(steps: &[StepRow], procedure: &mut P) -> Result<Result<P::Value, Error>, Fault>
where
    P: Procedure<Request = Request, Response = Response, Error = Error>,
{
    let (mut rows, mut played, mut ended_ns) = (steps.iter(), None::<&StepRow>, 0);
    let wait = |row: &StepRow, ended_ns: u64, not_before_ns: u64| {
        let then = match not_before_ns - ended_ns {
            300_000 => "wait_300us_and_repeat",
            30_000_000 => "wait_30ms",
            _ => "repeat",
        };
        same("then", &row.then.as_str(), &then)
    };
    let ended = servowire_core::run(procedure, 0, |request, not_before_ns| {
        if let Some(row) = played {
            wait(row, ended_ns, not_before_ns)?;
        }
        let Some(row) = rows.next() else {
            return Err(Fault::Differs { what: "steps", expected: "the end".to_owned(), real: request.to_string() });
        };
        let sent: Vec<u16> = request.emit().as_slice().iter().map(|frame| frame.word(MsbFirst)).collect();
        same("tx", &words(&row.tx), &sent)?;
        (played, ended_ns) = (Some(row), not_before_ns + 100_000);
        Ok(Ended { outcome: reply(row, request)?, ready_ns: ended_ns })
    })?;
    let then = if ended.outcome.is_ok() { "done" } else { "restart_count" };
    if let Some(row) = played {
        same("then", &row.then.as_str(), &then)?;
    }
    match rows.next() {
        None => Ok(ended.outcome),
        Some(_) => Err(Fault::Differs { what: "steps", expected: "more".to_owned(), real: then.to_owned() }),
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
