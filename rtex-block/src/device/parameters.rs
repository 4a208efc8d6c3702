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

/// The parameters that the model looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Parameters([(Pr, i32); 10]);

impl Parameters {
    pub(super) const DEFAULT: Self = Self([
        (SPEED_UNIT, 1),
        (RESPONSE_DATA[0], 0),
        (RESPONSE_DATA[1], 0),
        (RESPONSE_DATA[2], 0),
        (SUB_RESPONSE_DATA[0], 0),
        (SUB_RESPONSE_DATA[1], 0),
        (SUB_RESPONSE_DATA[2], 0),
        (FEED_FORWARD, 0),
        (ACCELERATION, 1_000),
        (DECELERATION, 1_000),
    ]);

    pub(super) fn get(&self, pr: Pr) -> Option<i32> {
        self.0.iter().find(|(known, _)| *known == pr).map(|(_, value)| *value)
    }

    /// Of a parameter that is in the table.
    pub(super) fn value(&self, pr: Pr) -> i32 {
        self.get(pr).unwrap_or(0)
    }

    /// Whether there is such a parameter.
    pub(super) fn set(&mut self, pr: Pr, value: i32) -> bool {
        match self.0.iter_mut().find(|(known, _)| *known == pr) {
            Some((_, place)) => {
                *place = value;
                true
            }
            None => false,
        }
    }
}
