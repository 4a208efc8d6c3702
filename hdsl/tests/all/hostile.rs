//! A hostile line, for encoders of all widths and in both dialects: what is given as a position is the truth, or explained, and it
//! comes back.
//!
//! `HOSTILE_EVENTS=100000000 cargo test --release -p hdsl --test all hostile:: -- --nocapture` runs as many H-frames and prints
//! what happened in them; `SEED` gives others.

use std::collections::BTreeMap;

use hdsl::device::Device;
use hdsl::master::{Master, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::Registers;
use hdsl::{Answer, Dialect, Doubt, EncoderId, Policy, Window};
use servowire_world::{Seed, first_seed};

/// A free-running frame.
const FRAME_NS: u64 = 11_520;
const ANY_AGE: Policy = Policy::new(u64::MAX);

const ANSWER: u64 = u64::MAX >> 3;

struct Noise(u64);

impl Noise {
    /// A stream of its own for each seed, width and dialect.
    fn new(seed: u64, stream: u64) -> Self {
        let mut state = seed.wrapping_mul(1000).wrapping_add(stream).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        for factor in [0xbf58_476d_1ce4_e5b9, 0x94d0_49bb_1331_11eb] {
            state = (state ^ state >> 31).wrapping_mul(factor);
        }
        Self(state ^ state >> 31 | 1)
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, limit: u64) -> u64 {
        ((u128::from(self.next()) * u128::from(limit)) >> 64) as u64
    }
}

/// The motion, and what an encoder without errors would say about it.
struct Motion {
    /// Width of the encoder's position.
    bits: u32,
    velocity: i64,
    /// Positions at the last sampling edges, the newest first.
    positions: [i64; 20],
}

impl Motion {
    fn step(&mut self, noise: &mut Noise) -> i64 {
        // Half of the speed that a V-frame can tell.
        let fastest = (1_i64 << (self.bits - 5)).min(30_000);
        let hardest = (fastest / 24).clamp(1, 40);
        let jerk = noise.below(2 * hardest.unsigned_abs() + 1) as i64 - hardest;
        let wanted = if self.velocity.abs() > fastest { -jerk.abs() * self.velocity.signum() } else { jerk };
        self.velocity += wanted;
        self.positions.rotate_right(1);
        self.positions[0] = self.positions[1] + self.velocity;
        wanted
    }

    /// The position `age` frames ago, as an encoder of this width counts it.
    fn at(&self, age: u8) -> i64 {
        self.positions[usize::from(age)].rem_euclid(1 << self.bits)
    }
}

/// 11 bits of acceleration, and this many of position.
fn id_of(bits: u32) -> EncoderId {
    EncoderId::truncate(3 | (bits - 11) << 4)
}

/// What happens to an answer.
fn damage(noise: &mut Noise, answer: u64, last: u64) -> (&'static str, u64) {
    let flip = |noise: &mut Noise, bits: u64, count: u32| (0..count).fold(bits, |bits, _| bits ^ 1 << noise.below(61));
    match noise.below(1000) {
        0..=3 => ("one flip", flip(noise, answer, 1)),
        4..=6 => ("two flips", flip(noise, answer, 2)),
        7 => ("three flips", flip(noise, answer, 3)),
        8 => ("burst", answer ^ (noise.below(1 << 10)) << noise.below(52)),
        9 => ("stale", last),
        10 => ("silence", ANSWER),
        11 if noise.below(8) == 0 => ("any bits", noise.next() & ANSWER),
        12 if noise.below(8) == 0 => ("inverted", !answer & ANSWER),
        _ => ("clean", answer),
    }
}

#[derive(Default)]
struct Tally {
    events: BTreeMap<&'static str, u64>,
    fast: u64,
    explained: u64,
    safe: u64,
    messages: u64,
    restarts: u64,
    identifiers: u64,
    returned: u64,
}

fn run(dialect: Dialect, width: u32, seed: u64, frames: u64, tally: &mut Tally) {
    let _told = Seed(seed);
    let mut noise = Noise::new(seed, u64::from(width) * 2 + u64::from(dialect == Dialect::TI));
    let id = id_of(width);
    let mut device = Device::new(id);
    device.resources_mut().set_register(RemoteRegister::PING, 0x5a);
    let mut master = Master::new(dialect);
    let mut map = Registers::new(&dialect);
    let mut motion = Motion { bits: width, velocity: 0, positions: [(1 << width) - 5; 20] };
    // Frames since an acceleration word that was wrong and passed all checks.
    let (mut since_poison, mut before_it, mut last, mut quiet) = (u32::MAX, u32::MAX, 0, 0_u32);
    for frame in 0..frames {
        let truth = motion.step(&mut noise);
        let mut head = master.transmission().head.bits();
        let mut damaged = noise.below(2000) == 0;
        if damaged {
            head = Window::from_bits(head.bits() ^ 1 << noise.below(26), head.len()).unwrap();
            *tally.events.entry("head").or_default() += 1;
        }
        let answer = device.set_position(motion.at(0) as u64).hear(head);
        let (event, bits) = damage(&mut noise, answer.map_or(ANSWER, |answer| answer.bits), last);
        *tally.events.entry(event).or_default() += 1;
        damaged |= event != "clean";
        last = answer.map_or(ANSWER, |answer| answer.bits);
        let accepted = Answer::from_bits(dialect.rule, bits).delta_delta();
        let running = master.state() == State::Running;
        let sampled_ns = (frame + 100) * FRAME_NS;
        // 91 bits from the edge to the end of the window.
        let report = master.hear_bits(bits, None, sampled_ns + 9_707);
        map.apply(report);
        tally.restarts += u64::from(report.restarted.is_some());
        for result in [report.finished.short.map(|r| r.map(|a| a.data == Some(0x5a)))].into_iter().flatten() {
            tally.messages += u64::from(result.is_ok());
            assert!(result.unwrap_or(true), "a short message brought other data");
        }
        if let Some(Ok(answer)) = report.finished.long {
            tally.messages += 1;
            assert_eq!(answer.result.unwrap().as_bytes(), b"RESOLUTN");
        }
        let poisoned = running && accepted.is_ok_and(|value| i64::from(value.get()) != truth);
        if poisoned {
            (before_it, since_poison) = (since_poison, 0);
        } else {
            since_poison = since_poison.saturating_add(1);
        }

        // The identifier comes once and without check bits: an application knows which encoder it has and compares. (The line
        // inverted for that one frame gives another one.)
        if master.encoder_id().is_some_and(|known| known != id) {
            tally.identifiers += 1;
            master.request_restart();
            continue;
        }
        // Law: the fast position is the truth; a wrong word that passed CRC-5 is found out at the end of the next V-frame, and two
        // that cancel in the position at the end of theirs by the one after that.
        let fast = master.fast().at(sampled_ns, Policy::new(0));
        let explained = since_poison < if before_it < 24 { 24 } else { 16 };
        if let Ok(fast) = fast {
            tally.fast += 1;
            if (fast.position(), i64::from(fast.velocity())) != (motion.at(0), motion.velocity) {
                assert!(
                    explained,
                    "{width} bits: {fast:?}, truth {} {}, {since_poison} frames after the last bad word, {before_it} before it",
                    motion.at(0),
                    motion.velocity,
                );
                tally.explained += 1;
            }
        }
        // Law: on a good line it comes back, 24 + 32 frames after the last damage at the latest.
        quiet = if damaged || master.state() != State::Running { 0 } else { quiet + 1 };
        if quiet > 56 {
            tally.returned += u64::from(quiet == 57);
            assert!(fast.is_ok(), "{width} bits: {fast:?} after {quiet} good frames, {:?}", master.counters());
        }
        // Law: the safe position is the true one of its time.
        if let Ok(safe) = master.safe().at(sampled_ns, Policy::new(15 * FRAME_NS)) {
            let age = (sampled_ns - safe.sampled_ns()) / FRAME_NS;
            tally.safe += u64::from(age == 8);
            assert_eq!(safe.position(), motion.at(u8::try_from(age).unwrap()), "wrong safe position");
        }
        // Law: before the lock and after a loss there is nothing.
        if master.state() != State::Running {
            assert!(
                master.fast().at(sampled_ns, ANY_AGE) == Err(Doubt::NoLink)
                    && master.safe().at(sampled_ns, ANY_AGE) == Err(Doubt::NoLink)
                    && (map.link() == (master.state() > State::IdReq))
            );
        }
        if noise.below(300) == 0 {
            let _ = master.start_short(ShortRequest::Read(RemoteRegister::PING));
            let _ = master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN));
        }
    }
}

#[test]
fn hostile_frames_give_the_truth_or_nothing() {
    let frames = servowire_world::wanted_events(200_000);
    for dialect in [Dialect::SICK, Dialect::TI] {
        let mut tally = Tally::default();
        for bits in 11..=40 {
            run(dialect, bits, first_seed(), frames / 60, &mut tally);
        }
        println!(
            "{} fast positions, {} of them wrong after words that passed CRC-5; it came back {} times; {} safe positions; \
             {} messages; {} restarts; {} wrong identifiers; {:?}",
            tally.fast,
            tally.explained,
            tally.returned,
            tally.safe,
            tally.messages,
            tally.restarts,
            tally.identifiers,
            tally.events
        );
        assert!(tally.fast > frames / 20 && tally.safe > frames / 200 && tally.messages > 0 && tally.returned > 0);
    }
}
