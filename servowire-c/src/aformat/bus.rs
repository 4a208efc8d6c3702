//! One request, and the responses of up to eight encoders.

use core::mem::MaybeUninit;

use nikon_aformat::bus::Addresses;
use nikon_aformat::master::{BusTransaction, Line, Transmission};
use nikon_aformat::{BitRate, EncoderAddress, Evidence, Policy, Resolution, Tolerated};

use super::codec::{
    error, flat, request, resolution, sw_aformat_encoder_t, sw_aformat_request_t, sw_aformat_response_t,
};
use crate::border::{OK, Refused, border, in_range, read, state, there};
use crate::clock::time;
use crate::result::{sw_code_t, sw_result_t};
use crate::tformat::sw_position_t;

/// A line with up to eight encoders of one kind: one request, the responses, and the newest position of each. Its content is
/// private; it may be copied. Only one context at a time may use it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_aformat_t {
    pub(crate) _private: [MaybeUninit<u64>; 112],
}
state!(sw_aformat_t, Master, 0x21);

#[derive(Clone, Copy)]
pub(crate) struct Master {
    line: Line,
    resolution: Resolution,
    transaction: BusTransaction,
    /// The transaction was requested.
    asked: bool,
    evidence: [Evidence; 8],
}

/// The data to send, and when to send them.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_aformat_transmission_t {
    /// When to start the first start bit.
    pub start_ns: u64,
    /// When the last delimiter ends.
    pub end_ns: u64,
    /// The content of the frames, the first bit of the line in bit 0.
    pub contents: [u16; 4],
    /// How many.
    pub len: u8,
}

/// Maximum number of frames in a block.
pub(super) const LONGEST: usize = 48;

impl Master {
    /// The transaction, if one was requested.
    #[inline(always)]
    fn told(&mut self) -> Result<&mut BusTransaction, Refused> {
        if self.asked { Ok(&mut self.transaction) } else { Err(sw_code_t::SW_E_NO_VALUE as sw_result_t) }
    }

    /// What became of it, and the positions that came of it. Out of line: two functions need it.
    #[inline(never)]
    fn result(&mut self) -> Result<sw_result_t, Refused> {
        for ea in self.transaction.bus().asked().without(self.transaction.bus().missing()).iter() {
            self.keep(ea);
        }
        match self.transaction.outcome() {
            None => Ok(sw_code_t::SW_PENDING as sw_result_t),
            Some(Ok(())) => OK,
            Some(Err(refusal)) => Err(error(refusal)),
        }
    }

    /// Out of line: eight times the same would be too much.
    #[inline(never)]
    fn keep(&mut self, ea: EncoderAddress) {
        let exchange = self.transaction.exchange(ea).filter(|exchange| exchange.response.abs().is_some());
        if let (Some(exchange), Some(evidence)) = (exchange, self.evidence.get_mut(usize::from(ea.get()))) {
            *evidence = exchange.evidence(self.resolution);
        }
    }

    /// The line and the widths, while no exchange is pending.
    pub(super) fn idle(&self) -> Result<(Line, Resolution), Refused> {
        let idle = self.transaction.outcome().is_some();
        if idle { Ok((self.line, self.resolution)) } else { Err(sw_code_t::SW_E_NOT_FREE as sw_result_t) }
    }

    fn of(&self, ea: u8) -> Option<&Evidence> {
        self.evidence.get(usize::from(ea))
    }
}

/// Prepares a line: bits per second (2500000, 4000000, 6666667, 8000000 or 16000000), and the properties of
/// its encoders.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_init(
    m: Option<&mut MaybeUninit<sw_aformat_t>>,
    bits_per_second: u32,
    encoder: Option<&sw_aformat_encoder_t>,
) -> sw_result_t {
    border(|| {
        let rate = in_range(BitRate::ALL.into_iter().find(|rate| rate.bits_per_second() == bits_per_second))?;
        let (line, resolution) = (Line::new(rate), resolution(*there(encoder)?)?);
        let state = Master {
            line,
            resolution,
            transaction: BusTransaction::idle(),
            asked: false,
            evidence: [Evidence::NEVER; 8],
        };
        sw_aformat_t::start(m, state)?;
        OK
    })
}

