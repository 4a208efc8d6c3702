//! One law for the three places where a start-up frame is checked: a frame in a buffer, the cut-through rewriter, and a
//! device that the frame passes. They refuse the same frames for the same reason.

use crate::common::device_in;
use sorte_proto::Link;
use sorte_proto::Place;
use sorte_proto::cut_through::Rewriter;
use sorte_proto::device::{Config, Device, FrameTimes, Path, PortId, State, Trigger};
use sorte_proto::{
    DelayReq, Discovery, Entry, Error, ErrorClass, FrameType, LongFrame, Param, Parameters, Status, Sync, fcs,
};

const STOCK: Parameters = Parameters::STOCK;
const ARRIVAL: FrameTimes = FrameTimes { sof_ns: 0, counter_ns: 0, now_ns: 0 };

fn frames() -> [Vec<u8>; 4] {
    [
        Discovery::request(Place::Inner).emit().to_vec(),
        Param::request(Parameters::STOCK, Place::Inner).emit().to_vec(),
        DelayReq::of_master(Place::Inner).emit().to_vec(),
        Sync::of_master(500, 76, Place::Inner).emit().to_vec(),
    ]
}

/// What each of them says, with its numbers.
fn reasons(frame: &[u8], devices: &[Device]) -> Vec<Option<Error>> {
    let mut all = vec![LongFrame::parse(frame).map(|_| ())];
    let adds = Status::empty();
    for rewriter in [Rewriter::discovery(Entry::STOCK, adds), Rewriter::sync(85, adds), Rewriter::unchanged()] {
        all.push(rewriter.pass(&mut frame.to_vec()).map(|_| ()));
    }
    all.extend(devices.iter().map(|device| device.clone().hear(PortId::A, &mut frame.to_vec(), ARRIVAL).result));
    all.into_iter().map(Result::err).collect()
}

fn devices() -> Vec<Device> {
    let states = [State::Discovery, State::Param, State::LineDelay, State::Sync];
    states.into_iter().flat_map(|state| [device_in(state, false, STOCK), device_in(state, true, STOCK)]).collect()
}

#[test]
fn every_flip_has_one_reason_and_it_is_the_fcs() {
    let devices = devices();
    for frame in frames() {
        // All bits of a short frame; of DISCOVERY all of the head, and some of each entry.
        let bits = (0..frame.len() * 8).filter(|bit| *bit < 16 * 8 || bit % 61 == 0 || frame.len() * 8 - bit <= 32);
        for bit in bits {
            let mut frame = frame.clone();
            frame[bit / 8] ^= 1 << (bit % 8);
            let (body, trailer) = frame.split_last_chunk().unwrap();
            let want = Some(Error::BadFcs { got: u32::from_le_bytes(*trailer), want: fcs(body) });
            let reasons = reasons(&frame, &devices);
            assert!(reasons.iter().all(|reason| *reason == want), "bit {bit}: {reasons:?}");
        }
    }
}

#[test]
fn a_frame_that_is_wrong_with_a_right_fcs_has_one_reason() {
    let devices = devices();
    for good in frames() {
        let mut wrong = Vec::new();
        for (at, byte) in [(0, 254), (0, 0), (2, 0), (2, 11), (2, 255)] {
            let mut frame = good.clone();
            frame[at] = byte;
            wrong.push(frame);
        }
        for len in [good.len() - 1, good.len() + 1, good.len() + 4, 8, 9] {
            let mut frame = good.clone();
            frame.resize(len, 0);
            if len != good.len() {
                wrong.push(frame);
            }
        }
        for mut frame in wrong {
            let (body, trailer) = frame.split_last_chunk_mut().unwrap();
            *trailer = fcs(body).to_le_bytes();
            let reasons = reasons(&frame, &devices);
            assert!(reasons[0].is_some(), "{frame:02x?}");
            assert!(reasons.iter().all(|reason| *reason == reasons[0]), "{frame:02x?}: {reasons:?}");
        }
        for len in 0..good.len().min(40) {
            let reasons = reasons(&good[..len], &devices);
            assert!(reasons[0].is_some() && reasons.iter().all(|reason| *reason == reasons[0]), "{len}: {reasons:?}");
        }
    }
}

