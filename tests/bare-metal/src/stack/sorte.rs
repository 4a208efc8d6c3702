//! The SORTE master from link-up into the IO exchange, with one device at its line.

use sorte_proto::Link;
use sorte_proto::device::{self, Device, FrameTimes, PortId};
use sorte_proto::master::{Action, Config, Master};
use sorte_proto::{DeviceAddress, DeviceFrame, Discovery, Status};

use super::of;

/// Cycles of the IO exchange; the last is without an answer.
const CYCLES: u64 = 4;
/// Round trip of a delay request in ns: 90 ns of cable. A device frame that leaves with the master's is captured after these and the
/// 120 ns from its first bit.
const ROUND_TRIP: u64 = 500;
const CAPTURED: u64 = 210;

/// The deepest call of the master: what it is told to do, the frames that it writes, and those that it takes. The master
/// itself, the buffer of a frame and the device are not counted.
pub(super) fn master() -> u32 {
    let mut master = Master::new(Config::new().with_sync_frames(20));
    let mut device = Device::new(device::Config::new());
    let mut buffer = [0; Discovery::LEN];
    device.set_links(Link::Up, Link::Down);
    master.set_link(Link::Up);
    let (mut now_ns, mut deepest) = (0, 0);
    for _ in 0..1000 {
        let mut action = Action::Wait { until_ns: 0 };
        deepest = deepest.max(of(|| action = master.poll(now_ns)));
        match action {
            Action::Wait { until_ns } => now_ns = until_ns,
            Action::Send { at_ns, frame } => {
                let mut len = 0;
                deepest = deepest.max(of(|| len = frame.emit_into(&mut buffer).unwrap_or_default()));
                let Some(bytes) = buffer.get_mut(..len) else { break };
                let _ = device.hear(PortId::A, bytes, FrameTimes { sof_ns: 0, counter_ns: 0, now_ns: at_ns });
                let mut taken = Ok(());
                deepest = deepest.max(of(|| {
                    taken =
                        master.hear(bytes, at_ns + u64::from(frame.preamble().capture_ns()) + ROUND_TRIP).map(|_| ());
                }));
                if taken.is_err() {
                    break;
                }
            }
            Action::Exchange { cycle: CYCLES, .. } => return deepest,
            Action::Exchange { at_ns, time_stamp, cycle, .. } => {
                let mut len = 0;
                deepest = deepest.max(of(|| {
                    len = master.emit_into(&[0; 16], time_stamp, &mut buffer).unwrap_or_default();
                }));
                let answer = DeviceFrame { address: DeviceAddress::FIRST, status: Status::LAST, payload: [0; 3] };
                let answer = answer.emit_into(&mut buffer).ok();
                let Some(bytes) = buffer.get(..answer.unwrap_or_default()) else { break };
                let mut good = false;
                deepest = deepest.max(of(|| good = master.hear(bytes, at_ns + CAPTURED).is_ok()));
                if !good || bytes.len() != DeviceFrame::<3>::LEN || len != 21 {
                    break;
                }
                now_ns += cycle;
            }
            Action::Restart { .. } => break,
        }
    }
    u32::MAX
}
