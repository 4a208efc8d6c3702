//! What comes live: pipes and files that grow.

use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

use crate::common;
use crate::common::{Bench, Wave, id3};

/// Longer than any line may take.
const LONG: Duration = Duration::from_secs(20);

/// A running program and the lines it prints.
struct Live {
    child: Child,
    lines: Receiver<String>,
}

impl Live {
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_servowire"))
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let (send, lines) = mpsc::channel();
        let out = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || out.lines().map_while(Result::ok).for_each(|line| drop(send.send(line))));
        Self { child, lines }
    }

    fn write(&mut self, bytes: &[u8]) {
        self.child.stdin.as_mut().unwrap().write_all(bytes).unwrap();
    }

    #[track_caller]
    fn shows(&self, words: &str) {
        let line = self.lines.recv_timeout(LONG).expect("nothing was shown");
        assert!(line.contains(words), "{line:?} instead of {words:?}");
    }

    /// The lines that are left when the input is closed.
    fn end(mut self) -> Vec<String> {
        drop(self.child.stdin.take());
        self.child.wait().unwrap();
        self.lines.iter().collect()
    }
}

/// `count` exchanges with positions from `from` on.
fn exchanges(from: u32, count: u32) -> Wave {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..count {
        wave.exchange(&[0x1a], &id3(from + k, 0, 0));
    }
    wave
}

#[test]
fn samples_from_a_pipe() {
    let mut live = Live::start(&["decode", "--rate", "20M", "--format", "packed", "-"]);
    // Whole bytes of eight samples.
    live.write(&exchanges(100, 4).packed(20e6));
    for k in 100..104 {
        live.shows(&format!("ABS {k} "));
    }
    // Half an exchange shows nothing; the other half completes it.
    let next = exchanges(500, 2).packed(20e6);
    live.write(&next[..60]);
    std::thread::sleep(Duration::from_millis(300));
    assert!(live.lines.try_recv().is_err());
    live.write(&next[60..]);
    live.shows("ABS 500 ");
    live.shows("ABS 501 ");
    assert_eq!(live.end(), Vec::<String>::new());
}

#[test]
fn a_vcd_from_a_pipe() {
    let mut live = Live::start(&["decode"]);
    let vcd = exchanges(7, 6).vcd();
    // Up to the middle of an exchange, of a line.
    let cut = vcd.len() * 3 / 4;
    live.write(&vcd.as_bytes()[..cut]);
    for k in 7..11 {
        live.shows(&format!("ABS {k} "));
    }
    live.write(&vcd.as_bytes()[cut..]);
    live.shows("ABS 11 ");
    live.shows("ABS 12 ");
    assert_eq!(live.end(), Vec::<String>::new());
}

#[test]
fn a_log_and_a_table_from_a_pipe() {
    let mut live = Live::start(&["decode", "--bytes", "--json", "-"]);
    live.write(b"1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n");
    live.shows("\"line\":1");
    live.shows("\"line\":2");
    live.write(b"1A\n");
    live.shows("\"line\":3");
    assert_eq!(live.end().len(), 1, "the request without an answer is said at the end");

    let mut live = Live::start(&["decode", "--format", "csv", "-"]);
    let table = exchanges(3, 4).saleae_csv();
    live.write(table.as_bytes());
    for k in 3..6 {
        live.shows(&format!("ABS {k} "));
    }
    assert_eq!(live.end().len(), 1);
}

/// Lines that keep coming, each before the program takes the input for paused, are shown long before they fill 4 KiB.
#[test]
fn a_log_that_comes_line_by_line() {
    let mut live = Live::start(&["decode", "--json", "-"]);
    let mut lines = ["1A\n", "1A 20 29 C0 3B 17 00 00 00 C8 37\n"].into_iter().cycle();
    let shown = (0..150).find_map(|_| {
        live.write(lines.next()?.as_bytes());
        live.lines.recv_timeout(Duration::from_millis(20)).ok()
    });
    assert!(shown.expect("nothing was shown").contains("\"line\":1"));
}

#[test]
fn a_file_that_grows() {
    let bench = Bench::new();
    let vcd = exchanges(40, 8).vcd();
    let (first, second) = vcd.split_at(vcd.len() / 2);
    let path = bench.file("grows.vcd", first);
    let mut live = Live::start(&["decode", "--follow", path.to_str().unwrap()]);
    for k in 40..43 {
        live.shows(&format!("ABS {k} "));
    }
    std::fs::OpenOptions::new().append(true).open(&path).unwrap().write_all(second.as_bytes()).unwrap();
    for k in 43..47 {
        live.shows(&format!("ABS {k} "));
    }
    live.child.kill().unwrap();
    live.child.wait().unwrap();
    // What is complete only at its end cannot be followed.
    let session = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/samples/hpm-uart.fst");
    common::servowire(&["decode", "--follow", session]).fails_with("cannot be followed while it grows");
    assert_eq!(common::servowire(&["decode", "--follow"]).code, 2);
}

