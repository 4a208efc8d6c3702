//! The border in an interpreter that knows undefined behaviour: every length from 0 in blocks of their own, states that were
//! not started, copies.

use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use std::vec::Vec;

use tformat::{Adf, DataId, Request, Response};

use crate::result::{Protocol, refused};
use crate::tformat::*;

/// ID 3: turn 0, 3915817 counts of 23 bits, no alarms.
const ANSWER: [u8; 11] = [0x1a, 0x00, 0x29, 0xc0, 0x3b, 0x17, 0x00, 0x00, 0x00, 0x00, 0xdf];

fn of<T>(result: &Result<T, tformat::Error>) -> i32 {
    result.as_ref().map_or_else(|error| refused(Protocol::Tformat, error.class().number()), |_| 0)
}

#[test]
fn every_length_from_0_says_what_the_crate_says() {
    for id in DataId::ALL {
        let asked = sw_tformat_request_t { id: id.code(), adf: 5, edf: 7 };
        let request = Request::of(id, Adf::from_bits(5), 7);
        let (mut frame, mut size) = ([MaybeUninit::<u8>::uninit(); 4], MaybeUninit::uninit());
        let room: *mut u8 = frame.as_mut_ptr().cast();
        for short in 0..usize::from(id.request_fields()) {
            // SAFETY: there is more room than is told.
            assert_eq!(unsafe { sw_tformat_build(Some(&asked), room, short, Some(&mut size)) }, -4);
        }
        // SAFETY: a frame has at most four fields.
        assert_eq!(unsafe { sw_tformat_build(Some(&asked), room, 4, Some(&mut size)) }, 0);
        // SAFETY: the call has said that it wrote it.
        assert_eq!(unsafe { size.assume_init() }, usize::from(id.request_fields()));
        for len in 0..=ANSWER.len() {
            let mut bytes: Vec<u8> = ANSWER[..len].into();
            if let Some(cf) = bytes.first_mut() {
                *cf = id.control_field().get();
            }
            let (bytes, mut out) = (bytes.into_boxed_slice(), MaybeUninit::uninit());
            // SAFETY: all of the block.
            let result = unsafe { sw_tformat_parse(Some(&asked), bytes.as_ptr(), len, Some(&mut out)) };
            assert_eq!(result, of(&Response::parse(request, &bytes)), "{id} {len}");
            let mut why = MaybeUninit::uninit();
            // SAFETY: all of the block.
            assert_eq!(unsafe { sw_tformat_why(Some(&asked), bytes.as_ptr(), len, Some(&mut why)) }, result);
            // SAFETY: it is written for every result.
            let why = unsafe { why.assume_init() };
            assert!(why.field == 255 || why.field < 11, "{why:?}");
            for bits in [len * 8, (len * 8).saturating_sub(3)] {
                for order in 0..2 {
                    // SAFETY: no more bits than the block has.
                    let result =
                        unsafe { sw_tformat_parse_line(Some(&asked), bytes.as_ptr(), bits, order, Some(&mut out)) };
                    assert!(result < 0, "a line without framing");
                }
            }
        }
    }
}

#[test]
fn null_is_refused_everywhere() {
    let asked = sw_tformat_request_t { id: 3, adf: 0, edf: 0 };
    let (mut out, mut size, mut to_send) = (MaybeUninit::uninit(), MaybeUninit::uninit(), MaybeUninit::uninit());
    // SAFETY: what is not NULL is a place of its own.
    let results = unsafe {
        [
            sw_tformat_parse(None, ANSWER.as_ptr(), 11, Some(&mut out)),
            sw_tformat_parse(Some(&asked), null(), 11, Some(&mut out)),
            sw_tformat_parse(Some(&asked), ANSWER.as_ptr(), 11, None),
            sw_tformat_parse_all(null(), 0, None),
            sw_tformat_parse_all(ANSWER.as_ptr(), 11, None),
            sw_tformat_build(Some(&asked), null_mut(), 4, Some(&mut size)),
            sw_tformat_hear(None, ANSWER.as_ptr(), 11, 0),
            sw_tformat_read(None, 3, 0, Some(&mut to_send)),
            sw_tformat_init(None, 2_500_000, 23, 16),
            sw_tformat_clear_errors(None, 0),
            sw_tformat_next(None, None, 0, Some(&mut to_send)),
            sw_tformat_device_start(None, 0x17, 2_500_000),
        ]
    };
    assert_eq!(results, [-1; 12]);
    assert!(!sw_tformat_angle(None, 0, 1, None));
}

