//! The fast position for control: the second differences of the acceleration channel, integrated twice starting from the safe
//! positions and compared with each of them.
//!
//! A receiver's registers POS and VEL follow the vendors' rules, including their faults; see
//! [`PositionTracker`](crate::PositionTracker).

use crate::acceleration::DeltaDelta;
use crate::doubt::Doubt;
use crate::encoder_id::{EncoderId, PositionBits};
use crate::evidence::{Evidence, Sample};

/// The limit of speeds, in steps per frame, which keeps the sum of two in range.
const FASTEST: i64 = 1 << 30;
/// Number of H-frames in a V-frame.
const V_FRAME: u32 = 8;

/// What the safe positions have shown so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Known {
    Nothing,
    /// The position at the sampling edge before this V-frame.
    Position,
    /// Position and speed are known.
    Speed,
    /// A further safe position has agreed.
    Confirmed,
}

/// The missing acceleration words.
///
/// If the estimate of word k is wrong by d, then n frames later the position is wrong by n d. The caller knows how large d can
/// be: it follows from the largest acceleration and the estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Missing {
    words: u16,
    /// Sum of n over these words, where n is the number of frames from each of them to now, including its own.
    frames: u32,
    /// Sum of the sizes of the estimates, in steps per frame².
    estimated: u32,
    /// Sum of n times the size.
    way: u32,
}

impl Missing {
    const NONE: Self = Self { words: 0, frames: 0, estimated: 0, way: 0 };

    fn add(&mut self, estimate: i16) {
        self.words = self.words.saturating_add(1);
        self.estimated = self.estimated.saturating_add(estimate.unsigned_abs().into());
    }

    /// Notes that another frame has been integrated.
    fn drift(&mut self) {
        self.frames = self.frames.saturating_add(self.words.into());
        self.way = self.way.saturating_add(self.estimated);
    }

    /// Notes that the position at the sampling edge before this V-frame, eight frames ago, is now known; `since` holds the words
    /// missing since then.
    fn position_known(&mut self, since: &Self) {
        let before = u32::from(self.words.saturating_sub(since.words));
        self.frames = before.saturating_mul(V_FRAME).saturating_add(since.frames);
        let estimated = self.estimated.saturating_sub(since.estimated);
        self.way = estimated.saturating_mul(V_FRAME).saturating_add(since.way);
    }
}

/// The fast position of a link, and whether it may be used.
///
/// In each H-frame it takes the acceleration word, and after the last H-frame of a V-frame the safe position. The first safe
/// position provides the position, the second one the speed, and the third one has to agree. A missing word is estimated. A
/// single one is corrected by the second safe position after it at the latest, several by the third.
///
/// ```
/// use hdsl::{DeltaDelta, Doubt, EncoderId, FastPosition, Policy};
/// let id = EncoderId::try_from(0x00153)?; // 32 bits
/// let mut fast = FastPosition::new(id)?;
/// for safe in [1000, 1000, 1000] {
///     for _ in 0..8 {
///         fast.step(Some(DeltaDelta::ZERO));
///     }
///     assert_eq!(fast.evidence(0, 0).at(0, Policy::new(0)), Err(Doubt::Alignment));
///     fast.align(Some(safe));
/// }
/// fast.step(DeltaDelta::new(7));
/// let sample = fast.evidence(25, 0).at(0, Policy::new(0))?;
/// assert_eq!((sample.position(), sample.velocity(), sample.frame()), (1007, 7, 25));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FastPosition {
    id: EncoderId,
    bits: PositionBits,
    /// Modulo 2^64; only the low bits are significant.
    position: u64,
    /// Steps per frame.
    velocity: i32,
    /// The most recent accelerations, the newest at `at`.
    recent: [i16; 8],
    at: u8,
    known: Known,
    /// The position was confirmed, and nothing but missing words has happened since.
    followed: bool,
    missing: Missing,
    /// The missing words of this V-frame.
    missing_here: Missing,
    /// Whether words of the previous V-frame are missing.
    missing_before: bool,
    /// Number of missing words in a row, up to now.
    in_a_row: u32,
    /// `position` at the sampling edge before this V-frame.
    begin: u64,
}

impl FastPosition {
    /// Creates the state before the first word of a link.
    ///
    /// # Errors
    /// [`Error::UnsupportedEncoder`](crate::Error::UnsupportedEncoder).
    pub const fn new(id: EncoderId) -> Result<Self, crate::Error> {
        match id.check() {
            Ok(bits) => Ok(Self::start(id, bits)),
            Err(error) => Err(error),
        }
    }

    pub(crate) const fn start(id: EncoderId, bits: PositionBits) -> Self {
        Self {
            id,
            bits,
            position: 0,
            velocity: 0,
            recent: [0; 8],
            at: 0,
            known: Known::Nothing,
            followed: false,
            missing: Missing::NONE,
            missing_here: Missing::NONE,
            missing_before: false,
            in_a_row: 0,
            begin: 0,
        }
    }

