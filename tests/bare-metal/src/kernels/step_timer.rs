//! The step interrupts of step-motion in each of their calls, and the background that feeds them.

mod machines;

use step_motion::{AxesQueue, AxesTimer, Axis, Clock, Fired, FiredAxes, Queue, StepTimer, Work};

use machines::{Job, PART, Shuttle, Square, limits};

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
static LONG: Queue<129> = Queue::new();
static SHORT: Queue<129> = Queue::new();
static ASKED: Queue<129> = Queue::new();
static SLICES: Queue<129> = Queue::new();
static MOVES: [Queue<129>; 3] = [const { Queue::new() }; 3];
static RAMPS: [Queue<129>; 6] = [const { Queue::new() }; 6];
static PATHS: [AxesQueue<3, 257>; 5] = [const { AxesQueue::new() }; 5];

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

    /// A millisecond of that motion with all of its background and the interrupt: the first 50 s of it.
    fn step_motion_axes_millisecond(job: &mut Job, _input: &i8) -> bool {
        job.millisecond()
    } as {
        Job::new(&PATHS[4]).map_or(0, |mut own| tenths_of(50_000 / PART, &mut own, step_motion_axes_millisecond, &[0]))
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
