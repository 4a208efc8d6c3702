//! Rules of the master, one by one: when it waits, what it counts as an answer, why it gives up, and what it counts.

use crate::common::{answer, capture_ns, device_frame, discovery, sync};
use crate::master_bench::{Bench, FOREVER, ROUND_TRIP, running};
use sorte_proto::Link;
use sorte_proto::Place;
use sorte_proto::master::{Action, Config, Counters, Heard, Master, Outgoing, State};
use sorte_proto::timing::Slots;
use sorte_proto::{
    DelayReq, DeviceAddress, DeviceFrame, Discovery, Error, ErrorClass, FrameType, Param, Parameters, RoundTrips,
    Status, Sync, Tally, fcs,
};

#[test]
fn nothing_happens_without_link_and_enable() {
    let mut master = Master::new(Config::new());
    assert_eq!(master.poll(0), FOREVER);
    master.set_link(Link::Down);
    assert_eq!((master.poll(0), master.counters().retrains), (FOREVER, 0));
    master.set_link(Link::Up);
    master.disable();
    assert_eq!(master.poll(0), FOREVER);
    master.enable();
    assert!(matches!(master.poll(0), Action::Send { at_ns: 0, frame: Outgoing::Discovery { place: Place::Inner } }));
    // Up again, enabled again: nothing new.
    master.set_link(Link::Up);
    master.enable();
    assert_eq!((master.state(), master.counters()), (State::Discovery, Counters::default()));
    assert_eq!(master.poll(999_999), Action::Wait { until_ns: 1_000_000 });
    assert!(matches!(master.poll(1_000_000), Action::Send { at_ns: 1_000_000, .. }));
}

#[test]
fn a_link_that_is_lost_ends_it_and_an_enable_bit_that_is_taken_stops_it() {
    let mut bench = running(Config::new());
    bench.master.disable();
    assert_eq!((bench.master.state(), bench.master.poll(bench.now_ns)), (State::Idle, FOREVER));
    let mut bench = running(Config::new());
    bench.master.set_link(Link::Down);
    assert_eq!(bench.master.poll(bench.now_ns), Action::Restart { error: Error::LinkDown });
    assert_eq!((bench.master.state(), bench.master.counters().retrains), (State::Idle, 1));
    assert_eq!(bench.master.poll(bench.now_ns), FOREVER);
    // A pause of 30 ms, and from the beginning.
    bench.master.set_link(Link::Up);
    let ready_ns = bench.now_ns + 30_000_000;
    assert_eq!(bench.master.poll(bench.now_ns), Action::Wait { until_ns: ready_ns });
    assert_eq!(bench.master.poll(ready_ns - 1), Action::Wait { until_ns: ready_ns });
    assert!(matches!(bench.master.poll(ready_ns), Action::Send { at_ns, .. } if at_ns == ready_ns));
    assert_eq!(bench.master.network().devices(), 0);
}

#[test]
fn too_few_devices_and_silence_are_told_apart() {
    let mut none = Bench::new(Config::new());
    assert_eq!(none.run(|_, _| None), Err(Some(Error::NoAnswer { sent: FrameType::Discovery, frame: 9 })));
    for (asked, found, want) in [(0, 0, 1), (3, 2, 3)] {
        let mut bench = Bench::new(Config::new().with_min_devices(asked));
        let mut empty = Discovery::request(Place::Inner);
        empty.status |= Status::LAST;
        let reply = if found == 0 { empty.emit().to_vec() } else { discovery(found, Place::Inner) };
        let error = bench.run(|_, _| Some(reply.clone()));
        assert_eq!(error, Err(Some(Error::TooFewDevices { got: found, want })));
        assert_eq!(bench.sent.len(), 10);
    }
    assert!(Bench::new(Config::new().with_min_devices(2)).run(|_, frame| Some(answer(frame, 2))).is_ok());
}

