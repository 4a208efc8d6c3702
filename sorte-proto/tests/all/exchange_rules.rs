//! The IO exchange at each end: which frames count, in which cycle, and who counts what was lost, doubled, late or stale.

use crate::common::{answer, capture_ns, device_frame, device_in};
use sorte_proto::device::{Action, Config, Device, FrameTimes, PortId, State};
use sorte_proto::master::{self, Heard, Master};
use sorte_proto::timing::Slots;
use sorte_proto::{
    Correction, Discovery, Error, ErrorClass, Link, Parameters, Place, Status, Sync, Tally, drv8711,
    emit_master_frame_into,
};

/// Common time at the start of cycle 0: the last SYNC frame was triggered at 30,500 ns, and 10 us later it begins.
const ZERO_NS: u32 = 40_500;

/// The only device of a line of 76 ns, in the exchange of 4 us.
fn device() -> Device {
    let mut device = device_in(State::Sync, true, Parameters::CNC);
    let times = FrameTimes { sof_ns: 30_856, counter_ns: 30_856, now_ns: 0 };
    assert_eq!(device.hear(PortId::A, &mut Sync::of_master(30_500, 76, Place::Last).emit(), times).result, Ok(()));
    assert_eq!(device.state(), State::Exchange);
    device
}

fn frame(cycle: u32) -> [u8; 21] {
    let mut frame = [0; 21];
    emit_master_frame_into(&[cycle as u8; 16], (ZERO_NS + 4000 * cycle + 500) as u16, &mut frame).unwrap();
    frame
}

/// 500 ns and the cable into the cycle, and 120 ns more to the capture.
fn captured(cycle: u32, off_ns: i32) -> FrameTimes {
    let sof_ns = (ZERO_NS + 4000 * cycle + 500 + 76 + 120).wrapping_add_signed(off_ns);
    FrameTimes { sof_ns, counter_ns: sof_ns + 2500, now_ns: sof_ns.into() }
}

/// Everything that the device wants up to this time, with the times at which it wanted it.
fn until(device: &mut Device, from_ns: u32, until_ns: u32) -> Vec<(u32, Action)> {
    let (mut now, mut actions) = (from_ns, Vec::new());
    loop {
        match device.poll(now, now.into()) {
            Action::Wait { until_ns: next } if next > until_ns => return actions,
            Action::Wait { until_ns: next } => now = next,
            action => actions.push((now, action)),
        }
    }
}

/// On a line of more than ten devices the answer to the last SYNC is still on its way when the first slot comes.
#[test]
fn a_device_is_silent_until_its_first_master_frame() {
    let mut device = device();
    assert_eq!(device.answer([0; 3]), None);
    let silent = until(&mut device, ZERO_NS - 1000, ZERO_NS + 20_000);
    let starts: Vec<u32> = silent.iter().map(|(now, _)| *now).collect();
    assert!(silent.iter().all(|(_, action)| matches!(action, Action::CycleStart { .. })), "{silent:?}");
    assert_eq!(starts, [40_500, 44_500, 48_500, 52_500, 56_500, 60_500]);
    assert_eq!(device.counters().master, Tally::default(), "nobody has sent anything");
    device.hear_exchange(&frame(5), captured(5, 0)).unwrap();
    assert!(device.answer([0; 3]).is_some());
}

/// The payload of the published application: STATUS of the driver, and the steps from their low byte on.
#[test]
fn steps_that_are_not_known_are_sent_with_error() {
    let mut device = device();
    let driver = drv8711::Status::from_bits_retain(0x21);
    assert_eq!(device.answer_ordered(driver, Some(0x1234)), None, "before the first master frame");
    device.hear_exchange(&frame(5), captured(5, 0)).unwrap();
    let answers = [Some(0x1234), None, Some(0)].map(|ordered| device.answer_ordered(driver, ordered).unwrap());
    assert_eq!(answers.map(|answer| answer.payload), [[0x21, 0x34, 0x12], [0x21, 0, 0], [0x21, 0, 0]]);
    assert_eq!(answers.map(|answer| answer.status.contains(Status::ERROR)), [false, true, false]);
}

