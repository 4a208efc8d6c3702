//! From the line to the field of a motor, as README and `examples/commutation.rs` put it together, against a shaft in whole numbers:
//! at every instant of use the true field is within the bound. `DRIVES=20000` runs as many drives.

use hdsl::device::Device;
use hdsl::master::{Master, State};
use hdsl::{Dialect, EncoderId, EvidenceShaftCell, Policy, Tolerated};
use servowire_core::{Acceleration, Angle, Commutation, Sense, Tracker};

/// A free-running frame of 108 bits, and the 91 bits from the sampling edge to the end of the window.
const FRAME_NS: u64 = 11_520;
const SINCE_EDGE_NS: u64 = 9_707;
/// A turn, in the units of the shaft; times are in ns.
const TURN: i128 = 1 << 81;
/// A turn per second squared, in half a unit per ns²; rounded down.
const TURN_PER_S2: i128 = (TURN / 2) / 1_000_000_000_000_000_000;
/// Both words of the acceleration channel, all zeros: no words by either rule.
const NO_ACCELERATION: u64 = !(0xf_ffff << 30);

struct Draw(u64);

impl Draw {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

/// A shaft whose acceleration changes from time to time.
struct Shaft {
    position: i128,
    /// Half a unit per ns.
    speed: i128,
    /// Half a unit per ns².
    acceleration: i128,
    now_ns: u64,
}

impl Shaft {
    /// Where it is `ns` later if the acceleration stays, and its speed then.
    fn later(&self, ns: u64) -> (i128, i128) {
        let ns = i128::from(ns);
        (self.position + 2 * self.speed * ns + self.acceleration * ns * ns, self.speed + self.acceleration * ns)
    }

    fn run_to(&mut self, ns: u64) {
        (self.position, self.speed) = self.later(ns - self.now_ns);
        self.now_ns = ns;
    }
}

/// An encoder on a motor, and how the drive is set up.
#[derive(Debug, Clone, Copy)]
struct Drive {
    dialect: Dialect,
    /// Width of a position.
    bits: u32,
    steps_per_turn: u32,
    pole_pairs: u16,
    sense: Sense,
    latency_ns: u16,
    /// The largest acceleration, in turns per second squared.
    turns_per_s2: u32,
    words: u8,
    seed: u64,
}

/// How often the angle was given, and how often over missing words.
#[derive(Debug, Default, Clone, Copy)]
struct Tally {
    angles: u32,
    ridden: u32,
    sharp: u32,
}

impl Drive {
    /// The true field, in 2^-32 turn.
    fn field(&self, offset: u32, position: i128) -> i128 {
        let turned = (position.rem_euclid(TURN) * i128::from(self.pole_pairs)) >> 49;
        let turned = if self.sense == Sense::Up { turned } else { -turned };
        (i128::from(offset) + turned).rem_euclid(1 << 32)
    }

