//! Readers of capture files, and the survey of channels behind them.
//!
//! Every reader ends on every input, its times never go back, its channels are those that it names, and it says the same
//! however the input comes in pieces.

use std::fmt::Write as _;
use std::io::{self, Cursor, Read};
use std::panic;

use servowire_decode::capture::{Capture, Change, Format, Hints, Input, Line, Memory, open};
use servowire_decode::event::Event;
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::settings::Settings;
use servowire_decode::time::Time;

use crate::byte;

/// Inputs that unpack to more are left alone: the law is about readers, not about gzip.
const MOST: u64 = 1 << 22;

/// Gives its bytes in pieces.
struct Pieces {
    bytes: Cursor<Vec<u8>>,
    size: usize,
}

impl Read for Pieces {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = buffer.len().min(self.size);
        self.bytes.read(&mut buffer[..count])
    }
}

/// Comes back from a call that panics: the library for FST does on some damaged files.
fn guarded(call: &mut dyn FnMut()) {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| ()));
    let _ = panic::catch_unwind(panic::AssertUnwindSafe(call));
    panic::set_hook(hook);
}

/// All that a reader says, as text; without a format, that of the file's own.
fn read(format: Option<Format>, data: &[u8], size: usize) -> String {
    let pieces = Pieces { bytes: Cursor::new(data.to_vec()), size };
    let input = Input::over("fuzz", pieces.take(MOST));
    let is = |formats: &[Format]| format.is_some_and(|format| formats.contains(&format));
    let hints = Hints {
        format,
        sample_rate: is(&[Format::Raw, Format::Packed, Format::Csv]).then_some(20_000_000),
        unit_size: is(&[Format::Raw]).then_some(2),
        record_size: is(&[Format::Records]).then_some(16),
        guard: Some(guarded),
        ..Hints::default()
    };
    let mut said = String::new();
    match open(input, hints) {
        Ok(Capture::Edges(mut line)) => edges(line.as_mut(), &mut said),
        Ok(Capture::Samples(mut raw)) => edges(&mut raw, &mut said),
        Ok(Capture::Bytes(mut log)) => loop {
            match log.burst() {
                Ok(Some(burst)) => {
                    assert!(!burst.bytes.is_empty() || burst.spoilt.is_some(), "a burst of nothing");
                    writeln!(said, "{burst:?}").unwrap();
                }
                Ok(None) => break,
                Err(fault) => {
                    writeln!(said, "{fault}").unwrap();
                    break;
                }
            }
        },
        Ok(Capture::Packets(mut packets)) => loop {
            match packets.packet() {
                Ok(Some(packet)) => writeln!(said, "{packet:?}").unwrap(),
                Ok(None) => break,
                Err(fault) => {
                    writeln!(said, "{fault}").unwrap();
                    break;
                }
            }
        },
        Err(fault) => writeln!(said, "{fault}").unwrap(),
    }
    said
}

fn edges(line: &mut dyn Line, said: &mut String) {
    let channels = line.channels().len();
    writeln!(said, "{:?}", line.channels()).unwrap();
    let (mut changes, mut last) = (Vec::new(), -Time::MAX);
    for _ in 0..1 << 20 {
        changes.clear();
        let more = line.read(&mut changes);
        for change in &changes {
            assert!(usize::from(change.channel) < channels, "a channel without a name");
            assert!(change.time >= last, "time goes back from {last} to {}", change.time);
            last = change.time;
            writeln!(said, "{change:?}").unwrap();
        }
        if let Some(hole) = line.hole() {
            assert!(hole.from <= hole.to, "{hole:?}");
            writeln!(said, "{hole:?}").unwrap();
        }
        match more {
            Ok(true) => {}
            Ok(false) => return,
            Err(fault) => {
                writeln!(said, "{fault}").unwrap();
                return;
            }
        }
    }
    panic!("the reader does not end");
}

/// The same in one piece and in small ones.
fn whole_and_in_pieces(format: Option<Format>, data: &[u8]) {
    let whole = read(format, data, usize::MAX);
    for size in [1, 7] {
        assert_eq!(read(format, data, size), whole, "{format:?} in pieces of {size}");
    }
}

macro_rules! readers {
    ($($(#[$doc:meta])* $name:ident: $format:ident;)*) => {$(
        $(#[$doc])*
        pub fn $name(data: &[u8]) {
            whole_and_in_pieces(Some(Format::$format), data);
        }
    )*};
}

readers! {
    /// Value change dumps.
    vcd: Vcd;
    /// Tables.
    table: Csv;
    /// Tables of bytes.
    analyzer: AnalyzerTable;
    /// Waveforms of Tektronix.
    isf: Isf;
    /// Exports of Logic 2.
    saleae: SaleaeBinary;
    /// Sessions of sigrok and DSView.
    session: Session;
    /// FST.
    fst: Fst;
    /// Text of sigrok-cli.
    sigrok_text: SigrokText;
    /// Files of the OLS client.
    ols: Ols;
    /// Samples of two bytes.
    raw: Raw;
    /// Samples of a bit.
    packed: Packed;
    /// Logs and dumps of bytes.
    hex: Hex;
    /// Records.
    records: Records;
    /// Network captures.
    packets: Pcapng;
}

/// Whatever the first bytes show it to be, packed or not.
pub fn any(data: &[u8]) {
    whole_and_in_pieces(None, data);
}

/// Counts events and holds their times against the capture's.
#[derive(Default)]
struct Counted(u64);

impl Printer for Counted {
    fn event(&mut self, _: &Origin, _: &Event) -> io::Result<()> {
        self.0 += 1;
        Ok(())
    }
}

/// The survey of up to four channels, and the decoding of what it finds: it ends, and says not more than was heard. The
/// channels are made of bytes: each is a time since the one before, a channel, and a toggle.
pub fn survey(mut data: &[u8]) {
    let names: Vec<String> = (0..=byte(&mut data) % 4).map(|name| name.to_string()).collect();
    // Edges on a grid of an eighth of a bit at one of the rates, or of 10 ns.
    let grid = [50_000, 25_000, 31_250, 18_750, 15_625, 7_812, 13_333, 10_000][usize::from(byte(&mut data) % 8)];
    let mut levels = vec![true; names.len()];
    let mut changes: Vec<Change> =
        (0..).zip(&levels).map(|(channel, level)| Change { time: Time::ZERO, channel, level: *level }).collect();
    let mut time = Time::ZERO;
    while data.len() > 1 {
        let (length, which) = (byte(&mut data), byte(&mut data));
        // Long runs are longer than a frame.
        time += i64::from(if length == 255 { 4_000 } else { u16::from(length) }) * grid;
        let channel = usize::from(which) % names.len();
        levels[channel] = !levels[channel];
        changes.push(Change { time, channel: channel as u16, level: levels[channel] });
    }
    let edges = changes.len() as u64;
    let memory = Memory::new(names, changes, time + 100 * grid);
    let mut counted = Counted::default();
    let mut out = Output::new("fuzz", &mut counted);
    // A fault is as good an end as any.
    let _ = servowire_decode::decode("fuzz", Capture::Edges(Box::new(memory)), None, &Settings::default(), &mut out);
    assert!(counted.0 <= 16 * edges, "{} events of {edges} edges", counted.0);
}
