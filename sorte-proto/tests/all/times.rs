//! Times and limits of master and device as numbers of the published firmware, not of the functions under test.

use crate::common::{EXCHANGE_CAPTURE_NS, answer, capture_ns, device_frame, device_in, sync};
use sorte_proto::Link;
use sorte_proto::Place;
use sorte_proto::device::{self, Device, FrameTimes, PortId};
use sorte_proto::master::{self, Action, Heard, Master, Outgoing};
use sorte_proto::{Correction, Error, Parameters, Status, Sync, emit_master_frame_into};

/// A master in the IO exchange with two devices, and what it did until then.
fn running(config: master::Config) -> (Master, Vec<(u64, Outgoing)>, (u64, u16)) {
    let mut master = Master::new(config);
    master.set_link(Link::Up);
    let (mut sent, mut now_ns) = (Vec::new(), 0);
    loop {
        match master.poll(now_ns) {
            Action::Wait { until_ns } => now_ns = until_ns,
            Action::Send { at_ns, frame } => {
                sent.push((at_ns, frame));
                // 472 ns of round trip: a line of 76 ns.
                assert_eq!(master.hear(&answer(frame, 2), at_ns + capture_ns(&frame) + 472), Ok(Heard::StartUp));
            }
            Action::Exchange { at_ns, time_stamp, cycle, .. } => {
                assert_eq!(cycle, 0);
                return (master, sent, (at_ns, time_stamp));
            }
            Action::Restart { error } => panic!("{error}"),
        }
    }
}

/// 10 DISCOVERY, 10 PARAM and 16 DELAY_REQ a millisecond apart, 1024 SYNC every 10 us at 500, 10500, ... of the master's
/// time, and the first frame of the exchange after 46.24 ms.
#[test]
fn the_start_up_has_the_published_times() {
    let (master, sent, (first_ns, stamp)) = running(master::Config::new());
    assert_eq!(sent.len(), 10 + 10 + 16 + 1024);
    for (n, (at_ns, frame)) in sent.iter().enumerate() {
        let (phase, want) =
            if n < 36 { (n / 10, n as u64 * 1_000_000) } else { (9, 36_000_500 + (n as u64 - 36) * 10_000) };
        assert_eq!(*at_ns, want, "frame {n}");
        match frame {
            Outgoing::Discovery { place } => assert_eq!((phase, *place == Place::Last), (0, n == 9)),
            Outgoing::Param(_) => assert_eq!(phase, 1),
            Outgoing::DelayReq(_) => assert!(phase == 2 || phase == 3),
            Outgoing::Sync(frame) => {
                let sync = n as u32 - 36;
                assert_eq!((frame.time_stamp_ns, frame.delay_ns), (500 + 10_000 * sync + 76 + 280, 76));
                assert_eq!(frame.status.bits(), if sync == 1023 { 0x08 } else { 0x40 });
            }
        }
    }
    assert_eq!((first_ns, master.epoch_ns()), (46_241_000, 36_000_000));
    // The time stamp is that of this frame: 10,241,000 modulo 65,536.
    assert_eq!(stamp, 17_384);
}

#[test]
fn each_cycle_has_its_own_time_stamp() {
    let (mut master, _, (mut at_ns, mut stamp)) = running(master::Config::new());
    for cycle in 1..100 {
        for address in 1..=2 {
            good_frame(&mut master, address, at_ns);
        }
        let Action::Wait { until_ns } = master.poll(at_ns) else { panic!("no wait") };
        assert_eq!(until_ns, at_ns + 4000);
        let Action::Exchange { at_ns: at, time_stamp, cycle: number, stop } = master.poll(until_ns) else { panic!() };
        assert_eq!((at, number, stop), (at_ns + 4000, cycle, false));
        assert_eq!(time_stamp, stamp.wrapping_add(4000));
        (at_ns, stamp) = (at, time_stamp);
    }
}

/// Capture of a device's frame of the cycle that was triggered at `at_ns`: published times, 76 ns to the first device, none between.
fn capture_of(address: u8, at_ns: u64) -> u64 {
    at_ns - 500 + if address == 1 { 500 + 76 } else { 900 + 76 + 355 } + EXCHANGE_CAPTURE_NS
}

