//! A path in two halves: every step at its tick, all axes on the line whatever the background does, no step after a halt.

use proptest::prelude::*;
use step_motion::{Axes, AxesQueue, AxesTimer, AxisSetup, Clock, Limits, Path, PathMover, Work};

use crate::laws::limits;
use crate::machine;

const N: usize = 3;
const LINES: usize = 8;
const SLOTS: usize = 257;

type Background = Axes<'static, N, LINES, SLOTS>;

fn queue() -> &'static AxesQueue<N, SLOTS> {
    Box::leak(Box::default())
}

type Machine = machine::Machine<AxesTimer<'static, N, SLOTS>, N>;

fn run(axes: &mut Background, machine: &mut Machine, every: u64, until: u64) -> Work {
    let work = machine.run(axes, every, until);
    assert_ne!(work, Work::TooFewSlots);
    work
}

fn path(hz: u32, axes: [AxisSetup; N], deviation: u32) -> Path<N, LINES> {
    Path::new(Clock::new(hz).unwrap(), axes, deviation).unwrap()
}

fn place() -> impl Strategy<Value = [i64; N]> {
    prop_oneof![
        3 => [-900..=900_i64, -900..=900_i64, -300..=300_i64],
        1 => [-6..6_i64, -6..6_i64, -2..2_i64],
        1 => (-900..900_i64).prop_map(|x| [x, 0, 0]),
    ]
}

fn spread(low: f64, high: f64) -> impl Strategy<Value = u64> {
    (low.ln()..high.ln()).prop_map(|x| x.exp() as u64)
}

fn clocks() -> impl Strategy<Value = u32> {
    prop_oneof![Just(25_000_u32), Just(1_000_000), Just(72_000_000), Just(200_000_000)]
}

fn setup() -> impl Strategy<Value = (u64, u64, u64, u64)> {
    (spread(200.0, 3e4), spread(1e4, 1e7), prop_oneof![Just(0), spread(1e6, 1e10)], spread(1e4, 2e5))
}

fn axes(hz: u32, from: [(u64, u64, u64, u64); N]) -> [AxisSetup; N] {
    from.map(|(v, a, j, scale)| AxisSetup::new(limits((v as u32).min(hz / 4), a as u32, j), scale as u32))
}

fn cases() -> u32 {
    std::env::var("MOTION_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(200)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    /// Beside the path that is taken step by step, whose steps are in the tick nearest to the exact time.
    #[test]
    fn every_step_is_at_its_tick(
        hz in clocks(), from in [setup(), setup(), setup()], deviation in prop_oneof![Just(0), 1..2000_u32],
        lines in prop::collection::vec((place(), spread(1e3, 3e5)), 1..LINES),
    ) {
        let axes = axes(hz, from);
        let mut exact = PathMover::new(path(hz, axes, deviation));
        let (mut background, timer) = Axes::new(queue(), path(hz, axes, deviation));
        let mut machine = Machine::new(timer);
        for (to, feed) in &lines {
            background.push(*to, *feed as u32).unwrap();
            exact.push(*to, *feed as u32, 0).unwrap();
        }
        run(&mut background, &mut machine, u64::from(hz) / 400 + 1, u64::MAX);
        let target = lines.last().unwrap().0;
        prop_assert_eq!((machine.position, background.commanded()), (target, target));
        let mut want: [Vec<u64>; N] = Default::default();
        while let Some(pulse) = exact.pulse() {
            want[usize::from(pulse.axis)].push(pulse.tick);
        }
        // 3/4 of a tick, or 25 ns, and the half that is rounded there.
        let most = 1.max((25e-9 * f64::from(hz) + 0.5) as u64);
        let (mut late, all) = (0, machine.steps.len());
        let mut at = [0; N];
        for (tick, axis, _) in &machine.steps {
            let off = tick.abs_diff(want[*axis][at[*axis]]);
            prop_assert!(off <= most + 2, "step {} of axis {axis} at {tick}, off by {off}", at[*axis]);
            late += u32::from(off > most);
            at[*axis] += 1;
        }
        prop_assert!(f64::from(late) <= 2.0 + all as f64 * 0.02, "{late} of {all} steps are late");
    }
}

/// A request to the axes of a path.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Request<const N: usize> {
    Push([i64; N], u32),
    MoveTo([i64; N], u32),
    Override(u16),
    Hold,
    Resume,
    Stop,
    Quick(u32),
    Halt,
}

