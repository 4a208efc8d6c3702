//! What the simulated encoder says, word by word, against what the documents print.

use hdsl::device::{BadHead, Behaviour, Complement, Device, Fault, Overload};
use hdsl::frame::Head;
use hdsl::sampling::TEST_PATTERN;
use hdsl::{Answer, EncoderId, LineDisparity, ParameterByte, Rule, Window};

const RESET: u8 = 0x1f;
const SYNC: u8 = 0x19;
const START: u8 = 0x1a;
const IDREQ: u8 = 0x1d;
/// FIRST, and FIRST with MSYNC.
const INIT: u8 = 0x9e;
const IDLE: u8 = 0xd0;

/// The bits of the answer.
fn hear(device: &mut Device, head: Window, position: u64) -> Option<u64> {
    device.set_position(position).hear(head).map(|answer| answer.bits)
}

fn head(byte: u8) -> Window {
    Head::new(ParameterByte::new(byte), None, LineDisparity::ZERO).bits()
}

/// An encoder that was reset and has synchronised.
fn synchronised(id: u32) -> Device {
    at_standstill(id, 0)
}

fn at_standstill(id: u32, position: u64) -> Device {
    let mut device = Device::new(EncoderId::new(id).unwrap());
    assert_eq!(hear(&mut device, head(RESET), position), None);
    for _ in 0..8 {
        assert_eq!(hear(&mut device, head(SYNC), position), None);
    }
    device
}

/// Bytes of the words of an answer: vertical, parameter, pipe, acceleration high, low, secondary.
fn words(bits: Option<u64>) -> [u8; 6] {
    Answer::from_bits(Rule::Strict, bits.unwrap()).words().map(|word| word.byte().unwrap())
}

/// Both safe blocks of the V-frame after the present one, at standstill at this position.
fn blocks(device: &mut Device, position: u64) -> [[u8; 8]; 2] {
    while words(hear(device, head(IDLE), position))[1] & 0x80 == 0 {}
    let frames = [(); 8].map(|()| words(hear(device, head(IDLE), position)));
    [frames.map(|frame| frame[0]), frames.map(|frame| frame[5])]
}

/// The example block of the documents: SUMMARY 00, position 0012345678h, CRC 3227h; STATUS2 1Ch, ones' complement, CRC 7BD1h.
#[test]
fn printed_blocks() {
    let mut device = synchronised(0x00153);
    let [first, mut second] = blocks(&mut device, 0x1234_5678);
    assert_eq!(first, [0x00, 0x00, 0x12, 0x34, 0x56, 0x78, 0x32, 0x27]);
    if second[0] & 0x80 != 0 {
        // TOG2 alternates.
        let _ = [(); 8].map(|()| hear(&mut device, head(IDLE), 0x1234_5678));
        [_, second] = blocks(&mut device, 0x1234_5678);
    }
    assert_eq!(second, [0x1c, 0xff, 0xed, 0xcb, 0xa9, 0x87, 0x7b, 0xd1]);
    // The fault is one wrong bit of the CRC; the two's complement, eight bits coarser.
    device.set_fault(Fault::BadCrc);
    let coarse = Behaviour::new().with_second_shift(8);
    device.set_behaviour(coarse.with_complement(Complement::Twos));
    let [first, second] = blocks(&mut device, 0x1234_5678);
    assert_eq!(first[6..], [0x32, 0x26]);
    assert_eq!(second[1..6], [0xff, 0xff, 0xed, 0xcb, 0xaa]);
    device.set_behaviour(coarse);
    let [_, second] = blocks(&mut device, 0x1234_5678);
    assert_eq!(second[1..6], [0xff, 0xff, 0xed, 0xcb, 0xa9]);
}

/// TOG2 alternates from V-frame to V-frame and begins with 0 (register list); TEST2 and ERR2 are bits 6 and 5.
#[test]
fn status_2() {
    let mut device = synchronised(0x00153);
    let status: Vec<u8> = (0..48).map(|_| words(hear(&mut device, head(IDLE), 0))[5]).step_by(8).collect();
    assert_eq!(status, [0x1c, 0x9c, 0x1c, 0x9c, 0x1c, 0x9c]);
    for (fault, want) in [
        (Fault::Test2, [0x5c, 0xdc, 0x5c]),
        (Fault::Error2, [0xbc, 0x3c, 0xbc]),
        (Fault::StuckToggle, [0x1c, 0x1c, 0x1c]),
    ] {
        device.set_fault(fault);
        let status: Vec<u8> = (0..24).map(|_| words(hear(&mut device, head(IDLE), 0))[5]).step_by(8).collect();
        assert_eq!(status, want);
    }
}

/// VPOS has 40 bits: above those of the encoder are zeros, or the sign if bit 10 of the identifier says so; an encoder has 40
/// at most.
#[test]
fn bits_above_the_position() {
    let position = 0xf0_8765_4321;
    for (id, want) in [
        (0x00153, [0x00, 0x87, 0x65, 0x43, 0x21]),
        (0x00553, [0xff, 0x87, 0x65, 0x43, 0x21]),
        (0x000d3, [0x00, 0x00, 0x65, 0x43, 0x21]),
        (0x001d3, [0xf0, 0x87, 0x65, 0x43, 0x21]),
        (0x001f3, [0xf0, 0x87, 0x65, 0x43, 0x21]),
    ] {
        let [first, _] = blocks(&mut synchronised(id), position | 0xff << 40);
        assert_eq!(first[1..6], want, "{id:05x}");
    }
}

