//! What is asked for counts after the stop of each block too, where the machine comes to rest if its background is late.

use step_motion::{Axes, AxesQueue, AxesTimer, AxisSetup, Clock, Error, Limits, Path, Work};

use crate::axes_requests::Bench;
use crate::machine::Machine;

/// A request, and no background until the machine has come to rest.
fn late(ask: impl FnOnce(&mut Bench)) -> Bench {
    let mut bench = Bench::running();
    ask(&mut bench);
    bench.until(700_000, false);
    assert!(bench.machine.compare.is_none() && bench.x() < 3000);
    bench
}

#[test]
fn a_new_target_counts_behind_a_stop() {
    let mut bench = late(|bench| bench.axes.move_to([0, 100], 100_000).unwrap());
    bench.until(4_000_000, true);
    assert_eq!((bench.axes.commanded(), bench.axes.target()), ([0, 100], [0, 100]));
}

/// Also one that is asked for in the stop after the last block, which stays as it is.
#[test]
fn the_target_is_where_a_stop_ends() {
    let quick = |bench: &mut Bench| bench.axes.quick_stop([Limits::new(8000, 2_000_000).unwrap(); 2]);
    let asks: [fn(&mut Bench); 3] = [|bench| bench.axes.stop(), quick, |bench| bench.axes.hold()];
    for (ask, after) in asks.into_iter().flat_map(|ask| (0..160_000).step_by(1111).map(move |after| (ask, after))) {
        let mut bench = Bench::running();
        bench.until(300_000 + after, false);
        ask(&mut bench);
        let target = bench.axes.target();
        bench.until(3_000_000, true);
        assert!(bench.axes.is_at_rest() && bench.machine.compare.is_none());
        let want = if target == [8000, 0] { target } else { bench.axes.commanded() };
        assert_eq!((bench.axes.target(), target), (want, want), "{after}");
    }
}

#[test]
fn a_path_is_forgotten_behind_a_stop() {
    let quick = |bench: &mut Bench| bench.axes.quick_stop([Limits::new(8000, 80_000).unwrap(); 2]);
    let asks: [fn(&mut Bench); 2] = [|bench| bench.axes.stop(), quick];
    for ask in asks {
        let mut bench = late(ask);
        let rest = bench.axes.commanded();
        bench.until(3_000_000, true);
        assert_eq!((bench.axes.commanded(), bench.axes.target()), (rest, rest));
        bench.axes.push([0, 0], 100_000).unwrap();
        bench.until(6_000_000, true);
        assert_eq!(bench.axes.commanded(), [0, 0]);
    }
}

#[test]
fn a_hold_and_an_override_count_behind_a_stop() {
    type Ask = fn(&mut Bench);
    let pairs: [(Ask, Ask); 2] = [
        (|bench| bench.axes.hold(), |bench| bench.axes.resume()),
        (|bench| bench.axes.set_override(0), |bench| bench.axes.set_override(100)),
    ];
    for (rests, goes_on) in pairs {
        let mut bench = late(rests);
        let rest = bench.x();
        bench.until(1_500_000, true);
        assert_eq!((bench.x(), bench.axes.target()), (rest, [8000, 0]));
        goes_on(&mut bench);
        bench.until(4_000_000, true);
        assert_eq!(bench.axes.commanded(), [8000, 0]);
    }
}

/// After any slice of the work for the brake, the background being in time.
#[test]
fn a_resume_ends_a_hold_that_is_under_way() {
    for slices in 0..120 {
        let mut bench = Bench::running();
        bench.axes.hold();
        for _ in 0..slices {
            if bench.machine.slice(&mut bench.axes) == Work::Later {
                bench.machine.until(bench.machine.now + 100);
            }
        }
        bench.axes.resume();
        bench.until(3_000_000, true);
        assert_eq!(bench.axes.commanded(), [8000, 0], "{slices}");
    }
}