/// An answer that has not passed the last device counts no devices; a damaged one ends the phase at once.
#[test]
fn discovery_needs_an_answer_of_the_last_device() {
    let mut bench = Bench::new(Config::new());
    let passing = |_: usize, frame: Outgoing| {
        let mut bytes = answer(frame, 2);
        bytes[3] &= !1;
        let (body, trailer) = bytes.split_last_chunk_mut().unwrap();
        *trailer = fcs(body).to_le_bytes();
        Some(bytes)
    };
    assert!(matches!(bench.run(passing), Err(Some(Error::NoAnswer { sent: FrameType::Discovery, .. }))));
    assert_eq!((counters(&bench).retrains, counters(&bench).format_errors), (1, 0));
    let mut bench = Bench::new(Config::new());
    let error = bench.run(|_, frame| {
        let mut bytes = answer(frame, 2);
        bytes[20] ^= 1;
        Some(bytes)
    });
    assert_eq!(error.map_err(|error| error.map(Error::class)), Err(Some(ErrorClass::BadFcs)));
    let Counters { crc_errors, format_errors, retrains, .. } = counters(&bench);
    assert_eq!((bench.sent.len(), crc_errors, format_errors, retrains), (1, 1, 0, 1));
    let mut bench = Bench::new(Config::new());
    let error = bench.run(|_, _| Some(DelayReq::of_master(Place::Inner).emit().to_vec()));
    assert_eq!(error, Err(Some(Error::UnexpectedType { got: 3, want: 1 })));
    assert_eq!((counters(&bench).crc_errors, counters(&bench).format_errors), (0, 1));
}

fn counters(bench: &Bench) -> Counters {
    bench.master.counters()
}

/// The counter of PARAM goes down with answers only; the frame sent when it is 1 carries STATE_CHANGE.
#[test]
fn ten_param_frames_must_be_answered_and_ten_in_a_row_may_not_be() {
    let mut bench = Bench::new(Config::new());
    bench
        .run(|n, frame| {
            let lost = matches!(frame, Outgoing::Param(_)) && n % 2 == 1;
            (!lost).then(|| answer(frame, 2))
        })
        .unwrap();
    let params: Vec<bool> = bench
        .sent
        .iter()
        .filter_map(|(_, frame)| match frame {
            Outgoing::Param(param) => Some(param.status.contains(Status::STATE_CHANGE)),
            _ => None,
        })
        .collect();
    // Answered, lost, answered, ...: the tenth answer comes to the nineteenth frame.
    assert_eq!(params.len(), 19);
    assert!(params.iter().enumerate().all(|(n, change)| *change == (n >= 17)), "{params:?}");

    let mut bench = Bench::new(Config::new());
    let silent = bench.run(|_, frame| (!matches!(frame, Outgoing::Param(_))).then(|| answer(frame, 2)));
    assert_eq!(silent, Err(Some(Error::NoAnswer { sent: FrameType::Param, frame: 9 })));
    // Nine lost and one answered, for ever: no reason to give up.
    let mut bench = Bench::new(Config::new());
    let patient = bench.run(|n, frame| {
        let lost = matches!(frame, Outgoing::Param(_)) && n % 10 != 9;
        (!lost).then(|| answer(frame, 2))
    });
    assert!(patient.is_ok());
    // A damaged answer is not an answer, and no reason to give up either.
    let mut bench = Bench::until(Config::new(), State::Param);
    let mut damaged = Param::request(Parameters::STOCK, Place::Inner).emit();
    damaged[8] ^= 1;
    assert_eq!(bench.master.hear(&damaged, bench.now_ns).map_err(Error::class), Err(ErrorClass::BadFcs));
    assert_eq!((bench.master.state(), counters(&bench).crc_errors, counters(&bench).retrains), (State::Param, 1, 0));
}

#[test]
fn only_a_long_line_is_told_the_period_of_sync() {
    for (long, want) in [(false, 0), (true, 2000)] {
        let bench = Bench::until(Config::new().with_long_line(long), State::Param);
        let Some((_, Outgoing::Param(param))) = bench.sent.last() else { panic!("no PARAM") };
        assert_eq!((param.parameters.sync_cycle, param.parameters.cycle_time_ns), (want, 4000));
    }
}

#[test]
fn a_delay_request_has_a_millisecond_to_come_back() {
    let mut bench = Bench::until(Config::new(), State::LineDelay);
    let (asked_ns, _) = *bench.sent.last().unwrap();
    let until_ns = asked_ns + 600 + 1_000_000;
    assert_eq!(bench.master.poll(asked_ns), Action::Wait { until_ns });
    // DELAY_RESP tells nothing.
    let mut response = DelayReq::of_device(Place::Inner).emit();
    (response[2], response[3]) = (FrameType::DelayResp.code(), 0x30);
    let (body, trailer) = response.split_last_chunk_mut().unwrap();
    *trailer = fcs(body).to_le_bytes();
    assert_eq!(bench.master.hear(&response, asked_ns + 600 + 500), Ok(Heard::StartUp));
    assert_eq!(bench.master.line_delay().count(), 0);
    assert_eq!(bench.master.poll(until_ns - 1), Action::Wait { until_ns });
    let error = Error::NoAnswer { sent: FrameType::DelayReq, frame: 0 };
    assert_eq!(bench.master.poll(until_ns), Action::Restart { error });
    // One answer to one request.
    let mut bench = Bench::until(Config::new(), State::LineDelay);
    for _ in 0..3 {
        bench.master.hear(&DelayReq::of_master(Place::Inner).emit(), asked_ns + 600 + ROUND_TRIP).unwrap();
    }
    assert_eq!(
        (bench.master.line_delay().count(), bench.master.line_delay().extremes()),
        (1, Some(RoundTrips { shortest_ns: 472, longest_ns: 472 }))
    );
}