/// Sets the longest time from the end of a frame to its hand-over, ns, and the highest address on the line,
/// 0..7.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_set_hand_over(
    m: Option<&mut sw_aformat_t>,
    hand_over_ns: u32,
    highest_ea: u8,
) -> sw_result_t {
    border(|| {
        let m = sw_aformat_t::get(m)?;
        let highest = in_range(EncoderAddress::new(highest_ea))?;
        m.line = m.line.with_hand_over_ns(hand_over_ns).with_highest(highest);
        OK
    })
}

/// Begins a request to all encoders whose bit is set in `asked` (bit 0 is EA 0). Only commands that read
/// (0..7, 21..30) are sent this way; those with a single answer are sent to one encoder. SW_SEND with
/// `to_send` filled; SW_E_NOT_FREE while an exchange is pending, and before the time of
/// sw_aformat_until_ns().
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_read(
    m: Option<&mut sw_aformat_t>,
    command: u8,
    asked: u8,
    start_ns: u64,
    to_send: Option<&mut MaybeUninit<sw_aformat_transmission_t>>,
) -> sw_result_t {
    border(|| {
        let (m, start_ns, to_send) = (sw_aformat_t::get(m)?, time(start_ns)?, there(to_send)?);
        in_range(matches!(command, 0..=7 | 21..=30).then_some(()))?;
        let asked = Addresses::from_bits(asked);
        let ea = in_range(asked.iter().next())?;
        let request = request(&sw_aformat_request_t { data: 0, command, ea: ea.get(), fc: 0, address: 0, bank: 0 })?;
        in_range((request.command().is_multi_response() || asked.len() == 1).then_some(()))?;
        if m.transaction.outcome().is_none() || start_ns < m.transaction.until_ns() {
            return Err(sw_code_t::SW_E_NOT_FREE as sw_result_t);
        }
        m.asked = true;
        m.transaction.restart(request, m.resolution, asked, m.line, start_ns);
        if let Some(Err(refusal)) = m.transaction.outcome() {
            return Err(error(refusal));
        }
        sent(&m.transaction.transmission(), to_send);
        Ok(sw_code_t::SW_SEND as sw_result_t)
    })
}

/// What is to be sent as C reads it. A request without a bank has four frames at most.
pub(super) fn sent(transmission: &Transmission, to_send: &mut MaybeUninit<sw_aformat_transmission_t>) {
    let mut contents = [0; 4];
    for (to, frame) in contents.iter_mut().zip(transmission.frames.as_slice()) {
        *to = frame.word(nikon_aformat::BitOrder::LsbFirst);
    }
    to_send.write(sw_aformat_transmission_t {
        start_ns: transmission.start_ns,
        end_ns: transmission.end_ns,
        contents,
        len: u8::try_from(transmission.frames.as_slice().len()).unwrap_or(4),
    });
}

/// The frames of the caller, those that are not framed as `None`.
///
/// # Safety
/// As for [`read`]: `framed` is NULL or has a byte for each of the contents.
#[inline(always)]
pub(super) unsafe fn block(
    contents: *const u16,
    framed: *const u8,
    count: usize,
    frames: &mut [Option<u16>; LONGEST],
) -> Result<&[Option<u16>], Refused> {
    // SAFETY: the caller vouches for it.
    let contents = unsafe { read(contents, count)? };
    // SAFETY: as above.
    let framed = if framed.is_null() { None } else { Some(unsafe { read(framed, count)? }) };
    let block = in_range(frames.get_mut(..count))?;
    for (at, (to, content)) in block.iter_mut().zip(contents).enumerate() {
        let sound = framed.and_then(|framed| framed.get(at)).is_none_or(|framed| *framed != 0);
        *to = sound.then_some(*content);
    }
    Ok(block)
}

