//! A receiver: start-up, link, positions judged at use, synchronisation.

use core::mem::MaybeUninit;

use hdsl::frame::Trailer;
use hdsl::master::{HFrame, Master, RestartReason, State};
use hdsl::sync::{Es, Synchroniser};
use hdsl::{EncoderId, Policy};

use super::error;
use super::names::{dialect as dialect_of, sw_hdsl_restart_t, sw_hdsl_state_t};
use crate::border::{OK, border, in_range, read, state, there};
use crate::clock::time;
use crate::result::{sw_code_t, sw_result_t};

/// Samples of the window of an answer: bytes, one a bit, eight samples each.
pub const SW_HDSL_WINDOW: usize = 72;
const NO_VALUE: sw_result_t = sw_code_t::SW_E_NO_VALUE as sw_result_t;
const _: () = assert!(SW_HDSL_WINDOW == hdsl::sampling::WINDOW);

/// A receiver: start-up, link, newest positions. Its content is private; it may be copied. Only one context
/// at a time may use it.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_t {
    pub(crate) _private: [MaybeUninit<u64>; 84],
}
state!(sw_hdsl_t, Master, 0x31);

/// What is to be sent from the start of an H-frame.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_transmission_t {
    /// SYNC to PARA, the first bit of the line in bit 0 of byte 0.
    pub head: [u8; 16],
    /// Bits of it.
    pub head_bits: u8,
    /// Zeros before the frame.
    pub lead_in: u8,
    /// 1: an encoder answers; the line is released after PARA, and reception begins one bit later. 0: filler is sent.
    pub answered: u8,
}

/// A fast position that may be used.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_position_t {
    /// Steps, turns included.
    pub position: i64,
    /// When it was sampled.
    pub sampled_ns: u64,
    /// Steps in the last H-frame.
    pub velocity: i32,
    /// The angle in the turn, a turn is 2^32; 0 if the steps of a turn were not told.
    pub angle: u32,
}

/// Prepares a free-running receiver, which begins with the start-up. `steps_per_turn` is the encoder's resolution, for angles; 0 if it is not
/// known. `dialect` is sw_hdsl_dialect_t.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_start(
    m: Option<&mut MaybeUninit<sw_hdsl_t>>,
    dialect: u8,
    steps_per_turn: u32,
) -> sw_result_t {
    border(|| {
        let mut master = Master::new(dialect_of(dialect)?);
        master.set_steps_per_turn(steps_per_turn);
        sw_hdsl_t::start(m, master)?;
        OK
    })
}

/// Returns the data to send in the present H-frame.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_transmission(
    m: Option<&sw_hdsl_t>,
    to_send: Option<&mut MaybeUninit<sw_hdsl_transmission_t>>,
) -> sw_result_t {
    border(|| {
        let (transmission, to_send) = (sw_hdsl_t::look(m)?.transmission(), there(to_send)?);
        let head = transmission.head.bits();
        to_send.write(sw_hdsl_transmission_t {
            head: head.bits().to_le_bytes(),
            head_bits: u8::try_from(head.len()).unwrap_or(128),
            lead_in: transmission.lead_in,
            answered: transmission.answered.into(),
        });
        OK
    })
}

/// Ends the H-frame: takes the samples of its window (SW_HDSL_WINDOW bytes if an encoder answers), which
/// ended at `end_ns`. The result is the state of the receiver, sw_hdsl_state_t.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sw_hdsl_hear(
    m: Option<&mut sw_hdsl_t>,
    samples: *const u8,
    len: usize,
    end_ns: u64,
) -> sw_result_t {
    border(|| {
        // SAFETY: the caller of the C function vouches for his memory.
        let samples = unsafe { read(samples, len)? };
        let (m, end_ns) = (sw_hdsl_t::get(m)?, time(end_ns)?);
        let _ = m.hear(samples, end_ns).map_err(error)?;
        Ok(state_of(m))
    })
}

/// The same from a receiver that gives bits: the 61 of the answer, the first of the line in bit 0; all ones without an answer.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_hear_bits(m: Option<&mut sw_hdsl_t>, bits: u64, end_ns: u64) -> sw_result_t {
    border(|| {
        let (m, end_ns) = (sw_hdsl_t::get(m)?, time(end_ns)?);
        let _ = m.hear_bits(bits, None, end_ns);
        Ok(state_of(m))
    })
}

fn state_of(m: &Master) -> sw_result_t {
    (match m.state() {
        State::Reset => sw_hdsl_state_t::SW_HDSL_RESET,
        State::Sync => sw_hdsl_state_t::SW_HDSL_SYNC,
        State::Start => sw_hdsl_state_t::SW_HDSL_START,
        State::Learn => sw_hdsl_state_t::SW_HDSL_LEARN,
        State::Check => sw_hdsl_state_t::SW_HDSL_CHECK,
        State::IdReq => sw_hdsl_state_t::SW_HDSL_IDREQ,
        State::WaitVsync => sw_hdsl_state_t::SW_HDSL_WAIT_VSYNC,
        State::Running => sw_hdsl_state_t::SW_HDSL_RUNNING,
    }) as sw_result_t
}