fn request() -> impl Strategy<Value = Request<N>> {
    let feed = || spread(100.0, 3e5).prop_map(|feed| feed as u32);
    prop_oneof![
        1 => (-2000..2000_i64, feed()).prop_map(|(x, feed)| Request::Push([0, x, 0], feed)),
        7 => (place(), feed()).prop_map(|(to, feed)| Request::Push(to, feed)),
        2 => (place(), feed()).prop_map(|(to, feed)| Request::MoveTo(to, feed)),
        3 => (0..200_u16).prop_map(Request::Override),
        2 => Just(Request::Hold),
        3 => Just(Request::Resume),
        1 => Just(Request::Stop),
        1 => (1000..10_000_000_u32).prop_map(Request::Quick),
        1 => Just(Request::Halt),
    ]
}

fn ask(axes: &mut Background, request: Request<N>) {
    match request {
        Request::Push(to, feed) => _ = axes.push(to, feed),
        Request::MoveTo(to, feed) => _ = axes.move_to(to, feed),
        Request::Override(percent) => axes.set_override(percent),
        Request::Hold => axes.hold(),
        Request::Resume => axes.resume(),
        Request::Stop => axes.stop(),
        Request::Quick(acceleration) => axes.quick_stop([Limits::new(1, acceleration).unwrap(); N]),
        Request::Halt => axes.halt(),
    }
}

