//! Speed of the decode path: `cargo bench -p servowire --bench decode [WORD]`.
//!
//! Traffic at 8 samples a bit goes from memory through the reader, the survey, the receiver and the protocol, as
//! `servowire decode` does it without options. The plain way beside it asks for every sample on its own.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    clippy::indexing_slicing,
    clippy::std_instead_of_core,
    clippy::expect_used,
    clippy::unwrap_used
)]

mod clock;
#[path = "../tests/random/mod.rs"]
mod random;

use std::hint::black_box;
use std::io::{self, Cursor};
use std::rc::Rc;

use nrz_line::{Format, Receiver};
use random::speech::Kind;
use random::wire::{Scene, capture};
use servowire_decode::capture::raw::{Raw, Unit};
use servowire_decode::capture::{Capture, Input};
use servowire_decode::event::Event;
use servowire_decode::line::{LineField, StartStop};
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::protocols::tformat;
use servowire_decode::settings::{Settings, Widths};
use servowire_decode::sink::Tally;
use servowire_decode::time::Time;

/// Samples a bit.
const N: usize = 8;
/// Samples a second: 8 x 2.5 Mbit/s.
const RATE: u64 = 20_000_000;
/// Picoseconds of a bit.
const BIT: i64 = 400_000;
/// ID 3 transactions, about 10^8 samples.
const TRANSACTIONS: u32 = 80_000;

fn main() {
    let wanted = std::env::args().skip(1).find(|word| !word.starts_with('-')).unwrap_or_default();
    if Kind::Tformat.name().contains(&wanted) {
        tformat_lines();
    }
    for (kind, bit_rate, count) in [(Kind::Aformat, 4_000_000, 40_000), (Kind::Dsl, 9_375_000, 100_000)] {
        if !kind.name().contains(&wanted) {
            continue;
        }
        let (samples, frames) = drawn(kind, bit_rate, N as u64, count);
        println!("{}: {:.0} million samples at {N} a bit", kind.name(), samples.len() as f64 / 1e6);
        let packed = pack(&samples);
        let rate = bit_rate * N as u64;
        show("decode, packed 8 samples a byte", samples.len(), best(frames, || decode(&packed, rate, Unit::Bit)));
    }
}

fn show(name: &str, samples: usize, seconds: f64) {
    println!("  {name:<40} {:>8.1} million samples/s", samples as f64 / seconds / 1e6);
}

fn tformat_lines() {
    let samples = traffic();
    let packed = pack(&samples);
    let bytes: Rc<[u8]> = samples.iter().map(|&s| u8::from(s)).collect();
    let frames = 2 * u64::from(TRANSACTIONS);
    let plain = best(frames, || one_by_one(&samples));
    println!("T-Format: {:.0} million samples at {N} a bit", samples.len() as f64 / 1e6);
    show("sample by sample", samples.len(), plain);
    show("decode, one sample a byte", samples.len(), best(frames, || decode(&bytes, RATE, Unit::Bytes(1))));
    show("decode, packed 8 samples a byte", samples.len(), best(frames, || decode(&packed, RATE, Unit::Bit)));
}

/// Least time of some runs, in seconds; all `frames` hold.
fn best(frames: u64, run: impl FnMut() -> Tally) -> f64 {
    let (seconds, tally) = clock::best(run);
    assert_eq!((tally.ok, tally.refused), (frames, 0));
    seconds
}

/// Eight samples a byte, the oldest in bit 0.
fn pack(samples: &[bool]) -> Rc<[u8]> {
    samples.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, &sample| byte << 1 | u8::from(sample))).collect()
}

/// Random traffic of a protocol, `per_bit` samples a bit, and the frames of it that a decoder has to say.
fn drawn(kind: Kind, bit_rate: u64, per_bit: u64, count: u64) -> (Vec<bool>, u64) {
    let scene = Scene { transactions: (count, count), nominal: Some(bit_rate as f64), ..Scene::clean() };
    let capture = capture(kind, &scene, 1);
    let period = 1e12 / (bit_rate * per_bit) as f64;
    let mut samples = Vec::new();
    let mut level = true;
    // After an edge, so that the samples lie in the middle of their pieces.
    for (time, next) in capture.channels[0].edges.iter().copied().chain([(capture.end, true)]) {
        samples.resize((time as f64 / period).round() as usize, level);
        level = next;
    }
    let due = capture.due[0].events.len() as u64;
    // Every eighth answer of DSL completes a V-frame, but for the first: that has not begun with a known one.
    let more = if kind == Kind::Dsl { due / 2 / 8 - 1 } else { 0 };
    (samples, due + more)
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

impl Printer for Nowhere {
    fn event(&mut self, _: &Origin, event: &Event) -> io::Result<()> {
        black_box(event);
        Ok(())
    }
}

fn decode(data: &Rc<[u8]>, rate: u64, unit: Unit) -> Tally {
    let input = Input::over("memory", Cursor::new(Rc::clone(data)));
    let mut nowhere = Nowhere;
    let mut out = Output::new("memory", &mut nowhere);
    let capture = Capture::Samples(Raw::new(input, rate, unit));
    servowire_decode::decode("memory", capture, None, &Settings::default(), &mut out).expect("the traffic is good");
    out.tally
}

fn one_by_one(samples: &[bool]) -> Tally {
    let mut receiver = Receiver::new(Format::new(N as u32, 8).unwrap());
    let mut protocol = tformat::Decoder::new(BIT, Widths::default());
    let mut tally = Tally::default();
    let time = |sample: u64| Time::from_ps(i128::from(sample) * i128::from(BIT) / N as i128);
    for &sample in samples {
        if let Some(field) = receiver.push(sample) {
            let start = time(field.start);
            let (content, delimiter, spikes) = (field.content, field.delimiter, field.spikes);
            let field = LineField { content, delimiter, start, end: start + 10 * BIT, spikes, bits: 0 };
            protocol.field(&field, &mut tally).unwrap();
        }
    }
    protocol.finish(time(samples.len() as u64), &mut tally).unwrap();
    tally
}
