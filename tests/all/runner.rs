//! The runner refuses what it cannot run, instead of passing over it.

use std::fs;
use std::path::Path;

use conformance::{Report, RunError, run_all, run_protocol};
use tempfile::TempDir;

const ABOUT: &str = "{\"about\": \"rows of a test\"}\n";
const GOOD: &str = "{\"name\": \"x\", \"bytes\": \"313233343536373839\", \"crc\": \"31\", \"lfsr_wire\": \"8c\"}\n";

fn run(file: &str, content: &str) -> Report {
    let dir = TempDir::new().unwrap();
    fs::write(dir.path().join(file), content).unwrap();
    run_protocol("tformat", dir.path())
}

#[test]
fn a_good_row_passes() {
    let report = run("crc.jsonl", &format!("{ABOUT}{GOOD}"));
    assert!(report.passed());
    assert_eq!((report.topics.len(), report.topics[0].passed), (1, 1));
}

#[test]
fn a_wrong_expectation_is_shown_with_both_sides() {
    let report = run("crc.jsonl", &GOOD.replace("\"31\"", "\"32\""));
    assert!(!report.passed());
    let text = report.topics[0].failures[0].to_string();
    assert!(text.contains("expected") && text.contains("real") && text.contains("line 1, x"), "{text}");
}

#[test]
fn an_unknown_key_fails_the_row() {
    let report = run("crc.jsonl", &GOOD.replace("\"crc\"", "\"extra\": 1, \"crc\""));
    assert!(report.topics[0].failures[0].to_string().contains("extra"));
}

#[test]
fn unknown_topics_empty_files_and_broken_lines_are_errors() {
    assert!(matches!(run("weather.jsonl", GOOD).errors[..], [RunError::UnknownTopic(..)]));
    assert!(matches!(run("crc.jsonl", ABOUT).errors[..], [RunError::NoRows(..)]));
    assert!(matches!(run("crc.jsonl", "{\"name\"").errors[..], [RunError::Line(_, 1, _)]));
    assert!(matches!(run("crc.jsonl", "{\"name\": 1}").errors[..], [RunError::Line(_, 1, _)]));
    assert!(matches!(run("notes.txt", "").errors[..], [RunError::NoFiles(..)]));
    assert!(matches!(run_protocol("morse", Path::new(".")).errors[..], [RunError::UnknownProtocol(..)]));
    assert!(matches!(run_all(Path::new("no/such/folder")).errors[..], [RunError::Io(..)]));
}
