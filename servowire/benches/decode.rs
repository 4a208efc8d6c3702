//! Speed of the decode path: `cargo bench -p servowire`.
//!
//! T-Format traffic at 8 samples a bit goes from memory through the reader, the receiver and the protocol into a
//! tally, as `servowire decode` does it. The plain way beside it asks for every sample on its own.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::std_instead_of_core,
    clippy::expect_used,
    clippy::unwrap_used
)]

use std::hint::black_box;
use std::io::{self, Cursor};
use std::rc::Rc;
use std::time::Instant;

use nrz_line::{Format, Receiver};
use servowire::capture::raw::{Raw, Unit};
use servowire::capture::{Capture, Input};
use servowire::event::Event;
use servowire::line::{LineField, StartStop};
use servowire::output::{Output, Printer, Sink, Tally};
use servowire::protocols::{Protocol, Settings, tformat};

/// Samples a bit.
const N: usize = 8;
/// Samples a second: 8 x 2.5 Mbit/s.
const RATE: u64 = 20_000_000;
/// Picoseconds of a bit.
const BIT: i64 = 400_000;
/// ID 3 transactions, about 10^8 samples.
const TRANSACTIONS: u32 = 80_000;
/// Runs; the best counts.
const RUNS: usize = 5;

fn main() {
    let samples = traffic();
    let count = samples.len() as f64;
    let packed: Rc<[u8]> = samples.chunks(8).map(|c| c.iter().rev().fold(0, |b, &s| b << 1 | u8::from(s))).collect();
    let bytes: Rc<[u8]> = samples.iter().map(|&s| u8::from(s)).collect();

    let plain = best(|| one_by_one(&samples));
    println!("{:.0} million samples at {N} a bit, {TRANSACTIONS} ID 3 transactions", count / 1e6);
    let show = |name: &str, seconds: f64| {
        println!("{name:<34} {:>8.1} million samples/s   {:>5.2} x", count / seconds / 1e6, plain / seconds);
    };
    show("sample by sample", plain);
    show("decode, one sample a byte", best(|| decode(&bytes, Unit::Bytes(1))));
    show("decode, packed 8 samples a byte", best(|| decode(&packed, Unit::Bit)));
}

/// Best of some runs, in seconds.
fn best(mut run: impl FnMut() -> Tally) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..RUNS {
        let start = Instant::now();
        let tally = black_box(run());
        best = best.min(start.elapsed().as_secs_f64());
        assert_eq!((tally.ok, tally.refused), (2 * u64::from(TRANSACTIONS), 0));
    }
    best
}

/// An axis that turns; 10 us between transactions.
fn traffic() -> Vec<bool> {
    let mut samples = Vec::new();
    let idle = |samples: &mut Vec<bool>, bits: usize| samples.extend(std::iter::repeat_n(true, bits * N));
    let send = |samples: &mut Vec<bool>, bytes: &[u8]| {
        for byte in bytes {
            let bits = [false].into_iter().chain((0..8).map(|k| byte >> k & 1 == 1)).chain([true]);
            samples.extend(bits.flat_map(|bit| [bit; N]));
        }
    };
    for k in 0..TRANSACTIONS {
        let [a0, a1, a2, _] = (k.wrapping_mul(7919) & 0x7f_ffff).to_le_bytes();
        let [m0, m1, ..] = (k / 1059).to_le_bytes();
        let mut answer = [0x1a, 0x00, a0, a1, a2, 0x17, m0, m1, 0x00, 0x00, 0x00];
        answer[10] = answer.iter().fold(0, |crc, byte| crc ^ byte);
        idle(&mut samples, 25);
        send(&mut samples, &[0x1a]);
        samples.extend(std::iter::repeat_n(true, 15 * N / 2));
        send(&mut samples, &answer);
    }
    idle(&mut samples, 100);
    samples
}

/// Takes events and forgets them.
struct Nowhere;

impl Sink for Nowhere {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        black_box(event);
        Ok(())
    }
}

impl Printer for Nowhere {
    fn begin(&mut self, _: &str) -> io::Result<()> {
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn decode(data: &Rc<[u8]>, unit: Unit) -> Tally {
    let input = Input::over("memory", Box::new(Cursor::new(Rc::clone(data))));
    let mut nowhere = Nowhere;
    let mut out = Output::new(&mut nowhere, None, &|| (), &|_| ());
    let capture = Capture::Samples(Raw::new(input, RATE, unit));
    Protocol::Tformat.decode("memory", capture, &Settings::default(), &mut out).expect("the traffic is good");
    out.tally
}

fn one_by_one(samples: &[bool]) -> Tally {
    let mut receiver = Receiver::new(Format::new(N as u32, 8).unwrap());
    let mut protocol = tformat::Decoder::new(BIT, tformat::Settings::default());
    let mut tally = Tally::default();
    let time = |sample: u64| i64::try_from(sample).unwrap() * BIT / N as i64;
    for &sample in samples {
        if let Some(field) = receiver.push(sample) {
            let start = time(field.start);
            let (content, delimiter, spikes) = (field.content, field.delimiter, field.spikes);
            let field = LineField { content, delimiter, start, end: start + 10 * BIT, spikes, bits: 0 };
            protocol.field(&field, &mut tally).unwrap();
        }
    }
    protocol.finish(Some(time(samples.len() as u64)), &mut tally).unwrap();
    tally
}
