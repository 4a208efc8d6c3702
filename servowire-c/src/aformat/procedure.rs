//! Procedures of several exchanges with one encoder.

use core::mem::MaybeUninit;

use nikon_aformat::master::{
    Detected, Detection, EepromRead, GuardedReset, Line, Reset, Step, Transaction, VerifiedWrite, Write,
};
use nikon_aformat::{EncoderAddress, EncoderId, Error, Resolution, Response, UserAddress};

use super::bus::{LONGEST, block, sent, sw_aformat_t, sw_aformat_transmission_t};
use super::codec::error;
use crate::border::{OK, Refused, border, in_range, state, there};
use crate::clock::time;
use crate::procedure::{ended, plain};
use crate::result::{sw_code_t, sw_result_t};

/// A procedure of several exchanges with one encoder: it says what to send, takes what is heard, and decides what to repeat. Its
/// content is private. While it runs, nothing else may use the line.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_aformat_procedure_t {
    pub(crate) _private: [MaybeUninit<u64>; 80],
}
state!(sw_aformat_procedure_t, Procedure, 0x22);

#[derive(Clone, Copy)]
enum Kind {
    Reset(Reset),
    GuardedReset(GuardedReset),
    Write(Write),
    VerifiedWrite(VerifiedWrite),
    EepromRead(EepromRead),
    Detection(Detection),
}

#[derive(Clone, Copy)]
pub(crate) struct Procedure {
    kind: Kind,
    line: Line,
    resolution: Resolution,
    transaction: Transaction,
    next: Step<u32>,
    /// The exchange of `next` has begun.
    asked: bool,
    /// Who was found, with these widths.
    found: Option<(EncoderAddress, Resolution)>,
}

fn alarms(response: Response) -> u32 {
    response.alm().map_or(0, |alm| alm.bits().into())
}

impl Procedure {
    fn start(&mut self, now_ns: u64) {
        self.next = match &mut self.kind {
            Kind::Reset(it) => plain(it.start(now_ns), alarms),
            Kind::GuardedReset(it) => plain(it.start(now_ns), alarms),
            Kind::Write(it) => plain(it.start(now_ns), |_| 0),
            Kind::VerifiedWrite(it) => plain(it.start(now_ns), |()| 0),
            Kind::EepromRead(it) => plain(it.start(now_ns), u32::from),
            Kind::Detection(it) => plain(it.start(now_ns), |_| 0),
        };
    }

    fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) {
        self.next = match &mut self.kind {
            Kind::Reset(it) => plain(it.receive(outcome, ready_ns), alarms),
            Kind::GuardedReset(it) => plain(it.receive(outcome, ready_ns), alarms),
            Kind::Write(it) => plain(it.receive(outcome, ready_ns), |_| 0),
            Kind::VerifiedWrite(it) => plain(it.receive(outcome, ready_ns), |()| 0),
            Kind::EepromRead(it) => plain(it.receive(outcome, ready_ns), u32::from),
            Kind::Detection(it) => {
                let found = &mut self.found;
                plain(it.receive(outcome, ready_ns), |Detected { ea, type_word, resolution }| {
                    *found = resolution.map(|resolution| (ea, resolution));
                    type_word.0.into()
                })
            }
        };
    }

    /// What became of the exchange.
    fn result(&self) -> Result<sw_result_t, Refused> {
        match self.transaction.outcome() {
            None => Ok(sw_code_t::SW_PENDING as sw_result_t),
            Some(Ok(_)) => OK,
            Some(Err(refusal)) => Err(error(*refusal)),
        }
    }
}

fn begin(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    kind: Kind,
    now_ns: u64,
) -> Result<sw_result_t, Refused> {
    let (now_ns, (line, resolution)) = (time(now_ns)?, sw_aformat_t::look(m)?.idle()?);
    let next = Step::Done { value: 0, ready_ns: now_ns };
    let transaction = Transaction::idle();
    let mut procedure = Procedure { kind, line, resolution, transaction, next, asked: false, found: None };
    procedure.start(now_ns);
    sw_aformat_procedure_t::start(p, procedure)?;
    OK
}

