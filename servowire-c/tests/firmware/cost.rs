//! The calls that `cost.c` measures, without the C interface: the same crates, their state behind a pointer too. Linked beside the
//! interface into one image.

#![cfg_attr(target_os = "none", no_std)]

use core::mem::MaybeUninit;
use core::num::NonZeroU16;
use core::slice::from_raw_parts;

use nikon_aformat::bus::{Addresses, Bus, Verdict};
use nikon_aformat::{Command, Expected, Layout};
use rtex_block::master::{ActiveCode, Axis, AxisConfig, CommandCounter, Heard, Limits, Turn};
use rtex_block::{MacId, Policy as RtexPolicy, UpdateCounter};
use servowire_c as _;
use sorte_proto::DeviceFrameView;
use step_profile::{StepTime, corrected};
use tformat::master::{Line, Transaction, Transmission};
use tformat::{AllData, BitOrder, BitRate, Evidence, Policy, Request, Resolution, Response, Tolerated};

const PENDING: i32 = 1;

fn refused(class: u8) -> i32 {
    i32::from(class).wrapping_neg()
}

/// What an interface without C would give: 0, or the number of the class.
fn result<T, E>(outcome: Result<T, E>, out: &mut MaybeUninit<T>, class: impl FnOnce(E) -> u8) -> i32 {
    match outcome {
        Ok(value) => {
            out.write(value);
            0
        }
        Err(error) => refused(class(error)),
    }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_parse_all(bytes: *const u8, len: usize, out: &mut MaybeUninit<AllData>) -> i32 {
    // SAFETY: `cost.c` has that many.
    let bytes = unsafe { from_raw_parts(bytes, len) };
    result(AllData::parse(bytes), out, |error| error.class().number())
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_parse_single(bytes: *const u8, len: usize, out: &mut MaybeUninit<Response>) -> i32 {
    // SAFETY: as above.
    let bytes = unsafe { from_raw_parts(bytes, len) };
    result(Response::parse(Request::ReadSingleTurn, bytes), out, |error| error.class().number())
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_parse_any(
    request: &Request,
    bytes: *const u8,
    len: usize,
    out: &mut MaybeUninit<Response>,
) -> i32 {
    // SAFETY: as above.
    let bytes = unsafe { from_raw_parts(bytes, len) };
    result(Response::parse(*request, bytes), out, |error| error.class().number())
}

/// What `sw_tformat_t` holds.
struct Master {
    request: Request,
    line: Line,
    resolution: Resolution,
    tolerated: Tolerated,
    transaction: Transaction,
    evidence: Evidence,
}

const RESOLUTION: Resolution = match Resolution::new(23, 16) {
    Ok(resolution) => resolution,
    Err(_) => panic!(),
};

/// Bytes that `cost.c` has for a state.
const PLACE: usize = 1024;
const _: () = assert!(size_of::<Master>() <= PLACE && size_of::<Drive>() <= PLACE && size_of::<Bus>() <= PLACE);
const _: () = assert!(size_of::<hdsl::master::Master>() <= PLACE);

#[unsafe(no_mangle)]
extern "C" fn rust_start(m: &mut MaybeUninit<Master>) -> *const Request {
    let m = m.write(Master {
        request: Request::ReadAll,
        line: Line::new(BitRate::Mbit2_5),
        resolution: RESOLUTION,
        tolerated: Tolerated::SINGLE_TURN,
        transaction: Transaction::idle(),
        evidence: Evidence::NEVER,
    });
    &raw const m.request
}

#[unsafe(no_mangle)]
extern "C" fn rust_read(m: &mut Master, start_ns: u64, out: &mut MaybeUninit<Transmission>) -> i32 {
    if m.transaction.outcome().is_none() || start_ns < m.transaction.until_ns() {
        return -1;
    }
    m.transaction.restart(m.request, m.line, start_ns);
    if let Some(Err(error)) = m.transaction.outcome() {
        return refused(error.class().number());
    }
    out.write(m.transaction.transmission());
    2
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_hear(m: &mut Master, bytes: *const u8, len: usize, end_ns: u64) -> i32 {
    // SAFETY: as above.
    let bytes = unsafe { from_raw_parts(bytes, len) };
    match m.transaction.push(bytes, end_ns) {
        None => PENDING,
        Some(Ok(exchange)) => {
            if matches!(exchange.response, Response::ReadSingleTurn(_) | Response::ReadAll(_)) {
                m.evidence = exchange.evidence(m.resolution);
            }
            0
        }
        Some(Err(error)) => refused(error.class().number()),
    }
}

#[unsafe(no_mangle)]
extern "C" fn rust_poll(m: &mut Master, now_ns: u64) -> i32 {
    let _ = m.transaction.poll(now_ns);
    match m.transaction.outcome() {
        None => PENDING,
        Some(Ok(_)) => 0,
        Some(Err(error)) => refused(error.class().number()),
    }
}

#[unsafe(no_mangle)]
extern "C" fn rust_angle(m: &Master, now_ns: u64, max_age_ns: u64, out: &mut MaybeUninit<u32>) -> bool {
    match m.evidence.at(now_ns, Policy::new(max_age_ns).tolerating(m.tolerated)) {
        Ok(sample) => {
            out.write(sample.angle().to_bits());
            true
        }
        Err(_) => false,
    }
}

#[unsafe(no_mangle)]
extern "C" fn rust_bus_start(bus: &mut MaybeUninit<Bus>, addresses: u8) {
    bus.write(Bus::new(Expected::new(Layout::Abs40, Command::Abs40Mt), Addresses::from_bits(addresses)));
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_bus_push(
    bus: &mut Bus,
    words: *const u16,
    count: usize,
    msb_first: bool,
    out: &mut MaybeUninit<Verdict>,
) -> i32 {
    // SAFETY: as above.
    let words = unsafe { from_raw_parts(words, count) };
    let order = if msb_first { BitOrder::MsbFirst } else { BitOrder::LsbFirst };
    let verdict = out.write(bus.push_abs40(words, order));
    i32::from(verdict.outcome.is_err() || verdict.extra || verdict.duplicate)
}

/// What `sw_rtex_axis_t` holds.
struct Drive {
    axis: Axis,
    counter: CommandCounter,
    turn: Turn,
}

#[unsafe(no_mangle)]
extern "C" fn rust_rtex_start(drive: &mut MaybeUninit<Drive>) {
    let limits = Limits::new(NonZeroU16::MIN.saturating_add(2), 1000);
    let config = AxisConfig::new(MacId::truncate(5), ActiveCode::CyclicPosition, 500_000, limits);
    drive.write(Drive {
        axis: Axis::new(config),
        counter: CommandCounter::new(0),
        turn: Turn::Valid(UpdateCounter::ZERO),
    });
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_rtex_parse(bytes: *const u8, len: usize, out: &mut MaybeUninit<rtex_block::Response>) -> i32 {
    // SAFETY: as above.
    let bytes = unsafe { from_raw_parts(bytes, len) };
    result(rtex_block::Response::parse(bytes), out, |error| error.class().number())
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_rtex_hear(drive: &mut Drive, bytes: *const u8, len: usize, end_ns: u64) -> i32 {
    // SAFETY: as above.
    let heard = Heard::from(rtex_block::Response::parse(unsafe { from_raw_parts(bytes, len) }));
    drive.axis.hear(drive.turn, &heard, end_ns);
    0
}

#[unsafe(no_mangle)]
extern "C" fn rust_rtex_transmit(drive: &mut Drive, out: &mut MaybeUninit<[u8; 16]>) -> i32 {
    drive.turn = drive.counter.next();
    out.write(drive.axis.transmission(drive.turn).main.emit());
    0
}

#[unsafe(no_mangle)]
extern "C" fn rust_rtex_feedback(drive: &Drive, now_ns: u64, max_age_ns: u64, out: &mut MaybeUninit<i32>) -> bool {
    match drive.axis.evidence().at(now_ns, RtexPolicy::new(max_age_ns)) {
        Ok(sample) => {
            out.write(sample.position());
            true
        }
        Err(_) => false,
    }
}

#[unsafe(no_mangle)]
extern "C" fn rust_hdsl_start(m: &mut MaybeUninit<hdsl::master::Master>) {
    m.write(hdsl::master::Master::new(hdsl::Dialect::SICK));
}

#[unsafe(no_mangle)]
extern "C" fn rust_hdsl_hear(m: &mut hdsl::master::Master, bits: u64, end_ns: u64) -> i32 {
    let _ = m.hear_bits(bits, None, end_ns);
    m.state() as i32
}

#[unsafe(no_mangle)]
unsafe extern "C" fn rust_sorte_device(
    bytes: *const u8,
    len: usize,
    payload: usize,
    out: &mut MaybeUninit<[u8; 2]>,
) -> i32 {
    // SAFETY: as above.
    let bytes = unsafe { from_raw_parts(bytes, len) };
    let view = DeviceFrameView::parse(payload, bytes).map(|view| [view.address().get(), view.status().bits()]);
    result(view, out, |error| error.class().number())
}

#[unsafe(no_mangle)]
extern "C" fn rust_step_next(t_step: u32, prev: u32, out: &mut MaybeUninit<StepTime>) -> i32 {
    out.write(corrected(t_step, prev));
    0
}
