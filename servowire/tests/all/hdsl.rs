//! HIPERFACE DSL from the bundled capture and from a simulated link in sync mode.

#[path = "../../examples/render-dsl.rs"]
#[allow(dead_code, reason = "its main is not needed here")]
mod render_dsl;

use crate::random;
use std::path::Path;

use crate::common;
use crate::common::Bench;
use crate::random::speech::Kind;
use crate::random::wire::Scene;
use hdsl::device::Device;
use hdsl::frame::FILLER;
use hdsl::master::Master;
use hdsl::message::{RemoteRegister, ShortRequest};
use hdsl::sampling::line;
use hdsl::sync::{Es, Synchroniser};
use hdsl::{Dialect, EncoderId};

fn capture() -> (std::path::PathBuf, String) {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = render_dsl::render(&package.join("../tests/vectors/hdsl/fw_startup.jsonl")).unwrap();
    (package.join("../servowire-decode/captures").join(render_dsl::FILE), text)
}

#[test]
fn the_capture_is_what_the_generator_makes() {
    let (path, text) = capture();
    assert!(std::fs::read_to_string(path).unwrap() == text, "the file is not what render-dsl makes");
}

/// The start-up of the firmware: 18 frames without an answer, 34 times the test pattern, the identifier, then V-frames.
#[test]
fn the_start_up_of_the_firmware() {
    let run = common::servowire(&["decode", "-p", "hdsl", "--json"]);
    run.is_good();
    let events = run.json();
    let count = |kind: &str| events.iter().filter(|event| event["kind"] == kind).count();
    assert_eq!((count("H-frame"), count("test pattern"), count("identifier"), count("answer")), (98, 34, 1, 45));
    let symbols: Vec<_> =
        events.iter().filter(|e| e["kind"] == "H-frame").map(|e| e["fields"]["SYMBOL"].clone()).collect();
    assert_eq!(
        (symbols[0].as_str(), symbols[2].as_str(), symbols[97].as_str()),
        (Some("RESET"), Some("SYNC"), Some("IDLE"))
    );
    assert_eq!(count("V-frame"), 4);
    assert!(events.iter().filter(|e| e["kind"] == "V-frame").all(|e| e["fields"]["QM"].as_u64() >= Some(10)));
}

/// Samples of a link in sync mode: EXTRA windows with edges between the bits, stuffing, a message, a running position.
fn sampled() -> Vec<u8> {
    let sync = Synchroniser::new(1333, Es::ONE).unwrap();
    let mut master = Master::synchronised(Dialect::SICK, sync);
    let mut encoder = Device::new(EncoderId::new(0x00153).unwrap());
    let level = |bit: bool| if bit { 0xff_u8 } else { 0 };
    let mut samples = vec![0xff; 20];
    for frame in 0..160_u64 {
        if frame == 120 {
            master.start_short(ShortRequest::Write(RemoteRegister::PING, 0xa5)).unwrap();
        }
        let present = master.transmission();
        samples.extend(present.head.samples());
        let answer = encoder.set_position(1000 + 5 * frame).hear(present.head.bits());
        let received = answer.map_or([0xff; 72], |answer| line(answer.bits, 21));
        let h_frame = master.hear(&received, 0).unwrap();
        if present.answered {
            // Switch bit, the answer with its reserve, two bits of TRAILER that nobody drives.
            samples.push(0xff);
            samples.extend(received);
            samples.extend([0xff; 3]);
        } else {
            samples.extend((0..FILLER.len()).map(|at| level(FILLER.get(at).unwrap())));
        }
        samples.extend(h_frame.tail.bits().map(level));
    }
    // The oldest sample in bit 0.
    samples.iter().map(|byte| byte.reverse_bits()).collect()
}

/// Bits as a receiver has read them, one sample each, without a protocol being named.
#[test]
fn a_stream_of_bits() {
    let bench = Bench::new();
    for seed in 1..8 {
        let capture = random::wire::capture(Kind::Dsl, &Scene::clean(), seed);
        let period = 1e12 / 9.375e6;
        let mut bits = Vec::new();
        let mut level = true;
        for (time, next) in capture.channels[0].edges.iter().copied().chain([(capture.end, true)]) {
            bits.resize((time as f64 / period).round() as usize, level);
            level = next;
        }
        let packed: Vec<u8> =
            bits.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit))).collect();
        let run = bench.decode("bits.bin", packed, &["--format", "packed", "--rate", "9.375M", "--json"]);
        run.is_good();
        let due = &capture.due[0].events;
        let said: Vec<_> = run.json().into_iter().filter(|event| event["kind"] != "V-frame").collect();
        assert_eq!(said.len(), due.len(), "{}", run.err);
        for (event, due) in said.iter().zip(due) {
            let same = |(name, value): &(&str, i64)| event["fields"][name].as_i64() == Some(*value);
            let flags: Vec<_> = due.fields.iter().filter(|field| !same(field)).collect();
            assert!(event["kind"] == due.kind.as_str() && flags.is_empty(), "{event} is not {due:?}");
        }
    }
    // At another rate four samples a bit are needed.
    bench
        .decode("bits.bin", [0x5a; 400], &["--format", "packed", "--rate", "9M"])
        .fails_with("samples per bit are too few");
}

#[test]
fn samples_of_a_synchronised_link() {
    let bench = Bench::new();
    let options = ["-p", "hdsl", "--format", "packed", "--rate", "75000000", "--json"];
    let run = bench.decode("line.bin", sampled(), &options);
    run.is_good();
    let events = run.json();
    let of = |kind: &str| events.iter().filter(|event| event["kind"] == kind).collect::<Vec<_>>();
    assert_eq!(of("H-frame").len(), 160);
    assert!(of("H-frame").iter().all(|e| (4..=9).contains(&e["fields"]["EXTRA"].as_u64().unwrap())));
    let last = of("answer").last().unwrap().to_owned();
    assert_eq!((last["fields"]["VEL"].as_i64(), last["fields"]["delay"].as_i64()), (Some(5), Some(3)));
    let messages: Vec<_> = of("message").iter().map(|e| e["fields"]["message"].as_str().unwrap().to_owned()).collect();
    assert_eq!(messages, ["write register 7Fh = A5h", "register 7Fh is written"]);
    assert_eq!(last["fields"]["POS"].as_u64(), Some(1000 + 5 * 159), "{last}");
}
