use super::phase::{ControlError, ControlPhase};

/// What the COM LED of the master shows at an instant. Green and red exclude each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Led {
    /// Dark.
    Off,
    /// Green.
    Green,
    /// Red.
    Red,
}

/// A pattern of the LED over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Pattern {
    /// All the time.
    Steady(Led),
    /// 0.5 s lit, 0.5 s dark.
    Flashing(Led),
}

/// The patterns without a fault, by phase.
///
/// In the guide's table the text "flashing green" is in the row of PH_PREPARE, and the rows of PH_WAITING and PH_START are
/// blank; this crate reads it as one cell over the three rows. In the other possible reading, PH_WAITING is dark, and
/// PH_PREPARE and PH_START flash.
const BY_PHASE: [(ControlPhase, Pattern); 5] = [
    (ControlPhase::Init, Pattern::Steady(Led::Off)),
    (ControlPhase::Waiting, Pattern::Flashing(Led::Green)),
    (ControlPhase::Prepare, Pattern::Flashing(Led::Green)),
    (ControlPhase::Start, Pattern::Flashing(Led::Green)),
    (ControlPhase::Running, Pattern::Steady(Led::Green)),
];

/// Half of a flashing period, ms.
const HALF_MS: u64 = 500;

/// Returns the pattern of a state. A fault is shown in any phase: a time-out by flashing red, slaves that do not match the
/// table by steady red.
pub fn pattern(phase: ControlPhase, fault: Option<ControlError>) -> Pattern {
    match fault {
        Some(ControlError::Timeout) => Pattern::Flashing(Led::Red),
        Some(ControlError::SlaveInfoMismatch) => Pattern::Steady(Led::Red),
        None => BY_PHASE.iter().find(|(p, _)| *p == phase).map_or(Pattern::Steady(Led::Off), |(_, pattern)| *pattern),
    }
}

/// Returns what the LED shows `t_ms` after the start of a lit half-period. System Design Guide for Master, "COM LED".
pub fn led(phase: ControlPhase, fault: Option<ControlError>, t_ms: u64) -> Led {
    match pattern(phase, fault) {
        Pattern::Steady(led) => led,
        Pattern::Flashing(led) if t_ms % (2 * HALF_MS) < HALF_MS => led,
        Pattern::Flashing(_) => Led::Off,
    }
}
