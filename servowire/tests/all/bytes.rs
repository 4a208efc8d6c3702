//! Logs and dumps of bytes, as programs write them: the same exchanges in each, with no option.

use std::path::PathBuf;

use crate::common;

fn decode(name: &str) -> common::Run {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/samples").join(name);
    common::decode(&path, &["--json"])
}

fn answers(run: &common::Run) -> Vec<String> {
    let answers = run.json().into_iter().filter(|event| event["direction"] == "answer");
    answers.map(|event| format!("{} {}", event["kind"].as_str().unwrap(), event["fields"]["ABS"])).collect()
}

#[test]
fn dumps_and_arrays() {
    let all = ["ID 3 3915817", "ID 0 1883572", "ID 2 null", "ID 3 3915817", "ID 3 3915817"];
    for name in [
        "bytes-xxd.txt",
        "bytes-xxd-b.txt",
        "bytes-xxd-i.h",
        "bytes-hexdump-C.txt",
        "bytes-hexdump.txt",
        "bytes-od-x1z.txt",
    ] {
        let run = decode(name);
        assert_eq!(answers(run.is_good()), all, "{name}: {}", run.out);
    }
    // Each of the five forms holds all of it.
    assert_eq!(answers(decode("bytes-python.txt").is_good()), [all; 5].concat());
    assert_eq!(answers(decode("bytes-rust.rs").is_good()), [all[0], all[0]]);
    decode("bytes-od-octal.txt").fails_with("octal words");
}

#[test]
fn logs_of_monitors() {
    for (name, count) in [("bytes-docklight.txt", 2), ("bytes-portmon.txt", 1), ("bytes-pairs.txt", 2)] {
        let run = decode(name);
        assert_eq!(answers(run.is_good()), &["ID 3 3915817", "ID 0 1883572"][..count], "{name}: {}", run.out);
        assert_eq!(run.json().len(), 2 * count, "{name}");
    }
}

/// Two requests in a row: the first got no answer, however long its line might have been an answer's.
#[test]
fn the_log_says_who_spoke() {
    let bench = common::Bench::new();
    let log = "TX: EA 01 EB\nTX: EA 01 EB\nRX: EA 01 5A B1\n";
    let run = bench.decode("log.txt", log, &["--json"]);
    assert_eq!(run.verdicts(), ["ok", "no_response", "ok", "ok"], "{}", run.out);
    let words = bench.decode("notes.txt", "These are notes.\nNothing else.\n", &[]);
    words.fails_with("no format that is known");
}

/// Answers of a T-Format encoder as they were given, one after the other with their requests.
fn traffic(exchanges: u32) -> Vec<u8> {
    (0..exchanges).flat_map(|k| [vec![0x1a], common::id3(3_915_817 + 37 * k, k % 7, 0)].concat()).collect()
}

fn rows(bytes: &[u8], width: usize, row: impl Fn(usize, String) -> String) -> String {
    let hex = |part: &[u8]| part.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().join(" ");
    bytes.chunks(width).enumerate().map(|(k, part)| row(k * width, hex(part))).collect()
}

/// `od -An -tx1` and `xxd -p` have no addresses: their lines end where they are full, not where a frame does. An RTEX
/// block has sixteen bytes too, and no check sum to tell it from anything.
#[test]
fn dumps_without_addresses() {
    let bench = common::Bench::new();
    let bytes = traffic(40);
    for text in [
        rows(&bytes, 16, |_, hex| format!(" {hex}\n")),
        rows(&bytes, 30, |_, hex| hex.replace(' ', "") + "\n"),
        rows(&bytes, 32, |_, hex| hex + "\n"),
    ] {
        for options in [&["--json"][..], &["--json", "-p", "tformat"]] {
            let run = bench.decode("dump.txt", &text, options);
            assert_eq!(run.is_good().json().len(), 80, "{}", run.out);
        }
    }
    // Lines that are frames stay lines: the third one is damaged, and no other.
    let mut log: Vec<String> = (0..9).map(|k| rows(&common::id3(k, 0, 0), 11, |_, hex| hex + "\n")).collect();
    log[2] = log[2].replacen("1a", "1b", 1);
    let run = bench.decode("log.txt", log.concat(), &["--json"]);
    assert_eq!(run.verdicts().iter().filter(|verdict| *verdict == "ok").count(), 8, "{}", run.out);
}

