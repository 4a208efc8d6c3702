//! A worked port: an RTEX master on a chip with the communication ASIC on its bus, in the internal-timer system.
//!
//! `cargo run -p servowire-examples --bin rtex-port` runs it against a simulated ASIC with three drives. To copy this, keep
//! `main.rs` and `port.rs`, write `map.rs` from the data sheet of the ASIC, which is not public, and replace `asic.rs` by
//! the one volatile access of your chip. Two interrupts and the main loop share the driver:
//!
//! ```text
//! XSYNC    highest priority   exchange, then the set-points of the next period
//! XINTRX   below it           counts a frame
//! main     no priority        control(), LED, what the machine is to do; takes the driver in a critical section, for one call
//! ```
//! Positions leave the interrupt through an [`EvidenceCell`] and targets enter it through atomics, so the main loop needs no critical
//! section for either. If this program fails to stop the motors, hardware has to: see the README of `rtex-block`.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::std_instead_of_core,
    reason = "a program for a host"
)]

mod asic;
mod map;
mod port;

use core::num::NonZeroU16;
use core::sync::atomic::{AtomicI32, Ordering};
use std::error::Error;
use std::sync::{Mutex, PoisonError};

use asic::{Asic, Interrupt};
use port::{Mnm1221, Window};
use rtex_block::master::{
    ActiveCode, Axis, AxisConfig, AxisState, ControlPhase, Limits, Master, MasterConfig, Slave, StopCategory,
};
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{BlockSize, Evidence, EvidenceCell, MacId, Policy};
use servowire_core::Writer;
use servowire_drivers::rtex::{Driver, FrameCount};

pub(crate) const AXES: usize = 3;

/// The drives along the ring, as the drawing of the machine lists them.
pub(crate) const DRIVES: [u8; AXES] = [4, 0, 31];

/// The one access to the bus. On a chip: `read_volatile` and `write_volatile` at the base address of the ASIC, whose region is
/// neither cached nor buffered.
struct Bus;

impl Window for Bus {
    fn read(&mut self, address: usize) -> u16 {
        Asic::with(|asic| asic.read(address))
    }

    fn write(&mut self, address: usize, word: u16) {
        Asic::with(|asic| asic.write(address, word));
    }
}

/// The clock: on a chip a `CounterClock` over its cycle counter.
type Clock = fn() -> u64;

type Rtex = Driver<'static, Mnm1221<Bus>, Clock, AXES>;

/// What the interrupts and the main loop share; on a chip a `critical_section::Mutex`.
static DRIVER: Mutex<Option<Shared>> = Mutex::new(None);
/// Frames, counted by XINTRX.
static FRAMES: FrameCount = FrameCount::new();
/// Where the main loop wants the axes, command units.
static TARGETS: [AtomicI32; AXES] = [const { AtomicI32::new(0) }; AXES];

