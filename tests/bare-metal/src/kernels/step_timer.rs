//! The step interrupts of step-motion in each of their calls, and the background that feeds them.

use servowire_core::Direction;
use step_motion::{
    Axes, AxesQueue, AxesTimer, Axis, AxisSetup, Clock, Fired, FiredAxes, Limits, Path, Queue, StepTimer, Work,
};

use super::kernels_on_states;
use crate::count::{most_tenths, tenths_of, tenths_on};

/// Segments long enough that none ends, and segments of a step: every call goes on to the next one. The lengths tell the kernels
/// apart.
static STEPS: Queue<9> = Queue::new();
static SEGMENTS: Queue<11> = Queue::new();
static EMPTY: Queue<13> = Queue::new();
static HALTED: Queue<15> = Queue::new();
static ONE: AxesQueue<3, 9> = AxesQueue::new();
static ALL: AxesQueue<3, 11> = AxesQueue::new();
static LINES: AxesQueue<3, 257> = AxesQueue::new();
static LONG: Queue<129> = Queue::new();
static SHORT: Queue<129> = Queue::new();
static ASKED: Queue<129> = Queue::new();
static SLICES: Queue<129> = Queue::new();
static MOVES: [Queue<129>; 3] = [const { Queue::new() }; 3];
static RAMPS: [Queue<129>; 6] = [const { Queue::new() }; 6];
static PATHS: [AxesQueue<3, 257>; 5] = [const { AxesQueue::new() }; 5];

mod toolpaths {
    include!(concat!(env!("OUT_DIR"), "/toolpaths.rs"));
}
use toolpaths::{AHEAD, AXES, DEVIATION, TOOLPATHS};

/// Numbers that are random enough, and the same in each run.
struct Dice(u32);

impl Dice {
    fn throw(&mut self, sides: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 16) % sides
    }
}

/// An axis that goes back and forth, with its interrupt, and how far.
struct Shuttle {
    axis: Axis<'static, 129>,
    timer: StepTimer<'static, 129>,
    way: i64,
    dice: Dice,
}

impl Shuttle {
    /// At 168 MHz, to 50,000 steps/s if the way is long enough.
    fn new(queue: &'static Queue<129>, way: i64, jerk: u64) -> Option<Self> {
        Self::on(queue, 168_000_000, Limits::new(50_000, 100_000).ok()?.with_jerk(jerk).ok()?, way)
    }

    /// On a clock of `hz`, over two ramps of so many steps to 100,000 steps/s.
    fn ramps(queue: &'static Queue<129>, hz: u32, ramp: u32) -> Option<Self> {
        let acceleration = 5_000_000_000_u64.div_ceil(ramp.into()).try_into().ok()?;
        Self::on(queue, hz, Limits::new(100_000, acceleration).ok()?, ramp.into())
    }

    fn on(queue: &'static Queue<129>, hz: u32, limits: Limits, way: i64) -> Option<Self> {
        let (axis, timer) = Axis::new(queue, Clock::new(hz)?, limits).ok()?;
        Some(Self { axis, timer, way, dice: Dice(1) })
    }

    fn slice(&mut self) -> Work {
        let work = self.axis.poll();
        if work == Work::Rest {
            self.way = -self.way;
            let _: Result<_, _> = self.axis.move_to(self.way);
        }
        work
    }

    /// An event, and all that the background has to do then.
    fn event(&mut self) -> Fired {
        while matches!(self.slice(), Work::More | Work::Rest) {}
        self.timer.fire()
    }

    /// A step, and all that the background has to do up to it.
    fn step(&mut self) -> Fired {
        loop {
            let fired = self.event();
            if fired.is_step() {
                return fired;
            }
        }
    }

    /// A random request: mostly a move.
    fn ask(&mut self) -> bool {
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
    fn at_its_end(mut self) -> Self {
        let end = -self.way;
        while self.axis.commanded() != end {
            self.event();
        }
        self
    }
}

/// Three axes that go round a square, a little up and down, with their interrupt.
struct Square {
    axes: Axes<'static, 3, 8, 257>,
    timer: AxesTimer<'static, 3, 257>,
    corner: usize,
}

impl Square {
    /// At 168 MHz, 50 mm at 100 mm/s, 80 steps/mm.
    fn new() -> Option<Self> {
        let limits = Limits::new(20_000, 200_000).ok()?.with_jerk(4_000_000).ok()?;
        let path = Path::new(Clock::new(168_000_000)?, [AxisSetup::new(limits, 80_000); 3], 20).ok()?;
        let (axes, timer) = Axes::new(&LINES, path);
        Some(Self { axes, timer, corner: 0 })
    }

