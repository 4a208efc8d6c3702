//! The background half of a path: it plans along the lines, and hands segments for all axes to the interrupt.

mod braking;
mod making;
mod standing;

use core::sync::atomic::Ordering;

use servowire_core::Direction;

use crate::axes_timer::{AxesQueue, AxesTimer};
use crate::axis::{COARSE, EXACT, Work};
use crate::error::Error;
use crate::halts::Halts;
use crate::limits::Limits;
use crate::path::{AxisSetup, Path};
use crate::path_mover::PathMover;
use crate::real::Real;
use crate::requests::Requests;
use crate::writer::{LONGEST, Writer};

/// The axes of a path, whose steps are made in an interrupt.
///
/// It takes the requests of a [`PathMover`] and cuts the plan into segments, a little ahead of the [`AxesTimer`] that runs
/// them. A request takes effect at the end of the blocks already handed out: after at most twice the
/// [reach](Self::with_reach), and 32 ticks because a block does not end at a step. Only [`halt`](Self::halt) takes effect at once: no
/// step follows it. Each block is followed by a stop along the path: if [`poll`](Self::poll) is not called in time, the machine comes to
/// rest on its lines, and continues from there at the next call. Each step of that stop is exact to a sixteenth of an interval, or
/// [as exact as all others](Self::with_exact_stops); every other step is exact to 3/4 of a tick, or 25 ns if that is more. If a block
/// ends within two ticks of a step, or DIR changes, a step may be a tick or two late. DIR of an axis changes at least half of its
/// reversal pause after a step and before the next one, or a quarter of the reach if that is less.
///
/// A [`move_to`](Self::move_to), or a quick stop within other limits, takes the place of a block that is still being made: do not ask for
/// them faster than blocks are made.
///
/// It contains four copies of the [`PathMover`], so keep it in a `static` or on a large stack.
///
/// ```
/// use step_motion::{Axes, AxesQueue, AxisSetup, Clock, Limits, Path, Work};
/// static QUEUE: AxesQueue<2, 129> = AxesQueue::new();
/// let axis = AxisSetup::new(Limits::new(20_000, 200_000)?.with_jerk(4_000_000)?, 80_000);
/// let path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20)?;
/// let (mut axes, mut timer) = Axes::new(&QUEUE, path);
/// axes.push([800, 400], 100_000)?; // 10 mm and 5 mm, at 100 mm/s
/// axes.push([1600, 800], 100_000)?; // straight on: no stop
/// let mut steps = [0, 0];
/// loop {
///     match axes.poll() {
///         Work::More => continue,
///         Work::Rest => break,
///         _ => {}
///     }
///     // what the timer does
///     let fired = timer.fire();
///     for (axis, steps) in steps.iter_mut().enumerate() {
///         *steps += fired.steps() >> axis & 1;
///     }
/// }
/// assert_eq!((axes.commanded(), steps), ([1600, 800], [1600, 800]));
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Axes<'q, const N: usize, const M: usize, const S: usize> {
    queue: &'q AxesQueue<N, S>,
    /// How far off a step may be, in moments.
    off: Real,
    /// Ticks of motion in a block, and how many times this has been halved because slots ran out.
    reach: u32,
    shorter: u32,
    /// The path at the end of the blocks handed out, with the tick, DIR of each axis and the interrupt's step count at that
    /// point.
    path: PathMover<N, M>,
    end: u64,
    dirs: [Direction; N],
    made: [u32; N],
    /// The block being made from it: the stage of the work, its copy of the path, whether that is still the same, the block
    /// and its writers.
    stage: Stage,
    work: PathMover<N, M>,
    same: bool,
    block: usize,
    writers: [Writer; N],
    /// The axis being cut, and how many axes before it had nothing to cut.
    axis: usize,
    quiet: usize,
    /// Where the block is to end, how often that was postponed, and the writers at that point.
    until: u64,
    put_off: u8,
    joint: [Writer; N],
    /// The present exactness of the stop, and the best that is allowed.
    coarse: u32,
    finest: u32,
    /// The stop after each of the two blocks, with all later requests.
    stops: [PathMover<N, M>; 2],
    outs: [Out<N>; 2],
    /// The interrupt is stopped, and the following motion begins there; and the tick at which it last stood.
    standing: bool,
    stood: u64,
    /// The interrupt has not entered the last block yet.
    pending: bool,
    /// There is a request that the path does not follow yet.
    asked: bool,
    /// The block being made is for a request, and there is another one that it does not follow.
    told: bool,
    later: bool,
    /// The plan cannot be run.
    lost: bool,
    turn: u32,
    halts: Halts,
    /// The limits of the last quick stop.
    hard: Option<[Limits; N]>,
}