/// Who says what comes is waited for; who does not gets the program's own captures, and is told so.
#[test]
fn a_pipe_that_is_silent_at_first() {
    let mut live = Live::start(&["decode", "--bytes", "--json"]);
    std::thread::sleep(Duration::from_millis(900));
    live.write(b"1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n");
    live.shows("\"file\":\"standard input\",\"line\":1");
    assert_eq!(live.end().len(), 1);

    let mut silent = std::process::Command::new(env!("CARGO_BIN_EXE_servowire"))
        .arg("decode")
        .stdin(std::process::Stdio::piped())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let open = silent.stdin.take();
    let said = silent.wait_with_output().unwrap();
    drop(open);
    assert!(said.status.success());
    let (out, err) = (String::from_utf8(said.stdout).unwrap(), String::from_utf8(said.stderr).unwrap());
    assert!(
        out.contains("captures/hpm-uart-readme.vcd") && err.contains("nothing has arrived on standard input"),
        "{err}"
    );
}

/// What describes a file needs one.
#[test]
fn options_without_a_file() {
    for options in [
        &["--rate", "24M"][..],
        &["--format", "vcd"],
        &["--unit-size", "2"],
        &["--channel", "x"],
        &["--tx", "a", "--rx", "b"],
        &["--bit-rate", "2.5M"],
        &["--polarity", "inverted"],
        &["--threshold", "1"],
        &["--block-size", "16"],
    ] {
        let run = common::servowire(&[&["decode"], options].concat());
        assert_eq!(run.code, 2, "{options:?}");
        assert!(run.err.contains("describes a capture: name its file"), "{}", run.err);
    }
}

/// Ctrl-C ends what follows a file; its figures are printed, and what is complete so far.
#[cfg(unix)]
#[test]
fn figures_of_what_is_followed() {
    let bench = Bench::new();
    for (options, want) in
        [(&["--stats"][..], "  frames        10 requests, 10 answers, 0 others"), (&["--csv"], "file,channel,")]
    {
        let path = bench.file("grows.vcd", exchanges(40, 10).vcd());
        let mut live = Live::start(&[&["decode", "--follow", path.to_str().unwrap()], options].concat());
        std::thread::sleep(Duration::from_millis(1500));
        let asked = Command::new("kill").args(["-INT", &live.child.id().to_string()]).status().unwrap();
        assert!(asked.success());
        assert_eq!(live.child.wait().unwrap().code(), Some(0), "{options:?}");
        let lines = live.end();
        assert!(lines.iter().any(|line| line.starts_with(want)), "{options:?}: {lines:?}");
    }
}

/// The first error is the last thing that is shown, also of what goes on.
#[test]
fn until_the_first_error() {
    let mut wave = exchanges(40, 6);
    let mut bad = id3(46, 0, 0);
    bad[5] ^= 1;
    wave.exchange(&[0x1a], &bad);
    for k in 47..60 {
        wave.exchange(&[0x1a], &id3(k, 0, 0));
    }
    let bench = Bench::new();
    let path = bench.file("grows.vcd", wave.vcd());
    let live = Live::start(&["decode", "--json", "--until", "error", "--follow", path.to_str().unwrap()]);
    let lines = live.end();
    assert_eq!(lines.len(), 14, "{lines:?}");
    assert!(lines[13].contains("\"verdict\":\"crc\""), "{}", lines[13]);
    let run = common::decode(&path, &["--stats", "--until", "error"]);
    assert_eq!(run.code, 1);
    assert!(run.out.contains("  verdicts      13 ok, 1 refused"), "{}", run.out);
    // A log of bytes too.
    let log = "1A\n1A 20 29 C0 3B 17 00 00 00 C8 36\n1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n";
    let run = bench.decode("log.txt", log, &["--json", "--until", "error"]);
    assert_eq!((run.code, run.out.lines().count()), (1, 2), "{}", run.out);
}

/// Figures while a capture comes in, of each encoder; also that nothing comes any more. The whole at the end.
#[test]
fn figures_while_it_comes() {
    let packed = exchanges(100, 40).packed(20e6);
    let options = ["decode", "--rate", "20M", "--format", "packed", "--stats", "--every", "200ms"];
    let mut live = Live::start(&[&options[..], &["-"]].concat());
    live.write(&packed);
    let line = live.lines.recv_timeout(LONG).expect("no figures");
    assert!(line.contains(" frames  no errors  cycle ") && !line.contains('\x1b'), "{line}");
    assert!(line.contains("  delay 3.000 us +- 0.000  ABM, ABS "), "{line}");
    let silent = live.lines.iter().find(|line| line.ends_with(" s  nothing"));
    assert!(silent.is_some(), "nobody says that nothing comes");
    live.write(&packed);
    let again = live.lines.iter().find(|line| line.contains("ABM, ABS 139 "));
    assert!(again.is_some(), "what comes after a pause is not shown");
    let lines = live.end();
    assert!(lines.iter().any(|line| line == "  frames        80 requests, 80 answers, 0 others"), "{lines:?}");

    let mut live = Live::start(&[&options[..], &["--json", "-"]].concat());
    live.write(&packed);
    let line: serde_json::Value = serde_json::from_str(&live.lines.recv_timeout(LONG).expect("no figures")).unwrap();
    assert!(line["at_s"].as_f64().unwrap() > 0.19 && line["over_s"].as_f64().unwrap() > 0.19, "{line}");
    assert!(line["last_positions"]["ABM, ABS"].is_u64() && line["refused"].as_object().unwrap().is_empty(), "{line}");
    let lines = live.end();
    let whole: serde_json::Value = serde_json::from_str(lines.last().unwrap()).unwrap();
    assert_eq!((whole["answers"].as_u64(), whole.get("at_s")), (Some(40), None));
}