/// Slot, cycle and close of the published device at 4 us: 500 ns into the cycle, given out 400 ns before.
#[test]
fn cycles_begin_and_own_frames_leave_at_their_times() {
    let mut device = device();
    device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
    let mut now = ZERO_NS + 3500;
    for cycle in 1..4 {
        let start_ns = ZERO_NS + 4000 * cycle;
        let actions = until(&mut device, now, start_ns + 600);
        now = start_ns + 700;
        let cycle_start = Action::CycleStart { cycle: cycle.into(), start_ns };
        let send = Action::Send { cycle: cycle.into(), at_ns: start_ns + 500 };
        let begin = actions.iter().position(|(at, action)| (*at, *action) == (start_ns, cycle_start)).unwrap();
        assert_eq!(actions[begin + 1], (start_ns + 100, send));
        device.hear_exchange(&frame(cycle), captured(cycle, 0)).unwrap();
    }
    assert_eq!(device.counters().master, Tally::default());
}

/// A frame that is held up is late if its stamp is that of the cycle, give or take the window of 250 ns, and stale beyond.
#[test]
fn late_or_stale_by_the_stamp() {
    let stamped = |off_ns: i32| {
        let mut device = device();
        device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
        let mut bytes = [0; 21];
        let stamp = (ZERO_NS + 500).wrapping_add_signed(off_ns) as u16;
        emit_master_frame_into(&[0; 16], stamp, &mut bytes).unwrap();
        assert!(device.hear_exchange(&bytes, captured(0, 1000)).is_err());
        (device.counters().master.late, device.counters().master.stale)
    };
    assert_eq!([stamped(0), stamped(250), stamped(-250)], [(1, 0); 3]);
    assert_eq!([stamped(251), stamped(-251)], [(0, 1); 2]);
}

/// The frames of a start-up, as the last device hears them.
fn start_up() -> [Vec<u8>; 5] {
    [
        Discovery::request(Place::Inner).emit().to_vec(),
        Discovery::request(Place::Last).emit().to_vec(),
        sorte_proto::Param::request(Parameters::CNC, Place::Last).emit().to_vec(),
        sorte_proto::DelayReq::of_master(Place::Last).emit().to_vec(),
        Sync::of_master(30_500, 76, Place::Last).emit().to_vec(),
    ]
}

/// With cycles of 10 ms a device waits for six frames and two more, not for the 20 ms of the start-up.
#[test]
fn long_cycles_are_waited_for() {
    let mut device = Device::new(Config::new().with_cycle_ns(Some(10_000_000)));
    device.set_links(Link::Up, Link::Down);
    for mut frame in start_up() {
        assert_eq!(device.hear(PortId::A, &mut frame, captured(0, 0)).result, Ok(()));
    }
    let now_ns = captured(0, 0).now_ns;
    let missed = u64::from(Config::new().missed_frames) + 2;
    assert_ne!(device.poll(ZERO_NS, now_ns + missed * 10_000_000), Action::Restart);
    assert_eq!(device.poll(ZERO_NS, now_ns + missed * 10_000_000 + 1), Action::Restart);
}

