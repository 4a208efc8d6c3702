//! The same line through every file format.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

mod common;

use common::{Bench, GOOD_FRAMES, Run, good_traffic};

#[track_caller]
fn all_good(run: &Run) {
    run.is_good();
    assert_eq!(run.json().len(), GOOD_FRAMES, "{}", run.out);
    assert!(run.verdicts().iter().all(|verdict| verdict == "ok"));
}

/// Kinds, fields, positions: what does not depend on how exactly the edges were recorded.
fn said(run: &Run) -> Vec<String> {
    let one = |e: &serde_json::Value| format!("{} {} {} {}", e["direction"], e["kind"], e["fields"], e["position"]);
    run.json().iter().map(one).collect()
}

#[test]
fn every_format_gives_the_same_frames() {
    let bench = Bench::new();
    for rate in [2.5e6, 5e6] {
        let wave = good_traffic(rate);
        let vcd = bench.decode("a.vcd", wave.vcd(), &["--json"]);
        all_good(&vcd);
        let others = [
            bench.decode("a.csv", wave.saleae_csv(), &["--json"]),
            bench.decode("digital_0.bin", wave.saleae_binary(), &["--json"]),
            bench.decode("a.raw", wave.raw(40e6, 3), &["--json", "--rate", "40M", "--channel", "3"]),
            bench.decode("b.raw", wave.raw(40e6, 7), &["--json", "--rate", "40M"]),
            bench.decode("c.raw", wave.raw(24e6, 0), &["--json", "--rate", "24M"]),
            bench.decode("d.raw", wave.packed(100e6), &["--json", "--rate", "100M", "--format", "packed"]),
        ];
        for run in &others {
            all_good(run);
            assert_eq!(said(run), said(&vcd));
        }
    }
}

#[test]
fn samples_of_several_bytes() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    for unit in [2, 3, 8] {
        let samples = wave.samples(20e6);
        let wide: Vec<u8> =
            samples.iter().flat_map(|&s| (0..unit).map(move |k| if k == 1 { u8::from(s) << 2 } else { 0 })).collect();
        let options = ["--json", "--rate", "20M", "--unit-size", &unit.to_string()];
        all_good(&bench.decode("wide.raw", wide, &options));
    }
}

/// The fast path over packed samples and the general one give the same events at the same times.
#[test]
fn packed_samples_and_edges_agree() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let file = bench.file("a.raw", wave.packed(20e6));
    let vcd = bench.path("out.vcd");
    let fast = common::decode(&file, &["--json", "--rate", "20M", "--format", "packed"]);
    let options = ["--json", "--rate", "20M", "--format", "packed", "--vcd", vcd.to_str().unwrap()];
    let general = common::decode(&file, &options);
    all_good(&fast);
    assert_eq!(fast.out, general.out);
}

/// A long recording: blocks of the reader end everywhere in the frames.
#[test]
fn frames_across_the_blocks_of_the_reader() {
    let bench = Bench::new();
    let mut wave = good_traffic(2.5e6);
    for k in 0..2000 {
        wave.idle_us(0.05 * f64::from(k % 7)).exchange(&[0x1a], &common::id3(k, 0, 0));
    }
    let want = GOOD_FRAMES + 4000;
    for run in [
        bench.decode("long.raw", wave.packed(50e6), &["--json", "--rate", "50M", "--format", "packed"]),
        bench.decode("bytes.raw", wave.raw(25e6, 1), &["--json", "--rate", "25M"]),
        bench.decode("long.vcd", wave.vcd(), &["--json"]),
        bench.decode("long.csv", wave.saleae_csv(), &["--json"]),
        bench.decode("long.bin", wave.saleae_binary(), &["--json"]),
    ] {
        run.is_good();
        assert_eq!(run.json().len(), want);
    }
}

#[test]
fn times_before_the_trigger() {
    let bench = Bench::new();
    let text = good_traffic(2.5e6).saleae_csv();
    let earlier: String = text
        .lines()
        .map(|line| match line.split_once(',') {
            Some((time, level)) if level.len() == 1 => {
                format!("{:.9},{level}\n", time.parse::<f64>().unwrap() - 0.000_1)
            }
            _ => format!("{line}\n"),
        })
        .collect();
    let run = bench.decode("early.csv", earlier, &["--json"]);
    all_good(&run);
    assert_eq!(run.json()[0]["start_ps"], -70_000_000);
}

#[test]
fn hex_logs() {
    let bench = Bench::new();
    let log = "# position and turns\n1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n02 0220b4bd1c37\n0x92,0x92,0x00,0x17,0x85\n\
        EA 01 EB\nEA 01 5A B1\n02 20 50 A9 78 A3\n# with the echo of the request\n1A\n1A1A2029C03B17000000C837\n\
        # two exchanges on a line\n020220b4bd1c37 020220b4bd1c37\n";
    let run = bench.decode("log.txt", log, &["--bytes", "--json"]);
    run.is_good();
    let kinds: Vec<String> =
        run.json().iter().map(|e| format!("{} {} {}", e["line"], e["direction"], e["kind"])).collect();
    let want = [
        "2 \"request\" \"ID 3\"",
        "3 \"answer\" \"ID 3\"",
        "4 \"request\" \"ID 0\"",
        "4 \"answer\" \"ID 0\"",
        "5 \"request\" \"ID 2\"",
        "5 \"answer\" \"ID 2\"",
        "6 \"request\" \"ID D\"",
        "7 \"answer\" \"ID D\"",
        "8 \"answer\" \"ID 0\"",
        "10 \"request\" \"ID 3\"",
        "11 \"answer\" \"ID 3\"",
        "13 \"request\" \"ID 0\"",
        "13 \"answer\" \"ID 0\"",
        "13 \"request\" \"ID 0\"",
        "13 \"answer\" \"ID 0\"",
    ];
    assert_eq!(kinds, want);
}

#[test]
fn several_files_and_the_standard_input() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let (a, b) = (bench.file("a.vcd", wave.vcd()), bench.file("b.csv", wave.saleae_csv()));
    let run = common::servowire(&["decode", "--json", a.to_str().unwrap(), b.to_str().unwrap()]);
    run.is_good();
    assert_eq!(run.json().len(), 2 * GOOD_FRAMES);
    let piped = std::process::Command::new(env!("CARGO_BIN_EXE_servowire"))
        .args(["decode", "--json", "-"])
        .stdin(std::fs::File::open(a).unwrap())
        .output()
        .unwrap();
    assert!(piped.status.success());
    assert_eq!(piped.stdout.split(|b| *b == b'\n').count(), GOOD_FRAMES + 1);
}

/// The names of channels: alone where they are unique, with their scopes where not, or by number.
#[test]
fn channels_of_a_vcd() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let text = wave.vcd().replace(
        "$var wire 1 ! line $end\n",
        "$var wire 8 @ bus $end\n$scope module inner $end\n$var wire 1 ! line $end\n$upscope $end\n\
         $scope module other $end\n$var wire 1 % line $end\n$var wire 1 & clock $end\n$upscope $end\n",
    );
    let file = bench.file("scopes.vcd", text);
    all_good(&common::decode(&file, &["--json"]));
    all_good(&common::decode(&file, &["--json", "--channel", "m.inner.line"]));
    all_good(&common::decode(&file, &["--json", "--channel", "0"]));
    common::decode(&file, &["--channel", "clock"]).fails_with("no traffic on channel \"clock\": 0 edges");
}