#[test]
fn a_round_trip_that_cannot_be_ends_it() {
    let mut bench = Bench::new(Config::new());
    let fast = |master: &mut Master, at_ns: u64, frame| {
        master.hear(&answer(frame, 2), at_ns + capture_ns(&frame) + 314).map(|_| ())
    };
    let error = loop {
        match bench.master.poll(bench.now_ns) {
            Action::Wait { until_ns } => bench.now_ns = until_ns,
            Action::Send { at_ns, frame } => {
                fast(&mut bench.master, at_ns, frame).unwrap();
            }
            Action::Restart { error } => break error,
            Action::Exchange { .. } => panic!("it runs"),
        }
    };
    // 320 ns in the first device, and 5 ns less for a tick of the counter.
    assert_eq!(error, Error::ImplausibleRoundTrip { rtt_ns: 314 });
}

#[test]
fn sync_without_an_answer_ends_it_with_its_last_frame() {
    let mut bench = Bench::new(Config::new());
    let error = bench.run(|_, frame| (!matches!(frame, Outgoing::Sync(_))).then(|| answer(frame, 2)));
    assert_eq!(error, Err(Some(Error::NoAnswer { sent: FrameType::Sync, frame: 1023 })));
}

/// The delay field holds 65,535 ns.
#[test]
fn the_longest_line_is_the_one_that_the_delay_field_holds() {
    // Of the answer's time stamp: the way beyond the first device, and the transit of the last.
    let run = |config: Config, beyond_ns: u32| {
        let mut bench = Bench::new(config.with_cycle_ns(1_000_000).with_sync_frames(2));
        bench.run(|_, frame| match frame {
            Outgoing::Sync(mut frame) => {
                frame = sync(frame, &[0]);
                frame.time_stamp_ns += beyond_ns;
                Some(frame.emit().to_vec())
            }
            frame => Some(answer(frame, 2)),
        })
    };
    assert!(run(Config::new(), 65_535 - 76).is_ok());
    assert_eq!(run(Config::new(), 65_536 - 76), Err(Some(Error::LineTooLong { delay_ns: 65_536 })));
    assert!(run(Config::new().with_long_line(true), 65_536 - 76).is_ok());
}

/// A device that lets SYNC pass adds nothing to it: three devices add 1065 ns and their cables, whichever.
#[test]
fn a_line_of_which_a_device_is_not_in_step_does_not_run() {
    let run = |passed: &[u16]| {
        let mut bench = Bench::new(Config::new().with_sync_frames(2));
        let end = bench.run(|_, frame| match frame {
            Outgoing::Sync(frame) => Some(sync(frame, passed).emit().to_vec()),
            frame => Some(answer(frame, 3)),
        });
        (end.map(|_| ()), bench.master.state())
    };
    assert_eq!(run(&[0, 0, 0]), (Ok(()), State::Exchange));
    let not_in_sync = |got| (Err(Some(Error::NotInSync { got, want: 3 })), State::Idle);
    assert_eq!((run(&[0, 0]), run(&[40, 40]), run(&[0])), (not_in_sync(2), not_in_sync(2), not_in_sync(1)));
    // 1064 ns are not enough.
    assert_eq!(run(&[354, 0]), not_in_sync(2));
}

/// The cable between two devices is the hop less 355 ns: with 1000 ns the master frame ends at the second device after
/// 500 + 23 x 80 + 76 + 1355 = 3771 ns.
#[test]
fn the_cycle_is_looked_at_with_the_measured_cables() {
    let run = |cycle_ns| {
        let mut bench = Bench::new(Config::new().with_cycle_ns(cycle_ns).with_sync_frames(2));
        bench.run(|_, frame| match frame {
            Outgoing::Sync(frame) => Some(sync(frame, &[1000, 0]).emit().to_vec()),
            frame => Some(answer(frame, 2)),
        })
    };
    assert!(run(3771).is_ok());
    assert_eq!(run(3770), Err(Some(Error::CycleTooShort { device: 2, needs_ns: 3771 })));
}

