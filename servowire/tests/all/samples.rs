//! The same capture in every format, written by other programs or by hand.

use std::fmt::Write as _;
use std::path::PathBuf;

use crate::common;
use crate::common::{Bench, Run, Wave, id3, servowire};

fn sample(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/samples").join(name)
}

/// Positions of the seven answers of `captures/hpm-uart-readme.vcd`.
fn positions(run: &common::Run) -> Vec<i64> {
    run.json().iter().filter_map(|event| event["fields"]["ABS"].as_i64()).collect()
}

#[test]
fn one_capture_in_every_format() {
    let plain = common::decode(
        &PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../servowire-decode/captures/hpm-uart-readme.vcd"),
        &["--json"],
    );
    plain.is_good();
    let want = positions(&plain);
    assert_eq!(want.len(), 7);
    for name in [
        "hpm-uart-100M.sr",
        "hpm-uart-sigrok-dedup.csv",
        "hpm-uart-wrapped.fst",
        "hpm-uart.fst",
        "hpm-uart.vcd.gz",
        "hpm-uart.vcd.zst",
        "synthetic-dsview-v3.dsl",
        "synthetic-logic2-iso.csv",
        "synthetic-logic2-v0.bin",
        "synthetic-logic2-v1.bin",
        "synthetic-logic2.csv",
    ] {
        let run = common::decode(&sample(name), &["--json"]);
        assert_eq!((run.code, positions(&run)), (0, want.clone()), "{name}: {}", run.err);
    }
}

/// Eight channels of which three were recorded, at 1 MHz: read, and too slow for what is known.
#[test]
fn channels_of_a_sigrok_session() {
    for name in ["demo-3of4.bits", "demo-3of4.csv", "demo-3of4.hex", "demo-3of4.vcd", "demo-3of4-time.csv"] {
        common::decode(&sample(name), &[]).fails_with("channel \"D2\" runs at about 1.00 Mbit/s");
    }
    // Which has no names.
    common::decode(&sample("demo-3of4.ols"), &[]).fails_with("channel \"1\" runs at about 1.00 Mbit/s");
    common::decode(&sample("demo-3of4.sr"), &["--channel", "D1"]).fails_with("samples per bit are too few");
}

/// A byte order mark, a blank in a name, SystemVerilog types, a vector by its bits.
#[test]
fn an_odd_vcd() {
    let run = common::decode(&sample("odd.vcd"), &["--channel", "RX"]);
    run.fails_with("the file has \"RS485 A/B\", \"clk\", \"nib[0]\", \"nib[1]\", \"nib[2]\", \"nib[3]\"");
}

/// The line inside a vector, with a blank between value and code, and an unfinished last word.
#[test]
fn a_line_in_a_vector() {
    let mut wave = common::good_traffic(2.5e6);
    wave.idle_us(40.0);
    let mut text =
        "$timescale 1 ps $end $var wire 4 ab bus [7:4] $end $var string 1 c text $end $enddefinitions $end\n"
            .to_owned();
    for (time, level) in &wave.edges {
        writeln!(text, "#{time} b{}010 ab\nsx c", u8::from(*level)).unwrap();
    }
    let bench = common::Bench::new();
    let run = bench.decode("bus.vcd", &text, &["--json"]);
    run.is_good();
    assert_eq!((run.json().len(), run.json()[0]["channel"].as_str()), (common::GOOD_FRAMES, Some("bus[7]")));
    let run = bench.decode("bus.vcd", text + "#10", &["--json"]);
    run.fails_with("the file ends in the middle of a time: it was cut off");
}

/// A window far inside a long recording is decoded from shortly before it, with what was learnt at the beginning; nothing between
/// is read, so that nothing of it is seen although it is damaged.
#[test]
fn a_window_in_the_middle() {
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(100.0);
    let mut starts = Vec::new();
    for k in 0..9_000_u32 {
        starts.push(wave.end);
        wave.exchange(&[0x1a], &id3(k, 5, 0));
    }
    let bench = Bench::new();
    for (format, packed) in [(&["--format", "packed"][..], true), (&["--channel", "3"], false)] {
        let samples = if packed { wave.packed(20e6) } else { wave.raw(20e6, 3) };
        let path = bench.file("long.bin", &samples);
        let path = path.to_str().unwrap();
        let (from, to) = (format!("{}ps", starts[8_000]), format!("{}ps", starts[8_010]));
        let window = [&["decode", path, "--rate", "20M", "--json", "--from", &from, "--to", &to][..], format].concat();
        let whole = servowire(&window);
        let shown = |run: &Run| {
            let position = |event: &serde_json::Value| event["position"]["counts"].as_u64();
            run.json().iter().filter_map(position).collect::<Vec<_>>()
        };
        let due: Vec<u64> = (8_000..8_010).map(|k| 5 << 23 | k).collect();
        assert_eq!(shown(whole.is_good()), due);
        // Whatever was in between.
        let mut spoilt = samples.clone();
        let (begin, end) = (samples.len() / 3, samples.len() / 2);
        spoilt[begin..end].iter_mut().enumerate().for_each(|(k, byte)| *byte = (k / 3 % 251) as u8);
        let again =
            servowire(&[&window[..1], &[bench.file("spoilt.bin", spoilt).to_str().unwrap()], &window[2..]].concat());
        assert_eq!(again.is_good().out.replace("spoilt.bin", "long.bin"), whole.out);
    }
}
