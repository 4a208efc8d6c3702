//! Tables, pictures, filters, colours, completions; and what the README says of the JSON.

use std::path::Path;
use std::process::Command;

use crate::common;
use crate::common::{Bench, Wave, good_traffic, id0, id3};
use serde_json::Value;

/// Good frames, a spoilt answer, and a request that nobody answers.
fn mixed() -> Wave {
    let mut wave = good_traffic(2.5e6);
    let mut bad = id3(5, 0, 0);
    bad[10] ^= 1;
    wave.exchange(&[0x1a], &bad).send(&[0x02]).idle_us(60.0).exchange(&[0x02], &id0(77));
    wave
}

#[test]
fn a_table_for_spreadsheets() {
    let bench = Bench::new();
    let file = bench.file("a.vcd", mixed().vcd());
    let (table, json) = (common::decode(&file, &["--csv"]), common::decode(&file, &["--json"]).json());
    assert_eq!(table.code, 1);
    let mut reader = csv::Reader::from_reader(table.out.as_bytes());
    let names: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), json.len());
    let cell = |row: &csv::StringRecord, name: &str| {
        row.get(names.iter().position(|known| known == name).unwrap()).unwrap().to_owned()
    };
    for (row, event) in rows.iter().zip(&json) {
        let start: f64 = cell(row, "start_us").parse().unwrap();
        assert_eq!((start * 1e6).round() as i64, event["start_ps"].as_i64().unwrap());
        assert_eq!((cell(row, "kind"), cell(row, "verdict")), (text(&event["kind"]), text(&event["verdict"])));
        assert_eq!((cell(row, "channel"), cell(row, "protocol")), ("line".to_owned(), "T-Format".to_owned()));
        // Numbers are numbers.
        assert_eq!(cell(row, "ABS").parse().ok(), event["fields"]["ABS"].as_i64());
        assert_eq!(cell(row, "ALMC").parse().ok(), event["fields"]["ALMC"]["raw"].as_i64());
        assert_eq!(cell(row, "position").parse().ok(), event["position"]["counts"].as_i64());
        assert_eq!(cell(row, "more"), "");
    }
    // A log has no lines: its columns are what its frames hold.
    let log = bench.decode("log.txt", "1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n", &["--bytes", "--csv"]);
    let lines: Vec<&str> = log.is_good().out.lines().collect();
    assert!(lines[0].ends_with(",flags,SF,ABS,ENID,ABM,ALMC,CRC,more"), "{}", lines[0]);
    assert!(lines[2].ends_with(",EA1 OF BE BA,32,3915817,23,0,200,55,"), "{}", lines[2]);
}

fn text(value: &Value) -> String {
    value.as_str().unwrap().to_owned()
}

#[test]
fn a_picture() {
    let bench = Bench::new();
    let (file, out) = (bench.file("a.vcd", mixed().vcd()), bench.path("out.svg"));
    let run = common::decode(&file, &["--svg", out.to_str().unwrap()]);
    assert_eq!(run.code, 1);
    let svg = std::fs::read_to_string(&out).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    for word in ["position ABM, ABS in turns", "answers by their delay", "crc", "no_response", "time in us"] {
        assert!(svg.contains(word), "{word} is not in the picture");
    }
    assert_eq!(common::servowire(&["decode", "--svg", "x.svg"]).code, 2, "one file, one picture");
    let log = bench.decode("log.txt", "1A\n", &["--bytes", "--svg", out.to_str().unwrap()]);
    log.fails_with("a log of bytes has no times for a picture");
}

