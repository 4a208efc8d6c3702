//! HIPERFACE DSL, free running.

use core::mem::MaybeUninit;

use hdsl::device::Device;
use hdsl::master::{Master, State};
use hdsl::{Dialect, EncoderId, Error, Policy, Window};

use crate::border::{OK, Refused, border, in_range, read, state, there};
use crate::clock::time;
use crate::result::{Protocol, refused, sw_result_t};

/// Samples of the window of an answer: bytes, one a bit, eight samples each.
pub const SW_HDSL_WINDOW: usize = 72;
const _: () = assert!(SW_HDSL_WINDOW == hdsl::sampling::WINDOW);

/// Whose rules are followed where sources differ.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_dialect_t {
    /// The manual of the link.
    SW_HDSL_SICK = 0,
    /// The receiver of TI's Motor Control SDK.
    SW_HDSL_TI = 1,
}

/// Where the receiver is in its start-up.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_state_t {
    /// RESET.
    SW_HDSL_RESET = 0,
    /// SYNC.
    SW_HDSL_SYNC = 1,
    /// START.
    SW_HDSL_START = 2,
    /// LEARN.
    SW_HDSL_LEARN = 3,
    /// CHECK.
    SW_HDSL_CHECK = 4,
    /// IDREQ.
    SW_HDSL_IDREQ = 5,
    /// WAIT VSYNC.
    SW_HDSL_WAIT_VSYNC = 6,
    /// RUNNING.
    SW_HDSL_RUNNING = 7,
}

/// Refusals of HIPERFACE DSL that these calls give.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum sw_hdsl_error_t {
    /// Fewer samples than the window of an answer.
    SW_E_HDSL_TRUNCATED = -0x301,
}

/// A receiver: start-up, link, newest positions. Its content is private; it may be copied. One context at a time.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_t {
    pub(crate) _private: [MaybeUninit<u64>; 84],
}
state!(sw_hdsl_t, Master, b"SWhd");

/// A modelled encoder. Its content is private; it may be copied.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct sw_hdsl_device_t {
    pub(crate) _private: [MaybeUninit<u64>; 54],
}
state!(sw_hdsl_device_t, Device, b"SWhe");

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

fn error(error: Error) -> Refused {
    refused(Protocol::Hdsl, error.class().number())
}

/// A free-running receiver at the begin of the start-up. `steps_per_turn` is the encoder's resolution, for angles; 0 if it is not
/// known.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_start(
    m: Option<&mut MaybeUninit<sw_hdsl_t>>,
    dialect: u8,
    steps_per_turn: u32,
) -> sw_result_t {
    border(|| {
        let dialect = in_range(match dialect {
            0 => Some(Dialect::SICK),
            1 => Some(Dialect::TI),
            _ => None,
        })?;
        let mut master = Master::new(dialect);
        master.set_steps_per_turn(steps_per_turn);
        sw_hdsl_t::start(m, master)?;
        OK
    })
}

/// What the present H-frame sends.
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

/// The H-frame is over: the samples of its window (SW_HDSL_WINDOW bytes where an encoder answers), which ended at `end_ns`. The result is
/// the state of the receiver, sw_hdsl_state_t.
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

/// The fast position, judged now: **false if it must not be used, and the outputs have to go off**: never heard, no link, estimated, not
/// aligned with the safe one, too fast, older than `max_age_ns`.
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

/// Switches a modelled encoder on, with an encoder identifier.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_device_start(
    device: Option<&mut MaybeUninit<sw_hdsl_device_t>>,
    encoder_id: u32,
) -> sw_result_t {
    border(|| {
        let id = in_range(EncoderId::try_from(encoder_id).ok())?;
        sw_hdsl_device_t::start(device, Device::new(id))?;
        OK
    })
}

/// Turns its shaft.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_device_set_position(device: Option<&mut sw_hdsl_device_t>, position: u64) -> sw_result_t {
    border(|| {
        sw_hdsl_device_t::get(device)?.set_position(position);
        OK
    })
}

/// What it answers to the head of an H-frame: the 61 bits for sw_hdsl_hear_bits(), all ones where it is silent.
#[unsafe(no_mangle)]
pub extern "C" fn sw_hdsl_device_hear(
    device: Option<&mut sw_hdsl_device_t>,
    heard: Option<&sw_hdsl_transmission_t>,
    bits: Option<&mut MaybeUninit<u64>>,
) -> sw_result_t {
    border(|| {
        let (device, heard, bits) = (sw_hdsl_device_t::get(device)?, there(heard)?, there(bits)?);
        let head = in_range(Window::from_bits(u128::from_le_bytes(heard.head), heard.head_bits.into()))?;
        bits.write(device.hear(head).map_or(u64::MAX, |answer| answer.bits));
        OK
    })
}
