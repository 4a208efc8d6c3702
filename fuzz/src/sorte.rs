//! SORTE: frames against their own emission, the rewriters against the buffered form, a device against its laws, the
//! lossless step generator against what was asked of it.

use nom::Parser;
use sorte_proto::cut_through::{Passed, Rewriter};
use sorte_proto::device::{Action, Config, Device, FrameTimes, PortId, Reaction, State, Trigger};
use sorte_proto::iep::Channel;
use sorte_proto::sync0::{CMP7_NS, MAX_LATENCY_NS, PULSE_NS, Variant};
use sorte_proto::{
    Assignment, DelayReq, DeviceAddress, DeviceFrame, DeviceFrameView, Discovery, Entry, Error, FrameType, Link,
    LongFrame, MasterFrame, MasterFrameView, Param, Parameters, Place, StartTime, Status, Sync, fcs, stream,
    strip_preamble,
};

use crate::byte;

/// Any bytes as every kind of frame: what is accepted gives itself back, and the streaming parsers agree.
pub fn frame(data: &[u8]) {
    let body = strip_preamble(data);
    let streamed = stream::preamble::<Error>(data);
    assert_eq!(body.ok(), streamed.ok().map(|(rest, ())| rest));

    let frame = LongFrame::parse(data);
    if let Ok(frame) = frame {
        let known = frame.frame_type().frame_len().is_some();
        assert_eq!(stream::long_frame::<Error>(data).is_ok(), known);
        assert_eq!(frame.fcs(), fcs(&data[..data.len() - 4]));
        match frame.frame_type() {
            FrameType::Discovery => assert_eq!(Discovery::parse(data).map(|f| f.emit().to_vec()), Ok(data.to_vec())),
            FrameType::Param => assert_eq!(Param::parse(data).map(|f| f.emit().to_vec()), Ok(data.to_vec())),
            FrameType::DelayReq => assert_eq!(DelayReq::parse(data).map(|f| f.emit().to_vec()), Ok(data.to_vec())),
            FrameType::Sync => assert_eq!(Sync::parse(data).map(|f| f.emit().to_vec()), Ok(data.to_vec())),
            _ => {}
        }
    } else {
        assert!(Discovery::parse(data).is_err() && Param::parse(data).is_err());
        assert!(DelayReq::parse(data).is_err() && Sync::parse(data).is_err());
    }

    if let Ok(frame) = MasterFrame::<16>::parse(data) {
        let mut again = [0; 21];
        assert_eq!((frame.emit_into(&mut again), &again[..]), (Ok(21), data));
    }
    if let Ok(frame) = DeviceFrame::<3>::parse(data) {
        let mut again = [0; 6];
        assert_eq!((frame.emit_into(&mut again), &again[..]), (Ok(6), data));
    }
    for len in [0, 3, 16] {
        let whole = data.len() == len + MasterFrameView::OVERHEAD;
        let streamed = stream::master_frame::<Error>(len).parse(data).is_ok();
        assert!(!whole || streamed == MasterFrameView::parse(len, data).is_ok());
        let whole = data.len() == len + DeviceFrameView::OVERHEAD;
        let streamed = stream::device_frame::<Error>(len).parse(data).is_ok();
        assert!(!whole || streamed == DeviceFrameView::parse(len, data).is_ok());
    }
}

