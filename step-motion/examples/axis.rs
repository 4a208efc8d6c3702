//! A machine from switching on to its first part: homing, work within soft limits, an arc, a hand on the feed, a hold.
//!
//! `cargo run -p step-motion --example axis`
#![allow(clippy::arithmetic_side_effects)]

use step_motion::{
    Arc, AxisSetup, Clock, Direction, Homing, HomingConfig, HomingState, Limits, Mover, Path, PathMover, Switch,
    Turning,
};

/// Where the reference switch closes, seen from where the axis is switched on.
const SWITCH: i64 = -700;

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let limits = Limits::new(20_000, 200_000)?.with_jerk(4_000_000)?;
    // A limit switch has no time for a jerk limit.
    let hard = limits.without_jerk();
    let mut x = Mover::new(Clock::MICROSECONDS, limits)?.with_reversal_pause(500);
    let config = HomingConfig::new(Direction::Reverse, 4000, 400, 5000, hard).with_back_off(100);
    let mut homing = Homing::start(config, &mut x, Switch::Open, 0)?;
    let mut now = 0;
    let mut made = 0;
    while !matches!(homing.state(), HomingState::Done | HomingState::Failed) {
        match x.pulse() {
            Some(pulse) => {
                now = pulse.tick;
                made += if pulse.direction == Direction::Forward { 1 } else { -1 };
            }
            None => now += 1000,
        }
        homing.poll(&mut x, if made <= SWITCH { Switch::Closed } else { Switch::Open }, now)?;
    }
    println!("homed at {now} us: {:?}, position {} after {made} steps", homing.state(), x.commanded());

    // Work, with other limits and between soft ones.
    x.set_limits(limits.with_speed(15_000)?, now)?;
    let mut x = x.with_soft_limits(-100, 40_000);
    x.move_to(20_000, now)?;
    run(&mut x, 5000, &mut now);
    x.set_override(30, now);
    run(&mut x, 10_000, &mut now);
    println!("at {now} us and {}", x.at(now));
    x.set_override(100, now);
    run(&mut x, 20_000, &mut now);
    x.run(Direction::Forward, 10_000, now)?;
    run(&mut x, 25_000, &mut now);
    x.halt(now);
    println!("at {now} us halted at speed: {}, home it again", x.is_halted());

    corner()?;
    feed()?;
    Ok(())
}

/// Takes steps until it is there.
fn run(x: &mut Mover, position: i64, now: &mut u64) {
    while x.commanded() < position {
        let Some(pulse) = x.pulse() else { return };
        *now = pulse.tick;
    }
}

/// Two axes along a line and a quarter of a circle, after a pause of a second.
fn corner() -> Result<(), Box<dyn core::error::Error>> {
    let axis = AxisSetup::new(Limits::new(20_000, 200_000)?, 80_000);
    let mut path = Path::<2, 64>::new(Clock::MICROSECONDS, [axis; 2], 20)?;
    path.push([800, 0], 100_000)?;
    for end in Arc::new([10_000, 0], [15_000, 5000], [10_000, 5000], Turning::Counterclockwise, 5)? {
        path.push(end.map(|um| i64::from(um) * 80 / 1000), 100_000)?;
    }
    path.not_before(1_000_000);
    let mut steps = [0; 2];
    let mut end = 0;
    while let Some(line) = path.next_line() {
        end = line.end();
        for pulse in line {
            if let Some(count) = steps.get_mut(usize::from(pulse.axis)) {
                *count += 1;
            }
        }
    }
    println!("a line and an arc: {steps:?} steps, over at {end} us");
    Ok(())
}

/// Two axes with a hand on the feed: slower, held, sent on, and told to go home instead.
fn feed() -> Result<(), Box<dyn core::error::Error>> {
    let axis = AxisSetup::new(Limits::new(20_000, 200_000)?.with_jerk(4_000_000)?, 80_000);
    let mut machine = PathMover::new(Path::<2, 8>::new(Clock::MICROSECONDS, [axis; 2], 20)?);
    machine.push([8000, 4000], 100_000, 0)?;
    machine.push([8000, 12_000], 100_000, 0)?;
    let mut now = 0;
    while let Some(pulse) = machine.pulse() {
        now = pulse.tick;
        match machine.commanded() {
            [1000, _] if pulse.axis == 0 => machine.set_override(50, now),
            [3000, _] if pulse.axis == 0 => machine.hold(now),
            _ => {}
        }
    }
    now += 1_000_000;
    println!("held at {:?}, {} lines left, at rest: {}", machine.commanded(), machine.len(), machine.is_at_rest(now));
    machine.set_override(120, now);
    machine.resume(now);
    while let Some(pulse) = machine.pulse() {
        now = pulse.tick;
        if machine.commanded() == [8000, 6000] {
            machine.stop(now);
            println!("a stop from {} ends at {:?}", machine.at(now)[1], machine.target());
            machine.move_to([0, 0], 200_000, now)?;
        }
    }
    println!("home: {:?}, halted: {}", machine.commanded(), machine.is_halted());
    Ok(())
}
