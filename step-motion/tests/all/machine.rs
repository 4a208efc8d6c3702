//! The interrupt of an axis, or of the axes of a path, and what its handler does. The fuzz targets have it from here.

use step_motion::{Axes, AxesTimer, Axis, StepTimer, Work};

/// An interrupt half.
pub(crate) trait Timer {
    /// Steps and DIR, with a bit for each axis, and the ticks to the next event.
    fn fired(&mut self) -> (u16, u16, u32);
}

impl<const S: usize> Timer for StepTimer<'_, S> {
    fn fired(&mut self) -> (u16, u16, u32) {
        let fired = self.fire();
        (fired.is_step().into(), fired.direction().dir().into(), fired.wait())
    }
}

impl<const N: usize, const S: usize> Timer for AxesTimer<'_, N, S> {
    fn fired(&mut self) -> (u16, u16, u32) {
        let fired = self.fire();
        (fired.steps(), fired.reverse(), fired.wait())
    }
}

/// A background half of `N` axes.
pub(crate) trait Background<const N: usize> {
    /// More slices than it needs at once.
    const SLICES: u32;
    /// Does a slice of its work.
    fn slice(&mut self) -> Work;
    /// The steps that it knows of.
    fn made(&self) -> [i64; N];
}

impl<const S: usize> Background<1> for Axis<'_, S> {
    const SLICES: u32 = 1000;

    fn slice(&mut self) -> Work {
        self.poll()
    }

    fn made(&self) -> [i64; 1] {
        [self.commanded()]
    }
}

impl<const N: usize, const M: usize, const S: usize> Background<N> for Axes<'_, N, M, S> {
    const SLICES: u32 = 20_000;

    fn slice(&mut self) -> Work {
        self.poll()
    }

    fn made(&self) -> [i64; N] {
        self.commanded()
    }
}

/// A timer, and what its handler does.
pub(crate) struct Machine<T, const N: usize> {
    timer: T,
    pub(crate) now: u64,
    /// When the compare register is reached.
    pub(crate) compare: Option<u64>,
    reverse: u16,
    /// When DIR changed, and the last step, of each axis.
    turned: [Option<u64>; N],
    last: [Option<u64>; N],
    /// The steps: when, which axis, and which way.
    pub(crate) steps: Vec<(u64, usize, i64)>,
    /// The changes of DIR between steps: ticks from the step before, and to the one after.
    pub(crate) turns: Vec<(u64, u64)>,
    /// Ticks from the last step of an axis to each change of its DIR, whether or not a step follows before the next one.
    pub(crate) edges: Vec<u64>,
    pub(crate) position: [i64; N],
}

impl<T: Timer, const N: usize> Machine<T, N> {
    pub(crate) fn new(timer: T) -> Self {
        let (turned, last) = ([None; N], [None; N]);
        let (steps, turns, edges) = (Vec::new(), Vec::new(), Vec::new());
        Self { timer, now: 0, compare: None, reverse: 0, turned, last, steps, turns, edges, position: [0; N] }
    }

    pub(crate) fn fire(&mut self) {
        let (steps, reverse, wait) = self.timer.fired();
        for axis in 0..N {
            let (step, back) = (steps >> axis & 1 != 0, reverse >> axis & 1 != 0);
            if back != (self.reverse >> axis & 1 != 0) {
                assert!(!step, "DIR changes with a step");
                assert!(self.last[axis].is_none_or(|last| last < self.now), "DIR changes in the tick of a step");
                self.edges.extend(self.last[axis].map(|last| self.now - last));
                self.turned[axis] = Some(self.now);
            }
            if step {
                assert!(self.last[axis].is_none_or(|last| last < self.now), "two steps in a tick");
                assert!(self.turned[axis].is_none_or(|turned| turned < self.now), "a step in the tick of DIR");
                if let (Some(turned), Some(last)) = (self.turned[axis].take(), self.last[axis]) {
                    self.turns.push((turned - last, self.now - turned));
                }
                let by = if back { -1 } else { 1 };
                self.last[axis] = Some(self.now);
                self.steps.push((self.now, axis, by));
                self.position[axis] += by;
            }
        }
        self.reverse = reverse;
        self.compare = (wait > 0).then(|| self.now + u64::from(wait));
    }

    /// Time goes on.
    pub(crate) fn until(&mut self, time: u64) {
        while let Some(compare) = self.compare.filter(|compare| *compare <= time) {
            self.now = compare;
            self.fire();
        }
        self.now = self.now.max(time);
    }

    /// All that is out.
    pub(crate) fn drain(&mut self) {
        while let Some(compare) = self.compare {
            self.until(compare);
        }
    }

    /// A slice of the background; the timer starts if it asks for that.
    pub(crate) fn slice(&mut self, background: &mut impl Background<N>) -> Work {
        let mut work = background.slice();
        if work == Work::Start && self.compare.is_none() {
            self.fire();
            work = Work::More;
        }
        assert_eq!(background.made(), self.position);
        work
    }

    /// The background in time: called every so many ticks, until it is at rest or a time comes.
    pub(crate) fn run<B: Background<N>>(&mut self, background: &mut B, every: u64, until: u64) -> Work {
        loop {
            let mut calls = 0;
            let work = loop {
                match self.slice(background) {
                    Work::More => calls += 1,
                    other => break other,
                }
                assert!(calls < B::SLICES, "the background does not end");
            };
            if self.now >= until || work == Work::Rest {
                return work;
            }
            self.until((self.now + every).min(until));
        }
    }
}
