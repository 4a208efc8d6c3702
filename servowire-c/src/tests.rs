//! The border in an interpreter that knows undefined behaviour: every length from 0 in blocks of their own, states that were
//! not started, copies.

use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use std::vec;
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
    let setup =
        sw_motion_setup_t { limits, soft_low: 0, soft_high: 0, clock_hz: 1_000_000, reversal_pause: 0, reach: 0 };
    // SAFETY: the place stays until the end of the test.
    let queue = unsafe { &mut *place };
    assert_eq!(sw_motion_start(Some(&mut axis), Some(&mut timer), Some(queue), Some(&setup)), 0);
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

/// A state of one kind is refused by the functions of another.
#[test]
fn no_two_kinds_of_state_have_the_same_mark() {
    let mut marks = [
        crate::aformat::sw_aformat_bus_t::MARK,
        crate::aformat::sw_aformat_device_t::MARK,
        crate::aformat::sw_aformat_procedure_t::MARK,
        crate::aformat::sw_aformat_receiver_t::MARK,
        crate::aformat::sw_aformat_t::MARK,
        crate::sw_clock_t::MARK,
        crate::hdsl::sw_hdsl_device_t::MARK,
        crate::hdsl::sw_hdsl_pipe_t::MARK,
        crate::hdsl::sw_hdsl_quality_t::MARK,
        crate::hdsl::sw_hdsl_registers_t::MARK,
        crate::hdsl::sw_hdsl_t::MARK,
        crate::hdsl::sw_hdsl_tracker_t::MARK,
        crate::motion::sw_motion_axis_t::MARK,
        crate::motion::sw_motion_homing_t::MARK,
        crate::motion::sw_motion_timer_t::MARK,
        crate::nrz::sw_nrz_t::MARK,
        crate::rtex::sw_rtex_axis_t::MARK,
        crate::rtex::sw_rtex_counter_t::MARK,
        crate::rtex::sw_rtex_drive_t::MARK,
        crate::rtex::sw_rtex_echo_t::MARK,
        crate::rtex::sw_rtex_handshake_t::MARK,
        crate::rtex::sw_rtex_move_t::MARK,
        crate::rtex::sw_rtex_phases_t::MARK,
        crate::rtex::sw_rtex_ring_t::MARK,
        crate::rtex::sw_rtex_sub_handshake_t::MARK,
        crate::tformat::sw_tformat_device_t::MARK,
        crate::tformat::sw_tformat_procedure_t::MARK,
        crate::tformat::sw_tformat_t::MARK,
    ];
    marks.sort_unstable();
    assert!(marks.windows(2).all(|two| two[0] < two[1]) && marks[0] != 0);
}

/// What every decoder reads lies in its block: each has one of exactly this length.
#[test]
fn decoders_of_all_protocols_take_every_length() {
    use crate::{aformat::*, hdsl::*, rtex::*, sorte::*};
    let lengths = if cfg!(miri) { 0..=33_usize } else { 0..=1040 };
    for len in lengths {
        let block: Vec<u8> = (0..=u8::MAX).cycle().take(len).collect();
        let (start, len) = (block.as_ptr(), block.len());
        let words: Vec<u16> = block.chunks_exact(2).map(|two| u16::from_le_bytes([two[0], two[1]])).collect();
        let (mut wide, mut narrow, mut back) = (vec![0_u32; len / 4], vec![0_u16; len / 2], vec![0_u8; len]);
        // SAFETY: the blocks with their lengths.
        let results = unsafe {
            [
                sw_hdsl_parse_short(start, len, Some(&mut MaybeUninit::uninit())),
                sw_hdsl_parse_long(start, len, Some(&mut MaybeUninit::uninit())),
                sw_rtex_parse_response(start, len, Some(&mut MaybeUninit::uninit())),
                sw_rtex_parse_command_strict(start, len, Some(&mut MaybeUninit::uninit())),
                sw_rtex_parse_command32(start, len, Some(&mut MaybeUninit::uninit()), Some(&mut MaybeUninit::uninit())),
                sw_rtex_to_words16(start, len, narrow.as_mut_ptr(), narrow.len()),
                sw_rtex_to_words32(start, len, wide.as_mut_ptr(), wide.len()),
                sw_sorte_parse_device_frame(start, len, 3, Some(&mut MaybeUninit::uninit())),
                sw_sorte_parse_master_frame(start, len, 16, Some(&mut MaybeUninit::uninit())),
                sw_sorte_parse_header(start, len, Some(&mut MaybeUninit::uninit())),
                sw_sorte_parse_discovery(start, len, Some(&mut MaybeUninit::uninit())),
                sw_sorte_strip_preamble(start, len, Some(&mut MaybeUninit::uninit())),
                sw_sorte_parse_payload(start, len, Some(&mut MaybeUninit::uninit())),
                sw_aformat_parse_as(0, 0, 255, words.as_ptr(), words.len(), 1, Some(&mut MaybeUninit::uninit())),
                sw_aformat_parse_abs40(0, 255, words.as_ptr(), words.len(), 0, Some(&mut MaybeUninit::uninit())),
            ]
        };
        assert!(results.iter().all(|result| *result <= 0), "{results:?}");
        assert_eq!((results[5] == 0, results[6] == 0), (len % 2 == 0, len % 4 == 0));
        assert_eq!(results[12] == 0, len == 16);
        // SAFETY: as above.
        let unpacked = unsafe { sw_rtex_from_words16(narrow.as_ptr(), narrow.len(), back.as_mut_ptr(), len) };
        assert_eq!((unpacked == 0, unpacked != 0 || back == block), (len % 2 == 0, true));
    }
}

