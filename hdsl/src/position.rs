//! The registers POS and VEL of a receiver: the second differences of the acceleration channel, integrated twice and aligned
//! with the safe position once per V-frame, as the vendors do.

use crate::acceleration::DeltaDelta;
use crate::encoder_id::PositionBits;

const POSITION: u64 = 0xff_ffff_ffff;
const VELOCITY: u32 = 0xff_ffff;
/// How velocity and position are calculated.
///
/// By either rule, an unusable acceleration word is replaced by last + (16 d0 + 8 d1 + 4 d2 + 2 d3 + d4) / 32 (HDSL Protocol
/// Design), rounded towards minus infinity, where `last` is the value before and d0..d4 are its five newest differences.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum PositionRule {
    /// The estimate is limited to the 11 bits of a real value. Positions and their differences are taken modulo the
    /// width of the position (SICK manual, p. 44). A V-frame determines the velocity modulo an eighth of the range, so after
    /// stage 1 it is within a sixteenth.
    #[default]
    Sick,
    /// As in the firmware of the Motor Control SDK.
    ///
    /// * The estimate wraps at 16 bits, and is added to the velocity with its sign only if bit 10 is set. While nothing wraps,
    ///   both rules produce the same estimate.
    /// * The alignment subtracts positions as 40-bit numbers, whatever their width. If the position passes the end of its range
    ///   in the V-frame of stage 0, the velocity is afterwards wrong by an eighth of the range, and so is the position in seven
    ///   frames out of eight, without any flag.
    Ti,
}

/// The stage of the alignment of the fast with the safe position; it advances once per V-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum AlignmentStage {
    /// 0: the position is not known; the next safe position is adopted.
    #[default]
    Position = 0,
    /// 1: the next safe position reveals the error of the velocity.
    Velocity = 1,
    /// 2: one V-frame with correct values has to pass.
    Settle = 2,
    /// 3: aligned; every safe position is compared.
    Check = 3,
}

/// The registers of a receiver that belong to the fast position, by the vendor's names.
///
/// They hold numbers whether or not these are right. For a position that may be used, see
/// [`FastPosition`](crate::FastPosition).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct PositionRegisters {
    /// POS4..POS0, 40 bits. With [`PositionRule::Ti`] it can have bits above the width of the encoder right after stages 0 and
    /// 1; the next step removes them.
    pub pos: u64,
    /// VEL2..VEL0 with their sign: the velocity in steps per H-frame, 24 bits.
    pub vel: i32,
    /// ACC_ERR_CNT without its limit: the number of unusable words since the last usable one.
    pub acc_err_cnt: u32,
    /// The flag POS: the position contains an estimated value, or the last check failed.
    pub pos_flag: bool,
}

/// Integrates the acceleration words into velocity and position.
///
/// All arithmetic is modulo the width: 24 bits of velocity in steps per H-frame, 40 bits of position.
///
/// ```
/// use hdsl::{DeltaDelta, PositionBits, PositionTracker};
/// let mut tracker = PositionTracker::new(PositionBits::MAX);
/// tracker.align(1000);
/// for _ in 0..3 {
///     tracker.step(DeltaDelta::new(2));
/// }
/// assert_eq!((tracker.registers().vel, tracker.registers().pos), (6, 1000 + 2 + 4 + 6));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PositionTracker {
    bits: PositionBits,
    /// Returns a mask of this width.
    mask: u64,
    rule: PositionRule,
    position: u64,
    velocity: u32,
    /// Sum of the velocities since the last safe position.
    relative: i32,
    last: i16,
    /// Differences between successive values, the newest first.
    history: [i16; 5],
    /// Position at stage 0, from which the error of the velocity is derived in stage 1.
    reference: u64,
    stage: AlignmentStage,
    unreliable: bool,
    errors: u32,
}

impl PositionTracker {
    /// Creates a tracker at standstill at position 0, not aligned.
    pub const fn new(bits: PositionBits) -> Self {
        Self::with_rule(bits, PositionRule::Sick)
    }

    /// Creates a tracker that follows a rule.
    pub const fn with_rule(bits: PositionBits, rule: PositionRule) -> Self {
        Self {
            bits,
            mask: bits.mask(),
            rule,
            position: 0,
            velocity: 0,
            relative: 0,
            last: 0,
            history: [0; 5],
            reference: 0,
            stage: AlignmentStage::Position,
            unreliable: false,
            errors: 0,
        }
    }

