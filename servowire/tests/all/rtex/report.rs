//! The service report: times, events, cycles, curves.

use std::fmt::Write as _;

use super::{exchanges, hex_log};
use crate::common::Bench;

/// A table with times, directions and axes: two drives, of which one alarms at 1.0 ms, and a command that is 20 us late.
fn table() -> String {
    let mut text = "time_us,direction,axis,data\n".to_owned();
    for (k, (command, response)) in exchanges().into_iter().enumerate() {
        for drive in [5_u8, 7] {
            let begins = 500 * k + if k == 3 { 20 } else { 0 };
            let (mut command, mut response) = (command, response);
            (command[0], response[0]) = (command[0] & 0xe0 | drive, response[0] & 0xe0 | drive);
            response[4..8].copy_from_slice(&(990 + 10 * k as i32 + i32::from(drive)).to_le_bytes());
            if drive == 7 && k >= 2 {
                response[2] = 0x20;
            }
            for (at, said, block) in [(begins, "command", command), (begins + 30, "response", response)] {
                writeln!(text, "{at},{said},{drive},{:032x}", u128::from_be_bytes(block)).unwrap();
            }
        }
    }
    text
}

#[test]
fn a_service_report_of_a_table() {
    let bench = Bench::new();
    let run = bench.decode("ring.csv", table(), &["--protocol", "rtex", "--stats", "--jump", "1000"]);
    assert_eq!(run.code, 4, "{}", run.err);
    assert!(run.err.ends_with("drive 7 reported an alarm\n"), "{}", run.err);
    for want in [
        "  address 5\n  frames        6 requests, 6 answers, 0 others\n",
        "  cycle         min 480.000 us, mean 500.000 us, max 520.000 us, jitter 40.000 us peak to peak",
        "  largest move  10 counts\n  jumps         0 of more than 1000 counts\n  events        3\n",
        "          1000.000 us  SERVO_ON 1\n",
        "          1030.000 us  SERVO_READY 0\n",
        "          1030.000 us  ALARM 1\n",
    ] {
        assert!(run.out.contains(want), "{want}\n{}", run.out);
    }
    let (five, seven) = run.out.split_once("  address 7").unwrap();
    assert!(!five.contains("ALARM") && seven.contains("ALARM"), "{}", run.out);
    // A row of a table stands alone: the last one has all its values.
    let run = bench.decode("ring.csv", table(), &["--protocol", "rtex", "--csv"]);
    let rows: Vec<Vec<&str>> = run.out.lines().map(|line| line.split(',').collect()).collect();
    let column = |name| rows[0].iter().position(|title| *title == name).unwrap();
    let last = rows.last().unwrap();
    let shown = ["start_us", "direction", "address", "position", "Response_Data2", "Response_Data3"]
        .map(|name| last[column(name)]);
    assert_eq!(shown, ["2530.000000", "answer", "7", "1047", "20000", "0"]);
    // Each axis has its curve.
    let picture = bench.path("ring.svg");
    bench.decode("ring.csv", table(), &["--protocol", "rtex", "--svg", picture.to_str().unwrap()]);
    let svg = std::fs::read_to_string(&picture).unwrap();
    assert!(svg.contains("address 5") && svg.contains("address 7"));
    // --bytes names what stands in the cells.
    let run = bench.decode("ring.csv", table(), &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!((run.code, run.json().len()), (4, 24));
}

/// The same in lines of a monitor: times and who spoke stand before the bytes.
#[test]
fn a_log_of_a_monitor() {
    let bench = Bench::new();
    let mut text = String::new();
    for (k, (command, response)) in exchanges().into_iter().enumerate() {
        let (command, response) = (u128::from_be_bytes(command), u128::from_be_bytes(response));
        writeln!(text, "14:02:07.{:06} TX {command:032x}\n14:02:07.{:06} RX {response:032x}", 500 * k, 500 * k + 30)
            .unwrap();
    }
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--stats"]);
    // Since the first of them.
    assert!(
        run.is_good().out.contains("  cycle         min 500.000 us, mean 500.000 us, max 500.000 us"),
        "{}",
        run.out
    );
    assert!(run.out.contains("          1000.000 us  SERVO_ON 1\n"), "{}", run.out);
    // What the log says of the direction and C/R have to agree.
    let run = bench.decode("log.txt", text.replacen("TX", "RX", 1), &["--protocol", "rtex", "--json"]);
    assert_eq!((run.code, run.verdicts()[0].as_str()), (1, "direction"));
    assert_eq!(run.json()[0]["reason"], "the log has a response, C/R says command");
    assert_eq!(run.json()[0]["at_field"], "byte 0");
    let run = bench.decode("log.txt", text.replacen("RX", "TX", 1), &["--protocol", "rtex", "--json"]);
    assert_eq!(run.json()[1]["reason"], "the log has a command, C/R says response");
}

/// Times that are counted by Update_Counter and --period say nothing of a jitter.
#[test]
fn counted_times_have_no_jitter() {
    let bench = Bench::new();
    let options = ["--protocol", "rtex", "--bytes", "--period", "500us", "--stats"];
    let run = bench.decode("log.txt", hex_log(&exchanges()), &options);
    assert!(
        run.is_good().out.contains("cycle         500.000 us on average as counted: the log has no times"),
        "{}",
        run.out
    );
    assert!(!run.out.contains("jitter 0"), "{}", run.out);
}

/// What the drive says when it is asked for its alarm, in words.
#[test]
fn an_alarm_in_words() {
    let bench = Bench::new();
    let text = "45250000000000000000000000000000\nc5a5200000000000000000001b040000\n65250000000000000000000000000000\n\
                e52520000000000000000000 1b040000\n";
    let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes", "--stats"]);
    assert!(run.out.contains("Err27.4 (too large a step of the position command)"), "{}", run.out);
}

/// Two axes, each with its own counter and count of update periods, of which one is missing; what is refused is an event of its axis.
#[test]
fn periods_are_counted_for_each_axis() {
    let bench = Bench::new();
    let line = |counter: u8, drive: u8, code: u8| format!("{:02x}{code:02x}{:028x}\n", counter << 5 | drive, 0);
    let text: String = [1, 2, 0].map(|counter| line(counter, 5, 0x20) + &line((counter + 1) % 4, 7, 0x20)).concat();
    let options = ["--protocol", "rtex", "--bytes", "--period", "500us"];
    let run = bench.decode("log.txt", &text, &[&options[..], &["--json"]].concat());
    let begins: Vec<_> = run.json().iter().map(|event| event["start_ps"].as_i64().unwrap() / 1_000_000).collect();
    assert_eq!(begins, [0, 0, 500, 500, 1_500, 1_500]);
    let run = bench.decode("log.txt", text + &line(0, 5, 0x50), &["--protocol", "rtex", "--bytes", "--stats"]);
    let (five, seven) = run.out.split_once("  address 7").unwrap();
    let refused = "    line         7  refused: cyclic code 5 is not defined\n";
    assert!(five.contains(refused) && !seven.contains("refused:"), "{}", run.out);
}

/// A block of 32 bytes in two lines is from when the first of them was.
#[test]
fn a_block_in_two_lines_has_the_time_of_the_first() {
    let bench = Bench::new();
    let mut text = String::new();
    for (k, (command, response)) in exchanges().into_iter().enumerate() {
        for (block, at, told, sub) in [(command, 500 * k, "TX", 0x8a_u8), (response, 500 * k + 30, "RX", 0x0a)] {
            writeln!(text, "14:02:07.{at:06} {told} {:032x}", u128::from_be_bytes(block)).unwrap();
            writeln!(text, "14:02:07.{:06} {told} {sub:02x}{:030x}", at + 7, 0).unwrap();
        }
    }
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--json"]);
    let begins: Vec<_> = run.json().iter().map(|event| event["start_ps"].as_i64().unwrap() / 1_000_000).collect();
    let want: Vec<_> = (0..6).flat_map(|k| [500 * k, 500 * k + 30]).collect();
    assert_eq!(begins, want);
}

/// What the decoder says of the log itself is an event of nobody, above the figures of the drives, and no frame of it.
#[test]
fn what_is_said_of_a_log_is_one_of_its_events() {
    let bench = Bench::new();
    let bytes: Vec<u8> = (0..40).flat_map(|_| exchanges()).flat_map(|(c, r)| [c, r]).flatten().collect();
    // Five bytes are missing after 100 blocks, and the last block is cut.
    let hole = [&bytes[..1_600], &bytes[1_605..]].concat();
    let stats = |log: &[u8], more: &[&str]| {
        let options = ["--protocol", "rtex", "--record-size", "16", "--stats"];
        bench.decode("log.bin", &log[..log.len() / 16 * 16], &[&options[..], more].concat())
    };
    let out = stats(&hole, &[]).out;
    let (log, drives) = out.split_once("  address ").unwrap();
    let [_, number, shape, end] = log.lines().collect::<Vec<_>>()[..] else { panic!("{log}") };
    assert_eq!(number, "  events        2");
    let from = "from here on the log looks like blocks of 16 bytes, the first of which begins at byte 11";
    assert!(shape.starts_with("    line ") && shape.ends_with(from), "{shape}");
    assert!(end.ends_with("the log ends in the middle of a block"), "{end}");
    assert!(drives.contains("  frames ") && !drives.contains("the log "), "{drives}");
    let json = stats(&hole, &["--json"]).json();
    let [log, drives @ ..] = &json[..] else { panic!("{json:?}") };
    assert!(log["address"].is_null() && drives.iter().all(|drive| drive["address"].is_number()));
    assert_eq!(["requests", "answers", "others", "ok"].map(|frames| log[frames].as_u64()), [Some(0); 4]);
    assert_eq!(log["events"][1]["what"], "the log ends in the middle of a block");
    // A log of which there is nothing to say has no such part.
    let out = stats(&bytes, &[]).out;
    assert!(!out.contains("the log ") && out.lines().nth(1) == Some("  address 5"), "{out}");
    // The shape that follows from NOPs before it.
    let started = [[5_u8].into_iter().chain([0; 15]).cycle().take(16 * 300).collect(), bytes[5..].to_vec()].concat();
    let out = stats(&started, &[]).out;
    assert!(out.contains("\n    line         1  the log looks like blocks of 16 bytes, "), "{out}");
}

/// A change of the cyclic command is an event, once, and flags of every motion are none.
#[test]
fn what_is_an_event() {
    let bench = Bench::new();
    let mut text = String::new();
    // From position to speed, and IN_POSITION comes and goes.
    for (k, (code, status)) in [(0x20, 0xc1), (0x20, 0xc0), (0x30, 0xc1), (0x30, 0xc0)].into_iter().enumerate() {
        let counter = (k as u8 + 1) % 4 * 32 + 5;
        writeln!(text, "{counter:02x}{code:02x}80{:026x}\n{:02x}{code:02x}{status:02x}{:026x}", 0, counter | 0x80, 0)
            .unwrap();
    }
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--stats", "--json"]);
    let figures = run.json();
    let said: Vec<_> =
        figures[0]["events"].as_array().unwrap().iter().map(|event| event["what"].as_str().unwrap()).collect();
    let begins = ["Command_Code CP normal (20h)", "SERVO_ON 1", "SERVO_ACTIVE 1", "SERVO_READY 1"];
    assert_eq!(said, [&begins[..], &["Command_Code CV normal (30h)"]].concat());
}

/// What is seen between the blocks of a drive is one of its events, and a refused block is shown with its bytes.
#[test]
fn findings_are_events_and_refused_blocks_have_bytes() {
    let bench = Bench::new();
    // The echo of the counter stands still, and then come ones.
    let still = [1, 2, 2, 2].map(|counter: u8| format!("{:02x}20c1{:026x}\n", 0x85 | counter << 5, 0)).concat();
    let text = still + &"f".repeat(32) + "\n";
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--stats", "--json"]);
    let figures = run.json();
    let drive = figures.iter().find(|own| own["address"] == 5).unwrap();
    let events = drive["events"].as_array().unwrap();
    let said = |what: &str| events.iter().filter(|event| event["what"] == what).count();
    assert_eq!(said("the counter echo stands still for 3 responses"), 1, "{events:?}");
    let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes"]);
    let shown = run.out.lines().find(|line| line.to_lowercase().replace(' ', "").contains(&"f".repeat(32)));
    assert!(shown.is_some(), "{}", run.out);
}