    /// Takes the acceleration of one H-frame; `None` if it cannot be used.
    #[inline]
    pub fn step(&mut self, value: Option<DeltaDelta>) {
        let value = match value {
            Some(value) => {
                self.in_a_row = 0;
                value.get()
            }
            None => self.without_value(),
        };
        self.at = self.at.wrapping_add(1) & 7;
        if let Some(newest) = self.recent.get_mut(usize::from(self.at)) {
            *newest = value;
        }
        self.velocity = self.velocity.wrapping_add(value.into());
        self.position = self.position.wrapping_add_signed(self.velocity.into());
        if self.missing.words != 0 {
            self.missing.drift();
            self.missing_here.drift();
        }
    }

    /// Returns the estimate in place of a value: last + (16 d0 + 8 d1 + 4 d2 + 2 d3 + d4) / 32 (HDSL Protocol Design), with `last`
    /// the value before and d0..d4 its five newest differences.
    #[cold]
    fn without_value(&mut self) -> i16 {
        self.in_a_row = self.in_a_row.saturating_add(1);
        let value = |age: u8| {
            let place = usize::from(self.at.wrapping_sub(age) & 7);
            i32::from(self.recent.get(place).copied().unwrap_or(0))
        };
        // The differences put in.
        let last = value(0);
        let sum = (1..6)
            .zip([8, 4, 2, 1, 1])
            .fold(last.wrapping_mul(16), |sum: i32, (age, weight)| sum.wrapping_sub(value(age).wrapping_mul(weight)));
        let estimate = last.wrapping_add(sum >> 5).clamp(DeltaDelta::MIN.get().into(), DeltaDelta::MAX.get().into());
        let estimate = i16::try_from(estimate).unwrap_or(0);
        self.missing.add(estimate);
        self.missing_here.add(estimate);
        estimate
    }

    /// Takes the safe position of a V-frame after its last H-frame; `None` if it brought none. It is the position at the
    /// sampling edge before the V-frame, 40 bits.
    pub fn align(&mut self, safe: Option<u64>) {
        if let Some(safe) = safe {
            self.compare(safe);
        } else {
            // Not compared for a while: what it knows has to be confirmed again.
            self.known = if self.known >= Known::Speed { Known::Speed } else { Known::Nothing };
        }
        self.missing_before = self.missing_here.words != 0;
        self.missing_here = Missing::NONE;
        self.begin = self.position;
    }

    fn compare(&mut self, safe: u64) {
        // How far the position was off eight frames ago.
        let error = self.signed(safe.wrapping_sub(self.begin));
        let (all, here) = (self.missing.words, self.missing_here.words);
        if self.known >= Known::Speed && all == here {
            // No word was missing by then.
            if error != 0 {
                self.lose(error);
            } else if all == 0 {
                (self.known, self.followed) = (Known::Confirmed, true);
                if self.is_too_fast() {
                    self.reduce();
                }
            }
            return;
        }
        // Since how many frames, at the sampling edge before this V-frame, the speed was off by what it is off now.
        let frames = match self.known {
            Known::Nothing => None,
            Known::Position => (here == 0 && !self.missing_before).then_some(V_FRAME),
            Known::Speed | Known::Confirmed => {
                (all == 1).then_some(self.missing.frames.saturating_sub(V_FRAME)).filter(|n| *n <= V_FRAME)
            }
        };
        let Some(frames) = frames else {
            // The position is known from here on.
            self.position = self.position.wrapping_add_signed(error);
            self.missing.position_known(&self.missing_here);
            self.known = Known::Position;
            return;
        };
        let Some(velocity) = self.speed(error, frames) else { return self.lose(error) };
        let change = i64::from(velocity).wrapping_sub(self.velocity.into());
        self.velocity = velocity;
        // In the eight frames since it went on drifting.
        self.position = self.position.wrapping_add_signed(error.wrapping_add(change.wrapping_mul(8)));
        self.missing = Missing::NONE;
        self.known = Known::Speed;
    }

    /// Returns whether the speed exceeds what a V-frame can determine.
    const fn is_too_fast(&self) -> bool {
        let sixteenth = 1_i64.wrapping_shl(self.bits.get().saturating_sub(4) as u32);
        let limit = if sixteenth < FASTEST { sixteenth } else { FASTEST };
        let velocity = self.velocity as i64;
        velocity < limit.wrapping_neg() || velocity >= limit
    }

    /// A wrong word can leave a speed that is off by an eighth of the range, with which all safe positions agree.
    #[cold]
    fn reduce(&mut self) {
        if let Some(velocity) = self.speed(0, V_FRAME) {
            self.velocity = velocity;
            (self.known, self.followed) = (Known::Speed, false);
        }
    }

