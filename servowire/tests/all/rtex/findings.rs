//! What a log shows between its blocks, and as a whole.

use super::{exchanges, hex_log};
use crate::common::Bench;

/// Times from the update period; steps, jumps and requests are seen.
#[test]
fn a_log_with_a_period() {
    let bench = Bench::new();
    let mut all = exchanges();
    // In the last exchange the command goes on by more than 400 M pulses a second.
    all[5].0[4..8].copy_from_slice(&300_000_i32.to_le_bytes());
    all[5].1[4..8].copy_from_slice(&299_990_i32.to_le_bytes());
    let options = ["--protocol", "rtex", "--bytes", "--mac-id", "5", "--period", "500us"];
    let run = bench.decode("log.txt", hex_log(&all), &[&options[..], &["--json"]].concat());
    let events = run.is_good().json();
    assert_eq!(events[10]["fields"]["note"], "position step 298960, at most 200000: Err27.4");
    let run = bench.decode("log.txt", hex_log(&all), &[&options[..], &["--stats", "--jump", "1000"]].concat());
    assert!(run.is_good().out.contains("1 of more than 1000 counts"), "{}", run.out);
}

/// Without what it needs --jump says so.
#[test]
fn jumps_that_cannot_be_told() {
    let bench = Bench::new();
    let options = ["--protocol", "rtex", "--bytes", "--stats", "--jump", "5"];
    for (more, want) in [
        (
            &[][..],
            "jumps         not known: the positions have no times (a log of RTEX blocks needs times, or --period)",
        ),
        (&["--period", "500us"], "jumps         5 of more than 5 counts"),
    ] {
        let run = bench.decode("log.txt", hex_log(&exchanges()), &[&options[..], more].concat());
        assert!(run.is_good().out.contains(want), "{more:?}: {}", run.out);
    }
    let json = [&options[..], &["--json"]].concat();
    let figures = bench.decode("log.txt", hex_log(&exchanges()), &json).json();
    assert!(figures[0]["jumps"].is_null() && figures[0]["address"] == 5, "{figures:?}");
}

/// 400 M pulses a second in 0.5 ms are 200 000 pulses: 50 000 command units at gear 4/1.
#[test]
fn steps_after_the_gear() {
    let bench = Bench::new();
    let mut all = exchanges();
    all[5].0[4..8].copy_from_slice(&51_041_i32.to_le_bytes());
    let notes = |more: &[&str]| {
        let options = ["--protocol", "rtex", "--bytes", "--json", "--period", "0.5ms"];
        let run = bench.decode("log.txt", hex_log(&all), &[&options[..], more].concat());
        run.is_good().json()[10]["fields"].get("note").map(|note| note.as_str().unwrap().to_owned())
    };
    assert_eq!(notes(&[]), None);
    assert_eq!(notes(&["--gear", "4/1"]).unwrap(), "position step 50001, at most 50000: Err27.4");
    assert_eq!(notes(&["--gear", "200000/50001"]), None);
    for wrong in ["4", "0/1", "1/0", "-4/1"] {
        let gear = format!("--gear={wrong}");
        let options = ["--protocol", "rtex", "--bytes", "--period", "0.5ms", gear.as_str()];
        assert_eq!(bench.decode("log.txt", hex_log(&all), &options).code, 2, "{wrong}");
    }
}

