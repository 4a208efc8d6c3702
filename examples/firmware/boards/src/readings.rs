//! Passes a master's readings on to its console.

use core::fmt::{self, Display, Write};

use servowire_core::{Cell, ClockError, Feedback, Policy, Reader, Words, Writer};
use servowire_drivers::Error;

use crate::report::Report;

/// A printed position is no older than this.
const MAX_AGE_NS: u64 = 200_000;

/// The encoder's end of a feedback cell, the end that judges its content, and the report.
pub struct Readings<'a, F: Feedback, const W: usize> {
    writer: Writer<'a, F, W>,
    reader: Reader<'a, F, W>,
    policy: Policy<F::Tolerated>,
    report: Report,
}

impl<'a, F: Feedback<Sample: Display, Doubt: Display> + Words<W>, const W: usize> Readings<'a, F, W> {
    /// Creates readings that report one good one in `every`, beginning with the first.
    pub fn new(cell: &'a mut Cell<F, W>, every: u32) -> Self {
        let (writer, reader) = cell.split();
        Self { writer, reader, policy: Policy::new(MAX_AGE_NS), report: Report::new(every) }
    }

    /// Sets the permitted age of a printed position; 200 us at first.
    #[must_use]
    pub fn with_max_age_ns(self, max_age_ns: u64) -> Self {
        Self { policy: Policy::new(max_age_ns), ..self }
    }

    /// Takes the result of a reading. Returns whether a good one was printed.
    ///
    /// # Errors
    /// Those of the console.
    pub fn take<IO: Display, PIN, P, D>(
        &mut self,
        console: &mut impl Write,
        read: Result<F, Error<IO, PIN, P, D>>,
        now_ns: Result<u64, ClockError>,
    ) -> Result<bool, fmt::Error>
    where
        Error<IO, PIN, P, D>: Display,
    {
        let Self { writer, reader, policy, report } = self;
        match (read.map(|evidence| writer.put(evidence)), now_ns) {
            (Ok(()), Ok(now_ns)) => return report.good(console, || reader.at(now_ns, *policy)),
            (Err(Error::Io(fault)), _) => report.fault(console, fault)?,
            (Err(error), _) => report.fault(console, error)?,
            (_, Err(error)) => report.fault(console, error)?,
        }
        Ok(false)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::convert::Infallible;
    use std::string::String;
    use tformat::{Doubt, Evidence, EvidenceCell, Request, Response};

    use crate::RESOLUTION;

    type Read = Result<Evidence, Error<&'static str, Infallible, &'static str, Doubt>>;

    /// All data (ID 3) of an encoder with 23 and 16 bits, whose identification (17h) says so: 4,660 counts, 7 turns.
    fn evidence(sampled_ns: u64) -> Evidence {
        let bytes = [0x1a, 0, 0x34, 0x12, 0, 0x17, 7, 0, 0, 0, 0x1a ^ 0x34 ^ 0x12 ^ 0x17 ^ 7];
        Evidence::of(Response::parse(Request::ReadAll, &bytes).unwrap(), RESOLUTION, sampled_ns)
    }

    #[test]
    fn positions_are_judged_and_every_failure_is_said() {
        let (mut cell, mut console) = (EvidenceCell::new(), String::new());
        let mut readings = Readings::new(&mut cell, 1);
        let all: [(Read, Result<u64, ClockError>); 5] = [
            (Ok(evidence(1_000)), Ok(201_000)),
            (Ok(evidence(1_000)), Ok(201_001)),
            (Err(Error::Io("noise")), Ok(0)),
            (Err(Error::Protocol("no answer")), Ok(0)),
            (Ok(evidence(1_000)), Err(ClockError::Stopped)),
        ];
        let said = all.map(|(read, now_ns)| readings.take(&mut console, read, now_ns).unwrap());
        assert_eq!(said, [true, true, false, false, false]);
        let lines: std::vec::Vec<_> = console.lines().collect();
        assert_eq!(lines[0], "turn 7, 4660 counts at 1000 ns, 1 good, 0 bad");
        assert!(lines[1].starts_with("no position: ") && lines[1].ends_with("2 good, 0 bad"), "{console}");
        assert_eq!(lines[2..4], ["fault: noise, 2 good, 1 bad", "fault: no answer, 2 good, 2 bad"]);
        assert!(lines[4].starts_with("fault: ") && lines[4].ends_with("2 good, 3 bad"), "{console}");
    }
}
