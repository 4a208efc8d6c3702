//! The RTEX driver at a simulated ASIC: both timer systems, all widths of the bus, and faults.

#[cfg(feature = "async")]
mod asynch;
mod bank;
mod clock;
mod exchange;
mod faults;
mod reception;
mod stops;

use std::marker::PhantomData;
use std::num::NonZeroU16;

use crate::asic::{AXES, Bus, COM_NS, Drawn, Ring, SWITCHES, Shared, Watch};
use rtex_block::device::{Drive, Fault};
use rtex_block::master::{
    ActiveCode, Arrival, Axis, AxisConfig, AxisState, ControlError, ControlPhase, Limits, Master, MasterConfig,
    RingFailure, Slave, StopCategory, StopReason,
};
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{Alarm, BlockSize, Doubt, MacId, Policy};
use servowire_drivers::Error;
use servowire_drivers::rtex::Driver;
use servowire_world::{Draw, wanted_events};

const LIMIT: u16 = 6;

type Rtex<W> = Driver<'static, Bus<W>, Watch, AXES>;

fn driver<W: Drawn>(ring: &Shared) -> Rtex<W> {
    let (external, wide, reception) = (ring.borrow().external, ring.borrow().wide, ring.borrow().reception());
    let (periods, timer) = if external {
        (Periods::from_a6n(-1, 2, Some(COM_NS as i64)).unwrap(), TimerSystem::External)
    } else {
        (Periods::from_a6n(-1, 1, Some(COM_NS as i64)).unwrap(), TimerSystem::Internal)
    };
    let limit = NonZeroU16::new(LIMIT).unwrap();
    let size = if wide { BlockSize::Bytes32 } else { BlockSize::Bytes16 };
    let config = MasterConfig::new(size, periods, timer).with_watchdog(Some(limit));
    let ids = SWITCHES.map(|switches| MacId::new(switches).unwrap());
    let limits = Limits::new(limit, 60).with_ready(Some(200));
    let axes = ids.map(|id| Axis::new(AxisConfig::new(id, ActiveCode::CyclicPosition, periods.update_ns, limits)));
    let master = Master::new(config, ids.map(|mac_id| Slave { mac_id, kind: 1 }), axes).unwrap();
    Driver::new(Bus(ring.clone(), PhantomData), Watch(ring.clone()), master, reception)
}

/// The NC interrupt of the next update period, and what the exchange gave.
fn update<W: Drawn>(
    ring: &Shared,
    driver: &mut Rtex<W>,
) -> Result<
    servowire_drivers::rtex::Exchanged,
    Error<(), std::convert::Infallible, ControlError, std::convert::Infallible>,
> {
    let began_ns = {
        let mut ring = ring.borrow_mut();
        let periods = if ring.external { 2 } else { 1 };
        for _ in 0..periods {
            let begins_ns = ring.next_frame_ns();
            ring.pass(begins_ns);
        }
        let noticed_ns = ring.now_ns + ring.late_ns;
        ring.pass(noticed_ns);
        ring.in_exchange = true;
        ring.read_of.clear();
        ring.now_ns
    };
    let result = driver.exchange(began_ns);
    let mut ring = ring.borrow_mut();
    ring.in_exchange = false;
    ring.let_in();
    result
}

/// The actual position, if it is no older than an update period and the frame that brought it, and a little for a late executor.
fn position<W: Drawn, C: servowire_drivers::Clock>(
    ring: &Shared,
    driver: &Driver<'static, Bus<W>, C, AXES>,
    place: usize,
) -> Option<i32> {
    let update_ns = u64::from(driver.master().config().periods.update_ns);
    let policy = Policy::new(COM_NS + update_ns + 100_000);
    driver.evidence(place).at(ring.borrow().now_ns, policy).ok().map(|sample| sample.position())
}

fn on<W: Drawn>(ring: &Shared) -> Rtex<W> {
    let mut driver = driver::<W>(ring);
    assert_eq!(driver.start(1_000_000), Ok(ControlPhase::Running));
    for _ in 0..400 {
        if driver.ring_mut().switch_on().is_ok() {
            break;
        }
        update(ring, &mut driver).unwrap();
    }
    for _ in 0..60 {
        if driver.master().ring().all_are(AxisState::On) {
            return driver;
        }
        update(ring, &mut driver).unwrap();
    }
    panic!("{:?}", driver.master().ring().failure());
}

fn move_on<W: Drawn, C: servowire_drivers::Clock>(driver: &mut Driver<'static, Bus<W>, C, AXES>) {
    for (k, axis) in driver.ring_mut().axes_mut().iter_mut().enumerate() {
        if axis.state() == AxisState::On {
            let to = axis.setpoint().wrapping_add(10 * (k as i32 + 1));
            axis.set_position(to).unwrap();
        }
    }
}

fn heal(ring: &Shared) {
    let mut ring = ring.borrow_mut();
    (ring.fail_in, ring.lose_frames, ring.stall_in) = (None, 0, None);
}

/// Every position is there, and it is that of the last frames; nothing has stopped.
fn is_well<W: Drawn, C: servowire_drivers::Clock>(
    ring: &Shared,
    driver: &Driver<'static, Bus<W>, C, AXES>,
    what: &dyn std::fmt::Debug,
) {
    assert_eq!(driver.master().ring().failure(), None, "{what:?}");
    for place in 0..AXES {
        let said = position(ring, driver, place).unwrap_or_else(|| panic!("{what:?}: no position of {place}"));
        let is = ring.borrow().drives[place].position();
        let per_update = 10 * (place as i32 + 1);
        assert!(is.wrapping_sub(said).unsigned_abs() <= 3 * per_update as u32, "{what:?}: {said}, and it is at {is}");
    }
}
