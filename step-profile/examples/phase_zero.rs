//! How a motor stands still at 250 kHz: the trap of phase 0.
//!
//! `cargo run -p step-profile --example phase_zero`
#![allow(clippy::arithmetic_side_effects)]

use step_profile::{Error, NamedSpeed, Parameters, Profile, RampTable, Speed};

fn main() -> Result<(), Error> {
    let sum: u32 = RampTable::SIN2.entries().iter().sum();
    println!("The ramp at 250 kHz lasts {sum} * 4 ns = {} cycles of 4 us, a whole number.", sum / 1000);
    println!("A move that starts at phase 0 is back at phase 0 when it reaches full speed, and stays there.\n");

    println!("A full turn, 51200 steps. Pulses whose sync_time a PTO word cannot carry:\n");
    println!("     speed  initial sync_time      0 (read as no pulse)  3991..=3999 (reserved)");
    for NamedSpeed { hz, speed } in Speed::NAMED {
        for init_sync in [0, Parameters::INIT_SYNC] {
            let profile = Profile::new(Parameters::at(speed).with_init_sync(init_sync))?;
            let (mut silent, mut reserved) = (0, 0);
            for step in profile.steps(51_200) {
                silent += u32::from(step.sync_time == 0);
                reserved += u32::from(step.sync_time > 3990);
            }
            println!("{hz:>7} Hz {init_sync:>15} ns {silent:>21} {reserved:>23}");
        }
    }

    println!("\nA speed whose period is not a whole number of nanoseconds wanders through all phases and meets the");
    println!("gap now and then. The sender of the word has to shift such a pulse to 1 or 3990 ns, not drop it.");
    Ok(())
}
