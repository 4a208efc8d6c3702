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
    // The LED flashes while the phases go on, each at its time, and red after the stop; one time for all.
    for line in [
        "20.0 ms  ASIC Initial, phase Waiting, COM LED Green",
        "520.0 ms  ASIC RingConfig, phase Waiting, COM LED Off",
        "1020.0 ms  ASIC RingConfig, phase Waiting, COM LED Green",
        "1300.0 ms  ASIC Ready, phase Prepare, COM LED Green",
        "1520.0 ms  ASIC Ready, phase Start, COM LED Off",
        "2100.0 ms  ASIC Running, phase Running, COM LED Green",
        "drive 11 goes silent",
        "phase Running, fault Timeout, COM LED Red",
        "phase Running, fault Timeout, COM LED Off",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    let times: Vec<f64> = text.lines().filter_map(|l| l.split(" ms  ").next()?.trim().parse().ok()).collect();
    assert!(times.is_sorted() && times.len() > 12, "{times:?}");
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

/// Two drives in each other's place: the slave table is not what the ring configuration finds.
#[test]
fn a_ring_that_is_not_the_one_of_the_table() {
    let run = Command::new(env!("CARGO_BIN_EXE_rtex-ring")).arg("--swapped").output().unwrap();
    let text = String::from_utf8(run.stdout).unwrap();
    assert_eq!(run.status.code(), Some(1), "{text}");
    assert!(text.contains("1300.0 ms  ASIC Ready, phase Waiting, fault SlaveInfoMismatch, COM LED Red"), "{text}");
    assert!(String::from_utf8(run.stderr).unwrap().contains("the ring does not start: SlaveInfoMismatch"));
    // Solid red: nothing is shown after it.
    assert!(text.trim_end().ends_with("COM LED Red"), "{text}");
}

#[test]
fn options_are_no_files() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (option, code) in [("--help", 0), ("-h", 0), ("--nothing", 2)] {
        let run = Command::new(env!("CARGO_BIN_EXE_rtex-ring")).arg(option).current_dir(folder).output().unwrap();
        assert_eq!(run.status.code(), Some(code));
        let text = if code == 0 { run.stdout } else { run.stderr };
        assert!(String::from_utf8(text).unwrap().contains("Usage: rtex-ring"));
        assert!(!folder.join(option).exists());
    }
}
