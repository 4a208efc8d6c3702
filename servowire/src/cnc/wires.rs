//! The wires of the line: what is on them and when, and what happens to it.
//!
//! Nothing here knows the protocol or uses a number from its crate: only bytes, times, and the figures of the published
//! hardware.

use std::cell::Cell;
use std::collections::VecDeque;
use std::rc::Rc;

use super::noise::{Noise, SplitMix64};

/// A byte at 100 Mbit/s.
pub(super) const BYTE_NS: f64 = 80.0;
/// Time from the first bit at a port to the first bit that its device forwards: 64 register steps of 5 ns, and 35 ns of
/// hardware.
const TRANSIT_NS: f64 = 355.0;
/// The same for a port that sends a frame back, as measured by the master, and as measured by a neighbouring device.
pub(super) const REFLECTION_NS: f64 = 320.0;
pub(super) const NEIGHBOUR_NS: f64 = 360.0;
/// Devices differ by half a tick of 200 MHz either way.
const SPREAD_NS: f64 = 2.5;
/// Longest cable of 100BASE-TX, at 5 ns a metre.
pub(super) const LONGEST_CABLE_NS: u16 = 500;
/// Wires forget their frames after this time.
const FORGOTTEN_NS: f64 = 1e6;
/// A duplicated frame arrives again after this time.
const AGAIN_NS: f64 = 6000.0;

/// Time from the first bit of a frame to the capture of its start, half a byte before the end of 0xD5.
pub(super) fn capture_ns(preamble: usize) -> f64 {
    preamble as f64 * BYTE_NS - 40.0
}

/// Whether a frame has met another one on its way.
pub(super) type Hit = Rc<Cell<bool>>;

struct Busy {
    start: f64,
    end: f64,
    hit: Hit,
}

/// What the line does to frames.
#[derive(Debug, Clone, Copy)]
pub(super) struct Physics {
    /// How much longer the way back over a cable takes than the way out, in ns.
    pub(super) asymmetry_ns: f64,
    /// Rms jitter that each port adds to a frame, in ns.
    pub(super) hop_jitter_ns: f64,
    /// Largest error of a capture, in ns.
    pub(super) capture_jitter_ns: f64,
    pub(super) bit_error_rate: f64,
    /// Probabilities that a frame of the exchange is lost on a cable, and that it arrives twice.
    pub(super) loss: f64,
    pub(super) duplicates: f64,
}

pub(super) struct Wires {
    cables_ns: Vec<f64>,
    transits_ns: Vec<f64>,
    /// Frames on the wire from each device towards the master.
    up: Vec<VecDeque<Busy>>,
    physics: Physics,
    pub(super) noise: Noise,
    random: SplitMix64,
    /// Frames that met another one.
    pub(super) collisions: u64,
    /// Frames that were lost, and frames that came twice.
    pub(super) lost: u64,
    pub(super) doubled: u64,
}

/// A frame at its destination: when it began there, and whether it is a copy that can only be mistaken for the earlier frame.
pub(super) struct Arrival {
    pub(super) start: f64,
    pub(super) bytes: Rc<Vec<u8>>,
    pub(super) copy: bool,
}

impl Wires {
    pub(super) fn new(cables_ns: &[u16], physics: Physics, seed: u64) -> Self {
        let mut random = SplitMix64(seed ^ 0x00b1_ade5);
        Self {
            cables_ns: cables_ns.iter().map(|ns| f64::from(*ns)).collect(),
            transits_ns: cables_ns.iter().map(|_| TRANSIT_NS + random.either(SPREAD_NS)).collect(),
            up: cables_ns.iter().map(|_| VecDeque::new()).collect(),
            physics,
            noise: Noise::new(physics.bit_error_rate, seed ^ 0x5eed),
            random,
            collisions: 0,
            lost: 0,
            doubled: 0,
        }
    }

    pub(super) fn out(&self, k: usize) -> f64 {
        self.cables_ns.get(k).copied().unwrap_or_default()
    }

    /// Passes a frame over the same cable, towards the master.
    pub(super) fn back(&self, k: usize) -> f64 {
        self.out(k) + self.physics.asymmetry_ns
    }

    /// Passes a frame through device k.
    pub(super) fn transit(&mut self, k: usize) -> f64 {
        self.transits_ns.get(k).copied().unwrap_or_default() + self.hop_jitter()
    }

    /// Uniformly distributed, as for a sampled edge.
    fn hop_jitter(&mut self) -> f64 {
        if self.physics.hop_jitter_ns == 0.0 {
            return 0.0;
        }
        self.random.either(self.physics.hop_jitter_ns * 3f64.sqrt())
    }

    /// Returns the error of a capture.
    pub(super) fn capture_jitter(&mut self) -> f64 {
        if self.physics.capture_jitter_ns == 0.0 { 0.0 } else { self.random.either(self.physics.capture_jitter_ns) }
    }