    /// An event, and all that the background has to do then.
    fn event(&mut self) -> FiredAxes {
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
const PART: usize = if cfg!(target_has_atomic = "ptr") { 1 } else { 8 };

/// The ten toolpaths of step-motion's tests one after another, each from where the last one ended, with their interrupt.
struct Job {
    axes: Axes<'static, 3, AHEAD, 257>,
    timer: AxesTimer<'static, 3, 257>,
    /// The path, and the line of it that is pushed next.
    path: usize,
    line: usize,
    /// Steps that have been made and not counted yet.
    ahead: u32,
    dice: Dice,
    /// Ticks to the end of a millisecond.
    ticks: u32,
}

impl Job {
    fn new(queue: &'static AxesQueue<3, 257>) -> Option<Self> {
        let [x, y, z] = AXES.map(|[per_m, v, a, j]| {
            let limits = Limits::new(v, a).ok()?.with_jerk(j.into()).ok()?;
            Some(AxisSetup::new(limits, per_m))
        });
        let path = Path::new(Clock::new(168_000_000)?, [x?, y?, z?], DEVIATION).ok()?;
        let (axes, timer) = Axes::new(queue, path);
        Some(Self { axes, timer, path: 0, line: 0, ahead: 0, dice: Dice(1), ticks: 0 })
    }

    fn path(at: usize) -> Option<impl Iterator<Item = &'static ([i32; 3], u32)>> {
        let path = TOOLPATHS.get(at)?;
        Some(path.iter().take((path.len() / PART).max(4)))
    }

    /// The next line; none behind the last one.
    fn next(&mut self) -> Option<([i64; 3], u32)> {
        loop {
            if let Some((to, feed)) = Self::path(self.path)?.nth(self.line) {
                self.line += 1;
                return Some((to.map(i64::from), *feed));
            }
            (self.path, self.line) = (self.path + 1, 0);
        }
    }

    /// An event, and all that the background has to do then.
    fn event(&mut self) -> FiredAxes {
        while !self.axes.is_full() {
            let Some((to, feed)) = self.next() else { break };
            let _: Result<_, _> = self.axes.push(to, feed);
        }
        while self.axes.poll() == Work::More {}
        self.timer.fire()
    }

    /// All events of a millisecond.
    fn millisecond(&mut self) -> bool {
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
    fn step(&mut self) -> bool {
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
    fn ask(&mut self) -> bool {
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

    /// Pushes lines as long as there is room, from the first path again behind the last one.
    fn fill(&mut self) {
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
    fn stirred(&mut self, of: u32) {
        if self.dice.throw(of) == 0 {
            self.ask();
        }
        while self.axes.poll() == Work::More {}
        self.timer.fire();
    }

    /// Steps of all axes on all paths.
    fn steps() -> usize {
        let (mut steps, mut at) = (0, [0; 3]);
        for (to, _) in (0..).map_while(Self::path).flatten() {
            steps += to.iter().zip(at).map(|(to, at)| to.abs_diff(at) as usize).sum::<usize>();
            at = *to;
        }
        steps
    }
}

fn limits() -> Option<Limits> {
    Limits::new(20_000, 100_000).ok()
}

kernels_on_states! {
    /// A step within a segment.
    fn step_timer_step(timer: &mut StepTimer<'static, 9>, _input: &()) -> Fired {
        timer.fire()
    } as {
        tenths_on(&mut StepTimer::endless(&STEPS, 65_535), step_timer_step, &[()])
    }

    /// A step that goes on to the next segment.
    fn step_timer_segment(timer: &mut StepTimer<'static, 11>, _input: &()) -> Fired {
        timer.fire()
    } as {
        tenths_on(&mut StepTimer::endless(&SEGMENTS, 1), step_timer_segment, &[()])
    }

    /// A call that finds nothing to do.
    fn step_timer_idle(timer: &mut StepTimer<'static, 13>, _input: &()) -> Fired {
        timer.fire()
    } as {
        let Some(limits) = limits() else { return 0 };
        let Ok((_, mut timer)) = Axis::new(&EMPTY, Clock::MICROSECONDS, limits) else { return 0 };
        tenths_on(&mut timer, step_timer_idle, &[()])
    }

    /// A call after a halt.
    fn step_timer_halt(timer: &mut StepTimer<'static, 15>, _input: &()) -> Fired {
        timer.fire()
    } as {
        let Some(limits) = limits() else { return 0 };
        let Ok((mut axis, mut timer)) = Axis::new(&HALTED, Clock::MICROSECONDS, limits) else { return 0 };
        axis.halt();
        tenths_on(&mut timer, step_timer_halt, &[()])
    }

    /// One of three axes makes a step.
    fn axes_timer_one(timer: &mut AxesTimer<'static, 3, 9>, _input: &()) -> FiredAxes {
        timer.fire()
    } as {
        tenths_on(&mut AxesTimer::endless(&ONE, 65_535, 1), axes_timer_one, &[()])
    }

    /// Three axes make a step, and each goes on to its next segment.
    fn axes_timer_all(timer: &mut AxesTimer<'static, 3, 11>, _input: &()) -> FiredAxes {
        timer.fire()
    } as {
        tenths_on(&mut AxesTimer::endless(&ALL, 1, 0), axes_timer_all, &[()])
    }

    /// An event of three axes with all of its background, along lines of 4000 steps.
    fn step_motion_axes_lines(square: &mut Square, _input: &()) -> FiredAxes {
        square.event()
    } as {
        Square::new().map_or(0, |mut own| tenths_on(&mut own, step_motion_axes_lines, &[()]))
    }

    /// A step with all of its background, on ramps of 2500 steps of an S-curve: up and down twice.
    fn step_motion_axis_long(shuttle: &mut Shuttle, _input: &()) -> Fired {
        shuttle.event()
    } as {
        let Some(own) = Shuttle::new(&LONG, 2500, 1_000_000) else { return 0 };
        tenths_of(2 * 5000, &mut own.at_its_end(), step_motion_axis_long, &[()])
    }

    /// The same on ramps of 100 steps, ten times.
    fn step_motion_axis_short(shuttle: &mut Shuttle, input: &u8) -> (Fired, u8) {
        (shuttle.event(), *input)
    } as {
        let Some(own) = Shuttle::new(&SHORT, 100, 5_000_000) else { return 0 };
        tenths_of(10 * 200, &mut own.at_its_end(), step_motion_axis_short, &[0])
    }

    /// A step with all of its background, in moves of 250, 2500 and 25000 steps: there and back.
    fn step_motion_axis_250(shuttle: &mut Shuttle, input: &u64) -> (Fired, u64) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::new(&MOVES[0], 125, 1_000_000) else { return 0 };
        tenths_of(20 * 250, &mut own.at_its_end(), step_motion_axis_250, &[0])
    }

    /// The same.
    fn step_motion_axis_2500(shuttle: &mut Shuttle, input: &u32) -> (Fired, u32) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::new(&MOVES[1], 1250, 1_000_000) else { return 0 };
        tenths_of(4 * 2500, &mut own.at_its_end(), step_motion_axis_2500, &[0])
    }

    /// The same.
    fn step_motion_axis_25000(shuttle: &mut Shuttle, input: &i16) -> (Fired, i16) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::new(&MOVES[2], 12_500, 1_000_000) else { return 0 };
        tenths_of(2 * 25_000, &mut own.at_its_end(), step_motion_axis_25000, &[0])
    }

    /// A step with all of its background, in moves of two ramps of 32, 250 and 2500 steps to 100,000 steps/s; first in ticks of
    /// 1 us, then at 168 MHz.
    fn step_motion_ramps_32_us(shuttle: &mut Shuttle, input: &[u8; 1]) -> (Fired, [u8; 1]) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::ramps(&RAMPS[0], 1_000_000, 32) else { return 0 };
        tenths_of(20 * 2 * 32, &mut own.at_its_end(), step_motion_ramps_32_us, &[[0; 1]])
    }

    /// The same.
    fn step_motion_ramps_250_us(shuttle: &mut Shuttle, input: &[u8; 2]) -> (Fired, [u8; 2]) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::ramps(&RAMPS[1], 1_000_000, 250) else { return 0 };
        tenths_of(20 * 2 * 250, &mut own.at_its_end(), step_motion_ramps_250_us, &[[0; 2]])
    }

