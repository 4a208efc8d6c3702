//! Axes with their interrupt, on which the kernels are measured.

use servowire_core::Direction;
use step_motion::{
    Axes, AxesQueue, AxesTimer, Axis, AxisSetup, Clock, Fired, FiredAxes, Limits, Path, Queue, StepTimer, Work,
};

static LINES: AxesQueue<3, 257> = AxesQueue::new();

mod toolpaths {
    include!(concat!(env!("OUT_DIR"), "/toolpaths.rs"));
}
use toolpaths::{AHEAD, AXES, DEVIATION, TOOLPATHS};

/// Numbers that are random enough, and the same in each run.
pub(super) struct Dice(u32);

impl Dice {
    pub(super) fn throw(&mut self, sides: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 16) % sides
    }
}

/// An axis that goes back and forth, with its interrupt, and how far.
pub(super) struct Shuttle {
    pub(super) axis: Axis<'static, 129>,
    pub(super) timer: StepTimer<'static, 129>,
    pub(super) way: i64,
    pub(super) dice: Dice,
}

impl Shuttle {
    /// At 168 MHz, to 50,000 steps/s if the way is long enough.
    pub(super) fn new(queue: &'static Queue<129>, way: i64, jerk: u64) -> Option<Self> {
        Self::on(queue, 168_000_000, Limits::new(50_000, 100_000).ok()?.with_jerk(jerk).ok()?, way)
    }

    /// On a clock of `hz`, over two ramps of so many steps to 100,000 steps/s.
    pub(super) fn ramps(queue: &'static Queue<129>, hz: u32, ramp: u32) -> Option<Self> {
        let acceleration = 5_000_000_000_u64.div_ceil(ramp.into()).try_into().ok()?;
        Self::on(queue, hz, Limits::new(100_000, acceleration).ok()?, ramp.into())
    }

    pub(super) fn on(queue: &'static Queue<129>, hz: u32, limits: Limits, way: i64) -> Option<Self> {
        let (axis, timer) = Axis::new(queue, Clock::new(hz)?, limits).ok()?;
        Some(Self { axis, timer, way, dice: Dice(1) })
    }

    pub(super) fn slice(&mut self) -> Work {
        let work = self.axis.poll();
        if work == Work::Rest {
            self.way = -self.way;
            let _: Result<_, _> = self.axis.move_to(self.way);
        }
        work
    }

    /// An event, and all that the background has to do then.
    pub(super) fn event(&mut self) -> Fired {
        while matches!(self.slice(), Work::More | Work::Rest) {}
        self.timer.fire()
    }

    /// A step, and all that the background has to do up to it.
    pub(super) fn step(&mut self) -> Fired {
        loop {
            let fired = self.event();
            if fired.is_step() {
                return fired;
            }
        }
    }

    /// A random request: mostly a move.
    pub(super) fn ask(&mut self) -> bool {
        let (way, speed) = (i64::from(self.dice.throw(5000)), self.dice.throw(50_000));
        let own = &mut self.axis;
        match self.dice.throw(16) {
            0 => own.hold(),
            1 | 2 => own.resume(),
            3 => own.set_override(u16::try_from(speed % 150).unwrap_or(0)),
            4 => own.stop(),
            5 => {
                let Some(hard) = limits() else { return false };
                own.quick_stop(hard);
            }
            6 | 7 => return own.run(Direction::of(way - 2500), speed).is_ok(),
            8..12 => return own.move_to(way / 50).is_ok(),
            _ => return own.move_to(way - 2500).is_ok(),
        }
        true
    }

    /// At one end of its way, from which it goes all of it.
    pub(super) fn at_its_end(mut self) -> Self {
        let end = -self.way;
        while self.axis.commanded() != end {
            self.event();
        }
        self
    }
}

/// Three axes that go round a square, a little up and down, with their interrupt.
pub(super) struct Square {
    pub(super) axes: Axes<'static, 3, 8, 257>,
    pub(super) timer: AxesTimer<'static, 3, 257>,
    pub(super) corner: usize,
}

impl Square {
    /// At 168 MHz, 50 mm at 100 mm/s, 80 steps/mm.
    pub(super) fn new() -> Option<Self> {
        let limits = Limits::new(20_000, 200_000).ok()?.with_jerk(4_000_000).ok()?;
        let path = Path::new(Clock::new(168_000_000)?, [AxisSetup::new(limits, 80_000); 3], 20).ok()?;
        let (axes, timer) = Axes::new(&LINES, path);
        Some(Self { axes, timer, corner: 0 })
    }

    /// An event, and all that the background has to do then.
    pub(super) fn event(&mut self) -> FiredAxes {
        const CORNERS: [[i64; 3]; 4] = [[4000, 0, 40], [4000, 4000, 0], [0, 4000, 40], [0, 0, 0]];
        while !self.axes.is_full() {
            let to = CORNERS.get(self.corner).copied().unwrap_or_default();
            let _: Result<_, _> = self.axes.push(to, 100_000);
            self.corner = (self.corner + 1) % CORNERS.len();
        }
        while self.axes.poll() == Work::More {}
        self.timer.fire()
    }
}

