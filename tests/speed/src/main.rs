//! What `run.py` counts the instructions of: a program that writes captures, and decodes one as the tool does.
//!
//! `servowire-speed write FOLDER` writes each line in two lengths and prints a row for each file: its name, protocol, samples a
//! second, samples and frames. `servowire-speed decode FILE PROTOCOL RATE OUTPUT` decodes it with `text` or `stats` as the output.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::std_instead_of_core
)]

#[path = "../../../servowire/tests/random/mod.rs"]
mod random;

use std::error::Error;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::Path;
use std::{env, iter};

use servowire_decode::capture::{self, Format, Hints, Input};
use servowire_decode::output::Output;
use servowire_decode::output::printer::Printer;
use servowire_decode::output::stats::Stats;
use servowire_decode::output::text::Text;
use servowire_decode::protocols::CODECS;
use servowire_decode::settings::Settings;

use random::speech::Kind;
use random::wire::{Scene, capture as draw};

/// Samples a bit.
const PER_BIT: u64 = 8;

/// A line that is drawn.
struct Drawn {
    name: &'static str,
    kind: Kind,
    bit_rate: u64,
    /// Transactions of the short capture and of the long one.
    counts: [u64; 2],
    formats: &'static [&'static str],
}

const LINES: [Drawn; 3] = [
    Drawn {
        name: "tformat",
        kind: Kind::Tformat,
        bit_rate: 2_500_000,
        // The samples of eight channels, a byte each, are decoded in words when 32,768 changes have been looked at.
        counts: [1000, 3000],
        formats: &["packed", "bytes", "vcd"],
    },
    Drawn { name: "nikon", kind: Kind::Aformat, bit_rate: 4_000_000, counts: [300, 1500], formats: &["packed"] },
    Drawn { name: "hdsl", kind: Kind::Dsl, bit_rate: 9_375_000, counts: [1200, 4800], formats: &["packed", "vcd"] },
];

/// Exchanges of the clean line whose edges all lie on the grid of samples.
const ALIGNED: [u32; 2] = [2000, 6000];

/// Writes all captures into a folder.
fn write(folder: &Path) -> io::Result<()> {
    for Drawn { name, kind, bit_rate, counts, formats } in LINES {
        for (length, count) in iter::zip(["short", "long"], counts) {
            let scene = Scene { transactions: (count, count), nominal: Some(bit_rate as f64), ..Scene::clean() };
            let drawn = draw(kind, &scene, 1);
            let rate = bit_rate * PER_BIT;
            let Some(line) = drawn.channels.first() else { continue };
            let samples = sampled(&line.edges, drawn.end, 1e12 / rate as f64);
            let events: usize = drawn.due.iter().map(|due| due.events.len()).sum();
            for format in formats {
                let bytes = if *format == "vcd" { vcd(&line.edges) } else { raw(&samples, format) };
                let file = format!("{name}-{length}.{format}");
                fs::write(folder.join(&file), bytes)?;
                println!("{file} {name} {rate} {} {events}", samples.len());
            }
        }
    }
    for (length, count) in iter::zip(["short", "long"], ALIGNED) {
        let samples = aligned(count);
        for format in ["packed", "bytes"] {
            let file = format!("aligned-{length}.{format}");
            fs::write(folder.join(&file), raw(&samples, format))?;
            println!("{file} tformat {} {} {}", 2_500_000 * PER_BIT, samples.len(), 2 * count);
        }
    }
    Ok(())
}

fn raw(samples: &[bool], format: &str) -> Vec<u8> {
    match format {
        "packed" => samples.chunks_exact(8).map(packed).collect(),
        _ => samples.iter().map(|level| u8::from(*level)).collect(),
    }
}

/// A T-Format axis that turns, every bit of it 8 samples long.
fn aligned(count: u32) -> Vec<bool> {
    let mut samples = Vec::new();
    let idle = |samples: &mut Vec<bool>, count: u64| samples.extend(iter::repeat_n(true, count as usize));
    let send = |samples: &mut Vec<bool>, bytes: &[u8]| {
        for byte in bytes {
            let bits = [false].into_iter().chain((0..8).map(|k| byte >> k & 1 == 1)).chain([true]);
            samples.extend(bits.flat_map(|bit| [bit; PER_BIT as usize]));
        }
    };
    for k in 0..count {
        let [a0, a1, a2, _] = (k.wrapping_mul(7919) & 0x7f_ffff).to_le_bytes();
        let [m0, m1, ..] = (k / 1059).to_le_bytes();
        let values = [0x1a, 0x00, a0, a1, a2, 0x17, m0, m1, 0x00, 0x00];
        let check = values.iter().fold(0, |sum, byte| sum ^ byte);
        idle(&mut samples, 25 * PER_BIT);
        send(&mut samples, &[0x1a]);
        idle(&mut samples, 15 * PER_BIT / 2);
        send(&mut samples, &[&values[..], &[check]].concat());
    }
    idle(&mut samples, 100 * PER_BIT);
    samples
}

/// Eight samples in a byte, the first in bit 0.
fn packed(eight: &[bool]) -> u8 {
    eight.iter().rev().fold(0, |byte, level| byte << 1 | u8::from(*level))
}

/// A line by samples so many picoseconds apart. Edges lie in the middle between two of them.
fn sampled(edges: &[(i64, bool)], end: i64, period: f64) -> Vec<bool> {
    let mut samples = Vec::new();
    let mut level = true;
    for (time, next) in edges.iter().copied().chain([(end, true)]) {
        samples.resize((time as f64 / period).round() as usize, level);
        level = next;
    }
    samples
}

fn vcd(edges: &[(i64, bool)]) -> Vec<u8> {
    let mut text = "$timescale 1 ns $end $var wire 1 ! line $end $enddefinitions $end\n".to_owned();
    for (time, level) in edges {
        // A String takes everything.
        let _ = write!(text, "#{}\n{}!\n", time / 1000, u8::from(*level));
    }
    text.into_bytes()
}

/// Decodes a file as the tool does.
fn decode(file: &str, protocol: &str, rate: &str, output: &str) -> Result<(), Box<dyn Error>> {
    let out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    let mut printer: Box<dyn Printer> = match output {
        "stats" => Box::new(Stats::new(out, None)),
        _ => Box::new(Text::new(out)),
    };
    let raw = Hints { sample_rate: Some(rate.parse()?), ..Hints::default() };
    let hints = match Path::new(file).extension().and_then(|end| end.to_str()) {
        Some("packed") => Hints { format: Some(Format::Packed), ..raw },
        Some("bytes") => Hints { format: Some(Format::Raw), ..raw },
        _ => Hints::default(),
    };
    let protocol = CODECS.iter().copied().find(|codec| codec.name == protocol);
    let capture = capture::open(Input::seeking(file, io::BufReader::new(File::open(file)?)), hints)?;
    let mut out = Output::new(file, printer.as_mut());
    out.begin()?;
    let end = servowire_decode::decode(file, capture, protocol, &Settings::default(), &mut out);
    out.end()?;
    eprintln!("{} good, {} not", out.tally.ok, out.tally.faults());
    end.map_err(|stop| stop.to_string().into())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["write", folder] => Ok(write(Path::new(folder))?),
        ["decode", file, protocol, rate, output] => decode(file, protocol, rate, output),
        _ => Err("servowire-speed write FOLDER | decode FILE PROTOCOL RATE text|stats".into()),
    }
}
