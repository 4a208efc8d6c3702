//! What comes twice, late, early or not at all, and machines that are asked too late: the order of events that a line and a
//! busy processor can bring about.

use crate::common::{answer, capture_ns, device_in, sync};
use sorte_proto::Link;
use sorte_proto::Place;
use sorte_proto::cut_through::Rewriter;
use sorte_proto::device::{self, Device, FrameTimes, Path, PortId};
use sorte_proto::master::{Action, Config, Master, Outgoing, State};
use sorte_proto::{
    Correction, DelayReq, DeviceAddress, DeviceFrame, Discovery, Entry, Error, ErrorClass, FrameType, Param,
    Parameters, RoundTrips, Status, Sync,
};

/// 76 ns of cable and 320 ns in the device.
const ROUND_TRIP: u64 = 472;

fn master(config: Config) -> Master {
    let mut master = Master::new(config);
    master.set_link(Link::Up);
    master
}

/// Frames sent, each with the time of the poll and its own; time of the last poll and of the first frame of the exchange.
type Run = (Vec<(u64, u64, Outgoing)>, Result<(u64, u64), Error>);

/// Runs until the exchange begins or the master gives up. `late`: so much later than asked for each poll comes; `hear`: what
/// reaches the master of a frame sent, with the capture of its start.
fn run(master: &mut Master, mut late: impl FnMut() -> u64, mut hear: impl FnMut(&mut Master, u64, Outgoing)) -> Run {
    let (mut now_ns, mut sent) = (0, Vec::new());
    for _ in 0..20_000 {
        match master.poll(now_ns) {
            Action::Wait { until_ns } => {
                assert_ne!(until_ns, u64::MAX);
                now_ns = until_ns.max(now_ns) + late();
            }
            Action::Send { at_ns, frame } => {
                sent.push((now_ns, at_ns, frame));
                hear(master, at_ns + capture_ns(&frame), frame);
            }
            Action::Exchange { at_ns, .. } => return (sent, Ok((now_ns, at_ns))),
            Action::Restart { error } => return (sent, Err(error)),
        }
    }
    panic!("no end");
}

fn hear_once(master: &mut Master, at_ns: u64, frame: Outgoing) {
    let _: Result<_, _> = master.hear(&answer(frame, 2), at_ns + ROUND_TRIP);
}

/// Ten frames must be answered, and the devices must have had the one with STATE_CHANGE.
#[test]
fn an_answer_to_param_that_comes_twice_counts_once() {
    let mut master = master(Config::new());
    let (sent, end) = run(
        &mut master,
        || 0,
        |master, at_ns, frame| {
            hear_once(master, at_ns, frame);
            hear_once(master, at_ns + 5000, frame);
        },
    );
    assert!(end.is_ok());
    let params: Vec<u8> = sent
        .iter()
        .filter_map(|(.., frame)| match frame {
            Outgoing::Param(param) => Some(param.status.bits()),
            _ => None,
        })
        .collect();
    assert_eq!(params, [0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x10, 0x18]);
}

/// An answer without STATE_CHANGE is not the answer to the frame that has it.
#[test]
fn the_last_param_needs_its_own_answer() {
    let mut master = master(Config::new().with_param_frames(2));
    let (sent, end) = run(
        &mut master,
        || 0,
        |master, at_ns, frame| match frame {
            Outgoing::Param(_) => {
                let old = Param::request(Parameters::STOCK, Place::Inner).emit();
                let _: Result<_, _> = master.hear(&old, at_ns + ROUND_TRIP);
            }
            frame => hear_once(master, at_ns, frame),
        },
    );
    assert_eq!(end.map_err(Error::class), Err(ErrorClass::NoAnswer));
    assert!(sent.iter().all(|(.., frame)| !matches!(frame, Outgoing::DelayReq(_))));
}

/// What began before the request is not its answer: as a round trip it would be 0 ns and shorten the line by 30 ns.
#[test]
fn a_reflection_that_is_older_than_its_request_is_refused() {
    let mut master = master(Config::new());
    let mut refused = 0;
    let (_, end) = run(
        &mut master,
        || 0,
        |master, at_ns, frame| {
            if let Outgoing::DelayReq(_) = frame {
                let request = DelayReq::of_master(Place::Inner).emit();
                let stale = master.hear(&request, at_ns - 900_000);
                assert_eq!(stale, Err(Error::BeforeRequest { early_ns: 900_000 }));
                refused += 1;
            }
            hear_once(master, at_ns, frame);
        },
    );
    assert!(end.is_ok());
    assert_eq!(
        (refused, master.line_delay().extremes(), master.line_delay().checked()),
        (16, Some(RoundTrips { shortest_ns: 472, longest_ns: 472 }), Ok(76))
    );
}

