//! Finding the line: rate, polarity, channel, and where a recording begins and ends.

use std::fmt::Write as _;

use crate::common;
use crate::common::{Bench, GOOD_FRAMES, Wave, good_traffic, id3};

#[test]
fn rates_within_the_tolerance_are_found() {
    let bench = Bench::new();
    for nominal in [2.5e6, 5e6] {
        for off in [-2.4, -1.54, 0.0, 1.0, 2.4] {
            let wave = good_traffic(nominal * (1.0 + off / 100.0));
            let run = bench.decode("a.vcd", wave.vcd(), &["--json"]);
            run.is_good();
            assert_eq!(run.json().len(), GOOD_FRAMES);
            let said = format!("{} Mbit/s ({off:+.2} % on the line)", nominal / 1e6);
            assert!(run.err.contains(&said), "{said} not in {}", run.err);
            // 24 MHz are 9.6 and 4.8 samples a bit.
            let run = bench.decode("a.raw", wave.raw(24e6, 0), &["--json", "--rate", "24M"]);
            run.is_good();
            assert_eq!(run.json().len(), GOOD_FRAMES);
        }
    }
}

#[test]
fn other_rates_are_named() {
    let bench = Bench::new();
    for (rate, seen) in [
        (1e6, "1.00"),
        (1.25e6, "1.25"),
        (2.0e6, "2.00"),
        (3.2e6, "3.20"),
        (4e6, "4.00"),
        (10e6, "10.0"),
        (115_200.0, "0.115"),
    ] {
        let run = bench.decode("a.vcd", good_traffic(rate).vcd(), &[]);
        let sentence = format!("channel \"line\" runs at about {seen} Mbit/s");
        run.fails_with(&sentence);
        assert!(run.out.is_empty());
    }
    // Who knows better says so.
    let run = bench.decode("a.vcd", good_traffic(4e6).vcd(), &["--bit-rate", "4M", "--json"]);
    run.is_good();
    assert_eq!(run.json().len(), GOOD_FRAMES);
}

#[test]
fn a_rate_that_was_given_wrong() {
    let bench = Bench::new();
    let run = bench.decode("a.vcd", good_traffic(2.5e6).vcd(), &["--bit-rate", "5M"]);
    run.fails_with("frames refused").fails_with("5 Mbit/s, though the runs look like 2.500 Mbit/s");
    assert!(!run.err.contains("exchange A and B"), "{}", run.err);
}

#[test]
fn an_inverted_line_is_decoded_and_not_good() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6).inverted();
    for (name, content, options) in [
        ("a.vcd", wave.vcd().into_bytes(), &["--json"][..]),
        ("a.raw", wave.packed(20e6), &["--json", "--rate", "20M", "--format", "packed"]),
        ("b.raw", wave.raw(50e6, 2), &["--json", "--rate", "50M", "--channel", "2"]),
    ] {
        let run = bench.decode(name, &content, options);
        run.fails_with("idles low (A and B swapped) and is decoded inverted").fails_with("exchange A and B");
        assert_eq!(run.verdicts(), ["ok"; GOOD_FRAMES]);
        bench.decode(name, &content, &[options, &["--polarity", "inverted"]].concat()).is_good();
    }
}

#[test]
fn an_inverted_line_that_was_called_normal() {
    let bench = Bench::new();
    let run = bench.decode("a.vcd", good_traffic(2.5e6).inverted().vcd(), &["--polarity", "normal"]);
    run.fails_with("taken as idling high, though it idles low (A and B swapped?)").fails_with("refused");
}

#[test]
fn only_the_own_requests() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(50.0);
    for _ in 0..4 {
        wave.send(&[0x1a]).idle_us(120.0);
    }
    let run = bench.decode("echo.vcd", wave.vcd(), &["--json"]);
    run.fails_with(
        "4 requests without an answer: no_response (only the request is on the line: no encoder, A and B exchanged",
    );
    assert_eq!(run.verdicts(), ["ok", "no_response"].repeat(4));
    // The controller may also be quick to ask again.
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(50.0);
    for pause in [15.0, 12.0, 9.0, 7.0, 100.0] {
        wave.send(&[0x1a]).idle_us(pause);
    }
    let run = bench.decode("echo.vcd", wave.vcd(), &["--json"]);
    assert_eq!(run.verdicts(), ["ok", "no_response"].repeat(5));
    assert_eq!(run.json()[3]["reason"], "no answer within 12.0 us");
    let log = bench.decode("echo.txt", "1A\n1A\n", &["--bytes"]);
    log.fails_with("2 requests without an answer: no_response (");
    let one = bench.decode("one.txt", "1A\n", &["--bytes"]);
    one.fails_with("error: ").fails_with("1 request without an answer: no_response (");
    assert!(!one.err.contains("refused") && !log.err.contains("refused"), "{} {}", one.err, log.err);
    let reasons: Vec<_> = log.out.lines().filter_map(|line| Some(line.split_once("no_response: ")?.1)).collect();
    assert!(reasons[0].starts_with("no answer before the next request"), "{reasons:?}");
    assert!(reasons[1].starts_with("no answer before the log ends"), "{reasons:?}");
}