/// A frame through both rewriters: a good one comes out as the buffered form has it, a bad one stays bad.
///
/// ```text
/// 0  bit 0 last, bit 1 error, bit 2 a right FCS is put in     1  lengths, line delay     2..  the frame
/// ```
pub fn cut_through(mut data: &[u8]) {
    let (flags, number) = (byte(&mut data), byte(&mut data));
    let mut adds = Status::empty();
    adds.set(Status::LAST, flags & 1 != 0);
    adds.set(Status::ERROR, flags & 2 != 0);
    let mut frame = data.to_vec();
    if let (true, Some((body, trailer))) = (flags & 4 != 0, frame.split_last_chunk_mut()) {
        *trailer = fcs(body).to_le_bytes();
    }
    let lengths = Entry { input: number.into(), output: u16::from(number) << 8 | 1 };
    let mut passed = frame.clone();
    let told = Rewriter::discovery(lengths, adds).pass(&mut passed);
    if let Ok(buffered) = Discovery::parse(&frame) {
        let (assignment, after) = discovery_passed(&buffered, lengths, adds);
        // A device says nothing about SA.
        let status = buffered.status;
        assert_eq!(told, assignment.map(|assignment| Passed::Discovery { status, assignment }));
        assert_eq!(passed, after.emit());
    } else {
        assert!(!matches!(told, Ok(Passed::Discovery { .. })) && Discovery::parse(&passed).is_err());
    }

    let mut passed = frame.clone();
    let told = Rewriter::sync(number.into(), adds).pass(&mut passed);
    if let Ok(buffered) = Sync::parse(&frame) {
        assert_eq!(told, Ok(Passed::Sync(buffered)));
        let hop = 355 + u32::from(number);
        let after = Sync {
            status: buffered.status | adds,
            time_stamp_ns: buffered.time_stamp_ns.wrapping_add(hop),
            delay_ns: buffered.delay_ns.wrapping_add(hop as u16),
            ..buffered
        };
        assert_eq!(passed, after.emit());
    } else {
        assert!(!matches!(told, Ok(Passed::Sync(_))) && Sync::parse(&passed).is_err());
    }

    let mut passed = frame.clone();
    assert_eq!(Rewriter::unchanged().pass(&mut passed).is_ok(), LongFrame::parse(&frame).is_ok());
    assert_eq!(passed, frame);
}

/// What a device makes of DISCOVERY, in the values of the frame.
fn discovery_passed(before: &Discovery, lengths: Entry, adds: Status) -> (Result<Assignment, Error>, Discovery) {
    let Discovery { count, input_total: in_offset, output_total: out_offset, .. } = *before;
    let mut after = Discovery { status: before.status | adds, ..*before };
    if count >= 254 {
        // A passing frame shows its low byte first, so nothing is carried.
        after.count = if count & 0xff == 0xff { count } else { count + 1 };
        return (Err(Error::TooManyDevices { count: count.saturating_add(1) }), after);
    }
    after.count += 1;
    after.entries[usize::from(count)] = lengths;
    after.input_total = in_offset.wrapping_add(lengths.input);
    after.output_total = out_offset.wrapping_add(lengths.output);
    let address = DeviceAddress::new(after.count as u8).expect("1 to 254");
    (Ok(Assignment { address, in_offset, out_offset }), after)
}

/// A device and a series of frames and times.
///
/// ```text
/// 0  bit 0 last in the line     then commands of two bytes: what, and with which number
/// ```
pub fn device(mut data: &[u8]) {
    let last = byte(&mut data) & 1 != 0;
    let mut device = Device::new(Config::new());
    device.set_links(Link::Up, if last { Link::Down } else { Link::Up });
    let mut now_ns = 0;
    while let [command, value, rest @ ..] = data {
        data = rest;
        let place = if value & 1 == 0 { Place::Inner } else { Place::Last };
        let frame = match command & 7 {
            0 => Discovery::request(place).emit().to_vec(),
            1 => Param::request(Parameters::STOCK, place).emit().to_vec(),
            2 => DelayReq::of_master(place).emit().to_vec(),
            3 => Sync::of_master(u32::from(*value) * 10_000, 76, place).emit().to_vec(),
            4 => {
                now_ns += u64::from(*value) * 1_000_000;
                let _: Action = device.poll(now_ns as u32, now_ns);
                continue;
            }
            5 => {
                let _: Action = device.poll(u32::from(*value) * 500, now_ns);
                continue;
            }
            6 => {
                let request = DelayReq::of_device(place).emit();
                let trigger = if place == Place::Last { Trigger::Last } else { Trigger::Normal };
                assert_eq!(device.hear_reflection(trigger, &request, 360 + u32::from(*value)), Ok(()));
                continue;
            }
            _ => {
                exchange(&mut device, *value, now_ns);
                continue;
            }
        };
        let port = if command & 8 == 0 { PortId::A } else { PortId::B };
        let times = FrameTimes { sof_ns: now_ns as u32, counter_ns: now_ns as u32, now_ns };
        if command & 16 != 0 {
            damaged(device, port, frame.clone(), *value, times);
        }
        let before = device.port(port).state as u8;
        let (length, mut passed) = (frame.len(), frame);
        let _: Reaction = device.hear(port, &mut passed, times);
        assert_eq!(passed.len(), length);
        let after = device.port(port).state as u8;
        assert!(after == before || after == before + 1 || after == 0, "{before} to {after}");
    }
}

