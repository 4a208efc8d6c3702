//! What a drive is doing at present.

use crate::device::wire::Request;
use crate::error_code::Alarm;

/// A command that is being executed, or that has been executed and is still held by the master.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Job {
    pub(super) request: Request,
    pub(super) busy: u16,
    pub(super) outcome: Outcome,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Outcome {
    Value(i32),
    /// A monitor value, read again for every response.
    Live(u16),
    /// Attributes of the present alarm, whose number is the index echo.
    Attributes(Alarm),
    Failed,
}
