//! The A-format driver on the hostile line.

#![cfg(feature = "nikon")]
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

use std::cell::RefCell;
use std::collections::VecDeque;
use std::convert::Infallible;
use std::rc::Rc;

use nikon_aformat::device::Device;
use nikon_aformat::master::Line;
use nikon_aformat::{BitRate, EncoderAddress, RequestFrame, Resolution};
use servowire_drivers::nikon::{Encoder, Frame, FramePort};
use servowire_drivers::{Clock, Error};
use servowire_world::{
    Event, Fault, Framing, Host, Id, Kind, Message, Planned, Rates, Scenario, Script, Tally, Transmission, Verdict,
    Wire, World,
};

/// 2.5 Mbit/s: a frame is 7.2 us.
const WIRE: Wire = Wire { bit_ps: 400_000, framing: Framing::StartStop { width: 16 }, devices: 1 };
const LOOK_NS: u64 = 100;
const RATES: Rates = Rates { per_million: [6_000; Kind::ALL.len()], longest_ns: 60_000 };

struct Bench {
    world: World,
    encoder: Device<1>,
    fifo: VecDeque<Frame>,
    shaft: u32,
    request: Option<Id>,
}

impl Bench {
    fn new(scenario: Scenario) -> Rc<RefCell<Self>> {
        let encoder = Device::new(EncoderAddress::ZERO, Resolution::default(), BitRate::Mbit2_5);
        let world = World::new(WIRE, scenario);
        Rc::new(RefCell::new(Self { world, encoder, fifo: VecDeque::new(), shaft: 0, request: None }))
    }

    fn pass(&mut self, until_ns: u64) {
        loop {
            match self.world.next(until_ns) {
                Event::Time { .. } => return,
                Event::Delivered(block) => self.fifo.extend(block.units.iter().map(|unit| {
                    let (content, framed) = unit.bits.content();
                    Frame { content: content as u16, framed }
                })),
                Event::Heard { unit, .. } => {
                    let (content, framed) = unit.bits.content();
                    self.shaft += 1;
                    self.encoder.set_position(self.shaft, 3);
                    if !framed {
                        self.encoder.framing_error(unit.end_ns);
                    } else if let Some(answer) = self.encoder.frame(content as u16, unit.end_ns) {
                        let contents = answer.raw.contents().iter().map(|content| u64::from(*content));
                        let message = Message::frames(16, contents).tagged(self.shaft.into());
                        self.world.answer(0, unit.origin.transmission, &message, answer.at_ns);
                    }
                }
            }
        }
    }
}

#[derive(Clone)]
struct Port(Rc<RefCell<Bench>>);

impl FramePort for Port {
    type Error = Infallible;

    fn send(&mut self, frames: &[RequestFrame], gap_bits: u32) -> Result<(), Infallible> {
        let contents = frames.iter().map(|frame| u64::from(frame.content()));
        let message = Message::frames(16, contents).with_gap_bits(gap_bits as usize);
        let mut bench = self.0.borrow_mut();
        let now_ns = bench.world.now_ns();
        bench.request = Some(bench.world.send(&message, now_ns));
        Ok(())
    }

    fn take(&mut self) -> Result<Option<Frame>, Infallible> {
        Ok(self.0.borrow_mut().fifo.pop_front())
    }
}

impl Clock for Port {
    fn now_ns(&mut self) -> u64 {
        let mut bench = self.0.borrow_mut();
        let until_ns = bench.world.now_ns() + LOOK_NS;
        bench.pass(until_ns);
        bench.world.now_ns()
    }
}

fn driver(bench: &Rc<RefCell<Bench>>) -> Encoder<Port, Port> {
    let port = Port(bench.clone());
    let line = Line::new(BitRate::Mbit2_5).with_response_timeout_ns(20_000);
    Encoder::new(port.clone(), port, EncoderAddress::ZERO, Resolution::default(), line)
}

#[test]
fn positions_come() {
    let bench = Bench::new(Scenario::quiet());
    let mut encoder = driver(&bench);
    for turn in 1..=10_u64 {
        let abs = encoder.read_abs40().unwrap().response.abs40().unwrap().get();
        assert_eq!(abs, turn | 3 << 20);
    }
    assert_eq!(bench.borrow().world.truth().clashes(), 0);
}

/// Each fault alone, in the first exchange: the second one is good. (Noise makes the encoder deaf for the next request, which
/// is not the driver's to mend.)
#[test]
fn any_fault_is_over_with_the_next_call() {
    let faults = [
        Fault::Drop,
        Fault::Flip { bit: 4 },
        Fault::Flip { bit: 17 },
        Fault::Idle { bits: 20 },
        Fault::Cut,
        Fault::Delay { ns: 12_000 },
        Fault::Preempt { ns: 300_000 },
    ];
    for fault in faults {
        for (transmission, units) in [(0, 1), (1, 4)] {
            for unit in 0..units {
                let script = Script::planned(vec![Planned { transmission, unit, fault }]);
                let bench = Bench::new(Scenario { script, ..Scenario::quiet() });
                let mut encoder = driver(&bench);
                let first = encoder.read_abs40();
                let second = encoder.read_abs40();
                assert!(second.is_ok(), "{fault:?} in unit {unit} of {transmission}: {first:?}, {second:?}");
            }
        }
    }
}

/// No value older than its request, and no good answer lost, whatever has happened before.
#[test]
fn hostile_events_are_survived() {
    let events = std::env::var("HOSTILE_EVENTS").ok().and_then(|events| events.parse().ok()).unwrap_or(100_000);
    let (mut sum, mut seed, mut good, mut failed) = (Tally::default(), 0, 0, 0);
    while sum.events() < events {
        let scenario = Scenario::random(seed, RATES);
        let host = Host { echo: scenario.host.echo, ..Host::IDEAL };
        let bench = Bench::new(Scenario { host, ..scenario });
        let mut encoder = driver(&bench);
        for call in 0..100 {
            let before = bench.borrow().world.tally().of(Kind::Preempt);
            let result = encoder.read_abs40();
            let mut bench = bench.borrow_mut();
            let Some(request) = bench.request else { continue };
            let preempted = bench.world.tally().of(Kind::Preempt) > before;
            let truth = bench.world.truth();
            let sent_ns = truth.transmission(request).unwrap().sent_ns;
            let on_time =
                |answer: &Transmission| answer.start_ns < sent_ns + 15_000 && answer.end_ns - answer.start_ns == 28_800;
            let whole = !preempted && truth.undisturbed(request) && truth.intact_answers(request).any(on_time);
            match result {
                Ok(reading) => {
                    let shaft = reading.response.abs40().unwrap().get() & 0xf_ffff;
                    let verdict = truth.verdict(request, shaft);
                    assert!(
                        preempted || !matches!(verdict, Verdict::Old { .. }),
                        "seed {seed}, call {call}: {verdict:?}"
                    );
                    good += 1;
                }
                Err(Error::Protocol(error)) => {
                    assert!(!whole, "seed {seed}, call {call}: {error}");
                    failed += 1;
                }
                Err(error) => panic!("{error:?}"),
            }
            let past_ns = bench.world.now_ns().saturating_sub(1_000_000);
            bench.world.truth_mut().forget_before(past_ns);
        }
        sum.add(bench.borrow().world.tally());
        seed += 1;
    }
    println!("{sum}\n{good} good, {failed} failed");
    assert!(good > failed && failed > 100);
}
