//! An interrupt that comes between any two accesses of the background to what they share, for one event or until it has none: the
//! machine can always be started again, and comes to where it is told.

use std::boxed::Box;
use std::rc::Rc;

use core::cell::RefCell;

use super::watched::interrupt;
use crate::{Axes, AxesQueue, Axis, AxisSetup, Clock, Limits, Path, Queue, Work};

const N: usize = 2;
const SLOTS: usize = 41;

/// What happens to the machine.
#[derive(Debug, Clone, Copy)]
enum Event {
    To([i64; N]),
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

impl Background for Axis<'static, SLOTS> {
    fn poll(&mut self) -> Work {
        self.poll()
    }

    fn ask(&mut self, event: Event) {
        match event {
            Event::To([to, _]) => self.move_to(to).unwrap(),
            Event::Hold => self.hold(),
            Event::Resume => self.resume(),
            Event::Stop => self.stop(),
            Event::Halt => self.halt(),
            Event::Override(percent) => self.set_override(percent),
            _ => unreachable!("{event:?}"),
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
            Event::To(to) => self.push(to, 250_000).unwrap(),
            Event::Hold => self.hold(),
            Event::Resume => self.resume(),
            Event::Stop => self.stop(),
            Event::Halt => self.halt(),
            Event::Override(percent) => self.set_override(percent),
            _ => unreachable!("{event:?}"),
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

/// The interrupt, and when it comes.
struct Interrupt {
    fire: Fire,
    running: bool,
    now: u64,
    position: [i64; N],
    steps: u64,
    last: [Option<(u64, bool)>; N],
    reverse: u16,
    /// Accesses of the background so far; that before which events come, and how many.
    accesses: u32,
    at: u32,
    events: u32,
    /// One event in so many accesses; 0 for none.
    pace: u32,
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
        if self.accesses == self.at {
            self.events(self.events);
        } else if self.pace > 0 && self.accesses % self.pace == 0 {
            self.events(1);
        }
        self.accesses += 1;
    }
}

struct Bench {
    background: Box<dyn Background>,
    interrupt: Rc<RefCell<Interrupt>>,
}

/// When the interrupt comes: before which access of the background and how many times, and how often beside that.
#[derive(Debug, Clone, Copy)]
struct Times {
    at: u32,
    events: u32,
    pace: u32,
}

impl Bench {
    fn new((background, fire): (Box<dyn Background>, Fire), Times { at, events, pace }: Times) -> Self {
        let (position, last) = ([0; N], [None; N]);
        let (running, now, steps, reverse, accesses) = (false, 0, 0, 0, 0);
        let new = Interrupt { fire, running, now, position, steps, last, reverse, accesses, at, events, pace };
        Self { background, interrupt: Rc::new(RefCell::new(new)) }
    }

    /// A slice of the background, in which the interrupt may come.
    fn slice(&mut self) -> Work {
        let own = Rc::clone(&self.interrupt);
        interrupt(Some(Box::new(move || own.borrow_mut().access())));
        let work = self.background.poll();
        interrupt(None);
        assert_ne!(work, Work::TooFewSlots);
        let mut own = self.interrupt.borrow_mut();
        own.running |= work == Work::Start;
        assert_eq!(self.background.made(), own.position);
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
                self.until(|bench, work| work == Work::Rest || bench.interrupt.borrow().steps >= until);
            }
            Event::Starve => self.interrupt.borrow_mut().events(u32::MAX),
            Event::Rest => self.until(|bench, work| work == Work::Rest && bench.background.is_at_rest()),
            request => self.background.ask(request),
        }
    }

    fn until(&mut self, over: impl Fn(&Self, Work) -> bool) {
        let mut starts = 0;
        for _ in 0..20_000 {
            let work = self.slice();
            if over(self, work) {
                return;
            }
            // The first event is a while ahead when the timer has been started.
            starts = if work == Work::Start { starts + 1 } else { 0 };
            if work == Work::Later || starts > 2 {
                self.interrupt.borrow_mut().events(3);
            }
        }
        panic!("it stands still at {:?}", self.interrupt.borrow().position);
    }
}

/// All that happens, and a place to go to afterwards. Returns how often the background has read or written what is shared.
fn run(halves: (Box<dyn Background>, Fire), events: &[Event], times: Times) -> u32 {
    let mut bench = Bench::new(halves, times);
    for event in events {
        bench.happen(*event);
    }
    for event in [Event::Override(100), Event::Resume, Event::Rest, Event::To([-7, 5]), Event::Rest] {
        bench.happen(event);
    }
    let own = bench.interrupt.borrow();
    assert!(own.position == [-7, 5] || own.position == [-7, 0], "{:?}: {times:?} {events:?}", own.position);
    own.accesses
}

fn axis() -> (Box<dyn Background>, Fire) {
    let queue: &'static Queue<SLOTS> = Box::leak(Box::default());
    let limits = Limits::new(20_000, 2_000_000).unwrap();
    let (axis, mut timer) = Axis::new(queue, Clock::MICROSECONDS, limits).unwrap();
    let fire = move || {
        let fired = timer.fire();
        (fired.is_step().into(), fired.direction().dir().into(), fired.wait())
    };
    (Box::new(axis.with_reach(400)), Box::new(fire))
}

fn axes() -> (Box<dyn Background>, Fire) {
    let queue: &'static AxesQueue<N, SLOTS> = Box::leak(Box::default());
    let axis = AxisSetup::new(Limits::new(20_000, 2_000_000).unwrap(), 80_000);
    let path = Path::new(Clock::MICROSECONDS, [axis; N], 20).unwrap();
    let (axes, mut timer) = Axes::new(queue, path);
    let fire = move || {
        let fired = timer.fire();
        (fired.steps(), fired.reverse(), fired.wait())
    };
    (Box::new(axes.with_reach(400)), Box::new(fire))
}

use Event::{Halt, Hold, Override, Rest, Resume, Slices, Starve, Steps, Stop, To};

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

/// Before any access, so many events. All of them take minutes, in the nightly run; otherwise some.
fn everywhere(halves: fn() -> (Box<dyn Background>, Fire)) {
    let apart = if std::env::var_os("MOTION_CASES").is_some() { 1 } else { 53 };
    let mut runs = 0;
    for (script, pace) in SCRIPTS.iter().flat_map(|script| [(script, 0), (script, 97)]) {
        let all = run(halves(), script, Times { at: u32::MAX, events: 0, pace });
        for (begin, events) in [(0, 1), (7, 2), (23, 5), (41, u32::MAX)] {
            for at in (begin % apart..all).step_by(apart as usize) {
                run(halves(), script, Times { at, events, pace });
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