/// Both wires, a direction signal, a slow clock: the wire that decodes the right way up is taken.
#[test]
fn the_channel_that_decodes_is_taken() {
    let bench = Bench::new();
    let wave = good_traffic(2.5e6);
    let mut text = "Time [s],DE,B,CLK,A\n".to_owned();
    for (k, (time, level)) in wave.edges.iter().enumerate() {
        let (de, clock) = (u8::from(k % 37 < 5), u8::from(k / 3 % 2 == 0));
        writeln!(text, "{:.9},{de},{},{clock},{}", *time as f64 / 1e12, u8::from(!level), u8::from(*level)).unwrap();
    }
    let run = bench.decode("a.csv", &text, &["--json"]);
    run.is_good();
    assert!(run.err.contains("channel \"A\" idles high"), "{}", run.err);
    let other = bench.decode("a.csv", &text, &["--json", "--channel", "B"]);
    other.fails_with("the line is inverted");
    assert_eq!(run.out, other.out.replace("\"channel\":\"B\"", "\"channel\":\"A\""));
}

/// 64 edges of a clock for one of the line.
#[test]
fn a_busy_channel_beside_the_line() {
    let bench = Bench::new();
    let mut wave = good_traffic(2.5e6);
    wave.idle_us(30_000.0);
    for k in 0..10 {
        wave.exchange(&[0x1a], &id3(k, 0, 0));
    }
    let line = wave.samples(40e6);
    let raw: Vec<u8> = line.iter().enumerate().map(|(k, &s)| (k % 2) as u8 | u8::from(s) << 5).collect();
    let run = bench.decode("a.raw", raw, &["--json", "--rate", "40M"]);
    run.is_good();
    assert_eq!(run.json().len(), GOOD_FRAMES + 20);
    assert!(run.err.contains("channel \"5\""), "{}", run.err);
}

/// A recording that was started and stopped inside a frame is not a fault of the line.
#[test]
fn recordings_cut_at_both_ends() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..4 {
        wave.exchange(&[0x1a], &id3(k, 0, 0));
    }
    let from = |us: i64| {
        let mut cut = wave.clone();
        cut.edges.retain(|(time, _)| *time >= us * 1_000_000);
        cut.vcd()
    };
    // Inside the first answer (27 us to 71 us), in steps of a bit and a half.
    for start in (28..71).step_by(3) {
        let run = bench.decode("late.vcd", from(start), &["--json"]);
        run.is_good();
        assert!(run.json().iter().filter(|e| e["kind"] == "ID 3").count() >= 6, "{}", run.out);
    }
    for end in (300..345).step_by(3) {
        let mut cut = wave.clone();
        cut.edges.retain(|(time, _)| *time < end * 1_000_000);
        cut.end = cut.edges.last().unwrap().0;
        let run = bench.decode("early.vcd", cut.vcd(), &["--json"]);
        // The last line may show the piece; all before it is as it was.
        let verdicts = run.verdicts();
        let (last, before) = verdicts.split_last().unwrap();
        assert!(before.iter().all(|verdict| verdict == "ok"), "{}", run.out);
        assert_eq!(run.code, i32::from(last == "truncated"), "{end}: {}\n{}", run.err, run.out);
    }
}

#[test]
fn spikes_on_the_idle_line() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..20 {
        wave.send(&[0x1a]).idle_us(1.5).level(false, 60e3).idle_us(1.5).send(&id3(k, 0, 0)).idle_us(30.0);
    }
    let run = bench.decode("a.vcd", wave.vcd(), &["--json"]);
    run.is_good();
    assert_eq!(run.json()[1]["fields"]["spikes"], 1);
}

/// Where the user names what the line is not, it is said what it looks like.
#[test]
fn a_line_of_another_protocol_than_was_said() {
    let bench = Bench::new();
    let traffic = good_traffic(2.5e6).vcd();
    for wrong in [&["-p", "nikon"][..], &["-p", "hdsl"], &["--bit-rate", "4M"], &["-p", "tformat", "--bit-rate", "5M"]]
    {
        let run = bench.decode("a.vcd", &traffic, wrong);
        let frames = common::GOOD_FRAMES;
        let said = format!("it looks like T-Format at 2.5 Mbit/s: {frames} of {frames} frames are valid that way");
        run.fails_with(&said);
        assert!(run.err.contains("leave out the option that says otherwise"), "{wrong:?}: {}", run.err);
    }
    for right in [&[][..], &["-p", "tformat"], &["--bit-rate", "2.5M"], &["--polarity", "normal"]] {
        let run = bench.decode("a.vcd", &traffic, right);
        assert!(!run.is_good().err.contains("looks like"), "{right:?}: {}", run.err);
    }
    // Damage is no other protocol.
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..12 {
        let mut answer = id3(k, 0, 0);
        answer[4] ^= 1;
        wave.exchange(&[0x1a], &answer);
    }
    let run = bench.decode("a.vcd", wave.vcd(), &["-p", "tformat"]);
    assert!(!run.err.contains("looks like"), "{}", run.err);
}

/// At 9.6 samples a bit an edge may be a tenth of a bit off, in the same way in every exchange.
#[test]
fn the_rate_of_a_coarse_recording() {
    let bench = Bench::new();
    let mut wave = Wave::new(2.5e6);
    wave.idle_us(20.0);
    for k in 0..8 {
        wave.send(&[0x1a]).idle_us(3.0).send(&id3(3_915_817 + 37 * k, k, 0xc8)).idle_us(80.0);
    }
    let run = bench.decode("a.raw", wave.raw(24e6, 0), &["--rate", "24M"]);
    let shown = run.is_good().err.split_once("2.5 Mbit/s (").unwrap().1.split_once(" %").unwrap().0.to_owned();
    assert!(shown.parse::<f64>().unwrap().abs() <= 0.1, "{}", run.err);
}
