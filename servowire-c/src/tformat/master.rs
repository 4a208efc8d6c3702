//! One request and its answer, and what is known about the position.

use core::mem::MaybeUninit;

use tformat::master::{Line, Transaction};
use tformat::{Almc, BitRate, DataId, Doubt, Evidence, Policy, Request, Resolution, Response, Tolerated};

use super::codec::{error, flat, request, sw_tformat_request_t, sw_tformat_response_t};
use super::names::{sw_tformat_doubt_t, sw_tformat_turns_t};
use crate::border::{OK, Refused, border, in_range, read, state, there};
use crate::clock::time;
use crate::result::{sw_code_t, sw_result_t};

/// A master: the line, one request and its response, and the newest position. Its content is private; it may be copied.
///
/// One context at a time: an interrupt that calls it while another call runs is a race.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_tformat_t {
    pub(crate) _private: [MaybeUninit<u64>; 36],
}
state!(sw_tformat_t, Master, 0x11);

#[derive(Clone, Copy)]
pub(crate) struct Master {
    pub(super) line: Line,
    resolution: Resolution,
    /// What is tolerated where the motor is commutated, and where turns are counted.
    commutating: Tolerated,
    positioning: Tolerated,
    pub(super) transaction: Transaction,
    evidence: Evidence,
}

/// The times of a line, in ns: sw_tformat_get_line() returns the defaults; change those that differ.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_line_t {
    /// 2500000 or 5000000.
    pub bits_per_second: u32,
    /// Longest time from the end of the request to the start bit of the response; default 10 000.
    pub response_timeout_ns: u32,
    /// Longest time from the end of a field to the end of the next; default one and a half field times.
    pub field_timeout_ns: u32,
    /// Shortest time from the end of the request to the start bit of the response; default four bits.
    pub turn_around_ns: u32,
    /// Longest time from the end of a byte to its hand-over: interrupt latency, or the time after which an
    /// idle line is reported.
    pub hand_over_ns: u32,
    /// The driver is on for this time before the request; default 1000.
    pub driver_lead_ns: u32,
    /// From the end of the request to the instant at which the position is taken; default 480.
    pub sampling_ns: u32,
    /// 1 if the request itself is received too: this makes the errors clearer, and nothing else depends on
    /// it.
    pub echo: u8,
}

/// The data to send, and when to send them.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_tformat_transmission_t {
    /// When to start the start bit.
    pub start_ns: u64,
    /// When the last bit ends.
    pub end_ns: u64,
    /// When the driver is to be switched on.
    pub driver_on_ns: u64,
    /// When to switch the driver off at the latest; `end_ns` is the earliest.
    pub driver_off_ns: u64,
    /// The fields, one byte each.
    pub bytes: [u8; 4],
    /// How many.
    pub len: u8,
}

/// A position that may be used.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_position_t {
    /// Turns times the counts of a turn, plus the single turn.
    pub counts: i64,
    /// When it was sampled.
    pub sampled_ns: u64,
    /// Counts in the turn.
    pub single_turn: u32,
    /// Turns.
    pub turns: i32,
}

impl Master {
    /// The last exchange has ended by then, including a late answer.
    #[inline(always)]
    pub(super) fn free(&self, start_ns: u64) -> Result<(), Refused> {
        if self.transaction.outcome().is_none() || start_ns < self.transaction.until_ns() {
            return Err(sw_code_t::SW_E_NOT_FREE as sw_result_t);
        }
        Ok(())
    }

    pub(super) fn begin(
        &mut self,
        request: Request,
        start_ns: u64,
        to_send: &mut MaybeUninit<sw_tformat_transmission_t>,
    ) -> Result<sw_result_t, Refused> {
        self.free(start_ns)?;
        if matches!(request, Request::SetSingleTurnZero | Request::ResetTurnsAndErrors) {
            // What was heard before counts from another zero.
            self.evidence = Evidence::NEVER;
        }
        self.transaction.restart(request, self.line, start_ns);
        if let Some(Err(refusal)) = self.transaction.outcome() {
            return Err(error(*refusal));
        }
        let transmission = self.transaction.transmission();
        // A request has four fields at most.
        let [a, b, c, d, ..] = transmission.frame.to_array();
        to_send.write(sw_tformat_transmission_t {
            start_ns: transmission.start_ns,
            end_ns: transmission.end_ns,
            driver_on_ns: transmission.driver_on_ns,
            driver_off_ns: transmission.driver_off.latest_ns,
            bytes: [a, b, c, d],
            len: transmission.frame.fields(),
        });
        Ok(sw_code_t::SW_SEND as sw_result_t)
    }

