//! Which request is taken or refused when, and what it does to the others: one table for an axis and for a path, one by one and in two
//! halves.

mod machines;
mod sequences;

use step_motion::{Clock, Direction, Error, Limits, Mover};

use machines::{Ask, Driven, MoverMachine, PathMachine, with_axes, with_axis};

const MS: u64 = 1000;

/// The same test of all four.
fn all(test: impl Fn(&mut dyn Driven, &str)) {
    test(&mut MoverMachine::new(), "Mover");
    test(&mut PathMachine::new(), "PathMover");
    with_axis(|machine| test(machine, "Axis"));
    with_axes(|machine| test(machine, "Axes"));
}

fn under_way(machine: &mut dyn Driven) {
    machine.ask(Ask::To(100)).unwrap();
    machine.wait(20 * MS);
    assert!(!machine.is_at_rest() && machine.at() > 5);
}

/// The second one comes at rest: the motor may still have lost steps by the first one. Neither a stop nor a hold nor another position
/// makes that good, a motion is what its caller does about it.
#[test]
fn an_axis_is_halted_until_it_is_moved() {
    all(|machine, name| {
        machine.ask(Ask::Halt).unwrap();
        machine.wait(10 * MS);
        assert!(!machine.is_halted(), "{name}: at rest");
        under_way(machine);
        for ask in
            [Ask::Halt, Ask::Halt, Ask::Stop, Ask::Hold, Ask::Override(50), Ask::Quick, Ask::Halt, Ask::Standstill]
        {
            machine.ask(ask).unwrap();
            machine.wait(10 * MS);
            assert!(machine.is_halted(), "{name}: {ask:?}");
        }
        machine.ask(Ask::To(0)).unwrap();
        assert!(!machine.is_halted(), "{name}");
    });
}

/// Also if the interrupt has not seen the halt.
#[test]
fn a_hold_before_a_halt_is_over_and_one_after_it_counts() {
    for (before, moves) in [(true, true), (false, false)] {
        all(|machine, name| {
            under_way(machine);
            let asks = if before { [Ask::Hold, Ask::Halt] } else { [Ask::Halt, Ask::Hold] };
            for ask in asks {
                machine.ask(ask).unwrap();
            }
            machine.wait(30 * MS);
            let at = machine.at();
            machine.ask(Ask::To(0)).unwrap();
            machine.wait(500 * MS);
            assert_eq!(machine.at(), if moves { 0 } else { at }, "{name} {before}");
            machine.ask(Ask::Resume).unwrap();
            machine.wait(500 * MS);
            assert_eq!(machine.at(), 0, "{name} {before}");
        });
    }
}

/// Whoever asks in vain again and again does not keep the machine from its work.
#[test]
fn a_refused_request_costs_nothing() {
    all(|machine, name| {
        machine.ask(Ask::To(60)).unwrap();
        for _ in 0..10_000 {
            assert!(matches!(machine.ask(Ask::To(20_000)), Err(Error::SoftLimit { .. })), "{name}");
            machine.work(MS / 50);
        }
        assert_eq!(machine.at(), 60, "{name}");
    });
}

/// A control loop that sets the override in each cycle, from a slice of the background's work to the next.
#[test]
fn a_request_for_what_is_so_costs_nothing() {
    all(|machine, name| {
        for (percent, to) in [(100, 60), (50, 20)] {
            machine.ask(Ask::Override(percent)).unwrap();
            machine.ask(Ask::To(to)).unwrap();
            for _ in 0..10_000 {
                machine.ask(Ask::Override(percent)).unwrap();
                machine.ask(Ask::Resume).unwrap();
                machine.work(MS / 50);
            }
            assert_eq!(machine.at(), to, "{name}");
        }
    });
}

/// A loop that asks again as long as a button is pressed, from slice to slice; wherever the background is in its work.
#[test]
fn a_stop_that_is_asked_for_again_comes_as_soon() {
    for (ask, brake) in [(Ask::Hold, 10), (Ask::Override(0), 10), (Ask::Stop, 10), (Ask::Quick, 2)] {
        for later in 0..12 {
            all(|machine, name| {
                under_way(machine);
                machine.wait(later * MS);
                let at = machine.at();
                for _ in 0..5000 {
                    machine.ask(ask).unwrap();
                    machine.work(MS / 50);
                }
                let steps = machine.at() - at;
                let most = brake + if machine.has_halves() { 4 } else { 0 };
                assert!(machine.is_at_rest() && steps <= most + 1, "{name}: {steps} steps after {ask:?}, {later}");
            });
        }
    }
}

