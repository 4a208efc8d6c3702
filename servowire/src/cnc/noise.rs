//! Bit errors on the cables, seeded.

use std::rc::Rc;

/// A stream of bits, each of which is wrong with the same probability.
///
/// Only the distances between errors are drawn, so a clean frame costs a subtraction.
#[derive(Debug, Clone)]
pub(super) struct Noise {
    random: SplitMix64,
    /// ln(1 - rate); 0 without errors.
    ln_good: f64,
    /// Good bits before the next error.
    good: u64,
    /// Errors so far.
    pub(super) flips: u64,
}

impl Noise {
    pub(super) fn new(bit_error_rate: f64, seed: u64) -> Self {
        let mut noise = Self { random: SplitMix64(seed), ln_good: (-bit_error_rate).ln_1p(), good: u64::MAX, flips: 0 };
        noise.good = noise.distance();
        noise
    }

    fn distance(&mut self) -> u64 {
        if self.ln_good == 0.0 { u64::MAX } else { (self.random.unit().ln() / self.ln_good) as u64 }
    }

    /// Passes a frame over this many cables, one after the other.
    pub(super) fn travel(&mut self, frame: &mut [u8], cables: usize) {
        let bits = frame.len() as u64 * 8 * cables as u64;
        if self.good >= bits {
            self.good -= bits;
            return;
        }
        for _ in 0..cables {
            self.pass(frame);
        }
    }

    /// Passes a frame over a cable; returns whether it was hit.
    pub(super) fn pass(&mut self, frame: &mut [u8]) -> bool {
        let bits = frame.len() as u64 * 8;
        if self.good >= bits {
            self.good -= bits;
            return false;
        }
        let mut at = 0;
        while self.good < bits - at {
            at += self.good;
            if let Some(byte) = frame.get_mut((at / 8) as usize) {
                *byte ^= 1 << (at % 8);
            }
            at += 1;
            self.flips += 1;
            self.good = self.distance();
        }
        self.good -= bits - at;
        true
    }
}

impl Noise {
    /// The same for a frame that other devices also hold.
    pub(super) fn pass_shared(&mut self, frame: &mut Rc<Vec<u8>>) {
        let bits = frame.len() as u64 * 8;
        if self.good >= bits {
            self.good -= bits;
        } else {
            let frame: &mut Vec<u8> = Rc::make_mut(frame);
            self.pass(frame);
        }
    }
}

/// A small generator of random numbers (Steele, Lea and Flood, 2014), so that a seed always gives the same run.
#[derive(Debug, Clone)]
pub(super) struct SplitMix64(pub(super) u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ mixed >> 31
    }

    /// Returns a number from -`most` to `most`.
    pub(super) fn either(&mut self, most: f64) -> f64 {
        (self.unit() - 0.5) * 2.0 * most
    }

    /// Returns a number above 0 and at most 1.
    pub(super) fn unit(&mut self) -> f64 {
        ((self.next() >> 11) + 1) as f64 / (1u64 << 53) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_the_rate() {
        let mut noise = Noise::new(1e-3, 1);
        let mut hit = 0;
        for _ in 0..10_000 {
            let mut frame = [0u8; 100];
            noise.pass(&mut frame);
            hit += frame.iter().map(|byte| u64::from(byte.count_ones())).sum::<u64>();
        }
        assert_eq!(hit, noise.flips);
        assert!((7500..8500).contains(&hit), "{hit} of 8 million bits");
    }

    #[test]
    fn many_cables_are_one_after_the_other() {
        let (mut one, mut many) = (Noise::new(2e-3, 5), Noise::new(2e-3, 5));
        for cables in (0..200).map(|k| k % 7) {
            let (mut a, mut b) = ([0u8; 30], [0u8; 30]);
            (0..cables).for_each(|_| {
                one.pass(&mut a);
            });
            many.travel(&mut b, cables);
            assert_eq!((a, one.flips, one.good), (b, many.flips, many.good));
        }
        assert!(one.flips > 100);
    }

    #[test]
    fn no_rate_no_errors_and_all_errors() {
        let mut frame = [0u8; 21];
        assert!(!Noise::new(0.0, 7).pass(&mut frame));
        assert!(Noise::new(1.0, 7).pass(&mut frame));
        assert_eq!(frame, [0xff; 21]);
    }
}
