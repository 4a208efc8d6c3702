//! Blocks one by one, in text and in binary records.

use super::{exchanges, hex_log};
use crate::common::{self, Bench};

#[test]
fn hex_lines_show_what_changed() {
    let bench = Bench::new();
    let run = bench.decode("log.txt", hex_log(&exchanges()), &["--protocol", "rtex", "--bytes", "--json"]);
    run.is_good();
    let events = run.json();
    assert_eq!(events.len(), 12);
    assert_eq!(events[0]["kind"], "cmd 5");
    assert_eq!(events[0]["fields"]["Command_Position"], 1_000);
    assert_eq!(events[1]["fields"]["Response_Data2"], 20_000);
    assert_eq!(events[1]["fields"]["Status_Flags"]["set"][0], "SERVO_READY");
    // The servo is switched on in the third command; everything that stays is left out.
    assert_eq!(events[4]["fields"]["SERVO_ON"], 1);
    assert_eq!(events[4]["fields"]["Command_Position"], 1_020);
    assert_eq!(events[4]["fields"].as_object().unwrap().len(), 3);
    assert!(events[5]["fields"].get("Response_Data2").is_none());
}

#[test]
fn binary_records_say_the_same() {
    let bench = Bench::new();
    let all = exchanges();
    let binary: Vec<u8> = all.iter().flat_map(|(c, r)| [*c, *r].concat()).collect();
    let options = |size: &'static str| ["--protocol", "rtex", "--record-size", size, "--json"];
    let fields = |run: &common::Run| run.json().iter().map(|e| e["fields"].clone()).collect::<Vec<_>>();
    let text = bench.decode("log.txt", hex_log(&all), &["--protocol", "rtex", "--bytes", "--json"]);
    for size in ["16", "32"] {
        let run = bench.decode("log.bin", &binary, &options(size));
        assert_eq!(fields(run.is_good()), fields(&text));
    }
    bench.decode("cut.bin", &binary[..40], &options("16")).fails_with("the last record has 8 of 16 bytes");
}

#[test]
fn one_drive_of_many() {
    let bench = Bench::new();
    let mut both = exchanges();
    // Another drive, far away, in between.
    for (k, (mut command, mut response)) in exchanges().into_iter().enumerate() {
        (command[0], response[0], response[7]) = (command[0] ^ 1, response[0] ^ 1, 0x40);
        both.insert(2 * k + 1, (command, response));
    }
    let options = ["--protocol", "rtex", "--bytes", "--mac-id", "5", "--stats"];
    let run = bench.decode("log.txt", hex_log(&both), &options);
    assert!(run.is_good().out.contains("6 requests, 6 answers"), "{}", run.out);
    let run = bench.decode("log.txt", hex_log(&both), &["--protocol", "rtex", "--bytes", "--mac-id", "5", "--json"]);
    let positions: Vec<_> = run.json().iter().filter_map(|e| e["position"]["counts"].as_i64()).collect();
    assert_eq!(positions, [990, 1_000, 1_010, 1_020, 1_030, 1_040]);
}

#[test]
fn faults_and_notes() {
    let bench = Bench::new();
    let options = ["--protocol", "rtex", "--bytes", "--json"];
    let run = bench.decode("log.txt", "45507000000000000000000000000000\n4520800000\n", &options);
    assert_eq!(run.verdicts(), ["cyclic_code", "truncated"]);
    assert_eq!(run.code, 1);
    let run = bench.decode("log.txt", "00000000000000000000000000000000\n45208300000000000000000000000000\n", &options);
    let notes: Vec<_> = run.json().iter().map(|e| e["fields"]["note"].as_str().unwrap().to_owned()).collect();
    assert!(notes[0].contains("a NOP does not switch the servo off"), "{notes:?}");
    assert!(notes[1].contains("byte 2 has reserved bits 0x03 set"), "{notes:?}");
    // A counter that stands still is normal (two communications an update); one that skips is not.
    let stands = "25200000000000000000000000000000\n25200000000000000000000000000000\n";
    let run = bench.decode("log.txt", format!("{stands}65200000000000000000000000000000\n"), &options);
    let counters: Vec<_> = run.json().iter().map(|e| e["fields"].get("Update_Counter").is_some()).collect();
    assert_eq!(counters, [false, false, true]);
    bench.decode("a.vcd", common::good_traffic(2.5e6).vcd(), &["--protocol", "rtex"]).fails_with("--record-size");
}

/// One wrong digit costs one line.
#[test]
fn a_spoilt_line() {
    let bench = Bench::new();
    let text = hex_log(&exchanges()).replacen("4520", "45g0", 2);
    let spoilt = text.lines().filter(|line| line.contains('g')).count();
    assert!(spoilt > 0);
    let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!((run.json().len(), run.verdicts().iter().filter(|v| **v == "hex").count()), (12, spoilt));
}

/// The first line may be the spoilt one, with the protocol named or not.
#[test]
fn a_log_that_begins_with_a_spoilt_line() {
    let bench = Bench::new();
    let text = hex_log(&exchanges()).split_once('\n').unwrap().1.to_owned();
    let text = text.replacen(text.chars().nth(7).unwrap(), "g", 1);
    assert!(text.lines().next().unwrap().contains('g'));
    for options in [&["--protocol", "rtex", "--bytes", "--json"][..], &["--json"]] {
        let run = bench.decode("log.txt", &text, options);
        assert_eq!((run.code, run.json().len()), (1, 12), "{options:?}: {}", run.err);
        assert_eq!(run.verdicts().iter().filter(|v| **v == "hex").count(), 1);
    }
}

/// A line that is a byte too short or too long costs that line: nothing is said of the order of the others.
#[test]
fn a_line_of_another_length() {
    let bench = Bench::new();
    let text = hex_log(&exchanges());
    let line = text.lines().nth(3).unwrap();
    for (other, refused) in [(format!("{line}00"), 1), (line[2..].to_owned(), 1), (line[..2].to_owned(), 1)] {
        let run = bench.decode("log.txt", text.replacen(line, &other, 1), &["--protocol", "rtex", "--bytes", "--json"]);
        let truncated = run.verdicts().iter().filter(|verdict| **verdict == "truncated").count();
        assert_eq!((run.code, truncated), (1, refused), "{other}");
        assert!(!run.err.contains("looks like") && !run.err.contains("shifts"), "{other}: {}", run.err);
    }
}