/// The fast position, judged now: **false if it must not be used, and the outputs must be switched off**:
/// never heard, no link, estimated, not aligned with the safe one, too fast, older than `max_age_ns`.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_position(
    m: Option<&sw_hdsl_t>,
    now_ns: u64,
    max_age_ns: u64,
    position: Option<&mut MaybeUninit<sw_hdsl_position_t>>,
) -> bool {
    let (Ok(m), Some(position), Ok(now_ns)) = (sw_hdsl_t::look(m), position, time(now_ns)) else { return false };
    let Ok(sample) = m.fast().at(now_ns, Policy::new(max_age_ns)) else { return false };
    position.write(sw_hdsl_position_t {
        position: sample.position(),
        sampled_ns: sample.sampled_ns(),
        velocity: sample.velocity(),
        angle: sample.angle().to_bits(),
    });
    true
}

/// The safe position of the last V-frame, judged now: false if it must not be used.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_safe_position(
    m: Option<&sw_hdsl_t>,
    now_ns: u64,
    max_age_ns: u64,
    position: Option<&mut MaybeUninit<i64>>,
) -> bool {
    let (Ok(m), Some(position), Ok(now_ns)) = (sw_hdsl_t::look(m), position, time(now_ns)) else { return false };
    let Ok(sample) = m.safe().at(now_ns, Policy::new(max_age_ns)) else { return false };
    position.write(sample.position());
    true
}

/// How the last H-frame heard continues, and what it brought besides the positions.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct sw_hdsl_frame_t {
    /// What to drive after the answer (TRAILER, then stuffing), the first bit of the line in bit 0 of byte
    /// 0.
    pub tail: [u8; 24],
    /// Bits of it.
    pub tail_bits: u8,
    /// Bits of TRAILER in which the line idles before it.
    pub tail_idle: u8,
    /// sw_hdsl_restart_t: set if the next frame begins a new start-up.
    pub restarted: u8,
    /// 1: the start-up broke off in a LEARN frame, and only the zeros of TRAILER are driven.
    pub cut: u8,
    /// Quality monitor, 0..15.
    pub quality: u8,
    /// RSSI of this answer, 0..12; 255 if it was not measured.
    pub rssi: u8,
    /// 1: no short message is in progress.
    pub short_free: u8,
    /// 1: no long message is in progress.
    pub long_free: u8,
    /// The word of the pipe channel: its byte; -1 for none (K30.7), -2 for a word in no table.
    pub pipe: i16,
    /// 1: it is a special character.
    pub pipe_special: u8,
    /// Acceleration words in a row that could not be used.
    pub acceleration_errors: u32,
    /// Restarts of the link since the start.
    pub restarts: u32,
}

fn restarted(reason: Option<RestartReason>) -> sw_hdsl_restart_t {
    match reason {
        None => sw_hdsl_restart_t::SW_HDSL_NO_RESTART,
        Some(RestartReason::Requested) => sw_hdsl_restart_t::SW_HDSL_RESTART_REQUESTED,
        Some(RestartReason::Learn(_)) => sw_hdsl_restart_t::SW_HDSL_RESTART_LEARN,
        Some(RestartReason::Pattern) => sw_hdsl_restart_t::SW_HDSL_RESTART_PATTERN,
        Some(RestartReason::Identifier(_)) => sw_hdsl_restart_t::SW_HDSL_RESTART_IDENTIFIER,
        Some(RestartReason::NoVsync) => sw_hdsl_restart_t::SW_HDSL_RESTART_NO_VSYNC,
        Some(RestartReason::Quality) => sw_hdsl_restart_t::SW_HDSL_RESTART_QUALITY,
        Some(RestartReason::AccelerationErrors) => sw_hdsl_restart_t::SW_HDSL_RESTART_ACCELERATION,
        Some(_) => sw_hdsl_restart_t::SW_HDSL_RESTART_OTHER,
    }
}

fn pipe_of(frame: &HFrame) -> (i16, u8) {
    match frame.pipe_character() {
        None => (-1, 0),
        Some(Ok(character)) => (character.byte().into(), character.is_control().into()),
        Some(Err(_)) => (-2, 0),
    }
}