#[test]
fn old_answers_of_discovery_and_sync_are_refused_and_end_nothing() {
    let mut discovering = master(Config::new());
    let Action::Send { at_ns, frame } = discovering.poll(5_000_000) else { panic!() };
    let answer_before = answer(frame, 2);
    let stale = discovering.hear(&answer_before, at_ns + 600 - 1);
    assert_eq!(stale, Err(Error::BeforeRequest { early_ns: 1 }));
    assert_eq!((discovering.state(), discovering.network().devices()), (State::Discovery, 0));
    // The answer to the last SYNC of the start-up before, which is the same byte for byte.
    let mut syncing = master(Config::new().with_sync_frames(3));
    let final_answer = sync(Sync::of_master(20_500, 76, Place::Last), &[0, 0]);
    let (_, end) = run(
        &mut syncing,
        || 0,
        |master, at_ns, frame| match frame {
            Outgoing::Sync(_) => {
                let _: Result<_, _> = master.hear(&final_answer.emit(), at_ns - 300);
            }
            frame => hear_once(master, at_ns, frame),
        },
    );
    assert_eq!(end, Err(Error::NoAnswer { sent: FrameType::Sync, frame: 2 }));
    // Before the last one has been sent it is an answer to nothing, whatever its time.
    let mut early = master(Config::new().with_sync_frames(3));
    let mut sent = 0;
    let (_, end) = run(
        &mut early,
        || 0,
        |master, at_ns, frame| match frame {
            Outgoing::Sync(_) if sent < 2 => {
                sent += 1;
                let _: Result<_, _> = master.hear(&final_answer.emit(), at_ns + 1000);
            }
            Outgoing::Sync(_) => {}
            frame => hear_once(master, at_ns, frame),
        },
    );
    assert_eq!(end, Err(Error::NoAnswer { sent: FrameType::Sync, frame: 2 }));
}

/// No cable is longer than 4096 ns of round trip: one request that was held up on its way must not pass as a mean.
#[test]
fn one_round_trip_that_cannot_be_spoils_the_measurement() {
    let mut master = master(Config::new());
    let mut asked = 0;
    let (_, end) = run(
        &mut master,
        || 0,
        |master, at_ns, frame| {
            let held_up = if let Outgoing::DelayReq(_) = frame {
                asked += 1;
                asked == 7
            } else {
                false
            };
            let _: Result<_, _> = master.hear(&answer(frame, 2), at_ns + if held_up { 30_000 } else { ROUND_TRIP });
        },
    );
    assert_eq!(end, Err(Error::ImplausibleRoundTrip { rtt_ns: 30_000 }));
}

/// No frame is to be sent at a time that has passed; SYNC and the exchange stay in their raster, with true time stamps.
#[test]
fn a_master_that_is_polled_late_sends_nothing_in_the_past() {
    let mut master = master(Config::new());
    let mut polls = 0_u64;
    let late = move || {
        polls += 1;
        // 0 to 33 us, and once 2.5 ms.
        if polls == 30 { 2_500_000 } else { polls * 7919 % 33_000 }
    };
    let (sent, end) = run(&mut master, late, hear_once);
    let (now_ns, first_ns) = end.unwrap();
    assert!(first_ns >= now_ns);
    let mut syncs = 0;
    for (asked_ns, at_ns, frame) in &sent {
        assert!(at_ns >= asked_ns, "{frame:?} at {at_ns}, asked at {asked_ns}");
        if let Outgoing::Sync(frame) = frame {
            syncs += 1;
            let time = at_ns - master.epoch_ns();
            assert_eq!(time % 10_000, 500);
            assert_eq!(frame.time_stamp_ns, time as u32 + 76 + 280);
        }
    }
    assert_eq!((syncs, master.line_delay().checked()), (1024, Ok(76)));
    let last_ns = sent.last().unwrap().1;
    assert_eq!((first_ns - last_ns - 10_500) % 4000, 0);
    // In the exchange: asked 9 us late, the third cycle from there is the next that can be.
    let before = master.counters().skipped_cycles;
    let Action::Exchange { at_ns, time_stamp, cycle, .. } = master.poll(first_ns + 4000 + 9000) else { panic!() };
    assert_eq!((at_ns, cycle), (first_ns + 16_000, 1));
    assert_eq!(time_stamp, (at_ns - master.epoch_ns()) as u16);
    assert_eq!((master.counters().cycles, master.counters().skipped_cycles - before), (2, 3));
}

