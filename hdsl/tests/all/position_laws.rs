//! Laws of the fast position at all widths and in both dialects: it is the truth or none, and it comes back.

use hdsl::device::{Device, Fault};
use hdsl::master::{Master, State};
use hdsl::registers::Registers;
use hdsl::{Dialect, Doubt, EncoderId, Policy, Sample, Tolerated};

const DIALECTS: [Dialect; 2] = [Dialect::SICK, Dialect::TI];
/// A free-running frame.
pub(super) const FRAME_NS: u64 = 11_520;
/// The low word of the acceleration, ten zeros: no word by either rule.
const BAD_WORD: u64 = 0x3ff << 40;

/// Both ends on a line without delay, the register map beside the receiver, and the truth.
pub(super) struct Link {
    pub(super) master: Master,
    map: Registers,
    device: Device,
    bits: u32,
    position: i64,
    velocity: i64,
    pub(super) sampled_ns: u64,
    /// Where the shaft was, and when.
    past: Vec<(u64, i64)>,
}

impl Link {
    /// An encoder of this width: 11 bits of acceleration, bits 9:4 of the identifier say how many more the position has.
    pub(super) fn new(dialect: Dialect, bits: u32) -> Self {
        let device = Device::new(EncoderId::new(3 | (bits - 11) << 4).unwrap());
        let (master, map, position) = (Master::new(dialect), Registers::new(&dialect), (1 << bits) - 5);
        Self { master, map, device, bits, position, velocity: 0, sampled_ns: 0, past: Vec::new() }
    }

    /// One H-frame; `lost` are bits of the answer that become zero.
    pub(super) fn frame(&mut self, acceleration: i64, lost: u64) -> Result<Sample, Doubt> {
        self.velocity += acceleration;
        self.turn();
        let head = self.master.transmission().head.bits();
        let answer = self.device.set_position(self.position as u64).hear(head);
        let bits = answer.map_or(u64::MAX, |answer| answer.bits & !lost);
        // 91 bits from the edge to the end of the window.
        self.map.apply(self.master.hear_bits(bits, None, self.sampled_ns + 9_707));
        self.safe();
        self.fast()
    }

    /// The shaft goes on to the next sampling edge.
    fn turn(&mut self) {
        self.sampled_ns += FRAME_NS;
        self.position = (self.position + self.velocity).rem_euclid(1 << self.bits);
        self.past.push((self.sampled_ns, self.position));
    }

    /// Law: a safe position is that of its instant.
    fn safe(&self) {
        if let Ok(safe) = self.master.safe().at(self.sampled_ns, Policy::new(u64::MAX)) {
            let (_, truth) = self.past.iter().rev().find(|(when_ns, _)| *when_ns == safe.sampled_ns()).unwrap();
            assert_eq!(safe.position(), *truth, "{} bits", self.bits);
        }
    }

    /// Law: what is given is the truth, by the register map too.
    pub(super) fn fast(&self) -> Result<Sample, Doubt> {
        if let Some(shown) = self.map.pos() {
            assert_eq!(shown, self.position as u64, "{} bits", self.bits);
        }
        let fast = self.master.fast().at(self.sampled_ns, Policy::new(0));
        if let Ok(fast) = fast {
            let truth = (self.position, self.velocity);
            assert_eq!((fast.position(), i64::from(fast.velocity())), truth, "{} bits", self.bits);
        }
        fast
    }

    /// A frame whose answer does not come to the receiver; the head is that of the frame before.
    pub(super) fn lost_frame(&mut self) {
        self.turn();
        let _ = self.device.set_position(self.position as u64).hear(self.master.transmission().head.bits());
    }

    /// A frame whose head the encoder does not hear: it samples nothing and is silent.
    fn unheard_head(&mut self) {
        self.turn();
        self.map.apply(self.master.hear_bits(u64::MAX, None, self.sampled_ns + 9_707));
        let _ = self.fast();
    }

    /// Law: over missing words of a shaft that is not pushed harder than this, the position is within its bound.
    pub(super) fn ridden(&self, words: u8, acceleration: i64) -> Result<Sample, Doubt> {
        let policy = Policy::new(0).tolerating(Tolerated::missing_words(words, acceleration as u16));
        let fast = self.master.fast().at(self.sampled_ns, policy);
        if let Ok(fast) = fast {
            let half = 1 << (self.bits - 1);
            let off = (fast.position() - self.position + half).rem_euclid(1 << self.bits) - half;
            assert!(off.unsigned_abs() <= fast.bound().into(), "{} bits: {off} steps off, {fast:?}", self.bits);
        }
        fast
    }

    /// The largest speed that one V-frame can tell, less a step; an even number of frames get there.
    fn limit(&self) -> i64 {
        (1_i64 << (self.bits - 4)).min(1 << 22) - 1
    }

    /// An acceleration that this width can stand for some frames.
    pub(super) fn push(&self) -> i64 {
        (self.limit() / 24).clamp(1, 300)
    }

    pub(super) fn lock(&mut self) {
        for _ in 0..61 + 5 * 8 {
            let _ = self.frame(0, 0);
        }
        assert_eq!(self.master.state(), State::Running);
        assert!(self.fast().is_ok(), "{} bits: {:?}", self.bits, self.fast());
    }

    /// Law: five V-frames after the last disturbance the position is there, and stays.
    pub(super) fn returns(&mut self) {
        for _ in 0..40 {
            let _ = self.frame(0, 0);
        }
        for _ in 0..16 {
            let fast = self.frame(0, 0);
            assert!(fast.is_ok(), "{} bits: {fast:?} at {} steps a frame", self.bits, self.velocity);
        }
    }
}