/// The present work of the background.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Idle,
    /// The lines that were added are to be taken into account.
    LookAhead,
    Block,
    /// The stop after it is to be planned: from a copy of the path that has still to be made, or from that copy.
    Brake,
    Hold,
    Stop,
}

/// The finished part of a block.
#[derive(Debug, Clone, Copy)]
struct Out<const N: usize> {
    /// The interrupt may reach the stop of this block.
    valid: bool,
    /// Slots of the first axis that come before the stop.
    len: usize,
    /// Where the stop ends.
    end: u64,
    dirs: [Direction; N],
}

/// How often the end of a block may be postponed so that it makes no step late.
const PUT_OFF: u8 = 8;

impl<'q, const N: usize, const M: usize, const S: usize> Axes<'q, N, M, S> {
    /// Creates the axes at rest at the present end of `path`, and the other end of the queue for the interrupt. A queue
    /// serves one such pair. Lines already in the path begin with the first request.
    pub fn new(queue: &'q AxesQueue<N, S>, path: Path<N, M>) -> (Self, AxesTimer<'q, N, S>) {
        let path = PathMover::new(path).cutting();
        let clock = path.clock();
        let dirs = [Direction::Forward; N];
        let out = Out { valid: false, len: 0, end: 0, dirs };
        let axes = Self {
            queue,
            off: clock.blur(),
            reach: (clock.hz() / 100).max(4),
            shorter: 0,
            work: path.clone(),
            stops: [path.clone(), path.clone()],
            path,
            end: 0,
            dirs,
            made: [0; N],
            stage: Stage::Idle,
            same: false,
            block: 0,
            writers: [Writer::new(0, Direction::Forward); N],
            axis: 0,
            quiet: 0,
            until: 0,
            put_off: 0,
            joint: [Writer::new(0, Direction::Forward); N],
            coarse: COARSE,
            finest: COARSE,
            outs: [out; 2],
            standing: true,
            stood: 0,
            pending: false,
            asked: false,
            told: false,
            later: false,
            lost: false,
            turn: 0,
            halts: Halts::NONE,
            hard: None,
        };
        (axes, AxesTimer::new(queue))
    }

    /// Sets how many ticks of motion are in each half of the queue, at least 4; 10 ms by default.
    pub fn with_reach(self, ticks: u32) -> Self {
        Self { reach: ticks.clamp(4, LONGEST), ..self }
    }

    /// Makes the stop after each block as exact as all other steps, if the [`AxesQueue`] has slots for it. This takes
    /// about three times as many slots and instructions.
    pub fn with_exact_stops(self) -> Self {
        Self { finest: EXACT, ..self }
    }

    /// Steps of each axis made so far, forward minus reverse.
    pub fn commanded(&self) -> [i64; N] {
        let mut commanded = self.path.commanded();
        for ((at, made), queue) in commanded.iter_mut().zip(self.made).zip(&self.queue.axes) {
            #[expect(clippy::cast_possible_wrap, reason = "a difference in two's complement")]
            let ahead = made.wrapping_sub(queue.made.load(Ordering::Acquire)) as i32;
            *at = at.wrapping_sub(ahead.into());
        }
        commanded
    }

    /// The end of the last line, in steps; after a [`stop`](Self::stop), the place where it will end.
    pub fn target(&self) -> [i64; N] {
        let (place, _) = self.place();
        let stop = self.stop_at(place).and_then(|block| self.stops.get(block));
        stop.map_or_else(|| self.path.target(), PathMover::target)
    }

    /// Returns whether no line can be pushed: the queue is full, or would be if the machine came to rest because the
    /// background is late.
    pub fn is_full(&self) -> bool {
        let stops = self.stops.iter().enumerate().any(|(at, stop)| self.may_come_to(at) && stop.is_full());
        stops || self.path.is_full()
    }

    /// Returns whether the interrupt is stopped and no motion is pending (or it is on hold).
    pub fn is_at_rest(&self) -> bool {
        !self.halts.is_pending() && self.standing && !self.pending && !self.goes_on()
    }

