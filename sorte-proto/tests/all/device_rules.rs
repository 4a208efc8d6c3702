//! Rules of a device, one by one: which frames it listens to at which port, when it gives up, and what it keeps then.

use sorte_proto::Link;
use sorte_proto::Place;
use sorte_proto::device::{Action, Config, Device, FrameTimes, HeardSync, Path, PortId, State, Trigger};
use sorte_proto::{DelayReq, Discovery, Param, Parameters, Status, Sync};

const OTHER: Parameters = Parameters { cycle_time_ns: 31_250, ..Parameters::STOCK };

fn at(now_ns: u64) -> FrameTimes {
    FrameTimes { sof_ns: 77_000, counter_ns: 77_700, now_ns }
}

fn feed(device: &mut Device, port: PortId, frame: &[u8], now_ns: u64) {
    assert_eq!(device.hear(port, &mut frame.to_vec(), at(now_ns)).result, Ok(()));
}

/// DISCOVERY as it comes back from the end of the line.
fn answer(place: Place) -> Vec<u8> {
    let mut frame = Discovery::request(place);
    frame.status |= Status::LAST;
    frame.emit().to_vec()
}

fn param(parameters: Parameters, place: Place) -> Vec<u8> {
    Param::request(parameters, place).emit().to_vec()
}

fn reflect(device: &mut Device, trigger: Trigger) {
    let request = Device::delay_request(trigger).unwrap().emit();
    device.hear_reflection(trigger, &request, 560).unwrap();
}

/// A device with a neighbour, master at port A, both ports in this state; it is measured before SYNC.
fn between(state: State) -> Device {
    let mut device = Device::new(Config::new());
    device.set_links(Link::Up, Link::Up);
    for place in [Place::Inner, Place::Last] {
        if device.state() != state {
            feed(&mut device, PortId::A, &Discovery::request(place).emit(), 0);
            feed(&mut device, PortId::B, &answer(place), 0);
        }
    }
    if device.state() != state {
        for port in [PortId::A, PortId::B] {
            feed(&mut device, port, &param(Parameters::CNC, Place::Last), 0);
        }
    }
    if device.state() != state {
        for n in 1..=16 {
            reflect(&mut device, if n == 16 { Trigger::Last } else { Trigger::Normal });
        }
        feed(&mut device, PortId::A, &DelayReq::of_master(Place::Last).emit(), 0);
    }
    if device.state() != state {
        feed(&mut device, PortId::A, &Sync::of_master(30_500, 76, Place::Last).emit(), 0);
        feed(&mut device, PortId::B, &Sync::of_master(30_500, 76, Place::Last).emit(), 0);
    }
    assert_eq!((device.state(), device.port(PortId::B).state), (state, state));
    device
}

/// The only device of its line, in the IO exchange, with the parameters that it was told.
fn last_in_exchange(parameters: Parameters, sync: Sync) -> Device {
    let mut device = Device::new(Config::new());
    device.set_links(Link::Up, Link::Down);
    for place in [Place::Inner, Place::Last] {
        feed(&mut device, PortId::A, &Discovery::request(place).emit(), 0);
    }
    feed(&mut device, PortId::A, &param(parameters, Place::Last), 0);
    feed(&mut device, PortId::A, &DelayReq::of_master(Place::Last).emit(), 0);
    feed(&mut device, PortId::A, &sync.emit(), 0);
    assert_eq!(device.state(), State::Exchange);
    device
}

#[test]
fn the_last_sync_is_kept_with_its_time() {
    let sync = Sync::of_master(30_500, 76, Place::Last);
    assert_eq!(last_in_exchange(Parameters::CNC, sync).last_sync(), Some(HeardSync { sync, sof_ns: 77_000 }));
}

/// 1 to 1000 are a factor of the cycle; a period of its own begins at 1001 ticks.
#[test]
fn only_a_period_of_its_own_tells_the_long_delay() {
    // 65,621 ns: 85 in the field. Periods of 5000 and 5005 ns; the frame was sent at 500 ns of the first.
    let sync = Sync { time_stamp_ns: 780 + 65_621, delay_ns: 85, ..Sync::of_master(0, 0, Place::Last) };
    let told = |sync_cycle| Parameters { sync_cycle, ..Parameters::CNC };
    assert_eq!(last_in_exchange(told(1000), sync).delay_ns(), Some(85));
    assert_eq!(last_in_exchange(told(1001), sync).delay_ns(), Some(65_621));
}

