//! Broken files of every format: whatever is in them, decoding ends, and with a sentence.

use std::io::{self, Cursor};
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;

use crate::random::rng::Rng;
use servowire_decode::capture::{Hints, Input, open};
use servowire_decode::event::Event;
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::settings::Settings;

struct Nowhere;

impl Printer for Nowhere {
    fn event(&mut self, _: &Origin, _: &Event) -> io::Result<()> {
        Ok(())
    }
}

/// The library for FST panics on some damaged files, and is the only one that may.
fn guarded(call: &mut dyn FnMut()) {
    let _ = panic::catch_unwind(AssertUnwindSafe(call));
}

fn decode(name: &str, bytes: Vec<u8>) {
    let input = Input::over(name, Cursor::new(bytes));
    let Ok(capture) = open(input, Hints { guard: Some(guarded), ..Hints::default() }) else { return };
    let mut nowhere = Nowhere;
    let mut out = Output::new(name, &mut nowhere);
    // A fault is as good an end as any.
    let _ = servowire_decode::decode(name, capture, None, &Settings::default(), &mut out);
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
