//! Whatever a good controller and a good encoder say, at whatever rate and pauses, is decoded as it was said.

use std::io::{self, Cursor};

use crate::common;
use crate::common::{Wave, sealed};
use proptest::prelude::*;
use servowire_decode::capture::hexlog::HexLog;
use servowire_decode::capture::raw::{Raw, Unit};
use servowire_decode::capture::saleae_binary::SaleaeBinary;
use servowire_decode::capture::table::Table;
use servowire_decode::capture::vcd::Vcd;
use servowire_decode::capture::{ByteLog, Capture, Hints, Input};
use servowire_decode::event::{Direction, Event};
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::protocols::CODECS;
use servowire_decode::settings::Settings;

#[derive(Default)]
struct Collect(Vec<Event>);

impl Printer for Collect {
    fn event(&mut self, _: &Origin, event: &Event) -> io::Result<()> {
        self.0.push(event.clone());
        Ok(())
    }
}

fn decode(capture: Capture) -> Result<Vec<Event>, String> {
    let mut events = Collect::default();
    let mut out = Output::new("line", &mut events);
    match servowire_decode::decode("line", capture, CODECS.first().copied(), &Settings::default(), &mut out)
        .map_err(|stop| stop.to_string())
    {
        // An inverted line is decoded to its end before it is told.
        Err(told) if !told.contains("the line is inverted") => Err(told),
        _ => Ok(events.0),
    }
}

fn input(bytes: Vec<u8>) -> Input {
    Input::over("line", Box::new(Cursor::new(bytes)))
}

/// Names and values; where exactly they were depends on how the line was recorded.
fn values(event: &Event) -> Vec<(&'static str, servowire_decode::event::Value)> {
    event.fields.iter().map(|field| (field.name, field.value.clone())).collect()
}

/// Request and answer without their check fields, by the control field.
fn exchange() -> impl Strategy<Value = (Vec<u8>, Vec<u8>)> {
    let six = (prop::sample::select(vec![0x02_u8, 0x8a, 0xba, 0xc2, 0x62]), any::<[u8; 4]>())
        .prop_map(|(cf, d)| (vec![cf], sealed(&[&[cf], &d[..]].concat())));
    let id2 = any::<[u8; 2]>().prop_map(|d| (vec![0x92], sealed(&[&[0x92], &d[..]].concat())));
    let id3 = any::<[u8; 9]>().prop_map(|d| (vec![0x1a], sealed(&[&[0x1a], &d[..]].concat())));
    let read = any::<[u8; 2]>().prop_map(|[a, d]| (sealed(&[0xea, a & 0x7f]), sealed(&[0xea, a & 0x7f, d])));
    let write = any::<[u8; 2]>().prop_map(|[a, d]| (sealed(&[0x32, a & 0x7f, d]), sealed(&[0x32, a & 0x7f, d])));
    prop_oneof![six, id2, id3, read, write]
}

/// Rate, inversion, and exchanges with the delay of the answer and the pause after it in us.
type Traffic = (f64, bool, Vec<((Vec<u8>, Vec<u8>), f64, f64)>);

fn traffic() -> impl Strategy<Value = Traffic> {
    let rate =
        (prop::sample::select(vec![2.5e6, 5e6]), -24..=24_i32).prop_map(|(r, off)| r * (1.0 + f64::from(off) / 1e3));
    let exchanges = prop::collection::vec((exchange(), 1.8..12.0, 2.0..60.0), 3..30);
    (rate, any::<bool>(), exchanges)
}