    /// Puts a frame on the wire from device k towards the master.
    pub(super) fn occupy(&mut self, k: usize, start: f64, end: f64, hit: &Hit) {
        let Some(wire) = self.up.get_mut(k) else { return };
        let mut place = wire.len();
        for (at, other) in wire.iter().enumerate().rev() {
            if other.start > start {
                place = at;
            }
            if other.start < end && other.end > start {
                self.collisions += u64::from(!other.hit.replace(true)) + u64::from(!hit.replace(true));
            }
            if other.end <= start {
                break;
            }
        }
        wire.insert(place, Busy { start, end, hit: Rc::clone(hit) });
        while wire.front().is_some_and(|busy| busy.end < start - FORGOTTEN_NS) {
            wire.pop_front();
        }
    }

    /// Sends a frame of device k at `sent` through all devices before it, and returns how it arrives at the master.
    pub(super) fn up(&mut self, k: usize, sent: f64, preamble: usize, bytes: Vec<u8>) -> (Vec<Arrival>, Hit) {
        let (mut start, mut bytes, hit) = (sent, bytes, Hit::default());
        let length = (preamble + bytes.len()) as f64 * BYTE_NS;
        for j in (0..=k).rev() {
            self.occupy(j, start, start + length, &hit);
            start += self.back(j);
            if j > 0 {
                start += self.transit(j - 1);
            }
        }
        self.noise.travel(&mut bytes, k + 1);
        if self.happens(self.physics.loss) {
            self.lost += 1;
            return (Vec::new(), hit);
        }
        let bytes = Rc::new(bytes);
        let mut arrivals = vec![Arrival { start, bytes: Rc::clone(&bytes), copy: false }];
        if self.happens(self.physics.duplicates) {
            self.doubled += 1;
            arrivals.push(Arrival { start: start + AGAIN_NS, bytes, copy: true });
        }
        (arrivals, hit)
    }

    /// Sends a frame of the master to all devices, starting with the first; beyond a cable that loses it nothing arrives.
    pub(super) fn down(&mut self, devices: usize, sent: f64, bytes: Vec<u8>) -> Vec<(usize, Arrival)> {
        let (mut arrivals, mut doubled) = (Vec::with_capacity(devices), false);
        let (mut start, mut bytes) = (sent, Rc::new(bytes));
        for k in 0..devices {
            start += self.out(k);
            if self.happens(self.physics.loss) {
                self.lost += 1;
                break;
            }
            self.noise.pass_shared(&mut bytes);
            if self.happens(self.physics.duplicates) {
                self.doubled += 1;
                doubled = true;
            }
            arrivals.push((k, Arrival { start, bytes: Rc::clone(&bytes), copy: false }));
            if doubled {
                arrivals.push((k, Arrival { start: start + AGAIN_NS, bytes: Rc::clone(&bytes), copy: true }));
            }
            start += self.transit(k);
        }
        arrivals
    }

    fn happens(&mut self, probability: f64) -> bool {
        probability > 0.0 && self.random.unit() < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const QUIET: Physics = Physics {
        asymmetry_ns: 0.0,
        hop_jitter_ns: 0.0,
        capture_jitter_ns: 0.0,
        bit_error_rate: 0.0,
        loss: 0.0,
        duplicates: 0.0,
    };

    /// Two frames of 640 ns on one wire: apart, and 1 ns too close; whichever was sent first.
    #[test]
    fn two_frames_on_one_wire_are_both_damaged() {
        for (second, hit) in [(640.0, false), (639.0, true), (-640.0, false), (-639.0, true)] {
            let mut wires = Wires::new(&[85; 2], QUIET, 1);
            let hits = [Hit::default(), Hit::default()];
            wires.occupy(1, 1000.0, 1640.0, &hits[0]);
            wires.occupy(1, 1000.0 + second, 1640.0 + second, &hits[1]);
            assert_eq!((hits[0].get(), hits[1].get(), wires.collisions), (hit, hit, 2 * u64::from(hit)), "{second}");
        }
    }

    /// The frame of device 3 passes two devices and three cables.
    #[test]
    fn a_frame_takes_its_way() {
        let mut wires = Wires::new(&[10, 20, 30], QUIET, 1);
        let (arrivals, _) = wires.up(2, 1000.0, 2, vec![0; 6]);
        assert!((arrivals[0].start - 1000.0 - 60.0 - 710.0).abs() <= 5.0);
        let arrivals = wires.down(3, 500.0, vec![0; 21]);
        assert!((arrivals[2].1.start - 500.0 - 60.0 - 710.0).abs() <= 5.0);
    }

    #[test]
    fn jitter_adds_up_over_the_ports() {
        let mut wires = Wires::new(&[0; 101], Physics { hop_jitter_ns: 4.0, ..QUIET }, 7);
        let ways: Vec<f64> =
            (0..400).map(|n| wires.up(100, f64::from(n) * 1e6, 2, vec![0; 6]).0[0].start % 1e6).collect();
        let mean = ways.iter().sum::<f64>() / 400.0;
        let rms = (ways.iter().map(|way| (way - mean).powi(2)).sum::<f64>() / 400.0).sqrt();
        // 4 ns in each of a hundred ports.
        assert!((36.0..44.0).contains(&rms), "{rms}");
    }
}
