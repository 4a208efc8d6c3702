//! What is known of the way from the start of a line on, and how long that holds.

use crate::real::Real;

/// Numbers of a path; each changes when something that was found no longer holds.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Times {
    /// Changes with anything.
    edition: u32,
    /// Changes with the fraction of the requested speeds, and with lines, unless they are only added.
    season: u32,
    /// Changes with lines, unless they are only added.
    era: u32,
}

impl Times {
    pub(super) const FIRST: Self = Self { edition: 1, season: 1, era: 0 };

    pub(super) const fn line_added(&mut self) {
        self.edition = self.edition.wrapping_add(1);
    }

    pub(super) const fn other_part(&mut self) {
        self.line_added();
        self.season = self.season.wrapping_add(1);
    }

    pub(super) const fn other_lines(&mut self) {
        self.other_part();
        self.era = self.era.wrapping_add(1);
    }
}

/// What is known of a line.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Ahead {
    /// Lines after the first one of the run that begins there; when that was found, and whether a line that is added can
    /// still belong to the run.
    more: usize,
    found: u32,
    open: bool,
    /// The speed at which the run is to end, and the greatest at which it may begin for that. In this edition all lines
    /// after the run can slow down in time.
    entry: Option<(Real, Real)>,
    edition: u32,
    /// The greatest entry found in an era.
    promise: (u32, Real),
}

impl Ahead {
    pub(crate) const NONE: Self =
        Self { more: 0, found: 0, open: true, entry: None, edition: 0, promise: (0, Real::ZERO) };

    /// Returns how many lines follow the first one in the run that begins there.
    pub(super) fn run(&self, times: Times) -> Option<usize> {
        let holds = self.found == if self.open { times.edition } else { times.season };
        holds.then_some(self.more)
    }

    pub(super) fn know_run(&mut self, more: usize, open: bool, times: Times) {
        let found = if open { times.edition } else { times.season };
        (self.more, self.found, self.open, self.entry) = (more, found, open, None);
    }

    /// Returns the speed at its start from which all lines can slow down in time.
    pub(super) fn entry(&self, times: Times) -> Option<Real> {
        self.entry.filter(|_| self.edition == times.edition).map(|(_, entry)| entry)
    }

    /// Returns that speed if the run is to end at a speed for which it has been found already.
    pub(super) fn entry_to(&self, exit: Real) -> Option<Real> {
        self.entry.filter(|(own, _)| *own == exit).map(|(_, entry)| entry)
    }

    pub(super) fn know_entry(&mut self, exit: Real, entry: Real, times: Times) {
        (self.entry, self.edition) = (Some((exit, entry)), times.edition);
        self.promise = (times.era, entry.max(self.promised(times)));
    }

    pub(super) fn promised(&self, times: Times) -> Real {
        let (era, speed) = self.promise;
        if era == times.era { speed } else { Real::ZERO }
    }
}