/// An axis in cyclic position mode, which sends two update periods of 0.5 ms of invalid data before its first commands.
fn rtex_config(mac_id: u8) -> crate::rtex::sw_rtex_config_t {
    crate::rtex::sw_rtex_config_t {
        update_ns: 500_000,
        invalid: 2,
        wait: 10,
        ready: 0,
        inactive: 0,
        gear_numerator: 1,
        gear_denominator: 1,
        echo: 3,
        command_errors: 3,
        mac_id,
        mode: 2,
    }
}

/// States of all protocols in memory that was not started, through a few calls, and copied.
#[test]
fn states_of_all_protocols_are_started_used_and_copied() {
    use crate::{hdsl::*, rtex::*};
    let mut place = MaybeUninit::zeroed();
    // SAFETY: plain words, and 0 stands for a state that was not started.
    assert_eq!(sw_hdsl_hear_bits(Some(unsafe { place.assume_init_mut() }), u64::MAX, 0), -3);
    assert_eq!(sw_hdsl_start(Some(&mut place), 0, 0), 0);
    // SAFETY: it was started.
    let mut m: sw_hdsl_t = unsafe { place.assume_init() };
    for frame in 0..20 {
        assert!(sw_hdsl_transmission(Some(&m), Some(&mut MaybeUninit::uninit())) == 0);
        assert!(sw_hdsl_hear_bits(Some(&mut m), u64::MAX, frame * 11_500) >= 0);
        assert_eq!(sw_hdsl_finished(Some(&m), Some(&mut MaybeUninit::uninit())), 0);
        m = *std::boxed::Box::new(m);
    }
    let config = rtex_config(5);
    let mut place = MaybeUninit::zeroed();
    assert_eq!(sw_rtex_axis_start(Some(&mut place), Some(&config)), 0);
    // SAFETY: it was started.
    let mut axis: sw_rtex_axis_t = unsafe { place.assume_init() };
    let mut drive = MaybeUninit::zeroed();
    for period in 1..20 {
        let mut block = [0_u8; 16];
        // SAFETY: 16 bytes, and an answer of 16.
        unsafe {
            assert_eq!(sw_rtex_axis_transmit(Some(&mut axis), block.as_mut_ptr(), 15), -4);
            assert_eq!(sw_rtex_axis_transmit(Some(&mut axis), block.as_mut_ptr(), 16), 0);
            assert_eq!(sw_rtex_axis_hear(Some(&mut axis), block.as_ptr(), period % 17, period as u64 * 500_000), 0);
            assert_eq!(sw_rtex_axis_hear(Some(&mut axis), null(), 0, period as u64 * 500_000 + 1), 0);
        }
        axis = *std::boxed::Box::new(axis);
    }
    assert!(!sw_rtex_feedback(Some(&axis), 1, 1, Some(&mut MaybeUninit::uninit())));
    // SAFETY: as above.
    let unstarted: &mut sw_rtex_drive_t = unsafe { drive.assume_init_mut() };
    let answer = [0_u8; 32];
    // SAFETY: 16 and 32 bytes.
    let refused = unsafe { sw_rtex_drive_hear(Some(unstarted), answer.as_ptr(), 16, null_mut(), 0) };
    assert!(refused < 0 && answer == [0; 32]);
}

/// A position that was dropped stays so: a late poll does not bring it back.
#[test]
fn what_was_dropped_does_not_come_back() {
    let mut place = MaybeUninit::zeroed();
    assert_eq!(sw_tformat_init(Some(&mut place), 2_500_000, 23, 16), 0);
    // SAFETY: it was started.
    let mut m: sw_tformat_t = unsafe { place.assume_init() };
    assert_eq!(sw_tformat_poll(Some(&mut m), 0), -6);
    assert_eq!(sw_tformat_read(Some(&mut m), 3, 0, Some(&mut MaybeUninit::uninit())), 2);
    // SAFETY: as long as it says.
    assert_eq!(unsafe { sw_tformat_hear(Some(&mut m), ANSWER.as_ptr(), ANSWER.len(), 51_000) }, 0);
    let angle = |m: &sw_tformat_t| sw_tformat_angle(Some(m), 60_000, 100_000, Some(&mut MaybeUninit::uninit()));
    assert!(angle(&m));
    assert_eq!(sw_tformat_poll(Some(&mut m), 52_000), 0);
    assert!(angle(&m));
    assert_eq!(sw_tformat_set_resolution(Some(&mut m), 23, 12, 0), 0);
    assert_eq!(sw_tformat_poll(Some(&mut m), 53_000), 0);
    assert!(!angle(&m));
}

