//! DISCOVERY that is sent again instead of starting again.

use crate::common::answer;
use sorte_proto::device::{Config, Device, FrameTimes, PortId, State};
use sorte_proto::master::{self, Master, Outgoing};
use sorte_proto::{Discovery, ErrorClass, Link, Param, Parameters, Place};

/// A damaged answer to DISCOVERY: the published rule starts again; the patient one asks again, two agreeing answers and then the
/// last one until it comes back whole.
#[test]
fn a_patient_master_asks_again() {
    let run = |config: master::Config, damaged: &dyn Fn(usize) -> bool| {
        let mut master = Master::new(config);
        master.set_link(Link::Up);
        let (mut now_ns, mut places) = (0, Vec::new());
        loop {
            match master.poll(now_ns) {
                master::Action::Wait { until_ns } => now_ns = until_ns,
                master::Action::Send { at_ns, frame: Outgoing::Discovery { place } } => {
                    let mut bytes = answer(Outgoing::Discovery { place }, 2);
                    bytes[40] ^= u8::from(damaged(places.len()));
                    places.push(place);
                    let _: Result<_, _> = master.hear(&bytes, at_ns + 1072);
                }
                master::Action::Restart { error } => return (places, Err(error.class())),
                _ => return (places, Ok(master.network().devices())),
            }
        }
    };
    let (config, patient) = (master::Config::new(), master::Config::new().with_patient_discovery(true));
    assert_eq!(run(config, &|n| n == 4).1, Err(ErrorClass::BadFcs));
    let (places, end) = run(patient, &|_| false);
    assert_eq!((places, end), (vec![Place::Inner, Place::Inner, Place::Last], Ok(2)));
    let (places, end) = run(patient, &|n| n < 5 || n == 6 || (8..20).contains(&n));
    assert_eq!((places.len(), end), (21, Ok(2)));
    assert!(places[..8].iter().all(|place| *place == Place::Inner), "{places:?}");
    assert!(places[8..].iter().all(|place| *place == Place::Last), "{places:?}");
    let (places, end) = run(patient.with_discovery_tries(50), &|_| true);
    assert_eq!((places.len(), end), (50, Err(ErrorClass::NoAnswer)));
}

/// Two answers have agreed, and the last one tells another line: it is asked again, and the line has to be the one told last.
#[test]
fn a_patient_master_refuses_a_line_that_changes() {
    let mut master = Master::new(master::Config::new().with_patient_discovery(true));
    master.set_link(Link::Up);
    let (mut now_ns, mut last) = (0, 0);
    loop {
        match master.poll(now_ns) {
            master::Action::Wait { until_ns } => now_ns = until_ns,
            master::Action::Send { at_ns, frame: frame @ Outgoing::Discovery { place } } => {
                last += u8::from(place == Place::Last);
                let devices = if place == Place::Last { 3 } else { 2 };
                master.hear(&answer(frame, devices), at_ns + 1072).unwrap();
            }
            _ => break,
        }
    }
    assert_eq!((last, master.network().devices()), (2, 3));
}

/// A device that has had the last DISCOVERY counts itself in its repetition too, until PARAM comes.
#[test]
fn a_patient_device_takes_a_repeated_discovery() {
    let times = FrameTimes { sof_ns: 0, counter_ns: 0, now_ns: 0 };
    for patient in [false, true] {
        let mut device = Device::new(Config::new().with_patient_discovery(patient));
        device.set_links(Link::Up, Link::Down);
        let counted = |device: &mut Device| {
            let mut frame = Discovery::request(Place::Last).emit();
            assert_eq!(device.hear(PortId::A, &mut frame, times).result, Ok(()));
            Discovery::parse(&frame).unwrap().count
        };
        assert_eq!((counted(&mut device), counted(&mut device)), (1, 1));
        assert_eq!(device.state(), State::Param);
        assert_eq!(counted(&mut device), u16::from(patient));
        let mut param = Param::request(Parameters::CNC, Place::Inner).emit();
        assert_eq!(device.hear(PortId::A, &mut param, times).result, Ok(()));
        assert_eq!((counted(&mut device), device.state()), (0, State::Param));
    }
}
