//! Text, JSON Lines, the VCD beside, statistics, and what happens when nobody reads on.

use std::fmt::Write as _;
use std::process::{Command, Stdio};

use crate::common;
use crate::common::{Bench, GOOD_FRAMES, Wave, good_traffic, id3};
use vcd::{Command as Vcd, Parser};

#[test]
fn text_has_a_transaction_a_line() {
    let bench = Bench::new();
    let run = bench.decode("a.vcd", good_traffic(2.5e6).vcd(), &[]);
    run.is_good();
    // What is longer than a hundred columns goes on below: that of the reset.
    let whole = run.out.replace("\n                  ", "");
    let lines: Vec<&str> = whole.lines().collect();
    assert_eq!((lines.len(), run.out.lines().count()), (12, 13), "{}", run.out);
    assert!(lines.iter().all(|line| line.contains("  <>  ID ") && line.ends_with("  +3.00 us  ok")), "{}", run.out);
    assert!(lines[1].starts_with("     93.000 us  <>  ID 3  SF 0  "), "{}", lines[1]);
    assert!(lines[1].contains("ABS 1000  ") && lines[1].contains("  7.000119 turns"), "{}", lines[1]);
    // Fields of one kind stand below each other.
    assert!(lines[3..7].iter().all(|line| line.find("ABM") == lines[3].find("ABM")), "{}", run.out);
    // The encoder ID is said once, with the first frame that has it.
    assert_eq!(run.out.matches("ENID 23").count(), 1, "{}", run.out);
}

#[test]
fn text_of_frames_that_do_not_pair() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0).exchange(&[0x1a], &id3(1, 0, 0)).send(&id3(2, 0, 0)).idle_us(40.0);
    wave.send(&[0x1a]).idle_us(40.0).exchange(&[0x92], &id3(3, 0, 0)).send(&[0x9a]).idle_us(100.0);
    let run = bench.decode("a.vcd", wave.vcd(), &[]);
    assert_eq!(run.code, 1);
    let starts: Vec<&str> = run
        .out
        .lines()
        .filter(|line| line.contains(" us  ") && !line.starts_with("               "))
        .map(|line| line[16..].split("  ").next().unwrap())
        .collect();
    let joined = run.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert_eq!(starts, ["<>", "<", "<>", "<>", ">"], "{}", run.out);
    assert!(
        joined.contains("REFUSED no_response: no answer within 20.0 us (only the request is on the line"),
        "{}",
        run.out
    );
    assert!(joined.contains("REFUSED rejected: the encoder refused the request"), "{}", run.out);
    assert!(joined.contains("REFUSED parity in CF bit 8 at "), "{}", run.out);
}

/// The VCD is read back: the same line, and beside it the strings at the times of the frames.
#[test]
fn the_vcd_beside() {
    let bench = Bench::new();
    let (wave, out) = (good_traffic(2.5e6), bench.path("out.vcd"));
    let run = bench.decode("a.vcd", wave.vcd(), &["--json", "--vcd", out.to_str().unwrap()]);
    run.is_good();
    let text = std::fs::read(&out).unwrap();
    let mut parser = Parser::new(text.as_slice());
    let header = parser.parse_header().unwrap();
    let code = |path: &[&str]| header.find_var(path).unwrap().code;
    let line = code(&["capture", "line"]);
    let (frame, abs) = (code(&["decoded_line", "frame"]), code(&["decoded_line", "ABS"]));
    let (mut now, mut edges, mut frames, mut positions) = (0, Vec::new(), Vec::new(), Vec::new());
    for command in parser {
        match command.unwrap() {
            Vcd::Timestamp(time) => {
                assert!(time > now || now == 0);
                now = time;
            }
            Vcd::ChangeScalar(id, value) if id == line => edges.push((now as i64 * 1000, value == vcd::Value::V1)),
            Vcd::ChangeString(id, text) if id == frame => frames.push((now, text)),
            Vcd::ChangeString(id, text) if id == abs => positions.push((now, text)),
            _ => {}
        }
    }
    assert_eq!(edges, wave.edges);
    let shown = |want: &[(u64, &str)], got: &[(u64, String)]| {
        assert_eq!(got.iter().take(want.len()).map(|(t, s)| (*t, s.as_str())).collect::<Vec<_>>(), want);
    };
    shown(&[(0, "-"), (30_000, "request_ID_2"), (34_000, "-"), (37_000, "answer_ID_2"), (53_000, "-")], &frames);
    shown(&[(0, "-"), (100_000, "1000"), (144_000, "-")], &positions);
    // What was written can be decoded again.
    let again = common::decode(&out, &["--json"]);
    again.is_good();
    assert_eq!(again.json().len(), run.json().len());
    let file = out.to_str().unwrap();
    assert_eq!(common::decode(&out, &["--vcd", file]).code, 2, "the capture is not overwritten");
    assert_eq!(std::fs::read(&out).unwrap(), text);
    let nowhere = bench.path("none").join("out.vcd");
    bench.decode("a.vcd", wave.vcd(), &["--vcd", nowhere.to_str().unwrap()]).fails_with("cannot be created: ");
    let hex = bench.decode("a.txt", "1A\n", &["--bytes", "--vcd", out.to_str().unwrap()]);
    hex.fails_with("there are no levels in it for a VCD");
}

