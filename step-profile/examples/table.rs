//! The published ramp with a table of one's own, and what a motor driver is told for 1/8 steps.
//!
//! `cargo run -p step-profile --example table`
#![allow(clippy::arithmetic_side_effects)]

use step_profile::{Frequency, Microstep, Parameters, Profile, RampTable, Speed};

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let microstep = Microstep::from_code(3).ok_or("no such profile")?;
    println!("{microstep:?}: CTRL.MODE {:#05x}", microstep.ctrl_field());

    // Constant steps of the level, for a tone of 125 ms.
    let table = RampTable::new(core::array::from_fn(|entry| 1000 * (32 - u32::try_from(entry).unwrap_or(31))))?;
    let tone = Frequency::from_hz(94_570);
    let profile = Profile::new(Parameters::at(Speed::from_frequency(tone)?).with_table(&table))?;
    println!("125 ms of {tone}: {} ns", profile.duration_ns(tone.steps_in(125)));
    Ok(())
}
