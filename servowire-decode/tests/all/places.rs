//! Where fields are in their frames, and when they were on the line.

use std::io::Cursor;

use servowire_decode::capture::{self, Capture, Format, Hints, Input};
use servowire_decode::event::{Event, Place, Value};
use servowire_decode::protocols::CODECS;

use crate::{events, line};

/// What is said of a frame as a whole, or computed from several.
const WHOLE: [&str; 15] = [
    "bytes", "words", "note", "effect", "width", "spikes", "message", "VEL", "POS", "SUMMARY", "VPOS", "STATUS2",
    "VPOS2", "QM", "ENC_ID",
];

/// First and last bit of a field, and from when to when it was on the line, in ps after the beginning of its frame.
fn place(event: &Event, name: &str) -> (u32, u32, i64, i64) {
    let span = event.fields.iter().find(|field| field.name == name).and_then(|field| field.span);
    let span = span.unwrap_or_else(|| panic!("{name} of {event:?}"));
    match (span.place, event.place) {
        (Place::Time { start, end }, Place::Time { start: begin, .. }) => {
            (span.first, span.last, start - begin, end - begin)
        }
        _ => (span.first, span.last, 0, 0),
    }
}

fn of_capture(codec: usize, capture: usize) -> Vec<Event> {
    let (name, bytes) = CODECS[codec].captures[capture];
    events(name, Capture::Edges(line(name, bytes)), Some(CODECS[codec]))
}

#[test]
fn fields_of_t_format() {
    // 2.5 Mbit/s: a bit is 400 ns, a field ten of them: start bit, eight bits, delimiter.
    let answer = &of_capture(0, 0)[1];
    assert_eq!(place(answer, "SF"), (11, 18, 4_400_000, 7_600_000));
    // Fields 2 to 4 and 6 to 8, with start bits and delimiters between them.
    assert_eq!(place(answer, "ABS"), (21, 48, 8_400_000, 19_600_000));
    assert_eq!(place(answer, "ABM"), (61, 88, 24_400_000, 35_600_000));
    assert_eq!(place(answer, "ALMC"), (91, 98, 36_400_000, 39_600_000));
    assert_eq!(place(answer, "CRC"), (101, 108, 40_400_000, 43_600_000));
}

#[test]
fn fields_of_a_format() {
    // A bit is 400 ns, a frame 18 of them: start bit, sixteen bits, delimiter.
    let all = of_capture(1, 0);
    assert_eq!(place(&all[0], "EA"), (6, 8, 2_400_000, 3_600_000));
    assert_eq!(place(&all[1], "EA"), (4, 6, 1_600_000, 2_800_000));
    assert_eq!(place(&all[1], "ES"), (13, 16, 5_200_000, 6_800_000));
    // Forty bits in the second, third and the first half of the fourth frame.
    assert_eq!(place(&all[1], "ABS"), (19, 62, 7_600_000, 25_200_000));
    assert_eq!(place(&all[1], "CRC"), (63, 70, 25_200_000, 28_400_000));
}

#[test]
fn fields_of_hiperface_dsl() {
    let all = of_capture(2, 0);
    let head = all.iter().find(|event| event.kind == "H-frame" && event.verdict.is_ok()).unwrap();
    let (first, last, start, end) = place(head, "SYMBOL");
    assert_eq!(last - first, 9, "a word of the code has ten bits");
    let Place::Time { start: begin, end: over } = head.place else { panic!("{head:?}") };
    assert_eq!(end, over - begin, "it is the last of the head");
    assert!((end - start - 1_066_667).abs() < 20, "ten bits at 9.375 MBaud, {start} to {end}");
    let answer = all.iter().find(|event| event.kind == "answer" && event.verdict.is_ok()).unwrap();
    let bits = ["VERT", "SYMBOL", "VSYNC", "PIPE", "DD", "SEC"].map(|name| place(answer, name)).map(|it| (it.0, it.1));
    assert_eq!(bits, [(0, 9), (10, 19), (10, 19), (20, 29), (30, 49), (51, 60)]);
}