#[test]
fn losing_the_link_to_the_master_restarts_and_the_other_link_does_not() {
    for (master, [a, b]) in [(PortId::A, [Link::Up, Link::Down]), (PortId::B, [Link::Down, Link::Up])] {
        let mut device = Device::new(Config::new());
        device.set_links(Link::Up, Link::Up);
        feed(&mut device, master, &Discovery::request(Place::Inner).emit(), 0);
        device.set_links(Link::Up, Link::Up);
        assert_eq!(device.state(), State::Discovery);
        device.set_links(a, b);
        assert_eq!((device.state(), device.counters().retrains), (State::Discovery, 0), "{master:?}");
        device.set_links(b, a);
        assert_eq!((device.state(), device.counters().retrains), (State::Idle, 1), "{master:?}");
    }
}

#[test]
fn an_error_outlives_a_restart() {
    let mut device = between(State::Param);
    let mut damaged = param(Parameters::STOCK, Place::Inner);
    damaged[9] ^= 1;
    assert!(device.hear(PortId::A, &mut damaged, at(0)).result.is_err());
    device.reset();
    device.set_links(Link::Up, Link::Down);
    let mut frame = Discovery::request(Place::Inner).emit();
    device.hear(PortId::A, &mut frame, at(0)).result.unwrap();
    assert!(Discovery::parse(&frame).unwrap().status.contains(Status::ERROR));
}

/// What has gone wrong is told once, however often it has.
#[test]
fn errors_do_not_cancel_each_other() {
    for wrong in 1..4 {
        let mut device = between(State::Param);
        for _ in 0..wrong {
            let mut damaged = param(Parameters::STOCK, Place::Inner);
            damaged[9] ^= 1;
            assert!(device.hear(PortId::A, &mut damaged, at(0)).result.is_err());
        }
        device.reset();
        device.set_links(Link::Up, Link::Down);
        for told in [true, false] {
            let mut frame = Discovery::request(Place::Inner).emit();
            device.hear(PortId::A, &mut frame, at(0)).result.unwrap();
            assert_eq!(Discovery::parse(&frame).unwrap().status.contains(Status::ERROR), told, "{wrong}");
        }
    }
}

/// DISCOVERY that a patient master sends again keeps a device in PARAM, and only one that is patient too.
#[test]
fn a_repeated_discovery_keeps_a_patient_device() {
    for (patient, want) in [(true, State::Param), (false, State::Idle)] {
        let mut device = Device::new(Config::new().with_patient_discovery(patient));
        device.set_links(Link::Up, Link::Down);
        for (place, now_ns) in [(Place::Inner, 0), (Place::Last, 0), (Place::Last, 19_000_000)] {
            feed(&mut device, PortId::A, &Discovery::request(place).emit(), now_ns);
        }
        let _action = device.poll(0, 30_000_000);
        assert_eq!(device.state(), want);
    }
}

/// Firmware that does not know where its axis is.
#[test]
fn a_flagged_error_is_told_once() {
    let mut device = last_in_exchange(Parameters::CNC, Sync::of_master(30_500, 76, Place::Last));
    device.flag_error();
    device.reset();
    device.set_links(Link::Up, Link::Down);
    let mut frame = Discovery::request(Place::Inner).emit();
    device.hear(PortId::A, &mut frame, at(0)).result.unwrap();
    assert!(Discovery::parse(&frame).unwrap().status.contains(Status::ERROR));
}

/// Only the frame that the state waits for, at the port that faces the master, keeps a start-up state alive.
#[test]
fn a_start_up_state_waits_20_ms_for_its_own_frame() {
    let mut device = between(State::Param);
    feed(&mut device, PortId::A, &Discovery::request(Place::Inner).emit(), 19_000_000);
    feed(&mut device, PortId::B, &param(Parameters::STOCK, Place::Inner), 19_000_000);
    assert_ne!(device.poll(0, 20_000_000), Action::Restart);
    assert_eq!(device.clone().poll(0, 20_000_001), Action::Restart);
    feed(&mut device, PortId::A, &param(Parameters::STOCK, Place::Inner), 19_000_000);
    assert_ne!(device.poll(0, 39_000_000), Action::Restart);
    assert_eq!(device.poll(0, 39_000_001), Action::Restart);
    assert_eq!(device.state(), State::Idle);
}

#[test]
fn parameters_are_taken_in_their_state_and_from_the_master_only() {
    let mut device = between(State::Param);
    feed(&mut device, PortId::B, &param(OTHER, Place::Inner), 0);
    assert_eq!(device.parameters(), None);
    feed(&mut device, PortId::A, &param(Parameters::CNC, Place::Inner), 0);
    assert_eq!(device.parameters(), Some(Parameters::CNC));
    let mut device = between(State::Sync);
    feed(&mut device, PortId::A, &param(OTHER, Place::Inner), 0);
    assert_eq!((device.parameters(), device.line_delay_next_ns()), (Some(Parameters::CNC), Ok(100)));
}

