use crate::header::UpdateCounter;

/// The data sent in one update period.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Turn {
    /// Invalid data: 00h with counter 0, to every drive.
    Invalid,
    /// Valid commands with this counter.
    Valid(UpdateCounter),
}

/// Update_Counter of the master.
///
/// Invalid data (00h) are sent with counter 0, and the first valid block has 1. Then the counter adds 1 modulo 4 in every
/// update period, even if nothing else changes; otherwise drives do not accept the commands. With two communication periods
/// in an update period the same block is sent twice. SX-DSV02310, "Update counter".
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct CommandCounter {
    invalid: u32,
    last: UpdateCounter,
}

impl CommandCounter {
    /// Creates a counter that starts with `invalid` update periods of invalid data.
    pub const fn new(invalid: u32) -> Self {
        Self { invalid, last: UpdateCounter::ZERO }
    }

    /// Moves on to the next update period.
    pub const fn next(&mut self) -> Turn {
        if let Some(left) = self.invalid.checked_sub(1) {
            self.invalid = left;
            Turn::Invalid
        } else {
            self.last = self.last.next();
            Turn::Valid(self.last)
        }
    }

    /// The counter of the last update period.
    pub const fn last(&self) -> UpdateCounter {
        self.last
    }
}