    /// The same.
    fn step_motion_ramps_2500_us(shuttle: &mut Shuttle, input: &[u8; 3]) -> (Fired, [u8; 3]) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::ramps(&RAMPS[2], 1_000_000, 2500) else { return 0 };
        tenths_of(20 * 2 * 2500, &mut own.at_its_end(), step_motion_ramps_2500_us, &[[0; 3]])
    }

    /// The same.
    fn step_motion_ramps_32(shuttle: &mut Shuttle, input: &[u8; 4]) -> (Fired, [u8; 4]) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::ramps(&RAMPS[3], 168_000_000, 32) else { return 0 };
        tenths_of(20 * 2 * 32, &mut own.at_its_end(), step_motion_ramps_32, &[[0; 4]])
    }

    /// The same.
    fn step_motion_ramps_250(shuttle: &mut Shuttle, input: &[u8; 5]) -> (Fired, [u8; 5]) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::ramps(&RAMPS[4], 168_000_000, 250) else { return 0 };
        tenths_of(20 * 2 * 250, &mut own.at_its_end(), step_motion_ramps_250, &[[0; 5]])
    }

    /// The same.
    fn step_motion_ramps_2500(shuttle: &mut Shuttle, input: &[u8; 6]) -> (Fired, [u8; 6]) {
        (shuttle.step(), *input)
    } as {
        let Some(own) = Shuttle::ramps(&RAMPS[5], 168_000_000, 2500) else { return 0 };
        tenths_of(20 * 2 * 2500, &mut own.at_its_end(), step_motion_ramps_2500, &[[0; 6]])
    }

    /// A step of any axis with all of its background, on the ten toolpaths of step-motion's tests.
    fn step_motion_axes_job(job: &mut Job, _input: &()) -> bool {
        job.step()
    } as {
        Job::new(&PATHS[0]).map_or(0, |mut own| tenths_of(Job::steps(), &mut own, step_motion_axes_job, &[()]))
    }

    /// A millisecond of that motion with all of its background and the interrupt.
    fn step_motion_axes_millisecond(job: &mut Job, _input: &i8) -> bool {
        job.millisecond()
    } as {
        Job::new(&PATHS[4]).map_or(0, |mut own| tenths_of(75_000 / PART, &mut own, step_motion_axes_millisecond, &[0]))
    }

    /// The worst slice of the background of these axes, to 40 instructions, with requests at random moments.
    fn step_motion_axes_slice(job: &mut Job, _input: &u8) -> Work {
        job.axes.poll()
    } as {
        let Some(mut job) = Job::new(&PATHS[1]) else { return 0 };
        most_tenths(500_000 / PART, |clock| {
            if job.dice.throw(400) == 0 {
                job.ask();
            }
            job.fill();
            match clock(&mut || step_motion_axes_slice(&mut job, &0)) {
                Work::More => {}
                _ => _ = job.timer.fire(),
            }
        })
    }

    /// The worst push of a line to these axes.
    fn step_motion_axes_push(job: &mut Job, _input: &u16) -> bool {
        let Some((to, feed)) = job.next() else { return false };
        job.axes.push(to, feed).is_ok()
    } as {
        let Some(mut job) = Job::new(&PATHS[2]) else { return 0 };
        most_tenths(4000 / PART, |clock| {
            while job.axes.is_full() {
                job.stirred(50);
            }
            clock(&mut || step_motion_axes_push(&mut job, &0));
        })
    }

    /// The worst request to these axes, at a random moment.
    fn step_motion_axes_request(job: &mut Job, _input: &u32) -> bool {
        job.ask()
    } as {
        let Some(mut job) = Job::new(&PATHS[3]) else { return 0 };
        most_tenths(8000 / PART, |clock| {
            for _ in 0..1 << job.dice.throw(11) {
                job.fill();
                job.event();
            }
            clock(&mut || step_motion_axes_request(&mut job, &0));
        })
    }

    /// The worst slice of the background of one axis, to 40 instructions, with requests at random moments.
    fn step_motion_axis_slice(shuttle: &mut Shuttle, _input: &u8) -> Work {
        shuttle.axis.poll()
    } as {
        let Some(mut own) = Shuttle::new(&SLICES, 1000, 2_000_000) else { return 0 };
        most_tenths(100_000 / PART, |clock| {
            if own.dice.throw(100) == 0 {
                own.ask();
            }
            match clock(&mut || step_motion_axis_slice(&mut own, &0)) {
                Work::More => {}
                _ => _ = own.timer.fire(),
            }
        })
    }

    /// The worst request to one axis, at a random moment.
    fn step_motion_axis_request(shuttle: &mut Shuttle, _input: &u32) -> bool {
        shuttle.ask()
    } as {
        let Some(mut own) = Shuttle::new(&ASKED, 1000, 2_000_000) else { return 0 };
        most_tenths(4000 / PART, |clock| {
            for _ in 0..1 << own.dice.throw(10) {
                while own.axis.poll() == Work::More {}
                own.timer.fire();
            }
            clock(&mut || step_motion_axis_request(&mut own, &0));
        })
    }
}
