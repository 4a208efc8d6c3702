//! A device on its way through the start-up, for several test programs.

use sorte_proto::device::{Config, Device, FrameTimes, PortId, State, Trigger};
use sorte_proto::master::Outgoing;
use sorte_proto::{DelayReq, Discovery, Link, Param, Parameters, Place};

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