fn good_frame(master: &mut Master, address: u8, at_ns: u64) {
    assert!(master.hear(&device_frame(address), capture_of(address, at_ns)).is_ok());
}

/// Runs cycles in which `bad(n)` devices are heard right; gives the cycle in which the master gave up.
fn cycles(master: &mut Master, mut at_ns: u64, frames: impl Fn(u32) -> [Option<bool>; 2]) -> Option<(u32, Error)> {
    for n in 0..100 {
        for (address, good) in (1..).zip(frames(n)) {
            let mut bytes = device_frame(address);
            bytes[2] ^= u8::from(good == Some(false));
            if good.is_some() {
                let _: Result<_, _> = master.hear(&bytes, capture_of(address, at_ns));
            }
        }
        at_ns += 4000;
        if let Action::Restart { error } = master.poll(at_ns) {
            return Some((n, error));
        }
    }
    None
}

/// Three cycles in a row with a damaged frame, or with one missing; two and a good one never.
#[test]
fn the_master_gives_up_after_three_bad_cycles_in_a_row() {
    let run = |frames: fn(u32) -> [Option<bool>; 2]| {
        let (mut master, _, (at_ns, _)) = running(master::Config::new());
        cycles(&mut master, at_ns, frames)
    };
    assert_eq!(run(|_| [Some(true), Some(true)]), None);
    assert_eq!(run(|n| if n < 5 { [Some(true); 2] } else { [Some(true), None] }).map(|(n, _)| n), Some(7));
    assert_eq!(
        run(|n| if n < 5 { [Some(true); 2] } else { [None, Some(true)] }),
        Some((7, Error::DevicesMissing { first: 1, count: 1, cycles: 3 }))
    );
    assert_eq!(run(|n| if n % 3 == 2 { [Some(true); 2] } else { [Some(true), None] }), None);
    // A damaged frame is a missing one too, so the limits are told apart with one of them off.
    let damaged = |limits: fn(master::Config) -> master::Config, frames: fn(u32) -> [Option<bool>; 2]| {
        let (mut master, _, (at_ns, _)) = running(limits(master::Config::new()));
        cycles(&mut master, at_ns, frames)
    };
    let crc = |config: master::Config| config.with_retrain_timing_errors(0);
    assert_eq!(damaged(crc, |_| [Some(false), Some(true)]), Some((2, Error::TooManyCrcErrors { cycles: 3 })));
    assert_eq!(damaged(crc, |n| if n % 3 == 2 { [Some(true); 2] } else { [Some(false), Some(true)] }), None);
    let none = |config: master::Config| config.with_retrain_timing_errors(0).with_retrain_crc_errors(0);
    assert_eq!(damaged(none, |_| [Some(false), None]), None);
    let five = |config: master::Config| config.with_retrain_timing_errors(0).with_retrain_crc_errors(5);
    assert_eq!(damaged(five, |_| [Some(true), Some(false)]).map(|(n, _)| n), Some(4));
}

/// SYNC is over only with an answer that has passed the last device and carries STATE_CHANGE.
#[test]
fn the_last_sync_needs_last_and_state_change() {
    for (status, want) in [(0x09, true), (0x08, false), (0x01, false), (0x00, false), (0x0d, true)] {
        let mut master = Master::new(master::Config::new().with_sync_frames(4));
        master.set_link(Link::Up);
        let mut now_ns = 0;
        let ran = loop {
            match master.poll(now_ns) {
                Action::Wait { until_ns } => now_ns = until_ns,
                Action::Send { at_ns, frame: Outgoing::Sync(mut frame) } => {
                    frame = sync(frame, &[0, 0]);
                    frame.status = Status::from_bits_retain(status);
                    let _: Result<_, _> = master.hear(&frame.emit(), at_ns + 280 + 472);
                }
                Action::Send { at_ns, frame } => {
                    let _: Result<_, _> = master.hear(&answer(frame, 2), at_ns + capture_ns(&frame) + 472);
                }
                Action::Exchange { .. } => break true,
                Action::Restart { .. } => break false,
            }
        };
        assert_eq!(ran, want, "STATUS {status:#04x}");
    }
}

