//! What Surfer shows of the VCD that decoding writes: read by the library with which Surfer reads it.

use std::path::Path;

use wellen::SignalValue;
use wellen::simple::{Waveform, read};

use crate::common::{self, Bench, Wave, good_traffic, id3};

/// A file as the viewer has it, with the times in picoseconds.
struct Viewed {
    waves: Waveform,
    tick: i64,
}

impl Viewed {
    fn open(path: &Path) -> Self {
        let waves = read(path).unwrap();
        let scale = waves.hierarchy().timescale().unwrap();
        let exponent = scale.unit.to_exponent().unwrap() + 12;
        let tick = i64::from(scale.factor) * 10_i64.pow(exponent.unsigned_abs().into());
        assert!(exponent >= 0);
        Self { waves, tick }
    }

    /// The changes of a variable: from when on it has which value.
    fn changes(&mut self, scope: &str, name: &str) -> Vec<(i64, String)> {
        let hierarchy = self.waves.hierarchy();
        let var = hierarchy.lookup_var(&[scope], &name).unwrap_or_else(|| panic!("{scope}.{name}"));
        let signal = hierarchy[var].signal_ref();
        self.waves.load_signals(&[signal]);
        let times = self.waves.time_table();
        let changes = self.waves.get_signal(signal).unwrap().iter_changes();
        let text = |value| match value {
            SignalValue::String(text) => text.to_owned(),
            value => value.to_bit_string().unwrap(),
        };
        changes.map(|(at, value)| (times[at as usize] as i64 * self.tick, text(value))).collect()
    }
}

/// The value at a time.
fn at(changes: &[(i64, String)], time: i64) -> &str {
    changes.iter().rev().find(|(from, _)| *from <= time).map_or("", |(_, value)| value)
}

/// Each event of a run is seen at its place, and nothing after it.
fn holds(run: &common::Run, viewed: &mut Viewed) -> usize {
    let (frames, verdicts) = (viewed.changes("decoded_line", "frame"), viewed.changes("decoded_line", "verdict"));
    let positions = viewed.changes("decoded_line", "ABS");
    let events = run.json();
    for event in &events {
        let time = |key: &str| event[key].as_i64().unwrap();
        let middle = (time("start_ps") + time("end_ps")) / 2;
        let said = format!("{}_{}", event["direction"].as_str().unwrap(), event["kind"].as_str().unwrap());
        assert_eq!(at(&frames, middle), said.replace(' ', "_"), "{event}");
        let good = event["verdict"] == "ok";
        assert_eq!(at(&verdicts, middle) == "ok", good, "{event}: {}", at(&verdicts, middle));
        let shown = event["fields"]["ABS"].as_i64().map_or("-".to_owned(), |abs| abs.to_string());
        assert_eq!(at(&positions, middle), shown, "{event}");
        assert_eq!(at(&frames, time("end_ps") + viewed.tick), "-", "{event}");
    }
    events.len()
}

#[test]
fn the_vcd_in_the_reader_of_surfer() {
    let bench = Bench::new();
    let (wave, out) = (good_traffic(2.5e6), bench.path("out.vcd"));
    let to = out.to_str().unwrap();
    let run = bench.decode("a.vcd", wave.vcd(), &["--json", "--vcd", to]);
    let mut viewed = Viewed::open(&out);
    let line = viewed.changes("capture", "line");
    let level = |level: bool| if level { "1" } else { "0" }.to_owned();
    assert_eq!(line, wave.edges.iter().map(|(time, high)| (*time, level(*high))).collect::<Vec<_>>());
    assert!(holds(&run, &mut viewed) > 10);

    // A piece of it.
    let run = bench.decode("a.vcd", wave.vcd(), &["--json", "--cut", "90us..360us", "-o", to]);
    assert_eq!(holds(&run, &mut Viewed::open(&out)), 6);
}

/// Only the time around a refused frame: the line has no level before and an unknown one after it.
#[test]
fn faults_in_the_reader_of_surfer() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..40_u32 {
        let mut answer = id3(1000 + k, 0, 0);
        answer[5] ^= u8::from(k == 20);
        wave.exchange(&[0x1a], &answer).idle_us(40.0);
    }
    let out = bench.path("faults.vcd");
    let arguments = ["--json", "--errors", "--around", "60us", "-o", out.to_str().unwrap()];
    let run = bench.decode("a.vcd", wave.vcd(), &arguments);
    let mut viewed = Viewed::open(&out);
    assert_eq!(holds(&run, &mut viewed), 1);
    let line = viewed.changes("capture", "line");
    let (first, last) = (line.first().unwrap(), line.last().unwrap());
    assert!(first.0 > 2_500_000_000, "{line:?}");
    assert_eq!((first.1.as_str(), last.1.as_str()), ("1", "x"), "{line:?}");
    assert!(line.iter().any(|(_, level)| level == "0") && line.len() < wave.edges.len() / 4);
}
