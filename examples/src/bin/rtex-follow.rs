//! Two RTEX axes that follow the curves of `step-motion`: the plan says where an axis has to be at an instant, and each
//! update period sends that position. It makes a jerk-limited move forth, one back, and one that a stop ends half-way.
//!
//! `cargo run -p servowire-examples --bin rtex-follow` prints what each move puts on the wire.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    clippy::std_instead_of_core,
    reason = "a program for a host"
)]

use core::convert::Infallible;
use core::num::NonZeroU16;
use std::error::Error;

use rtex_block::device::{Drive, DriveConfig, OpenCodes};
use rtex_block::master::{ActiveCode, Axis, AxisConfig, AxisState, Ended, Heard, Limits, Ring, Run, StopCategory};
use rtex_block::{MacId, Response};
use step_motion::{Clock, Plan};

const AXES: usize = 2;
/// An update period; a tick of the plans is a microsecond.
const PERIOD_NS: u64 = 500_000;
const TICK_NS: u64 = 1_000;

/// The ring, its modelled drives, and the command positions that went over the wire.
struct Bench {
    ring: Ring<AXES>,
    drives: [Drive; AXES],
    heard: [Heard; AXES],
    now_ns: u64,
    wire: Vec<[i32; AXES]>,
}

impl Run<AXES> for Bench {
    type Error = Infallible;

    fn ring_mut(&mut self) -> &mut Ring<AXES> {
        &mut self.ring
    }

    fn update(&mut self) -> Result<u64, Infallible> {
        self.now_ns += PERIOD_NS;
        let blocks = self.ring.update(&self.heard, self.now_ns).map(|command| command.main.emit());
        for ((drive, heard), block) in self.drives.iter_mut().zip(&mut self.heard).zip(&blocks) {
            *heard = drive.hear(block).map_or(Heard::Nothing, |block| Response::parse(&block).into());
        }
        self.wire.push(blocks.map(|[_, _, _, _, a, b, c, d, ..]| i32::from_le_bytes([a, b, c, d])));
        Ok(self.now_ns)
    }
}

/// Where an axis has been told to go: from here, by a plan that began at an instant.
struct Course {
    plan: Plan,
    from: i32,
    forward: bool,
    begin_ns: u64,
}

impl Course {
    /// `by` command units from where the set-point is, at 400,000 units/s, 2,000,000 units/s² and 40,000,000 units/s³.
    fn new(axis: &Axis, by: i32, begin_ns: u64) -> Result<Self, Box<dyn Error>> {
        let limits = step_motion::Limits::new(400_000, 2_000_000)?.with_jerk(40_000_000)?;
        let plan = Plan::new(Clock::MICROSECONDS, limits, by.unsigned_abs())?;
        Ok(Self { plan, from: axis.setpoint(), forward: by > 0, begin_ns })
    }

    /// Where the axis is to be at an instant; `None` after the end.
    fn position(&self, now_ns: u64) -> Option<i32> {
        let tick = now_ns.saturating_sub(self.begin_ns) / TICK_NS;
        // A step of the plan is a command unit, in 2^-32; the last period ends in the target.
        let by = ((self.plan.at(tick).position + (1 << 31)) >> 32) as i32;
        let over = tick >= self.plan.duration() + PERIOD_NS / TICK_NS;
        (!over).then(|| if self.forward { self.from.wrapping_add(by) } else { self.from.wrapping_sub(by) })
    }
}

/// Moves all axes at once, each by its own distance; after `stop` update periods a stop of category 2 is asked for.
fn go(bench: &mut Bench, by: [i32; AXES], stop: Option<u64>) -> Result<(), Box<dyn Error>> {
    let begin_ns = bench.now_ns;
    bench.wire.clear();
    let [first, second] = bench.ring.axes();
    let courses = [Course::new(first, by[0], begin_ns)?, Course::new(second, by[1], begin_ns)?];
    let end_ns = stop.map_or(u64::MAX, |periods| begin_ns + periods * PERIOD_NS);
    bench.follow(|place, now_ns| courses.get(place)?.position(now_ns).filter(|_| now_ns < end_ns))?;
    if stop.is_some() {
        bench.ring.stop(StopCategory::Two);
        let held = |axis: &Axis| matches!(axis.state(), AxisState::Held(_));
        match bench.until(Some(1_000), |ring| ring.axes().iter().all(held)) {
            // It was asked for: the ring says who had asked.
            Ok(()) | Err(Ended::Ring(_)) => {}
            Err(other) => return Err(other.into()),
        }
        for _ in 0..200 {
            bench.update()?;
        }
    }
    for (place, (axis, drive)) in bench.ring.axes().iter().zip(&bench.drives).enumerate() {
        let track: Vec<i64> = bench.wire.iter().map(|positions| positions[place].into()).collect();
        let speeds: Vec<i64> = track.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let most = |values: &mut dyn Iterator<Item = i64>| values.map(i64::abs).max().unwrap_or_default();
        let fastest = most(&mut speeds.iter().copied());
        let hardest = most(&mut speeds.windows(2).map(|pair| pair[1] - pair[0]));
        let far = track.last().unwrap_or(&0) - track.first().unwrap_or(&0);
        println!(
            "axis {place}: {far:>7} units in {:>4} periods, at most {fastest} a period, {hardest} more or less in the next; {}, \
             motor {} behind",
            track.len(),
            axis.state(),
            axis.setpoint() - drive.position(),
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let limits = Limits::new(NonZeroU16::MIN.saturating_add(7), 200);
    let number = |place: u8| MacId::new(place + 1).unwrap_or_default();
    let axis = |place| {
        let config = AxisConfig::new(number(place), ActiveCode::CyclicPosition, 500_000, limits);
        Axis::new(config.with_deceleration(1))
    };
    let drive = |place| Drive::new(DriveConfig::new(number(place), OpenCodes::INVENTED));
    let mut bench = Bench {
        ring: Ring::new([axis(0), axis(1)], 4)?,
        drives: [drive(0), drive(1)],
        heard: [Heard::Nothing; AXES],
        now_ns: 0,
        wire: Vec::new(),
    };
    bench.switch_on()?;
    go(&mut bench, [200_000, -50_000], None)?;
    go(&mut bench, [-200_000, 50_000], None)?;
    go(&mut bench, [200_000, -50_000], Some(300))?;
    Ok(())
}