fn as_text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// What no single block shows: each finding stands beside the block at which it is seen.
#[test]
fn findings_between_blocks() {
    let block =
        |bytes: [u8; 10]| bytes.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}")) + "000000000000";
    let command = |counter: u8, code| block([counter << 5 | 5, code, 0x80, 0, 0, 0, 0, 0, 7, 0]);
    let response = |counter: u8, code, nine| block([0x80 | counter << 5 | 5, code, 0xc1, 0, 0, 0, 0, 0, 7, nine]);
    let bench = Bench::new();
    let notes = |lines: &[String]| {
        let run = bench.decode("log.txt", lines.join("\n"), &["--protocol", "rtex", "--bytes", "--json"]);
        let noted: Vec<_> = run
            .json()
            .iter()
            .enumerate()
            .filter_map(|(k, event)| Some((k, event["fields"].get("note")?.as_str()?.to_owned())))
            .collect();
        noted
    };
    let note = |at: usize, text: &str| (at, text.to_owned());
    // The echo of the counter stands still beyond the two communications of an update.
    let still = [1, 2, 2, 2, 3].map(|counter| response(counter, 0x20, 0));
    assert_eq!(notes(&still), [note(3, "the counter echo stands still for 3 responses")]);
    // Somebody has to look after that, and after an alarm: so says the exit code.
    let trouble = |lines: &[String]| {
        let run = bench.decode("log.txt", lines.join("\n"), &["--protocol", "rtex", "--bytes"]);
        (run.code, run.err.lines().last().unwrap_or_default().to_owned())
    };
    let (code, said) = trouble(&still);
    assert!(code == 4 && said.ends_with("drive 5 sent a counter echo that stood still"), "{said}");
    let alarm = [1, 2, 3].map(|counter| response(counter, 0x20, 0).replacen("20c1", "20e1", 1));
    let (code, said) = trouble(&alarm);
    assert!(code == 4 && said.ends_with("drive 5 reported an alarm"), "{said}");
    // A log that is not as it was meant, or cut, does not hide it.
    let turned = |line: &String| -> String {
        line.as_bytes().chunks(4).flat_map(|word| [as_text(&word[2..]), as_text(&word[..2])]).collect()
    };
    let moving = |k: u8| response(k & 3, 0x20, 0).replacen("20c1", if k == 30 { "20e1" } else { "20c1" }, 1);
    let long: Vec<String> = (0..40).map(|k| turned(&moving(k))).collect();
    let (code, said) = trouble(&long);
    assert!(code == 5 && said.ends_with("pack with shifts; drive 5 reported an alarm"), "{said}");
    let bytes = |line: &String| (0..16).map(|k| u8::from_str_radix(&line[2 * k..2 * k + 2], 16).unwrap()).collect();
    let mut cut: Vec<u8> = (0..40).flat_map(|k| -> Vec<u8> { bytes(&moving(k)) }).collect();
    cut.truncate(39 * 16 + 9);
    let run = bench.decode("log.bin", cut, &["--protocol", "rtex", "--record-size", "16"]);
    let want = ", byte 624: the last record has 9 of 16 bytes: it was cut off; drive 5 reported an alarm\n";
    assert!(run.code == 5 && run.err.ends_with(want), "{} {}", run.code, run.err);
    // The code comes back later than one command after the other.
    let late: Vec<_> =
        (1..=4).flat_map(|k| [command(k & 3, 0x20), response(k & 3, if k == 4 { 0x20 } else { 0x10 }, 0)]).collect();
    assert_eq!(notes(&late), [note(7, "the code came back after 4 responses")]);
    // A request: its latency, and for how long it was busy.
    let asked: Vec<_> = [(1, 0x20, 0), (2, 0x20, 0), (3, 0x26, 0x10), (0, 0x26, 0x10), (1, 0x26, 0)]
        .into_iter()
        .flat_map(|(k, echo, nine)| {
            [command(k, if k == 1 && echo == 0x20 { 0x20 } else { 0x26 }), response(k, echo, nine)]
        })
        .collect();
    assert_eq!(notes(&asked), [note(9, "answered after 4 responses, 2 of them busy")]);
    // A drive that goes silent, and a block of another one in its place.
    let mut silent: Vec<_> = [1, 2].into_iter().flat_map(|k| [command(k, 0x20), response(k, 0x20, 0)]).collect();
    silent.extend([3, 0, 1].map(|counter| command(counter, 0x20)));
    silent.push(response(1, 0x20, 0).replacen("a5", "a6", 1));
    assert_eq!(
        notes(&silent),
        [note(6, "no answer to the last 3 commands"), note(8, "drive 6 answers and was never sent a command")]
    );
}

