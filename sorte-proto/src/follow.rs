//! Motion that survives lost frames. **An extension of this crate, not TI's.**
//!
//! If a frame is lost, the published device repeats the step of the previous cycle, and nothing reveals it. Here the command
//! word of each [`Slice`], which the reference design leaves free, carries the position of the axis after the step of this
//! word, modulo 2^16. A device that missed a frame sees how far it is behind and catches up in cycles that have no step of
//! their own; if it is too far behind, it stops. The reserved bytes of its device frame tell the master how many steps it
//! has ordered from its pulse generator: [`Evidence`](crate::Evidence) decides whether that number may be used.
//!
//! ```text
//!  Slice         byte 0..2  PTO             byte 2..4  steps asked for after it, LSB first
//!  device frame  byte 0     DRV8711 STATUS  byte 1..3  steps ordered, LSB first
//! ```
//!
//! Both count up with DIR 0 and down with DIR 1, modulo 2^16. A device whose follower does not yet know where the axis is
//! must say so with ERROR, see [`Device::flag_error`](crate::device::Device::flag_error).
//!
//! ```
//! use sorte_proto::follow::{Asked, Follower};
//! use sorte_proto::{Direction, Pto};
//! let (mut axis, mut device) = (Asked::new(), Follower::new(128));
//! let step = Pto::from_step(500, Direction::Low)?;
//! let rest = Pto::default();
//! device.next(Some(axis.slice(rest))); // both agree on where the axis is
//! axis.slice(step); // this frame is lost
//! device.next(None);
//! assert_eq!(device.next(Some(axis.slice(rest))).start().map(|start| start.ns()), Some(1)); // caught up
//! assert_eq!(device.ordered().map(|ordered| axis.lag(ordered)), Some(0));
//! # Ok::<(), sorte_proto::OutOfRange>(())
//! ```

use crate::evidence::Sample;
pub use crate::payload::InputSlice;
use crate::payload::Slice;
use crate::pto::{Direction, Pto, StartTime};

/// Returns the steps of a word: 1, -1 or 0.
const fn step(word: Pto) -> i16 {
    match word {
        Pto::Pulse { direction: Direction::Low, .. } => 1,
        Pto::Pulse { direction: Direction::High, .. } => -1,
        _ => 0,
    }
}

/// The master's end: the steps commanded for one axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Asked {
    steps: i64,
}

impl Asked {
    /// Nothing yet.
    pub const fn new() -> Self {
        Self { steps: 0 }
    }

    /// Returns the slice with this word and the number of steps commanded, including it.
    pub const fn slice(&mut self, word: Pto) -> Slice {
        self.steps = self.steps.saturating_add(step(word) as i64);
        Slice { pto: word, command: self.low() }
    }

    /// Steps commanded so far; backward steps count as negative.
    pub const fn asked(&self) -> i64 {
        self.steps
    }

    const fn low(self) -> u16 {
        let [low, high, ..] = self.steps.to_le_bytes();
        u16::from_le_bytes([low, high])
    }

    /// Returns how many steps a device still has to make if it has ordered this many, modulo 2^16. Words still on their way
    /// count too: two cycles with the published timing.
    pub const fn lag(&self, ordered: u16) -> i16 {
        difference(self.low(), ordered)
    }

    /// Returns the full position of a sample, in steps: the one nearest to the commanded position.
    pub const fn position(&self, sample: Sample) -> i64 {
        self.steps.saturating_sub(self.lag(sample.position()) as i64)
    }
}

/// Returns the shorter distance from `from` to `to`, modulo 2^16.
const fn difference(to: u16, from: u16) -> i16 {
    i16::from_le_bytes(to.wrapping_sub(from).to_le_bytes())
}

const fn direction_of(steps: i16) -> Direction {
    if steps < 0 { Direction::High } else { Direction::Low }
}

/// The device's end.
///
/// ```
/// use sorte_proto::follow::{Asked, Follower};
/// use sorte_proto::{Direction, Pto};
/// let (mut master, mut device) = (Asked::new(), Follower::new(128));
/// let step = Pto::from_step(1_000, Direction::High).unwrap();
/// assert_eq!(device.next(Some(master.slice(step))), step);
/// master.slice(step); // in a frame that is lost
/// assert_eq!(device.next(None), Pto::NoPulse { direction: Direction::High });
/// // The next good frame tells that a step is missing, and it is made up for.
/// device.next(Some(master.slice(Pto::NoPulse { direction: Direction::High })));
/// assert_eq!((device.lag(), device.is_stopped()), (0, false));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Follower {
    /// Unknown until the first word.
    ordered: Option<u16>,
    asked: u16,
    direction: Direction,
    /// The previous cycle had no pulse.
    quiet: bool,
    stopped: bool,
    max_lag: u16,
}