/// What every encoder of a block writes lies in the caller's block, of every length: a short one is refused and left alone.
#[test]
fn encoders_of_blocks_write_all_or_nothing() {
    use crate::{rtex::*, sorte::*};
    // SAFETY: structures of integers, and 0 is a value of each.
    let (command, sub, response, sub_response, param, sync, device) = unsafe {
        (
            MaybeUninit::zeroed().assume_init(),
            MaybeUninit::zeroed().assume_init(),
            MaybeUninit::zeroed().assume_init(),
            MaybeUninit::zeroed().assume_init(),
            MaybeUninit::zeroed().assume_init(),
            MaybeUninit::zeroed().assume_init(),
            sw_sorte_device_frame_t { address: 1, status: 0 },
        )
    };
    let (words, payload) = ([0_u16; 4], [0_u8; 3]);
    let mut len = MaybeUninit::uninit();
    for size in 0..=40_usize {
        let write = |want: usize, call: &mut dyn FnMut(*mut u8) -> i32| {
            let mut block = vec![0xa5_u8; size].into_boxed_slice();
            let result = call(block.as_mut_ptr());
            assert_eq!(result, if size < want { -4 } else { 0 }, "{want} into {size}");
            assert!(
                block.iter().skip(if result == 0 { want } else { 0 }).all(|byte| *byte == 0xa5),
                "{want} into {size}"
            );
            assert_eq!(call(null_mut()), -1);
        };
        // SAFETY: the blocks with their sizes, or NULL.
        unsafe {
            write(16, &mut |to| sw_rtex_build_command(Some(&command), to, size));
            write(32, &mut |to| sw_rtex_build_command32(Some(&command), Some(&sub), to, size));
            write(16, &mut |to| sw_rtex_build_response(Some(&response), to, size));
            write(32, &mut |to| sw_rtex_build_response32(Some(&response), Some(&sub_response), to, size));
            write(40, &mut |to| sw_sorte_build_param(Some(&param), to, size));
            write(14, &mut |to| sw_sorte_build_sync(Some(&sync), to, size));
            write(8, &mut |to| sw_sorte_build_delay_req(0, 0, to, size));
            write(16, &mut |to| sw_sorte_build_payload(words.as_ptr(), words.len(), to, size));
            write(6, &mut |to| sw_sorte_build_device_frame(Some(&device), payload.as_ptr(), to, size));
            write(8, &mut |to| sw_sorte_build_master_frame(payload.as_ptr(), 3, 7, to, size, Some(&mut len)));
        }
    }
}

/// A block that the ASIC did not get is taken back.
#[test]
fn a_block_that_was_not_written_was_not_sent() {
    use crate::rtex::*;
    let config = rtex_config(9);
    for written in [true, false] {
        let (mut place, mut block, mut now) = (MaybeUninit::zeroed(), [0_u8; 16], 0);
        assert_eq!(sw_rtex_axis_start(Some(&mut place), Some(&config)), 0);
        // SAFETY: it was started.
        let mut axis: sw_rtex_axis_t = unsafe { place.assume_init() };
        // The drive answers to the last block, if it answers: ready, and not active yet. Returns whether Servo_On goes out.
        let mut exchange = |axis: &mut sw_rtex_axis_t, answers: bool| {
            let answer = [0x80 | block[0] & 0x60 | 9, block[1], 0x40, 0, 0x88, 0x13, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
            now += 500_000;
            // SAFETY: 16 bytes each.
            unsafe {
                let heard = if answers { answer.as_ptr() } else { null() };
                assert_eq!(sw_rtex_axis_hear(Some(axis), heard, 16, now), 0);
                assert_eq!(sw_rtex_axis_transmit(Some(axis), block.as_mut_ptr(), 16), 0);
            }
            block[2] & 0x80 != 0
        };
        (0..20).for_each(|_| _ = exchange(&mut axis, true));
        assert_eq!(sw_rtex_axis_switch_on(Some(&mut axis)), 0);
        assert!(exchange(&mut axis, true));
        if !written {
            assert_eq!(sw_rtex_axis_not_sent(Some(&mut axis)), 0);
        }
        // No position comes: Servo_On may go on, but not begin.
        assert_eq!(exchange(&mut axis, false), written);
    }
    assert_eq!(sw_rtex_axis_not_sent(None), -1);
}
