use crate::type_code::Pr;

/// Pr7.25: unit of speeds, 0 r/min, 1 command units per second.
pub(super) const SPEED_UNIT: Pr = Pr { class: 7, number: 25 };
/// Pr7.29 to Pr7.34: monitor codes of Response_Data1 to 3 and Sub_Response_Data1 to 3; 0 is the default value.
pub(super) const RESPONSE_DATA: [Pr; 3] = [pr7(29), pr7(30), pr7(31)];
pub(super) const SUB_RESPONSE_DATA: [Pr; 3] = [pr7(32), pr7(33), pr7(34)];
/// Pr7.35: what Command_Data3 feeds forward, 0 nothing, 1 velocity, 2 torque.
pub(super) const FEED_FORWARD: Pr = pr7(35);
/// Pr8.01 and Pr8.04: acceleration and deceleration of profile motion, 10 000 command units/s^2.
pub(super) const ACCELERATION: Pr = Pr { class: 8, number: 1 };
pub(super) const DECELERATION: Pr = Pr { class: 8, number: 4 };

const fn pr7(number: u8) -> Pr {
    Pr { class: 7, number }
}

/// A parameter: the value that counts, and the one that was written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Parameter {
    pr: Pr,
    value: i32,
    written: i32,
}

const fn of(pr: Pr, value: i32) -> Parameter {
    Parameter { pr, value, written: value }
}

/// The parameters that the model looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Parameters([Parameter; 10]);

impl Parameters {
    pub(super) const DEFAULT: Self = Self([
        of(SPEED_UNIT, 1),
        of(RESPONSE_DATA[0], 0),
        of(RESPONSE_DATA[1], 0),
        of(RESPONSE_DATA[2], 0),
        of(SUB_RESPONSE_DATA[0], 0),
        of(SUB_RESPONSE_DATA[1], 0),
        of(SUB_RESPONSE_DATA[2], 0),
        of(FEED_FORWARD, 0),
        of(ACCELERATION, 1_000),
        of(DECELERATION, 1_000),
    ]);

    /// What was written to it, whether it counts or not; `None` if there is no such parameter.
    pub(super) fn written(&self, pr: Pr) -> Option<i32> {
        self.0.iter().find(|parameter| parameter.pr == pr).map(|parameter| parameter.written)
    }

    /// What counts, of a parameter that is in the table.
    pub(super) fn value(&self, pr: Pr) -> i32 {
        self.0.iter().find(|parameter| parameter.pr == pr).map_or(0, |parameter| parameter.value)
    }

    /// Whether there is such a parameter.
    pub(super) fn set(&mut self, pr: Pr, value: i32, at_once: bool) -> bool {
        let Some(parameter) = self.0.iter_mut().find(|parameter| parameter.pr == pr) else { return false };
        parameter.written = value;
        if at_once {
            parameter.value = value;
        }
        true
    }

    /// What was written counts from now on.
    pub(super) fn take_over(&mut self) {
        for parameter in &mut self.0 {
            parameter.value = parameter.written;
        }
    }
}
