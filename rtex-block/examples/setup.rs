//! What has to fit together before a ring is started: periods, timer, frame time, gear and speed, and the memory of the ASIC.
//!
//! `cargo run -p rtex-block --example setup`
#![allow(clippy::std_instead_of_core, reason = "a program for a host")]

use core::num::NonZeroU16;
use std::error::Error;

use rtex_block::master::{ActiveCode, Axis, AxisConfig, Limits, Master, MasterConfig, Slave};
use rtex_block::position::{Gear, is_within_limit, max_step, max_torque};
use rtex_block::timing::{A6N, A6nParameters, FrameTime, Periods, TimerSystem, timer_reload};
use rtex_block::{BlockSize, Command, MacId, stream};

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "update     communication  Pr7.20  Pr7.21  Pr7.91   internal  axes  reload at 50 MHz  late if it ends 20 us before the next"
    );
    for periods in A6N {
        let A6nParameters { pr7_20, pr7_21, pr7_91 } = periods.a6n_parameters();
        let internal = if TimerSystem::Internal.allows(&periods) { "yes" } else { "no" };
        let reload = timer_reload(50_000_000, periods.com_ns).map_or("-".to_owned(), |ticks| ticks.to_string());
        println!(
            "{:7} ns {:11} ns {pr7_20:7} {pr7_21:7} {pr7_91:8} {internal:>8} {:5} {reload:>17} {:>20}",
            periods.update_ns,
            periods.com_ns,
            FrameTime::GUIDE.axes_within(periods.com_ns),
            periods.frames_late(periods.update_ns.saturating_sub(20_000)),
        );
    }
    let linear = Periods::from_a5nl(0, 2).ok_or("not a pair of the A5NL")?;
    println!("A5NL with Pr7.20 = 0, Pr7.21 = 2: {} ns, {} communications", linear.update_ns, linear.communications());

    let gear = Gear::new(8, 1).ok_or("a gear of 0")?;
    let (step, fits) = (max_step(500_000, gear), is_within_limit(25_001, 500_000, gear));
    println!("at gear 8/1 and 0.5 ms the position may go {step} command units; 25001: {fits}");
    println!("5.0 A peak on 2.0 A rated: {:?} in 0.1 %", max_torque(50, 20));
    memory()
}

/// A master over the three kinds of memory: all of them hold the same blocks.
fn memory() -> Result<(), Box<dyn Error>> {
    let periods = Periods::from_a6n(3, 1, None).ok_or("not in the table")?;
    let mac_id = MacId::new(5).ok_or("above 31")?;
    let limits = Limits::new(NonZeroU16::MIN.saturating_add(7), 100);
    let axis = Axis::new(AxisConfig::new(mac_id, ActiveCode::CyclicPosition, periods.update_ns, limits));
    let config = MasterConfig::new(BlockSize::Bytes32, periods, TimerSystem::Internal);
    let mut master = Master::new(config, [Slave { mac_id, kind: 1 }], [axis])?;
    let (mut bytes, mut words16, mut words32) = ([0_u8; 32], [0_u16; 16], [0_u32; 8]);
    master.exchange_words(&[0; 32], &mut bytes, 0)?;
    master.exchange_words(&[0; 16], &mut words16, 0)?;
    master.exchange_words(&[0; 8], &mut words32, 0)?;
    println!("{:04x} {:08x}", words16[0], words32[0]);
    let (_, command) = stream::command32::<nom::error::Error<&[u8]>>(&bytes).map_err(|error| error.to_string())?;
    println!("{} {}", command.main, if command.main == Command::nop(mac_id) { "before the start" } else { "" });
    Ok(())
}
