//! The pins that an image uses on a board.

use core::fmt;

/// A pin that an image drives or reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pin {
    /// Name of the processor's pin, as in its data sheet: `PB3`, `GPIO 2`.
    pub name: &'static str,
    /// The signal wired to it.
    pub signal: &'static str,
    /// Where it is on the board.
    pub at: &'static str,
}

/// A board: its pin table and its crystal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Board {
    /// Name as printed on the board.
    pub name: &'static str,
    /// The crystal, Hz.
    pub crystal_hz: u32,
    /// All pins that an image may use.
    pub pins: &'static [Pin],
    /// Pins that switch a power stage on this board or on one that is stacked on it or mistaken for it.
    pub power_stage: &'static [&'static str],
}

impl Pin {
    /// Creates a pin `name` of the processor, which is `at` this place on the board and wired to `signal`.
    pub const fn new(name: &'static str, signal: &'static str, at: &'static str) -> Self {
        Self { name, signal, at }
    }
}

impl Board {
    /// Creates a board without a power stage that cannot be mistaken for one with it; [checked](Self::checked).
    pub const fn plain(name: &'static str, crystal_hz: u32, pins: &'static [Pin]) -> Self {
        Self { name, crystal_hz, pins, power_stage: &[] }.checked()
    }

    /// Returns this board if its table is permitted; otherwise a `const` does not compile.
    ///
    /// # Panics
    /// If a pin is in the table twice or switches a power stage.
    #[must_use]
    #[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "below the lengths, at compile time")]
    pub const fn checked(self) -> Self {
        let mut at = 0;
        while at < self.pins.len() {
            let mut other = 0;
            while other < at {
                assert!(!same(self.pins[at].name, self.pins[other].name), "a pin is in the table twice");
                other += 1;
            }
            let mut gate = 0;
            while gate < self.power_stage.len() {
                assert!(!same(self.pins[at].name, self.power_stage[gate]), "this pin switches a power stage");
                gate += 1;
            }
            at += 1;
        }
        self
    }
}

#[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "below the lengths, at compile time")]
const fn same(one: &str, other: &str) -> bool {
    let (one, other) = (one.as_bytes(), other.as_bytes());
    let mut at = 0;
    while at < one.len() && at < other.len() && one[at] == other[at] {
        at += 1;
    }
    at == one.len() && at == other.len()
}

impl fmt::Display for Board {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)?;
        self.pins.iter().try_for_each(|Pin { name, signal, at }| write!(f, ", {signal} {name} ({at})"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    const PINS: &[Pin] = &[Pin { name: "PB3", signal: "DI", at: "D3" }, Pin { name: "PB4", signal: "RO", at: "D5" }];
    const TWICE: &[Pin] = &[PINS[0], Pin { name: "PB3", signal: "DE", at: "D3" }];
    const BOARD: Board =
        Board { name: "TEST", crystal_hz: 24_000_000, pins: PINS, power_stage: &["PB30", "PB", "PA9"] };

    #[test]
    fn a_table_says_all_its_pins() {
        assert_eq!(BOARD.checked().to_string(), "TEST, DI PB3 (D3), RO PB4 (D5)");
    }

    #[test]
    #[should_panic(expected = "this pin switches a power stage")]
    fn a_pin_of_a_power_stage_is_refused() {
        let _ = Board { power_stage: &["PA9", "PB4"], ..BOARD }.checked();
    }

    #[test]
    #[should_panic(expected = "a pin is in the table twice")]
    fn a_pin_is_in_the_table_once() {
        let _ = Board { pins: TWICE, ..BOARD }.checked();
    }
}