#[test]
fn filters() {
    let bench = Bench::new();
    let file = bench.file("a.vcd", mixed().vcd());
    let kinds = |options: &[&str]| -> Vec<String> {
        let run = common::decode(&file, &[&["--json"], options].concat());
        run.json().iter().map(|event| text(&event["kind"])).collect()
    };
    assert_eq!(kinds(&["--id", "d"]), ["ID D", "ID D"]);
    assert_eq!(kinds(&["--id", "ID 2,D"]), ["ID 2", "ID 2", "ID D", "ID D"]);
    assert_eq!(kinds(&["--from", "30us", "--to", "0.1ms"]), ["ID 2", "ID 2", "ID 3"]);
    assert_eq!(kinds(&["--errors"]), ["ID 3", "ID 0"]);
    // What is not asked for is not counted: this part of the file is good.
    common::decode(&file, &["--to", "100us"]).is_good();
    common::decode(&file, &["--id", "D", "--errors"]).is_good();
    common::decode(&file, &["--id", "9"]).fails_with("none of its 29 frames passes the filter");
    assert_eq!(common::decode(&file, &["--from", "12"]).code, 2, "a time has a unit");
    bench.decode("log.txt", "1A\n", &["--bytes", "--to", "1s"]).fails_with("has no times for --from and --to");
    let nikon = "../servowire-decode/captures/nikon-artinchip-crc.vcd";
    assert_eq!(common::servowire(&["decode", nikon, "--address", "7", "--json"]).json().len(), 2);
    common::servowire(&["decode", nikon, "--address", "1"]).fails_with("none of its 2 frames passes the filter");
}

/// Reading ends where nothing that is asked for can come any more.
#[test]
fn a_file_is_read_as_far_as_it_is_asked_for() {
    let bench = Bench::new();
    let mut wave = good_traffic(2.5e6);
    for k in 0..20_000 {
        wave.exchange(&[0x1a], &id3(k, 0, 0));
    }
    let run = bench.decode("a.vcd", wave.vcd() + "broken", &["--to", "1ms", "--json"]);
    assert!(run.is_good().json().len() > 20, "{}", run.err);
}

#[test]
fn refused_frames_are_red_where_colours_are_wanted() {
    let bench = Bench::new();
    let file = bench.file("a.vcd", mixed().vcd());
    let run = |name: &str, value: &str| {
        let out = Command::new(env!("CARGO_BIN_EXE_servowire"))
            .args(["decode", file.to_str().unwrap()])
            .env_remove("NO_COLOR")
            .env_remove("CLICOLOR_FORCE")
            .env(name, value)
            .output()
            .unwrap();
        String::from_utf8(out.stdout).unwrap()
    };
    let coloured = run("CLICOLOR_FORCE", "1");
    assert_eq!(coloured.matches("\u{1b}[1m\u{1b}[31mREFUSED\u{1b}[0m crc").count(), 1, "{coloured}");
    // A file takes none, and neither does who does not want any.
    for plain in [run("CLICOLOR", "1"), run("NO_COLOR", "1")] {
        assert!(!plain.contains('\u{1b}') && plain.contains("REFUSED crc"));
        assert_eq!(plain, coloured.replace("\u{1b}[1m\u{1b}[31m", "").replace("\u{1b}[0m", ""));
    }
}

/// Whatever comes, also with long reasons and many fields.
#[test]
fn lines_fit_a_hundred_columns() {
    let bench = Bench::new();
    let file = bench.file("a.vcd", mixed().vcd());
    let mut runs = vec![common::decode(&file, &[])];
    for protocol in ["tformat", "nikon", "hdsl"] {
        runs.push(common::servowire(&["decode", "-p", protocol]));
    }
    runs.push(common::servowire(&["decode", "-p", "rtex", "--bytes", "tests/cmd/rtex.in/ring.txt"]));
    runs.push(common::servowire(&["decode", "-p", "rtex", "--bytes", "tests/cmd/rtex.in/bad.txt"]));
    for run in runs {
        assert!(run.out.lines().count() > 1);
        for line in run.out.lines() {
            assert!(line.chars().count() <= 100, "{line}");
        }
    }
}

#[test]
fn completions_and_manual_pages() {
    for (shell, word) in [("bash", "complete -F"), ("zsh", "#compdef servowire"), ("fish", "complete -c servowire")] {
        let run = common::servowire(&["completions", shell]);
        assert!(run.is_good().out.contains(word), "{shell}");
    }
    let page = common::servowire(&["man"]);
    assert!(page.is_good().out.contains(".TH servowire 1"), "{}", page.out);
    let page = common::servowire(&["man", "decode"]);
    assert!(page.is_good().out.contains(".TH servowire-decode 1") && page.out.contains("\\-\\-errors"), "{}", page.out);
    assert_eq!(common::servowire(&["man", "nothing"]).code, 2);
}