    /// The transaction is one that was asked for: a request has fields.
    pub(super) fn asked(&self) -> bool {
        self.transaction.transmission().frame.fields() > 0
    }

    /// What became of it, and the position that came of it if it was pending until now. Out of line: three functions need it.
    #[inline(never)]
    fn result(&mut self, pending: bool) -> Result<sw_result_t, Refused> {
        match self.transaction.outcome() {
            None => Ok(sw_code_t::SW_PENDING as sw_result_t),
            // A transaction that nobody has asked for counts as one that failed.
            Some(Err(_)) if !self.asked() => Err(sw_code_t::SW_E_NO_VALUE as sw_result_t),
            Some(Err(refusal)) => Err(error(*refusal)),
            Some(Ok(value)) => {
                if pending && of_position(&value.response) {
                    self.evidence = value.evidence(self.resolution);
                }
                OK
            }
        }
    }

    fn commutation(&self, max_age_ns: u64) -> Policy {
        Policy::new(max_age_ns).tolerating(self.commutating)
    }
}

/// The answers from which an angle can be made.
#[inline(always)]
fn of_position(response: &Response) -> bool {
    matches!(response, Response::ReadSingleTurn(_) | Response::ReadAll(_))
}

fn rate(bits_per_second: u32) -> Result<BitRate, Refused> {
    in_range(BitRate::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_per_second))
}

/// Prepares a master: bits per second (2500000 or 5000000) and the widths of the encoder's single-turn data, 1..24 bits, and
/// multi-turn data, 0..24 bits.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_init(
    m: Option<&mut MaybeUninit<sw_tformat_t>>,
    bits_per_second: u32,
    abs_bits: u8,
    abm_bits: u8,
) -> sw_result_t {
    border(|| {
        let m = there(m)?;
        let resolution = in_range(Resolution::new(abs_bits, abm_bits).ok())?;
        let line = Line::new(rate(bits_per_second)?);
        let state = Master {
            line,
            resolution,
            commutating: Tolerated::SINGLE_TURN,
            positioning: Tolerated::MULTI_TURN,
            transaction: Transaction::idle(),
            evidence: Evidence::NEVER,
        };
        sw_tformat_t::start(Some(m), state)?;
        OK
    })
}

/// Sets other widths, or turns of another kind (`flags`: sw_tformat_turns_t). The position that was heard last is dropped.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_set_resolution(
    m: Option<&mut sw_tformat_t>,
    abs_bits: u8,
    abm_bits: u8,
    flags: u8,
) -> sw_result_t {
    border(|| {
        let m = sw_tformat_t::get(m)?;
        let mut resolution = in_range(Resolution::new(abs_bits, abm_bits).ok())?;
        in_range((flags < 4).then_some(()))?;
        if flags & sw_tformat_turns_t::SW_TFORMAT_UNSIGNED_TURNS as u8 != 0 {
            resolution = resolution.with_unsigned_turns();
        }
        if flags & sw_tformat_turns_t::SW_TFORMAT_UPPER_BITS_IGNORED as u8 != 0 {
            resolution = resolution.with_upper_bits_ignored();
        }
        m.resolution = resolution;
        m.evidence = Evidence::NEVER;
        OK
    })
}

/// Reads the present times of the line.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_get_line(
    m: Option<&sw_tformat_t>,
    line: Option<&mut MaybeUninit<sw_tformat_line_t>>,
) -> sw_result_t {
    border(|| {
        let (it, line) = (&sw_tformat_t::look(m)?.line, there(line)?);
        line.write(sw_tformat_line_t {
            bits_per_second: it.rate.bits_per_second(),
            response_timeout_ns: it.response_timeout_ns,
            field_timeout_ns: it.field_timeout_ns,
            turn_around_ns: it.turn_around_ns,
            hand_over_ns: it.hand_over_ns,
            driver_lead_ns: it.driver_lead_ns,
            sampling_ns: it.sampling_ns,
            echo: it.echo.into(),
        });
        OK
    })
}

