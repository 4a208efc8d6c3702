//! No command writes over what it reads, or twice into one file.

use std::fs;
use std::path::PathBuf;

use crate::common::{Bench, Run, servowire};

#[track_caller]
fn refused(run: &Run, sentence: &str) {
    assert_eq!(run.code, 2, "{}", run.err);
    assert!(run.err.contains(sentence), "{sentence:?} not in {:?}", run.err);
}

/// A part program under its name, a hard link and a symbolic one.
fn program(bench: &Bench) -> Vec<PathBuf> {
    let (file, hard, soft) = (bench.file("a.nc", "G0 X1\n"), bench.path("hard.nc"), bench.path("soft.nc"));
    fs::hard_link(&file, &hard).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink(&file, &soft).unwrap();
    [file, hard, soft].into_iter().filter(|path| path.exists()).collect()
}

#[test]
#[cfg_attr(windows, ignore = "hard links are not recognised there")]
fn a_part_program_is_not_overwritten() {
    let bench = Bench::new();
    let names = program(&bench);
    for name in names.iter().map(|path| path.to_str().unwrap()) {
        for call in ["profile --vcd", "profile --svg", "cnc --vcd", "cnc --pcapng", "cnc --svg", "cnc --wav"] {
            let (command, option) = call.split_once(' ').unwrap();
            let run = servowire(&[command, "--gcode", names[0].to_str().unwrap(), option, name]);
            refused(&run, &format!("{option} would overwrite the part program {name}"));
            assert_eq!(fs::read_to_string(&names[0]).unwrap(), "G0 X1\n", "{call}");
        }
    }
}

#[test]
fn a_capture_and_a_backup_are_not_overwritten() {
    let bench = Bench::new();
    let file = bench.file("a.vcd", "as it was");
    let path = file.to_str().unwrap();
    for (call, want) in [
        (&["decode", path, "--svg", path][..], "--svg would overwrite the capture"),
        (&["report", path, "-o", path], "--output would overwrite the capture"),
        (&["explain", path, "--at", "1us", "--svg", path], "--svg would overwrite the capture"),
        (
            &["talk", "--port", "none", "--log", path, "eeprom", "restore", "--overwrite-eeprom", path],
            "--log would overwrite the backup",
        ),
    ] {
        refused(&servowire(call), want);
        assert_eq!(fs::read_to_string(&file).unwrap(), "as it was", "{call:?}");
    }
}

/// A capture that a shell opened is the same file.
#[test]
#[cfg(unix)]
fn a_capture_at_the_standard_input_is_not_overwritten() {
    let bench = Bench::new();
    let file = bench.file("a.vcd", "as it was");
    for more in [&["-"][..], &[]] {
        let mut call = std::process::Command::new(env!("CARGO_BIN_EXE_servowire"));
        call.arg("decode").args(more).arg("-o").arg(&file).stdin(fs::File::open(&file).unwrap());
        let output = call.output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert_eq!(fs::read_to_string(&file).unwrap(), "as it was");
    }
}

#[test]
fn two_outputs_are_two_files() {
    let bench = Bench::new();
    let (input, new) = (bench.file("a.vcd", ""), bench.path("new"));
    let (input, new) = (input.to_str().unwrap(), new.to_str().unwrap());
    let around = bench.path(".").join("new");
    let around = around.to_str().unwrap();
    for (call, want) in [
        (&["cnc", "--vcd", new, "--pcapng", around][..], "--vcd and --pcapng would both write"),
        (&["cnc", "--svg", new, "--wav", new], "--svg and --wav would both write"),
        (&["decode", input, "--svg", new, "--vcd", around], "--vcd and --svg would both write"),
        (&["talk", "--port", "none", "--log", new, "watch", "--csv", new], "--log and --csv would both write"),
        (&["talk", "--port", "none", "--log", new, "eeprom", "backup", new], "--log and the backup would both write"),
    ] {
        refused(&servowire(call), want);
        assert!(!bench.path("new").exists(), "{call:?}");
    }
}

/// Neither a device nor a link to what is not there yet is mistaken.
#[test]
#[cfg(unix)]
fn devices_and_links_to_nothing() {
    let bench = Bench::new();
    let (new, link) = (bench.path("new"), bench.path("link"));
    std::os::unix::fs::symlink("new", &link).unwrap();
    let run = servowire(&["cnc", "--vcd", link.to_str().unwrap(), "--pcapng", new.to_str().unwrap()]);
    refused(&run, "--vcd and --pcapng would both write");
    servowire(&["cnc", "--steps", "100", "--vcd", "/dev/null", "--pcapng", "/dev/null"]).is_good();
}

/// The text goes to the standard output, and drawings and recordings into files.
#[test]
fn a_dash_is_no_file() {
    let bench = Bench::new();
    let program = bench.file("a.nc", "G0 X1\n");
    let program = program.to_str().unwrap();
    for call in [
        &["profile", "--gcode", program, "--vcd", "-"][..],
        &["profile", "--freq", "1k", "--steps", "9", "--svg", "-"],
        &["cnc", "--pcapng", "-"],
        &["cnc", "--scaling", "--svg", "-"],
        &["decode", program, "-o", "-"],
        &["report", program, "-o", "-"],
        &["explain", program, "--at", "1us", "--svg", "-"],
        &["timing", "--svg", "-", "tformat"],
        &["talk", "--port", "none", "--log", "-", "read"],
    ] {
        refused(&servowire(call), "writes a file, and not the standard output: name one, or ./- for that name");
    }
}
