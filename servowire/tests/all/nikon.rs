//! A-format: the captures that come with the program, all rates, buses, silence and damage.

#[path = "../../examples/render-nikon-captures.rs"]
#[allow(dead_code, reason = "its main is not needed here")]
mod render;

use std::path::Path;

use crate::common;

use servowire_decode::protocols::CODECS;

use crate::common::{Bench, Run, Wave};
use nikon_aformat::device::{Device, Encoders, Fault};
use nikon_aformat::{BitRate, EncoderAddress, Operation, Request, Resolution, TypeWord, Window};

const RATES: [(BitRate, f64); 5] = [
    (BitRate::Mbit2_5, 2.5e6),
    (BitRate::Mbit4, 4e6),
    (BitRate::Mbit6_67, 2e7 / 3.0),
    (BitRate::Mbit8, 8e6),
    (BitRate::Mbit16, 1.6e7),
];

fn ea(address: u8) -> EncoderAddress {
    EncoderAddress::new(address).unwrap()
}

fn encoders(rate: BitRate) -> Encoders<8, 1> {
    Encoders {
        all: EncoderAddress::ALL.map(|ea| {
            let mut device = Device::new(ea, Resolution::new(20, 16).unwrap(), rate);
            device.set_position(u32::from(ea.get()) * 100_000 + 0x5_1234, 17);
            device
        }),
    }
}

fn bits(line: Window) -> Vec<bool> {
    (0..line.len()).map(|at| line.get(at) == Some(true)).collect()
}

/// A request with the answers of the encoders, then 100 us; `wave` runs `now_ns` ahead.
fn exchange(wave: &mut Wave, encoders: &mut Encoders<8, 1>, request: Request, rate: BitRate, now_ns: &mut u64) {
    let mut answers = Vec::new();
    let frame_ns = u64::from(rate.bit_ps()) * 18 / 1000;
    for (k, frame) in request.emit().as_slice().iter().enumerate() {
        if k > 0 {
            wave.idle_us(1.5);
            *now_ns += 1_500;
        }
        wave.bits(&bits(frame.line()));
        *now_ns += frame_ns;
        answers.extend(encoders.hear(&[Some(frame.content())], *now_ns).into_iter().flatten());
    }
    answers.sort_by_key(|answer| answer.start_ns);
    for answer in answers {
        wave.idle_us((answer.start_ns - *now_ns) as f64 / 1000.0).bits(&bits(answer.line));
        *now_ns = answer.start_ns + u64::from(answer.line.len()) * u64::from(rate.bit_ps()) / 1000;
    }
    wave.idle_us(400.0);
    *now_ns += 400_000;
}

/// Some transactions of all kinds and how many frames the program has to show.
fn traffic(rate: BitRate, hertz: f64) -> (Wave, usize) {
    let (mut wave, mut encoders, mut now_ns) = (Wave::new(hertz), encoders(rate), 0);
    wave.idle_us(50.0);
    let word = TypeWord::EEPROM_ADDRESS;
    let asked = [
        (1, Operation::EepromRead { address: word }, 2),
        (1, Operation::EepromRead { address: word }, 2),
        (3, Operation::Abs40, 2),
        (7, Operation::Abs40Mt, 9),
        (2, Operation::Status, 2),
        (2, Operation::Abs17, 2),
        (6, Operation::Abs24Temp, 2),
        (4, Operation::Abs24LowMt, 6),
        (5, Operation::Temperature, 2),
    ];
    for (address, operation, _) in asked {
        exchange(&mut wave, &mut encoders, Request::new(ea(address), operation), rate, &mut now_ns);
    }
    (wave, asked.iter().map(|(.., frames)| frames).sum())
}

fn decode(bench: &Bench, wave: &Wave, options: &[&str]) -> Run {
    bench.decode("a.vcd", wave.vcd(), &[&["-p", "nikon", "--json"], options].concat())
}

