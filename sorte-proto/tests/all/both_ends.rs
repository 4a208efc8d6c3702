//! Master and devices on a simulated line.

mod line;

use crate::common::capture_ns;
use proptest::prelude::*;
use sorte_proto::Link;
use sorte_proto::device::{self, Device};
use sorte_proto::master::{self, Action, Master};
use sorte_proto::timing::Slots;
use sorte_proto::{Discovery, Entry, Error, ErrorClass, FrameType, Parameters, Tally};

use line::Line;

#[test]
fn lines_of_all_lengths_start_and_exchange() {
    for devices in [1, 2, 3, 4] {
        let mut line = Line::new((0..devices).map(|k| 20 + 37 * k).collect());
        let first = line.start_up().unwrap();
        assert_eq!(u64::from(line.master.network().devices()), devices);
        for (k, device) in line.devices.iter().enumerate() {
            let place = device.assignment().unwrap();
            assert_eq!((usize::from(place.address.get()), usize::from(place.out_offset)), (k + 1, 4 * k));
            assert_eq!(device.parameters(), Some(Parameters::CNC));
            assert_eq!(device.state(), device::State::Exchange);
            // The clocks agree with the master's, but for the rounding of the line delays: 8 ns a device.
            let master_ns = (first.0 - line.master.epoch_ns()) as u32;
            let error = master_ns.abs_diff(line.counters[k].at(first.0));
            assert!(error <= 8 * k as u32 + 1, "device {}: {error} ns", k + 1);
        }
        assert_eq!(line.cycles(first, 200), None);
        assert_eq!(line.master.counters().timing_errors, 0);
    }
}

/// Back to back at the master, from 585 ns on.
const SLOTS: Slots = Slots::Raster { first_ns: 585, slot_ns: 880 };

/// 254 devices of which each has 85 ns of cable in front of it, and a byte of process data.
fn full_line(config: master::Config) -> Line {
    let mut line = Line::new(vec![85; 254]);
    line.master = Master::new(config.with_sync_frames(64).with_slots(SLOTS));
    line.cycle_ns = config.cycle_ns;
    line.master.set_link(Link::Up);
    let entry = Entry { input: 4, output: 1 };
    let config =
        device::Config::new().with_output_len(None).with_lengths(entry).with_slots(SLOTS).with_clock_average(1);
    line.devices.fill(Device::new(config));
    line.plug(254);
    line
}

#[test]
fn a_line_that_the_delay_field_cannot_hold_is_refused_with_its_length() {
    let mut line = full_line(master::Config::new().with_cycle_ns(224_000));
    // 253 hops of 355 + 85 ns, less what the measurement of a hop loses, and the cable of the first.
    let delay_ns = match line.start_up() {
        Err(Error::LineTooLong { delay_ns }) => delay_ns,
        other => panic!("{other:?}"),
    };
    assert!((253 * 430..=253 * 440 + 85).contains(&delay_ns), "{delay_ns}");
}

#[test]
fn a_cycle_that_is_too_short_names_the_device_that_breaks_it() {
    let mut line = full_line(master::Config::new().with_cycle_ns(40_000).with_long_line(true));
    // The master frame of 261 bytes ends at 500 + 20,880 + 85 + 440 (a - 1) ns: above 40 us from a = 44 on, with 1 ns a hop
    // lost in the measurement.
    assert_eq!(line.start_up(), Err(Error::CycleTooShort { device: 44, needs_ns: 40_342 }));
    let mut line = Line::new(vec![10; 5]);
    // The fifth device has the send time of the fourth, and the measurement makes 4 ns of each cable: 355 + 4 - 640 ns behind its
    // frame. Six sigma of four ports with 1.443 ns each are 24.5 ns.
    assert_eq!(line.start_up(), Err(Error::GapTooShort { device: 5, gap_ns: -281, needs_ns: 25 }));
}

/// The clocks agree at the end of the start-up and after five hundred cycles, but for what the published measurement of
/// the line delay loses: up to 8 ns a device.
#[test]
fn a_line_of_254_devices_keeps_its_time() {
    let mut line = full_line(master::Config::new().with_cycle_ns(224_000).with_long_line(true));
    let first = line.start_up().unwrap();
    assert_eq!(line.master.network().devices(), 254);
    assert_eq!(line.master.output_len(), 254);
    assert_eq!(line.devices.last().unwrap().assignment().unwrap().out_offset, 253);
    assert!(line.devices.last().unwrap().delay_ns().unwrap() > 65_535);
    let check = |line: &Line, now_ns: u64| {
        for (k, counter) in line.counters.iter().enumerate() {
            let master_ns = now_ns - line.master.epoch_ns();
            let error = i64::from(counter.at(now_ns).wrapping_sub(master_ns as u32) as i32);
            assert!((-8 * k as i64 - 1..=1).contains(&error), "device {}: {error} ns", k + 1);
        }
    };
    check(&line, first.0);
    assert_eq!(line.cycles(first, 500), None);
    check(&line, line.now_ns);
    let slots: Vec<u32> = line.devices.iter().map(|device| device.send_time_ns().unwrap()).collect();
    // 585 + 880 (a - 1) ns, less the way: back to back at the master.
    for (k, slot) in slots.iter().enumerate() {
        let arrival = i64::from(*slot) + 85 + 440 * k as i64;
        assert!((arrival - (585 + 880 * k as i64)).abs() <= 8 * k as i64 + 1, "device {}", k + 1);
    }
}

