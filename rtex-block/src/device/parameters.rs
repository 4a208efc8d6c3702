//! Parameters by their index: class in the high byte, number in the low one (inferred, as in the master).

/// Pr7.25: unit of speeds, 0 r/min, 1 command units per second.
pub(super) const SPEED_UNIT: u16 = 0x0719;
/// Pr7.29 to Pr7.34: monitor codes of Response_Data1 to 3 and Sub_Response_Data1 to 3; 0 is the default value.
pub(super) const RESPONSE_DATA: [u16; 3] = [0x071d, 0x071e, 0x071f];
pub(super) const SUB_RESPONSE_DATA: [u16; 3] = [0x0720, 0x0721, 0x0722];
/// Pr7.35: what Command_Data3 feeds forward, 0 nothing, 1 velocity, 2 torque.
pub(super) const FEED_FORWARD: u16 = 0x0723;
/// Pr7.36 and Pr7.37: the same for Sub_Command_Data2 and 3.
pub(super) const SUB_FEED_FORWARD: [u16; 2] = [0x0724, 0x0725];
/// Pr8.01 and Pr8.04: acceleration and deceleration of profile motion, 10 000 command units/s^2.
pub(super) const ACCELERATION: u16 = 0x0801;
pub(super) const DECELERATION: u16 = 0x0804;

/// A parameter: the value in effect, and the value written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Parameter {
    pr: u16,
    value: i32,
    written: i32,
}

const fn of(pr: u16, value: i32) -> Parameter {
    Parameter { pr, value, written: value }
}

/// The parameters that the model uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Parameters([Parameter; 12]);

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
        of(SUB_FEED_FORWARD[0], 0),
        of(SUB_FEED_FORWARD[1], 0),
        of(ACCELERATION, 1_000),
        of(DECELERATION, 1_000),
    ]);

    /// Returns the value written, whether it is in effect or not; `None` if there is no such parameter.
    pub(super) fn written(&self, pr: u16) -> Option<i32> {
        self.0.iter().find(|parameter| parameter.pr == pr).map(|parameter| parameter.written)
    }

    /// Returns the value in effect of a parameter that is in the table.
    pub(super) fn value(&self, pr: u16) -> i32 {
        self.0.iter().find(|parameter| parameter.pr == pr).map_or(0, |parameter| parameter.value)
    }

    /// Number of parameters in the class given by the high byte of `pr`; `None` if there is no such class.
    pub(super) fn count(pr: u16) -> Option<i32> {
        let [class, _] = pr.to_be_bytes();
        let all = Self::DEFAULT.0.into_iter().filter(|parameter| parameter.pr.to_be_bytes()[0] == class).count();
        i32::try_from(all).ok().filter(|all| *all > 0)
    }

    /// Whether the parameter exists.
    pub(super) fn set(&mut self, pr: u16, value: i32, at_once: bool) -> bool {
        let Some(parameter) = self.0.iter_mut().find(|parameter| parameter.pr == pr) else { return false };
        parameter.written = value;
        if at_once {
            parameter.value = value;
        }
        true
    }

    /// Makes the written values take effect.
    pub(super) fn take_over(&mut self) {
        for parameter in &mut self.0 {
            parameter.value = parameter.written;
        }
    }
}