/// Two places in the queue: a line is taken when neither the path nor a stop has both of them, and none is lost.
#[test]
fn a_full_queue_loses_no_line() {
    let (mut refused, mut taken) = (0, 0);
    for slices in 0..250 {
        let axis = AxisSetup::new(Limits::new(20_000, 2_000_000).unwrap(), 80_000);
        let path = Path::<1, 2>::new(Clock::MICROSECONDS, [axis], 20).unwrap();
        let queue: &'static AxesQueue<1, 257> = Box::leak(Box::default());
        let (axes, timer) = Axes::new(queue, path);
        let (mut axes, mut machine) = (axes.with_reach(2500), Machine::<_, 1>::new(timer));
        for to in [60, 160] {
            axes.push([to], 250_000).unwrap();
        }
        for _ in 0..slices {
            if machine.slice(&mut axes) == Work::Later {
                machine.until(machine.now + 250);
            }
        }
        let full = axes.is_full();
        let pushed = axes.push([300], 250_000);
        assert_eq!(pushed, if full { Err(Error::QueueFull) } else { Ok(()) }, "{slices}");
        *(if full { &mut refused } else { &mut taken }) += 1;
        machine.drain();
        machine.run(&mut axes, 500, u64::MAX);
        assert_eq!(machine.position, [if full { 160 } else { 300 }], "{slices}");
    }
    assert!(refused > 20 && taken > 20, "{refused} {taken}");
}

/// Four lines of 650 steps in a queue for four. A block has 200 steps, and 20 of brake after it: the fourth one passes the end of a
/// line, which the stop after the third one does not.
fn four_lines() -> (Axes<'static, 1, 4, 257>, Machine<AxesTimer<'static, 1, 257>, 1>) {
    let axis = AxisSetup::new(Limits::new(20_000, 10_000_000).unwrap(), 80_000);
    let path = Path::new(Clock::MICROSECONDS, [axis], 20).unwrap();
    let queue: &'static AxesQueue<1, 257> = Box::leak(Box::default());
    let (mut axes, timer) = Axes::new(queue, path);
    for n in 1..=4 {
        axes.push([650 * n], 250_000).unwrap();
    }
    (axes, Machine::new(timer))
}

#[test]
fn a_stop_counts_until_the_interrupt_is_past_it() {
    let (mut axes, mut machine) = four_lines();
    let mut slices = 0;
    while axes.is_full() {
        assert_eq!(axes.push([2700], 250_000), Err(Error::QueueFull));
        match machine.slice(&mut axes) {
            Work::Later => {
                slices = 0;
                machine.until(machine.compare.unwrap());
            }
            _ => slices += 1,
        }
    }
    assert!((575..600).contains(&machine.position[0]), "{:?}", machine.position);
    assert_eq!(slices, 1);
}

#[test]
fn a_halt_makes_room() {
    let (mut axes, mut machine) = four_lines();
    machine.run(&mut axes, 2000, 25_000);
    assert!(axes.is_full());
    axes.halt();
    machine.run(&mut axes, 2000, 30_000);
    assert!(!axes.is_full() && axes.is_halted());
}

/// In one block, and in several.
#[test]
fn at_rest_is_when_nothing_is_left_to_do() {
    for to in [1, 40] {
        let mut bench = Bench::new();
        assert!(bench.axes.is_at_rest());
        bench.axes.push([to, 0], 100_000).unwrap();
        assert!(!bench.axes.is_at_rest(), "a line waits");
        while bench.axes.poll() == Work::More {}
        assert!(!bench.axes.is_at_rest(), "the interrupt has not begun");
        bench.machine.fire();
        while let Some(next) = bench.machine.compare {
            while bench.axes.poll() == Work::More {}
            assert!(!bench.axes.is_at_rest(), "{:?} at {}", bench.axes.commanded(), bench.machine.now);
            bench.machine.until(next);
        }
        while bench.axes.poll() == Work::More {}
        assert!(bench.axes.is_at_rest() && bench.x() == to);
        bench.axes.halt();
        assert!(!bench.axes.is_at_rest(), "the interrupt has not seen the halt");
    }
}