/// A dump of many blocks of the reader: no frame is cut in two.
#[test]
fn a_long_dump() {
    let bench = common::Bench::new();
    let text = rows(&traffic(20_000), 16, |at, hex| format!("{at:08x}  {hex}\n"));
    let run = bench.decode("dump.txt", text, &["--json"]);
    assert_eq!(run.is_good().json().len(), 40_000);
}

/// What a program writes in front of its bytes does not keep them from being read.
#[test]
fn lines_with_a_title() {
    let bench = common::Bench::new();
    let bytes = traffic(20);
    for title in ["I (1234) encoder: ", "12:30:00 PM: ", "17 ms: ", "Nov 22 09:15:00 bench axis[3]: ", "COM3 > "] {
        let text = rows(&bytes, 12, |_, hex| format!("{title}{hex}\n"));
        let run = bench.decode("log.txt", text, &["--json"]);
        assert_eq!(run.is_good().json().len(), 40, "{title}: {}", run.out);
    }
}

/// A request, and a line in which a digit was lost: nobody knows whether that was the answer.
#[test]
fn an_answer_that_cannot_be_read_is_not_missing() {
    let bench = common::Bench::new();
    let run = bench.decode("log.txt", "1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n1A\n1A 20 29 C\n", &["--bytes", "--json"]);
    assert_eq!(run.verdicts(), ["ok", "ok", "ok", "hex"], "{}", run.out);
}

/// The wrong protocol was named, and the right one is said.
#[test]
fn what_a_log_looks_like() {
    let bench = common::Bench::new();
    let tformat = rows(&traffic(10), 12, |_, hex| hex + "\n");
    let nikon = {
        use nikon_aformat::device::{Device, Encoders};
        use nikon_aformat::{BitRate, EncoderAddress, Operation, Request, Resolution};
        let rate = BitRate::Mbit4;
        let device = |ea| Device::new(ea, Resolution::new(20, 16).unwrap(), rate);
        let mut encoders: Encoders<8, 1> = Encoders { all: EncoderAddress::ALL.map(device) };
        let request = Request::new(EncoderAddress::new(3).unwrap(), Operation::Abs40);
        let mut text = String::new();
        for k in 0..10_u64 {
            let mut words: Vec<u16> = Vec::new();
            for frame in request.emit().as_slice() {
                words.push(frame.content());
                for answer in encoders.hear(&[Some(frame.content())], 1_000_000 * k).into_iter().flatten() {
                    // The content of a frame stands between its start bit and its delimiter.
                    let bit = |at: u32| u16::from(answer.line.get(at) == Some(true));
                    words.extend(
                        (0..answer.line.len() / 18).map(|f| (0..16).map(|b| bit(18 * f + 1 + b) << b).sum::<u16>()),
                    );
                }
            }
            text.extend(words.iter().map(|word| format!("{:04x} ", word.reverse_bits())));
            text.push('\n');
        }
        text
    };
    for (text, wrong, right) in [
        (&tformat, "nikon", "T-Format: 20 of 20"),
        (&tformat, "rtex", "T-Format: 20 of 20"),
        (&tformat, "hdsl", "T-Format: 20 of 20"),
        (&tformat, "sorte", "T-Format: 20 of 20"),
        (&nikon, "tformat", "A-format: 20 of 20"),
        (&nikon, "rtex", "A-format: 20 of 20"),
    ] {
        let run = bench.decode("log.txt", text, &["--bytes", "-p", wrong]);
        run.fails_with(&format!(
            "it looks like {right} frames are valid that way; leave out the option that says otherwise"
        ));
    }
    for (text, right) in [(&tformat, "tformat"), (&nikon, "nikon")] {
        let run = bench.decode("log.txt", text, &["--bytes", "-p", right]);
        assert!(!run.is_good().err.contains("looks like"), "{}", run.err);
    }
    let ring = ["decode", "--bytes", "tests/cmd/rtex.in/ring.txt", "-p"];
    common::servowire(&[&ring[..], &["tformat"]].concat()).fails_with("it looks like RTEX");
    assert!(!common::servowire(&[&ring[..], &["rtex"]].concat()).err.contains("looks like"));
}
