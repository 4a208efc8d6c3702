//! The RTEX driver on a clock that stands, was set back, or wraps, with an ASIC that never gets ready.

use std::cell::Cell;
use std::convert::Infallible;
use std::num::NonZeroU16;

use rtex_block::master::{ActiveCode, Asic, Axis, AxisConfig, Limits, Master, MasterConfig, Slave};
use rtex_block::timing::{Periods, TimerSystem};
use rtex_block::{BlockSize, MacId};
use servowire_drivers::rtex::{Driver, FrameCount, Port};
use servowire_drivers::{ClockError, Error};

use crate::bad_clock::{Wrong, holds_against};

/// An ASIC that never gets ready, and the blocks that were written to it.
struct Stuck<'a>(&'a Cell<u32>);

impl Port for Stuck<'_> {
    type Word = u16;
    type Error = Infallible;

    fn state(&mut self) -> Result<Asic, Infallible> {
        Ok(Asic::RingConfig)
    }

    fn slaves(&mut self, _: &mut [Slave]) -> Result<Option<usize>, Infallible> {
        Ok(None)
    }

    fn read(&mut self, _: usize, _: &mut [u16]) -> Result<(), Infallible> {
        Ok(())
    }

    fn write(&mut self, _: usize, _: &[u16]) -> Result<(), Infallible> {
        self.0.set(self.0.get() + 1);
        Ok(())
    }
}

static RECEIVED: FrameCount = FrameCount::new();

pub(super) fn host() -> Master<1> {
    let periods = Periods::from_a6n(-1, 1, Some(500_000)).unwrap();
    let config = MasterConfig::new(BlockSize::Bytes16, periods, TimerSystem::Internal);
    let mac_id = MacId::truncate(1);
    let limits = Limits::new(NonZeroU16::new(6).unwrap(), 60);
    let axis = Axis::new(AxisConfig::new(mac_id, ActiveCode::CyclicPosition, periods.update_ns, limits));
    Master::new(config, [Slave { mac_id, kind: 1 }], [axis]).unwrap()
}

#[test]
fn rtex() {
    // What a phase of an RTEX master lasts nobody can tell from a jump.
    holds_against(&[Wrong::Stands, Wrong::Reset, Wrong::Wraps], "start", |clock| {
        let writes = Cell::new(0);
        let mut driver = Driver::new(Stuck(&writes), || clock.look(), host(), &RECEIVED);
        std::array::from_fn(|_| driver.start(1_000_000).err())
    });
}

/// Drives stop without commands.
#[test]
fn rtex_commands_go_out_whatever_the_clock_says() {
    let (writes, now_ns) = (Cell::new(0), Cell::new(5_000_000));
    let mut driver = Driver::new(Stuck(&writes), || now_ns.get(), host(), &RECEIVED);
    assert_eq!(driver.exchange(5_000_000).map(|exchanged| exchanged.frames_late), Ok(0));
    now_ns.set(4_000_000);
    let error = driver.exchange(5_500_000).unwrap_err();
    assert_eq!(error, Error::Clock(ClockError::Backwards { by_ns: 1_000_000 }));
    assert_eq!(writes.get(), 2);
    assert!(driver.exchange(4_000_000).is_ok());
}