/// A flip is refused, is not sent on as good, and changes nothing but counters.
fn damaged(mut device: Device, port: PortId, mut frame: Vec<u8>, value: u8, times: FrameTimes) {
    let known = |device: &Device| {
        (device.port(PortId::A).state, device.port(PortId::B).state, device.assignment(), device.last_sync())
    };
    let before = known(&device);
    let bit = usize::from(value) * 31 % (frame.len() * 8);
    frame[bit / 8] ^= 1 << (bit % 8);
    let exchange = device.port(port).state == State::Exchange;
    let reaction = device.hear(port, &mut frame, times);
    assert!(exchange || reaction.result.is_err());
    assert!(exchange || LongFrame::parse(&frame).is_err());
    // A line that was never measured makes a device give up at the first SYNC, whatever it is.
    assert!(known(&device) == before || device.state() == State::Idle);
}

/// A master frame, near its time or not: data only of the cycle that the device is in, and each once.
fn exchange(device: &mut Device, value: u8, now_ns: u64) {
    let Some(first) = device.first_cycle_ns() else { return };
    let start = first.wrapping_add(u32::from(value & 15) * 4000);
    let trigger = start.wrapping_add(500);
    let frame = MasterFrame { status: Status::EXCHANGE, output: [value; 16], time_stamp: trigger as u16 };
    let mut bytes = [0; 21];
    assert_eq!(frame.emit_into(&mut bytes), Ok(21));
    let sof_ns = trigger.wrapping_add(76 + 120 + u32::from(value >> 4) * 40);
    let times = FrameTimes { sof_ns, counter_ns: sof_ns, now_ns };
    let good = device.hear_exchange(&bytes, times).map(|output| output.data.to_vec());
    // A device at a far place owns none of the 16 bytes.
    assert!(good.is_err() || good == Ok(vec![value; 4]));
    assert!(good.is_err() || value >> 4 <= 6, "{sof_ns} is not its time");
    assert!(good.is_err() || device.answer([value; 3]).is_some());
    assert!(device.hear_exchange(&bytes, times).is_err(), "each once");
    bytes[2] ^= 1;
    assert!(device.hear_exchange(&bytes, times).is_err());
}

/// Legal steps through the lossless generator: all of them, on time, at full width.
///
/// ```text
/// 0, 1  handler latency     then two bytes for each step: how much later than 4 us after the one before
/// ```
pub fn sync0(mut data: &[u8]) {
    let latency = u16::from_le_bytes([byte(&mut data), byte(&mut data)]) % (MAX_LATENCY_NS + 1);
    let (mut at, mut words) = (0u64, Vec::new());
    while let [low, high, rest @ ..] = data {
        data = rest;
        at += 4000 + u64::from(u16::from_le_bytes([*low, *high])) % 12_000;
        // The wire carries 1 to 3990.
        if at % 4000 == 0 || at % 4000 > 3990 {
            at = (at / 4000 + u64::from(at % 4000 > 3990)) * 4000 + 1;
        }
        words.resize((at / 4000) as usize, 0);
        words.push((at % 4000) as u16);
    }
    let mut axis = Channel::new(Variant::Lossless, CMP7_NS, latency);
    let mut wanted = (1..).zip(&words).filter(|(_, word)| **word != 0).map(|(n, word)| n * 4000 + u64::from(*word));
    let mut up = 0;
    for (end, word) in (1..).map(|n| n * 4000).zip(words.iter().chain(&[0; 3])) {
        axis.set_start(StartTime::new(*word));
        while let Some(edge) = axis.next_edge(end) {
            if edge.high {
                let wanted = wanted.next().expect("no more pulses than steps");
                assert!(edge.ns.abs_diff(wanted) < 10, "{} for {wanted}", edge.ns);
                up = edge.ns;
            } else {
                assert_eq!(edge.ns - up, u64::from(PULSE_NS));
            }
        }
    }
    assert_eq!(wanted.next(), None);
}
