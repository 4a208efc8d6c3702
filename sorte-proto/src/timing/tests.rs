use std::string::ToString;

use super::*;

fn cnc(devices: u8, line_delays_ns: &[u16]) -> Timing<'_> {
    Timing::new(line_delays_ns, devices)
}

fn address(address: u8) -> DeviceAddress {
    DeviceAddress::new(address).unwrap()
}

/// The table of the published firmware and the rule behind it, at 85 ns of cable. The table puts the frames of the devices at the
/// master 115, 175 and 155 ns and one cable apart; the rule puts all of them 240 ns apart.
#[test]
fn the_published_table_and_its_rule() {
    let line = cnc(4, &[85]);
    let published = line.with_slots(Some(Slots::Published));
    for (device, table, rule) in [(1, 500, 500), (2, 900, 940), (3, 1360, 1380), (4, 1800, 1820)] {
        assert_eq!(published.send_time_ns(address(device)), Some(table));
        assert_eq!(line.send_time_ns(address(device)), Some(rule));
        assert_eq!(Slots::rule(85).send_ns(address(device), 85 + 440 * u32::from(device - 1)), rule);
    }
    assert_eq!((line.send_time_ns(address(5)), cnc(0, &[]).send_time_ns(address(1))), (None, None));
    // 3505 ns and four cables: 123 ns each is the last that 4 us hold.
    assert_eq!(published.budget().device_frames_at_master_ns, 3505 + 4 * 85);
    for (cable, fits) in [(0, true), (85, true), (123, true), (124, false), (148, false)] {
        let delays = [cable];
        let line = cnc(4, &delays).with_slots(Some(Slots::Published));
        assert_eq!(line.misfit(4000).is_none(), fits, "{cable}");
    }
    let misfit = cnc(4, &[124]).with_slots(Some(Slots::Published)).misfit(4000);
    let want = Misfit { device: 4, limit: Limit::DeviceFrames, needs_ns: 4001, has_ns: 4000 };
    assert_eq!(misfit, Some(want));
    // By the rule the way out is the limit, at 3405 ns and four cables.
    assert_eq!(
        (cnc(4, &[148]).misfit(4000), cnc(4, &[149]).misfit(4000).map(|m| m.limit)),
        (None, Some(Limit::MasterFrame))
    );
}

/// The fifth device of the table has the send time of the fourth.
#[test]
fn the_published_table_is_for_four_devices() {
    let misfit = cnc(5, &[85]).with_slots(Some(Slots::Published)).misfit(8000);
    // 355 + 85 - 640.
    assert_eq!(misfit.map(|m| (m.device, m.limit, m.has_ns)), Some((5, Limit::Gap, -200)));
}

/// Above 525 ns of cable the rule asks the devices to send earlier and earlier.
#[test]
fn a_cable_longer_than_a_slot_asks_a_device_to_send_before_its_cycle() {
    assert_eq!(cnc(254, &[525]).misfit(1_000_000), None);
    // 500 - 75 (a - 1) ns.
    let misfit = cnc(254, &[600]).misfit(1_000_000).unwrap();
    assert_eq!((misfit.device, misfit.limit, misfit.needs_ns), (8, Limit::SendTime, 25));
    assert_eq!(misfit.to_string(), "device 8 would have to send 25 ns before the cycle");
    // 500 - 100 (a - 1) ns: the sixth sends at 0.
    assert_eq!(cnc(6, &[625]).misfit(1_000_000), None);
    let misfit = cnc(7, &[625]).misfit(1_000_000);
    assert_eq!(misfit, Some(Misfit { device: 7, limit: Limit::SendTime, needs_ns: 100, has_ns: 0 }));
}

/// 3405 ns and four cables on the way out, 3780 and one on the way back: at 125 ns both are 3905 ns. Numbers that no
/// line has stay what they are, as far as there is room for them.
#[test]
fn the_way_back_is_named_where_both_are_too_long() {
    let line = cnc(4, &[125]);
    assert_eq!((line.budget().limit(), line.misfit(3905)), (Limit::DeviceFrames, None));
    let want = Misfit { device: 4, limit: Limit::DeviceFrames, needs_ns: 3905, has_ns: 3904 };
    assert_eq!(line.misfit(3904), Some(want));
    let slots = Slots::Raster { first_ns: u32::MAX, slot_ns: u32::MAX };
    let misfit = cnc(1, &[0]).with_slots(Some(slots)).misfit(u32::MAX);
    let want = Misfit { device: 1, limit: Limit::DeviceFrames, needs_ns: u32::MAX, has_ns: i32::MAX };
    assert_eq!(misfit, Some(want));
}

