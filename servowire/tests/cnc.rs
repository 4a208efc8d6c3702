//! The reference machine, run as a user runs it.
#![allow(clippy::indexing_slicing, clippy::panic, clippy::std_instead_of_core, clippy::unwrap_used)]

use std::fs;
use std::process::{Command, Output};

use tempfile::TempDir;

fn servowire(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_servowire")).args(arguments).output().unwrap()
}

fn text(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// Asked, carried, on time, late, lost and position of each axis.
fn axes(report: &str) -> Vec<Vec<i64>> {
    let rows = report.lines().skip_while(|line| !line.contains("on time")).skip(1);
    let numbers = |line: &str| line.split_whitespace().map_while(|word| word.parse().ok()).skip(1).take(6).collect();
    rows.take_while(|line| line.ends_with("ns")).map(numbers).collect()
}

#[test]
fn a_full_turn_on_four_axes_loses_nothing() {
    let output = servowire(&["cnc"]);
    assert!(output.status.success());
    let report = text(&output);
    assert_eq!(axes(&report), vec![vec![51_200, 51_200, 51_200, 0, 0, 51_200]; 4], "{report}");
    for line in ["first cycle after 46.24 ms", "fits 4000 ns", "DISCOVERY 10, PARAM 10, DELAY_REQ 16, SYNC 1024"] {
        assert!(report.contains(line), "{report}");
    }
}

#[test]
fn the_published_generator_loses_steps_and_the_exit_code_says_so() {
    let output = servowire(&["cnc", "--published-sync0"]);
    assert_eq!(output.status.code(), Some(1));
    for axis in axes(&text(&output)) {
        let [asked, carried, on_time, late, lost, _] = axis[..] else { panic!("{axis:?}") };
        assert_eq!((asked, carried), (51_200, on_time + late + lost));
        assert!((2..12).contains(&(100 * (late + lost) / asked)), "{late} late, {lost} lost");
    }
}

#[test]
fn any_speed_and_latency_is_lossless() {
    for arguments in [["--freq", "241000,187000", "--latency", "0"], ["--freq", "94570,229000", "--latency", "590"]] {
        let output = servowire(&[&["cnc", "--moves", "2", "--steps", "20000"], &arguments[..]].concat());
        for axis in axes(&text(&output)) {
            assert_eq!(axis, [40_000, 40_000, 40_000, 0, 0, 0], "{arguments:?}");
        }
    }
}

#[test]
fn bit_errors_cost_frames_and_no_step_that_a_good_frame_carried() {
    let run = |seed| servowire(&["cnc", "--bit-error-rate", "1e-5", "--cycles", "100000", "--seed", seed]);
    let (first, again, other) = (run("3"), run("3"), run("4"));
    assert_eq!(text(&first), text(&again));
    assert_ne!(text(&first), text(&other));
    assert!(first.status.success());
    for axis in axes(&text(&first)) {
        let [asked, carried, on_time, late, lost, _] = axis[..] else { panic!("{axis:?}") };
        assert!(carried < asked && (late, lost) == (0, 0));
        // The last words may still be on their way.
        assert!(carried - on_time <= 2);
    }
}

#[test]
fn a_cable_that_is_pulled_is_noticed_and_the_rest_goes_on() {
    let output = servowire(&["cnc", "--unplug", "3@10000"]);
    let report = text(&output);
    assert!(report.contains("cycle 10000: the cable in front of device 3 is pulled"), "{report}");
    assert!(report.contains("the line has changed: device 2 does not fit"), "{report}");
    let positions: Vec<i64> = axes(&report).iter().map(|axis| axis[5]).collect();
    assert!(matches!(positions[..], [51_200, 51_200, c, d] if c == d && c < 10_000), "{positions:?}");
}

#[test]
fn what_is_recorded_is_read_back() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (pcapng, vcd, svg, wav) = (path("m.pcapng"), path("m.vcd"), path("m.svg"), path("m.wav"));
    let record = ["--pcapng", &pcapng, "--vcd", &vcd, "--svg", &svg, "--wav", &wav];
    let output = servowire(&[&["cnc", "--dance", "--record-cycles", "1000"], &record[..]].concat());
    assert!(output.status.success());

    let decoded = servowire(&["decode", &pcapng]);
    assert!(decoded.status.success());
    let lines = text(&decoded);
    // Answers share the line of their request.
    let count = |kind: &str| lines.lines().filter(|line| line.contains(kind)).count();
    assert_eq!((count("DISCOVERY"), count("PARAM"), count("DELAY_REQ"), count("SYNC")), (10, 10, 16, 1024));
    assert_eq!((count("master"), count("device")), (1000, 4000 + 10), "devices counts in DISCOVERY too");

    let trace = fs::read_to_string(&vcd).unwrap();
    assert!(trace.contains("$var wire 1") && trace.contains("sDISCOVERY"));
    let times: Vec<u64> = trace.lines().filter_map(|line| line.strip_prefix('#')?.parse().ok()).collect();
    assert!(times.windows(2).all(|pair| pair[0] < pair[1]));
    assert!(fs::read_to_string(&svg).unwrap().contains("</svg>"));
    // Some seconds of sound at 44.1 kHz, and not silence.
    let sound = fs::read(&wav).unwrap();
    assert!(sound.len() > 2 * 44_100 && sound.iter().skip(44).any(|byte| *byte != 0));
}

#[test]
fn a_damaged_network_capture_is_refused_where_it_breaks() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("m.pcapng");
    let name = path.to_str().unwrap();
    assert!(servowire(&["cnc", "--steps", "100", "--record-cycles", "10", "--pcapng", name]).status.success());
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 7]).unwrap();
    let cut = servowire(&["decode", name]);
    assert_eq!(cut.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&cut.stderr).contains("behind packet"), "{cut:?}");
    // A flipped bit in the last frame.
    let mut flipped = whole;
    let at = flipped.len() - 30;
    flipped[at] ^= 1;
    fs::write(&path, &flipped).unwrap();
    let refused = servowire(&["decode", name]);
    assert_eq!(refused.status.code(), Some(1));
}

#[test]
fn wrong_use_is_explained() {
    for (arguments, word) in [
        (["--unplug", "9@1"], "device from 1 to 4"),
        (["--bit-error-rate", "2"], "probability"),
        (["--freq", "300000"], "error"),
        (["--devices", "5"], "1..=4"),
    ] {
        let output = servowire(&[&["cnc"], &arguments[..]].concat());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(word), "{arguments:?}");
    }
}
