use sorte_proto::inspect::During;
use sorte_proto::{DelayReq, DeviceFrame, DeviceFrameView, Evidence, Positions};

/// Device 1, the only one, has made 258 steps; its driver reports nothing.
fn sound() -> Vec<u8> {
    let mut bytes = vec![0x01, 0x01, 0x00, 0x02, 0x01];
    bytes.push(sorte_proto::crc8(&bytes));
    bytes
}

fn damaged() -> Vec<u8> {
    let mut bytes = sound();
    bytes[3] ^= 0x10;
    bytes
}

fn evidence() -> Evidence {
    let bytes = sound();
    Evidence::of(DeviceFrameView::parse(3, &bytes).unwrap(), Positions::taken_before_ns(0), 5_000_000_000)
}

decode! { sorte_proto::DeviceFrameView(usize, &[u8]); with (3); sound &sound(); damaged &damaged() => "bad_crc8" }
encode! { sorte_proto::DelayReq = DelayReq::of_master(sorte_proto::Place::Last) }
code! { sorte_proto::FrameType: 5; unknown 11 }
feedback! { sorte_proto: evidence(), sampled at 5_000_000_000; "`master.hear(frame, sof_ns)?.evidence(Positions)`" }
inspect! { sorte_proto::inspect(during = During::Exchange; bytes); damaged damaged().leak() => "bad_crc8" }
log! { sorte_proto: DelayReq, DeviceFrame<3>, sorte_proto::FrameType, sorte_proto::master::State }
counters! { sorte_proto }
differs! {
    EXCHANGE: "the line has its own clock: `Master::new(config)`, `poll(now_ns)`, `hear(frame: &[u8], sof_ns)`";
    PROCEDURE: "the start-up is part of `Master`";
    DEVICE: "`Device` is firmware, so it has no faults and no behaviour: `hear(device::PortId, &mut [u8], device::FrameTimes)`";
}