/// On a Cortex-M0+ only an eighth of each toolpath is followed, or it would take a minute.
pub(super) const PART: usize = if cfg!(target_has_atomic = "ptr") { 1 } else { 8 };

/// The ten toolpaths of step-motion's tests one after another, each from where the last one ended, with their interrupt.
pub(super) struct Job {
    pub(super) axes: Axes<'static, 3, AHEAD, 257>,
    pub(super) timer: AxesTimer<'static, 3, 257>,
    /// The path, and the line of it that is pushed next.
    pub(super) path: usize,
    pub(super) line: usize,
    /// Steps that have been made and not counted yet.
    pub(super) ahead: u32,
    pub(super) dice: Dice,
    /// Ticks to the end of a millisecond.
    pub(super) ticks: u32,
}

impl Job {
    pub(super) fn new(queue: &'static AxesQueue<3, 257>) -> Option<Self> {
        let [x, y, z] = AXES.map(|[per_m, v, a, j]| {
            let limits = Limits::new(v, a).ok()?.with_jerk(j.into()).ok()?;
            Some(AxisSetup::new(limits, per_m))
        });
        let path = Path::new(Clock::new(168_000_000)?, [x?, y?, z?], DEVIATION).ok()?;
        let (axes, timer) = Axes::new(queue, path);
        Some(Self { axes, timer, path: 0, line: 0, ahead: 0, dice: Dice(1), ticks: 0 })
    }

    pub(super) fn path(at: usize) -> Option<impl Iterator<Item = &'static ([i32; 3], u32)>> {
        let path = TOOLPATHS.get(at)?;
        Some(path.iter().take((path.len() / PART).max(4)))
    }

    /// The next line; none after the last one.
    pub(super) fn next(&mut self) -> Option<([i64; 3], u32)> {
        loop {
            if let Some((to, feed)) = Self::path(self.path)?.nth(self.line) {
                self.line += 1;
                return Some((to.map(i64::from), *feed));
            }
            (self.path, self.line) = (self.path + 1, 0);
        }
    }

    /// An event, and all that the background has to do then.
    pub(super) fn event(&mut self) -> FiredAxes {
        while !self.axes.is_full() {
            let Some((to, feed)) = self.next() else { break };
            let _: Result<_, _> = self.axes.push(to, feed);
        }
        while self.axes.poll() == Work::More {}
        self.timer.fire()
    }

    /// All events of a millisecond.
    pub(super) fn millisecond(&mut self) -> bool {
        const MILLISECOND: u32 = 168_000;
        let mut events = 0;
        while self.ticks < MILLISECOND && events < MILLISECOND {
            self.ticks += self.event().wait();
            events += 1;
        }
        self.ticks -= self.ticks.min(MILLISECOND);
        events > 0
    }

    /// A step of any axis.
    pub(super) fn step(&mut self) -> bool {
        for _ in 0..1000 {
            if self.ahead > 0 {
                break;
            }
            self.ahead = self.event().steps().count_ones();
        }
        let made = self.ahead > 0;
        self.ahead = self.ahead.saturating_sub(1);
        made
    }

    /// A random request.
    pub(super) fn ask(&mut self) -> bool {
        let own = &mut self.axes;
        match self.dice.throw(10) {
            0 => own.hold(),
            1 | 2 => own.resume(),
            3 => own.set_override(20),
            4 => own.set_override(60),
            5 | 6 => own.set_override(120),
            7 => own.stop(),
            8 => {
                let Some(hard) = limits() else { return false };
                own.quick_stop([hard; 3]);
            }
            _ => return own.move_to(own.target().map(|at| at + 500), 100_000).is_ok(),
        }
        true
    }

    /// Pushes lines as long as there is room, from the first path again after the last one.
    pub(super) fn fill(&mut self) {
        if self.path >= TOOLPATHS.len() {
            (self.path, self.line) = (0, 0);
        }
        while !self.axes.is_full() {
            let Some((to, feed)) = self.next() else { break };
            if self.axes.push(to, feed).is_err() {
                break;
            }
        }
    }

    /// An event, and a request before one of so many.
    pub(super) fn stirred(&mut self, of: u32) {
        if self.dice.throw(of) == 0 {
            self.ask();
        }
        while self.axes.poll() == Work::More {}
        self.timer.fire();
    }

    /// Steps of all axes on all paths.
    pub(super) fn steps() -> usize {
        let (mut steps, mut at) = (0, [0; 3]);
        for (to, _) in (0..).map_while(Self::path).flatten() {
            steps += to.iter().zip(at).map(|(to, at)| to.abs_diff(at) as usize).sum::<usize>();
            at = *to;
        }
        steps
    }
}

pub(super) fn limits() -> Option<Limits> {
    Limits::new(20_000, 100_000).ok()
}