/// Hardware that sends at a time wants the frame before it: 20 us here.
#[test]
fn a_frame_is_handed_out_as_long_before_its_time_as_the_port_needs() {
    let mut master = master(Config::new().with_lead_ns(20_000));
    let (sent, end) = run(&mut master, || 0, hear_once);
    for (asked_ns, at_ns, frame) in &sent {
        assert_eq!(at_ns - asked_ns, 20_000, "{frame:?}");
    }
    let times: Vec<u64> = sent.iter().map(|(_, at_ns, _)| *at_ns - 20_000).collect();
    assert_eq!((times[10], times[35], times[36], times[1059]), (10_000_000, 35_000_000, 36_000_500, 46_230_500));
    let (now_ns, at_ns) = end.unwrap();
    assert_eq!((now_ns, at_ns), (46_241_000, 46_261_000));
    assert_eq!(master.poll(now_ns), Action::Wait { until_ns: now_ns + 4000 });
    // Without a link there is no time to wait for.
    master.disable();
    assert_eq!(master.poll(now_ns), Action::Wait { until_ns: u64::MAX });
}

/// The round trip counts from the start of the request as the port has captured it, if it can.
#[test]
fn a_request_that_left_later_than_planned_is_measured_from_its_start() {
    let mut master = master(Config::new());
    let mut held_ns = 0;
    let (_, end) = run(
        &mut master,
        || 0,
        |master, at_ns, frame| {
            held_ns += 100;
            master.sent(at_ns + held_ns);
            hear_once(master, at_ns + held_ns, frame);
        },
    );
    assert_eq!(
        (end.is_ok(), master.line_delay().extremes()),
        (true, Some(RoundTrips { shortest_ns: 472, longest_ns: 472 }))
    );
}

/// 254 devices 85 ns apart: the answer to SYNC is on its way for 223 us, and the exchange begins in the devices' raster, 10 us
/// and whole cycles after the last SYNC.
#[test]
fn the_answer_of_a_long_line_is_waited_for() {
    let mut master = master(Config::new().with_cycle_ns(224_000).with_long_line(true).with_sync_frames(64));
    let mut answers: Vec<(u64, Vec<u8>)> = Vec::new();
    let mut now_ns = 0;
    let (mut last_ns, mut first_ns) = (0, None);
    for _ in 0..2000 {
        let next = match master.poll(now_ns) {
            Action::Wait { until_ns } => until_ns,
            Action::Send { at_ns, frame } => {
                last_ns = at_ns;
                let way = if let Outgoing::DelayReq(_) = frame { ROUND_TRIP } else { 223_000 };
                answers.push((at_ns + capture_ns(&frame) + way, answer(frame, 2)));
                now_ns
            }
            Action::Exchange { at_ns, .. } => {
                first_ns = Some(at_ns);
                break;
            }
            Action::Restart { error } => panic!("{error}"),
        };
        now_ns = next;
        if answers.first().is_some_and(|(sof_ns, _)| *sof_ns <= next) {
            let (sof_ns, bytes) = answers.remove(0);
            now_ns = sof_ns;
            master.hear(&bytes, sof_ns).unwrap();
        }
    }
    assert_eq!(first_ns, Some(last_ns + 10_500 + 224_000));
}

/// The published master: cycle zero 10 us after the trigger of the last SYNC, the frame 500 ns later; whatever the period of SYNC is.
#[test]
fn the_exchange_begins_ten_and_a_half_microseconds_after_the_last_sync() {
    for period in [4000, 10_000, 25_000, 1_000_000] {
        let mut master = master(Config::new().with_sync_period_ns(period).with_sync_frames(5));
        let (sent, end) = run(&mut master, || 0, hear_once);
        assert_eq!(end.map(|(_, at_ns)| at_ns), Ok(sent.last().unwrap().1 + 10_500), "{period}");
    }
}