/// 100 steps/s: most blocks have no step, and between steps the motor moves all the same.
#[test]
fn a_halt_between_two_steps_is_one_in_motion() {
    for wait in 0..40 {
        let mut bench = Bench::new();
        bench.axes = bench.axes.with_reach(1000);
        bench.axes.push([100, 0], 1250).unwrap();
        bench.until(100_000 + wait * 613, true);
        bench.axes.halt();
        bench.until(bench.machine.now + 1000, true);
        assert!(bench.axes.is_halted() && bench.axes.is_at_rest(), "{wait}");
    }
}

/// What is let in, and has not begun when a halt comes, does not begin afterwards.
#[test]
fn a_halt_ends_what_has_not_begun() {
    let mut bench = Bench::new();
    bench.axes.push([40, 0], 100_000).unwrap();
    while bench.axes.poll() == Work::More {}
    bench.axes.halt();
    bench.machine.fire();
    while bench.axes.poll() == Work::More {}
    bench.machine.fire();
    bench.machine.drain();
    assert_eq!((bench.machine.position, bench.axes.commanded()), ([0, 0], [0, 0]));
    assert!(bench.axes.is_at_rest());
}

/// As many halts as a ticket has bits for, and some more: each of them is confirmed.
#[test]
fn no_halt_goes_unseen() {
    let mut bench = Bench::new();
    for halts in 0..33_000 {
        bench.axes.halt();
        assert_eq!(bench.machine.slice(&mut bench.axes), Work::More, "{halts}");
        assert_eq!(bench.machine.slice(&mut bench.axes), Work::More, "{halts}");
        assert!(bench.axes.is_at_rest() && bench.machine.compare.is_none(), "{halts}");
    }
    bench.axes.push([5, 3], 100_000).unwrap();
    bench.until(1_000_000, true);
    assert_eq!(bench.axes.commanded(), [5, 3]);
}

#[test]
fn the_shortest_reach_is_four_ticks() {
    for reach in [0, 4] {
        let mut bench = Bench::new();
        bench.axes = bench.axes.with_reach(reach);
        bench.axes.push([20, 10], 100_000).unwrap();
        assert_eq!(bench.machine.run(&mut bench.axes, 1, u64::MAX), Work::Rest);
        assert_eq!(bench.machine.position, [20, 10]);
    }
}

/// A step in every other tick: the end of a block cannot wait for a tick without one.
#[test]
fn a_hold_acts_in_time_where_each_tick_has_a_step() {
    let axis = AxisSetup::new(Limits::new(12_500, 10_000_000).unwrap(), 80_000);
    let path = Path::<2, 4>::new(Clock::new(25_000).unwrap(), [axis; 2], 20).unwrap();
    let queue: &'static AxesQueue<2, 513> = Box::leak(Box::default());
    let (axes, timer) = Axes::new(queue, path);
    let (mut axes, mut machine) = (axes.with_reach(250), Machine::<_, 2>::new(timer));
    axes.push([60_000, 59_000], u32::MAX).unwrap();
    machine.run(&mut axes, 100, 25_000);
    let before = machine.position[0];
    assert!(before > 12_000);
    axes.hold();
    assert_eq!(machine.run(&mut axes, 100, u64::MAX), Work::Rest);
    // Twice the reach, and 8 steps from 12,500 steps/s to rest.
    let made = machine.position[0] - before;
    assert!(made <= 250 + 8 + 16, "{made}");
}