/// From the last place of a line to the nearest one of it.
fn away(at: [f64; N], from: [f64; N], to: [f64; N]) -> f64 {
    let dot = |a: [f64; N], b: [f64; N]| (0..N).map(|i| a[i] * b[i]).sum::<f64>();
    let minus = |a: [f64; N], b: [f64; N]| -> [f64; N] { core::array::from_fn(|i| a[i] - b[i]) };
    let (way, here) = (minus(to, from), minus(at, from));
    let part = (dot(way, here) / dot(way, way).max(1e-9)).clamp(0.0, 1.0);
    let off = minus(here, way.map(|x| x * part));
    off.into_iter().fold(0.0, |most, x| f64::max(most, x.abs()))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: cases(), ..ProptestConfig::default() })]

    /// In time, late, or not at all for a while: what is out ends in a stop, no axis is faster than its limit, and it goes on.
    #[test]
    fn requests_and_a_background_that_stalls(
        hz in clocks(), from in [setup(), setup(), setup()], deviation in prop_oneof![Just(0), 1..2000_u32],
        requests in prop::collection::vec((request(), 0..300_000_u64, 0..400_u32), 1..16), target in place(),
        pauses in prop_oneof![Just([0; N]), [0..20_000_u32, 0..300_u32, 0..1_u32]],
    ) {
        let mut pauses = pauses.into_iter().map(|us| (u64::from(us) * u64::from(hz) / 1_000_000) as u32);
        let setups = axes(hz, from)
            .map(|axis| axis.with_soft_limits(-900, 900).with_reversal_pause(pauses.next().unwrap()));
        // In a quick stop a corner may be within less than half a step.
        let hurried = requests.iter().any(|(request, ..)| matches!(request, Request::Quick(_)));
        let (mut axes, timer) = Axes::new(queue(), path(hz, setups, deviation));
        let mut machine = Machine::new(timer);
        let reach = u64::from(hz / 200);
        for (request, wait_us, polls) in requests {
            let halted = matches!(request, Request::Halt).then_some(machine.position);
            ask(&mut axes, request);
            // A background that is cut off after some slices.
            for _ in 0..polls {
                prop_assert_ne!(machine.slice(&mut axes), Work::TooFewSlots);
            }
            let until = machine.now + wait_us * u64::from(hz) / 1_000_000;
            if wait_us % 3 == 0 {
                machine.until(until);
            } else {
                run(&mut axes, &mut machine, reach / 2, until);
            }
            if let Some(position) = halted {
                prop_assert_eq!(machine.position, position, "a step after a halt");
            }
            prop_assert_eq!(axes.commanded(), machine.position);
            prop_assert!(machine.position.iter().all(|at| at.abs() <= 900), "{:?}", machine.position);
        }
        axes.stop();
        machine.drain();
        let until = machine.now + 60 * u64::from(hz);
        run(&mut axes, &mut machine, reach / 2, until);
        prop_assert!(axes.is_at_rest());
        prop_assert_eq!(axes.target(), machine.position);
        axes.set_override(100);
        axes.resume();
        axes.push(target, 300_000).unwrap();
        prop_assert_eq!(run(&mut axes, &mut machine, reach / 2, u64::MAX), Work::Rest);
        prop_assert_eq!((machine.position, axes.commanded()), (target, target));
        let mut last = [None; N];
        for (tick, axis, by) in machine.steps {
            if let Some((before, way)) = last[axis].replace((tick, by)) {
                let pause = u64::from(setups[axis].reversal_pause);
                prop_assert!(by == way || hurried || tick - before + 3 >= pause, "{} of {pause} ticks", tick - before);
                let least = u64::from(hz) / u64::from(setups[axis].limits.speed());
                prop_assert!(tick - before + 3 + least / 8 >= least, "axis {axis}: {} of {least} ticks", tick - before);
            }
        }
    }

    /// Lines, holds and overrides, and a background that is not there now and then: every place is on a line, in their order.
    #[test]
    fn it_stays_on_its_lines_whatever_the_background_does(
        hz in clocks(), from in [setup(), setup(), setup()], deviation in prop_oneof![Just(0), 1..2000_u32],
        lines in prop::collection::vec((place(), spread(1e3, 3e5)), 2..20),
        what in prop::collection::vec((0..100_000_u64, 0..250_u32, 0..5_u8), 1..30),
    ) {
        let setups = axes(hz, from);
        let (mut axes, timer) = Axes::new(queue(), path(hz, setups, deviation));
        let mut machine = Machine::new(timer);
        let mut waiting = lines.iter();
        let mut next = waiting.next();
        let mut push = |axes: &mut Background| {
            while let Some((to, feed)) = next {
                if axes.push(*to, *feed as u32).is_err() {
                    return false;
                }
                next = waiting.next();
            }
            true
        };
        for (wait_us, polls, request) in what {
            push(&mut axes);
            match request {
                0 => axes.hold(),
                1 | 2 => axes.resume(),
                3 => axes.set_override(polls as u16),
                _ => {}
            }
            for _ in 0..polls {
                prop_assert_ne!(machine.slice(&mut axes), Work::TooFewSlots);
            }
            machine.until(machine.now + wait_us * u64::from(hz) / 1_000_000);
        }
        axes.set_override(100);
        axes.resume();
        let mut rounds = 0;
        while !push(&mut axes) || !axes.is_at_rest() {
            let until = machine.now + u64::from(hz / 100);
            run(&mut axes, &mut machine, u64::from(hz / 400), until);
            rounds += 1;
            prop_assert!(rounds < 1_000_000, "it does not end");
        }
        prop_assert_eq!(machine.position, lines.last().unwrap().0);
        let float = |at: [i64; N]| at.map(|x| x as f64);
        let (mut at, mut line, mut begin) = ([0; N], 0, [0; N]);
        for (tick, axis, by) in machine.steps {
            at[axis] += by;
            // A step of each axis may have a tick more or less; on to the next line where that is nearer.
            let (middle, to) = (float(at), |line: usize| float(lines[line].0));
            while away(middle, float(begin), to(line)) > 1.1 && line + 1 < lines.len() {
                (begin, line) = (lines[line].0, line + 1);
            }
            let off = away(middle, float(begin), to(line));
            prop_assert!(off <= 1.1, "{at:?} at {tick} is {off} steps off the line to {:?}", lines[line].0);
        }
    }
}