/// Sets other times of the line, from the next request on. `echo` is 0 or 1.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_set_line(m: Option<&mut sw_tformat_t>, line: Option<&sw_tformat_line_t>) -> sw_result_t {
    border(|| {
        let (m, line) = (sw_tformat_t::get(m)?, there(line)?);
        in_range((line.echo < 2).then_some(()))?;
        let it = Line::new(rate(line.bits_per_second)?)
            .with_response_timeout_ns(line.response_timeout_ns)
            .with_field_timeout_ns(line.field_timeout_ns)
            .with_turn_around_ns(line.turn_around_ns)
            .with_hand_over_ns(line.hand_over_ns)
            .with_driver_lead_ns(line.driver_lead_ns)
            .with_sampling_ns(line.sampling_ns);
        m.line = if line.echo == 1 { it.with_echo() } else { it };
        OK
    })
}

/// Sets the alarms (sum of sw_tformat_almc_t) that sw_tformat_angle() and sw_tformat_position() tolerate from now on, in addition to
/// their own.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_tolerate(m: Option<&mut sw_tformat_t>, almc: u8) -> sw_result_t {
    border(|| {
        let (m, alarms) = (sw_tformat_t::get(m)?, Almc::from_bits_retain(almc));
        m.commutating = Tolerated::SINGLE_TURN.alarms(alarms);
        m.positioning = Tolerated::MULTI_TURN.alarms(alarms);
        OK
    })
}

/// Begins a read: ID 0, 1, 2 or 3. The start bit of the request is on the line at `start_ns`, now or later.
/// The result is SW_SEND, and `to_send` is filled. SW_E_NOT_FREE while an exchange is pending, and before
/// the time of sw_tformat_until_ns().
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_read(
    m: Option<&mut sw_tformat_t>,
    id: u8,
    start_ns: u64,
    to_send: Option<&mut MaybeUninit<sw_tformat_transmission_t>>,
) -> sw_result_t {
    border(|| {
        let m = sw_tformat_t::get(m)?;
        let request = in_range(match DataId::from_code(id) {
            Some(DataId::ReadSingleTurn) => Some(Request::ReadSingleTurn),
            Some(DataId::ReadMultiTurn) => Some(Request::ReadMultiTurn),
            Some(DataId::ReadEncoderId) => Some(Request::ReadEncoderId),
            Some(DataId::ReadAll) => Some(Request::ReadAll),
            _ => None,
        })?;
        m.begin(request, time(start_ns)?, there(to_send)?)
    })
}

/// Begins one exchange of any kind. IDs 6, 7, 8 and C change the encoder: use the procedures, which make
/// the necessary repetitions, waits and checks.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_start(
    m: Option<&mut sw_tformat_t>,
    asked: Option<&sw_tformat_request_t>,
    start_ns: u64,
    to_send: Option<&mut MaybeUninit<sw_tformat_transmission_t>>,
) -> sw_result_t {
    border(|| {
        let request = request(*there(asked)?)?;
        sw_tformat_t::get(m)?.begin(request, time(start_ns)?, there(to_send)?)
    })
}

/// Takes bytes that were received back to back; the last one ended at `end_ns`, or was handed over within the latency of the line
/// after that. SW_PENDING, SW_OK with a response, or a refusal. SW_E_NO_VALUE if there was no request.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_tformat_hear(
    m: Option<&mut sw_tformat_t>,
    bytes: *const u8,
    len: usize,
    end_ns: u64,
) -> sw_result_t {
    border(|| {
        let m = sw_tformat_t::get(m)?;
        // SAFETY: the caller of the C function vouches for his memory.
        let bytes = unsafe { read(bytes, len)? };
        let end_ns = time(end_ns)?;
        let pending = m.transaction.outcome().is_none();
        match m.transaction.push(bytes, end_ns) {
            // The usual case, without a look at the state again.
            Some(Ok(value)) => {
                if pending && of_position(&value.response) {
                    m.evidence = value.evidence(m.resolution);
                }
                OK
            }
            _ => m.result(pending),
        }
    })
}

/// Reports a framing error of the UART for the byte that ended at `end_ns`.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_framing_error(m: Option<&mut sw_tformat_t>, end_ns: u64) -> sw_result_t {
    border(|| {
        let end_ns = time(end_ns)?;
        let m = sw_tformat_t::get(m)?;
        let pending = m.transaction.outcome().is_none();
        let _ = m.transaction.framing_error(end_ns);
        m.result(pending)
    })
}

