//! Lines as steps.

use std::vec::IntoIter;

use step_motion::{AxisPulse, AxisSetup, Clock, Limits, LinePulses, Path};

use super::{AXES, Line};

/// Lines that are looked ahead.
const AHEAD: usize = 64;

/// The steps of all axes in the order of time, in ns.
pub(crate) struct Steps {
    lines: IntoIter<Line>,
    path: Path<AXES, AHEAD>,
    per_mm: f64,
    line: Option<LinePulses<AXES>>,
    /// When the last line ends, in ns.
    end: u64,
}

impl Steps {
    pub(super) fn new(
        lines: Vec<Line>,
        limits: Limits,
        steps_per_mm: u32,
        deviation: u32,
    ) -> Result<Self, step_motion::Error> {
        let axis = AxisSetup::new(limits, steps_per_mm * 1000);
        let path = Path::new(Clock::NANOSECONDS, [axis; AXES], deviation)?;
        Ok(Self { lines: lines.into_iter(), path, per_mm: f64::from(steps_per_mm), line: None, end: 0 })
    }

    /// When the motion that has been planned is over, in ns.
    pub(crate) const fn end(&self) -> u64 {
        self.end
    }
}

impl Iterator for Steps {
    type Item = AxisPulse;

    fn next(&mut self) -> Option<AxisPulse> {
        loop {
            if let Some(pulse) = self.line.as_mut().and_then(Iterator::next) {
                return Some(pulse);
            }
            while !self.path.is_full() {
                let Some(line) = self.lines.next() else { break };
                let target = line.to.map(|mm| (mm * self.per_mm).round() as i64);
                // It is not full, and 100 m of 10000 steps/mm are fewer than 2^31.
                let _: Result<_, _> = self.path.push(target, line.feed.unwrap_or(u32::MAX));
            }
            self.line = Some(self.path.next_line()?);
            self.end = self.line.as_ref().map_or(self.end, LinePulses::end);
        }
    }
}