/// The only device of a line that is 76 ns long, in the IO exchange; its last SYNC frame began at 77,000 ns of its counter.
fn device_in_exchange() -> Device {
    let mut device = device_in(device::State::Sync, true, Parameters::CNC);
    let arrival = FrameTimes { sof_ns: 77_000, counter_ns: 77_700, now_ns: 0 };
    let handled = device.hear(PortId::A, &mut Sync::of_master(30_500, 76, Place::Last).emit(), arrival);
    // Time stamp 30,856, 700 ns since the start, 135 ns until the write is made.
    assert_eq!((handled.result, handled.correction), (Ok(()), Correction::Set { counter_ns: 31_691 }));
    device
}

#[test]
fn a_device_enters_the_exchange_ten_microseconds_after_the_last_sync() {
    let device = device_in_exchange();
    assert_eq!(device.cycle_zero_ns(), Some(87_000));
    // In the common time: triggered at 30,500, the first cycle 10 us later.
    assert_eq!((device.first_cycle_ns(), device.delay_ns()), (Some(40_500), Some(76)));
    // The first address sends at 500 ns and owns the first bytes.
    let place = device.assignment().unwrap();
    assert_eq!((place.address.get(), place.in_offset, place.out_offset), (1, 0, 0));
    assert_eq!(device.send_time_ns(), Some(500));
}

/// The master frame of a cycle: the device's cycle 0 begins at 40,500 ns.
fn master_frame(cycle: u32, fill: u8) -> [u8; 21] {
    let mut frame = [0; 21];
    let trigger = 40_500 + 4000 * cycle + 500;
    emit_master_frame_into(&[fill; 16], trigger as u16, &mut frame).unwrap();
    frame
}

/// When it is captured at the device, which is 76 ns away: 120 ns after its first bit.
fn captured(cycle: u32) -> FrameTimes {
    let sof_ns = 40_500 + 4000 * cycle + 500 + 76 + 120;
    FrameTimes { sof_ns, counter_ns: sof_ns + 2500, now_ns: u64::from(sof_ns) }
}

/// The clock's target in the exchange is the delay plus 500 plus the 120 ns to the capture; the reference time is the stamp plus the
/// delay.
#[test]
fn in_the_exchange_a_frame_is_expected_at_its_delay_and_500_ns() {
    for (late, ticks, increment) in [(23, 23, 4), (0, 0, 6)] {
        let mut device = device_in_exchange();
        for cycle in 0..16 {
            let mut times = captured(cycle);
            times.sof_ns += late;
            let frame = master_frame(cycle, 7);
            let output = device.hear_exchange(&frame, times).unwrap();
            assert_eq!(
                (output.reference_ns, output.cycle),
                (u32::from((41_000 + 4000 * cycle) as u16) + 76, u64::from(cycle))
            );
            assert_eq!((output.trigger_ns, output.age_ns(times.counter_ns)), (41_000 + 4000 * cycle, 2500 + 196));
            // A sum of 0 counts as positive.
            let want = if cycle == 15 { Correction::Rate { increment, ticks } } else { Correction::None };
            assert_eq!(output.correction, want);
        }
    }
}

/// A damaged master frame is told in the next device frame, and not in the one after it.
#[test]
fn an_error_is_told_once() {
    let mut device = device_in_exchange();
    device.hear_exchange(&master_frame(0, 7), captured(0)).unwrap();
    let mut frame = master_frame(1, 7);
    frame[3] ^= 1;
    let mut told = Vec::new();
    for _ in 0..3 {
        told.push(device.answer([0; 3]).unwrap().status.bits());
        if told.len() == 1 {
            assert!(matches!(device.hear_exchange(&frame, captured(1)), Err(Error::BadCrc8 { .. })));
        }
    }
    // LAST; LAST and ERROR; LAST.
    assert_eq!(told, [0x01, 0x05, 0x01]);
}
