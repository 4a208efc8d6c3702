//! The golden traces are what the generator makes, and enough to try a receiver with.

use hdsl::Dialect;
use hdsl::master::{Master, State};
use hdsl::message::{LongRequest, RemoteRegister, ResourceAddress, ShortRequest};
use hdsl::registers::{OnlineD, Registers};

#[allow(dead_code, reason = "its main")]
#[path = "../../examples/golden.rs"]
mod generator;

const SICK: &str = include_str!("../golden/sick-20m.jsonl");
const TI: &str = include_str!("../golden/ti-100m.jsonl");

#[test]
fn the_generator_makes_the_same_traces() {
    for (name, trace, dialect, metres) in [("sick-20m", SICK, Dialect::SICK, 20), ("ti-100m", TI, Dialect::TI, 100)] {
        let made = generator::trace(dialect, metres, 200).unwrap();
        for (made, kept) in made.lines().zip(trace.lines()) {
            assert_eq!(made, kept, "{name}");
        }
        assert_eq!((made.lines().count(), trace.lines().count()), (200, 200), "{name}");
    }
}

/// A line of a trace.
struct Frame {
    state: String,
    head: Vec<u8>,
    answer: Option<Vec<u8>>,
    tail: String,
    registers: Vec<u8>,
}

fn frames(trace: &str) -> Vec<Frame> {
    let bytes = |text: &str| -> Vec<u8> {
        let digits = text.as_bytes().chunks(2);
        digits.map(|pair| u8::from_str_radix(core::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
    };
    let frame = |line: &str| {
        let row: serde_json::Value = serde_json::from_str(line).unwrap();
        let text = |key: &str| row[key].as_str().unwrap().to_owned();
        Frame {
            state: text("state"),
            head: bytes(&text("head")),
            answer: row["answer"].as_str().map(bytes),
            tail: text("tail"),
            registers: bytes(&text("registers")),
        }
    };
    trace.lines().map(frame).collect()
}

/// A receiver that knows nothing but the samples of the answers sends the heads and tails of the trace and comes to its
/// registers, whether it takes the samples as bytes or as words.
#[test]
fn a_receiver_is_tried_with_the_samples() {
    for (trace, dialect) in [(SICK, Dialect::SICK), (TI, Dialect::TI)] {
        for whole_words in [false, true] {
            let (mut master, mut map) = (Master::new(dialect), Registers::new(&dialect));
            for (at, frame) in frames(trace).into_iter().enumerate() {
                match at {
                    90 => master.start_short(ShortRequest::Read(RemoteRegister::PING)).unwrap(),
                    100 => master.start_long(LongRequest::read_name(ResourceAddress::RESOLUTN)).unwrap(),
                    _ => {}
                }
                let present = master.transmission();
                assert_eq!(present.head.samples().collect::<Vec<_>>(), frame.head, "{at}");
                assert_eq!((present.answered, master.state().to_string()), (frame.answer.is_some(), frame.state));
                let samples = frame.answer.unwrap_or_else(|| vec![0x55; 72]);
                let report = if whole_words {
                    let words = core::array::from_fn(|k| {
                        samples[4 * k..4 * k + 4].iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte))
                    });
                    master.hear_words(&words, 0)
                } else {
                    master.hear(&samples, 0).unwrap()
                };
                let tail: String = report.tail.bits().map(|bit| if bit { '1' } else { '0' }).collect();
                assert_eq!(tail, frame.tail, "{at}");
                map.apply(report);
                assert_eq!(map.as_bytes().as_slice(), frame.registers, "{at}");
            }
            assert_eq!(master.state(), State::Running);
        }
    }
}

/// What the folder says happens does happen.
#[test]
fn the_traces_show_what_is_said_of_them() {
    for (trace, dialect) in [(SICK, Dialect::SICK), (TI, Dialect::TI)] {
        let frames = frames(trace);
        let map = |at: usize| Registers::from_bytes(&dialect, frames[at].registers.as_slice().try_into().unwrap());
        let doubtful = |at: usize| map(at).online_d().contains(OnlineD::POS);
        // Wrap of the 24 bits.
        assert_eq!((map(98).pos(), map(99).pos()), (Some(0xff_ffd8), Some(0)));
        assert_eq!((map(119).vel(), map(120).vel(), map(139).pos()), (Some(40), Some(-40), Some(0)));
        assert!(!doubtful(169) && doubtful(170) && !doubtful(199));
        assert_eq!((map(199).pos(), map(199).quality()), (Some((1 << 24) - 2400), 15));
        // The name that the long message asked for, in PC_BUFFER.
        assert_eq!(&frames[199].registers[0x20..0x28], b"RESOLUTN");
        assert_eq!(frames.iter().filter(|frame| frame.answer.is_none()).count(), 18);
        assert_eq!(frames[0].tail, "00000011");
    }
}
