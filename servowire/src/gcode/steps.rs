//! Lines as steps.

use std::fs::File;
use std::io::BufReader;

use servowire_decode::fault::Fault;
use step_motion::{AxisPulse, AxisSetup, Clock, LinePulses, Path};

use super::AXES;
use super::item::{Item, Line};
use super::program::Program;

/// Lines that are looked ahead.
const AHEAD: usize = 64;

/// The steps of all axes in the order of time, in ns. A line of the program is read when there is room for it.
pub(crate) struct Steps {
    program: Program<BufReader<File>>,
    path: Path<AXES, AHEAD>,
    per_mm: [f64; AXES],
    deviation: u32,
    line: Option<LinePulses<AXES>>,
    /// Nothing moves before a rest of this many ns has ended.
    rest: Option<u64>,
    /// When the last line ends, in ns.
    end: u64,
    fault: Option<Fault>,
}

impl Steps {
    pub(super) fn new(
        program: Program<BufReader<File>>,
        axes: [AxisSetup; AXES],
        deviation: u32,
    ) -> Result<Self, step_motion::Error> {
        let path = Path::new(Clock::NANOSECONDS, axes, deviation)?;
        let per_mm = axes.map(|axis| f64::from(axis.steps_per_m) / 1000.0);
        Ok(Self { program, path, per_mm, deviation, line: None, rest: None, end: 0, fault: None })
    }

    /// When the planned motion ends, in ns.
    pub(crate) const fn end(&self) -> u64 {
        self.end
    }

    /// Why it ended early.
    pub(crate) const fn fault(&self) -> Option<&Fault> {
        self.fault.as_ref()
    }

    /// Reads on until the path is full, or has to come to rest.
    fn fill(&mut self) {
        while !self.path.is_full() && self.rest.is_none() {
            match self.program.next() {
                Some(Ok(Item::Line(Line { to, feed }))) => {
                    let mut target = [0; AXES];
                    for ((target, mm), per_mm) in target.iter_mut().zip(to).zip(self.per_mm) {
                        *target = (mm * per_mm).round() as i64;
                    }
                    // It is not full, and 100 m of 10000 steps/mm are fewer than 2^31.
                    let _: Result<_, _> = self.path.push(target, feed.unwrap_or(u32::MAX));
                }
                Some(Ok(Item::Rest(ns))) => self.rest = Some(ns),
                Some(Ok(Item::Deviation(um))) => self.path.set_deviation(um.unwrap_or(self.deviation)),
                Some(Err(fault)) => self.fault = Some(fault),
                None => return,
            }
        }
    }
}

impl Iterator for Steps {
    type Item = AxisPulse;

    fn next(&mut self) -> Option<AxisPulse> {
        loop {
            if let Some(pulse) = self.line.as_mut().and_then(Iterator::next) {
                return Some(pulse);
            }
            self.fill();
            self.line = self.path.next_line();
            match (&self.line, self.rest) {
                (Some(line), _) => self.end = line.end(),
                (None, Some(ns)) => {
                    self.end = self.end.saturating_add(ns);
                    self.path.not_before(self.end);
                    self.rest = None;
                }
                (None, None) => return None,
            }
        }
    }
}