/// The start-up: silence until it was reset and has seen eight SYNC frames, the test pattern, the identifier twice, then
/// answers with VSYNC in the eighth.
#[test]
fn start_up() {
    let mut device = Device::new(EncoderId::new(0x9_0153).unwrap());
    for byte in [START, IDREQ, INIT, IDLE] {
        assert_eq!(hear(&mut device, head(byte), 0), None);
    }
    for frames in [7, 7, 8] {
        assert_eq!(hear(&mut device, head(RESET), 0), None);
        for _ in 0..frames {
            assert_eq!(hear(&mut device, head(SYNC), 0), None);
        }
        assert_eq!(hear(&mut device, head(START), 0), (frames == 8).then_some(TEST_PATTERN));
    }
    for byte in [START, 0x1b, 0x1c] {
        assert_eq!(hear(&mut device, head(byte), 0), Some(TEST_PATTERN));
    }
    assert_eq!(words(hear(&mut device, head(IDREQ), 0))[..5], [0x53, 0x01, 0x99, 0x01, 0x53]);
    let vsync = [(); 16].map(|()| words(hear(&mut device, head(INIT), 0))[1] >> 7);
    assert_eq!(vsync, [0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1]);
}

/// After a reset all is as at first: a message under way is gone, VSYNC comes in the eighth answer, TOG2 begins with 0, the
/// running disparity with minus.
#[test]
fn a_reset_in_the_middle() {
    let mut fresh = synchronised(0x00153);
    let first = [(); 16].map(|()| hear(&mut fresh, head(IDLE), 0));
    for frames in 8..24 {
        let mut device = synchronised(0x00153);
        // Short read of 7Fh: 7F 8A 44.
        for byte in [0xc7, 0xcf, 0xc8, 0xca, 0xc4, 0xc4] {
            let _ = hear(&mut device, head(byte), 0);
        }
        for _ in 0..frames {
            let _ = hear(&mut device, head(IDLE), 0);
        }
        assert_eq!(hear(&mut device, head(RESET), 0), None);
        assert_eq!(hear(&mut device, head(START), 0), None);
        for _ in 0..8 {
            assert_eq!(hear(&mut device, head(SYNC), 0), None);
        }
        assert_eq!([(); 16].map(|()| hear(&mut device, head(IDLE), 0)), first, "{frames}");
    }
}

/// A symbol of the start-up with FIRST is no start-up: every answer is a normal one, and the V-frame goes on.
#[test]
fn first_means_that_the_link_runs() {
    let mut device = synchronised(0x00153);
    for round in 0..3 {
        for (place, symbol) in [SYNC, START, 0x1b, 0x1c, IDREQ, RESET, 0x10, 0x10].into_iter().enumerate() {
            let [_, parameter, pipe, ..] = words(hear(&mut device, head(0x80 | symbol), 0));
            assert_eq!((parameter & 0x80 != 0, pipe), (place == 7, 0xfe), "{round} {symbol:02x}");
        }
    }
}

/// A head that cannot be read is not answered; the V-frame counts it, unless the encoder stalls.
#[test]
fn heads_that_cannot_be_read() {
    for stalls in [false, true] {
        for lost in 0..=8 {
            let mut device = synchronised(0x00153);
            let bad_head = if stalls { BadHead::Stalls } else { BadHead::Counts };
            device.set_behaviour(Behaviour::new().with_bad_head(bad_head));
            let mut vsync = None;
            for frame in 0..20_u64 {
                if frame == lost {
                    assert_eq!(hear(&mut device, Window::EMPTY, 100 * frame), None);
                    continue;
                }
                let [vertical, parameter, ..] = words(hear(&mut device, head(IDLE), 100 * frame));
                if parameter & 0x80 != 0 && vsync.is_none() {
                    vsync = Some(frame);
                }
                // Before the first answer there is no place in a V-frame. VPOS0 of a V-frame is the position one frame before it.
                let later = u64::from(stalls || lost == 0);
                if frame == 13 + later {
                    assert_eq!(u64::from(vertical), (100 * (7 + later)) & 0xff, "{stalls} {lost}");
                }
            }
            let first = match lost {
                0 => 8,
                7 if !stalls => 15,
                1..=7 => 7 + u64::from(stalls),
                _ => 7,
            };
            assert_eq!(vsync, Some(first), "{stalls} {lost}");
        }
    }
}

/// What the documents leave to the encoder, where a receiver does not look: bits 6:5 of the parameter byte.
#[test]
fn reserved_bits() {
    for bits in 0..4 {
        let mut device = synchronised(0x00153);
        device.set_behaviour(Behaviour::new().with_reserved_bits(bits));
        // IDLE is 10h.
        assert_eq!(words(hear(&mut device, head(IDLE), 0))[1], bits << 5 | 0x10);
    }
}

/// ΔΔ is the second difference; what does not fit into 11 bits is saturated and caught up with, or not sent.
#[test]
fn second_differences() {
    // The first position after standstill; +1023 and +1024, -1024 and -1025.
    for (step, word, none) in [
        (1, [0x00, 0x3a], false),
        (1023, [0x7f, 0xea], false),
        (1024, [0x7f, 0xea], true),
        (-1024, [0x80, 0x00], false),
        (-1025, [0x80, 0x00], true),
    ] {
        for overload in [Overload::Saturated, Overload::NoValue] {
            let mut device = at_standstill(0x00153, 5000);
            device.set_behaviour(Behaviour::new().with_overload(overload));
            let _ = (hear(&mut device, head(INIT), 5000), hear(&mut device, head(INIT), 5000));
            let [_, _, _, high, low, _] = words(hear(&mut device, head(INIT), 5000_u64.wrapping_add_signed(step)));
            let want = if none && overload == Overload::NoValue { [0xfd; 2] } else { word };
            assert_eq!([high, low], want, "{step} {overload:?}");
        }
    }
}
