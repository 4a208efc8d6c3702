//! A stepper motor plays: dance mode, cycle by cycle.
//!
//! `cargo run -p step-profile --example song`
#![allow(clippy::arithmetic_side_effects)]

use step_profile::{Command, Dance, Direction, Error, Motors, Note, Parameters, Tone};

fn main() -> Result<(), Error> {
    // 10 ms between the notes.
    let song = [Tone::Cis, Tone::E, Tone::Fis, Tone::A, Tone::H, Tone::Cis2].map(|tone| Note::p125(tone, 2500));
    let parameters = Parameters::at(Tone::A.speed()).with_steps_per_entry(2);
    let mut dance = Dance::new(Motors::ALL, parameters, Direction::Forward, &song)?;

    // What would be sent: four commands every 4 us.
    let (mut cycles, mut pulses) = (0_u64, 0_u64);
    while !dance.is_over() {
        for command in dance.tick() {
            pulses += u64::from(matches!(command, Command::Pulse { .. }));
        }
        cycles += 1;
    }
    println!("{} notes: {pulses} pulses to four motors in {} ms", song.len(), cycles * 4 / 1000);
    println!("each motor turned by {:?} steps of 1/51200 turn", dance.group().commanded());
    Ok(())
}