/// A reset: command 8 (clears the status), 9 (the turns), 10 (both), 11 (gives the only encoder on the line the address `ea`) or 12
/// (**makes this position the zero of the turn and shifts the commutation angle**), eight times, and the status 30 ms later: its ALM is
/// the value. With `careful` 1 the encoder is first made to restart its count, and a failure tells whether
/// the reset was done (SW_E_AFORMAT_NOT_DONE, SW_E_AFORMAT_EFFECT_UNKNOWN); with 0 only the eight requests
/// of the documents are sent. The line and the widths are those of `m`, which must not be used meanwhile.
/// Continue with sw_aformat_next().
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_reset(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    command: u8,
    ea: u8,
    careful: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let (ea, careful) = (in_range(EncoderAddress::new(ea))?, flag(careful)?);
        let reset = match command {
            8 => Reset::clear_status(ea),
            9 => Reset::clear_multiturn(ea),
            10 => Reset::clear_status_and_multiturn(ea),
            11 => Reset::set_address_of_the_only_encoder(ea),
            12 => Reset::set_single_turn_zero_and_shift_commutation_angle(ea),
            _ => return Err(sw_code_t::SW_E_ARGUMENT as sw_result_t),
        };
        let kind = if careful { Kind::GuardedReset(GuardedReset::new(reset)) } else { Kind::Reset(reset) };
        begin(p, m, kind, now_ns)
    })
}

fn flag(number: u8) -> Result<bool, Refused> {
    in_range((number < 2).then_some(number == 1))
}

/// Reads the EEPROM word at `address`; the word is the value. With `careful` 1 the first response is never
/// trusted: it may be left from an interrupted access; use 0 only if you know that there was none.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_eeprom_read(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    ea: u8,
    address: u8,
    careful: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let read = EepromRead::new(in_range(EncoderAddress::new(ea))?, address);
        let read = if flag(careful)? { read } else { read.knowing_that_none_was_broken_off() };
        begin(p, m, Kind::EepromRead(read), now_ns)
    })
}

fn write(write: Write, careful: u8) -> Result<Kind, Refused> {
    Ok(if flag(careful)? { Kind::VerifiedWrite(VerifiedWrite::new(write)) } else { Kind::Write(write) })
}

/// Writes an EEPROM word at `address`, 0x00..0xef. With `careful` 1 it is read back and a failure tells whether it was written; with 0
/// the status is read 30 ms later.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_eeprom_write(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    ea: u8,
    address: u8,
    data: u16,
    careful: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let (ea, address) = (in_range(EncoderAddress::new(ea))?, in_range(UserAddress::new(address))?);
        begin(p, m, write(Write::eeprom(ea, address, data), careful)?, now_ns)
    })
}

/// Gives the encoder at `ea` an identification code of 24 bits. `careful` as in sw_aformat_eeprom_write().
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_write_id(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    ea: u8,
    id: u32,
    careful: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let (ea, id) = (in_range(EncoderAddress::new(ea))?, in_range(EncoderId::new(id))?);
        begin(p, m, write(Write::id(ea, id), careful)?, now_ns)
    })
}

/// Gives the encoder with this identification code the address `ea`.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_set_address(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    id: u32,
    ea: u8,
    careful: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let (ea, id) = (in_range(EncoderAddress::new(ea))?, in_range(EncoderId::new(id))?);
        begin(p, m, write(Write::address(id, ea), careful)?, now_ns)
    })
}

/// Finds an encoder and its widths: the one at `ea`, or with 255 the only one on the line. The value is its type word.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_detect(
    p: Option<&mut MaybeUninit<sw_aformat_procedure_t>>,
    m: Option<&sw_aformat_t>,
    ea: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let detection = if ea == 255 { Detection::search() } else { Detection::of(in_range(EncoderAddress::new(ea))?) };
        begin(p, m, Kind::Detection(detection), now_ns)
    })
}

