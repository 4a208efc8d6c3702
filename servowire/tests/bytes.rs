//! Logs and dumps of bytes, as programs write them: the same exchanges in each, with no option.
#![allow(clippy::indexing_slicing, clippy::std_instead_of_core, clippy::unwrap_used)]

mod common;

use std::path::PathBuf;

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
