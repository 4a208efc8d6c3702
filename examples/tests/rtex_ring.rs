//! The ring example ends as it must: stopped by the time-out, with a table and a plot.
#![allow(clippy::unwrap_used, clippy::std_instead_of_core, clippy::indexing_slicing)]

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
    // The LED flashes while the phases go on, each at its time.
    for line in [
        "20.0 ms  before the motion: ASIC Initial, phase Waiting, COM LED Green",
        "500.0 ms  before the motion: ASIC RingConfig, phase Waiting, COM LED Off",
        "1300.0 ms  before the motion: ASIC Ready, phase Prepare, COM LED Green",
        "2100.0 ms  before the motion: ASIC Running, phase Running, COM LED Green",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let drawn = fs::read_to_string(&svg).unwrap();
    // The texts of the two marks stand on lines of their own, left of their marks.
    let texts: Vec<&str> =
        drawn.split("<text ").filter(|text| text.contains("drive silent") || text.contains("servos off")).collect();
    let y = |text: &str| text.split("y=\"").nth(1).and_then(|t| t.split('"').next()).map(str::to_owned);
    let places: Vec<_> = texts.iter().map(|text| y(text)).collect();
    assert!(places.len() == 2 && places[0] != places[1], "{texts:?}");
    // A line an axis, and the two marks; the scales have some too.
    assert!(drawn.matches("<polyline").count() >= 34);
    assert!(drawn.starts_with("<svg") && drawn.trim_end().ends_with("</svg>"));
}
