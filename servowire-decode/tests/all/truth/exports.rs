//! The files that are made of events: JSON, tables and figures, against the truth.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Cursor;

use serde_json::Value;
use servowire_decode::capture::{self, Capture, Hints, Input};
use servowire_decode::codec::Codec;
use servowire_decode::output::Output;
use servowire_decode::output::json::JsonLines;
use servowire_decode::output::stats::Stats;
use servowire_decode::output::table::Csv;
use servowire_decode::settings::{Rtex, Settings};

use super::bus::{Bus, Kind, build};
use super::line::{Recording, record};
use super::rng::Rng;
use super::{Said, Shown, dsl, memory, packets, ring};
use crate::protocol;

type Row = BTreeMap<String, String>;

/// What was written.
struct Exports {
    json: Vec<Value>,
    rows: Vec<Row>,
    figures: Vec<Value>,
}

fn lines(text: &[u8]) -> Vec<Value> {
    String::from_utf8_lossy(text).lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn exports(capture: Capture, protocol: Option<&'static dyn Codec>, settings: &Settings) -> Exports {
    let (mut json, mut table, mut figures) = (Vec::new(), Vec::new(), Vec::new());
    let (mut first, mut second) = (JsonLines::new(&mut json), Csv::new(&mut table));
    let mut third = Stats::new(&mut figures, None).in_json();
    let mut out = Output::new("x", &mut first).with_beside(Some(&mut second)).with_beside(Some(&mut third));
    out.begin().unwrap();
    let _ = servowire_decode::decode("x", capture, protocol, settings, &mut out);
    out.end().unwrap();
    drop((first, second, third));
    let mut reader = csv::Reader::from_reader(table.as_slice());
    let rows = reader.deserialize().map(Result::unwrap).collect();
    Exports { json: lines(&json), rows, figures: lines(&figures) }
}

/// Whether a value of a file is the true one; names of flags only where they are beside it.
fn is_true(value: &Value, due: &Shown) -> bool {
    let number = value.as_i64().or(value["raw"].as_i64());
    match due {
        Shown::Number(due) => number == Some(*due),
        Shown::Near(due) => number.is_some_and(|it| (it as f64 - due).abs() <= 1.0),
        Shown::Within(due, near) => number.is_some_and(|it| (it as f64 - due).abs() <= *near),
        Shown::Text(due) => value.as_str() == Some(due),
        Shown::Flags(raw, names) => {
            number == i64::try_from(*raw).ok() && value.get("set").is_none_or(|set| *set == Value::from(names.clone()))
        }
        Shown::Either(both) => both.iter().any(|due| is_true(value, due)),
        Shown::Any => true,
    }
}

/// Whether it is shown as a text.
fn is_text(due: &Shown) -> bool {
    match due {
        Shown::Text(_) => true,
        Shown::Either(both) => both.iter().any(is_text),
        _ => false,
    }
}

/// A cell as what it says, where a text or a number is due.
fn cell(text: &str, due: Option<&Shown>) -> Value {
    let number = text.parse::<i64>().ok().filter(|_| !due.is_some_and(is_text));
    number.map_or_else(|| Value::from(text), Value::from)
}

/// Picoseconds of a cell in microseconds.
fn picoseconds(text: &str) -> f64 {
    let digits = text.replace('.', "");
    assert_eq!(text.split_once('.').map(|(_, part)| part.len()), Some(6), "{text}");
    digits.parse::<i128>().unwrap() as f64
}

/// What is wrong in the files.
fn wrong(exports: &Exports, said: &[Said]) -> (usize, Vec<String>) {
    let (mut shown, mut wrong) = (0, Vec::new());
    assert_eq!(exports.json.len(), exports.rows.len());
    let mut met = vec![false; said.len()];
    for (object, row) in exports.json.iter().zip(&exports.rows) {
        if object["verdict"] != "ok" || object["kind"] == "cut" || object["kind"] == "log" {
            continue;
        }
        let start = object["start_ps"].as_f64().or(object["line"].as_f64()).unwrap();
        let same =
            |at: &usize| said[*at].kind == *object["kind"].as_str().unwrap() && (said[*at].start - start).abs() <= 4e5;
        let near = |at: &usize| ((said[*at].start - start).abs() * 1e3) as i64;
        let Some(at) = (0..said.len()).filter(|at| !met[*at] && same(at)).min_by_key(near) else {
            wrong.push(format!("nothing like it was said: {object}"));
            continue;
        };
        met[at] = true;
        let due = |name: &str| said[at].fields.iter().find(|(field, _)| *field == name).map(|(_, due)| due);
        let mut check = |what: &str, name: &str, value: &Value| {
            shown += 1;
            let note = name == "note" && said[at].damaged;
            if !note && !due(name).is_some_and(|due| is_true(value, due)) {
                wrong.push(format!("{what}: {} {name} is {value}, true is {:?}", said[at].kind, due(name)));
            }
        };
        for (name, value) in object["fields"].as_object().unwrap() {
            check("JSON", name, value);
            check("table", name, &cell(&row[name], due(name)));
        }
        if !object["delay_ps"].is_null() {
            check("JSON", "delay", &object["delay_ps"]);
            check("table", "delay", &Value::from(picoseconds(&row["delay_us"]) as i64));
        }
        if let Some(counts) = object["position"]["counts"].as_i64() {
            let turns = object["position"]["turns"].as_f64();
            let cells = [row["position"].parse().ok(), Some(counts)];
            // Of an encoder of 23 bits.
            let told = turns.filter(|_| object["protocol"] == "T-Format");
            let true_turns = told.is_none_or(|turns| (turns - counts as f64 / f64::from(1 << 23)).abs() < 1e-9);
            let same_turns = match (row["turns"].parse::<f64>(), turns) {
                (Ok(cell), Some(turns)) => (cell - turns).abs() < 1e-9,
                (cell, turns) => cell.is_err() && turns.is_none(),
            };
            if cells != [said[at].position.map(|(_, counts)| counts); 2] || !true_turns || !same_turns {
                wrong.push(format!("position {}, {row:?}, true is {:?}", object["position"], said[at].position));
            }
        }
        let places = [("start_us", "start_ps"), ("end_us", "end_ps")];
        for (cell, value) in places.iter().filter(|_| object["line"].is_null()) {
            if picoseconds(&row[*cell]).to_bits() != object[value].as_f64().unwrap().to_bits() {
                wrong.push(format!("{cell} {}, {value} {}", row[*cell], object[value]));
            }
        }
    }
    (shown, wrong)
}

/// The figures of each who speaks, counted again from its frames.
fn miscounted(exports: &Exports) -> Vec<String> {
    let mut wrong = Vec::new();
    for figures in &exports.figures {
        let own: Vec<&Value> = exports.json.iter().filter(|it| it["address"] == figures["address"]).collect();
        let ok = own.iter().filter(|it| it["verdict"] == "ok" && it["kind"] != "cut" && it["kind"] != "log").count();
        let delays: Vec<i64> = own.iter().filter_map(|it| it["delay_ps"].as_i64()).collect();
        let mut requests =
            own.iter().filter(|it| it["direction"] == "request").filter_map(|it| it["start_ps"].as_i64());
        let mut cycles = Vec::new();
        if let Some(mut before) = requests.next() {
            for start in requests {
                cycles.push(start - before);
                before = start;
            }
        }
        let spread = |values: &[i64]| {
            let mean = values.iter().sum::<i64>() as f64 / values.len() as f64;
            (values.len() as u64, values.iter().min().copied(), values.iter().max().copied(), mean)
        };
        let mut last = BTreeMap::new();
        for it in own.iter().filter(|it| it["position"]["counts"].is_i64() && it["start_ps"].is_i64()) {
            last.insert(it["position"]["name"].as_str().unwrap(), it["position"]["counts"].as_i64().unwrap());
        }
        let mut due = vec![("ok", Value::from(ok)), ("last_positions", serde_json::json!(last))];
        for (name, values) in [("answer_delay", &delays), ("cycle", &cycles)] {
            let (count, least, most, mean) = spread(values);
            let is = &figures[name];
            let near = is["mean_ps"].as_f64().is_some_and(|is| (is - mean).abs() < 1.0);
            if count > 0
                && (is["count"] != count
                    || is["min_ps"] != Value::from(least)
                    || is["max_ps"] != Value::from(most)
                    || !near)
            {
                wrong.push(format!("{name} {is}, counted {count} {least:?} {most:?} {mean}"));
            }
        }
        due.retain(|(name, due)| figures[*name] != *due);
        wrong.extend(due.iter().map(|(name, due)| format!("{name} {}, counted {due}", figures[*name])));
    }
    wrong
}

fn hold(what: &str, capture: Capture, said: &[Said], protocol: Option<&'static dyn Codec>, settings: &Settings) {
    let exports = exports(capture, protocol, settings);
    let (shown, mut wrong) = wrong(&exports, said);
    wrong.extend(miscounted(&exports));
    assert!(shown > 100 && !exports.figures.is_empty(), "{what}: {shown}");
    assert!(wrong.is_empty(), "{what}: {} of {shown}\n{}", wrong.len(), wrong[..wrong.len().min(12)].join("\n"));
}

#[test]
fn files_of_lines_are_true() {
    for (kind, name) in [(Kind::Tformat, "T-Format"), (Kind::Aformat, "A-format")] {
        for seed in 0..6 {
            let damaged = f64::from(seed % 2) * 0.2;
            let bus = Bus { kind, damaged, missing: damaged / 2.0, ..Bus::PLAIN };
            let (wire, said, end) = build(&bus, u64::from(seed as u8));
            let edges = record(&wire, Recording::EXACT, &mut Rng::new(7));
            hold(&format!("{name}, seed {seed}"), memory(&edges, end), &said, None, &Settings::default());
        }
    }
}

#[test]
fn files_of_links_are_true() {
    for seed in 0..3 {
        let link = dsl::Link { speed: 1000, delay: 3.0, ..dsl::Link::PLAIN };
        let built = dsl::build(&link, seed);
        let edges = record(&built.wire, Recording::EXACT, &mut Rng::new(7));
        hold(&format!("DSL, seed {seed}"), memory(&edges, built.end), &built.said, None, &Settings::default());
    }
}

#[test]
fn files_of_blocks_are_true() {
    for seed in 0..4 {
        let mut text = String::new();
        let mut said = Vec::new();
        for block in ring::build(&ring::Ring { drives: 3, asked: 0.5, ..ring::Ring::PLAIN }, seed) {
            let side = if block.from_master { "TX" } else { "RX" };
            let _ = write!(text, "0.{:09} {side} ", block.ns);
            for byte in &block.bytes {
                let _ = write!(text, "{byte:02x}");
            }
            text.push('\n');
            let mut it = block.said;
            it.fields.push(("note", Shown::Any));
            said.push(it);
        }
        let capture = capture::open(Input::over("log.txt", Cursor::new(text)), Hints::default()).unwrap();
        let settings = Settings { rtex: Rtex { whole: true, ..Rtex::default() }, ..Settings::default() };
        hold(&format!("RTEX, seed {seed}"), capture, &said, Some(protocol("rtex")), &settings);
    }
}

#[test]
fn files_of_packets_are_true() {
    for seed in 0..4 {
        let all = packets::build(&packets::Network { damaged: 0.1, ..packets::Network::PLAIN }, seed);
        let file = packets::File { check: packets::Check::Told, epoch: 0, units: 9, big: false };
        let said: Vec<Said> = all.iter().filter_map(|packet| packet.said.clone()).collect();
        let capture = capture::open(Input::over("net", Cursor::new(file.pcapng(&all))), Hints::default()).unwrap();
        hold(&format!("SORTE, seed {seed}"), capture, &said, None, &Settings::default());
    }
}