struct Shared {
    driver: Rtex,
    positions: [Writer<'static, Evidence, 6>; AXES],
    /// Exchanges that failed: a place was not written, or the clock stood.
    faults: u32,
}

/// Interrupts are off while `work` is at the driver, and on again before this returns: what has come meanwhile runs then.
fn critical<T>(work: impl FnOnce(&mut Shared) -> T) -> T {
    let result = {
        let mut shared = DRIVER.lock().unwrap_or_else(PoisonError::into_inner);
        work(shared.as_mut().expect("it is there before the interrupts"))
    };
    while let Some(interrupt) = Asic::with(Asic::pending) {
        handle(interrupt);
    }
    result
}

/// The vector table. `began_ns` is the time of the edge, from a capture unit or read first thing.
fn handle(interrupt: Interrupt) {
    match interrupt {
        Interrupt::Xsync { began_ns } => on_xsync(began_ns),
        Interrupt::Xintrx => FRAMES.add(),
    }
}

/// The falling edge of XSYNC: exchange first, then everything else.
fn on_xsync(began_ns: u64) {
    let mut shared = DRIVER.lock().unwrap_or_else(PoisonError::into_inner);
    let Some(Shared { driver, positions, faults }) = shared.as_mut() else { return };
    *faults += u32::from(driver.exchange(began_ns).is_err());
    for (place, cell) in positions.iter_mut().enumerate() {
        cell.put(driver.evidence(place));
    }
    for (axis, target) in driver.ring_mut().axes_mut().iter_mut().zip(&TARGETS) {
        if axis.state() == AxisState::On {
            // Ten command units a millisecond: a step that the axis refuses is not sent, and it stands.
            let by = target.load(Ordering::Relaxed).wrapping_sub(axis.setpoint()).clamp(-5, 5);
            _ = axis.set_position(axis.setpoint().wrapping_add(by));
        }
    }
}

fn driver() -> Result<Rtex, Box<dyn Error>> {
    let periods = Periods::from_a6n(3, 1, None).ok_or("not in the table")?;
    let ids = DRIVES.map(MacId::truncate);
    // 4 ms without an answer are a time-out; the main power may come whenever it likes.
    let limits = Limits::new(NonZeroU16::MIN.saturating_add(7), 200);
    let axis = |id| {
        let config = AxisConfig::new(id, ActiveCode::CyclicPosition, periods.update_ns, limits);
        Axis::new(config.with_stop(Some(StopCategory::One)).with_deceleration(1))
    };
    let config = MasterConfig::new(BlockSize::Bytes16, periods, TimerSystem::Internal).with_watchdog(Some(limits.echo));
    let master = Master::new(config, ids.map(|mac_id| Slave { mac_id, kind: map::KIND_SERVO }), ids.map(axis))?;
    let clock: Clock = || Asic::with(Asic::now_ns);
    Ok(Driver::new(Mnm1221::new(Bus), clock, master, &FRAMES))
}

/// Lets interrupts come until `done`, with a turn of the main loop after each of them.
fn until(what: &str, mut done: impl FnMut(&mut Shared) -> bool) -> Result<(), Box<dyn Error>> {
    for _ in 0..20_000 {
        if critical(|shared| {
            _ = shared.driver.control();
            done(shared)
        }) {
            println!("{:8.1} ms  {what}", Asic::with(Asic::now_ns) as f64 / 1e6);
            return Ok(());
        }
        // `wfi` on a chip.
        handle(Asic::with(Asic::wait));
    }
    Err(format!("not reached: {what}").into())
}

fn main() -> Result<(), Box<dyn Error>> {
    // On a chip: `StaticCell`, or `singleton!`.
    let cells: &'static mut [EvidenceCell; AXES] = Box::leak(Box::new([const { EvidenceCell::new() }; AXES]));
    let [(a, mut first), (b, _), (c, _)] = cells.each_mut().map(EvidenceCell::split);
    let shared = Shared { driver: driver()?, positions: [a, b, c], faults: 0 };
    *DRIVER.lock().unwrap_or_else(PoisonError::into_inner) = Some(shared);

    // Interrupts stay off until the communication runs.
    while critical(|shared| shared.driver.control()).map_err(|error| error.to_string())? != ControlPhase::Running {
        Asic::with(Asic::idle);
    }
    println!("{:8.1} ms  the communication runs", Asic::with(Asic::now_ns) as f64 / 1e6);

    until("all servos on", |Shared { driver, .. }| {
        _ = driver.ring_mut().switch_on();
        driver.master().ring().all_are(AxisState::On)
    })?;
    for (target, to) in TARGETS.iter().zip([4_000, -2_500, 1_000]) {
        target.store(to, Ordering::Relaxed);
    }
    until("all axes at their targets", |shared| {
        let axes = shared.driver.master().ring().axes();
        axes.iter().zip(&TARGETS).all(|(axis, target)| axis.setpoint() == target.load(Ordering::Relaxed))
    })?;
    // The main loop judges a position when it uses it: two periods old at the most, and the frame before.
    let now_ns = Asic::with(Asic::now_ns);
    let sample = first.at(now_ns, Policy::new(1_600_000))?;
    println!("{:8.1} ms  axis 0 is at {}", now_ns as f64 / 1e6, sample.position());

    TARGETS[0].store(8_000, Ordering::Relaxed);
    TARGETS[1].store(8_000, Ordering::Relaxed);
    until("half way to the next", |shared| shared.driver.master().ring().axes()[0].setpoint() > 6_000)?;
    Asic::with(|asic| asic.silence(2));
    println!("{:8.1} ms  drive {} goes silent", Asic::with(Asic::now_ns) as f64 / 1e6, DRIVES[2]);
    until("the communication has failed, all servos off", |_| Asic::with(|asic| asic.all_off()))?;
    let (failure, faults) = critical(|shared| (shared.driver.master().ring().failure(), shared.faults));
    let failure = failure.ok_or("nothing has failed")?;
    println!("{failure}, {faults} exchanges failed, {} frames", FRAMES.get());
    if let Err(doubt) = first.at(Asic::with(Asic::now_ns) + 10_000_000, Policy::new(1_600_000)) {
        println!("axis 0: {doubt}");
    }
    Ok(())
}