    /// Takes the acceleration of one H-frame; `None` if it cannot be used, in which case it is estimated.
    #[inline]
    pub fn step(&mut self, value: Option<DeltaDelta>) {
        let (added, kept) = match value {
            Some(value) => {
                self.errors = 0;
                (i32::from(value.get()), value.get())
            }
            None => self.without_value(),
        };
        self.integrate(added, kept);
    }

    /// The estimate in place of a value.
    #[cold]
    fn without_value(&mut self) -> (i32, i16) {
        self.errors = self.errors.saturating_add(1);
        self.stage = AlignmentStage::Position;
        self.unreliable = true;
        self.estimate()
    }

    /// `added` goes into the velocity, `kept` into the history.
    #[inline]
    fn integrate(&mut self, added: i32, kept: i16) {
        self.velocity = self.velocity.wrapping_add_signed(added) & VELOCITY;
        let [d0, d1, d2, d3, _] = self.history;
        self.history = [kept.wrapping_sub(self.last), d0, d1, d2, d3];
        self.last = kept;
        let signed = self.velocity();
        self.position = self.position.wrapping_add_signed(i64::from(signed)) & self.mask;
        self.relative = self.relative.wrapping_add(signed);
    }

    fn estimate(&self) -> (i32, i16) {
        let weights = [16, 8, 4, 2, 1];
        let terms = self.history.iter().zip(weights).map(|(d, w)| i32::from(*d).wrapping_mul(w));
        let sum = terms.fold(0, i32::wrapping_add);
        match self.rule {
            PositionRule::Sick => {
                let value = DeltaDelta::clamp(i64::from(self.last).wrapping_add(i64::from(sum >> 5))).get();
                (i32::from(value), value)
            }
            PositionRule::Ti => {
                let [low, high, ..] = sum.to_le_bytes();
                let sum = i16::from_le_bytes([low, high]) >> 5;
                let value = self.last.wrapping_add(sum);
                if value & 0x400 != 0 {
                    let value = value | -0x800;
                    (i32::from(value), value)
                } else {
                    // Added without its sign.
                    (i32::from(value) & 0xffff, value)
                }
            }
        }
    }

    /// Compares or aligns the position with the safe position, after the last H-frame of a V-frame.
    ///
    /// `safe` is the position at the sampling instant before the V-frame, 40 bits.
    ///
    /// ```text
    ///  stage 0   pos = safe + relative; x = pos                             -> 1
    ///  stage 1   x = safe - x is 8 times the error of the velocity:
    ///            vel += x / 8; pos += 2 x                                   -> 2
    ///  stage 2                                                              -> 3
    ///  stage 3   safe + relative = pos: aligned; otherwise                  -> 0
    /// ```
    ///
    /// One V-frame determines the speed only modulo an eighth of the range. The alignment is right for speeds of up to a
    /// sixteenth of the range per frame; with [`PositionRule::Sick`] the speed is brought into that range.
    pub fn align(&mut self, safe: u64) {
        let relative = i64::from(self.relative);
        let mask = match self.rule {
            PositionRule::Sick => self.mask,
            PositionRule::Ti => POSITION,
        };
        let expected = safe.wrapping_add_signed(relative) & mask;
        let agrees = (expected ^ self.position) & self.mask == 0;
        match self.stage {
            AlignmentStage::Position => {
                self.position = expected;
                self.reference = expected;
                self.stage = AlignmentStage::Velocity;
            }
            AlignmentStage::Velocity => {
                let x = sign_extend(safe.wrapping_sub(self.reference), mask);
                let [v0, v1, v2, v3, ..] = (x >> 3).to_le_bytes();
                self.velocity = self.velocity.wrapping_add(u32::from_le_bytes([v0, v1, v2, v3])) & VELOCITY;
                self.position = self.position.wrapping_add_signed(x.wrapping_mul(2)) & mask;
                if self.rule == PositionRule::Sick {
                    self.velocity = self.reduced();
                }
                self.stage = AlignmentStage::Settle;
            }
            AlignmentStage::Settle => self.stage = AlignmentStage::Check,
            AlignmentStage::Check if agrees => self.unreliable = false,
            AlignmentStage::Check => {
                self.stage = AlignmentStage::Position;
                self.unreliable = true;
            }
        }
        self.relative = 0;
    }

    /// Call this instead of [`align`](Self::align) if the V-frame brought no safe position.
    pub const fn no_safe_position(&mut self) {
        self.stage = AlignmentStage::Position;
        self.unreliable = true;
        self.relative = 0;
    }