/// Also a stop that comes while the first block is in the making.
#[test]
fn a_stop_is_one_after_any_slice() {
    for slices in 0..60 {
        for ask in [Ask::Stop, Ask::Quick, Ask::Hold, Ask::Halt] {
            all(|machine, name| {
                machine.ask(Ask::To(100)).unwrap();
                for _ in 0..slices {
                    machine.work(MS / 50);
                }
                machine.ask(ask).unwrap();
                machine.wait(500 * MS);
                assert!(machine.is_at_rest() && machine.at() < 100, "{name}: {ask:?} after {slices}");
                machine.ask(Ask::To(-5)).unwrap();
                machine.ask(Ask::Resume).unwrap();
                machine.wait(500 * MS);
                assert_eq!(machine.at(), -5, "{name}: {ask:?} after {slices}");
            });
        }
    }
}

/// At rest, on hold too: what was to be reached is forgotten, and targets are counted from the new position.
#[test]
fn a_position_is_set_at_rest() {
    all(|machine, name| {
        under_way(machine);
        assert_eq!(machine.ask(Ask::Set(7)), Err(Error::Moving), "{name}");
        machine.ask(Ask::Hold).unwrap();
        machine.wait(100 * MS);
        let at = machine.at();
        machine.ask(Ask::Set(7)).unwrap();
        assert_eq!(machine.at(), at + 7, "{name}");
        machine.ask(Ask::Resume).unwrap();
        machine.wait(500 * MS);
        assert_eq!(machine.at(), at + 7, "{name}: the old target has no meaning");
        for to in [at + 7, at + 12, 0] {
            machine.ask(Ask::To(to)).unwrap();
            machine.wait(500 * MS);
            assert_eq!(machine.at(), to, "{name}");
        }
        assert_eq!(machine.ask(Ask::To(101)), Err(Error::SoftLimit { target: 101 }), "{name}");
        machine.ask(Ask::Halt).unwrap();
        if machine.has_halves() {
            assert_eq!(machine.ask(Ask::Set(1)), Err(Error::Moving), "{name}: not confirmed");
        }
    });
}

/// To a clock that is ahead the quick stop is over; what is asked for with it is refused, and the stop is as it was.
#[test]
fn a_refused_request_does_not_end_a_quick_stop() {
    let limits = Limits::new(2000, 20_000).unwrap();
    let mut mover = Mover::new(Clock::MICROSECONDS, limits).unwrap().with_soft_limits(-900, 900);
    mover.move_to(900, 0).unwrap();
    let mut last = 0;
    while mover.commanded() < 300 {
        last = mover.pulse().unwrap().tick;
    }
    mover.quick_stop(Limits::new(2000, 200_000).unwrap(), last);
    while let Some(pulse) = mover.pulse() {
        last = pulse.tick;
    }
    assert!(!mover.is_at_rest(last));
    assert!(matches!(mover.move_to(901, last + 100_000), Err(Error::SoftLimit { .. })));
    assert_eq!(mover.move_to(900, last), Err(Error::Moving));
    assert_eq!(mover.run(Direction::Forward, 1, last), Err(Error::Moving));
}

/// A path takes lines again when an axis takes moves: at rest, half a step after its last step.
#[test]
fn a_quick_stop_lasts_until_rest() {
    all(|machine, name| {
        under_way(machine);
        machine.ask(Ask::Quick).unwrap();
        let mut refused = 0;
        while !machine.is_at_rest() {
            for ask in [Ask::To(0), Ask::Along(0)] {
                assert_eq!(machine.ask(ask), Err(Error::Moving), "{name}");
            }
            refused += 1;
            machine.wait(MS / 4);
        }
        assert!(refused > 2, "{name}");
        machine.ask(Ask::To(0)).unwrap();
        machine.wait(500 * MS);
        assert_eq!(machine.at(), 0, "{name}");
    });
}
