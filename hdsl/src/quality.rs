//! The quality monitor: counts what is right and wrong on the link, and decides when it is lost.

/// What the quality monitor counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum QualityEvent {
    /// VSYNC came in the last H-frame of the V-frame.
    VsyncOk,
    /// VSYNC did not come there.
    VsyncMissing,
    /// VSYNC came in one of the first seven H-frames.
    VsyncEarly,
    /// Safe channel 1 is right.
    Safe1Ok,
    /// Safe channel 1 has a bad word or a wrong CRC; once a V-frame.
    Safe1Error,
    /// Safe channel 2 has a bad word, or by [`QualityRule::Sick`] a wrong CRC; once a V-frame.
    Safe2Error,
    /// STATUS2 has TEST2 set; only [`QualityRule::Ti`] counts it.
    Test2,
    /// A bad word in the parameters or the pipe channel, each.
    ParameterOrPipeWord,
    /// A bad word in the acceleration channel, once a frame.
    AccelerationWord,
    /// A special character that has no meaning in its channel.
    UnknownSpecial,
    /// RSSI below 2.
    LowRssi,
}

/// Which table of penalties applies.
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
    /// What an event adds.
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
}

impl QualityMonitor {
    /// The value at the start of a link.
    pub const START: u8 = 8;
    /// Below this value the flag QMLW (quality monitor low) is set.
    pub const LOW: u8 = 14;
    /// The best value.
    pub const MAX: u8 = 15;

    /// At the start of a link.
    pub const fn new(rule: QualityRule) -> Self {
        Self { rule, value: Self::START, lost: false }
    }

    /// Counts an event. A lost link stays lost and its value 0.
    pub const fn count(&mut self, event: QualityEvent) {
        if self.lost {
            return;
        }
        // At most 15 + 1, at least 0 - 8.
        let sum = i8::from_le_bytes([self.value]).saturating_add(self.rule.weight(event));
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

    /// The value, 0..=15.
    pub const fn value(self) -> u8 {
        self.value
    }

    /// Whether the link is lost.
    pub const fn is_lost(self) -> bool {
        self.lost
    }

    /// QMLW: the value is below 14.
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