/// Blocks are shorter where their slots do not last, and as long as before where they do: then a background is in time that is called
/// every half of the reach.
#[test]
fn the_reach_is_what_it_was_behind_lines_that_take_many_slots() {
    let axis = AxisSetup::new(Limits::new(20_000, 2_000_000).unwrap(), 80_000);
    let path = Path::<2, 16>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
    let queue: &'static AxesQueue<2, 65> = Box::leak(Box::default());
    let (mut axes, timer) = Axes::new(queue, path);
    let mut machine = Machine::<_, 2>::new(timer);
    for n in 1..=300 {
        while axes.push([2 * n, n % 2 * 2], 250_000) == Err(Error::QueueFull) {
            machine.run(&mut axes, 100, machine.now + 100);
        }
    }
    while axes.push([20_000, 0], 250_000) == Err(Error::QueueFull) {
        machine.run(&mut axes, 100, machine.now + 100);
    }
    while machine.position[0] < 3000 {
        machine.run(&mut axes, 100, machine.now + 100);
    }
    let from = machine.steps.len();
    machine.run(&mut axes, 5000, u64::MAX);
    assert_eq!(machine.position, [20_000, 0]);
    // At 20,000 steps/s, but for the brake at the end.
    for pair in machine.steps[from..][..16_000].windows(2) {
        assert_eq!(pair[1].0 - pair[0].0, 50, "{pair:?}");
    }
}

/// Two lines with `S` slots and slices of 25 us: whether they were given up. If not, they have been run after three seconds.
fn given_up<const S: usize>(reach: u32) -> bool {
    let axis = AxisSetup::new(Limits::new(20_000, 200_000).unwrap().with_jerk(4_000_000).unwrap(), 80_000);
    let path = Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20).unwrap();
    let queue: &'static AxesQueue<2, S> = Box::leak(Box::default());
    let (axes, timer) = Axes::new(queue, path);
    let (mut axes, mut machine) = (axes.with_reach(reach), Machine::<_, 2>::new(timer));
    axes.push([3000, 211], 250_000).unwrap();
    axes.push([3000, 900], 250_000).unwrap();
    let mut few = false;
    for now in (0..3_000_000).step_by(25) {
        machine.until(now);
        few |= machine.slice(&mut axes) == Work::TooFewSlots;
    }
    assert_eq!((axes.is_at_rest(), axes.commanded()), (true, axes.target()), "{S} slots, {reach}");
    assert_eq!(few, axes.commanded() != [3000, 900], "{S} slots, {reach}");
    few
}

/// Where the slots hold so little that no background would make it in time, the path is given up: it does not stand still without a word.
#[test]
fn a_queue_that_is_too_short_says_so() {
    for reach in [2000, 10_000, 50_000] {
        let short = [given_up::<9>(reach), given_up::<13>(reach), given_up::<17>(reach), given_up::<21>(reach)];
        assert_eq!((short, given_up::<129>(reach)), ([true; 4], false), "{reach}");
    }
    assert_eq!([given_up::<65>(2000), given_up::<65>(10_000)], [false; 2]);
}

/// Slots that hold no more than an eighth of the reach, and DIR that waits for a quarter of it, while a block takes longer to make than it
/// lasts: what has been waited for from a rest on is not waited for again, so the machine gets on.
#[test]
fn a_slow_background_gets_there() {
    for slice in [1000, 10_000, 20_000, 40_000, 70_000, 150_000] {
        let axes = [(9086, 6_406_634, Some(22_313_646_525), 1150), (2032, 1_165_948, None, 257)];
        let axes = [axes[0], axes[1], (26_588, 114_995_103, Some(2_456_724_608_975), 3366)].map(|(v, a, j, scale)| {
            let limits = Limits::new(v, a).unwrap();
            let limits = j.map_or(limits, |j| limits.with_jerk(j).unwrap());
            AxisSetup::new(limits, scale)
        });
        let axes = [axes[0].with_reversal_pause(3_277_490), axes[1].with_reversal_pause(3_277_490), axes[2]];
        let path = Path::<3, 16>::new(Clock::NANOSECONDS, axes, 20).unwrap();
        let queue: &'static AxesQueue<3, 65> = Box::leak(Box::default());
        let (mut axes, timer) = Axes::new(queue, path);
        let mut machine = Machine::<_, 3>::new(timer);
        axes.push([128, -12, 426], u32::MAX).unwrap();
        while !axes.is_at_rest() {
            machine.until(machine.now + slice);
            machine.slice(&mut axes);
            assert!(machine.now < 3_000_000_000, "{slice}: {:?}", axes.commanded());
        }
        assert_eq!(axes.commanded(), [128, -12, 426], "{slice}");
    }
}