#[test]
fn statistics() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..10_u32 {
        // 51 us and a pause of 40 us, twice 42 us; one jump forth and one back.
        wave.exchange(&[0x1a], &id3(if k == 7 { 900_000 } else { 100 * k }, 0, 0)).idle_us(if k % 4 == 1 {
            2.0
        } else {
            0.0
        });
    }
    let mut bad = id3(1100, 0, 0);
    bad[5] ^= 1;
    wave.exchange(&[0x1a], &bad).send(&[0x1a]).idle_us(100.0);
    let file = bench.file("a.vcd", wave.vcd());
    let run = common::decode(&file, &["--stats", "--jump", "1000"]);
    assert_eq!(run.code, 1);
    for line in [
        "  frames        12 requests, 11 answers, 0 others",
        "  verdicts      22 ok, 1 refused, 1 answers missing",
        "    crc               1",
        "    no_response       1",
        "  cycle         min 91.000 us, mean 91.545 us, max 93.000 us, jitter 2.000 us peak to peak, 0.934 us rms",
        "  answer delay  min 3.000 us, mean 3.000 us, max 3.000 us, jitter 0.000 us peak to peak, 0.000 us rms",
        "  largest move  899400 counts",
        "  jumps         2 of more than 1000 counts",
        "600 to 900000: +899400",
        "900000 to 800: -899200",
    ] {
        assert!(run.out.contains(line), "{line:?} not in\n{}", run.out);
    }
    let json = common::decode(&file, &["--stats", "--json", "--jump", "1000"]).json();
    assert_eq!(json.len(), 1);
    assert_eq!((&json[0]["refused"]["crc"], &json[0]["jumps"]), (&1.into(), &2.into()));
    assert_eq!(json[0]["cycle"]["jitter_ps"], 2_000_000);
}

/// Runs the program with nobody who reads what it prints: it ends well, and this is what it says of it.
#[track_caller]
fn unread(arguments: &[&str]) -> String {
    let mut child = Command::new(env!("CARGO_BIN_EXE_servowire"))
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments:?}: {said}");
    said
}

#[test]
fn a_closed_pipe_ends_every_command_quietly() {
    let bench = Bench::new();
    let mut wave = good_traffic(2.5e6);
    for k in 0..4000 {
        wave.exchange(&[0x1a], &id3(k, 0, 0));
    }
    let (file, map) = (bench.file("long.vcd", wave.vcd()), bench.file("map.bin", [0; 256]));
    let (file, map) = (file.to_str().unwrap(), map.to_str().unwrap());
    for form in ["--json", "--csv", "--stats", "--errors"] {
        // What was found is said all the same.
        assert_eq!(unread(&["decode", form, file]).lines().count(), 1, "{form}");
    }
    for arguments in
        [&["timing", "tformat"][..], &["timing", "nikon"], &["registers", map], &["completions", "bash"], &["man"]]
    {
        assert_eq!(unread(arguments), "", "{arguments:?}");
    }
}

