//! The worked port runs against the simulated ASIC: start, motion, and the stop of everybody when one drive goes silent.
#![allow(clippy::unwrap_used, clippy::std_instead_of_core)]

use std::process::Command;

#[test]
fn the_port_starts_moves_and_stops() {
    let run = Command::new(env!("CARGO_BIN_EXE_rtex-port")).output().unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    assert!(run.status.success(), "{text}{}", String::from_utf8_lossy(&run.stderr));
    let order = [
        "the communication runs",
        "all servos on",
        "all axes at their targets",
        "axis 0 is at 39",
        "half way to the next",
        "drive 31 goes silent",
        "the communication has failed, all servos off",
        "axis 2: no block comes on time, 0 exchanges failed",
        "axis 0: the position is",
    ];
    let places: Vec<_> = order.iter().map(|line| text.find(line).unwrap_or_else(|| panic!("{line}\n{text}"))).collect();
    assert!(places.is_sorted(), "{text}");
    // 8 periods to notice it, one for the command to get there, one for the drives to obey, two for the frames between.
    let at = |line: &str| -> f64 {
        let line = text.lines().find(|text| text.contains(line)).unwrap();
        line.split_whitespace().next().unwrap().parse().unwrap()
    };
    assert!(at("all servos off") - at("goes silent") <= 6.0, "{text}");
}
