//! The quality monitor: rates what is right and wrong on the link and decides when the link is lost.

use crate::answer::{ACCELERATION, Answer, BadWords, PARAMETER, PIPE, SECONDARY, VERTICAL};
use crate::vframe::VFrame;

/// The events that the quality monitor counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum QualityEvent {
    /// VSYNC came in the last H-frame of the V-frame.
    VsyncOk,
    /// VSYNC did not come in the last H-frame.
    VsyncMissing,
    /// VSYNC came in one of the first seven H-frames.
    VsyncEarly,
    /// Safe channel 1 is right.
    Safe1Ok,
    /// Safe channel 1 has a bad word or a wrong CRC; once per V-frame.
    Safe1Error,
    /// Safe channel 2 has a bad word, or with [`QualityRule::Sick`] a wrong CRC; once per V-frame.
    Safe2Error,
    /// STATUS2 has TEST2 set; only [`QualityRule::Ti`] counts it.
    Test2,
    /// A bad word in the parameters or the pipe channel, counted separately.
    ParameterOrPipeWord,
    /// A bad word in the acceleration channel; once per frame.
    AccelerationWord,
    /// A special character that has no meaning in its channel.
    UnknownSpecial,
    /// RSSI below 2.
    LowRssi,
}

/// The table of penalties that applies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum QualityRule {
    /// SICK manual, table 21: VSYNC missing -4, early -6; the link is lost at 0.
    #[default]
    Sick,
    /// Motor Control SDK: VSYNC missing -6, early -4; the link is lost below 0.
    Ti,
}

impl QualityRule {
    /// The amount that an event adds.
    pub const fn weight(self, event: QualityEvent) -> i8 {
        match (self, event) {
            (_, QualityEvent::VsyncOk | QualityEvent::Safe1Ok) => 1,
            (_, QualityEvent::LowRssi)
            | (Self::Sick, QualityEvent::VsyncMissing)
            | (Self::Ti, QualityEvent::VsyncEarly) => -4,
            (_, QualityEvent::Safe1Error)
            | (Self::Sick, QualityEvent::VsyncEarly)
            | (Self::Ti, QualityEvent::VsyncMissing) => -6,
            (_, QualityEvent::Safe2Error) | (Self::Ti, QualityEvent::Test2) => -8,
            (Self::Sick, QualityEvent::Test2) => 0,
            (_, QualityEvent::ParameterOrPipeWord) => -1,
            (_, QualityEvent::AccelerationWord | QualityEvent::UnknownSpecial) => -2,
        }
    }
}

/// The quality monitor QM, 0..=15.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct QualityMonitor {
    rule: QualityRule,
    value: u8,
    lost: bool,
    /// Whether the penalties for a bad word in the vertical and the secondary channel were already applied in this V-frame.
    counted: [bool; 2],
}

impl QualityMonitor {
    /// The value at the start of a link.
    pub const START: u8 = 8;
    /// Below this value the flag QMLW (quality monitor low) is set.
    pub const LOW: u8 = 14;
    /// The highest value.
    pub const MAX: u8 = 15;

    /// Creates the monitor at the start of a link.
    pub const fn new(rule: QualityRule) -> Self {
        Self { rule, value: Self::START, lost: false, counted: [false; 2] }
    }

    /// Counts an event. A lost link stays lost, and its value stays 0.
    pub const fn count(&mut self, event: QualityEvent) {
        self.add(self.rule.weight(event));
    }

    const fn add(&mut self, weight: i8) {
        if self.lost {
            return;
        }
        let sum = i8::from_le_bytes([self.value]).saturating_add(weight);
        self.lost = match self.rule {
            QualityRule::Sick => sum <= 0,
            QualityRule::Ti => sum < 0,
        };
        self.value = match sum {
            ..=0 => 0,
            1..=15 => sum.unsigned_abs(),
            16.. => Self::MAX,
        };
    }