/// Two lines in the first file, one in the second, none in the log: what is said of one is not said of the next.
#[test]
fn files_do_not_mix() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let mut both = "$timescale 1 ps $end $var wire 1 ! A $end $var wire 1 % B $end $enddefinitions $end\n".to_owned();
    let second = wave.edges.iter().map(|(time, level)| (time + 30_000_000, *level, '%'));
    let mut edges: Vec<_> = wave.edges.iter().map(|(time, level)| (*time, *level, '!')).chain(second).collect();
    edges.sort_by_key(|(time, ..)| *time);
    for (time, level, code) in edges {
        writeln!(both, "#{time} {}{code}", u8::from(level)).unwrap();
    }
    let files = [
        bench.file("two.vcd", both),
        bench.file("one.vcd", wave.vcd()),
        bench.file("log.txt", "1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n"),
    ];
    let [two, one, log] = files.each_ref().map(|file| file.to_str().unwrap());
    let run = common::servowire(&["decode", "--json", two, one, log]);
    run.is_good();
    let channels = |file: &str| -> Vec<String> {
        let events = run.json().into_iter().filter(|event| event["file"] == file);
        let mut names: Vec<String> =
            events.map(|event| event["channel"].as_str().unwrap_or("none").to_owned()).collect();
        names.sort();
        names.dedup();
        names
    };
    assert_eq!([channels(two), channels(one), channels(log)], [vec!["A", "B"], vec!["line"], vec!["none"]]);
    let table = common::servowire(&["decode", "--csv", two, one, log]);
    let rows: Vec<Vec<&str>> = table.out.lines().skip(1).map(|row| row.split(',').take(3).collect()).collect();
    let of = |file: &str, channel: &str| rows.iter().filter(|row| row[0] == file && row[1] == channel).count();
    assert_eq!([of(two, "A"), of(two, "B"), of(one, "line"), of(log, "")], [GOOD_FRAMES, GOOD_FRAMES, GOOD_FRAMES, 2]);
    // Each line has its own figures, and can be taken alone.
    let figures = common::decode(&files[0], &["--stats"]).out;
    assert_eq!(figures.matches("  frames        12 requests, 12 answers, 0 others").count(), 2, "{figures}");
    assert!(!figures.contains("min -") && figures.contains("\n  A\n") && figures.contains("\n  B\n"), "{figures}");
    let own = common::decode(&files[0], &["--json", "--encoder", "B"]);
    assert!(own.json().len() == GOOD_FRAMES && own.json().iter().all(|event| event["channel"] == "B"), "{}", own.out);
    // In the text a line has a name where there are two; the encoder ID is said anew in each file.
    let text = common::servowire(&["decode", two, one, log]);
    let parts: Vec<&str> = text.out.split("\n\n").collect();
    assert!(parts[0].contains("us  A  <>") && parts[0].contains("us  B  <>") && parts[1].contains("us  <>"));
    assert!(parts[..3].iter().all(|part| part.contains("ENID 23")), "{}", text.out);
}

#[test]
fn no_progress_bar_without_a_terminal() {
    let bench = Bench::new();
    let mut wave = good_traffic(2.5e6);
    wave.idle_us(1_000_000.0);
    let run = bench.decode("long.raw", wave.raw(20e6, 0), &["--json", "--rate", "20M"]);
    run.is_good();
    assert_eq!(run.err.lines().count(), 1, "{}", run.err);
}

/// A piece of a capture by itself: the levels as they were, at their times, and it can be decoded again.
#[test]
fn a_piece_is_cut_out() {
    let bench = Bench::new();
    let (wave, out) = (good_traffic(2.5e6), bench.path("piece.vcd"));
    let to = out.to_str().unwrap();
    // The second to the fourth transaction; the line is high before.
    let run = bench.decode("a.vcd", wave.vcd(), &["--json", "--cut", "90us..360us", "-o", to]);
    run.is_good();
    assert_eq!(run.json().len(), 6, "{}", run.out);
    let again = common::decode(&out, &["--json", "--channel", "line"]);
    again.is_good();
    let times = |run: &common::Run| -> Vec<(i64, i64)> {
        let time = |event: &serde_json::Value, key: &str| event[key].as_i64().unwrap();
        run.json().iter().map(|event| (time(event, "start_ps"), time(event, "end_ps"))).collect()
    };
    assert_eq!(times(&again), times(&run));
    let text = std::fs::read_to_string(&out).unwrap();
    let stamps: Vec<u64> = text.lines().filter_map(|line| line.strip_prefix('#')?.parse().ok()).collect();
    assert_eq!((stamps[0], stamps.iter().all(|at| (90_000..360_000).contains(at))), (90_000, true));
    // Where nothing moves, the levels alone.
    bench.decode("a.vcd", wave.vcd(), &["--json", "--cut", "1us..2us", "-o", to]);
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.contains("#1000\n") && text.lines().filter(|line| line.starts_with('1')).count() == 1, "{text}");
    for wrong in ["2ms..1ms", "1ms", "1..2"] {
        assert_eq!(bench.decode("a.vcd", wave.vcd(), &["--cut", wrong, "-o", to]).code, 2, "{wrong}");
    }
}