/// Failures in a row, without 1000 good cycles between them.
#[test]
fn a_thousand_good_cycles_forgive_a_failure() {
    for (cycles, want) in [(999, State::Error), (1000, State::Idle)] {
        let mut bench = Bench::new(Config::new().with_max_failures(2).with_sync_frames(2));
        assert!(bench.run(|_, _| None).is_err());
        bench.now_ns = bench.run(|_, frame| Some(answer(frame, 2))).unwrap();
        bench.cycles(cycles);
        bench.master.set_link(Link::Down);
        assert_eq!(bench.master.state(), want, "{cycles} cycles");
    }
    // Neither a cycle with a damaged frame nor one without a device is a good one.
    for (heard, damaged) in [(&[1, 2][..], true), (&[1][..], false)] {
        let mut bench = Bench::new(Config::new().with_max_failures(2).with_sync_frames(2));
        assert!(bench.run(|_, _| None).is_err());
        bench.now_ns = bench.run(|_, frame| Some(answer(frame, 2))).unwrap();
        bench.cycles(999);
        for &address in heard {
            bench.hear(&device_frame(address)).unwrap();
        }
        let mut frame = device_frame(1);
        frame[3] ^= 1;
        assert!(!damaged || bench.hear(&frame).is_err());
        bench.now_ns += 4000;
        assert!(matches!(bench.master.poll(bench.now_ns), Action::Exchange { stop: false, .. }));
        bench.master.set_link(Link::Down);
        assert_eq!(bench.master.state(), State::Error, "{heard:?}");
    }
    let mut tireless = Bench::new(Config::new());
    assert!((0..300).all(|_| tireless.run(|_, _| None).is_err()));
    assert_eq!((tireless.master.state(), counters(&tireless).retrains), (State::Idle, 300));
}