impl Follower {
    /// `max_lag` is the number of steps behind the master beyond which the axis stops. 128 is half a full step at 1/256.
    pub const fn new(max_lag: u16) -> Self {
        Self { ordered: None, asked: 0, direction: Direction::Low, quiet: false, stopped: false, max_lag }
    }

    /// Returns what the axis does in the next cycle. `slice` holds the device's bytes of a good frame; `None` if none came. The
    /// first one only sets the position of the axis.
    pub fn next(&mut self, slice: Option<Slice>) -> Pto {
        let word = self.word(slice);
        self.quiet = word.start().is_none();
        self.ordered = self.ordered.map(|ordered| ordered.wrapping_add_signed(step(word)));
        word
    }

    fn word(&mut self, slice: Option<Slice>) -> Pto {
        let Some(Slice { pto, command }) = slice else {
            // Nothing is known of this cycle. The next word tells what is missing.
            return Pto::NoPulse { direction: self.direction };
        };
        self.direction = pto.direction().unwrap_or(self.direction);
        self.asked = command;
        let ordered = *self.ordered.get_or_insert(command.wrapping_add_signed(step(pto).wrapping_neg()));
        let lag = difference(command, ordered);
        self.stopped |= lag.unsigned_abs() > self.max_lag;
        let rest = Pto::NoPulse { direction: self.direction };
        match pto {
            Pto::DriverOff => pto,
            _ if self.stopped => rest,
            // A step back of one that was never made: both are left out.
            Pto::Pulse { .. } if lag.signum() == step(pto) => pto,
            Pto::Pulse { .. } => rest,
            // A pulse at the start of this cycle is 4 us and more after any of the cycle before the last, and 4 us and
            // more before any of the next.
            _ if lag != 0 && self.quiet => Pto::Pulse { start: StartTime::MIN, direction: direction_of(lag) },
            _ => rest,
        }
    }

    /// Steps ordered from the pulse generator, modulo 2^16, as the device reports them to the master. `None` before the
    /// first word and after [`resume`](Self::resume): the position of the axis is not known, and the device's frame must carry
    /// ERROR, see [`Device::flag_error`](crate::device::Device::flag_error).
    pub const fn ordered(&self) -> Option<u16> {
        self.ordered
    }

    /// Number of steps that are missing, according to the last good frame.
    pub const fn lag(&self) -> i16 {
        match self.ordered {
            Some(ordered) => difference(self.asked, ordered),
            None => 0,
        }
    }

    /// Returns whether the axis was so far behind that it has stopped. It starts again with [`resume`](Self::resume).
    pub const fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// Resumes after the host has dealt with the loss: the next word sets the position of the axis again.
    pub const fn resume(&mut self) {
        (self.stopped, self.ordered) = (false, None);
    }
}

#[cfg(test)]
#[allow(clippy::cast_sign_loss)]
mod tests {
    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;

    fn word(kind: u8) -> Pto {
        match kind {
            0 => Pto::from_step(1000, Direction::Low).unwrap(),
            1 => Pto::from_step(3990, Direction::High).unwrap(),
            2 => Pto::NoPulse { direction: Direction::High },
            _ => Pto::NoPulse { direction: Direction::Low },
        }
    }

    #[test]
    fn any_three_bytes_give_themselves_back() {
        for n in (0..=u16::MAX).step_by(crate::stride(997)) {
            let [low, high] = n.to_le_bytes();
            let bytes = [high ^ low, low, high];
            assert_eq!(InputSlice::parse(bytes).emit(), bytes);
        }
    }

    #[test]
    fn too_far_behind_it_stops_and_stays() {
        let (mut asked, mut device) = (Asked::new(), Follower::new(5));
        device.next(Some(asked.slice(word(3))));
        for _ in 0..5 {
            asked.slice(word(0));
        }
        assert!(device.next(Some(asked.slice(word(3)))).start().is_some());
        assert!(!device.is_stopped() && device.lag() == 4);
        asked.slice(word(0));
        asked.slice(word(0));
        for _ in 0..10 {
            assert_eq!(device.next(Some(asked.slice(word(3)))), word(3));
            assert!(device.is_stopped());
        }
        assert_eq!((device.ordered(), asked.asked()), (Some(1), 7));
        device.resume();
        assert_eq!((device.ordered(), device.lag()), (None, 0), "nobody knows where it is");
        device.next(Some(asked.slice(word(3))));
        assert_eq!((device.ordered(), device.lag(), device.is_stopped()), (Some(7), 0, false));
    }

