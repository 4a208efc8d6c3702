//! Packed samples are taken in words, everything else edge by edge: both ways say the same, whatever is on the line.

use std::cell::RefCell;
use std::io::{self, Cursor};

use crate::random::rng::Rng;
use crate::random::speech::Kind;
use crate::random::wire::{Scene, capture};
use servowire_decode::capture::raw::{Raw, Unit};
use servowire_decode::capture::{Capture, Change, Input, Line};
use servowire_decode::event::Event;
use servowire_decode::fault::Fault;
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::recognition::Note;
use servowire_decode::settings::Settings;
use servowire_decode::time::Time;

/// Samples that are given as edges only.
struct Edges(Raw);

impl Line for Edges {
    fn channels(&self) -> &[String] {
        self.0.channels()
    }

    fn read(&mut self, changes: &mut Vec<Change>) -> Result<bool, Fault> {
        self.0.read(changes)
    }

    fn reached(&self) -> Time {
        self.0.reached()
    }
}

#[derive(Default)]
struct Said(Vec<String>);

impl Printer for Said {
    fn event(&mut self, _: &Origin, event: &Event) -> io::Result<()> {
        self.0.push(format!("{event:?}"));
        Ok(())
    }
}

/// Everything that is said of a file, and how it ends.
fn decode(bytes: &[u8], rate: u64, edges: bool) -> Vec<String> {
    let raw = Raw::new(Input::over("packed", Cursor::new(bytes.to_vec())), rate, Unit::Bit);
    let capture = if edges { Capture::Edges(Box::new(Edges(raw))) } else { Capture::Samples(raw) };
    let notes = RefCell::new(Vec::new());
    let note = |note: &Note| notes.borrow_mut().push(note.to_string());
    let mut said = Said::default();
    let mut out = Output::new("packed", &mut said).with_notes(&note);
    let end = servowire_decode::decode("packed", capture, None, &Settings::default(), &mut out);
    let end = format!("{:?}", end.map_err(|stop| stop.to_string()));
    [said.0, notes.take(), vec![end]].concat()
}

/// The line, sampled; some samples are wrong.
fn packed(edges: &[(i64, bool)], end: i64, rate: u64, wrong: u64, rng: &mut Rng) -> Vec<u8> {
    let period = 1e12 / rate as f64;
    let mut samples = Vec::new();
    let mut level = true;
    for (time, next) in edges.iter().copied().chain([(end, true)]) {
        samples.resize((time as f64 / period).round() as usize, level);
        level = next;
    }
    for _ in 0..wrong {
        let at = rng.below(samples.len() as u64) as usize;
        samples[at] = !samples[at];
    }
    samples.chunks(8).map(|eight| eight.iter().rev().fold(0, |byte, &sample| byte << 1 | u8::from(sample))).collect()
}

#[test]
fn words_say_what_edges_say() {
    let clean = Scene { transactions: (300, 1500), ..Scene::clean() };
    let scenes = [
        clean.clone(),
        Scene { inverted: true, ..clean.clone() },
        Scene { rate: 0.02, encoder: 0.04, ..clean.clone() },
        Scene { rate: 0.004, encoder: 0.004, ..clean.clone() },
        Scene { jitter: 0.1, ..clean.clone() },
        Scene { ringing: 0.2, missing: 0.2, ..clean.clone() },
        Scene { spikes: (3, 30), inside: true, ..clean },
    ];
    let mut rng = Rng::new(7);
    let rounds = servowire_world::wanted_events(60) / 20;
    for round in 0..rounds.max(1) {
        for (k, scene) in scenes.iter().enumerate() {
            for (kind, bit_rate) in [(Kind::Dsl, 9_375_000), (Kind::Tformat, 2_500_000), (Kind::Aformat, 4_000_000)] {
                let scene = Scene { nominal: Some(bit_rate as f64), ..scene.clone() };
                let capture = capture(kind, &scene, round * 100 + k as u64);
                let per_bit = rng.pick(&[8, 8, 8, 16, 5]);
                // As a crystal has it, a little off at times.
                let rate = bit_rate * per_bit + rng.pick(&[0, 0, 1, 20_000, 400_000]);
                let wrong = rng.pick(&[0, 0, 5, 100]);
                let bytes = packed(&capture.channels[0].edges, capture.end, rate, wrong, &mut rng);
                let (words, edges) = (decode(&bytes, rate, false), decode(&bytes, rate, true));
                let what = format!("{kind:?}, scene {k}, round {round}, {rate} samples/s, {wrong} wrong");
                let first = words.iter().zip(&edges).find(|(words, edges)| words != edges);
                assert!(first.is_none(), "{what}: {first:#?}");
                assert_eq!(words.len(), edges.len(), "{what}");
                assert!(words.len() > 100, "{what}: {words:?}");
            }
        }
    }
}