    /// Counts what is wrong with the words of an answer, and VSYNC; returns the number of bad words. `at` is the place of the
    /// answer in the V-frame, 0..=7.
    ///
    /// A receiver calls this for every answer and [`count_v_frame`](Self::count_v_frame) after the last one of a V-frame.
    ///
    /// ```
    /// use hdsl::symbol::{Character, Control, RunningDisparity};
    /// use hdsl::{Answer, Content, DeltaDelta, EncoderByte, EncoderSymbol, QualityMonitor, QualityRule, Rule};
    ///
    /// let content = Content {
    ///     vertical: Character::data(0),
    ///     parameter: EncoderByte::of(EncoderSymbol::Idle).with_vsync(),
    ///     pipe: Character::control(Control::K30_7),
    ///     acceleration: Some(DeltaDelta::ZERO),
    ///     secondary: Character::control(Control::K28_0),
    /// };
    /// let bits = content.emit(RunningDisparity::Minus).bits;
    /// let mut quality = QualityMonitor::new(QualityRule::Sick);
    /// // VSYNC in its place: 8 + 1. Too early: - 6.
    /// assert_eq!(quality.count_answer(7, &Answer::from_bits(Rule::Strict, bits)), 0);
    /// assert_eq!(quality.count_answer(3, &Answer::from_bits(Rule::Strict, bits)), 0);
    /// assert_eq!(quality.value(), 3);
    /// ```
    pub fn count_answer(&mut self, at: u8, answer: &Answer) -> u8 {
        let bad = self.count_words(at, answer);
        if let Ok(parameter) = answer.parameter() {
            self.count_vsync(at, parameter.vsync());
        }
        bad
    }

    /// The part of [`count_answer`](Self::count_answer) that deals with words.
    #[inline]
    pub(crate) fn count_words(&mut self, at: u8, answer: &Answer) -> u8 {
        if at == 0 {
            self.counted = [false; 2];
        }
        if answer.is_plain() { 0 } else { self.count_bad_words(answer) }
    }

    /// The part that deals with VSYNC.
    #[inline]
    pub(crate) const fn count_vsync(&mut self, at: u8, vsync: bool) {
        let event = match (at, vsync) {
            (7, true) => QualityEvent::VsyncOk,
            (7, false) => QualityEvent::VsyncMissing,
            (_, true) => QualityEvent::VsyncEarly,
            (_, false) => return,
        };
        self.count(event);
    }

    /// Counts bad words and special characters without a meaning. All of these subtract, so applying their sum is equivalent to
    /// applying them one by one.
    #[cold]
    fn count_bad_words(&mut self, answer: &Answer) -> u8 {
        let ti = self.rule == QualityRule::Ti;
        let BadWords { bad, special } = answer.bad_words();
        let mut penalty = 0_u8;
        let mut charge = |event, times: u32| {
            let each = self.rule.weight(event).unsigned_abs();
            penalty = penalty.saturating_add(each.saturating_mul(times.to_le_bytes()[0]));
        };
        if bad & VERTICAL != 0 && ti && !self.counted[0] {
            self.counted[0] = true;
            charge(QualityEvent::Safe1Error, 1);
        }
        let unknown = special & (VERTICAL | PARAMETER | ACCELERATION);
        if unknown != 0 {
            // The firmware of the SDK counts specials of the acceleration once a frame, and not besides a bad word.
            let most = match (ti, bad & ACCELERATION) {
                (false, _) => 2,
                (true, 0) => 1,
                (true, _) => 0,
            };
            let others = (unknown & !ACCELERATION).count_ones();
            charge(
                QualityEvent::UnknownSpecial,
                (unknown & ACCELERATION).count_ones().min(most).saturating_add(others),
            );
        }
        charge(QualityEvent::ParameterOrPipeWord, (bad & (PARAMETER | PIPE)).count_ones());
        if bad & ACCELERATION != 0 {
            charge(QualityEvent::AccelerationWord, 1);
        }
        if bad & SECONDARY != 0 && !self.counted[1] {
            self.counted[1] = true;
            charge(QualityEvent::Safe2Error, 1);
        }
        if penalty != 0 {
            self.add(i8::from_le_bytes([penalty]).saturating_neg());
        }
        bad.count_ones().to_le_bytes()[0]
    }

    /// Counts the safe blocks of a complete V-frame.
    pub fn count_v_frame(&mut self, frame: &VFrame) {
        self.count_blocks(frame.safe1.is_sound(), frame.safe2.is_sound());
    }