    /// Returns the real speed, given that a wrong speed over `frames` frames caused this `error` of the position. A speed of
    /// up to a sixteenth of the range per frame is determined exactly, because the motion in eight frames is then at most
    /// half the range.
    fn speed(&self, error: i64, frames: u32) -> Option<i32> {
        let way = self.signed_of(i64::from(self.velocity).wrapping_mul(frames.into()).wrapping_add(error));
        let speed = divide(way, frames)?;
        if speed.unsigned_abs() > FASTEST.unsigned_abs() { None } else { i32::try_from(speed).ok() }
    }

    /// Handles a wrong word that has passed its checks, or a lost frame: only the position is known after it.
    fn lose(&mut self, error: i64) {
        self.position = self.position.wrapping_add_signed(error);
        self.missing.position_known(&self.missing_here);
        (self.known, self.followed) = (Known::Position, false);
    }

    /// Notes that frames have passed about which nothing is known.
    pub const fn interrupt(&mut self) {
        self.known = Known::Nothing;
        self.followed = false;
    }

    /// Notes that no answer came at all. If the encoder has not heard the head, it has not sampled, and its next word is
    /// not a second difference from frame to frame. How far the estimate is off is then unknown.
    pub(crate) const fn unanswered(&mut self) {
        self.followed = false;
    }

    /// Number of missing words in a row, up to now: ACC_ERR_CNT without its limit.
    pub(crate) const fn missing_in_a_row(&self) -> u32 {
        self.in_a_row
    }

    /// Returns the evidence after the last H-frame, which has the number `frame` and whose sampling edge was at `sampled_ns`.
    ///
    /// A position returned without a doubt is the true one as long as the real speed stays below a sixteenth of the range per
    /// frame (more than 300 000 revolutions per minute for an encoder that counts one turn), and below 2^30 steps per frame.
    pub const fn evidence(&self, frame: u32, sampled_ns: u64) -> Evidence {
        let doubt = if self.is_too_fast() {
            Some(Doubt::Speed)
        } else if self.in_a_row > 0 {
            Some(Doubt::Estimated)
        } else if self.missing.words > 0 || !matches!(self.known, Known::Confirmed) {
            Some(Doubt::Alignment)
        } else {
            None
        };
        let sample = Sample {
            position: self.id.position(self.position),
            velocity: self.velocity,
            bound: 0,
            frame,
            steps_per_turn: 0,
            sampled_ns,
        };
        let followed = self.followed && !matches!(doubt, Some(Doubt::Speed));
        let (words, frames, way) = (self.missing.words, self.missing.frames, self.missing.way);
        // More than can be tolerated are not tolerated.
        let missing = match words.to_le_bytes() {
            [words, 0] if followed => Some(words),
            _ => None,
        };
        Evidence { doubt, sample, missing, frames, way }
    }

    /// Returns whether a register map shows a position that may be used.
    pub(crate) fn is_at(&self, position: u64, velocity: i32) -> bool {
        let agrees = self.signed(position.wrapping_sub(self.position)) == 0 && velocity == self.velocity;
        agrees && self.evidence(0, 0).doubt.is_none()
    }

    /// Returns a difference of positions as a signed number.
    const fn signed(&self, difference: u64) -> i64 {
        let unused = 64_u32.saturating_sub(self.bits.get() as u32);
        i64::from_le_bytes(difference.wrapping_shl(unused).to_le_bytes()).wrapping_shr(unused)
    }

    const fn signed_of(&self, difference: i64) -> i64 {
        self.signed(u64::from_le_bytes(difference.to_le_bytes()))
    }
}

/// Divides a distance of less than 2^40 by 1 to 8 frames; `None` if there is a remainder.
///
/// Multiplying by the inverse of an odd divisor modulo 2^64 yields the quotient directly; `None` if it is too large. (A 64-bit
/// division takes hundreds of instructions.)
const fn divide(way: i64, frames: u32) -> Option<i64> {
    let (halvings, inverse) = match frames {
        1 => (0, 1),
        2 => (1, 1),
        3 => (0, 0xaaaa_aaaa_aaaa_aaab_u64),
        4 => (2, 1),
        5 => (0, 0xcccc_cccc_cccc_cccd),
        6 => (1, 0xaaaa_aaaa_aaaa_aaab),
        7 => (0, 0x6db6_db6d_b6db_6db7),
        8 => (3, 1),
        _ => return None,
    };
    let quotient = (way >> halvings).wrapping_mul(i64::from_le_bytes(inverse.to_le_bytes()));
    if quotient.wrapping_mul(frames as i64) == way && quotient.unsigned_abs() < 1 << 40 { Some(quotient) } else { None }
}

#[cfg(test)]
mod tests;
