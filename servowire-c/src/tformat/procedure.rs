//! Procedures of several exchanges.

use core::mem::MaybeUninit;

use tformat::master::{Detection, EEPROM_POLLING, EepromAccess, MultiTurnZero, Reset, SingleTurnZero, Step};
use tformat::{Address, Error, Page, Resolution, Response};

use super::codec::error;
use super::master::{sw_tformat_t, sw_tformat_transmission_t};
use crate::border::{OK, Refused, border, in_range, state, there};
use crate::clock::time;
use crate::procedure::{ended, plain};
use crate::result::{sw_code_t, sw_result_t};

/// A procedure of several exchanges: it says what to send, and decides what to repeat. Its content is private.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_tformat_procedure_t {
    pub(crate) _private: [MaybeUninit<u64>; 20],
}
state!(sw_tformat_procedure_t, Procedure, 0x12);

#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Reset(Reset),
    SingleTurnZero(SingleTurnZero),
    MultiTurnZero(MultiTurnZero),
    Eeprom(EepromAccess),
    Detection(Detection),
}

#[derive(Clone, Copy)]
pub(crate) struct Procedure {
    kind: Kind,
    next: Step<u32>,
    /// The exchange of `next` has begun.
    asked: bool,
}

impl Kind {
    fn start(&mut self, now_ns: u64) -> Step<u32> {
        match self {
            Self::Reset(it) => plain(it.start(now_ns), |value| value.abs.get()),
            Self::SingleTurnZero(it) => plain(it.start(now_ns), |value| value.abs.get()),
            Self::MultiTurnZero(it) => plain(it.start(now_ns), |value| value.abm.get()),
            Self::Eeprom(it) => plain(it.start(now_ns), u32::from),
            Self::Detection(it) => plain(it.start(now_ns), |value| value.enid.into()),
        }
    }

    fn receive(&mut self, outcome: Result<Response, Error>, ready_ns: u64) -> Step<u32> {
        match self {
            Self::Reset(it) => plain(it.receive(outcome, ready_ns), |value| value.abs.get()),
            Self::SingleTurnZero(it) => plain(it.receive(outcome, ready_ns), |value| value.abs.get()),
            Self::MultiTurnZero(it) => plain(it.receive(outcome, ready_ns), |value| value.abm.get()),
            Self::Eeprom(it) => plain(it.receive(outcome, ready_ns), u32::from),
            Self::Detection(it) => plain(it.receive(outcome, ready_ns), |value| value.enid.into()),
        }
    }
}

fn begin(p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>, mut kind: Kind, now_ns: u64) -> Result<i32, Refused> {
    let next = kind.start(time(now_ns)?);
    sw_tformat_procedure_t::start(p, Procedure { kind, next, asked: false })?;
    OK
}

/// ID 7: clears all latched errors, ten requests. Position and turns stay. Continue with sw_tformat_next().
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_clear_errors(
    p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>,
    now_ns: u64,
) -> sw_result_t {
    border(|| begin(p, Kind::Reset(Reset::clear_errors()), now_ns))
}

/// ID 8: makes this position the zero of the turn, and reads the result back. **Shifts the commutation
/// angle of the motor.** The shaft must be at rest; `tolerance` is how far from zero, in counts, it may
/// appear to be afterwards.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_zero_single_turn_and_shift_commutation_angle(
    p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>,
    abs_bits: u8,
    tolerance: u32,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let resolution = in_range(Resolution::new(abs_bits, 0).ok())?;
        begin(p, Kind::SingleTurnZero(SingleTurnZero::set_and_shift_commutation_angle(resolution, tolerance)), now_ns)
    })
}

/// ID C: clears turns and errors, and reads the result back. **The machine loses its multi-turn
/// reference.** `tolerance` is how many turns it may appear to be off zero afterwards.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_clear_turns_and_lose_multi_turn_reference(
    p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>,
    abs_bits: u8,
    abm_bits: u8,
    tolerance: u32,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let resolution = in_range(Resolution::new(abs_bits, abm_bits).ok())?;
        begin(p, Kind::MultiTurnZero(MultiTurnZero::set_and_lose_multi_turn_reference(resolution, tolerance)), now_ns)
    })
}