#[test]
fn as_many_cycles_are_left_to_stop_as_the_host_has_asked_for() {
    for cycles in [0, 1, 2, 500] {
        let mut master = master(Config::new().with_sync_frames(2).with_stop_cycles(cycles));
        let (_, end) = run(&mut master, || 0, hear_once);
        let (mut now_ns, _) = end.unwrap();
        let mut bytes = [0; 6];
        let (address, status) = (DeviceAddress::new(3).unwrap(), Status::LAST);
        DeviceFrame { address, status, payload: [0; 3] }.emit_into(&mut bytes).unwrap();
        assert_eq!(master.hear(&bytes, 0).map(|_| ()), Err(Error::TopologyChanged { address: 3 }));
        let mut stopping = 0;
        while let Action::Exchange { stop, .. } = {
            now_ns += 4000;
            master.poll(now_ns)
        } {
            stopping += u32::from(stop);
        }
        assert_eq!((stopping, master.state()), (cycles, State::Idle));
    }
}

#[test]
fn a_link_that_is_lost_in_error_restarts_nothing() {
    let mut failing = master(Config::new().with_max_failures(1));
    let (_, end) = run(&mut failing, || 0, |_, _, _| {});
    assert!(end.is_err());
    failing.set_link(Link::Down);
    failing.set_link(Link::Up);
    assert_eq!((failing.state(), failing.counters().retrains), (State::Error, 1));
    assert_eq!(failing.poll(1_000_000_000), Action::Wait { until_ns: u64::MAX });
}

const ARRIVAL: FrameTimes = FrameTimes { sof_ns: 77_000, counter_ns: 77_700, now_ns: 0 };

/// A frame is on its way through the device when its host resets it, its link goes or its time is over: what the rest of the
/// frame says belongs to a start-up that has ended. A clock that is set then would not be set in the next one.
#[test]
fn a_frame_that_began_before_a_restart_teaches_nothing_after_it() {
    let restarts: [fn(&mut Device); 4] = [
        Device::reset,
        |device| device.set_links(Link::Down, Link::Up),
        |device| assert_eq!(device.poll(0, 50_000_000), device::Action::Restart),
        Device::enter_error,
    ];
    for restart in restarts {
        let mut device = device_in(device::State::Sync, true, Parameters::CNC);
        let mut passage = device.passage(PortId::A);
        for byte in Sync::of_master(30_500, 76, Place::Last).emit() {
            passage.byte(byte);
        }
        restart(&mut device);
        let before = device;
        let handled = device.hear_passed(PortId::A, passage, ARRIVAL);
        assert_eq!((handled.result, handled.correction), (Err(Error::WrongState), Correction::None));
        assert_eq!(device, before);
    }
}

/// A neighbour that is still in PARAM sends DISCOVERY back as it is, without LAST. The master is not on that side for that.
#[test]
fn only_one_port_faces_the_master() {
    let mut device = Device::new(device::Config::new());
    device.set_links(Link::Up, Link::Up);
    let mut frame = Discovery::request(Place::Inner).emit();
    assert_eq!(device.hear(PortId::A, &mut frame, ARRIVAL).path, Path::Forward);
    // Back as it went out.
    assert_eq!(device.hear(PortId::B, &mut frame, ARRIVAL).path, Path::Forward);
    // The second round: counted on the way out, and not again on the way back.
    let mut frame = Discovery::request(Place::Inner).emit();
    device.hear(PortId::A, &mut frame, ARRIVAL).result.unwrap();
    let mut returning = frame;
    Rewriter::discovery(Entry::STOCK, Status::LAST).pass(&mut returning).unwrap();
    let mut bytes = returning;
    device.hear(PortId::B, &mut bytes, ARRIVAL).result.unwrap();
    assert_eq!(bytes, returning);
    assert_eq!(device.assignment().map(|place| place.address.get()), Some(1));
    assert_eq!(device.master_port(), Some(PortId::A));
}

/// When a request has really begun matters where round trips are measured, and nowhere else.
#[test]
fn only_a_delay_request_has_a_begin_of_its_own() {
    let mut discovering = master(Config::new());
    let Action::Send { at_ns, frame } = discovering.poll(5_000_000) else { panic!() };
    discovering.sent(at_ns + 10_000);
    assert!(discovering.hear(&answer(frame, 2), at_ns + 600).is_ok());
}