/// A device whose line was never measured cannot rewrite SYNC. A SYNC frame that is not for its state is no reason.
#[test]
fn an_unmeasured_device_leaves_the_line_in_sync_and_not_before() {
    let sync = Sync::of_master(30_500, 76, Place::Inner).emit();
    for state in [State::Discovery, State::Param, State::LineDelay] {
        let mut device = between(state);
        feed(&mut device, PortId::A, &sync, 0);
        assert_eq!((device.state(), device.counters().retrains), (state, 0));
    }
    let mut device = between(State::LineDelay);
    reflect(&mut device, Trigger::Last);
    assert_eq!(device.port(PortId::B).state, State::Sync);
    feed(&mut device, PortId::B, &sync, 0);
    assert_eq!(device.state(), State::LineDelay);
    feed(&mut device, PortId::A, &DelayReq::of_master(Place::Last).emit(), 0);
    assert!(device.hear(PortId::A, &mut sync.to_vec(), at(0)).result.is_err());
    assert_eq!((device.state(), device.counters().retrains), (State::Idle, 1));
}

#[test]
fn in_line_delay_nothing_passes_and_in_the_exchange_the_last_device_ends_the_line() {
    let device = between(State::LineDelay);
    let path = |device: &Device, port| device.passage(port).path();
    assert_eq!([path(&device, PortId::A), path(&device, PortId::B)], [Some(Path::Reflect), Some(Path::Absorb)]);
    let device = between(State::Exchange);
    assert_eq!([path(&device, PortId::A), path(&device, PortId::B)], [Some(Path::Forward); 2]);
    let last = last_in_exchange(Parameters::CNC, Sync::of_master(30_500, 76, Place::Last));
    assert_eq!(path(&last, PortId::A), Some(Path::Absorb));
}

#[test]
fn the_last_measurement_and_no_other_takes_the_reverse_port_to_sync() {
    let mut device = between(State::LineDelay);
    for _ in 0..15 {
        reflect(&mut device, Trigger::Normal);
        assert_eq!(device.port(PortId::B).state, State::LineDelay);
    }
    reflect(&mut device, Trigger::Last);
    assert_eq!((device.port(PortId::A).state, device.port(PortId::B).state), (State::LineDelay, State::Sync));
    // Without a master there is no reverse port.
    let mut idle = Device::new(Config::new());
    reflect(&mut idle, Trigger::Last);
    assert_eq!([idle.port(PortId::A).state, idle.port(PortId::B).state], [State::Idle; 2]);
}

/// Only a frame on its way out is rewritten; what comes back from the end of the line passes as it is.
#[test]
fn what_comes_back_passes_unchanged() {
    let sync = Sync::of_master(30_500, 76, Place::Inner).emit().to_vec();
    for (state, frame) in [(State::Discovery, answer(Place::Inner)), (State::Sync, sync)] {
        let (mut device, mut passing) = (between(state), frame.clone());
        assert_eq!(device.hear(PortId::B, &mut passing, at(0)).path, Path::Forward);
        assert_eq!(passing, frame, "{state:?}");
    }
}

/// A device was the last one at port A; then another was plugged in behind it, and the master came in at B.
#[test]
fn a_device_that_is_no_longer_last_looks_for_its_master_anew() {
    let mut device = Device::new(Config::new());
    device.set_links(Link::Up, Link::Down);
    assert_eq!(device.master_port(), Some(PortId::A));
    device.set_links(Link::Up, Link::Up);
    assert_eq!((device.master_port(), device.is_last()), (None, false));
    feed(&mut device, PortId::B, &Discovery::request(Place::Inner).emit(), 0);
    assert_eq!(device.master_port(), Some(PortId::B));
    assert_eq!(device.port(PortId::A).state, State::Idle);
}

/// What it has counted stays, whoever makes it start again.
#[test]
fn counters_outlive_a_restart() {
    let mut device = between(State::Param);
    let before = device.counters();
    assert!(before.good_frames > 0 && before.a.good_frames > 0 && before.b.good_frames > 0);
    device.reset();
    let after = device.counters();
    assert_eq!(
        (after.good_frames, after.a, after.b, after.master),
        (before.good_frames, before.a, before.b, before.master)
    );
    assert_eq!(after.retrains, before.retrains + 1);
}

/// 254 devices with the longest cables that can be measured are 8 times 65,536 ns away.
#[test]
fn the_long_delay_goes_up_to_eight_wraps() {
    for wraps in 0..=9_u32 {
        let delay = wraps * 65_536 + 85;
        let sync = Sync { time_stamp_ns: 780 + delay, delay_ns: 85, ..Sync::of_master(0, 0, Place::Last) };
        assert_eq!(sync.long_delay_ns(1_000_000), (wraps <= 8).then_some(delay), "{wraps}");
    }
}