#[test]
fn frequencies_have_units_everywhere() {
    let plain = common::servowire(&["cnc", "--steps", "100", "--freq", "100000"]);
    assert_eq!(plain.is_good().out, common::servowire(&["cnc", "--steps", "100", "--freq", "100kHz"]).out);
}

/// The rows of the README's table of keys: key, type, when.
fn schema() -> Vec<(String, String, String)> {
    let readme = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).unwrap();
    let table = readme.lines().skip_while(|line| *line != "| key | type | present |").skip(2);
    let rows = table.take_while(|line| line.starts_with('|')).map(|line| {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        (cells[1].trim_matches('`').to_owned(), cells[2].to_owned(), cells[3].to_owned())
    });
    rows.collect()
}

fn is_a(kind: &str, value: &Value) -> bool {
    match kind {
        "string" => value.is_string(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "`request` or `answer`" => value == "request" || value == "answer",
        "fields" => value.as_object().unwrap().values().all(|field| {
            let flags = |flags: &serde_json::Map<String, Value>| {
                flags.len() == 2
                    && flags["raw"].is_u64()
                    && flags["set"].as_array().unwrap().iter().all(Value::is_string)
            };
            field.is_number() || field.is_string() || field.as_object().is_some_and(flags)
        }),
        "position" => {
            let position = value.as_object().unwrap();
            position["name"].is_string()
                && position["counts"].is_i64()
                && position.get("turns").is_none_or(Value::is_number)
                && position.len() <= 3
        }
        other => panic!("the README has no type {other:?}"),
    }
}

#[test]
fn json_is_as_the_readme_has_it() {
    let schema = schema();
    assert!(schema.len() > 12, "the table of the README was not found");
    let bench = Bench::new();
    let mut slipped = Wave::new(2.5e6);
    slipped.idle_us(20.0).exchange(&[0x1a], &id3(1, 0, 0)).exchange(&[0x1a], &id3(2, 0, 0)).send(&[0x1a]).idle_us(3.0);
    let bits: Vec<bool> = id3(3, 0, 0).iter().flat_map(|byte| common::field(*byte)).collect();
    slipped.bits(&[&bits[..40], &bits[41..]].concat()).idle_us(60.0);
    let temperature = "../servowire-decode/captures/nikon-ti-console.vcd";
    let runs = [
        bench.decode("a.vcd", mixed().vcd(), &["--json"]),
        bench.decode("b.vcd", slipped.vcd(), &["--json"]),
        bench.decode("log.txt", "1A\n1A 20 29 C0 3B 17 00 00 00 C8 36\nzz\n", &["--bytes", "--json"]),
        common::servowire(&["decode", "--json", temperature]),
        common::servowire(&["decode", "--json", "-p", "hdsl"]),
        common::servowire(&["decode", "--json", "-p", "rtex", "--bytes", "tests/cmd/rtex.in/ring.txt"]),
    ];
    let mut seen = std::collections::BTreeSet::new();
    for event in runs.iter().flat_map(common::Run::json) {
        let event = event.as_object().unwrap();
        for (key, value) in event {
            let row = schema.iter().find(|(name, ..)| name == key);
            let (_, kind, _) = row.unwrap_or_else(|| panic!("the README does not know {key:?}"));
            assert!(is_a(kind, value), "{key} is {value}, not {kind}");
            seen.insert(key.clone());
        }
        for (key, _, when) in &schema {
            let due = match when.as_str() {
                "always" => true,
                "refused" => event["verdict"] != "ok",
                "with times" => !event.contains_key("line"),
                "a log without times" => !event.contains_key("start_ps"),
                "a recorded line" => event.contains_key("channel"),
                _ => continue,
            };
            assert_eq!(event.contains_key(key), due, "{key}: {when}");
        }
    }
    for (key, ..) in &schema {
        assert!(seen.contains(key), "no test shows {key:?}");
    }
}
