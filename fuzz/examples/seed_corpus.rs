//! Writes the seeds of the corpora from the reference vectors: `cargo run --no-default-features --example seed_corpus`.
//!
//! At most [`SEEDS`] from a file, evenly spread over its rows, each named after its row or its line. Findings that are kept
//! beside them have names of their own and are left alone.

use std::path::Path;
use std::{fs, io};

use serde_json::Value;

#[path = "seed_corpus/hdsl.rs"]
mod hdsl;
#[path = "seed_corpus/nikon.rs"]
mod nikon;
#[path = "seed_corpus/nrz_line.rs"]
mod nrz_line;
#[path = "seed_corpus/rtex.rs"]
mod rtex;
#[path = "seed_corpus/sorte.rs"]
mod sorte;
#[path = "seed_corpus/step_profile.rs"]
mod step_profile;
#[path = "seed_corpus/tformat.rs"]
mod tformat;

const SEEDS: usize = 15;

/// A target, the vector file its seeds come from, and the input that a row becomes; `None` for rows of another kind.
type Source = (&'static str, &'static str, fn(&Value) -> Option<Vec<u8>>);

const SOURCES: &[&[Source]] = &[
    hdsl::SOURCES,
    nikon::SOURCES,
    nrz_line::SOURCES,
    rtex::SOURCES,
    sorte::SOURCES,
    step_profile::SOURCES,
    tformat::SOURCES,
];

fn main() -> io::Result<()> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (target, file, input) in SOURCES.iter().copied().flatten() {
        let folder = here.join("corpus").join(target);
        fs::create_dir_all(&folder)?;
        let rows = fs::read_to_string(here.join("../tests/vectors").join(file))?;
        let seeds: Vec<(String, Vec<u8>)> =
            (1..).zip(rows.lines()).filter_map(|(at, line)| seed(file, at, line, *input)).collect();
        let step = seeds.len().div_ceil(SEEDS).max(1);
        for (name, bytes) in seeds.iter().step_by(step) {
            fs::write(folder.join(name).with_extension("seed"), bytes)?;
        }
        println!("{target}: {} seeds from {file}", seeds.len().div_ceil(step));
    }
    Ok(())
}

/// Name and input of a row. A row without a name is called after its file and line.
fn seed(file: &str, at: usize, line: &str, input: fn(&Value) -> Option<Vec<u8>>) -> Option<(String, Vec<u8>)> {
    let row: Value = serde_json::from_str(line).expect("a vector file holds JSON");
    let name = row["name"].as_str().or(row["id"].as_str()).map_or_else(|| format!("{file}-{at:04}"), str::to_owned);
    let name = name.replace(|c: char| !c.is_ascii_alphanumeric() && c != '_', "-");
    Some((name, input(&row)?))
}

/// `"0220b4"` as bytes.
fn hex(digits: &str) -> Vec<u8> {
    let digit = |c: u8| char::from(c).to_digit(16).expect("hex digits") as u8;
    digits.as_bytes().chunks(2).map(|pair| pair.iter().fold(0, |byte, c| byte << 4 | digit(*c))).collect()
}

/// `"0010"` or samples as bytes, the first in bit 0; the last byte is filled with idle line.
fn packed(levels: impl IntoIterator<Item = bool>) -> Vec<u8> {
    let levels: Vec<bool> = levels.into_iter().collect();
    let byte = |eight: &[bool]| (0..8).fold(0, |byte, k| byte | u8::from(eight.get(k) != Some(&false)) << k);
    levels.chunks(8).map(byte).collect()
}