/// The cycle comes with PARAM: 31.25 us here; or from the settings, for the published master says 10 us and runs at 4.
#[test]
fn param_sets_the_cycle() {
    for (config, told, want) in [
        (Config::new(), 31_250, 31_250),
        (Config::new().with_cycle_ns(Some(4000)), 10_000, 4000),
        // Nothing that makes sense.
        (Config::new(), 0, 1000),
        (Config::new(), u32::MAX, 1_000_000_000),
    ] {
        let mut device = Device::new(config);
        device.set_links(Link::Up, Link::Down);
        let parameters = Parameters { cycle_time_ns: told, ..Parameters::CNC };
        for mut frame in [
            Discovery::request(Place::Inner).emit().to_vec(),
            Discovery::request(Place::Last).emit().to_vec(),
            sorte_proto::Param::request(parameters, Place::Last).emit().to_vec(),
            sorte_proto::DelayReq::of_master(Place::Last).emit().to_vec(),
            Sync::of_master(30_500, 76, Place::Last).emit().to_vec(),
        ] {
            let times = FrameTimes { sof_ns: 30_856, counter_ns: 30_856, now_ns: 0 };
            assert_eq!(device.hear(PortId::A, &mut frame, times).result, Ok(()));
        }
        let mut starts = Vec::new();
        let mut now = ZERO_NS;
        while starts.len() < 2 {
            match device.poll(now, 0) {
                Action::CycleStart { start_ns, .. } => starts.push(start_ns),
                Action::Wait { until_ns } => now = until_ns,
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(starts[1] - starts[0], want);
    }
}

/// A cycle without a frame is told, counted, and reported by ERROR in the frame after it; after the sixth the device starts again.
#[test]
fn a_lost_master_frame_leaves_its_trace() {
    let mut device = device();
    device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
    let status = |device: &mut Device| device.answer([0; 3]).map(|answer| answer.status.bits());
    assert_eq!(status(&mut device), Some(0x01));
    let mut now = ZERO_NS + 3999;
    for cycle in 1..=6 {
        // Nobody hands it over any more: 500 + 76 + 23 x 80 + 1000 ns into its cycle.
        let closes = ZERO_NS + 4000 * cycle + 3416;
        let early = until(&mut device, now, closes - 1);
        assert!(!early.iter().any(|(_, action)| matches!(action, Action::Lost { .. })), "{early:?}");
        assert_eq!(device.counters().master.missed, cycle - 1);
        let late = until(&mut device, closes, closes);
        now = closes;
        if cycle < 6 {
            assert_eq!(late, [(closes, Action::Lost { cycle: cycle.into() })]);
            assert_eq!((status(&mut device), status(&mut device)), (Some(0x05), Some(0x01)), "told once");
            assert_eq!(device.missed_frames(), cycle as u8);
        } else {
            assert_eq!(late, [(closes, Action::Restart)]);
        }
    }
    assert_eq!((device.state(), device.counters().retrains, device.counters().master.missed), (State::Idle, 1, 6));
}

/// A frame that comes again, a held up one, one of a cycle before, and one that claims to be of this cycle at another time: none is
/// used, none moves the clock, each is counted and told.
#[test]
fn only_the_frame_of_this_cycle_counts_and_only_once() {
    let run = |cycle: u32, of: u32, off_ns: i32| {
        let mut device = device();
        device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
        let result = device.hear_exchange(&frame(of), captured(cycle, off_ns)).map(|output| output.cycle);
        let told = device.answer([0; 3]).unwrap().status.contains(Status::ERROR);
        (result.map_err(Error::class), device.counters().master, told)
    };
    let none = Tally::default();
    assert_eq!(run(1, 1, 0), (Ok(1), none, false));
    // 250 ns is its time, 251 is not.
    assert_eq!((run(1, 1, 250), run(1, 1, -250)), ((Ok(1), none, false), (Ok(1), none, false)));
    for off in [251, -251, 1000, -1000, 1999] {
        let (result, tally, told) = run(1, 1, off);
        // Cycle 0 is the one that is awaited until its time is over, so the stamp of cycle 1 is not its own.
        assert_eq!((result, tally.late + tally.stale, told), (Err(ErrorClass::OutsideWindow), 1, true), "{off}");
    }
    // The same frame again, at once and 6 us later, which is half a cycle off.
    assert_eq!(run(0, 0, 10), (Err(ErrorClass::Doubled), Tally { doubled: 1, ..none }, true));
    assert_eq!(run(0, 0, 6000), (Err(ErrorClass::OutsideWindow), Tally { late: 1, ..none }, true));
    // Exactly a cycle late: its time stamp tells.
    let (result, tally, told) = run(1, 0, 0);
    assert_eq!((result, tally, told), (Err(ErrorClass::ImplausibleTimeStamp), Tally { stale: 1, ..none }, true));
    // Before cycle 0.
    let mut device = device();
    device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
    let old = FrameTimes { sof_ns: ZERO_NS - 4000 + 696, ..captured(0, 0) };
    assert_eq!(device.hear_exchange(&frame(0), old).map(|_| ()), Err(Error::CycleOver));
    assert_eq!(device.counters().master, Tally { stale: 1, ..none });
}

/// The clock takes nothing from frames that do not count.
#[test]
fn stale_frames_do_not_steer_the_clock() {
    let mut device = device();
    for cycle in 0..15 {
        let correction = device.hear_exchange(&frame(cycle), captured(cycle, 0)).unwrap().correction;
        assert_eq!(correction, Correction::None);
        // Again, 200 ns later: within the window.
        assert!(device.hear_exchange(&frame(cycle), captured(cycle, 200)).is_err());
    }
    let correction = device.hear_exchange(&frame(15), captured(15, 0)).unwrap().correction;
    assert_eq!(correction, Correction::Rate { increment: 6, ticks: 0 });
}

/// A damaged frame has come, so the watchdog is content; its data are lost all the same, and the next frame says so: a bit is
/// wrong, the end is missing, there is something behind it, or it is a device's.
#[test]
fn a_damaged_frame_is_lost_and_not_missed() {
    let [flipped, cut, long, foreign] = [frame(1); 4].map(|bytes| bytes.to_vec());
    let flipped = flipped.iter().enumerate().map(|(k, byte)| if k == 4 { byte ^ 1 } else { *byte }).collect();
    let long = [&long[..], &[0]].concat();
    // SA 1 in front, and the check that belongs to it.
    let body = [&[1], &foreign[1..18]].concat();
    let foreign = [&body[..], &[sorte_proto::crc8(&body)], &foreign[19..]].concat();
    for (damaged, crc, format) in [(flipped, 1, 0), (cut[..20].to_vec(), 0, 1), (long, 0, 1), (foreign, 0, 1)] {
        let mut device = device();
        device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
        let error = device.hear_exchange(&damaged, captured(1, 0)).map(|_| ()).unwrap_err();
        let statuses = [0, 1].map(|_| device.answer([0; 3]).unwrap().status.bits());
        assert_eq!(statuses, [0x05, 0x01], "{error}: told once");
        let actions = until(&mut device, ZERO_NS + 4000, ZERO_NS + 7990);
        assert!(actions.iter().any(|(_, action)| *action == Action::Lost { cycle: 1 }), "{actions:?}");
        let counters = device.counters();
        assert_eq!((device.missed_frames(), counters.master), (0, Tally::default()), "{error}");
        assert_eq!((counters.crc_errors, counters.format_errors), (crc, format), "{error}");
    }
}

/// What is there is taken before the clock is asked: two cycles were missed while nobody asked.
#[test]
fn a_frame_of_a_later_cycle_closes_those_before_it() {
    let mut device = device();
    device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
    let third = frame(3);
    let output = device.hear_exchange(&third, captured(3, 0)).unwrap();
    assert_eq!((output.cycle, output.data), (3, &[3; 4][..]));
    assert_eq!(device.counters().master.missed, 2);
    // Nothing is given out after its time: cycle 3 began, and the slot of cycle 4 is the next one.
    let actions = until(&mut device, ZERO_NS + 3 * 4000 + 3000, ZERO_NS + 4 * 4000 + 300);
    assert_eq!(actions[0].1, Action::CycleStart { cycle: 3, start_ns: ZERO_NS + 12_000 });
    assert!(
        actions.iter().any(|(_, action)| *action == Action::Send { cycle: 4, at_ns: ZERO_NS + 16_500 }),
        "{actions:?}"
    );
    assert!(!actions.iter().any(|(_, action)| matches!(action, Action::Send { cycle: 1..=3, .. })), "{actions:?}");
    // Six of them are too many.
    let error = device.hear_exchange(&frame(11), captured(11, 0)).map(|_| ());
    assert_eq!((error, device.state()), (Err(Error::WrongState), State::Idle));
}

/// A device whose host sleeps, or whose master never begins, gives up by the clock that nobody sets.
#[test]
fn a_device_that_waits_for_ever_gives_up() {
    let mut waiting = device();
    assert!(matches!(waiting.poll(ZERO_NS, 20_000_000), Action::CycleStart { .. }));
    assert_eq!(waiting.poll(ZERO_NS, 20_000_001), Action::Restart);
    assert_eq!(waiting.state(), State::Idle);
    let mut running = device();
    running.hear_exchange(&frame(0), captured(0, 0)).unwrap();
    assert_ne!(running.poll(ZERO_NS + 1000, 20_000_000), Action::Restart);
    assert_eq!(running.poll(ZERO_NS + 1000, 21_000_000), Action::Restart);
}

/// A slot before the cycle is not one: the device says nothing, and the plan refuses such a line.
#[test]
fn a_slot_before_the_cycle_is_not_used() {
    for (first_ns, slot) in [(76, Some(0)), (75, None)] {
        let mut device = device();
        assert_eq!(device.send_time_ns(), Some(500));
        let slots = Slots::Raster { first_ns, slot_ns: 880 };
        let mut other = Device::new(Config::new().with_slots(slots));
        other.set_links(Link::Up, Link::Down);
        core::mem::swap(&mut device, &mut other);
        for mut frame in start_up() {
            let times = FrameTimes { sof_ns: 30_856, counter_ns: 30_856, now_ns: 0 };
            assert_eq!(device.hear(PortId::A, &mut frame, times).result, Ok(()));
        }
        assert_eq!(device.send_time_ns(), slot);
        device.hear_exchange(&frame(0), captured(0, 0)).unwrap();
        let sends = until(&mut device, ZERO_NS + 3000, ZERO_NS + 9000);
        assert_eq!(sends.iter().any(|(_, action)| matches!(action, Action::Send { .. })), slot.is_some());
    }
}

/// A master in its first cycle, and the trigger of that.
fn master(config: master::Config) -> (Master, u64) {
    let mut master = Master::new(config.with_sync_frames(2));
    master.set_link(Link::Up);
    let mut now_ns = 0;
    loop {
        match master.poll(now_ns) {
            master::Action::Wait { until_ns } => now_ns = until_ns,
            master::Action::Send { at_ns, frame } => {
                master.hear(&answer(frame, 2), at_ns + capture_ns(&frame) + 472).unwrap();
            }
            master::Action::Exchange { at_ns, .. } => return (master, at_ns),
            master::Action::Restart { error } => panic!("{error}"),
        }
    }
}

/// Published send times of 500 and 900 ns, the cable, a device between, 120 ns to the capture.
fn at_master(address: u8, trigger_ns: u64, off_ns: i64) -> u64 {
    let arrives = if address == 1 { 500 + 76 } else { 900 + 76 + 355 };
    (trigger_ns - 500 + arrives + 120).saturating_add_signed(off_ns)
}

fn cycle_of(heard: Result<Heard<'_>, Error>) -> Result<Option<u64>, ErrorClass> {
    match heard {
        Ok(Heard::Device { cycle, .. }) => Ok(cycle),
        Ok(Heard::StartUp) => panic!("no start-up frame"),
        Err(error) => Err(error.class()),
    }
}

/// A master that is asked for the next cycle before this one's frames are in does not book them there.
#[test]
fn a_frame_belongs_to_its_cycle_whenever_the_next_one_is_planned() {
    for lead_ns in [0, 600, 1000, 2500] {
        let (mut master, first_ns) = master(master::Config::new().with_lead_ns(lead_ns));
        for cycle in 1..100 {
            let trigger_ns = first_ns + 4000 * (cycle - 1);
            let asked_ns = trigger_ns + 4000 - u64::from(lead_ns);
            let mut asked = false;
            for address in [1, 2] {
                let sof_ns = at_master(address, trigger_ns, 0);
                // 520 ns from the capture to the end.
                if sof_ns + 520 > asked_ns && !asked {
                    asked = true;
                    assert!(
                        matches!(master.poll(asked_ns), master::Action::Exchange { cycle: next, .. } if next == cycle)
                    );
                }
                assert_eq!(
                    cycle_of(master.hear(&device_frame(address), sof_ns)),
                    Ok(Some(cycle - 1)),
                    "{lead_ns} {cycle}"
                );
            }
            if !asked {
                assert!(matches!(master.poll(asked_ns), master::Action::Exchange { .. }));
            }
        }
        let counters = master.counters();
        assert_eq!((counters.frames, counters.timing_errors), (Tally::default(), 0), "{lead_ns}");
    }
}

/// The frame of device 2 has ended 1471 ns after the trigger: a master that is asked then has lost it if it has not come, and
/// one that is asked a nanosecond before it waits.
#[test]
fn a_cycle_is_closed_when_its_last_frame_must_have_ended() {
    for (lead_ns, missed, status) in [(4000 - 1471, 1, 0x34), (4000 - 1470, 0, 0x30), (3000, 0, 0x30)] {
        let (mut master, first_ns) = master(master::Config::new().with_lead_ns(lead_ns));
        for cycle in 1..5 {
            let trigger_ns = first_ns + 4000 * (cycle - 1);
            for address in if cycle < 4 { &[1, 2][..] } else { &[1] } {
                master.hear(&device_frame(*address), at_master(*address, trigger_ns, 0)).unwrap();
            }
            assert!(matches!(master.poll(trigger_ns + 4000 - u64::from(lead_ns)), master::Action::Exchange { .. }));
        }
        let mut bytes = [0; 21];
        master.emit_into(&[0; 16], 0, &mut bytes).unwrap();
        assert_eq!((master.tally(2).unwrap().missed, bytes[1]), (missed, status), "{lead_ns}");
        // One that comes now is in time where it was waited for.
        let late = cycle_of(master.hear(&device_frame(2), at_master(2, first_ns + 12_000, 0)));
        assert_eq!(late, if missed == 1 { Err(ErrorClass::CycleOver) } else { Ok(Some(3)) }, "{lead_ns}");
    }
}

/// Twice in a cycle, between two slots, and of a cycle that is closed: refused, counted for the device, and told in STATUS of the
/// next master frame.
#[test]
fn what_is_doubled_late_or_stale_is_refused_and_counted() {
    let none = Tally::default();
    let run = |address: u8, cycle: u64, off_ns: i64| {
        let (mut master, mut trigger_ns) = master(master::Config::new());
        for _ in 0..3 {
            for address in [1, 2] {
                master.hear(&device_frame(address), at_master(address, trigger_ns, 0)).unwrap();
            }
            trigger_ns += 4000;
            assert!(matches!(master.poll(trigger_ns), master::Action::Exchange { .. }));
        }
        // Cycle 3 is open now. Device 2 was heard in it.
        master.hear(&device_frame(2), at_master(2, trigger_ns, 0)).unwrap();
        let sof_ns = at_master(address, trigger_ns - 12_000 + 4000 * cycle, off_ns);
        let result = cycle_of(master.hear(&device_frame(address), sof_ns));
        if address == 2 || result.is_err() {
            let _: Result<_, _> = master.hear(&device_frame(1), at_master(1, trigger_ns, 0));
        }
        assert!(matches!(master.poll(trigger_ns + 4000), master::Action::Exchange { .. }));
        let mut bytes = [0; 21];
        master.emit_into(&[0; 16], 0, &mut bytes).unwrap();
        assert_eq!(master.counters().frames, master.tally(address).unwrap());
        assert_eq!(master.tally(3 - address), Some(none));
        (result, master.tally(address).unwrap(), bytes[1])
    };
    assert_eq!(run(1, 3, 0), (Ok(Some(3)), none, 0x30));
    assert_eq!((run(1, 3, 500), run(1, 3, -500)), ((Ok(Some(3)), none, 0x30), (Ok(Some(3)), none, 0x30)));
    let late = Tally { late: 1, ..none };
    assert_eq!(run(1, 3, 501), (Err(ErrorClass::OutsideWindow), late, 0x34));
    // 16 ns more for each device that it has passed.
    assert_eq!(run(2, 2, 517), (Err(ErrorClass::OutsideWindow), late, 0x34));
    assert_eq!(run(2, 3, 0), (Err(ErrorClass::Doubled), Tally { doubled: 1, ..none }, 0x34));
    assert_eq!(run(2, 3, 516), (Err(ErrorClass::Doubled), Tally { doubled: 1, ..none }, 0x34));
    // 6 us later than its time: half a cycle.
    assert_eq!(run(2, 2, 6000), (Err(ErrorClass::OutsideWindow), late, 0x34));
    assert_eq!(run(2, 2, 0), (Err(ErrorClass::CycleOver), Tally { stale: 1, ..none }, 0x34));
    let (master, _) = master(master::Config::new());
    assert_eq!((master.tally(0), master.tally(255), master.tally(254)), (None, None, Some(none)));
}

/// A host that is late leaves cycles out, and what comes in them is good: it was sampled when it was.
#[test]
fn frames_of_a_cycle_that_was_left_out_are_heard() {
    let (mut master, first_ns) = master(master::Config::new());
    assert_eq!(cycle_of(master.hear(&device_frame(1), at_master(1, first_ns + 4000, 0))), Ok(None));
    let master::Action::Exchange { at_ns, .. } = master.poll(first_ns + 9000) else { panic!() };
    assert_eq!(at_ns, first_ns + 12_000);
    assert_eq!(master.counters().frames, Tally::default());
}

/// In its first cycle no device speaks, so none is missing.
#[test]
fn nobody_is_missed_in_the_first_cycle() {
    let (mut master, first_ns) = master(master::Config::new());
    for cycle in 1..=2 {
        assert!(matches!(master.poll(first_ns + 4000 * cycle), master::Action::Exchange { .. }));
        let missed = [0, 1].map(|k| master.tally(k + 1).unwrap().missed);
        assert_eq!(missed, if cycle == 1 { [0, 0] } else { [1, 1] });
    }
    let mut bytes = [0; 21];
    master.emit_into(&[0; 16], 0, &mut bytes).unwrap();
    assert_eq!(bytes[1], 0x34, "the cycle before has lost two");
}
