//! An interrupt that comes between any two accesses of the background to what they share, for one event or until it has none: the
//! machine can always be started again, and comes to where it is told.

use std::boxed::Box;
use std::rc::Rc;
use std::vec;

use core::cell::RefCell;

use proptest::prelude::*;

use super::watched::interrupt;
use crate::{Axes, AxesQueue, Axis, AxisSetup, Clock, Limits, Path, Queue, Work};

const N: usize = 2;
const SLOTS: usize = 41;

/// What happens to the machine.
#[derive(Debug, Clone, Copy)]
enum Event {
    /// A line, which may be refused; a new target.
    To([i64; N]),
    Away([i64; N]),
    Quick,
    Hold,
    Resume,
    Stop,
    Halt,
    Override(u16),
    /// Slices of the background.
    Slices(u32),
    /// The background, until the first axis has made so many more steps.
    Steps(u64),
    /// All that is out, without the background.
    Starve,
    /// The background, until the machine is at rest.
    Rest,
}

/// Either machine.
trait Background {
    fn poll(&mut self) -> Work;
    fn ask(&mut self, event: Event);
    fn made(&self) -> [i64; N];
    fn is_at_rest(&self) -> bool;
}

/// The requests that are the same ones for both.
macro_rules! ask {
    ($machine:ident, $request:ident) => {
        match $request {
            Event::Hold => $machine.hold(),
            Event::Resume => $machine.resume(),
            Event::Stop => $machine.stop(),
            Event::Halt => $machine.halt(),
            Event::Override(percent) => $machine.set_override(percent),
            other => unreachable!("{other:?}"),
        }
    };
}

impl Background for Axis<'static, SLOTS> {
    fn poll(&mut self) -> Work {
        self.poll()
    }

    fn ask(&mut self, event: Event) {
        match event {
            Event::To([to, _]) | Event::Away([to, _]) => _ = self.move_to(to),
            Event::Quick => self.quick_stop(Limits::new(1, 9_000_000).unwrap()),
            request => ask!(self, request),
        }
    }

    fn made(&self) -> [i64; N] {
        [self.commanded(), 0]
    }

    fn is_at_rest(&self) -> bool {
        self.is_at_rest()
    }
}

impl Background for Axes<'static, N, 4, SLOTS> {
    fn poll(&mut self) -> Work {
        self.poll()
    }

    fn ask(&mut self, event: Event) {
        match event {
            Event::To(to) => _ = self.push(to, 250_000),
            Event::Away(to) => _ = self.move_to(to, 250_000),
            Event::Quick => self.quick_stop([Limits::new(1, 9_000_000).unwrap(); N]),
            request => ask!(self, request),
        }
    }

    fn made(&self) -> [i64; N] {
        self.commanded()
    }

    fn is_at_rest(&self) -> bool {
        self.is_at_rest()
    }
}

type Fire = Box<dyn FnMut() -> (u16, u16, u32)>;
type Halves = (Box<dyn Background>, Fire);

/// The interrupt, and when it comes.
struct Interrupt {
    fire: Fire,
    running: bool,
    now: u64,
    position: [i64; N],
    steps: u64,
    last: [Option<(u64, bool)>; N],
    reverse: u16,
    /// Accesses of the background so far.
    accesses: u32,
    times: Times,
}

impl Interrupt {
    fn event(&mut self) {
        let (steps, reverse, wait) = (self.fire)();
        assert_eq!((self.reverse ^ reverse) & steps, 0, "DIR changes with a step");
        self.reverse = reverse;
        for axis in (0..N).filter(|axis| steps >> axis & 1 != 0) {
            let back = reverse >> axis & 1 != 0;
            if let Some((last, _)) = self.last[axis].filter(|(_, way)| *way == back) {
                assert!(self.now >= last + 48, "{} ticks, 50 are the fastest", self.now - last);
            }
            self.last[axis] = Some((self.now, back));
            self.position[axis] += if back { -1 } else { 1 };
            self.steps += u64::from(axis == 0);
        }
        self.now += u64::from(wait);
        self.running = wait > 0;
    }

    fn events(&mut self, most: u32) {
        for _ in 0..most {
            if !self.running {
                break;
            }
            self.event();
        }
    }

    fn access(&mut self) {
        let Times { at, events, pace, .. } = self.times;
        if self.accesses == at {
            self.events(events);
            self.times.at = at.saturating_add(self.times.every);
        } else if pace > 0 && self.accesses % pace == 0 {
            self.events(1);
        }
        self.accesses += 1;
    }
}