fn started() -> sw_tformat_t {
    let mut m = MaybeUninit::zeroed();
    assert_eq!(sw_tformat_init(Some(&mut m), 2_500_000, 23, 16), 0);
    // SAFETY: it was started.
    unsafe { m.assume_init() }
}

#[test]
fn zeroed_states_are_refused() {
    let (mut m, mut to_send) = (sw_tformat_t { _private: [MaybeUninit::zeroed(); 36] }, MaybeUninit::uninit());
    let mut p = sw_tformat_procedure_t { _private: [MaybeUninit::zeroed(); 20] };
    let mut device = sw_tformat_device_t { _private: [MaybeUninit::zeroed(); 128] };
    // SAFETY: all of the block.
    assert_eq!(unsafe { sw_tformat_hear(Some(&mut m), ANSWER.as_ptr(), 11, 0) }, -3);
    assert_eq!(sw_tformat_read(Some(&mut m), 3, 0, Some(&mut to_send)), -3);
    assert_eq!(sw_tformat_poll(Some(&mut m), 0), -3);
    assert_eq!(sw_tformat_until_ns(Some(&m)), u64::MAX);
    assert_eq!(sw_tformat_next(Some(&mut p), Some(&mut started()), 0, Some(&mut to_send)), -3);
    assert_eq!(sw_tformat_device_set_alarms(Some(&mut device), 0), -3);
    assert_eq!(sw_tformat_device_page(Some(&device)), 255);
}

#[test]
fn an_exchange_in_pieces_and_in_a_copy() {
    for cut in 0..=ANSWER.len() {
        let (mut m, mut to_send, mut angle) = (started(), MaybeUninit::uninit(), MaybeUninit::uninit());
        assert_eq!(sw_tformat_read(Some(&mut m), 3, 1_000_000, Some(&mut to_send)), 2);
        // SAFETY: SW_SEND says that it is written.
        assert_eq!(unsafe { to_send.assume_init() }.bytes, [0x1a, 0, 0, 0]);
        let (first, last) = ANSWER.split_at(cut);
        let heard_ns = 1_007_000 + 4_000 * cut as u64;
        // SAFETY: all of both blocks.
        let _ = unsafe { sw_tformat_hear(Some(&mut m), first.as_ptr(), cut, heard_ns) };
        let mut copy = m;
        // SAFETY: all of both blocks.
        let _ = unsafe { sw_tformat_hear(Some(&mut copy), last.as_ptr(), last.len(), 1_051_000) };
        assert!(sw_tformat_angle(Some(&copy), 1_066_980, 62_500, Some(&mut angle)), "{cut}");
        // SAFETY: true says that it is written.
        assert_eq!(unsafe { angle.assume_init() }, 3_915_817 << 9);
        assert!(!sw_tformat_angle(Some(&copy), 1_066_981, 62_500, Some(&mut angle)));
        assert_eq!(sw_tformat_angle(Some(&m), 1_066_980, 62_500, Some(&mut angle)), cut == ANSWER.len());
    }
}

#[test]
fn both_ends_of_a_motion() {
    use crate::motion::*;
    let place = std::boxed::Box::into_raw(std::boxed::Box::new(MaybeUninit::<sw_motion_queue_t>::zeroed()));
    let (mut axis, mut timer) = (MaybeUninit::zeroed(), MaybeUninit::zeroed());
    let limits = sw_motion_limits_t { jerk: 0, speed: 1_000, acceleration: 100_000 };
    // SAFETY: the place stays until the end of the test.
    let queue = unsafe { &mut *place };
    assert_eq!(sw_motion_start(Some(&mut axis), Some(&mut timer), Some(queue), 1_000_000, Some(&limits)), 0);
    // SAFETY: they were started.
    let (axis, timer) = unsafe { (axis.assume_init_mut(), timer.assume_init_mut()) };
    assert_eq!(sw_motion_move_to(Some(axis), 3), 0);
    let (mut fired, mut steps) = (MaybeUninit::uninit(), 0);
    for _ in 0..10_000 {
        match sw_motion_poll(Some(axis)) {
            0 => break,
            1 => {}
            _ => {
                assert_eq!(sw_motion_fire(Some(timer), Some(&mut fired)), 0);
                // SAFETY: SW_OK says that it is written.
                steps += i64::from(unsafe { fired.assume_init() }.step);
            }
        }
    }
    let mut commanded = MaybeUninit::uninit();
    assert_eq!(sw_motion_commanded(Some(axis), Some(&mut commanded)), 0);
    // SAFETY: SW_OK says that it is written.
    assert_eq!((steps, unsafe { commanded.assume_init() }), (3, 3));
    // SAFETY: nobody uses it any more.
    drop(unsafe { std::boxed::Box::from_raw(place) });
}
