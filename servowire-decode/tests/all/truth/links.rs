//! HIPERFACE DSL links under many conditions.

use super::dsl::{BIT, Link, build};
use super::line::{Recording, record};
use super::rng::Rng;
use super::{Outcome, Said, decode, hold, hold_these, judge};

/// Draws a link and how it is recorded.
type Condition = fn(&mut Rng) -> (Link, Recording);

fn plain(rng: &mut Rng) -> Link {
    let delay = rng.between(0.2, 11.0);
    Link { speed: rng.about(3000), delay, five_zeros: rng.chance(0.5), anew: rng.chance(0.3), ..Link::PLAIN }
}

fn samples(rng: &mut Rng, least: f64, most: f64) -> Recording {
    Recording { period: Some(BIT / rng.between(least, most)), ..Recording::EXACT }
}

const CONDITIONS: &[(&str, Condition)] = &[
    ("exact", |rng| (plain(rng), Recording::EXACT)),
    ("8 samples a bit", |rng| (plain(rng), samples(rng, 8.0, 8.0))),
    ("4 to 20 samples a bit", |rng| (plain(rng), samples(rng, 4.0, 20.0))),
    ("inverted", |rng| (plain(rng), Recording { inverted: true, ..samples(rng, 6.0, 20.0) })),
    ("begins low", |rng| (Link { begins_low: true, ..plain(rng) }, Recording::EXACT)),
    ("begins inside a frame", |rng| (plain(rng), Recording { from: rng.between(3e6, 3e7), ..Recording::EXACT })),
    ("clock off by up to 2 %", |rng| (Link { clock: rng.between(0.98, 1.02), ..plain(rng) }, samples(rng, 8.0, 20.0))),
    ("start-up", |rng| (Link { start_up: true, frames: 60, ..plain(rng) }, samples(rng, 8.0, 20.0))),
    ("start-up, a turn of 18 to 35 bits ends", |rng| {
        let width = rng.pick(&[18, 24, 32, 35]);
        let speed = rng.about(1500);
        let from = if rng.chance(0.5) { (1 << width) - 20 * 1500 } else { 20 * 1500 };
        let signed = rng.chance(0.5);
        (Link { start_up: true, width, from, speed, signed, jolt: 5, frames: 120, ..plain(rng) }, Recording::EXACT)
    }),
    ("running, a turn of 18 to 35 bits ends", |rng| {
        let width = rng.pick(&[18, 24, 32, 35]);
        let speed = rng.pick(&[-1500, 1500]);
        let from = if speed > 0 { (1 << width) - 60 * 1500 } else { 60 * 1500 };
        (Link { width, from, speed, jolt: 5, frames: 120, ..plain(rng) }, Recording::EXACT)
    }),
    ("frames of 12 to 27 us", |rng| {
        let stuffing = rng.below(23) as usize;
        let window = Some(rng.about(23) + 48);
        (Link { window, stuffing, ..plain(rng) }, samples(rng, 8.0, 20.0))
    }),
    ("frames of 12 to 27 us from the start-up on", |rng| {
        let stuffing = rng.below(23) as usize;
        let window = Some(rng.about(23) + 48);
        (Link { window, stuffing, start_up: true, frames: 60, ..plain(rng) }, samples(rng, 8.0, 20.0))
    }),
    ("messages", |rng| (Link { messages: true, frames: 300, ..plain(rng) }, samples(rng, 8.0, 20.0))),
    ("edges off by up to an eighth of a bit", |rng| {
        (plain(rng), Recording { jitter: BIT / 8.0, ..samples(rng, 8.0, 20.0) })
    }),
    ("edges off by up to a fifth of a bit", |rng| {
        (plain(rng), Recording { jitter: BIT / 5.0, ..samples(rng, 8.0, 20.0) })
    }),
    ("bits flipped in answers", |rng| (Link { damaged: 0.05, frames: 300, ..plain(rng) }, Recording::EXACT)),
    ("bits flipped in heads", |rng| (Link { heads_damaged: 0.03, frames: 300, ..plain(rng) }, Recording::EXACT)),
];

/// From where on everything has to be there: answers once the delay is known, positions after the third V-frame.
fn due(link: &Link, recording: Recording) -> impl Fn(&Said, usize) -> bool {
    let from = recording.from + 2.0 * 273.0 * BIT;
    let clean = link.damaged == 0.0 && link.heads_damaged == 0.0;
    move |said, _| {
        let frame = matches!(&*said.kind, "H-frame" | "answer" | "test pattern" | "identifier");
        said.start > from && (frame || clean && said.kind == "message" && said.start > from + 1.2e7)
    }
}

fn run(name: &str, condition: Condition, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed ^ 0x00d5_1000 ^ (name.len() as u64) << 32);
    let (link, recording) = condition(&mut rng);
    let built = build(&link, seed);
    let edges = record(&built.wire, recording, &mut rng);
    let (events, notes) = decode(&edges, built.end);
    let mut outcome = judge(&events, &built.said, 2.0 * BIT + recording.jitter, due(&link, recording));
    let positions = events.iter().filter(|event| event.position.is_some_and(|it| it.name == "POS")).count();
    // A width that is not known costs the positions from the end of a turn to the next alignment.
    let least = link.frames.saturating_sub(if name.starts_with("running") { 80 } else { 56 });
    if link.damaged == 0.0 && link.heads_damaged == 0.0 && positions < least {
        outcome.lost.push(format!("{positions} fast positions of {} frames", link.frames));
    }
    if notes.contains("swapped") != recording.inverted {
        outcome.wrong.push(notes.clone());
    }
    outcome.notes = notes;
    outcome
}

#[test]
fn every_value_of_a_link_is_true() {
    hold(CONDITIONS, run);
}

/// Captures of which something was shown that was never said, or refused that was.
#[test]
fn what_was_once_wrong_is_right() {
    let wrong_once = [
        // A V-frame was taken for counted whose beginning nobody can know.
        ("start-up", 12),
        // An encoder that begins each answer anew went on by chance in the first ones.
        ("messages", 14),
        // A flipped bit at the front of an answer of such an encoder made another word.
        ("bits flipped in answers", 16),
        // One bit was flipped before, another after a break between two answers.
        ("bits flipped in answers", 17),
        // The flipped bit was in a word that no check of the V-frame covers.
        ("bits flipped in answers", 26),
        ("bits flipped in answers", 149),
        // All words of a damaged answer hold a bit beside it too, and its acceleration was taken there.
        ("bits flipped in answers", 57),
        ("bits flipped in answers", 244),
        // Edges on the wrong side of half a bit made words that hold, and a length of the bit that was off by one in a frame.
        ("edges off by up to a fifth of a bit", 22),
        ("edges off by up to a fifth of a bit", 24),
        ("edges off by up to a fifth of a bit", 46),
        ("edges off by up to a fifth of a bit", 69),
        // FIRST and MSYNC in a head before there was a rule.
        ("bits flipped in heads", 37),
        ("bits flipped in heads", 242),
        // What looked like a head in an answer.
        ("bits flipped in heads", 86),
        ("bits flipped in heads", 256),
        // A lone nibble, and the head after it was damaged too.
        ("bits flipped in heads", 94),
        // After a damaged head the answers half a bit beside the grid were laid on that of the master.
        ("bits flipped in heads", 133),
    ];
    hold_these(CONDITIONS, &wrong_once, run);
}
