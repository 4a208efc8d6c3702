//! Captures of a SORTE network under many conditions.

use std::io::Cursor;

use servowire_decode::capture::{self, Hints, Input};
use servowire_decode::event::{Direction, Place};
use servowire_decode::settings::Settings;

use super::packets::{Check, File, Network, Packet, Side, build};
use super::rng::Rng;
use super::{Outcome, Said, Shown, hold, judge, read};

/// A date: 2026.
const TODAY: u64 = 1_780_000_000_123_456_789;

const PLAIN: File = File { check: Check::Told, epoch: 0, units: 9, big: false };

type Condition = fn(&mut Rng) -> (Network, File);

fn network(rng: &mut Rng) -> Network {
    Network { devices: 1 + rng.below(4) as usize, ..Network::PLAIN }
}

const CONDITIONS: &[(&str, Condition)] = &[
    ("the check is told", |rng| (network(rng), PLAIN)),
    ("the check is not told", |rng| (network(rng), File { check: Check::Untold, ..PLAIN })),
    ("the check is stripped", |rng| (network(rng), File { check: Check::Stripped, ..PLAIN })),
    ("stripped and padded", |rng| (network(rng), File { check: Check::Padded, ..PLAIN })),
    ("today, in ns", |rng| (network(rng), File { epoch: TODAY, ..PLAIN })),
    ("today, in us, as a card has it", |rng| {
        (network(rng), File { epoch: TODAY, units: 6, check: Check::Padded, ..PLAIN })
    }),
    ("stamps of a power of two", |rng| (network(rng), File { epoch: TODAY, units: 0x9e, ..PLAIN })),
    ("the other order of bytes", |rng| (network(rng), File { big: true, epoch: TODAY, ..PLAIN })),
    ("5 to 254 devices", |rng| (Network { devices: 5 + rng.below(250) as usize, cycles: 3, ..Network::PLAIN }, PLAIN)),
    ("bits flipped", |rng| {
        (Network { damaged: 0.2, ..network(rng) }, File { check: rng.pick(&[Check::Told, Check::Untold]), ..PLAIN })
    }),
    ("frames missing", |rng| (Network { missing: 0.3, ..network(rng) }, PLAIN)),
    ("frames cut off", |rng| (Network { cut: 0.2, ..network(rng) }, PLAIN)),
    ("foreign traffic", |rng| {
        (Network { foreign: 0.5, ..network(rng) }, File { check: rng.pick(&[Check::Told, Check::Padded]), ..PLAIN })
    }),
    ("everything at once", |rng| {
        let network = Network { foreign: 0.2, damaged: 0.1, missing: 0.1, cut: 0.1, ..network(rng) };
        (network, File { epoch: TODAY, units: 6, big: rng.chance(0.5), ..PLAIN })
    }),
];

/// What is said of each packet in this file.
fn told(file: &File, packets: &[Packet]) -> Vec<Said> {
    let one = |packet: &Packet| {
        let mut said = packet.said.clone()?;
        said.start = file.stamp(packet.ns).1;
        let startup = packet.side != Side::Exchange;
        // What is cut off may be just the check.
        if startup && (matches!(file.check, Check::Stripped | Check::Padded) || said.damaged) {
            said.fields.push(("FCS", Shown::Text("not captured".to_owned())));
        }
        Some(said)
    };
    packets.iter().filter_map(one).collect()
}

fn judged(file: &File, bytes: Vec<u8>, packets: &[Packet]) -> Outcome {
    let capture = capture::open(Input::over("network", Cursor::new(bytes)), Hints::default()).unwrap();
    let (events, notes) = read(capture, None, &Settings::default());
    let said = told(file, packets);
    // Stamps are as coarse as the file; the order of the packets tells which is which.
    let mut outcome = judge(&events, &said, 0.5, |_, _| true);
    if events.len() != said.len() {
        outcome.wrong.push(format!("{} events of {} packets", events.len(), said.len()));
    }
    // What was sent is a request, what came an answer, and each takes the time of its bytes.
    let own = packets.iter().filter(|packet| packet.said.is_some());
    for (event, packet) in events.iter().zip(own) {
        let due = match packet.side {
            Side::Ethernet { inbound } => Some(if inbound { Direction::Answer } else { Direction::Request }),
            Side::Exchange => None,
        };
        let long = file.bytes(packet).len() as i64 * 80_000;
        let place = matches!(event.place, Place::Time { start, end } if end - start == long);
        // A file of one interface does not say who sent what.
        if !(event.direction == due || event.direction.is_none() && bytes_of_pcap(&events)) || !place {
            outcome.wrong.push(format!("{due:?}, {long} ps: {event:?}"));
        }
    }
    let foreign = packets.iter().filter(|packet| packet.said.is_none()).count();
    // Named once, with their numbers.
    if notes.matches("were skipped").count() != usize::from(foreign > 0) {
        outcome.wrong.push(notes.clone());
    }
    outcome.notes = notes;
    outcome
}

/// Whether nobody says who sent what.
fn bytes_of_pcap(events: &[servowire_decode::event::Event]) -> bool {
    events.iter().all(|event| event.direction.is_none())
}

fn run(name: &str, condition: Condition, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed ^ 0x0050_7274 ^ (name.len() as u64) << 32);
    let (network, file) = condition(&mut rng);
    let packets = build(&network, seed);
    judged(&file, file.pcapng(&packets), &packets)
}

#[test]
fn every_value_of_a_network_is_true() {
    hold(CONDITIONS, run);
}

/// A file of one interface holds the start-up alone.
fn run_startup(name: &str, condition: Condition, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed ^ 0x0070_6361 ^ (name.len() as u64) << 32);
    let (network, file) = condition(&mut rng);
    let file = File { check: if file.check == Check::Told { Check::Untold } else { file.check }, units: 9, ..file };
    let mut packets = build(&network, seed);
    packets.retain(|packet| packet.side != Side::Exchange);
    judged(&file, file.pcap(&packets), &packets)
}

#[test]
fn every_value_of_a_pcap_is_true() {
    hold(CONDITIONS, run_startup);
}

/// Frames that have by chance the bytes of an EtherType where ordinary traffic has it, and were skipped as such.
#[test]
fn what_was_once_skipped_is_shown() {
    let (name, condition) = CONDITIONS.iter().find(|(name, _)| *name == "5 to 254 devices").unwrap();
    for (outcome, seed) in [(run(name, *condition, 33), 33), (run_startup(name, *condition, 52), 52)] {
        assert!(outcome.is_right(), "{}", outcome.told(name, seed));
    }
}