#[test]
fn the_files_are_what_the_generator_makes() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rendered = render::render(&package.join("../tests/vectors/nikon/anchors.jsonl")).unwrap();
    assert_eq!(rendered.len(), CODECS[1].captures.len());
    for (file, text) in rendered {
        let name = format!("captures/{file}");
        let (_, bundled) = CODECS[1].captures.iter().find(|(known, _)| *known == name).unwrap();
        assert!(text.as_bytes() == *bundled, "{name} is not what render-nikon-captures makes");
    }
}

#[test]
fn without_a_file_the_published_positions_are_shown() {
    let run = common::servowire(&["decode", "-p", "nikon", "--json"]);
    run.is_good();
    let positions: Vec<i64> = run.json().iter().filter_map(|event| event["fields"]["ABS"].as_i64()).collect();
    let logged = (0xf_ffa5..=0xf_ffb4).map(|single_turn| 0x8888 << 20 | single_turn);
    let want: Vec<i64> = logged.chain([51_200 * 0x2_0000 + 86_639, 0xfb_f700]).collect();
    assert_eq!(positions, want);
    let text = common::servowire(&["decode", "-p", "nikon"]);
    text.is_good();
    assert!(text.out.contains("ABS40_MT  EA 0  ES BATT ERROR"), "{}", text.out);
}

#[test]
fn all_five_rates_are_found_and_all_frames_are_good() {
    let bench = Bench::new();
    for (rate, hertz) in RATES {
        for off in [-1.0, 0.0, 1.0] {
            let (wave, frames) = traffic(rate, hertz * (1.0 + off / 100.0));
            let run = decode(&bench, &wave, &[]);
            run.is_good();
            assert_eq!(run.json().len(), frames, "{hertz} {off}: {}", run.out);
            let found = format!("{} Mbit/s", f64::from(rate.bits_per_second()) / 1e6);
            assert!(run.err.contains(&found), "{found} not in {}", run.err);
        }
        let (wave, frames) = traffic(rate, hertz);
        let run = decode(&bench, &wave.inverted(), &[]);
        assert_eq!(run.json().len(), frames);
    }
}

/// The type word that the line carries gives the position in turns.
#[test]
fn the_type_word_gives_the_resolution() {
    let (wave, _) = traffic(BitRate::Mbit4, 4e6);
    let run = decode(&Bench::new(), &wave, &[]);
    let events = run.json();
    let turns = |kind: &str, ea: u32| {
        let said = |event: &&serde_json::Value| {
            event["kind"] == kind && event["direction"] == "answer" && event["address"] == ea
        };
        events.iter().find(said).unwrap()["position"]["turns"].as_f64()
    };
    let want = 17.0 + f64::from(100_000 + 0x5_1234) / f64::from(1 << 20);
    assert!((turns("ABS40_MT", 1).unwrap() - want).abs() < 1e-9);
    // Nobody has asked encoder 3 for its type.
    assert_eq!(turns("ABS40", 3), None);
}

#[test]
fn silence_damage_and_missing_encoders_are_told() {
    let bench = Bench::new();
    let (rate, hertz) = RATES[4];
    let request = Request::new(ea(2), Operation::Abs40);
    let verdicts = |fault| {
        let (mut wave, mut encoders, mut now_ns) = (Wave::new(hertz), encoders(rate), 0);
        wave.idle_us(50.0);
        exchange(&mut wave, &mut encoders, request, rate, &mut now_ns);
        encoders.all[2].set_fault(fault);
        exchange(&mut wave, &mut encoders, request, rate, &mut now_ns);
        let run = decode(&bench, &wave, &[]);
        assert_eq!(run.code, 1);
        run.verdicts()
    };
    assert_eq!(verdicts(Fault::Silent), ["ok", "ok", "ok", "no_response"]);
    assert_eq!(verdicts(Fault::BadCrc), ["ok", "ok", "ok", "crc"]);
    assert_eq!(verdicts(Fault::FlipBit { at: 20 }), ["ok", "ok", "ok", "crc"]);
    assert_eq!(verdicts(Fault::CutAfter { bits: 36 }), ["ok", "ok", "ok", "truncated"]);
    let (mut wave, mut encoders, mut now_ns) = (Wave::new(hertz), encoders(rate), 0);
    encoders.all[4].set_fault(Fault::Silent);
    wave.idle_us(50.0);
    exchange(&mut wave, &mut encoders, Request::new(ea(7), Operation::Abs40Mt), rate, &mut now_ns);
    let run = decode(&bench, &wave, &[]);
    run.is_good();
    let heard: Vec<i64> = run.json().iter().skip(1).map(|event| event["fields"]["EA"].as_i64().unwrap()).collect();
    assert_eq!(heard, [0, 1, 2, 3, 5, 6, 7]);
}

