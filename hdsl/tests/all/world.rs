//! Both ends on the hostile line of `tests/world`, which knows nothing of them: it drops, delays, repeats, cuts and flips what
//! they send, and lets others speak. Both hear it as samples.
//!
//! `HOSTILE_EVENTS=1000000 cargo test --release -p hdsl --test all world:: -- --nocapture` runs as many H-frames and prints what
//! happened in them; `SEED` gives others.

use hdsl::device::{Device, Heard};
use hdsl::master::{Master, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::sampling::WINDOW;
use hdsl::{Answer, Dialect, EncoderId, Policy, Window};
use servowire_world::{
    Bits, Event, Framing, Kind, Message, Rates, Scenario, Seed, Tally, Wire, World, first_seed, wanted_events,
};

/// A bit at 9.375 MBaud, a sample of it, and an H-frame of 108 bits.
const BIT_PS: u64 = 106_667;
const SAMPLE_PS: u64 = 13_333;
const FRAME_NS: u64 = 11_520;
/// For what is asked in the frame itself.
const ANY_AGE: Policy = Policy::new(u64::MAX);
/// 32 bits of position.
const ID: u32 = 0x00153;

/// Line bits, the first in bit 0.
fn message(bits: u128, len: u32) -> Message {
    let mut all = Bits::new();
    (0..len).for_each(|at| all.push(bits >> at & 1 == 1));
    Message::new(vec![all])
}

/// The line from then on as both ends sample it, the first sample of a byte in bit 7.
fn sampled(world: &World, from_ns: u64, bytes: usize) -> Vec<u8> {
    let samples = world.truth().sampled(from_ns, bytes * 8, SAMPLE_PS, BIT_PS);
    samples.into_iter().map(u8::reverse_bits).collect()
}

/// Lets the time pass; nobody takes what is handed over, for both ends sample.
fn wait(world: &mut World, until_ns: u64) {
    while !matches!(world.next(until_ns), Event::Time { .. }) {}
}

/// A motion that turns round now and then: its position in each frame, and the second difference there.
struct Motion {
    positions: [i64; 20],
    velocity: i64,
    acceleration: i64,
}

impl Motion {
    fn step(&mut self, frame: u64) {
        self.acceleration = if frame / 600 % 2 == 0 { 7 } else { -7 };
        self.velocity += self.acceleration;
        self.positions.rotate_right(1);
        self.positions[0] = self.positions[1] + self.velocity;
    }
}

#[derive(Debug, Default)]
struct Seen {
    fast: u64,
    explained: u64,
    safe: u64,
    messages: u64,
    restarts: u64,
    undisturbed: u64,
}

fn run(dialect: Dialect, seed: u64, frames: u64, rates: Rates) -> (Seen, Tally) {
    let mut scenario = Scenario::random(seed, rates);
    // The host hears through its samples; what the world would hand over counts as heard at once.
    scenario.host = Scenario::quiet().host;
    let mut world = World::new(Wire { bit_ps: BIT_PS, framing: Framing::Block, devices: 1 }, scenario);
    let (mut master, mut device) = (Master::new(dialect), Device::new(EncoderId::new(ID).unwrap()));
    device.resources_mut().set_register(RemoteRegister::PING, 0x5a);
    let mut motion = Motion { positions: [1 << 31; 20], velocity: 0, acceleration: 0 };
    let (mut seen, mut since_poison) = (Seen::default(), u32::MAX);
    for frame in 0..frames {
        motion.step(frame);
        let begin_ns = (frame + 1) * FRAME_NS;
        let head = master.transmission().head.bits();
        let request = world.send(&message(head.bits(), head.len()), begin_ns);
        // The end of PARA: the encoder has heard it, or not.
        wait(&mut world, begin_ns + 26 * BIT_PS / 1000 + 1);
        let position = motion.positions[0] as u64;
        let line = sampled(&world, begin_ns, 48);
        if let Some(heard) = Heard::on_line(&line) {
            let samples = u64::from(heard.start) + 8 * u64::from(heard.bits.len()) + 8;
            if let Some(answer) = device.set_position(position).hear(heard.bits) {
                world.answer(0, request, &message(answer.bits.into(), 61), begin_ns + samples * SAMPLE_PS / 1000 + 20);
            }
        } else {
            let _ = device.set_position(position).hear(Window::EMPTY);
        }
        // The receiver samples from one bit after PARA on.
        let receive_ns = begin_ns + 27 * BIT_PS / 1000;
        wait(&mut world, receive_ns + 72 * BIT_PS / 1000);
        let samples = sampled(&world, receive_ns, WINDOW);
        let running = master.state() == State::Running;
        let accepted = master.alignment().and_then(|alignment| alignment.bits(&samples).ok());
        let accepted = accepted.map(|bits| Answer::from_bits(dialect.rule, bits).delta_delta());
        let words = master.counters().words;
        let report = *master.hear(&samples, world.now_ns()).unwrap();
        seen.restarts += u64::from(report.restarted.is_some());
        let poisoned = running && matches!(accepted, Some(Ok(value)) if i64::from(value.get()) != motion.acceleration);
        since_poison = if poisoned { 0 } else { since_poison.saturating_add(1) };

        // Law: an answer that came whole and in its time, with nobody else on the line, is read without a bad word.
        let truth = world.truth();
        let punctual = |id| truth.transmission(id).is_some_and(|sent| sent.start_ns == sent.asked_ns);
        let answered = truth.intact_answers(request).any(|answer| punctual(answer.id));
        if running && punctual(request) && truth.undisturbed(request) && answered {
            seen.undisturbed += 1;
            assert_eq!(master.counters().words, words, "frame {frame}");
        }
        // Law: a position is the true one of its instant, or none. A word that was wrong and passed all checks is found out at the
        // end of the next V-frame.
        if let Ok(fast) = master.fast().at(begin_ns, ANY_AGE) {
            seen.fast += 1;
            if (fast.position(), i64::from(fast.velocity())) != (motion.positions[0], motion.velocity) {
                assert!(
                    since_poison < 16,
                    "frame {frame}: {fast:?}, truth {} {}",
                    motion.positions[0],
                    motion.velocity
                );
                seen.explained += 1;
            }
        }
        if let Ok(safe) = master.safe().at(begin_ns, ANY_AGE) {
            seen.safe += 1;
            let age = (begin_ns + FRAME_NS / 2 - safe.sampled_ns()) / FRAME_NS;
            assert_eq!(safe.position(), motion.positions[age as usize], "frame {frame}");
        }
        // Law: a message brings what the encoder holds, or an error.
        if let Some(Ok(answer)) = report.finished.short {
            seen.messages += 1;
            assert_eq!(answer.data, Some(0x5a));
        }
        if let Some(Ok(answer)) = report.finished.long {
            seen.messages += 1;
            assert_eq!(answer.result.unwrap().as_bytes(), b"RESOLUTN");
        }
        if frame % 300 == 0 {
            let _ = master.start_short(ShortRequest::Read(RemoteRegister::PING));
            let _ = master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN));
        }
        world.truth_mut().forget_before(begin_ns.saturating_sub(8 * FRAME_NS));
    }
    (seen, *world.tally())
}

