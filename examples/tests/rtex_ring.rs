//! The ring example ends as it must: stopped by the time-out, with a table and a plot.
#![allow(clippy::unwrap_used, clippy::std_instead_of_core)]

use std::fs;
use std::path::Path;
use std::process::Command;

#[test]
fn the_ring_stops_safely_and_is_drawn() {
    let svg = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ring.svg");
    let run = Command::new(env!("CARGO_BIN_EXE_rtex-ring")).arg(&svg).output().unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    assert!(run.status.success(), "{text}");
    assert!(text.contains("all servos off, 4.5 ms after"), "{text}");
    assert_eq!(text.lines().filter(|line| line.ends_with("axis 11")).count(), 31, "{text}");
    let drawn = fs::read_to_string(&svg).unwrap();
    // A line an axis, and the two marks; the scales have some too.
    assert!(drawn.matches("<polyline").count() >= 34);
    assert!(drawn.starts_with("<svg") && drawn.trim_end().ends_with("</svg>"));
}