    /// Marks the position as unreliable until an alignment succeeds.
    pub(crate) const fn doubt(&mut self) {
        self.unreliable = true;
    }

    /// Returns what the registers of the receiver show, usable or not, for register maps and not for a control loop.
    #[inline]
    pub const fn registers(&self) -> PositionRegisters {
        PositionRegisters {
            pos: self.position,
            vel: self.velocity(),
            acc_err_cnt: self.errors,
            pos_flag: self.unreliable,
        }
    }

    /// Returns the velocity within a sixteenth of the range, if its 24 bits can hold more than that.
    fn reduced(&self) -> u32 {
        let [a, b, c, d, ..] = sign_extend(self.velocity.into(), self.mask >> 3).to_le_bytes();
        let eighth = u32::from(self.bits.get()).saturating_sub(3);
        if eighth < 24 { u32::from_le_bytes([a, b, c, d]) & VELOCITY } else { self.velocity }
    }

    /// The signed velocity.
    const fn velocity(&self) -> i32 {
        i32::from_le_bytes((self.velocity << 8).to_le_bytes()) >> 8
    }

    /// The stage of the alignment.
    pub const fn stage(&self) -> AlignmentStage {
        self.stage
    }
}

/// Returns the low bits that `mask` selects, sign-extended from the highest of them.
const fn sign_extend(value: u64, mask: u64) -> i64 {
    let unused = mask.leading_zeros();
    i64::from_le_bytes((value << unused).to_le_bytes()) >> unused
}