/// An error is reported in the next STATUS byte that the device writes, and is forgotten only then.
#[test]
fn an_error_is_kept_until_a_status_byte_carries_it() {
    for last in [false, true] {
        let mut device = device_in(State::Discovery, last, STOCK);
        let mut flipped = Discovery::request(Place::Inner).emit();
        flipped[2] ^= 2;
        let handled = device.hear(PortId::A, &mut flipped, ARRIVAL);
        assert_eq!(handled.result.map_err(Error::class), Err(ErrorClass::BadFcs), "last: {last}");
        // Frames that the rewriter lets pass unchanged, one of them damaged in DA.
        let mut foreign = DelayReq::of_master(Place::Inner).emit();
        let sent = foreign;
        assert_eq!(device.hear(PortId::A, &mut foreign, ARRIVAL).result, Ok(()));
        assert_eq!(foreign, sent);
        let counters = device.counters();
        assert_eq!((counters.crc_errors, counters.format_errors), (1, 0));
        assert_eq!((counters.a.crc_errors, counters.b.crc_errors), (1, 0));

        let mut next = Discovery::request(Place::Inner).emit();
        assert_eq!(device.hear(PortId::A, &mut next, ARRIVAL).result, Ok(()));
        assert!(Discovery::parse(&next).unwrap().status.contains(Status::ERROR), "last: {last}");
        let mut after = Discovery::request(Place::Inner).emit();
        assert_eq!(device.hear(PortId::A, &mut after, ARRIVAL).result, Ok(()));
        assert!(!Discovery::parse(&after).unwrap().status.contains(Status::ERROR), "last: {last}");
    }
}

/// STATUS is the fourth byte: a frame that breaks off in front of it has carried nothing.
#[test]
fn an_error_is_kept_by_a_frame_without_a_status_byte() {
    for (len, kept) in [(0, true), (3, true), (4, false)] {
        let mut device = device_in(State::Discovery, true, STOCK);
        let mut flipped = Discovery::request(Place::Inner).emit();
        flipped[2] ^= 2;
        assert!(device.hear(PortId::A, &mut flipped, ARRIVAL).result.is_err());
        let mut cut = Discovery::request(Place::Inner).emit();
        assert!(device.hear(PortId::A, &mut cut[..len], ARRIVAL).result.is_err());
        let mut next = Discovery::request(Place::Inner).emit();
        assert_eq!(device.hear(PortId::A, &mut next, ARRIVAL).result, Ok(()));
        assert_eq!(Discovery::parse(&next).unwrap().status.contains(Status::ERROR), kept, "{len} bytes");
    }
}

/// Type 4 is defined by the vendor and sent by nobody: whoever gets one goes on as if it had not come.
#[test]
fn a_delay_response_is_accepted_and_ignored() {
    let mut response = DelayReq::of_device(Place::Inner).emit();
    (response[2], response[3]) = (FrameType::DelayResp.code(), 0x30);
    let (body, trailer) = response.split_last_chunk_mut().unwrap();
    *trailer = fcs(body).to_le_bytes();
    for state in [State::Discovery, State::Param, State::LineDelay, State::Sync] {
        for last in [false, true] {
            let mut device = device_in(state, last, STOCK);
            let before = device.counters();
            assert_eq!(device.hear(PortId::A, &mut response.clone(), ARRIVAL).result, Ok(()));
            assert_eq!((device.state(), device.counters().format_errors), (state, before.format_errors));
        }
    }
    let mut device = device_in(State::LineDelay, false, STOCK);
    let (before, counted) = (device.line_delay_next_ns(), device.counters());
    assert_eq!(device.hear_reflection(Trigger::Normal, &response, 560), Ok(()));
    assert_eq!((device.counters().format_errors, device.line_delay_next_ns()), (0, before));
    // It came to the port that does not face the master.
    assert_eq!((device.counters().a, device.counters().b.good_frames), (counted.a, counted.b.good_frames + 1));
}

/// Where a frame goes is known before its first byte, but for a last device in IDLE: there with the third.
#[test]
fn the_path_is_known_before_a_device_has_to_send() {
    for state in [State::Discovery, State::Param, State::LineDelay, State::Sync] {
        for last in [false, true] {
            let device = device_in(state, last, STOCK);
            let want = if last || state == State::LineDelay { Path::Reflect } else { Path::Forward };
            assert_eq!(device.passage(PortId::A).path(), Some(want), "{state:?}");
        }
    }
    let mut idle = Device::new(Config::new());
    idle.set_links(Link::Up, Link::Down);
    for (frame, want) in frames().into_iter().zip([Path::Reflect, Path::Absorb, Path::Absorb, Path::Absorb]) {
        let mut passage = idle.passage(PortId::A);
        for (at, byte) in frame.iter().enumerate() {
            passage.byte(*byte);
            assert_eq!(passage.path(), (at >= 2).then_some(want), "byte {at}");
        }
    }
}
