//! The same line through every file format.

use std::fmt::Write as _;

use crate::common;
use crate::common::{Bench, GOOD_FRAMES, Run, good_traffic};

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

/// What PowerShell makes of `sigrok-cli ... > file`.
#[test]
fn text_in_utf_16() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let little = |text: &str| -> Vec<u8> { text.encode_utf16().flat_map(u16::to_le_bytes).collect() };
    let big = |text: &str| -> Vec<u8> { text.encode_utf16().flat_map(u16::to_be_bytes).collect() };
    for text in [wave.vcd(), wave.saleae_csv()] {
        let text = format!("\u{feff}{text}").replace('\n', "\r\n");
        for bytes in [little(&text), big(&text)] {
            all_good(&bench.decode("a.txt", bytes, &["--json"]));
        }
    }
    let log = little("\u{feff}1A\r\n1A 20 29 C0 3B 17 00 00 00 C8 37\r\n");
    assert_eq!(bench.decode("log.txt", log, &["--json"]).is_good().json().len(), 2);
    // Samples may begin as they like.
    let mut raw = wave.raw(20e6, 3);
    raw.splice(0..2, [0xff, 0xfe]);
    assert_eq!(bench.decode("a.raw", raw, &["--json", "--rate", "20M"]).json().len(), GOOD_FRAMES);
}

/// Times between two units: `#20.4` of a microsecond.
#[test]
fn fractions_of_the_unit_of_a_vcd() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let mut text = "$timescale 1 us $end\n$var wire 1 ! line $end\n$enddefinitions $end\n".to_owned();
    for (time, level) in &wave.edges {
        write!(text, "#{}.{:06}\n{}!\n", time / 1_000_000, time % 1_000_000, u8::from(*level)).unwrap();
    }
    all_good(&bench.decode("a.vcd", &text, &["--json"]));
    let back = bench.decode("a.vcd", text + "#1.25\n#1.125\n", &["--json"]);
    back.fails_with("time goes back");
    bench.decode("b.vcd", wave.vcd() + "#9999999999.x\n", &[]).fails_with("#9999999999.x is not a time");
}

/// Extended VCD: the range of a port stands in the place of its width, a letter a line, then the strengths.
#[test]
fn ports_of_several_lines() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let mut text = "$timescale 1 ps $end\n$var port [2:0] <0 pair $end\n$enddefinitions $end\n".to_owned();
    for (time, level) in &wave.edges {
        // Driven from outside and by the device; the third line is fought for.
        write!(text, "#{time}\np{}LA 066 600 <0\n", if *level { 'U' } else { 'D' }).unwrap();
    }
    let file = bench.file("a.evcd", text);
    all_good(&common::decode(&file, &["--json"]));
    all_good(&common::decode(&file, &["--json", "--channel", "pair[2]"]));
    common::decode(&file, &["--channel", "pair[0]"]).fails_with("no traffic on channel \"pair[0]\"");
}

/// Drawn levels, as `sigrok-cli -O ascii` writes them: an edge is drawn in the place of the level after it.
#[test]
fn samples_that_are_drawn() {
    let bench = Bench::new();
    let samples = good_traffic(2.5e6).samples(20e6);
    let mut last = samples[0];
    let mut drawn = String::new();
    for level in samples {
        drawn.push(match (last, level) {
            (true, true) => '"',
            (false, false) => '.',
            (false, true) => '/',
            (true, false) => '\\',
        });
        last = level;
    }
    let mut text = "libsigrok 0.5.2\nAcquisition with 1/1 channels at 20 MHz\n".to_owned();
    for line in drawn.as_bytes().chunks(74) {
        writeln!(text, "A: B:{}", std::str::from_utf8(line).unwrap()).unwrap();
    }
    let run = bench.decode("a.txt", text, &["--json"]);
    all_good(&run);
    assert_eq!(run.json()[0]["channel"], "A: B");
}

/// Levels and nothing else: the user knows how fast they were taken.
#[test]
fn a_table_without_times() {
    let bench = Bench::new();
    let samples = good_traffic(2.5e6).samples(20e6);
    let text: String = samples.iter().map(|level| if *level { "1\n" } else { "0\n" }).collect();
    all_good(&bench.decode("a.csv", &text, &["--json", "--format", "csv", "--rate", "20M"]));
    bench.decode("a.csv", &text, &[]).fails_with("is said with --format csv --rate");
}

/// What `sigrok-cli -I` writes in front of its outputs: text, VCD, and samples, whose rate nobody has to say then.
#[test]
fn a_line_of_sigrok_before_the_capture() {
    let bench = Bench::new();
    let (wave, meta) = (good_traffic(2.5e6), "META samplerate: 20000000\n");
    let mut text = format!("{meta}libsigrok 0.5.2\nAcquisition with 1/1 channels at 20 MHz\n");
    for chunk in wave.samples(20e6).chunks(64) {
        let bits: String = chunk.iter().map(|level| if *level { '1' } else { '0' }).collect();
        writeln!(text, "D0:{bits}").unwrap();
    }
    all_good(&bench.decode("a.bits", &text, &["--json"]));
    all_good(&bench.decode("a.vcd", format!("{meta}{}", wave.vcd()), &["--json"]));
    let samples = [meta.as_bytes(), &wave.raw(20e6, 0)].concat();
    all_good(&bench.decode("a.bin", &samples, &["--json"]));
    all_good(&bench.decode("b.bin", &samples, &["--json", "--rate", "20M"]));
    // The line alone is no capture.
    bench.decode("c.bin", meta, &[]).fails_with("the file is empty");
}