/// Three axes of 20,000 steps/s and 2,000,000 steps/s² at 1 MHz, with a reach of 5 ms.
fn quick_axes() -> (Background, Machine) {
    let setup = AxisSetup::new(limits(20_000, 2_000_000, 0), 80_000);
    let (axes, timer) = Axes::new(queue(), path(1_000_000, [setup; N], 20));
    (axes.with_reach(5000), Machine::new(timer))
}

/// With a background that is called as seldom as it may be, and at any instant.
#[test]
fn a_hold_and_an_override_act_within_twice_the_reach() {
    for at in 0..160 {
        let (mut axes, mut machine) = quick_axes();
        axes.push([9000, 0, 0], 250_000).unwrap();
        run(&mut axes, &mut machine, 2500, 100_000 + at * 619);
        let before = machine.position[0];
        // A tenth of 20,000 steps/s, in 10 ms and 9 ms of brake.
        axes.set_override(10);
        run(&mut axes, &mut machine, 2500, 130_000 + at * 619);
        assert!(machine.position[0] - before <= 200 + 99 + 24, "{at}: {}", machine.position[0] - before);
        axes.set_override(100);
        run(&mut axes, &mut machine, 2500, 180_000 + at * 619);
        axes.hold();
        let made = machine.position[0];
        run(&mut axes, &mut machine, 2500, u64::MAX);
        // 10 ms, and the 100 steps from 20,000 steps/s to rest.
        assert!((100..=302).contains(&(machine.position[0] - made)), "{at}: {}", machine.position[0] - made);
    }
}

/// A line that comes after any slice of the background, and a background that is not there afterwards: it is not lost.
#[test]
fn a_line_is_not_lost_whenever_it_comes() {
    let mut stops = 0;
    // Alone, and with the background until it waits for the interrupt.
    for (slices, more) in (0..300).flat_map(|slices| [(slices, false), (slices, true)]) {
        let (mut axes, mut machine) = quick_axes();
        axes.push([300, 40, 0], 250_000).unwrap();
        for _ in 0..slices {
            if machine.slice(&mut axes) == Work::Later {
                machine.until(machine.now + 1000);
            }
        }
        axes.push([600, 0, 30], 250_000).unwrap();
        while more && machine.slice(&mut axes) == Work::More {}
        machine.drain();
        stops += u32::from(machine.position != [300, 40, 0] && machine.position != [0; N]);
        run(&mut axes, &mut machine, 1000, u64::MAX);
        assert_eq!((machine.position, axes.commanded()), ([600, 0, 30], [600, 0, 30]), "{slices}");
    }
    assert!(stops > 50, "{stops}");
}

/// Whether two lines are refused with `S` slots an axis and a reach. Refused or not, every step that the background knows of has been
/// made.
fn refused_with_slots<const S: usize>(reach: u32, exact: bool) -> bool {
    let queue: &'static AxesQueue<N, S> = Box::leak(Box::default());
    let setup = AxisSetup::new(limits(20_000, 200_000, 4_000_000), 80_000);
    let (axes, timer) = Axes::new(queue, path(1_000_000, [setup; N], 20));
    let mut axes = if exact { axes.with_exact_stops() } else { axes }.with_reach(reach);
    let mut machine = machine::Machine::<_, N>::new(timer);
    axes.push([3000, 211, 7], 250_000).unwrap();
    axes.push([3000, 900, 7], 250_000).unwrap();
    let mut refused = false;
    for slices in 0.. {
        assert!(slices < 100_000, "it does not end");
        match machine.slice(&mut axes) {
            Work::More | Work::Start => {}
            Work::Later => machine.until(machine.compare.unwrap()),
            Work::TooFewSlots => refused = true,
            Work::Rest => break,
        }
    }
    assert_eq!(axes.commanded(), machine.position, "{S} slots");
    assert!(refused || machine.position == [3000, 900, 7], "{S} slots: {:?}", machine.position);
    refused
}