/// Returns what a procedure needs next: SW_SEND with `to_send` filled (hear and poll by
/// sw_aformat_procedure_hear() and sw_aformat_procedure_poll() until the exchange ends, then call this
/// again), SW_PENDING while the exchange runs, SW_OK when the procedure is done, or why it failed.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_next(
    p: Option<&mut sw_aformat_procedure_t>,
    now_ns: u64,
    to_send: Option<&mut MaybeUninit<sw_aformat_transmission_t>>,
) -> sw_result_t {
    border(|| {
        let (p, now_ns, to_send) = (sw_aformat_procedure_t::get(p)?, time(now_ns)?, there(to_send)?);
        if p.asked {
            let Some(outcome) = p.transaction.outcome() else { return Ok(sw_code_t::SW_PENDING as sw_result_t) };
            let (outcome, ready_ns) = (outcome.map(|value| value.response), p.transaction.until_ns());
            p.receive(outcome, ready_ns);
            p.asked = false;
        }
        match p.next {
            Step::Send { request, not_before_ns } => {
                p.transaction.restart(request, p.resolution, p.line, not_before_ns.max(now_ns));
                p.asked = true;
                sent(&p.transaction.transmission(), to_send);
                Ok(sw_code_t::SW_SEND as sw_result_t)
            }
            Step::Done { .. } => OK,
            Step::Failed { error: refusal, .. } => Err(error(refusal)),
        }
    })
}

/// Takes frames that were heard one after another, as sw_aformat_hear() does. SW_PENDING, or the exchange
/// has ended: SW_OK or its refusal.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_procedure_hear(
    p: Option<&mut sw_aformat_procedure_t>,
    contents: *const u16,
    framed: *const u8,
    count: usize,
    end_ns: u64,
) -> sw_result_t {
    border(|| {
        let mut frames = [None; LONGEST];
        // SAFETY: the caller of the C function vouches for his memory.
        let block = unsafe { block(contents, framed, count, &mut frames)? };
        let (p, end_ns) = (sw_aformat_procedure_t::get(p)?, time(end_ns)?);
        p.transaction.push(block, end_ns);
        p.result()
    })
}

/// Sets the time to `now_ns`: ends an exchange whose time has run out. Hand over received data first.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_procedure_poll(p: Option<&mut sw_aformat_procedure_t>, now_ns: u64) -> sw_result_t {
    border(|| {
        let (p, now_ns) = (sw_aformat_procedure_t::get(p)?, time(now_ns)?);
        let _ = p.transaction.poll(now_ns);
        p.result()
    })
}

/// While an exchange of a procedure is pending, the time at which to poll it; afterwards, the time from
/// which the line is free. SW_NO_TIME for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_procedure_until_ns(p: Option<&sw_aformat_procedure_t>) -> u64 {
    sw_aformat_procedure_t::look(p).map_or(crate::clock::SW_NO_TIME, |p| p.transaction.until_ns())
}

/// Returns the result of a procedure that has ended with SW_OK: the EEPROM word, the type word, ALM after a
/// reset, else 0. `ready_ns` (may be NULL) is the time from which the encoder accepts requests again; it is
/// also set after a failure, with the failure as the result.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_value(
    p: Option<&sw_aformat_procedure_t>,
    value: Option<&mut MaybeUninit<u32>>,
    ready_ns: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| ended(&sw_aformat_procedure_t::look(p)?.next, value, ready_ns, error))
}

/// After sw_aformat_detect() has ended with SW_OK: the address and the widths of the encoder. SW_E_NO_VALUE
/// before that, and for an unknown type word.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_detected(
    p: Option<&sw_aformat_procedure_t>,
    ea: Option<&mut MaybeUninit<u8>>,
    st_bits: Option<&mut MaybeUninit<u8>>,
    mt_bits: Option<&mut MaybeUninit<u8>>,
) -> sw_result_t {
    border(|| {
        let (p, ea) = (sw_aformat_procedure_t::look(p)?, there(ea)?);
        let (st_bits, mt_bits) = (there(st_bits)?, there(mt_bits)?);
        let (who, resolution) = p.found.ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?;
        ea.write(who.get());
        st_bits.write(resolution.st_bits());
        mt_bits.write(resolution.mt_bits());
        OK
    })
}