#[test]
fn the_axes_may_come_to_rest_before_the_master_starts_again() {
    let mut line = Line::new(vec![50; 2]);
    line.master = Master::new(master::Config::new().with_sync_frames(64).with_stop_cycles(1000));
    line.master.set_link(Link::Up);
    for halt in [None, Some(30)] {
        line.plug(2);
        let mut first = line.start_up().unwrap();
        assert_eq!(line.cycles(first, 10), None);
        line.plug(1);
        let (mut stopping, mut error) = (0, None);
        for _ in 0..2000 {
            let output = vec![0; usize::from(line.master.output_len())];
            line.exchange(&output, first.0, first.1);
            if halt == Some(stopping) {
                line.master.halted();
            }
            loop {
                match line.master.poll(line.now_ns) {
                    Action::Wait { until_ns } => line.now_ns = until_ns,
                    Action::Exchange { at_ns, time_stamp, stop, .. } => {
                        assert!(stop || stopping == 0);
                        stopping += u32::from(stop);
                        first = (at_ns, time_stamp);
                        break;
                    }
                    Action::Restart { error: why } => {
                        error = Some(why);
                        break;
                    }
                    Action::Send { .. } => panic!("start-up in the exchange"),
                }
            }
            if error.is_some() {
                break;
            }
        }
        assert_eq!(error, Some(Error::TopologyChanged { address: 1 }));
        assert_eq!(stopping, halt.unwrap_or(1000));
        line.now_ns += 30_000_000;
        line.wait(line.now_ns + 1);
    }
}

#[test]
fn a_master_that_fails_again_and_again_stays_in_error() {
    let mut line = Line::new(vec![50; 2]);
    line.master = Master::new(master::Config::new().with_max_failures(3));
    line.master.set_link(Link::Up);
    line.plug(0);
    for n in 1..=3 {
        assert!(line.start_up().is_err());
        assert_eq!(line.master.state() == master::State::Error, n == 3);
    }
    assert_eq!(line.master.poll(u64::MAX - 1), Action::Wait { until_ns: u64::MAX });
    assert_eq!(line.master.hear(&[], 0), Err(Error::WrongState));
    line.master.disable();
    line.master.enable();
    line.plug(2);
    assert!(line.start_up().is_ok());
}

#[test]
fn devices_that_fall_silent_are_named_and_the_rest_starts_again() {
    let mut line = Line::new(vec![50; 4]);
    let first = line.start_up().unwrap();
    assert_eq!(line.cycles(first, 10), None);
    line.plug(2);
    let error = line.cycles(line.next, 100).unwrap();
    // Device 2 is the last one now and says so.
    assert!(matches!(error, Error::TopologyChanged { address: 2 }), "{error}");
    let first = line.start_up().unwrap();
    assert_eq!(line.master.network().devices(), 2);
    assert_eq!(line.cycles(first, 10), None);
    assert_eq!(line.master.counters().retrains, 1);
    // Back in: the master does not see them until it starts again.
    line.plug(4);
    let error = line.cycles(line.next, 100).unwrap();
    assert!(matches!(error, Error::TopologyChanged { .. }), "{error}");
    let first = line.start_up().unwrap();
    assert_eq!(line.master.network().devices(), 4);
    // Its processor starts again; the ports forward meanwhile.
    line.devices[1].reset();
    assert_eq!(line.cycles(first, 100), Some(Error::DevicesMissing { first: 2, count: 1, cycles: 3 }));
    assert!(line.start_up().is_ok());
}