#[cfg(test)]
#[allow(clippy::cast_sign_loss, clippy::cast_possible_wrap)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn dd(value: i64) -> Option<DeltaDelta> {
        DeltaDelta::new(value as i16)
    }

    /// Runs a tracker with a real motion and passes it the safe position after every eighth frame.
    fn follow(
        tracker: &mut PositionTracker,
        start: i64,
        accelerations: &[i64],
        speed: i64,
        lost: impl Fn(usize) -> bool,
    ) -> i64 {
        let (mut position, mut velocity, mut before) = (start, speed, start);
        for (k, a) in accelerations.iter().enumerate() {
            velocity += a;
            position += velocity;
            tracker.step(if lost(k) { None } else { dd(*a) });
            if k % 8 == 7 {
                tracker.align(before.rem_euclid(1 << 40) as u64 & tracker.bits.mask());
                before = position;
            }
        }
        position
    }

    proptest! {
        /// Whatever the encoder did before, the position is exact four V-frames later and stays exact.
        #[test]
        fn aligns_in_four_v_frames(start in 0..1_i64 << 31, speed in -3000..3000_i64, a in prop::collection::vec(-40..40_i64, 48)) {
            let mut tracker = PositionTracker::new(PositionBits::new(40).unwrap());
            let end = follow(&mut tracker, start + (1 << 33), &a, speed, |_| false);
            prop_assert_eq!(tracker.stage(), AlignmentStage::Check);
            prop_assert!(!tracker.registers().pos_flag);
            prop_assert_eq!(tracker.registers().pos, end.rem_euclid(1 << 40) as u64);
        }

        /// A lost word is detected and corrected, at the latest in the second round: if the word was lost in the middle of a
        /// V-frame, the first round derives a wrong error of the velocity.
        #[test]
        fn repairs_after_lost_words(speed in -3000..3000_i64, a in prop::collection::vec(-40..40_i64, 128), lost in 33..48_usize) {
            let mut tracker = PositionTracker::new(PositionBits::new(36).unwrap());
            let end = follow(&mut tracker, 1 << 33, &a, speed, |k| k == lost || k == lost + 2);
            prop_assert!(!tracker.registers().pos_flag);
            prop_assert_eq!(tracker.registers().pos, end.rem_euclid(1 << 40) as u64 & tracker.bits.mask());
        }

        /// As long as nothing wraps, both estimators agree.
        #[test]
        fn the_estimators_agree_without_wrap(a in prop::collection::vec(prop::option::of(-200..200_i16), 40)) {
            let bits = PositionBits::MAX;
            let mut one = PositionTracker::new(bits);
            let mut two = PositionTracker::with_rule(bits, PositionRule::Ti);
            for value in a {
                let value = value.map(|v| DeltaDelta::new(v).unwrap());
                one.step(value);
                two.step(value);
                if matches!(one.last, -1024 | 1023) {
                    return Ok(());
                }
                prop_assert_eq!((one.registers().pos, one.registers().vel), (two.registers().pos, two.registers().vel));
            }
        }

        /// An estimate never leaves the range of a real value.
        #[test]
        fn the_clamped_estimate_has_eleven_bits(a in prop::collection::vec(prop::option::of(-1024..=1023_i16), 60)) {
            let mut tracker = PositionTracker::new(PositionBits::MAX);
            for value in a {
                let before = tracker.registers().vel;
                tracker.step(value.map(|v| DeltaDelta::new(v).unwrap()));
                prop_assert!((-1024..=1023).contains(&(tracker.registers().vel - before)));
                prop_assert_eq!(tracker.registers().acc_err_cnt > 0, value.is_none());
            }
        }
    }

    /// At constant acceleration the estimate is exact, at speed 0 or any other.
    #[test]
    fn constant_acceleration_needs_no_words() {
        for a in [-7, 0, 7] {
            let mut tracker = PositionTracker::new(PositionBits::MAX);
            for k in 1..100 {
                tracker.step(if (20..30).contains(&k) { None } else { dd(a) });
                assert_eq!(i64::from(tracker.registers().vel), a * k);
            }
            assert!(tracker.registers().pos_flag);
        }
    }

    /// If the speed is off by an eighth of the range, a V-frame ends at the same position, so every check agrees. The error
    /// does not last.
    #[test]
    fn a_speed_that_is_off_by_an_eighth_of_the_range() {
        for bits in 11..=40 {
            let bits = PositionBits::new(bits).unwrap();
            let eighth = 1_i64 << (bits.get() - 3);
            for rule in [PositionRule::Sick, PositionRule::Ti] {
                // 24 bits hold all speeds of a wider range.
                for off in [-1, 1, 3].map(|off| off * eighth).into_iter().filter(|_| bits.get() < 27) {
                    let mut tracker = PositionTracker::with_rule(bits, rule);
                    let mut position = follow(&mut tracker, 77, &[0; 40], 3, |_| false);
                    assert!(!tracker.registers().pos_flag && tracker.registers().vel == 3);
                    tracker.velocity = tracker.velocity.wrapping_add(off as u32) & VELOCITY;
                    // A lost word begins the alignment anew.
                    position = follow(&mut tracker, position, &[0; 48], 3, |k| k == 0);
                    let (shown, right) = (tracker.registers(), position as u64 & bits.mask());
                    // (The firmware sees a range of 40 bits, and with it every speed.)
                    assert_eq!((shown.pos_flag, shown.pos == right, shown.vel), (false, true, 3), "{bits:?} {off}");
                }
                // A speed that the range allows is not touched.
                for speed in [-(1 << 23), (1 << 23) - 1, 5, -5] {
                    let sixteenth = 1_i64 << (bits.get() - 4);
                    let speed = i64::clamp(speed, -sixteenth, sixteenth - 1);
                    let mut tracker = PositionTracker::with_rule(bits, rule);
                    let position = follow(&mut tracker, 0, &[0; 40], speed, |_| false);
                    let shown = tracker.registers();
                    assert!(!shown.pos_flag);
                    if rule == PositionRule::Sick {
                        assert_eq!((i64::from(shown.vel), shown.pos), (speed, position as u64 & bits.mask()));
                    }
                }
            }
        }
    }

    /// An estimate of 1100 has bit 10 set, so the firmware reads it as -948.
    #[test]
    fn an_estimate_outside_eleven_bits() {
        for (rule, want) in [(PositionRule::Sick, 1023), (PositionRule::Ti, 1100 - 2048)] {
            let mut tracker = PositionTracker::with_rule(PositionBits::MAX, rule);
            (tracker.last, tracker.history) = (1000, [200, 0, 0, 0, 0]);
            tracker.step(None);
            assert_eq!(tracker.registers().vel, want);
        }
    }

    #[test]
    fn standstill_stays_exact() {
        let mut tracker = PositionTracker::new(PositionBits::new(24).unwrap());
        for frame in 0..if cfg!(miri) { 80 } else { 8000 } {
            tracker.step(dd(0));
            if frame % 8 == 7 {
                tracker.align(0xff_ffff);
                assert_eq!(tracker.registers().pos, 0xff_ffff);
            }
        }
        tracker.no_safe_position();
        assert_eq!((tracker.stage(), tracker.registers().pos_flag), (AlignmentStage::Position, true));
    }
}