/// Ctrl-C while nothing comes ends figures too, and prints those of the whole.
#[cfg(unix)]
#[test]
fn the_end_of_figures_while_nothing_comes() {
    let mut live = Live::start(&["decode", "--rate", "20M", "--format", "packed", "--stats", "--every", "100ms", "-"]);
    live.write(&exchanges(100, 40).packed(20e6));
    assert!(live.lines.iter().any(|line| line.ends_with(" s  nothing")));
    assert!(Command::new("kill").args(["-INT", &live.child.id().to_string()]).status().unwrap().success());
    assert_eq!(live.child.wait().unwrap().code(), Some(0));
    assert!(live.end().iter().any(|line| line == "  frames        40 requests, 40 answers, 0 others"));
}

/// Positions of the answers in what a VCD shows, and its first and last time in us.
fn shown(path: &std::path::Path) -> (Vec<u64>, f64, f64) {
    let text = std::fs::read_to_string(path).unwrap();
    let stamps: Vec<f64> =
        text.lines().filter_map(|line| line.strip_prefix('#')?.parse::<f64>().ok()).map(|ns| ns / 1e3).collect();
    let run = common::decode(path, &["--json"]);
    let events = run.json();
    let abs = |event: &serde_json::Value| event["fields"]["ABS"].as_u64();
    (events.iter().filter_map(abs).collect(), stamps[0], *stamps.last().unwrap())
}

/// Only the line around the errors is kept: of one, of two beside each other, and of one far away.
#[test]
fn a_ring_around_each_fault() {
    let damaged = |k: u32| {
        let mut bad = id3(k, 0, 0);
        bad[5] ^= 1;
        bad
    };
    let mut wave = exchanges(0, 100);
    for k in 100..400 {
        let answer = if [200, 202, 330].contains(&k) { damaged(k) } else { id3(k, 0, 0) };
        wave.exchange(&[0x1a], &answer);
    }
    let bench = Bench::new();
    let (path, out) = (bench.file("long.vcd", wave.vcd()), bench.path("faults.vcd"));
    let around = ["--around", "500us", "-o", out.to_str().unwrap(), "--json"];
    let run = common::decode(&path, &around);
    assert_eq!((run.code, run.json().len()), (1, 800), "everything is still shown");
    let (positions, from, _) = shown(&out);
    // An exchange takes 91 us: five before and after each.
    let want: Vec<u64> = (195..200).chain([201]).chain(203..208).chain(325..330).chain(331..336).collect();
    let near = |(got, want): (&u64, &u64)| got == want;
    assert!(positions.len() == want.len() && positions.iter().zip(&want).all(near), "{positions:?}");
    let first = run.json().iter().find(|event| event["verdict"] == "crc").unwrap()["start_ps"].as_f64().unwrap() / 1e6;
    assert!((first - 500.0 - from).abs() < 0.01, "{first} {from}");
    // Between the pieces the line is unknown, for those who look at it.
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.lines().any(|line| line == "x!"), "{}", &text[..text.len().min(2000)]);

    // Live, until the first error and so long after it.
    let live = Live::start(
        &[
            &["decode", "--follow", path.to_str().unwrap(), "--until", "error"][..],
            &["--around", "500us", "-o", out.to_str().unwrap(), "--json"],
        ]
        .concat(),
    );
    assert!(live.end().last().unwrap().contains("\"ok\""), "what comes after the fault is shown");
    let (positions, again, to) = shown(&out);
    assert!((again - from).abs() < 0.01 && positions.iter().all(|at| (195..208).contains(at)), "{positions:?}");
    // The second fault is in the piece of the first, and has its own time after it.
    assert!(to > first + 400.0 && to < first + 800.0, "{first} {to}");
    // Without an error there is nothing to keep.
    let quiet = bench.file("quiet.vcd", exchanges(0, 50).vcd());
    common::decode(&quiet, &around).is_good();
    assert!(!std::fs::read_to_string(&out).unwrap().contains("\n#"));
}
