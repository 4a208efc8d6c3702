//! The C interface: it says what the crates say, whatever it is called with.
//!
//! The calls are C's: pointers and lengths, and states that the caller owns. So they are `unsafe` here as nowhere else in this crate;
//! each place says why what it hands over is as large as it claims.

pub mod codecs;

use core::mem::MaybeUninit;

use servowire_c::tformat::{
    sw_tformat_angle, sw_tformat_build, sw_tformat_clear_errors, sw_tformat_device_hear, sw_tformat_device_start,
    sw_tformat_device_t, sw_tformat_framing_error, sw_tformat_hear, sw_tformat_init, sw_tformat_next, sw_tformat_parse,
    sw_tformat_parse_echoed, sw_tformat_parse_line, sw_tformat_poll, sw_tformat_position, sw_tformat_procedure_t,
    sw_tformat_request_t, sw_tformat_response, sw_tformat_start, sw_tformat_t, sw_tformat_until_ns, sw_tformat_why,
};
use tformat::master::{Line, Progress, Transaction, parse_echoed};
use tformat::{Adf, BitOrder, BitRate, DataId, Error, Request, Response, Window};

use crate::byte;

/// The number of T-Format in the high byte of a result.
fn code<T>(result: &Result<T, Error>) -> i32 {
    result.as_ref().map_or_else(|error| -(0x100 + i32::from(error.class().number())), |_| 0)
}

/// Answers and lines of every length from 0, in blocks of exactly that length; a transaction of the crate and one in C that hear
/// the same; and calls in any order on states that may not have been started.
///
/// ```text
/// 0..3  request      3  cut      4..  bytes, which are also the calls
/// ```
pub fn tformat(mut data: &[u8]) {
    let id = DataId::ALL[usize::from(byte(&mut data)) % 9];
    let (adf, edf, cut) = (byte(&mut data), byte(&mut data), byte(&mut data));
    let asked = sw_tformat_request_t { id: id.code(), adf, edf };
    let request = Request::of(id, Adf::from_bits(adf), edf);
    for len in 0..=data.len().min(24) {
        lengths(asked, request, &data[..len]);
    }
    exchange(asked, request, data, usize::from(cut));
    calls(asked, data);
}

fn lengths(asked: sw_tformat_request_t, request: Request, bytes: &[u8]) {
    let block: Box<[u8]> = bytes.into();
    let (start, len, mut out) = (block.as_ptr(), block.len(), MaybeUninit::uninit());
    let mut why = MaybeUninit::uninit();
    // SAFETY: all calls get the block with its length.
    unsafe {
        let parsed = Response::parse(request, bytes);
        assert_eq!(sw_tformat_parse(Some(&asked), start, len, Some(&mut out)), code(&parsed));
        assert_eq!(sw_tformat_why(Some(&asked), start, len, Some(&mut why)), code(&parsed));
        let echoed = parse_echoed(request, bytes);
        assert_eq!(sw_tformat_parse_echoed(Some(&asked), start, len, Some(&mut out)), code(&echoed));
        for (number, order) in [(0, BitOrder::LsbFirst), (1, BitOrder::MsbFirst)] {
            for bits in (len * 8).saturating_sub(7)..=len * 8 {
                let line = Window::read(bytes, 0, bits.min(128) as u32, order).expect("no more bits than there are");
                let parsed = Response::parse_line(request, line);
                assert_eq!(sw_tformat_parse_line(Some(&asked), start, bits, number, Some(&mut out)), code(&parsed));
            }
        }
    }
    let mut room: Box<[u8]> = vec![0; len.min(5)].into();
    let mut size = MaybeUninit::uninit();
    // SAFETY: all of the room.
    let built = unsafe { sw_tformat_build(Some(&asked), room.as_mut_ptr(), room.len(), Some(&mut size)) };
    let frame = request.emit();
    if frame.as_bytes().len() <= room.len() {
        assert!(built == 0 && room.starts_with(frame.as_bytes()));
    } else {
        assert_eq!(built, -4);
    }
}