    /// Returns whether the last stop was [`halt`](Self::halt): the steps are counted, but the motors may have run on.
    pub const fn is_halted(&self) -> bool {
        self.path.is_halted()
    }

    /// Does the same as [`PathMover::push`].
    ///
    /// # Errors
    /// The same, and [`Error::Moving`] before [`poll`](Self::poll) has seen the interrupt confirm a [`halt`](Self::halt).
    pub fn push(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        self.ready()?;
        if self.is_full() {
            return Err(Error::QueueFull);
        }
        self.path.check(&target)?;
        let line = self.path.line_to(target, feed)?;
        // In the copies it is mostly the same one.
        let like = [&self.work, &self.stops[0], &self.stops[1]].map(|other| other.ends_as(&self.path));
        self.path.append(line, target, self.end);
        let add = |other: &mut PathMover<N, M>, like: bool, end| {
            let line = if like { line } else { other.line_to(target, feed)? };
            other.append(line, target, end);
            Ok(())
        };
        if self.stage == Stage::Hold {
            // The copy does not have the line.
            self.stage = Stage::Brake;
        }
        if self.stage != Stage::Idle || self.same {
            // The same lines, or some of them: there is room for this one. After the block, if that is complete; and in it an axis
            // that had nothing to do may have to step now.
            let complete = matches!(self.stage, Stage::Brake | Stage::Hold | Stage::Stop);
            let _: Result<(), Error> = add(&mut self.work, like[0], if complete { self.until } else { self.end });
            self.quiet = 0;
        }
        let [_, stops @ ..] = like;
        self.tell_stops(|at, stop, end| add(stop, stops.get(at).copied().unwrap_or(false), end));
        Ok(())
    }

    /// Does the same as [`PathMover::move_to`].
    ///
    /// # Errors
    /// The same, and [`Error::Moving`] before [`poll`](Self::poll) has seen the interrupt confirm a [`halt`](Self::halt).
    pub fn move_to(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        self.path.check(&target)?;
        self.move_freely(target, feed)
    }

    /// Does that wherever the soft limits are.
    pub(super) fn move_freely(&mut self, target: [i64; N], feed: u32) -> Result<(), Error> {
        self.ready()?;
        self.path.go_to(target, feed, self.end)?;
        self.begin_anew();
        self.told = true;
        self.tell_stops(|_, stop, end| stop.go_to(target, feed, end));
        Ok(())
    }

    /// Does the same as [`Path::set_deviation`].
    pub fn set_deviation(&mut self, deviation: u32) {
        self.path.set_deviation(deviation);
        self.work.set_deviation(deviation);
        for stop in &mut self.stops {
            stop.set_deviation(deviation);
        }
    }

    /// Does the same as [`PathMover::set_override`].
    pub fn set_override(&mut self, percent: u16) {
        self.change(|requests| requests.set_override(percent));
    }

    /// Does the same as [`PathMover::hold`].
    pub fn hold(&mut self) {
        self.change(Requests::hold);
    }

    /// Does the same as [`PathMover::resume`].
    pub fn resume(&mut self) {
        self.change(Requests::resume);
    }

    /// Does the same as [`PathMover::stop`].
    pub fn stop(&mut self) {
        let (before, lines) = (self.path.requests(), self.path.len());
        self.path.stop(self.end);
        let same = self.path.requests().are_as(before) && self.path.len() == lines;
        if self.stage == Stage::Idle || !same {
            self.begin_anew();
            self.told = true;
        }
        self.tell_stops(|_, stop, end| {
            stop.stop(end);
            Ok(())
        });
    }

    /// Does the same as [`PathMover::quick_stop`].
    pub fn quick_stop(&mut self, limits: [Limits; N]) {
        if self.path.requests().is_quick() && self.hard == Some(limits) {
            return;
        }
        self.hard = Some(limits);
        self.begin_anew();
        self.told = true;
        self.path.quick_stop(limits, self.end);
        // Without a step of its own, it still takes the place of the stop after the last block.
        self.asked |= self.path.due().is_none() && self.runs_on();
        self.tell_stops(|_, stop, end| {
            stop.quick_stop(limits, end);
            Ok(())
        });
    }

    /// Makes no further step from now on: the interrupt sees this without the queue. Lines are refused until the interrupt
    /// has been called once more, which [`poll`](Self::poll) asks for, and `poll` has seen it; other requests count from then on.
    pub fn halt(&mut self) {
        if let Some(queue) = self.queue.axes.first() {
            self.halts.ask(&queue.halt);
        }
        self.path.halt_before(self.end);
        self.begin_anew();
    }

