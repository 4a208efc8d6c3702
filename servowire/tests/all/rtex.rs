//! RTEX blocks from logs of hex lines and binary records.

use std::fmt::Write as _;

use crate::common;
use crate::common::Bench;
use rtex_block::{Command, ControlBits, MacId, Response, StatusFlags, UpdateCounter};

/// Commands and responses of a drive that moves on by 10 in every exchange.
fn exchanges() -> Vec<([u8; 16], [u8; 16])> {
    let mac_id = MacId::new(5).unwrap();
    let mut counter = UpdateCounter::ZERO;
    (0..6)
        .map(|k| {
            counter = counter.next();
            let control = if k < 2 { ControlBits::empty() } else { ControlBits::SERVO_ON };
            let command = Command { control, command_data1: 1_000 + 10 * k, ..Command::idle(mac_id, counter) };
            let response = Response {
                mac_id,
                update_counter_echo: counter,
                cmd_error: false,
                code: command.code(),
                status: StatusFlags::SERVO_READY,
                response_data1: 990 + 10 * k,
                response_data2: 20_000,
                response_data3: 0,
            };
            (command.emit(), response.emit())
        })
        .collect()
}

fn hex_log(exchanges: &[([u8; 16], [u8; 16])]) -> String {
    let mut text = "# command, response\n".to_owned();
    for (command, response) in exchanges {
        for block in [command, response] {
            writeln!(text, "{:032x}", u128::from_be_bytes(*block)).unwrap();
        }
    }
    text
}

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