/// What can happen to a line between two that keep their own time.
const KINDS: [Kind; 8] =
    [Kind::Drop, Kind::Flip, Kind::Idle, Kind::Cut, Kind::Delay, Kind::Noise, Kind::Foreign, Kind::Repeat];

#[test]
fn the_laws_hold_on_a_hostile_line() {
    let frames = wanted_events(20_000);
    let quiet = Rates { longest_ns: 30_000, ..Rates::QUIET };
    let rates = KINDS.into_iter().fold(quiet, |rates, kind| rates.with(kind, 300));
    for seed in [1, 2].map(|seed| seed + 2 * first_seed()) {
        let _told = Seed(first_seed());
        let (seen, tally) = run(Dialect::SICK, seed, frames / 2, rates);
        println!("{seen:?}\n{tally}");
        assert!(
            seen.fast > frames / 10 && seen.safe > frames / 10 && seen.messages > 0 && seen.undisturbed > frames / 4
        );
    }
}

/// Without faults there is no bad frame, in either dialect.
#[test]
fn a_quiet_line() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let (seen, _) = run(dialect, 1, 3000, Rates::QUIET);
        assert_eq!((seen.explained, seen.restarts), (0, 0));
        assert!(seen.fast > 2900 && seen.messages >= 18, "{seen:?}");
    }
}