/// What goes on at the end of a log is said there, of one drive too.
#[test]
fn what_is_left_open() {
    let bench = Bench::new();
    let block = |bytes: [u8; 10]| format!("{}000000000000", bytes.map(|byte| format!("{byte:02x}")).concat());
    let options = ["--protocol", "rtex", "--bytes"];
    let at_end = |lines: &[String], more: &[&str]| {
        let run = bench.decode("log.txt", lines.join("\n"), &[&options[..], &["--json"], more].concat());
        (run.code, run.json().last().unwrap()["fields"]["note"].as_str().unwrap().to_owned())
    };
    let command = |k: u8, code| block([(k % 4) << 5 | 5, code, 0x80, 0, 0, 0, 0, 0, 7, 0]);
    let busy = |k: u8| block([0x80 | (k % 4) << 5 | 5, 0x26, 0xc1, 0, 0, 0, 0, 0, 7, 0x10]);
    let asked: Vec<_> = (1..=9).flat_map(|k| [command(k, 0x26), busy(k)]).collect();
    let silent: Vec<_> = asked[..2].iter().cloned().chain((2..=9).map(|k| command(k, 0x20))).collect();
    for more in [&[][..], &["--mac-id", "5"], &["--period", "1ms"]] {
        assert_eq!(
            at_end(&asked, more),
            (0, "at the end drive 5 has not answered CP parameter (26h) in 9 responses, 9 of them busy".to_owned())
        );
        // In the figures, too, as an event of the drive, though not as a frame.
        let figures = bench.decode("log.txt", asked.join("\n"), &[&options[..], more, &["--stats"]].concat()).out;
        assert!(figures.contains("at the end drive 5 has not answered CP parameter (26h) in 9 responses"), "{figures}");
        assert!(figures.contains("9 requests, 9 answers, 0 others"), "{figures}");
        // A drive that is silent has to be looked after.
        assert_eq!(at_end(&silent, more), (4, "at the end drive 5 has not answered the last 8 commands".to_owned()));
    }
}

#[test]
fn a_drive_that_never_answers() {
    let bench = Bench::new();
    let mut all = exchanges();
    for (command, _) in &mut all {
        command[0] ^= 2;
    }
    let run = bench.decode("log.txt", hex_log(&all), &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!(run.code, 4);
    assert!(run.err.ends_with("drive 7 did not answer\n"), "{}", run.err);
    let said: Vec<_> =
        run.json().iter().filter(|it| it["kind"] == "log").map(|it| it["fields"]["note"].clone()).collect();
    assert_eq!(said, ["drive 5 answers and was never sent a command", "drive 7 never answered"]);
    // In the figures, each stands with its drive.
    let run = bench.decode("log.txt", hex_log(&all), &["--protocol", "rtex", "--bytes", "--stats"]);
    let (five, seven) = run.out.split_once("  address 7").unwrap();
    assert!(
        five.contains("drive 5 answers and was never sent a command\n") && !five.contains("drive 7"),
        "{}",
        run.out
    );
    assert!(seven.contains("drive 7 never answered\n") && !seven.contains("drive 5"), "{}", run.out);
}

/// What is said of the log as a whole is no frame of it.
#[test]
fn a_remark_on_the_log_is_counted_nowhere() {
    let bench = Bench::new();
    // A drive that never answers, and eight blocks that are not valid.
    let mut all = exchanges();
    for (command, _) in &mut all {
        command[0] ^= 2;
    }
    let text = hex_log(&all) + &"45507000000000000000000000000000\n".repeat(8);
    let options = ["--protocol", "rtex", "--bytes"];
    let run = bench.decode("log.txt", &text, &[&options[..], &["--json"]].concat());
    assert!(run.code == 5 && run.err.contains("8 of 20 frames refused"), "{}", run.err);
    let events = run.json();
    let last = events.last().unwrap();
    assert_eq!((events.len(), last["kind"].as_str()), (22, Some("log")), "{last}");
    // It stands at the end of the log.
    assert_eq!(last["line"], events[19]["line"]);
    // All drives together.
    let figures = bench.decode("log.txt", &text, &[&options[..], &["--stats", "--json"]].concat()).json();
    let sum = |key: &str| figures.iter().map(|own| own[key].as_u64().unwrap()).sum::<u64>();
    assert_eq!(["requests", "answers", "others", "ok"].map(sum), [14, 6, 0, 12]);
    let refused = figures.iter().flat_map(|own| own["refused"].as_object().unwrap().values());
    assert_eq!(refused.filter_map(serde_json::Value::as_u64).sum::<u64>(), 8);
    // Its line has no verdict, as it is no frame.
    let shown = bench.decode("log.txt", &text, &options).out;
    assert!(!shown.trim_end().ends_with("ok"), "{shown}");
}