/// Blocks of 32 bytes in lines of 16, of which one is spoilt: no sub block is taken for a drive.
#[test]
fn long_blocks_in_two_lines() {
    let bench = Bench::new();
    let mut lines = vec!["# main half, sub half".to_owned()];
    for (command, response) in exchanges() {
        for (block, sub) in [(command, 0x8a_u8), (response, 0x0a)] {
            lines.push(format!("{:032x}", u128::from_be_bytes(block)));
            lines.push(format!("{sub:02x}{:030x}", 0));
        }
    }
    let options = ["--protocol", "rtex", "--bytes", "--json"];
    let kinds = |run: &common::Run| {
        run.json().iter().map(|event| event["kind"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let run = bench.decode("log.txt", lines.join("\n"), &options);
    assert_eq!(run.is_good().json().len(), 12);
    assert!(kinds(&run).iter().all(|kind| kind.ends_with('5')), "{:?}", kinds(&run));
    for spoilt in [5, 6] {
        let mut lines = lines.clone();
        lines[spoilt].replace_range(3..4, "g");
        let run = bench.decode("log.txt", lines.join("\n"), &options);
        let of_drives: Vec<_> = kinds(&run).into_iter().filter(|kind| kind != "line").collect();
        assert_eq!(of_drives.len(), 11);
        assert!(of_drives.iter().all(|kind| kind.ends_with('5')), "{of_drives:?}");
    }
    lines.pop();
    let run = bench.decode("log.txt", lines.join("\n"), &options);
    assert_eq!(run.json().last().unwrap()["fields"]["note"], "the log ends in the middle of a block");
    // The size that is given wrongly is said.
    let wrong = bench.decode("log.txt", lines.join("\n"), &[&options[..], &["--block-size", "16"]].concat());
    assert!(wrong.err.contains("looks like blocks of 32 bytes; try --block-size"), "{}", wrong.err);
}

/// Words of 16 or 32 bits written the wrong way round are said as such, for the log as a whole.
#[test]
fn logs_with_exchanged_bytes() {
    let bench = Bench::new();
    for (width, want) in [
        (2, "with the bytes of each 16-bit word exchanged"),
        (4, "with the bytes of each 32-bit word in the other order"),
    ] {
        let mut text = String::new();
        for block in exchanges().into_iter().flat_map(|(command, response)| [command, response]) {
            for byte in block.chunks(width).flat_map(|word| word.iter().rev()) {
                write!(text, "{byte:02x}").unwrap();
            }
            text.push('\n');
        }
        let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes"]);
        assert!(run.err.contains(want), "{}", run.err);
        // Said once more at the end, as the error that it is: what was shown is not what was sent.
        assert_eq!(run.code, 1);
        assert!(run.err.lines().last().is_some_and(|line| line.ends_with(": pack with shifts")), "{}", run.err);
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

/// A bus on which nothing answers is no drive 31.
#[test]
fn a_bus_of_ones() {
    let bench = Bench::new();
    let text = [&*"f".repeat(32); 6].join("\n");
    let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!((run.code, run.verdicts()), (1, vec!["reserved".to_owned(); 6]));
    assert!(run.err.contains("nothing answers on this bus"), "{}", run.err);
}

/// What goes on at the end of a log is said there, of one drive too.
#[test]
fn what_is_left_open() {
    let bench = Bench::new();
    let block = |bytes: [u8; 10]| format!("{}000000000000", bytes.map(|byte| format!("{byte:02x}")).concat());
    let at_end = |lines: &[String], more: &[&str]| {
        let run =
            bench.decode("log.txt", lines.join("\n"), &[&["--protocol", "rtex", "--bytes", "--json"], more].concat());
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
        // A drive that is silent has to be looked after.
        assert_eq!(at_end(&silent, more), (4, "at the end drive 5 has not answered the last 8 commands".to_owned()));
    }
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

/// Blocks of 32 bytes are recognised as such: their sub blocks are no drives.
#[test]
fn a_log_of_long_blocks() {
    let bench = Bench::new();
    let mut text = String::new();
    for (command, response) in exchanges() {
        for (block, sub) in [(command, 0x8a_u8), (response, 0x0a)] {
            writeln!(text, "{:032x}{sub:02x}{:030x}", u128::from_be_bytes(block), 0).unwrap();
        }
    }
    let run = bench.decode("log.txt", text, &["--protocol", "rtex", "--bytes", "--json"]);
    assert_eq!(run.is_good().json().len(), 12);
    assert!(run.json().iter().all(|event| event["kind"].as_str().unwrap().ends_with('5')));
    assert!(run.err.contains("the log looks like blocks of 32 bytes"), "{}", run.err);
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
    assert_eq!(
        run.json().last().unwrap()["fields"]["note"],
        "drive 5 answers and was never sent a command; drive 7 never answered"
    );
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
    assert_eq!((events.len(), last["kind"].as_str()), (21, Some("log")), "{last}");
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

/// A log from power-up: seconds of NOPs, and then blocks with the bytes of each word in the other order, or of 32 bytes.
#[test]
fn a_log_from_power_up() {
    let bench = Bench::new();
    for (wide, turned) in [(false, false), (false, true), (true, false), (true, true)] {
        let mut text = String::new();
        let mut put = |block: &[u8], sub: u8| {
            let mut bytes = block.to_vec();
            if wide {
                bytes.push(sub);
                bytes.extend([0; 15]);
            }
            let width = if turned { 4 } else { 1 };
            for byte in bytes.chunks(width).flat_map(|word| word.iter().rev()) {
                write!(text, "{byte:02x}").unwrap();
            }
            text.push('\n');
        };
        for _ in 0..2_000 {
            put(&[5, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0], 0x80);
        }
        for (command, response) in exchanges() {
            put(&command, 0x80);
            put(&response, 0);
        }
        let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--json"]);
        let said = format!("{wide} {turned}: {}", run.err);
        assert_eq!(run.code, i32::from(turned), "{said}");
        assert!(!turned || run.err.contains("pack with shifts"), "{said}");
        let drives = run.json().iter().filter(|event| event["kind"].as_str().unwrap().ends_with('5')).count();
        assert_eq!(drives, 2_012, "{said}");
    }
}

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

/// Blocks of which the first is cut, and blocks of which five bytes are missing in the middle of the log: what is whole is shown, and the
/// log is said not to be what it was written as.
#[test]
fn a_log_that_begins_or_goes_on_in_the_middle_of_a_block() {
    let bench = Bench::new();
    let bytes: Vec<u8> = (0..40).flat_map(|_| exchanges()).flat_map(|(c, r)| [c, r]).flatten().collect();
    let dump = |bytes: &[u8]| {
        bytes
            .chunks(16)
            .map(|line| line.iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}")) + "\n")
            .collect::<String>()
    };
    let of_5 = |run: &common::Run| {
        run.json().iter().filter(|it| it["kind"].as_str().unwrap().ends_with('5') && it["verdict"] == "ok").count()
    };
    for text in [dump(&bytes[5..]), dump(&bytes[..7_680 - 9][5..])] {
        let run = bench.decode("log.txt", &text, &["--protocol", "rtex", "--bytes", "--json"]);
        assert_eq!(run.code, 1, "{}", run.err);
        assert!(run.err.contains("begins in the middle of a block: its first 11 bytes are left out"), "{}", run.err);
        assert!(
            of_5(&run) >= 478 && run.verdicts().iter().all(|it| *it == "ok" || *it == "truncated"),
            "{}",
            of_5(&run)
        );
    }
    let hole = [&bytes[..1_600], &bytes[1_605..]].concat();
    let run = bench.decode(
        "log.bin",
        &hole[..hole.len() / 16 * 16],
        &["--protocol", "rtex", "--record-size", "16", "--json"],
    );
    assert_eq!(run.code, 1);
    assert!(run.err.contains("from here on the log looks like blocks of 16 bytes"), "{}", run.err);
    // 100 blocks before it and what follows the blocks by which it was seen.
    assert!(of_5(&run) > 340, "{}", of_5(&run));
}

/// The words of 32 bits are turned round, and the blocks are shown as they were meant.
#[test]
fn turned_words_are_read() {
    let bench = Bench::new();
    let log = hex_log(&exchanges());
    let turn = |line: &str| {
        line.as_bytes().chunks(8).flat_map(|w| w.chunks(2).rev()).flatten().map(|b| char::from(*b)).collect::<String>()
    };
    let text: String = log.lines().skip(1).map(|line| turn(line) + "\n").collect();
    let options = ["--protocol", "rtex", "--bytes", "--json"];
    let (turned, plain) = (bench.decode("log.txt", text, &options), bench.decode("log.txt", log, &options));
    let fields = |run: &common::Run| run.json().iter().map(|it| it["fields"].clone()).collect::<Vec<_>>();
    assert_eq!((turned.code, fields(&turned)), (1, fields(&plain)));
}