pub(super) fn each(mut law: impl FnMut(Link)) {
    for dialect in DIALECTS {
        for bits in 11..=40 {
            law(Link::new(dialect, bits));
        }
    }
}

/// Speed up, past the end of the range, and back: a position in every frame.
#[test]
fn every_width_has_a_position() {
    each(|mut link| {
        link.lock();
        for (push, frames) in [(link.push(), 8), (0, 40), (-link.push(), 16), (0, 40), (link.push(), 8)] {
            for _ in 0..frames {
                assert!(link.frame(push, 0).is_ok());
            }
        }
    });
}

/// One bad acceleration word at each place, at standstill, at speed and while the speed changes.
#[test]
fn after_a_bad_word() {
    for place in 0..8 {
        for push in [0, 1, -1] {
            each(|mut link| {
                link.lock();
                let push = push * link.push();
                for _ in 0..8 + place {
                    let _ = link.frame(push, 0);
                }
                assert!(link.frame(push, BAD_WORD).is_err());
                link.returns();
            });
        }
    }
}

/// The encoder gives no accelerations for a while, after a hard push and with another one within: the estimate is far off.
#[test]
fn after_a_stretch_without_words() {
    for frames in [2, 3, 7, 20, 60] {
        for place in [0, 3, 7] {
            each(|mut link| {
                // TI gives the link up after 31 in a row.
                link.master.set_acceleration_threshold(255);
                link.lock();
                for _ in 0..8 + place {
                    let _ = link.frame(0, 0);
                }
                let push = link.push();
                let _ = link.frame(push, 0);
                link.device.set_fault(Fault::NoAcceleration);
                for frame in 0..frames {
                    assert!(link.frame(if frame % 5 == 1 { -push / 2 } else { 0 }, 0).is_err());
                }
                link.device.set_fault(Fault::None);
                link.returns();
            });
        }
    }
}

/// V-frames without a safe position.
#[test]
fn after_a_safe_block_that_is_no_good() {
    // Three bad blocks in a row end the link.
    for (fault, longest) in [(Fault::BadCrc, 9), (Fault::NoPosition, 40)] {
        for frames in [1, 9, longest] {
            each(|mut link| {
                link.lock();
                for _ in 0..8 {
                    let _ = link.frame(link.push(), 0);
                }
                link.device.set_fault(fault);
                for _ in 0..frames {
                    let _ = link.frame(0, 0);
                }
                link.device.set_fault(Fault::None);
                for _ in 0..8 {
                    let _ = link.frame(0, 0);
                }
                link.returns();
            });
        }
    }
}

/// While words are missing, and until the position is exact again, a policy that tolerates it has a position in every frame.
#[test]
fn over_missing_words() {
    for words in [1, 2, 5, 12] {
        for place in 0..8 {
            each(|mut link| {
                link.lock();
                let push = link.push();
                for _ in 0..8 + place {
                    let _ = link.frame(0, 0);
                }
                link.device.set_fault(Fault::NoAcceleration);
                for _ in 0..words {
                    assert!(link.frame(push, 0).is_err());
                    assert!(link.ridden(words, push).is_ok());
                }
                assert_eq!(link.ridden(words - 1, push), Err(Doubt::Estimated));
                link.device.set_fault(Fault::None);
                for _ in 0..40 {
                    let _ = link.frame(0, 0);
                    assert!(link.ridden(words, push).is_ok());
                }
                assert_eq!(link.ridden(words, push).map(|fast| fast.bound()), Ok(0));
                link.returns();
            });
        }
    }
}

/// An encoder that did not hear a head has not sampled either: what it says next is no second difference from frame to frame, so that
/// no bound holds.
#[test]
fn heads_that_the_encoder_did_not_hear() {
    for place in 0..8 {
        each(|mut link| {
            link.lock();
            for _ in 0..8 + place {
                let _ = link.frame(link.push(), 0);
            }
            link.unheard_head();
            for _ in 0..150 {
                let _ = (link.ridden(255, link.push()), link.frame(0, 0));
            }
            link.returns();
        });
    }
}

/// More words are missing than can be counted in a tolerance.
#[test]
fn over_more_words_than_can_be_tolerated() {
    each(|mut link| {
        link.master.set_acceleration_threshold(255);
        let bits = link.bits;
        link.lock();
        link.device.set_fault(Fault::NoAcceleration);
        for frame in 0..300 {
            let _ = link.frame(if frame / 8 % 2 == 0 { link.push() / 8 } else { -link.push() / 8 }, 0);
            let ridden = link.ridden(255, link.push());
            assert!(link.master.state() != State::Running || ridden.is_ok() == (frame < 255) || bits < 30, "{frame}");
        }
        link.device.set_fault(Fault::None);
        for _ in 0..100 {
            let _ = link.frame(0, 0);
        }
        link.returns();
    });
}

/// Nobody feeds the receiver any more: its last evidence grows old.
#[test]
fn evidence_of_a_silent_host() {
    let mut link = Link::new(Dialect::SICK, 32);
    link.lock();
    let policy = Policy::new(20_000).tolerating(Tolerated::missing_words(255, 1));
    let at = |now_ns| link.master.fast().at(now_ns, policy).err();
    assert_eq!(
        (at(link.sampled_ns + 20_000), at(link.sampled_ns + 20_001)),
        (None, Some(Doubt::Old { age_ns: 20_001 }))
    );
}