#[test]
fn fields_of_rtex_blocks_have_bytes_and_a_line() {
    // MAC-ID 5, a profile position command to 70.
    let log = "05 20 00 00 46 00 00 00 00 00 00 00 00 00 00 00\n".repeat(2);
    let input = Input::over("log", Cursor::new(log));
    let capture = capture::open(input, Hints { format: Some(Format::Hex), ..Hints::default() }).unwrap();
    let rtex = CODECS.iter().copied().find(|codec| codec.name == "rtex");
    let all = events("log", capture, rtex);
    let data = all[0]
        .fields
        .iter()
        .find(|field| field.value == Value::Number { value: 70, unit: "" })
        .and_then(|field| field.span);
    let data = data.unwrap_or_else(|| panic!("{all:?}"));
    assert_eq!((data.first, data.last, data.place), (32, 63, Place::Line(1)));
    // A response: its position wraps at 32 bits.
    let log = "85 20 41 00 46 00 00 00 00 00 00 00 00 00 00 00\n";
    let capture =
        capture::open(Input::over("log", log.as_bytes()), Hints { format: Some(Format::Hex), ..Hints::default() });
    let position = events("log", capture.unwrap(), rtex)[0].position.unwrap();
    assert_eq!((position.counts, position.span), (70, Some(0x1_0000_0000)));
}

#[test]
fn fields_of_sorte_packets() {
    // IO exchange, link type 147: SA 0, STATUS 30h, outputs of one device, check, time stamp; 80 ns a byte.
    let frame = [0x00, 0x30, 0x0a, 0x00, 0x00, 0x00];
    let frame = [&frame[..], &[crc8(&frame)], &[0x34, 0x12]].concat();
    let mut file = vec![0x4d, 0x3c, 0xb2, 0xa1, 2, 0, 4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 147, 0, 0, 0];
    // The first of January 2026, and 5 ns.
    file.extend([1_767_225_600_u32, 5, frame.len() as u32, frame.len() as u32].map(u32::to_le_bytes).concat());
    file.extend(&frame);
    let capture = capture::open(Input::over("log", Cursor::new(file)), Hints::default()).unwrap();
    let all = events("log", capture, None);
    assert!(all[0].verdict.is_ok(), "{all:?}");
    let Place::Time { start, .. } = all[0].place else { panic!("{all:?}") };
    assert_eq!(start.ps(), 1_767_225_600_000_000_005_000, "an absolute time");
    assert_eq!(place(&all[0], "STATUS"), (8, 15, 80_000, 160_000));
    assert_eq!(place(&all[0], "PTO 1"), (16, 31, 160_000, 320_000));
    assert_eq!(place(&all[0], "time stamp"), (56, 71, 560_000, 720_000));
}

/// x^8 + x^2 + x + 1, beginning with 0.
fn crc8(bytes: &[u8]) -> u8 {
    bytes
        .iter()
        .fold(0, |crc, byte| (0..8).fold(crc ^ byte, |crc: u8, _| crc << 1 ^ if crc & 0x80 == 0 { 0 } else { 7 }))
}

/// Whatever the published captures hold: each field is inside its frame, or is of the frame as a whole.
#[test]
fn every_field_has_its_place() {
    for codec in CODECS {
        for (name, bytes) in codec.captures {
            for event in events(name, Capture::Edges(line(name, bytes)), Some(*codec)) {
                let Place::Time { start, end } = event.place else { panic!("{event:?}") };
                for field in &event.fields {
                    let whole = WHOLE.contains(&field.name) || field.name == "delay";
                    let Some(span) = field.span else {
                        assert!(whole, "{name}: {} of {event:?}", field.name);
                        continue;
                    };
                    let Place::Time { start: from, end: to } = span.place else { panic!("{event:?}") };
                    assert!(!whole && span.first <= span.last && start <= from && from < to && to <= end, "{event:?}");
                }
            }
        }
    }
}