/// Ends an exchange whose time is over at `now_ns`. Hand over what was received before you call it.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_poll(m: Option<&mut sw_tformat_t>, now_ns: u64) -> sw_result_t {
    border(|| {
        let m = sw_tformat_t::get(m)?;
        let now_ns = time(now_ns)?;
        match m.transaction.outcome() {
            Some(Ok(_)) => OK,
            Some(Err(_)) => m.result(false),
            None => {
                let _ = m.transaction.poll(now_ns);
                m.result(true)
            }
        }
    })
}

/// While an exchange is pending, the time at which to poll it; afterwards, the time from which the line is
/// free. 0 if nothing was asked, SW_NO_TIME for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_until_ns(m: Option<&sw_tformat_t>) -> u64 {
    sw_tformat_t::look(m).map_or(crate::clock::SW_NO_TIME, |m| m.transaction.until_ns())
}

/// The response of the exchange, once it has ended with SW_OK: raw fields. For control use sw_tformat_angle() and
/// sw_tformat_position().
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_response(
    m: Option<&sw_tformat_t>,
    response: Option<&mut MaybeUninit<sw_tformat_response_t>>,
) -> sw_result_t {
    border(|| {
        let (m, response) = (sw_tformat_t::look(m)?, there(response)?);
        let Some(Ok(value)) = m.transaction.outcome() else { return Err(sw_code_t::SW_E_NO_VALUE as sw_result_t) };
        response.write(flat(&value.response));
        OK
    })
}

/// The angle of the shaft for commutation, a turn is 2^32: **false if it must not be used, and the outputs
/// must be switched off.**
///
/// It is judged now: no older than `max_age_ns` since it was sampled, from a sound response to this master's request, of the right
/// encoder, without alarms that concern the single turn (tolerated are OF, BA, BE, ME and OS, and what sw_tformat_tolerate() names).
/// `angle` is unchanged if the result is false.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_angle(
    m: Option<&sw_tformat_t>,
    now_ns: u64,
    max_age_ns: u64,
    angle: Option<&mut MaybeUninit<u32>>,
) -> bool {
    let (Ok(m), Some(angle), Ok(now_ns)) = (sw_tformat_t::look(m), angle, time(now_ns)) else { return false };
    match m.evidence.at(now_ns, m.commutation(max_age_ns)) {
        Ok(sample) => {
            angle.write(sample.angle().to_bits());
            true
        }
        Err(_) => false,
    }
}

/// The position with its turns, judged now: false if it must not be used. Tolerated are OF and BA, and what sw_tformat_tolerate()
/// names. Turns come with ID 3. `position` is unchanged if the result is false.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_position(
    m: Option<&sw_tformat_t>,
    now_ns: u64,
    max_age_ns: u64,
    position: Option<&mut MaybeUninit<sw_position_t>>,
) -> bool {
    let (Ok(m), Some(position), Ok(now_ns)) = (sw_tformat_t::look(m), position, time(now_ns)) else { return false };
    let policy = Policy::new(max_age_ns).tolerating(m.positioning);
    let Ok(sample) = m.evidence.at(now_ns, policy) else { return false };
    let (Some(counts), Some(turns)) = (sample.counts(), sample.turns()) else { return false };
    let (sampled_ns, single_turn) = (sample.sampled_ns(), sample.single_turn());
    position.write(sw_position_t { counts, sampled_ns, single_turn, turns });
    true
}

/// Why sw_tformat_angle() is false: sw_tformat_doubt_t, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_tformat_doubt(m: Option<&sw_tformat_t>, now_ns: u64, max_age_ns: u64) -> sw_result_t {
    border(|| {
        let (m, now_ns) = (sw_tformat_t::look(m)?, time(now_ns)?);
        Ok(match m.evidence.at(now_ns, m.commutation(max_age_ns)) {
            Ok(_) => sw_tformat_doubt_t::SW_TFORMAT_NO_DOUBT,
            Err(Doubt::Never) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_NEVER,
            Err(Doubt::Old { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_OLD,
            Err(Doubt::Absent) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_ABSENT,
            Err(Doubt::Shifted { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_SHIFTED,
            Err(Doubt::RequestDamaged { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_REQUEST_DAMAGED,
            Err(Doubt::OtherEncoder { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_OTHER_ENCODER,
            Err(Doubt::UpperBits { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_UPPER_BITS,
            Err(Doubt::Alarms { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_ALARMS,
            Err(Doubt::Status { .. }) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_STATUS,
            Err(_) => sw_tformat_doubt_t::SW_TFORMAT_DOUBT_OTHER,
        } as sw_result_t)
    })
}