    fn run(&self, frames: u64, tally: &mut Tally) {
        let mut draw = Draw(self.seed);
        let mut master = Master::new(self.dialect);
        // 11 bits of acceleration, and the bits of the position that there are more.
        let mut encoder = Device::new(EncoderId::new(3 | (self.bits - 11) << 4).unwrap());
        master.set_steps_per_turn(self.steps_per_turn);
        master.set_latency_ns(self.latency_ns);
        let offset = draw.below(1 << 31) as u32;
        let commutation = Commutation::new(self.pole_pairs, Angle::from_bits(offset), self.sense).unwrap();
        let acceleration = Acceleration::from_turns_per_s2(self.turns_per_s2).unwrap();
        // In whole steps the second difference is less than 2 more.
        let steps = u64::from(self.turns_per_s2) * u64::from(self.steps_per_turn) * FRAME_NS * FRAME_NS;
        let steps = (steps / 1_000_000_000_000_000_000 + 2).min(1024) as u16;
        let policy = Policy::new(2 * FRAME_NS).tolerating(Tolerated::missing_words(self.words, steps));
        let mut cell = EvidenceShaftCell::new();
        let (mut writer, mut reader) = cell.split(Tracker::new(self.steps_per_turn, 300).unwrap());
        let most = TURN_PER_S2 * i128::from(self.turns_per_s2);
        // At the end of the range, if that is one of whole turns.
        let turns = if self.steps_per_turn.is_power_of_two() {
            (1 << self.bits) / i128::from(self.steps_per_turn)
        } else {
            1000
        };
        let mut shaft = Shaft { position: turns * TURN, speed: 0, acceleration: 0, now_ns: 0 };

        for frame in 0..frames {
            let sampled_ns = FRAME_NS * (frame + 1) + u64::from(self.latency_ns);
            shaft.run_to(sampled_ns);
            if draw.below(3) == 0 {
                shaft.acceleration = most * (i128::from(draw.below(2001)) - 1000) / 1000;
            }
            // Not beyond 100 turns per second.
            if shaft.speed.abs() > 100 * (TURN / 2) / 1_000_000_000 {
                shaft.acceleration = -most * shaft.speed.signum();
            }
            let position = (shaft.position * i128::from(self.steps_per_turn)) >> 81;
            let head = master.transmission().head.bits();
            let sent = if frame > 120 { draw.below(500) } else { u64::MAX };
            // A head that the encoder does not hear: it samples nothing and is silent.
            let answer = if sent == 0 { None } else { encoder.set_position(position as u64).hear(head) };
            let mut bits = answer.map_or(u64::MAX, |answer| answer.bits);
            match sent {
                1 => {
                    // Its block of samples was overwritten.
                    master.skip(1);
                    continue;
                }
                2 => bits = u64::MAX,
                3..23 => bits &= NO_ACCELERATION,
                _ => {}
            }
            let end_ns = FRAME_NS * (frame + 1) + SINCE_EDGE_NS;
            let _ = master.hear_bits(bits, None, end_ns);
            writer.put(master.fast(), end_ns, policy);
            if master.state() != State::Running {
                continue;
            }
            for _ in 0..4 {
                let now_ns = end_ns + draw.below(FRAME_NS);
                let Ok(sample) = reader.at(now_ns, policy) else { continue };
                let field = reader.angle(now_ns, policy, commutation, acceleration).unwrap();
                let bound = i128::from(field.bound.to_bits());
                let truth = self.field(offset, shaft.later(now_ns - sampled_ns).0);
                let off = (i128::from(field.angle.to_bits()) - truth).rem_euclid(1 << 32);
                let off = off.min((1 << 32) - off);
                assert!(off <= bound, "{self:?}: {off} at {now_ns} in frame {frame}, {field:?}, {sample:?}");
                tally.angles += 1;
                tally.ridden += u32::from(sample.bound() != 0);
                tally.sharp += u32::from(bound < 1 << 28);
            }
        }
    }
}

/// Encoders of few and of many steps, also of a number that is no power of two; one pole pair and many; both senses; a shaft pushed
/// to and fro within what was said, words, answers and frames missing.
#[test]
fn the_field_is_within_its_bound() {
    let mut tally = Tally::default();
    for seed in 0..drives() {
        let mut draw = Draw(seed ^ 0x5eed);
        let mut pick = |values: &[u32]| values[draw.below(values.len() as u64) as usize];
        let drive = Drive {
            dialect: [Dialect::SICK, Dialect::TI][pick(&[0, 1]) as usize],
            bits: pick(&[28, 32, 35, 40]),
            steps_per_turn: pick(&[1 << 9, 1 << 12, 1 << 15, 1 << 18, 1 << 20, 36_000, 100_003]),
            pole_pairs: pick(&[1, 2, 3, 4, 7, 25]) as u16,
            sense: [Sense::Up, Sense::Down][pick(&[0, 1]) as usize],
            latency_ns: pick(&[0, 75, 600]) as u16,
            turns_per_s2: pick(&[0, 20, 300, 5_000, 60_000]),
            words: pick(&[1, 4, 8, 30]) as u8,
            seed,
        };
        drive.run(1_000, &mut tally);
    }
    println!("{tally:?}");
    assert!(tally.sharp > tally.angles / 2 && tally.ridden > tally.angles / 20, "{tally:?}");
}

fn drives() -> u64 {
    std::env::var("DRIVES").map_or(if cfg!(miri) { 1 } else { 60 }, |drives| drives.parse().unwrap())
}