#[test]
fn few_slots_cost_exactness_and_never_a_step() {
    // Halved until it is less than a 16th, 500 ticks or 4: 4 becomes 2, 20 becomes 5 and 2.
    assert!(refused_with_slots::<9>(4, false) && refused_with_slots::<9>(20, false));
    // 6000 becomes 375 and 187, 10,000 becomes 625 and 312.
    for reach in [6000, 10_000] {
        assert!(refused_with_slots::<9>(reach, false));
        assert!(refused_with_slots::<17>(reach, false));
        // Either is right between them.
        let _ = [refused_with_slots::<61>(reach, false), refused_with_slots::<129>(reach, false)];
        assert!(!refused_with_slots::<257>(reach, false));
        // Where an exact stop does not fit, a coarser one does.
        assert!(!refused_with_slots::<81>(reach, true));
    }
    // A second is more than the slots hold: a shorter block is made.
    assert!(!refused_with_slots::<129>(1_000_000, false));
}

/// Two lines one way or the other that do not fit into `S` slots, and a slow one after what was made of them: how often each was
/// refused, and whether that was in motion.
fn given_up<const S: usize>(way: i64) -> [Vec<bool>; 2] {
    let queue: &'static AxesQueue<N, S> = Box::leak(Box::default());
    let setup = AxisSetup::new(limits(20_000, 200_000, 4_000_000), 80_000);
    let (axes, timer) = Axes::new(queue, path(1_000_000, [setup; N], 20));
    let (mut axes, mut machine) = (axes.with_reach(6000), machine::Machine::<_, N>::new(timer));
    axes.push([way * 3000, way * 211, way * 7], 250_000).unwrap();
    axes.push([way * 3000, way * 900, way * 7], 250_000).unwrap();
    [(); 2].map(|()| {
        let mut refused = Vec::new();
        loop {
            match machine.slice(&mut axes) {
                Work::More | Work::Start => {}
                Work::Later => machine.until(machine.compare.unwrap()),
                Work::TooFewSlots => refused.push(machine.compare.is_some()),
                Work::Rest => break,
            }
        }
        let [x, y, z] = machine.position;
        assert_eq!((axes.target(), axes.is_at_rest(), axes.is_halted()), ([x, y, z], true, false));
        axes.push([x + way * 3, y, z], 1000).unwrap();
        refused
    })
}

/// A path that is given up, at rest or in motion, is not the end: what fits is run afterwards.
#[test]
fn what_does_not_fit_is_given_up_and_no_more() {
    // The way back takes a slot for DIR.
    let [first, second] = given_up::<9>(-1);
    assert!(first == [false] && !second.is_empty(), "{first:?} {second:?}");
    assert_eq!([given_up::<33>(1), given_up::<37>(1)], [[vec![true], vec![]], [vec![true], vec![]]]);
}

/// A step in 100 ticks at constant speed, and blocks that end at any of these ticks: no step waits for the end of a block.
#[test]
fn the_end_of_a_block_moves_no_step() {
    let setup = AxisSetup::new(limits(10_000, 1_000_000, 0), 80_000);
    let queue: &'static AxesQueue<1, SLOTS> = Box::leak(Box::default());
    let path = Path::<1, LINES>::new(Clock::new(1_000_000).unwrap(), [setup], 20).unwrap();
    let (axes, timer) = Axes::new(queue, path);
    let (mut axes, mut machine) = (axes.with_reach(1001), machine::Machine::<_, 1>::new(timer));
    axes.push([3000], 125_000).unwrap();
    machine.run(&mut axes, 300, u64::MAX);
    assert_eq!(machine.position, [3000]);
    // 50 steps of ramp at either end.
    for pair in machine.steps[60..2940].windows(2) {
        assert_eq!(pair[1].0 - pair[0].0, 100, "{pair:?}");
    }
}