    /// Does the same as [`PathMover::set_commanded`].
    ///
    /// # Errors
    /// [`Error::Moving`] before it is [at rest](Self::is_at_rest).
    pub fn set_commanded(&mut self, steps: [i64; N]) -> Result<(), Error> {
        if !self.is_at_rest() {
            return Err(Error::Moving);
        }
        self.begin_anew();
        self.path.rename(steps, self.end);
        Ok(())
    }

    pub(super) const fn requests(&self) -> Requests {
        self.path.requests()
    }

    /// The setup of each axis.
    pub(super) const fn setup(&self) -> &[AxisSetup; N] {
        self.path.axes()
    }

    /// Does a slice of the background's work: a segment, a plan, or a check of the interrupt. Call it until it returns
    /// anything but [`Work::More`], again after each request, and every half [reach](Self::with_reach).
    pub fn poll(&mut self) -> Work {
        if self.halts.is_pending() {
            return self.confirm();
        }
        if self.pending && self.is_in(1_usize.wrapping_sub(self.block)) {
            (self.pending, self.standing) = (false, false);
            if let Some(out) = self.outs.get_mut(self.block) {
                out.valid = false;
            }
        }
        // Read after that: the interrupt may come at any time, and where it has been before the block is no rest in it.
        let (place, idle) = self.place();
        if let Some(block) = self.stop_at(place) {
            if idle {
                self.recover(block);
                return Work::More;
            }
            return Work::Later;
        }
        if self.pending {
            return if idle { Work::Start } else { Work::Later };
        }
        match self.stage {
            Stage::Idle if self.lost || !self.goes_on() => {
                if self.standing {
                    Work::Rest
                } else {
                    Work::Later
                }
            }
            Stage::Idle => self.begin(),
            Stage::LookAhead => self.look_ahead(),
            Stage::Block => self.cut_block(),
            Stage::Brake => self.brake(),
            Stage::Hold => self.hold_stop(),
            Stage::Stop => self.cut_stop(),
        }
    }

    /// Returns whether there is motion to plan or to cut.
    fn goes_on(&self) -> bool {
        self.asked || self.path.due().is_some()
    }

    /// Returns whether the interrupt may reach the stop of a block, or that stop is being cut.
    fn may_come_to(&self, block: usize) -> bool {
        let cut = self.stage == Stage::Stop && block == self.block;
        cut || self.outs.get(block).is_some_and(|out| out.valid)
    }

    /// Passes requests to the stops too, so that the machine would carry them out after a stop as well.
    fn tell_stops(&mut self, ask: impl Fn(usize, &mut PathMover<N, M>, u64) -> Result<(), Error>) {
        for at in 0..2 {
            if !self.may_come_to(at) {
                continue;
            }
            if let (Some(stop), Some(out)) = (self.stops.get_mut(at), self.outs.get(at)) {
                if ask(at, stop, out.end).is_err() {
                    stop.stop(out.end);
                }
            }
        }
    }

    /// Refuses motion until a halt has been seen, and during a quick stop.
    fn ready(&mut self) -> Result<(), Error> {
        self.halts.ready()?;
        self.path.set_lead(self.reach / 4);
        self.path.ready(self.is_at_rest())
    }

    /// Takes a request, which the next block follows. One for what is so already does not disturb the work on a block, and one
    /// that leaves the machine at rest there is done.
    fn change(&mut self, ask: impl FnOnce(&mut Requests)) {
        let rests = self.is_at_rest();
        if !self.path.ask(ask) {
            return;
        }
        if self.comes_first() {
            self.later = true;
        } else {
            self.begin_anew();
            self.asked = !rests || self.path.has_work();
        }
    }

    /// Returns whether the block being made has to be run before a new request is planned: one for the request before it, or requests
    /// that follow each other would never be carried out. A stop comes before a motion that has been asked for, but not before a stop.
    fn comes_first(&self) -> bool {
        self.stage != Stage::Idle && self.told && (self.work.requests().brakes() || !self.path.requests().brakes())
    }

    /// Forgets what has been cut but not handed out.
    const fn begin_anew(&mut self) {
        (self.stage, self.same, self.asked, self.later) = (Stage::Idle, false, false, false);
    }
}
