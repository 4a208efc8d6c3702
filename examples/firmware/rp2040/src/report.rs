//! What a master says: every sixteenth position, and every fault.

use core::fmt::{self, Display, Write};

use crate::board::Console;

/// Readings so far.
#[derive(Default)]
pub struct Report {
    good: u32,
    bad: u32,
}

impl Report {
    /// A reading was good. Every sixteenth is judged and said: a position, or why there is none.
    ///
    /// # Errors
    /// Never.
    pub fn good<S: Display, D: Display>(
        &mut self,
        console: &mut Console,
        position: impl FnOnce() -> Result<S, D>,
    ) -> fmt::Result {
        self.good += 1;
        let Self { good, bad } = self;
        if *good % 16 != 1 {
            return Ok(());
        }
        match position() {
            Ok(sample) => writeln!(console, "{sample}, {good} good, {bad} bad"),
            Err(doubt) => writeln!(console, "no position: {doubt}, {good} good, {bad} bad"),
        }
    }

    /// A reading failed.
    ///
    /// # Errors
    /// Never.
    pub fn fault(&mut self, console: &mut Console, error: impl Display) -> fmt::Result {
        self.bad += 1;
        let Self { good, bad } = self;
        writeln!(console, "fault: {error}, {good} good, {bad} bad")
    }
}
