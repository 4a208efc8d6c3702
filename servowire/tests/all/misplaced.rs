//! What has no use for what is asked is said, and nothing is done in its place.

use std::process::{Command, Stdio};

use crate::common::{self, Bench, good_traffic};

#[test]
fn options_that_a_capture_has_no_use_for() {
    let bench = Bench::new();
    let line = bench.file("a.vcd", good_traffic(2.5e6).vcd());
    for (options, want) in [
        (&["--mac-id", "3"][..], "a.vcd: --mac-id is for RTEX blocks in logs of bytes"),
        (&["--block-size", "16"], "--block-size is for RTEX"),
        (&["--period", "500us", "--gear", "8/1"], "--period is for RTEX"),
        (&["--fcs", "yes"], "--fcs is for captures of a network"),
        (&["--threshold", "1.5"], "a.vcd: --threshold is for voltages"),
        (&["--unit-size", "2"], "a.vcd: --unit-size is for raw samples"),
        (&["--rate", "24M"], "a.vcd: the file has times of its own"),
        (&["--rate", "24M", "--format", "vcd"], "a.vcd: --rate is for raw samples"),
        (&["--record-size", "9", "--format", "vcd"], "a.vcd: --record-size is for binary records"),
        (&["--tx", "0", "--rx", "0"], "--tx and --rx are one channel: if it has both, say --channel 0"),
    ] {
        common::decode(&line, options).fails_with(want);
    }
    let log = bench.file("log.txt", "1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n");
    common::decode(&log, &["--bytes"]).is_good();
    for (options, want) in [
        (&["--channel", "3"][..], "--channel is for captures of levels"),
        (&["--tx", "a", "--rx", "b"], "--tx is for captures of levels"),
        (&["--polarity", "inverted"], "--polarity is for captures of levels"),
        (&["--threshold", "1.5"], "--threshold is for voltages"),
        (&["--unit-size", "1"], "--unit-size is for raw samples"),
        (&["--protocol", "tformat", "--mac-id", "3"], "--mac-id is for RTEX"),
    ] {
        common::decode(&log, &[&["--bytes"], options].concat()).fails_with(want);
    }
    let table = bench.file("a.csv", "Time [s],Channel 0\n0.0,1\n0.1,0\n");
    common::decode(&table, &["--threshold", "1.5"]).fails_with("a.csv, line 1: --threshold is for voltages");
}

#[test]
fn options_that_a_move_has_no_use_for() {
    let bench = Bench::new();
    let part = bench.file("a.nc", "G0 X1\n");
    let part = part.to_str().unwrap();
    let ramp = ["--freq", "1000", "--steps", "9"];
    let refused = |arguments: &[&str]| {
        let run = common::servowire(arguments);
        assert!(run.code == 2 && run.out.is_empty() && run.err.starts_with("error: "), "{arguments:?}: {}", run.err);
    };
    for options in [
        &["--shape", "s-curve"][..],
        &["--steps", "7"],
        &["--tone", "cis"],
        &["--k", "2"],
        &["--compare", "--accel", "1000"],
        &["--init-sync", "5"],
        &["--arithmetic", "carried"],
    ] {
        refused(&[&["profile", "--gcode", part], options].concat());
    }
    for options in [
        &["--deviation", "5"][..],
        &["--steps-per-mm", "5"],
        &["--axis", "X:speed=5"],
        &["--block-delete"],
        &["--accel", "100", "--jerk", "0"],
    ] {
        refused(&[&["profile"], &ramp[..], options].concat());
    }
    for options in [&["--jerk", "100"][..], &["--init-sync", "5"], &["--arithmetic", "carried"]] {
        refused(&[&["profile", "--shape", "trapezoid", "--accel", "100"], &ramp[..], options].concat());
    }
    for options in [&["--steps", "5"][..], &["--moves", "3"], &["--k", "3"], &["--freq", "1000,2000"], &["--scaling"]] {
        refused(&[&["cnc", "--gcode", part], options].concat());
    }
    let out = bench.path("out");
    for option in ["--vcd", "--pcapng", "--wav"] {
        refused(&["cnc", "--scaling", option, out.to_str().unwrap()]);
    }
    refused(&["cnc", "--record-cycles", "5"]);
    for options in [
        &["--dance", "--steps", "5"][..],
        &["--dance", "--freq", "1000"],
        &["--deviation", "5"],
        &["--scaling", "--axis", "X:speed=5"],
    ] {
        refused(&[&["cnc"], options].concat());
    }
}

