//! Holes in a recording: what is missing there is nobody's fault on the line.

use std::fmt::Write as _;

use crate::common::{Bench, Run, Wave, id3};

const US: i64 = 1_000_000;

/// Ten exchanges, one every 150 us from 100 us on: 4 us of request, 3 us of pause, 44 us of answer.
fn exchanges() -> Wave {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(100.0);
    for k in 0..10 {
        wave.send(&[0x1a]).idle_us(3.0).send(&id3(1000 + 10 * k, 7, 0)).idle_us(99.0);
    }
    wave
}

/// Begin of the exchange `k`.
const fn begin(k: i64) -> i64 {
    (100 + 150 * k) * US
}

fn level(wave: &Wave, time: i64) -> bool {
    wave.edges.iter().take_while(|(at, _)| *at <= time).last().unwrap().1
}

/// As Logic 2 writes it: `X` where there are no data.
fn table(wave: &Wave, from: i64, to: i64) -> String {
    let mut text = "Time [s],Channel 0\n".to_owned();
    let mut row = |time: i64, cell: &str| {
        writeln!(text, "{}.{:012},{cell}", time / 1_000_000_000_000, time % 1_000_000_000_000).unwrap();
    };
    let cell = |level: bool| if level { "1" } else { "0" };
    wave.edges.iter().filter(|(time, _)| *time < from).for_each(|(time, level)| row(*time, cell(*level)));
    row(from, "X");
    row(to, cell(level(wave, to)));
    wave.edges.iter().filter(|(time, _)| *time > to).for_each(|(time, level)| row(*time, cell(*level)));
    row(wave.end, "1");
    text
}

/// As version 1 of the binary export has it: two chunks.
fn chunks(wave: &Wave, from: i64, to: i64) -> Vec<u8> {
    let seconds = |time: i64| (time as f64 / 1e12).to_le_bytes();
    let mut out = b"<SALEAE>".to_vec();
    out.extend([1_i32.to_le_bytes(), 0_i32.to_le_bytes()].concat());
    out.extend(2_u64.to_le_bytes());
    for (begin, end) in [(0, from), (to, wave.end)] {
        let edges: Vec<_> = wave.edges.iter().map(|(time, _)| *time).filter(|t| (begin + 1..end).contains(t)).collect();
        out.extend(u32::from(level(wave, begin)).to_le_bytes());
        out.extend([50e6_f64.to_le_bytes(), seconds(begin), seconds(end)].concat());
        out.extend((edges.len() as u64).to_le_bytes());
        out.extend(edges.into_iter().flat_map(seconds));
    }
    out
}

/// Both files with a hole give the same frames: those.
#[track_caller]
fn reads(from: i64, to: i64) -> Run {
    let (bench, wave) = (Bench::new(), exchanges());
    let runs = [
        bench.decode("a.csv", table(&wave, from, to), &["--json"]),
        bench.decode("a.bin", chunks(&wave, from, to), &["--json"]),
    ];
    let [csv, bin] = &runs;
    let times =
        |run: &Run| run.json().iter().map(|e| (e["start_ps"].clone(), e["verdict"].clone())).collect::<Vec<_>>();
    assert_eq!(times(csv), times(bin));
    runs.into_iter().next().unwrap()
}

fn good(run: &Run) -> usize {
    run.json().iter().filter(|event| event["kind"] == "ID 3" && event["verdict"] == "ok").count()
}

#[test]
fn a_hole_between_two_exchanges_costs_nothing() {
    let run = reads(begin(4) + 80 * US, begin(5) - 20 * US);
    run.is_good();
    assert_eq!(good(&run), 20);
}

/// Whole exchanges are missing: nobody was silent.
#[test]
fn exchanges_in_a_hole() {
    let run = reads(begin(4) - 20 * US, begin(7) - 20 * US);
    run.is_good();
    assert_eq!(good(&run), 14);
}

/// The request was recorded, its answer was not.
#[test]
fn an_answer_in_a_hole() {
    let run = reads(begin(4) + 5 * US, begin(5) - 20 * US);
    run.is_good();
    assert_eq!(good(&run), 19);
}

#[test]
fn a_hole_begins_inside_an_answer() {
    let run = reads(begin(4) + 20 * US, begin(5) - 20 * US);
    run.fails_with("truncated 1 (recording stopped there for a while)");
    assert_eq!(good(&run), 19);
    assert!(run.out.contains("a hole in the recording begins inside the frame"), "{}", run.out);
}

/// The rest of an answer after a hole is a piece of a frame, and the request before it stays.
#[test]
fn a_hole_ends_inside_an_answer() {
    let run = reads(begin(4) + 5 * US, begin(4) + 20 * US + 123_456);
    run.is_good();
    assert_eq!(good(&run), 19);
    assert!(run.out.contains("\"kind\":\"cut\""), "{}", run.out);
}

/// The hole lies inside one answer: both pieces of it are named, and neither is joined to the other.
#[test]
fn a_hole_inside_an_answer() {
    let run = reads(begin(4) + 20 * US, begin(4) + 30 * US + 123_456);
    run.fails_with("truncated 1 (recording stopped there for a while)");
    assert_eq!(good(&run), 19);
}

/// Only the rest of the request stands after it, and its answer: that one is whole.
#[test]
fn a_hole_ends_inside_a_request() {
    let run = reads(begin(3) + 80 * US, begin(4) + 2 * US + 123_456);
    run.is_good();
    assert_eq!(good(&run), 19);
}

/// A hole wherever it likes: no frame is wrong, and none of the others is lost.
#[test]
fn holes_everywhere() {
    for k in 0..60 {
        let from = begin(4) - 3 * US + k * 1_010_101;
        let run = reads(from, begin(6) - 20 * US);
        assert!(good(&run) >= 16, "{from}: {}\n{}", run.out, run.err);
        let wrong: Vec<String> = run
            .json()
            .iter()
            .map(|e| e["verdict"].to_string())
            .filter(|v| v != "\"ok\"" && v != "\"truncated\"")
            .collect();
        assert!(wrong.is_empty(), "{from}: {wrong:?}\n{}", run.out);
    }
}
