//! Broken files of every format: whatever is in them, decoding ends, and with a sentence.
#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    clippy::std_instead_of_core,
    clippy::unwrap_used
)]

#[path = "random/rng.rs"]
#[allow(dead_code, unreachable_pub, clippy::cast_precision_loss, reason = "a part of the generator")]
mod rng;

use std::io::{self, Cursor};
use std::path::Path;

use rng::Rng;
use servowire::capture::{Hints, Input, open_input};
use servowire::event::Event;
use servowire::output::{Origin, Output, Printer};
use servowire::protocols::{Protocol, Settings};

struct Nowhere;

impl Printer for Nowhere {
    fn event(&mut self, _: &Origin, _: &Event) -> io::Result<()> {
        Ok(())
    }
}

fn decode(name: &str, bytes: Vec<u8>) {
    let input = Input::over(name, Box::new(Cursor::new(bytes)));
    let Ok(capture) = open_input(input, Path::new(name), Hints::default()) else { return };
    let mut nowhere = Nowhere;
    let mut out = Output::new(name, &mut nowhere, &|| (), &|_| ());
    // A fault is as good an end as any.
    let _ = Protocol::Auto.decode(name, capture, &Settings::default(), &mut out);
}

#[test]
fn hostile_files_of_every_format() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/samples");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let rounds = servowire_world::wanted_events(600) / 20;
    let mut rng = Rng::new(1);
    for file in files.iter().filter(|file| file.extension().is_none_or(|ending| ending != "md")) {
        let name = file.file_name().unwrap().to_str().unwrap();
        let sound = std::fs::read(file).unwrap();
        for _ in 0..rounds {
            let mut bytes = sound.clone();
            for _ in 0..=rng.below(6) {
                let at = rng.below(bytes.len() as u64) as usize;
                match rng.below(4) {
                    0 => bytes[at] = rng.below(256) as u8,
                    1 => bytes.truncate(at.max(1)),
                    2 => bytes.insert(at, b"0 \n#,;$\xff"[rng.below(8) as usize]),
                    _ => {
                        let until = (at + rng.below(40) as usize).min(bytes.len());
                        let piece = bytes[at..until].to_vec();
                        bytes.splice(at..at, piece);
                    }
                }
            }
            decode(name, bytes);
        }
    }
}