/// 240 ns are six sigma of 16 ns a port for 4 devices, of 7.3 for 16, of 3.6 for 64 and of 1.8 for 254.
#[test]
fn jitter_decides_how_long_a_line_may_be() {
    for (devices, good_ps, bad_ps) in [(4, 16_320, 16_340), (16, 7302, 7305), (64, 3563, 3565), (254, 1777, 1779)] {
        assert_eq!(cnc(devices, &[85]).with_jitter_ps(good_ps).misfit(1_000_000), None, "{devices}");
        let misfit = cnc(devices, &[85]).with_jitter_ps(bad_ps).misfit(1_000_000).unwrap();
        assert_eq!((misfit.device, misfit.limit, misfit.has_ns), (devices, Limit::Gap, 240));
    }
    // Ports that re-time to 25 MHz: 40 ns / sqrt(12) carry seven devices. The published hardware carries 254.
    let misfit = cnc(254, &[85]).with_jitter_ps(11_547).misfit(1_000_000);
    assert_eq!(misfit.map(|m| m.device), Some(8));
    assert_eq!(cnc(254, &[85]).misfit(1_000_000), None);
}

#[test]
fn four_devices_fit_four_microseconds_and_five_do_not() {
    assert!(cnc(4, &[85]).budget().fits(CNC_CYCLE_NS));
    assert!(!cnc(5, &[0]).budget().fits(CNC_CYCLE_NS));
    assert_eq!(cnc(4, &[0]).budget().limit(), Limit::DeviceFrames);
    let long = cnc(4, &[200]).budget();
    assert_eq!((long.limit(), long.min_cycle_ns()), (Limit::MasterFrame, 4205));
}

#[test]
fn the_device_that_breaks_the_cycle_is_named() {
    assert_eq!(cnc(4, &[85]).misfit(4000), None);
    // 500 + 4 x 880 + 640 + 85: the fifth device's frame at the master.
    let misfit = cnc(5, &[85]).with_output_len(16).misfit(4000);
    assert_eq!(misfit, Some(Misfit { device: 5, needs_ns: 4745, limit: Limit::DeviceFrames, has_ns: 4000 }));
    // 500 + 23 x 80 + 4 x 200 + 3 x 355: the master frame at the fourth.
    let misfit = cnc(4, &[200]).misfit(4000);
    assert_eq!(misfit, Some(Misfit { device: 4, needs_ns: 4205, limit: Limit::MasterFrame, has_ns: 4000 }));
    for devices in 1..=254 {
        let line = cnc(devices, &[85]);
        let cycle = line.cnc_cycle_ns();
        assert!(cycle % 4000 == 0 && line.misfit(cycle).is_none());
        assert!(cycle == 4000 || line.misfit(cycle - 4000).is_some());
        assert_eq!(line.misfit(line.budget().min_cycle_ns() - 1).map(|m| m.needs_ns > 0), Some(true));
    }
    assert_eq!(
        (cnc(4, &[85]).cnc_cycle_ns(), cnc(10, &[85]).cnc_cycle_ns(), cnc(254, &[85]).cnc_cycle_ns()),
        (4000, 12_000, 224_000)
    );
}

#[test]
fn ten_devices_fit_ten_microseconds() {
    assert_eq!(cnc(10, &[0]).budget().min_cycle_ns(), 9060);
    assert_eq!(cnc(11, &[0]).budget().min_cycle_ns(), 9940);
    assert_eq!(cnc(254, &[0]).budget().min_cycle_ns(), 223_780);
}

#[test]
fn data_act_in_the_same_cycle_only_with_sixteen_bytes() {
    for devices in 1..=4 {
        let all = cnc(devices, &[0]).with_output_len(16);
        assert!(all.budget().same_cycle(2000));
        assert_eq!(cnc(devices, &[0]).budget().same_cycle(2000), devices != 2);
    }
}

/// The frames of all devices reach the master one slot after the other, whatever the cables.
/// The shortest cycle fits, one of a nanosecond less does not; data may be taken up to either end of a frame, and not at it.
#[test]
fn exactly_as_long() {
    let line = cnc(4, &[85]);
    let budget = line.budget();
    let least = budget.min_cycle_ns();
    assert_eq!((budget.fits(least), budget.fits(least - 1)), (true, false));
    assert_eq!((line.misfit(least), line.misfit(least - 1).is_some()), (None, true));
    let (first, last) = (budget.master_frame_at_first_ns, budget.master_frame_at_last_ns);
    assert_eq!([first - 1, first, last, last + 1].map(|ns| budget.same_cycle(ns)), [true, false, false, true]);
}

#[test]
fn device_frames_arrive_back_to_back() {
    let delays = [30, 200, 85, 0, 450, 7];
    let line = cnc(9, &delays);
    for address in 1..=9 {
        let sent = line.send_time_ns(self::address(address)).unwrap();
        let cables: u32 = (0..usize::from(address)).map(|k| u32::from(*delays.get(k).unwrap_or(&7))).sum();
        let arrival = sent + i64::from(cables) + 355 * i64::from(address - 1);
        assert_eq!(arrival, 500 + 30 + i64::from(address - 1) * 880);
    }
    let last = 500 + 30 + 8 * 880 + 640;
    assert_eq!(line.budget().device_frames_at_master_ns, last);
}