struct Bench {
    background: Box<dyn Background>,
    interrupt: Rc<RefCell<Interrupt>>,
}

/// When the interrupt comes: before which accesses of the background and how many times, and how often beside that.
#[derive(Debug, Clone, Copy)]
struct Times {
    at: u32,
    every: u32,
    events: u32,
    /// One event in so many accesses; 0 for none.
    pace: u32,
}

impl Times {
    const fn once(at: u32, events: u32, pace: u32) -> Self {
        Self { at, every: u32::MAX, events, pace }
    }
}

impl Bench {
    fn new((background, fire): Halves, times: Times) -> Self {
        let (position, last) = ([0; N], [None; N]);
        let new = Interrupt { fire, running: false, now: 0, position, steps: 0, last, reverse: 0, accesses: 0, times };
        Self { background, interrupt: Rc::new(RefCell::new(new)) }
    }

    /// The background does something, in which the interrupt may come.
    fn does<T>(&mut self, what: impl FnOnce(&mut dyn Background) -> T) -> T {
        let own = Rc::clone(&self.interrupt);
        interrupt(Some(Box::new(move || own.borrow_mut().access())));
        let result = what(&mut *self.background);
        interrupt(None);
        assert_eq!(self.background.made(), self.interrupt.borrow().position);
        result
    }

    fn slice(&mut self) -> Work {
        let work = self.does(|background| background.poll());
        assert_ne!(work, Work::TooFewSlots);
        self.interrupt.borrow_mut().running |= work == Work::Start;
        work
    }

    fn happen(&mut self, event: Event) {
        match event {
            Event::Slices(most) => {
                for _ in 0..most {
                    self.slice();
                }
            }
            Event::Steps(more) => {
                let until = self.interrupt.borrow().steps + more;
                self.until(5000, |bench, work| work == Work::Rest || bench.interrupt.borrow().steps >= until);
            }
            Event::Starve => self.interrupt.borrow_mut().events(u32::MAX),
            Event::Rest => _ = self.rests(5000),
            request => self.does(|background| background.ask(request)),
        }
    }

    /// The background, one event at a time when it has nothing to do. Returns whether it has come so far.
    fn until(&mut self, most: u32, over: impl Fn(&Self, Work) -> bool) -> bool {
        let mut starts = 0;
        for _ in 0..most {
            let work = self.slice();
            if over(self, work) {
                return true;
            }
            // The first event is a while ahead when the timer has been started.
            starts = if work == Work::Start { starts + 1 } else { 0 };
            if work == Work::Later || starts > 2 {
                self.interrupt.borrow_mut().events(1);
            }
        }
        false
    }

    fn rests(&mut self, most: u32) -> bool {
        self.until(most, |bench, work| work == Work::Rest && bench.background.is_at_rest())
    }
}

/// All that happens, and a place to go to afterwards, with a background that is in time. Returns how often the background has read or
/// written what is shared before that.
fn run(halves: Halves, events: &[Event], times: Times) -> u32 {
    let mut bench = Bench::new(halves, times);
    for event in events {
        bench.happen(*event);
    }
    let accesses = bench.interrupt.borrow().accesses;
    bench.interrupt.borrow_mut().times = Times::once(u32::MAX, 0, 0);
    for event in [Event::Override(100), Event::Resume] {
        bench.happen(event);
    }
    assert!(bench.rests(200_000), "it stands still at {:?}: {times:?} {events:?}", bench.background.made());
    bench.happen(Event::To([-7, 5]));
    assert!(bench.rests(200_000), "it stands still at {:?}: {times:?} {events:?}", bench.background.made());
    let own = bench.interrupt.borrow();
    assert!(own.position == [-7, 5] || own.position == [-7, 0], "{:?}: {times:?} {events:?}", own.position);
    accesses
}

fn axis(reach: u32) -> Halves {
    let queue: &'static Queue<SLOTS> = Box::leak(Box::default());
    let limits = Limits::new(20_000, 2_000_000).unwrap();
    let (axis, mut timer) = Axis::new(queue, Clock::MICROSECONDS, limits).unwrap();
    let fire = move || {
        let fired = timer.fire();
        (fired.is_step().into(), fired.direction().dir().into(), fired.wait())
    };
    (Box::new(axis.with_reach(reach)), Box::new(fire))
}