    /// Does the same if the caller knows whether they are sound.
    pub(crate) fn count_blocks(&mut self, sound1: bool, sound2: bool) {
        if sound1 {
            self.count(QualityEvent::Safe1Ok);
        } else if !self.counted[0] {
            // A bad word may have been counted when it came.
            self.count(QualityEvent::Safe1Error);
        }
        // Bad words were counted when they came.
        if !sound2 && self.rule == QualityRule::Sick && !self.counted[1] {
            self.count(QualityEvent::Safe2Error);
        }
    }

    /// The value, 0..=15.
    pub const fn value(self) -> u8 {
        self.value
    }

    /// Returns whether the link is lost.
    pub const fn is_lost(self) -> bool {
        self.lost
    }

    /// QMLW: the value is below 14.
    ///
    /// ```
    /// use hdsl::{QualityEvent, QualityMonitor, QualityRule};
    /// let mut quality = QualityMonitor::new(QualityRule::Sick);
    /// // A good V-frame is worth two: from 8 to 14 in three.
    /// for _ in 0..3 {
    ///     assert!(quality.is_low());
    ///     quality.count(QualityEvent::VsyncOk);
    ///     quality.count(QualityEvent::Safe1Ok);
    /// }
    /// assert_eq!((quality.value(), quality.is_low()), (14, false));
    /// ```
    pub const fn is_low(self) -> bool {
        self.value < Self::LOW
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// From the start a perfect link gains 2 a V-frame: 15 after four, QMLW off after three.
    #[test]
    fn a_perfect_link() {
        for rule in [QualityRule::Sick, QualityRule::Ti] {
            let mut monitor = QualityMonitor::new(rule);
            let mut values = [0; 5];
            for value in &mut values {
                monitor.count(QualityEvent::VsyncOk);
                monitor.count(QualityEvent::Safe1Ok);
                *value = monitor.value();
                assert_eq!(monitor.is_low(), *value < 14);
            }
            assert_eq!(values, [10, 12, 14, 15, 15]);
        }
    }

    /// An answer with two bad words, VSYNC in its place and out of it; a V-frame that is sound, or empty.
    #[test]
    fn whole_answers_and_v_frames() {
        use crate::parameter::{EncoderByte, EncoderSymbol};
        let idle = EncoderByte::of(EncoderSymbol::Idle).with_vsync();
        let content = crate::answer::Content {
            vertical: crate::symbol::Character::data(0),
            parameter: idle,
            pipe: crate::symbol::Character::control(crate::symbol::Control::K30_7),
            acceleration: Some(crate::DeltaDelta::ZERO),
            secondary: crate::symbol::Character::data(0),
        };
        let bits = content.emit(crate::symbol::RunningDisparity::Minus).bits;
        let count = |at, bits| {
            let mut monitor = QualityMonitor::new(QualityRule::Sick);
            (monitor.count_answer(at, &Answer::from_bits(crate::Rule::Strict, bits)), monitor.value())
        };
        assert_eq!((count(7, bits), count(3, bits)), ((0, 9), (0, 2)));
        // Ten zeros in the vertical and in the secondary channel.
        assert_eq!(count(0, bits & !0x3ff & !(0x3ff << 51)).0, 2);
        let counted = |frame: &VFrame| {
            let mut monitor = QualityMonitor::new(QualityRule::Sick);
            monitor.count_v_frame(frame);
            monitor.value()
        };
        let silent = VFrame::of(crate::Rule::Strict, &[Answer::from_bits(crate::Rule::Strict, u64::MAX); 8]);
        assert!(counted(&silent) < QualityMonitor::START);
    }

    #[test]
    fn where_the_link_is_lost() {
        let eight_off = |rule| {
            let mut monitor = QualityMonitor::new(rule);
            monitor.count(QualityEvent::Safe2Error);
            monitor
        };
        assert!(eight_off(QualityRule::Sick).is_lost());
        let mut ti = eight_off(QualityRule::Ti);
        assert_eq!((ti.is_lost(), ti.value()), (false, 0));
        ti.count(QualityEvent::ParameterOrPipeWord);
        ti.count(QualityEvent::VsyncOk);
        assert_eq!((ti.is_lost(), ti.value()), (true, 0));
    }
}
