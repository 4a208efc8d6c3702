//! Numbers, words and settings that are changed into one another, or made by default.

use sorte_proto::iep::Channel;
use sorte_proto::master::{self, Heard};
use sorte_proto::pins::Pins;
use sorte_proto::sync0::Variant;
use sorte_proto::{
    Clock, CrcMode, DeviceAddress, DeviceFrameView, Direction, OutOfRange, Parameters, Pto, PublishedDeviceFrame,
    Reserved, Slice, StartTime, Status, device,
};

#[test]
fn numbers_and_words_become_one_another() {
    assert_eq!(u8::from(DeviceAddress::new(7).unwrap()), 7);
    assert_eq!(u16::from(StartTime::new(1234).unwrap()), 1234);
    assert_eq!(StartTime::try_from(0), Err(OutOfRange { got: 0, max: 1 }));
    assert_eq!(StartTime::try_from(3991), Err(OutOfRange { got: 3991, max: 3990 }));
    let step = Pto::from(0x83e8);
    assert_eq!((step, u16::from(step)), (Pto::from_step(1000, Direction::High).unwrap(), 0x83e8));
    assert_eq!(Slice::from(step).emit(), [0xe8, 0x83, 0, 0]);
    let reserved = Reserved::try_from(Pto::from(0x0fff)).unwrap();
    assert_eq!((reserved.word(), Pto::from(reserved)), (0x0fff, Pto::Reserved(reserved)));
    assert_eq!(Reserved::try_from(step), Err(OutOfRange { got: 0x83e8, max: 3991 }));
}

/// The numbers of the published firmware where it has them.
#[test]
fn defaults() {
    assert_eq!((Pto::default().word(), Pins::default(), Clock::default()), (0, Pins::new(), Clock::new()));
    let device = device::Config::default();
    assert_eq!((device.output_len, device.missed_frames, device.clock_average), (Some(16), 5, 16));
    let master = master::Config::default();
    assert_eq!((master.discovery_frames, master.param_frames, master.sync_frames), (10, 10, 1024));
    let told = Parameters::default();
    assert_eq!((told.cycle_time_ns, told.gap_ns(), told.crc_mode), (10_000, 260, CrcMode::from_byte(0x33)));
}

#[test]
fn what_the_published_image_would_send_and_what_a_master_has_heard() {
    let address = DeviceAddress::new(3).unwrap();
    let frame = PublishedDeviceFrame { address, status: Status::LAST, drv8711_status: 0x5a };
    assert_eq!(frame.emit_without_crc(), [3, 1, 0x5a, 0]);
    let frame = DeviceFrameView::parse(0, &[1, 0, 0x15]).unwrap();
    assert_eq!(Heard::Device { frame, cycle: None, sof_ns: 5 }.device(), Some(frame));
    assert_eq!(Heard::StartUp.device(), None);
}

/// A timer in the middle of a pulse goes on as it would have, a thousand cycles earlier.
#[test]
fn a_timer_that_is_put_back_goes_on() {
    let edges = |axis: &mut Channel, until_ns: u64, back_ns: u64| -> Vec<(u64, bool)> {
        std::iter::from_fn(|| axis.next_edge(until_ns)).map(|edge| (edge.ns - back_ns, edge.high)).collect()
    };
    let mut axis = Channel::new(Variant::Lossless, 2000, 300);
    edges(&mut axis, 4_000_000, 0);
    axis.set_start(StartTime::new(1500));
    // Set up at 2 us of this cycle, it rises at 1.5 us of the next; the other one does it a thousand cycles earlier.
    let mut earlier = axis.rebased(1000);
    axis.next_edge(4_006_000);
    earlier.next_edge(6_000);
    assert_eq!(edges(&mut earlier, 8_000, 0), edges(&mut axis, 4_008_000, 4_000_000));
}