fn axes(reach: u32) -> Halves {
    let queue: &'static AxesQueue<N, SLOTS> = Box::leak(Box::default());
    let axis = AxisSetup::new(Limits::new(20_000, 2_000_000).unwrap(), 80_000);
    let path = Path::new(Clock::MICROSECONDS, [axis; N], 20).unwrap();
    let (axes, mut timer) = Axes::new(queue, path);
    let fire = move || {
        let fired = timer.fire();
        (fired.steps(), fired.reverse(), fired.wait())
    };
    (Box::new(axes.with_reach(reach)), Box::new(fire))
}

use Event::{Away, Halt, Hold, Override, Quick, Rest, Resume, Slices, Starve, Steps, Stop, To};

/// At least five rests each.
const SCRIPTS: [&[Event]; 4] = [
    &[To([9, 4]), Rest, To([0, 9]), Rest, To([12, 9]), Rest, To([12, 0]), Rest, To([3, 3]), Rest, To([4, 3]), Rest],
    &[
        To([60, 30]),
        Steps(20),
        Hold,
        Rest,
        Resume,
        Steps(10),
        Hold,
        Resume,
        Rest,
        Hold,
        To([0, 0]),
        Rest,
        Resume,
        Steps(4),
        Stop,
        Rest,
    ],
    &[
        To([50, 9]),
        Slices(9),
        Starve,
        Slices(40),
        Starve,
        Slices(70),
        Starve,
        Rest,
        To([0, 0]),
        Slices(33),
        Starve,
        Override(30),
        Steps(3),
        Starve,
        Rest,
    ],
    &[
        To([50, 20]),
        Steps(15),
        Halt,
        Rest,
        To([90, 0]),
        Steps(5),
        Override(0),
        Rest,
        Override(100),
        Steps(9),
        Halt,
        Rest,
        To([0, 1]),
        Rest,
    ],
];

/// How many cases, and all in place of some in the nightly run.
fn cases() -> Option<u32> {
    std::env::var("MOTION_CASES").ok()?.parse().ok()
}

/// Before any access, so many events.
fn everywhere(halves: fn(u32) -> Halves) {
    let apart = if cases().is_some() { 1 } else { 19 };
    let mut runs = 0;
    for (script, pace) in SCRIPTS.iter().flat_map(|script| [(script, 0), (script, 97)]) {
        let all = run(halves(400), script, Times::once(u32::MAX, 0, pace));
        for (begin, events) in [(0, 1), (7, 2), (23, 5), (41, u32::MAX)] {
            for at in (begin % apart..all).step_by(apart as usize) {
                run(halves(400), script, Times::once(at, events, pace));
                runs += 1;
            }
        }
    }
    std::println!("{runs} runs");
}

#[test]
#[cfg_attr(miri, ignore = "too long for an interpreter")]
fn an_axis_can_always_be_started_again() {
    everywhere(axis);
}

#[test]
#[cfg_attr(miri, ignore = "too long for an interpreter")]
fn axes_can_always_be_started_again() {
    everywhere(axes);
}

fn event() -> impl Strategy<Value = Event> {
    let place = || prop_oneof![[-40..40_i64, -40..40_i64], [-2..2_i64, -2..2_i64]];
    prop_oneof![
        6 => place().prop_map(To),
        2 => place().prop_map(Away),
        4 => Just(Rest),
        3 => (0..60_u64).prop_map(Steps),
        3 => (0..200_u32).prop_map(Slices),
        3 => Just(Starve),
        2 => Just(Hold),
        2 => Just(Resume),
        2 => (0..130_u16).prop_map(Override),
        1 => Just(Stop),
        1 => Just(Quick),
        1 => Just(Halt),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases().unwrap_or(150), ..ProptestConfig::default() })]

    /// Blocks without a step too.
    #[test]
    #[cfg_attr(miri, ignore = "too long for an interpreter")]
    fn whatever_is_asked_it_can_be_started_again(
        script in prop::collection::vec(event(), 1..24), reach in prop_oneof![Just(20_u32), 20..60_u32, Just(400)], one in any::<bool>(),
        at in 0..3000_u32, every in prop_oneof![1..40_u32, 1..2000_u32], events in prop_oneof![1..8_u32, Just(u32::MAX)],
        pace in prop_oneof![Just(0_u32), 2..300_u32],
    ) {
        let halves = if one { axis(reach) } else { axes(reach) };
        run(halves, &script, Times { at, every, events, pace });
    }
}