/// A file that cannot be opened is named in the same words, whatever it was for.
#[test]
fn a_file_that_is_not_there() {
    let bench = Bench::new();
    let (nowhere, folder) = (bench.path("nowhere"), bench.path(""));
    for (file, want) in [(&nowhere, "nowhere: cannot be opened: "), (&folder, ": is a folder: name a file in it")] {
        let file = file.to_str().unwrap();
        for arguments in [&["registers"][..], &["profile", "--gcode"], &["cnc", "--gcode"], &["decode"]] {
            let run = common::servowire(&[arguments, &[file]].concat());
            assert!(run.code != 0 && run.out.is_empty() && run.err.contains(want), "{arguments:?}: {}", run.err);
        }
    }
}

/// A part program is read twice, which a pipe cannot be: its second reading is empty.
#[cfg(unix)]
#[test]
fn a_part_program_comes_from_no_pipe() {
    for command in ["profile", "cnc"] {
        for (file, name) in [("/dev/stdin", "/dev/stdin"), ("-", "standard input")] {
            let mut run = Command::new(env!("CARGO_BIN_EXE_servowire"));
            let run = run.args([command, "--gcode", file]).stdin(Stdio::piped()).output().unwrap();
            let said = String::from_utf8_lossy(&run.stderr);
            let want = format!("{name}: cannot be read twice");
            assert!(run.status.code() == Some(2) && said.contains(&want), "{said}");
        }
    }
}

/// A file that is no register map is not shown as one.
#[test]
fn a_text_is_no_register_map() {
    let bench = Bench::new();
    let hex = "00 11 22 33 44 55 66 77 88 99 AA BB CC DD EE FF\n".repeat(8);
    for (text, code) in [
        (hex.clone(), 0),
        (good_traffic(2.5e6).vcd(), 2),
        (format!("{hex}0"), 2),
        (hex.replace("00 11", "0000: 00 11"), 2),
        (hex.replace(' ', ", 0x"), 2),
    ] {
        let file = bench.file("map", &text);
        let run = common::servowire(&["registers", file.to_str().unwrap()]);
        let told = run.err.contains("text that is not pairs of hex digits");
        assert!(run.code == code && told == (code == 2), "{text}: {}", run.err);
    }
}

/// The bundled captures are not shown for a file of the user's that is empty, and not without a word for such a pipe.
#[test]
fn a_standard_input_without_content() {
    let bench = Bench::new();
    let empty = std::fs::File::open(bench.file("empty.vcd", "")).unwrap();
    let decode = |input: Stdio| {
        let output = Command::new(env!("CARGO_BIN_EXE_servowire")).arg("decode").stdin(input).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap(), output.stdout.is_empty())
    };
    let note = "standard input was empty: these are the bundled captures\n";
    let (code, said, nothing) = decode(Stdio::null());
    assert!(code == Some(0) && !said.contains(note) && !nothing, "{said}");
    if cfg!(unix) {
        let (code, said, nothing) = decode(empty.into());
        assert!(code == Some(1) && said == "error: standard input: the file is empty\n" && nothing, "{said}");
        let (code, said, nothing) = decode(Stdio::piped());
        assert!(code == Some(0) && said.ends_with(note) && !nothing, "{said}");
    }
}

/// A sentence about a file names it once.
#[test]
fn a_report_names_its_capture_once() {
    let bench = Bench::new();
    let text = good_traffic(2.5e6).vcd();
    let cut = bench.file("cut.vcd", &text[..=text.rfind("1!").unwrap()]);
    let page = bench.path("page.html");
    let run = common::servowire(&["report", cut.to_str().unwrap(), "-o", page.to_str().unwrap()]);
    run.fails_with("the file ends in the middle of a value change");
    assert!(run.err.lines().all(|line| line.matches("cut.vcd").count() == 1), "{}", run.err);
}

#[test]
fn a_part_program_that_goes_on_behind_its_end() {
    let bench = Bench::new();
    let part = bench.file("a.nc", "G0 X1\nM30\n\nG0 X9\nno G-code\n");
    let run = common::servowire(&["profile", "--gcode", part.to_str().unwrap()]);
    assert!(run.is_good().out.contains("axis X  80 steps, at 80 in the end"), "{}", run.out);
    assert!(
        run.err.ends_with("a.nc, line 4: not run, nor is what follows: the program ends in line 2\n"),
        "{}",
        run.err
    );
}