#[test]
fn every_wait_ends_with_what_was_missing() {
    let mut line = Line::new(vec![50; 2]);
    line.plug(0);
    assert_eq!(line.start_up(), Err(Error::NoAnswer { sent: FrameType::Discovery, frame: 9 }));
    line.plug(2);
    let first = line.start_up().unwrap();
    line.plug(0);
    let error = line.cycles(first, 100);
    assert_eq!(error, Some(Error::DevicesMissing { first: 1, count: 2, cycles: 3 }));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// A bit flip anywhere in a start-up frame is found, nothing of it is used, and in the end the line runs.
    #[test]
    fn a_flip_in_the_start_up_only_costs_time(frame in 0u32..100, bit: usize) {
        let mut line = Line::new(vec![50; 3]);
        let mut sent = 0;
        let mut restarts = 0;
        let first = loop {
            match line.master.poll(line.now_ns) {
                Action::Wait { until_ns } => line.wait(until_ns),
                Action::Restart { .. } => restarts += 1,
                Action::Exchange { at_ns, time_stamp, .. } => break (at_ns, time_stamp),
                Action::Send { at_ns, frame: outgoing } => {
                    line.flip = (sent == frame).then_some(bit);
                    sent += 1;
                    let mut buffer = [0; Discovery::LEN];
                    let len = outgoing.emit_into(&mut buffer).unwrap();
                    if let Some((answer, sof_ns)) = line.carry(&buffer[..len], at_ns) {
                        let _: Result<_, _> = line.master.hear(&answer, sof_ns + capture_ns(&outgoing));
                    }
                }
            }
            prop_assert!(restarts < 3);
        };
        prop_assert_eq!(line.master.network().devices(), 3);
        prop_assert_eq!(line.cycles(first, 5), None);
    }

    /// Frames and answers that are lost, come twice or again later, and a master that is polled late: in the end the line runs
    /// with the right cables and clocks, or it has not begun.
    #[test]
    fn whatever_happens_in_the_start_up_the_line_and_the_clocks_are_right(events in proptest::collection::vec(0u8..9, 0..400)) {
        let mut line = Line::new(vec![50; 3]);
        let mut events = events.into_iter();
        let mut old: Option<(Vec<u8>, u64)> = None;
        let mut restarts = 0;
        let first = loop {
            match line.master.poll(line.now_ns) {
                Action::Wait { until_ns } => line.wait(until_ns),
                Action::Restart { .. } => restarts += 1,
                Action::Exchange { at_ns, time_stamp, .. } => break (at_ns, time_stamp),
                Action::Send { at_ns, frame } => {
                    prop_assert!(at_ns >= line.now_ns);
                    let event = events.next().unwrap_or_default();
                    let mut buffer = [0; Discovery::LEN];
                    let len = frame.emit_into(&mut buffer).unwrap();
                    let new = (event != 1).then(|| line.carry(&buffer[..len], at_ns)).flatten();
                    let new = new.map(|(answer, sof_ns)| (answer, sof_ns + capture_ns(&frame)));
                    let heard = match event {
                        2 => vec![],
                        3 => vec![new.clone(), new.clone()],
                        4 => vec![old.clone(), new.clone()],
                        5 => vec![new.clone(), old.clone()],
                        _ => vec![new.clone()],
                    };
                    for (answer, sof_ns) in heard.into_iter().flatten() {
                        let _: Result<_, _> = line.master.hear(&answer, sof_ns);
                    }
                    old = new.or(old);
                    if event == 6 {
                        line.wait(line.now_ns + 7_777);
                    }
                }
            }
            prop_assert!(restarts < 40);
        };
        prop_assert_eq!((line.master.network().devices(), line.master.line_delay().checked()), (3, Ok(50)));
        for (k, counter) in line.counters.iter().enumerate() {
            let error = ((first.0 - line.master.epoch_ns()) as u32).abs_diff(counter.at(first.0));
            prop_assert!(error <= 8 * k as u32 + 1, "device {}: {} ns", k + 1, error);
            prop_assert_eq!(line.devices[k].state(), device::State::Exchange);
        }
        prop_assert_eq!(line.cycles(first, 5), None);
    }

    /// A flip in the exchange: every device refuses the frame, unless it hit the low bits of the time stamp.
    #[test]
    fn a_flip_in_the_exchange_is_never_used(bit in 0usize..168, output: [u8; 16]) {
        let mut line = Line::new(vec![50; 4]);
        let (mut at_ns, mut stamp) = line.start_up().unwrap();
        let mut taken = Vec::new();
        for cycle in 0..3 {
            line.flip = (cycle == 1).then_some(bit);
            taken.push(line.exchange(&output, at_ns, stamp));
            line.now_ns = at_ns + 4000;
            let Action::Exchange { at_ns: at, time_stamp, .. } = line.master.poll(line.now_ns) else { panic!() };
            (at_ns, stamp) = (at, time_stamp);
        }
        for (k, data) in taken.swap_remove(1).into_iter().enumerate() {
            if bit < 19 * 8 {
                prop_assert_eq!(data.map_err(Error::class), Err(ErrorClass::BadCrc8));
                prop_assert_eq!(line.devices[k].counters().crc_errors, 1);
            } else if bit < 20 * 8 {
                // 128 ns of the time stamp and less are within the window.
                prop_assert_eq!(data, Ok(output[4 * k..4 * k + 4].to_vec()));
            } else {
                prop_assert_eq!(data.map_err(Error::class), Err(ErrorClass::ImplausibleTimeStamp));
                prop_assert_eq!(line.devices[k].counters().master.stale, 1);
            }
        }
        // The device frames of the cycle after have reported it.
        let told = if (19 * 8..20 * 8).contains(&bit) { 0 } else { 4 };
        prop_assert_eq!(line.master.counters().device_errors, told);
        prop_assert_eq!(line.master.counters().frames, Tally::default());
    }
}
