//! A device on its way through the start-up, and a line that answers a master.

use sorte_proto::cut_through::Rewriter;
use sorte_proto::device::{Config, Device, FrameTimes, PortId, State, Trigger};
use sorte_proto::master::Outgoing;
use sorte_proto::{
    DelayReq, DeviceAddress, DeviceFrame, Discovery, Entry, Link, Param, Parameters, Place, Status, Sync,
};

/// A device in the state that waits for a frame, the last of the line or not. Its frames begin at 77,000 ns of its counter.
pub(crate) fn device_in(state: State, last: bool, parameters: Parameters) -> Device {
    let arrival = FrameTimes { sof_ns: 77_000, counter_ns: 77_700, now_ns: 0 };
    let mut device = Device::new(Config::new());
    device.set_links(Link::Up, if last { Link::Down } else { Link::Up });
    let script = [
        Discovery::request(Place::Inner).emit().to_vec(),
        Discovery::request(Place::Last).emit().to_vec(),
        Param::request(parameters, Place::Last).emit().to_vec(),
        DelayReq::of_master(Place::Last).emit().to_vec(),
    ];
    for mut frame in script {
        if device.state() == state {
            break;
        }
        if device.state() == State::LineDelay && !last {
            for _ in 0..16 {
                device.hear_reflection(Trigger::Normal, &DelayReq::of_device(Place::Inner).emit(), 560).unwrap();
            }
        }
        assert_eq!(device.hear(PortId::A, &mut frame, arrival).result, Ok(()));
    }
    assert_eq!(device.state(), state);
    device
}

/// From the first bit of a frame to the capture of its start, half a byte before the end of 0xD5: preambles of 8, 4 and 2 bytes.
pub(crate) fn capture_ns(frame: &Outgoing) -> u64 {
    match frame {
        Outgoing::Sync(_) => 280,
        _ => 600,
    }
}

/// The same for the frames of the exchange.
pub(crate) const EXCHANGE_CAPTURE_NS: u64 = 120;

/// What device `n` of this many adds to STATUS.
pub(crate) fn last_of(n: u8, devices: u8) -> Status {
    if n == devices { Status::LAST } else { Status::empty() }
}

/// DISCOVERY behind this many devices.
pub(crate) fn discovery(devices: u8, place: Place) -> Vec<u8> {
    let mut frame = Discovery::request(place).emit();
    for n in 1..=devices {
        Rewriter::discovery(Entry::STOCK, last_of(n, devices)).pass(&mut frame).unwrap();
    }
    frame.to_vec()
}

/// SYNC behind as many devices as there are cables after them, in ns.
pub(crate) fn sync(frame: Sync, cables: &[u16]) -> Sync {
    let mut bytes = frame.emit();
    for (n, cable) in (1..).zip(cables) {
        Rewriter::sync(*cable, last_of(n, cables.len() as u8)).pass(&mut bytes).unwrap();
    }
    Sync::parse(&bytes).unwrap()
}

/// What a line of this many devices without cables between them answers.
pub(crate) fn answer(frame: Outgoing, devices: u8) -> Vec<u8> {
    match frame {
        Outgoing::Discovery { place } => discovery(devices, place),
        Outgoing::Param(frame) => frame.emit().to_vec(),
        Outgoing::DelayReq(frame) => frame.emit().to_vec(),
        Outgoing::Sync(frame) => {
            let cables: Vec<u16> = vec![0; devices.into()];
            sync(frame, &cables).emit().to_vec()
        }
    }
}

/// The frame of a device of two, with a payload of zeros.
pub(crate) fn device_frame(address: u8) -> [u8; 6] {
    let (address, status) = (DeviceAddress::new(address).unwrap(), last_of(address, 2));
    let mut bytes = [0; 6];
    DeviceFrame { address, status, payload: [0; 3] }.emit_into(&mut bytes).unwrap();
    bytes
}