/// The last H-frame heard: what has to be driven after its answer, and what it brought.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_frame(
    m: Option<&sw_hdsl_t>,
    frame: Option<&mut MaybeUninit<sw_hdsl_frame_t>>,
) -> sw_result_t {
    border(|| {
        let (m, out) = (sw_hdsl_t::look(m)?, there(frame)?);
        let it = m.h_frame();
        let (mut tail, mut tail_bits) = ([0_u8; 24], 0_u8);
        for bit in it.tail.bits() {
            if let Some(byte) = tail.get_mut(usize::from(tail_bits / 8)) {
                *byte |= u8::from(bit) << (tail_bits % 8);
            }
            tail_bits = tail_bits.saturating_add(1);
        }
        let (pipe, pipe_special) = pipe_of(it);
        out.write(sw_hdsl_frame_t {
            tail,
            tail_bits,
            tail_idle: if it.tail.trailer == Trailer::Whole { 0 } else { 2 },
            restarted: restarted(it.restarted) as u8,
            cut: (it.tail.trailer == Trailer::Cut).into(),
            quality: it.quality,
            rssi: it.signal.map_or(u8::MAX, |signal| signal.rssi.get()),
            short_free: it.short_free.into(),
            long_free: it.long_free.into(),
            pipe,
            pipe_special,
            acceleration_errors: it.acceleration_errors,
            restarts: m.counters().restarts,
        });
        OK
    })
}

/// Where the receiver is in its start-up: sw_hdsl_state_t, or a refusal.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_state(m: Option<&sw_hdsl_t>) -> sw_result_t {
    border(|| Ok(state_of(sw_hdsl_t::look(m)?)))
}

/// The encoder identifier, 20 bits. SW_E_NO_VALUE before it has come.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_encoder_id(m: Option<&sw_hdsl_t>, id: Option<&mut MaybeUninit<u32>>) -> sw_result_t {
    border(|| {
        let (m, id) = (sw_hdsl_t::look(m)?, there(id)?);
        id.write(m.encoder_id().map(EncoderId::get).ok_or(NO_VALUE)?);
        OK
    })
}

/// Restarts the link at the end of the present frame (PRST).
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_restart(m: Option<&mut sw_hdsl_t>) -> sw_result_t {
    border(|| {
        sw_hdsl_t::get(m)?.request_restart();
        OK
    })
}

/// Reports that this many H-frames, whose answers will not be heard, were on the line before the next one
/// heard.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_skip(m: Option<&mut sw_hdsl_t>, frames: u8) -> sw_result_t {
    border(|| {
        sw_hdsl_t::get(m)?.skip(frames);
        OK
    })
}

/// Prepares a receiver that keeps its frames on an external pulse: `period` eighths of a bit (13.333 ns
/// each) from pulse to pulse, and 1..10 frames for each. Otherwise as sw_hdsl_start();
/// SW_E_HDSL_PERIOD_TOO_SHORT, SW_E_HDSL_EXTRA_OUT_OF_RANGE.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_start_synchronised(
    m: Option<&mut MaybeUninit<sw_hdsl_t>>,
    dialect: u8,
    steps_per_turn: u32,
    period: u32,
    frames_per_pulse: u8,
) -> sw_result_t {
    border(|| {
        let (m, dialect, es) = (there(m)?, dialect_of(dialect)?, in_range(Es::new(frames_per_pulse))?);
        let mut master = Master::synchronised(dialect, Synchroniser::new(period, es).map_err(error)?);
        master.set_steps_per_turn(steps_per_turn);
        sw_hdsl_t::start(Some(m), master)?;
        OK
    })
}

/// The frames of a running link are synchronised from the next one on, or free running with 0 frames. The link goes on.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_set_sync(m: Option<&mut sw_hdsl_t>, period: u32, frames_per_pulse: u8) -> sw_result_t {
    border(|| {
        let m = sw_hdsl_t::get(m)?;
        if frames_per_pulse == 0 {
            m.set_frames_per_pulse(None).map_err(error)?;
            return OK;
        }
        let es = in_range(Es::new(frames_per_pulse))?;
        // What does not fit is refused before anything is changed.
        let _ = Synchroniser::new(period, es).map_err(error)?;
        m.set_pulse_period(period);
        m.set_frames_per_pulse(Some(es)).map_err(error)?;
        OK
    })
}

/// Whether the edge of the present frame belongs to a pulse.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_is_on_pulse(m: Option<&sw_hdsl_t>) -> bool {
    sw_hdsl_t::look(m).is_ok_and(Master::is_on_pulse)
}

/// Whether the last pulses came close to their edges.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_is_in_step(m: Option<&sw_hdsl_t>) -> bool {
    sw_hdsl_t::look(m).is_ok_and(Master::is_in_step)
}

/// Reports that the pulse of the present frame came this many eighths of a bit after its sampling edge
/// (below 0: before it). Call it before the answer is heard, in frames that are on a pulse.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_hear_pulse(m: Option<&mut sw_hdsl_t>, late: i16) -> sw_result_t {
    border(|| {
        sw_hdsl_t::get(m)?.hear_pulse(late);
        OK
    })
}