    /// A follower that has stopped stepping must not keep the current on.
    #[test]
    fn a_stopped_axis_lets_its_driver_be_switched_off() {
        let (mut asked, mut device) = (Asked::new(), Follower::new(2));
        device.next(Some(asked.slice(word(3))));
        for _ in 0..4 {
            asked.slice(word(0));
        }
        assert_eq!(device.next(Some(asked.slice(word(0)))), word(3));
        assert!(device.is_stopped());
        assert_eq!(device.next(Some(asked.slice(Pto::DriverOff))), Pto::DriverOff);
        assert!(device.is_stopped());
    }

    /// A step forward was lost and the next one is backward: neither is made, and the axis is where it should be.
    #[test]
    fn a_step_against_the_lag_is_left_out() {
        let (mut asked, mut device) = (Asked::new(), Follower::new(9));
        device.next(Some(asked.slice(word(3))));
        asked.slice(word(0));
        let back = device.next(Some(asked.slice(word(1))));
        assert_eq!((back, device.lag(), asked.asked()), (word(2), 0, 0));
        // Two forward are missing: the step back makes it one.
        asked.slice(word(0));
        asked.slice(word(0));
        assert_eq!((device.next(Some(asked.slice(word(1)))).start(), device.lag()), (None, 1));
    }

    /// Converts the steps that a device reports to the master's count: the nearest number, also beyond 16 bits and below zero.
    #[test]
    fn the_lag_and_the_position_in_all_bits() {
        for (steps, ordered, lag) in
            [(70_000_i64, 4_464_u16, 0), (70_000, 4_460, 4), (65_536, 65_535, 1), (-3, 0, -3), (-3, 65_530, 3)]
        {
            let asked = Asked { steps };
            assert_eq!(asked.lag(ordered), lag, "{steps} {ordered}");
            let [low, high] = ordered.to_le_bytes();
            let mut bytes = [1, 0, 0, low, high, 0];
            bytes[5] = crate::crc::crc8(&bytes[..5]);
            let frame = crate::exchange::DeviceFrameView::parse(3, &bytes).unwrap();
            let evidence = crate::evidence::Evidence::of(frame, crate::evidence::Positions::taken_before_ns(0), 1000);
            let sample = evidence.at(1000, crate::evidence::Policy::new(0)).unwrap();
            assert_eq!(asked.position(sample), steps - i64::from(lag));
        }
    }

    proptest! {
        /// Whatever is lost, no step is made twice, steps stay 4 us apart, and after some cycles without steps all have been
        /// made.
        #[test]
        fn every_step_is_made_in_the_end(cycles in proptest::collection::vec((0u8..6, any::<bool>()), 0..200), start: u16) {
            let mut asked = Asked { steps: start.into() };
            let mut device = Follower::new(300);
            let mut made = i64::from(start);
            let mut rises: Vec<u64> = Vec::new();
            let rest = (0..500).map(|_| (4, false));
            device.next(Some(asked.slice(word(3))));
            for (cycle, (kind, lost)) in cycles.into_iter().chain(rest).enumerate() {
                // Steps of a legal program: not after a later one in the cycle before.
                let slice = asked.slice(word(kind));
                let done = device.next((!lost).then_some(slice));
                made += i64::from(step(done));
                rises.extend(done.start().map(|s| cycle as u64 * 4000 + u64::from(s.ns())));
                prop_assert_eq!(device.ordered(), Some(made as u16));
                prop_assert!(lost || device.lag() == difference(asked.steps as u16, made as u16));
            }
            prop_assert_eq!((made, device.lag(), device.is_stopped()), (asked.asked(), 0, false));
            // The words themselves may follow a 3990 with a 1000; a step that is caught up never comes too close.
            prop_assert!(rises.windows(2).all(|pair| pair[1] - pair[0] >= 4000 || pair[0] % 4000 == 3990));
        }

        #[test]
        fn without_losses_every_word_is_done_as_it_is(kinds in proptest::collection::vec(0u8..6, 1..100)) {
            let (mut asked, mut device) = (Asked::new(), Follower::new(1));
            for kind in kinds {
                let pto = word(kind);
                prop_assert_eq!(device.next(Some(asked.slice(pto))), pto);
                prop_assert_eq!(device.ordered().map(|ordered| asked.lag(ordered)), Some(0));
            }
        }
    }
}