fn draw((rate, inverted, exchanges): &Traffic) -> Wave {
    let mut wave = Wave::new(*rate);
    wave.idle_us(25.0);
    for ((request, answer), delay, pause) in exchanges {
        wave.send(request).idle_us(*delay).send(answer).idle_us(*pause);
    }
    wave.idle_us(100.0);
    if *inverted { wave.inverted() } else { wave }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn what_was_said_is_what_is_decoded(traffic in traffic()) {
        let wave = draw(&traffic);
        let edges = decode(Capture::Edges(Box::new(Vcd::new(input(wave.vcd().into_bytes())).unwrap())));
        let events = edges.map_err(TestCaseError::fail)?;
        prop_assert_eq!(events.len(), 2 * traffic.2.len());
        for (pair, ((_, answer), delay, _)) in events.chunks(2).zip(&traffic.2) {
            prop_assert!(pair.iter().all(|event| event.verdict.is_ok()), "{:?}", pair);
            prop_assert_eq!(pair[0].direction, Some(Direction::Request));
            prop_assert_eq!(pair[1].direction, Some(Direction::Answer));
            let crc = servowire_decode::event::Value::Hex { value: u64::from(*answer.last().unwrap()), digits: 2 };
            prop_assert_eq!(&pair[1].fields.iter().find(|f| f.name == "CRC").unwrap().value, &crc);
            // Measured from the nominal end of a field, so off by the rate error of the request.
            let late = pair[1].delay.unwrap() as f64 / 1e6 - delay;
            prop_assert!(late.abs() < 0.45, "{}", late);
        }
        let packed = decode(Capture::Samples(Raw::new(input(wave.packed(80e6)), 80_000_000, Unit::Bit)));
        let packed = packed.map_err(TestCaseError::fail)?;
        let said = |events: &[Event]| -> Vec<_> { events.iter().map(|e| (e.kind.clone(), values(e), e.verdict.clone())).collect() };
        prop_assert_eq!(said(&packed), said(&events));
    }

    /// Damaged files never panic, whatever else they do.
    #[test]
    fn damaged_files(
        format in 0..4_usize,
        cut in any::<prop::sample::Index>(),
        edits in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..3), 0..12),
    ) {
        let wave = common::good_traffic(2.5e6);
        let log = b"1A\n1A 20 29 C0 3B 17 00 00 00 C8 37\n02 0220b4bd1c37\nEA 01 EB # x\n".to_vec();
        let mut file = match format {
            0 => wave.vcd().into_bytes(),
            1 => wave.saleae_csv().into_bytes(),
            2 => wave.saleae_binary(),
            _ => log,
        };
        file.truncate(1 + cut.index(file.len()));
        for (at, byte, what) in edits {
            let at = at.index(file.len());
            match what {
                0 => file[at] = byte,
                1 => file.insert(at, byte),
                _ => file[at] = b"0123456789#$!.,-\n"[usize::from(byte) % 17],
            }
        }
        let capture = match format {
            0 => Vcd::new(input(file)).map(|file| Capture::Edges(Box::new(file))),
            1 => Table::new(input(file), Hints::default()).map(|file| Capture::Edges(Box::new(file))),
            2 => SaleaeBinary::new(input(file)).map(|file| Capture::Edges(Box::new(file))),
            _ => Ok(Capture::Bytes(ByteLog::Hex(HexLog::new(input(file))))),
        };
        if let Ok(capture) = capture {
            let _ = decode(capture);
        }
    }

    /// Noise on the wire never panics, and never gives a value beside an error.
    #[test]
    fn noise(runs in prop::collection::vec(1..3000_u32, 1..600)) {
        let mut wave = Wave::new(2.5e6);
        for (k, run) in runs.iter().enumerate() {
            wave.level(k % 2 == 0, f64::from(*run) * 1e3);
        }
        if let Ok(events) = decode(Capture::Edges(Box::new(Vcd::new(input(wave.vcd().into_bytes())).unwrap()))) {
            for event in events {
                prop_assert!(event.verdict.is_ok() || event.position.is_none() || event.fields.iter().any(|f| f.name == "ABS"));
            }
        }
        let _ = decode(Capture::Samples(Raw::new(input(wave.packed(20e6)), 20_000_000, Unit::Bit)));
    }
}