#[test]
fn what_is_missing_is_counted_and_named() {
    let mut bench = running(Config::new());
    bench.cycles(5);
    let mut error = None;
    for n in 0..3 {
        bench.hear(&device_frame(1)).unwrap();
        bench.now_ns += 4000;
        match bench.master.poll(bench.now_ns) {
            Action::Exchange { .. } => assert!(n < 2),
            Action::Restart { error: why } => error = Some(why),
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(error, Some(Error::DevicesMissing { first: 2, count: 1, cycles: 3 }));
    // Cycles 5, 6 and 7; the first was number 0.
    assert_eq!((counters(&bench).timing_errors, counters(&bench).cycles, counters(&bench).retrains), (3, 8, 1));
    assert_eq!(
        (counters(&bench).frames.missed, bench.master.tally(1), bench.master.tally(2).map(|t| t.missed)),
        (3, Some(Tally::default()), Some(3))
    );
}

#[test]
fn a_device_frame_must_fit_what_discovery_found() {
    let changed = |bytes: [u8; 6]| {
        let mut bench = running(Config::new());
        let result = bench.hear(&bytes);
        (result, bench.master.poll(bench.now_ns))
    };
    let of = |address: u8, status: Status| {
        let mut bytes = [0; 6];
        DeviceFrame { address: DeviceAddress::new(address).unwrap(), status, payload: [0; 3] }
            .emit_into(&mut bytes)
            .unwrap();
        bytes
    };
    for (address, status) in [(3, Status::LAST), (3, Status::empty()), (1, Status::LAST), (2, Status::empty())] {
        let error = Error::TopologyChanged { address };
        assert_eq!(changed(of(address, status)), (Err(error), Action::Restart { error }), "{address} {status}");
    }
    assert_eq!(changed(device_frame(2)).0, Ok(()));
    let mut bench = running(Config::new());
    bench.hear(&of(1, Status::ERROR)).unwrap();
    bench.hear(&of(2, Status::LAST)).unwrap();
    assert_eq!(counters(&bench).device_errors, 1);
    let mut damaged = device_frame(1);
    damaged[3] ^= 1;
    assert!(bench.hear(&damaged).is_err());
    assert!(bench.hear(&damaged[..5]).is_err());
    assert_eq!((counters(&bench).crc_errors, counters(&bench).format_errors), (1, 1));
    let mut idle = Master::new(Config::new());
    assert_eq!(idle.hear(&device_frame(1), 0), Err(Error::WrongState));
}

#[test]
fn frames_of_the_start_up_have_their_states_lengths_and_preambles() {
    let mut idle = Master::new(Config::new());
    assert_eq!(idle.hear(&discovery(2, Place::Inner), 0), Err(Error::WrongState));
    let mut bench = running(Config::new());
    // In the exchange every frame is looked at as a device's.
    let late = bench.master.hear(&discovery(2, Place::Inner), 0).map(|_| ()).map_err(Error::class);
    assert_eq!((late, counters(&bench).format_errors), (Err(ErrorClass::TooLong), 1));
    let lengths = [
        (Outgoing::Discovery { place: Place::Inner }, 1030, 8),
        (Outgoing::Param(Param::request(Parameters::STOCK, Place::Inner)), 40, 8),
        (Outgoing::DelayReq(DelayReq::of_master(Place::Inner)), 8, 8),
        (Outgoing::Sync(Sync::of_master(500, 76, Place::Inner)), 14, 4),
    ];
    for (frame, len, preamble) in lengths {
        let mut buffer = [0; 1030];
        assert_eq!((frame.emit_into(&mut buffer), frame.preamble().bytes().len()), (Ok(len), preamble));
        let (got, want) = (len as u16 - 1, len as u16);
        assert_eq!(frame.emit_into(&mut buffer[..len - 1]), Err(Error::BufferTooSmall { got, want }));
    }
}

/// Two devices have 8 output bytes; 16 are sent all the same, and five have 20.
#[test]
fn the_master_frame_has_as_many_bytes_as_the_line_and_sixteen_at_least() {
    let mut bench = running(Config::new());
    let mut buffer = [0; 64];
    assert_eq!(bench.master.output_len(), 16);
    assert_eq!(bench.master.emit_into(&[1; 16], 7, &mut buffer), Ok(21));
    assert_eq!(bench.master.emit_into(&[1; 8], 7, &mut buffer), Err(Error::OutputLength { got: 8, want: 16 }));
    bench = Bench::new(Config::new().with_cycle_ns(8000).with_sync_frames(2).with_slots(Slots::rule(76)));
    bench.run(|_, frame| Some(answer(frame, 5))).unwrap();
    assert_eq!((bench.master.output_len(), bench.master.network().devices()), (20, 5));
}

/// Taking the enable bit away forgives what has failed before.
#[test]
fn a_disabled_master_has_not_failed() {
    let mut bench = Bench::new(Config::new().with_max_failures(2));
    for _ in 0..3 {
        assert!(bench.run(|_, _| None).is_err());
        assert_eq!(bench.master.state(), State::Idle);
        bench.master.disable();
        bench.master.enable();
    }
    assert!(bench.run(|_, _| None).is_err() && bench.run(|_, _| None).is_err());
    assert_eq!(bench.master.state(), State::Error);
}

/// PARAM frames without an answer count from the start of their phase, not from the start-up before.
#[test]
fn unanswered_frames_of_a_start_up_before_are_forgotten() {
    let mut bench = Bench::new(Config::new().with_param_tries(3));
    for _ in 0..2 {
        let (mut silent, mut bad) = (0, false);
        let end = bench.run(|_, frame| {
            let lost = matches!(frame, Outgoing::Param(_)) && silent < 2;
            silent += u32::from(lost);
            // The first start-up ends in LINE_DELAY, the second one runs.
            bad |= matches!(frame, Outgoing::DelayReq(_));
            (!lost).then(|| answer(frame, 2))
        });
        assert!(end.is_ok() && bad, "{end:?}");
        bench.master.set_link(Link::Down);
        assert!(matches!(bench.master.poll(bench.now_ns), Action::Restart { .. }));
        bench.master.set_link(Link::Up);
    }
    // In the middle of the phase: two are open when the link goes.
    let mut open = Bench::until(Config::new().with_param_tries(3), State::Param);
    open.now_ns += 1_000_000;
    assert!(matches!(open.master.poll(open.now_ns), Action::Send { .. }));
    open.master.set_link(Link::Down);
    open.master.set_link(Link::Up);
    assert!(matches!(open.master.poll(open.now_ns), Action::Restart { .. }));
    let mut silent = 0;
    let end = open.run(|_, frame| {
        let lost = matches!(frame, Outgoing::Param(_)) && silent < 2;
        silent += u32::from(lost);
        (!lost).then(|| answer(frame, 2))
    });
    assert!(end.is_ok(), "{end:?}");
}