/// Takes frames that were heard one after another, with the last delimiter at `end_ns`: their contents, the
/// first bit of the line in bit 0. `framed` has a byte for each, 0 for a frame whose delimiter reads 0;
/// NULL says that all are framed. At most 48 frames at once. SW_OK once all encoders asked have answered;
/// sw_aformat_missing() says at any time which have not.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_aformat_hear(
    m: Option<&mut sw_aformat_t>,
    contents: *const u16,
    framed: *const u8,
    count: usize,
    end_ns: u64,
) -> sw_result_t {
    border(|| {
        let mut frames = [None; LONGEST];
        // SAFETY: the caller of the C function vouches for his memory.
        let block = unsafe { block(contents, framed, count, &mut frames)? };
        let (m, end_ns) = (sw_aformat_t::get(m)?, time(end_ns)?);
        m.told()?.push(block, end_ns);
        m.result()
    })
}

/// Sets the time to `now_ns`: ends an exchange whose time has run out, with SW_OK. Hand over received data
/// first.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_poll(m: Option<&mut sw_aformat_t>, now_ns: u64) -> sw_result_t {
    border(|| {
        let now_ns = time(now_ns)?;
        let m = sw_aformat_t::get(m)?;
        let _ = m.told()?.poll(now_ns);
        m.result()
    })
}

/// While an exchange is pending, the time at which to poll it; afterwards, the time from which the line is
/// free. 0 if nothing was asked, SW_NO_TIME for a state that was not started.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_until_ns(m: Option<&sw_aformat_t>) -> u64 {
    sw_aformat_t::look(m).map_or(crate::clock::SW_NO_TIME, |m| m.transaction.until_ns())
}

/// The encoders that were asked and have not answered, one bit each; 0xff for a state that was not started
/// or has not asked.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_missing(m: Option<&sw_aformat_t>) -> u8 {
    let asked = sw_aformat_t::look(m).ok().filter(|m| m.asked);
    asked.map_or(0xff, |m| m.transaction.bus().missing().bits())
}

/// The good response of an encoder to the newest request, as raw fields. SW_E_NO_VALUE if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_response(
    m: Option<&sw_aformat_t>,
    ea: u8,
    response: Option<&mut MaybeUninit<sw_aformat_response_t>>,
) -> sw_result_t {
    border(|| {
        let (m, response, ea) = (sw_aformat_t::look(m)?, there(response)?, in_range(EncoderAddress::new(ea))?);
        let exchange = m.transaction.exchange(ea);
        response.write(flat(&exchange.ok_or(sw_code_t::SW_E_NO_VALUE as sw_result_t)?.response));
        OK
    })
}

/// The angle of a shaft for commutation, where a turn is 2^32: **false if it must not be used, and the
/// outputs must be switched off.** It is judged now, as by sw_tformat_angle(); the battery is tolerated.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_angle(
    m: Option<&sw_aformat_t>,
    ea: u8,
    now_ns: u64,
    max_age_ns: u64,
    angle: Option<&mut MaybeUninit<u32>>,
) -> bool {
    let (Ok(m), Some(angle), Ok(now_ns)) = (sw_aformat_t::look(m), angle, time(now_ns)) else { return false };
    let policy = Policy::new(max_age_ns).tolerating(Tolerated::SINGLE_TURN);
    let Some(Ok(sample)) = m.of(ea).map(|evidence| evidence.at(now_ns, policy)) else { return false };
    angle.write(sample.angle().to_bits());
    true
}

/// The position with its turns, judged now, nothing tolerated: false if it must not be used.
#[unsafe(no_mangle)]
pub extern "C" fn sw_aformat_position(
    m: Option<&sw_aformat_t>,
    ea: u8,
    now_ns: u64,
    max_age_ns: u64,
    position: Option<&mut MaybeUninit<sw_position_t>>,
) -> bool {
    let (Ok(m), Some(position), Ok(now_ns)) = (sw_aformat_t::look(m), position, time(now_ns)) else { return false };
    let sample = m.of(ea).map(|evidence| evidence.at(now_ns, Policy::new(max_age_ns)));
    let Some(Ok(sample)) = sample else { return false };
    let (Some(counts), Some(turns)) = (sample.counts(), sample.turns()) else { return false };
    let (sampled_ns, single_turn) = (sample.sampled_ns(), sample.single_turn());
    position.write(sw_position_t { counts, sampled_ns, single_turn, turns });
    true
}