/// Reads the EEPROM byte at `address`, 0..126, of `page`, 0..7.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_eeprom_read(
    p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>,
    page: u8,
    address: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let (page, address) = cell(page, address)?;
        begin(p, Kind::Eeprom(EepromAccess::read(page, address, EEPROM_POLLING)), now_ns)
    })
}

/// Writes an EEPROM byte and reads it back. Motor makers keep name plate and commutation data there: make
/// sure what is at the address.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_eeprom_write(
    p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>,
    page: u8,
    address: u8,
    edf: u8,
    now_ns: u64,
) -> sw_result_t {
    border(|| {
        let (page, address) = cell(page, address)?;
        begin(p, Kind::Eeprom(EepromAccess::write(page, address, edf, EEPROM_POLLING)), now_ns)
    })
}

fn cell(page: u8, address: u8) -> Result<(Page, Address), Refused> {
    let address = in_range(Address::new(address).filter(|address| *address != Address::PAGE_REGISTER))?;
    Ok((in_range(Page::new(page))?, address))
}

/// Finds the encoder after power-on: after 1.5 s it tries 5 Mbit/s, then 2.5 Mbit/s. The master's line is
/// that of the encoder when it ends with SW_OK; the value is its ENID.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_detect(
    p: Option<&mut MaybeUninit<sw_tformat_procedure_t>>,
    power_on_ns: u64,
) -> sw_result_t {
    border(|| begin(p, Kind::Detection(Detection::new()), power_on_ns))
}

/// Returns what a procedure needs next: SW_SEND with `to_send` filled (the exchange has begun in the
/// master: hear and poll it until it ends, then call this again), SW_PENDING while the exchange runs, SW_OK
/// when the procedure is done, or why it failed.
///
/// The first call begins. After the end the line and the encoder are free at sw_tformat_value()'s `ready_ns`.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_next(
    p: Option<&mut sw_tformat_procedure_t>,
    m: Option<&mut sw_tformat_t>,
    now_ns: u64,
    to_send: Option<&mut MaybeUninit<sw_tformat_transmission_t>>,
) -> sw_result_t {
    border(|| {
        let (p, m) = (sw_tformat_procedure_t::get(p)?, sw_tformat_t::get(m)?);
        let (now_ns, to_send) = (time(now_ns)?, there(to_send)?);
        if p.asked {
            if !m.asked() {
                return Err(sw_code_t::SW_E_NO_VALUE as sw_result_t);
            }
            let Some(outcome) = m.transaction.outcome() else { return Ok(sw_code_t::SW_PENDING as sw_result_t) };
            p.next = p.kind.receive(outcome.map(|value| value.response), m.transaction.until_ns());
            p.asked = false;
        }
        match p.next {
            Step::Send { request, not_before_ns } => {
                let start_ns = not_before_ns.max(now_ns);
                // A refusal changes nothing, the rate neither.
                m.free(start_ns)?;
                if let Kind::Detection(detection) = &p.kind {
                    m.line = detection.line();
                }
                let sent = m.begin(request, start_ns, to_send)?;
                p.asked = true;
                Ok(sent)
            }
            Step::Done { .. } => OK,
            Step::Failed { error: refusal, .. } => Err(error(refusal)),
        }
    })
}

/// Returns the result of a procedure that has ended with SW_OK: the EEPROM byte, ENID, ABM or ABS.
/// `ready_ns` (may be NULL) is the time from which the encoder accepts requests again; it is also set after
/// a failure, with the failure as the result.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_value(
    p: Option<&sw_tformat_procedure_t>,
    value: Option<&mut MaybeUninit<u32>>,
    ready_ns: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| ended(&sw_tformat_procedure_t::look(p)?.next, value, ready_ns, error))
}
