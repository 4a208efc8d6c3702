//! A disk that is full: every command says so, names the file, and fails.
#![cfg(target_os = "linux")]

use std::fs::File;
use std::process::{Command, Stdio};

use crate::common::{self, Bench, good_traffic};

/// Where nothing can be written.
const FULL: &str = "/dev/full";

/// Prints onto a full disk.
#[track_caller]
fn printed(arguments: &[&str]) {
    let full = File::options().write(true).open(FULL).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_servowire"));
    let output = command.args(arguments).stdin(Stdio::null()).stdout(full).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    let last = said.lines().last().unwrap_or_default();
    assert!(last.starts_with("error: ") && last.contains("No space left"), "{arguments:?}: {said}");
}

#[test]
fn what_cannot_be_printed() {
    let bench = Bench::new();
    let (line, map) = (bench.file("a.vcd", good_traffic(2.5e6).vcd()), bench.file("map.bin", [0; 256]));
    let (line, map) = (line.to_str().unwrap(), map.to_str().unwrap());
    for arguments in [
        &["decode", line][..],
        &["decode", "--json", line],
        &["decode", "--csv", line],
        &["decode", "--stats", line],
        &["explain", "--at", "40us", line],
        &["registers", map],
        &["timing", "tformat"],
        &["timing", "nikon"],
        &["profile", "--freq", "1000", "--steps", "9"],
        &["profile", "--freq", "1000", "--steps", "9", "--json"],
        &["profile", "--freq", "1000", "--steps", "9", "--shape", "trapezoid", "--accel", "1000", "--csv"],
        &["cnc", "--steps", "10"],
        &["cnc", "--scaling"],
        &["completions", "bash"],
        &["man"],
        &["help"],
        &["decode", "--help"],
        &["--version"],
    ] {
        printed(arguments);
    }
}

/// Through a link to the full device, so that the name is one of the test's own.
#[test]
fn what_cannot_be_written_is_named() {
    let bench = Bench::new();
    let (line, part) = (bench.file("a.vcd", good_traffic(2.5e6).vcd()), bench.file("a.nc", "G0 X1\n"));
    let (line, part) = (line.to_str().unwrap(), part.to_str().unwrap());
    let out = bench.path("out");
    std::os::unix::fs::symlink(FULL, &out).unwrap();
    let out = out.to_str().unwrap();
    for arguments in [
        &["decode", line, "-o", out][..],
        &["decode", line, "--svg", out],
        &["report", line, "-o", out],
        &["explain", "--at", "40us", line, "--svg", out],
        &["timing", "tformat", "--svg", out],
        &["profile", "--freq", "1000", "--steps", "9", "--svg", out],
        &["profile", "--gcode", part, "--vcd", out],
        &["profile", "--gcode", part, "--svg", out],
        &["cnc", "--steps", "10", "--vcd", out],
        &["cnc", "--steps", "10", "--pcapng", out],
        &["cnc", "--steps", "10", "--wav", out],
        &["cnc", "--steps", "10", "--svg", out],
    ] {
        let run = common::servowire(arguments);
        run.fails_with("No space left").fails_with(&format!("{out}: ")).fails_with("error: ");
    }
}
