//! Prints a master's report.

use core::fmt::{self, Display, Write};

/// Counts readings, and prints some of the positions and all faults.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Report {
    every: u32,
    good: u32,
    bad: u32,
}

impl Report {
    /// Creates a report that prints one good reading in this many, beginning with the first.
    pub(crate) const fn new(every: u32) -> Self {
        Self { every, good: 0, bad: 0 }
    }

    /// Counts a good reading. If it is to be printed, it is judged: the line has a position, or why there is none. Whether
    /// it was printed.
    ///
    /// # Errors
    /// Those of the console.
    pub(crate) fn good<S: Display, D: Display>(
        &mut self,
        console: &mut impl Write,
        position: impl FnOnce() -> Result<S, D>,
    ) -> Result<bool, fmt::Error> {
        let said = self.good.checked_rem(self.every) == Some(0);
        self.good = self.good.wrapping_add(1);
        let Self { good, bad, .. } = self;
        match said.then(position) {
            None => {}
            Some(Ok(sample)) => writeln!(console, "{sample}, {good} good, {bad} bad")?,
            Some(Err(doubt)) => writeln!(console, "no position: {doubt}, {good} good, {bad} bad")?,
        }
        Ok(said)
    }

    /// Reports a failed reading.
    ///
    /// # Errors
    /// Those of the console.
    pub(crate) fn fault(&mut self, console: &mut impl Write, error: impl Display) -> fmt::Result {
        self.bad = self.bad.wrapping_add(1);
        let Self { good, bad, .. } = self;
        writeln!(console, "fault: {error}, {good} good, {bad} bad")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::String;

    #[test]
    fn some_positions_are_said_and_all_faults() {
        let (mut report, mut console) = (Report::new(3), String::new());
        let mut said = std::vec::Vec::new();
        for number in 0..4 {
            said.push(report.good(&mut console, || Ok::<_, &str>(number)).unwrap());
        }
        report.fault(&mut console, "no response").unwrap();
        for _ in 0..3 {
            said.push(report.good(&mut console, || Err::<u8, _>("too old")).unwrap());
        }
        assert_eq!(said, [true, false, false, true, false, false, true]);
        let lines = "0, 1 good, 0 bad\n3, 4 good, 0 bad\nfault: no response, 4 good, 1 bad\nno position: too old, 7 good, 1 bad\n";
        assert_eq!(console, lines);
    }
}