/// A log of words, two bytes a frame, request and reply in turn.
#[test]
fn logs_of_words() {
    let log = "4403\n3000 14cb 6d00 00df\n40b0 5b78\n";
    let run = Bench::new().decode("a.txt", log, &["-p", "nikon", "--bytes", "--json"]);
    assert_eq!(run.verdicts(), ["ok", "ok", "ok", "no_response"]);
    assert_eq!(run.json()[1]["fields"]["ABS"], 11_981_608);
    assert_eq!(run.json()[2]["fields"]["address"], 0xf6);
}

/// A recording that begins anywhere in the first request: the reply to it is whole, and so is all after it.
#[test]
fn a_recording_that_begins_inside_a_request() {
    let bench = Bench::new();
    for (rate, hertz) in RATES {
        let (wave, frames) = traffic(rate, hertz);
        let begin = 50_000_000;
        let bit = i64::from(rate.bit_ps());
        for part in 1..36 {
            let cut = begin + part * bit / 2;
            let level = wave.edges.iter().take_while(|(time, _)| *time <= cut).last().unwrap().1;
            let rest = wave.edges.iter().copied().filter(|(time, _)| *time > cut);
            let mut wave = wave.clone();
            wave.edges = [(cut, level)].into_iter().chain(rest).collect();
            let run = decode(&bench, &wave, &[]);
            let whole = run.json().iter().filter(|event| event["kind"] != "cut").count();
            assert!(run.code == 0 && (frames - 1..=frames).contains(&whole), "{hertz} {part}: {}", run.out);
        }
    }
}

/// Eight encoders that stand far from each other and move five counts each: nobody's figures are those of another.
#[test]
fn each_encoder_of_a_bus_has_its_own_figures() {
    let (rate, hertz) = RATES[1];
    let (mut wave, mut encoders, mut now_ns) = (Wave::new(hertz), encoders(rate), 0);
    wave.idle_us(50.0);
    for k in 0..6 {
        for (device, address) in encoders.all.iter_mut().zip(0..) {
            device.set_position(address * 100_000 + 0x5_1234 + 5 * k, 17);
        }
        exchange(&mut wave, &mut encoders, Request::new(ea(7), Operation::Abs40Mt), rate, &mut now_ns);
    }
    let bench = Bench::new();
    let file = bench.file("bus.vcd", wave.vcd());
    let figures = common::decode(&file, &["--stats", "--json", "--jump", "100"]);
    figures.is_good();
    let figures = figures.json();
    assert_eq!(figures.len(), 8);
    for (address, own) in figures.iter().enumerate() {
        let seen = ["address", "answers", "largest_move", "jumps"].map(|key| own[key].as_u64().unwrap());
        assert_eq!(seen, [address as u64, 6, 5, 0], "{own}");
    }
    let text = common::decode(&file, &["--stats"]).out;
    assert_eq!(text.matches("  largest move  5 counts").count(), 8, "{text}");
    let own = common::decode(&file, &["--json", "--encoder", "3"]);
    own.is_good();
    assert_eq!(own.json().len(), 6);
    assert!(own.json().iter().all(|event| event["address"] == 3), "{}", own.out);
    let table = common::decode(&file, &["--csv", "--encoder", "line/5"]).out;
    assert!(
        table.lines().skip(1).all(|row| row.split(',').nth(2) == Some("5")) && table.lines().count() == 7,
        "{table}"
    );
    let svg = bench.path("bus.svg");
    common::decode(&file, &["--svg", svg.to_str().unwrap()]).is_good();
    let svg = std::fs::read_to_string(svg).unwrap();
    assert!((0..8).all(|address| svg.contains(&format!("address {address}: position ABS in "))), "{svg}");
}