fn exchange(asked: sw_tformat_request_t, request: Request, bytes: &[u8], cut: usize) {
    let mut place = MaybeUninit::zeroed();
    assert_eq!(sw_tformat_init(Some(&mut place), 2_500_000, 23, 16), 0);
    // SAFETY: it was started.
    let m = unsafe { place.assume_init_mut() };
    let mut to_send = MaybeUninit::uninit();
    assert_eq!(sw_tformat_start(Some(m), Some(&asked), 1_000_000, Some(&mut to_send)), 2);
    let mut rust = Transaction::start(request, Line::new(BitRate::Mbit2_5), 1_000_000);
    let result = |progress: Progress| match progress {
        Progress::Pending { .. } => 1,
        Progress::Done { .. } => 0,
        Progress::Failed { error, .. } => code::<()>(&Err(error)),
    };
    let (first, last) = bytes.split_at(cut.min(bytes.len()));
    for (piece, end_ns) in [(first, 1_030_000), (last, 1_030_000 + 4_000 * last.len() as u64)] {
        let block: Box<[u8]> = piece.into();
        // SAFETY: all of the block.
        let heard = unsafe { sw_tformat_hear(Some(m), block.as_ptr(), block.len(), end_ns) };
        assert_eq!(heard, result(rust.hear(piece, end_ns)));
        assert_eq!(sw_tformat_poll(Some(m), end_ns + 1), result(rust.poll(end_ns + 1)));
    }
    let end = rust.poll(u64::MAX >> 1);
    assert_eq!(sw_tformat_poll(Some(m), u64::MAX >> 1), result(end));
    let mut response = MaybeUninit::uninit();
    let value = sw_tformat_response(Some(m), Some(&mut response));
    assert_eq!(value == 0, matches!(end, Progress::Done { .. }));
}

/// Whatever is called in whatever order: no crash, and no position from nothing.
fn calls(asked: sw_tformat_request_t, mut data: &[u8]) {
    // SAFETY: plain words, and 0 stands for a state that was not started.
    let mut m: sw_tformat_t = unsafe { core::mem::zeroed() };
    // SAFETY: as above.
    let (mut p, mut device): (sw_tformat_procedure_t, sw_tformat_device_t) = unsafe { core::mem::zeroed() };
    let (mut now_ns, mut good) = (0_u64, false);
    let mut to_send = MaybeUninit::uninit();
    while let [first, rest @ ..] = data {
        let argument = rest.first().copied().unwrap_or(0);
        data = rest;
        now_ns += u64::from(argument) * 1_000;
        let piece: Box<[u8]> = rest[..rest.len().min(usize::from(argument & 15))].into();
        // SAFETY: the states are here, and the block has its length.
        let result = unsafe {
            match first & 15 {
                0 => sw_tformat_init(Some(&mut *(&raw mut m).cast()), 2_500_000, argument & 31, argument >> 3),
                1 => sw_tformat_start(Some(&mut m), Some(&asked), now_ns, Some(&mut to_send)),
                2..=4 => sw_tformat_hear(Some(&mut m), piece.as_ptr(), piece.len(), now_ns),
                5 => sw_tformat_poll(Some(&mut m), now_ns),
                6 => sw_tformat_framing_error(Some(&mut m), now_ns),
                7 => sw_tformat_clear_errors(Some(&mut *(&raw mut p).cast()), now_ns),
                8 | 9 => sw_tformat_next(Some(&mut p), Some(&mut m), now_ns, Some(&mut to_send)),
                10 => sw_tformat_device_start(Some(&mut *(&raw mut device).cast()), argument, 5_000_000),
                11 => {
                    let mut answer = MaybeUninit::uninit();
                    sw_tformat_device_hear(Some(&mut device), piece.as_ptr(), piece.len(), now_ns, Some(&mut answer))
                }
                _ => sw_tformat_until_ns(Some(&m)) as i32,
            }
        };
        good |= matches!(first & 15, 2..=4) && result == 0;
        let (mut angle, mut position) = (MaybeUninit::uninit(), MaybeUninit::uninit());
        let angle = sw_tformat_angle(Some(&m), now_ns, 100_000, Some(&mut angle));
        let position = sw_tformat_position(Some(&m), now_ns, 100_000, Some(&mut position));
        assert!(good || !(angle || position), "a position from nothing");
    }
}
