//! T-Format and A-format lines under many conditions.

use super::bus::{Bias, Bus, Kind, build};
use super::line::{Recording, record};
use super::rng::Rng;
use super::{Outcome, decode, hold, hold_these, judge};

/// Draws a line and how it is recorded, as bits a sample.
type Condition = fn(&mut Rng, Bus) -> (Bus, Option<f64>, Recording);

fn exact(bus: Bus) -> (Bus, Option<f64>, Recording) {
    (bus, None, Recording::EXACT)
}

const CONDITIONS: &[(&str, Condition)] = &[
    ("exact", |_, bus| exact(bus)),
    ("4 to 20 samples a bit", |rng, bus| (bus, Some(rng.between(4.0, 20.0)), Recording::EXACT)),
    ("inverted", |_, bus| (bus, Some(8.0), Recording { inverted: true, ..Recording::EXACT })),
    ("begins low", |_, bus| exact(Bus { begins_low: true, ..bus })),
    ("begins inside a frame", |rng, bus| {
        (bus, None, Recording { from: (30.0 + rng.between(0.5, 20.0)) * 1e12 / bus.rate, ..Recording::EXACT })
    }),
    ("clocks off by up to 2 %", |rng, bus| {
        exact(Bus { clocks: [rng.between(0.98, 1.02), rng.between(0.98, 1.02)], ..bus })
    }),
    ("edges off by a tenth of a bit", |_, bus| {
        (bus, Some(12.0), Recording { jitter: 0.1e12 / bus.rate, ..Recording::EXACT })
    }),
    ("answers missing", |_, bus| exact(Bus { missing: 0.2, ..bus })),
    ("bits flipped", |_, bus| exact(Bus { damaged: 0.2, ..bus })),
    ("spikes", |_, bus| exact(Bus { spikes: 5, ..bus })),
    ("floats low, its drivers on before their start bits", |rng, bus| {
        let bias = Bias::Missing { lead: rng.between(0.5, 3.0), hold: rng.between(0.0, 1.5) };
        (Bus { bias, ..bus }, Some(12.0), Recording::EXACT)
    }),
    ("floats low, its drivers on with their start bits", |rng, bus| {
        let bias = Bias::Missing { lead: 0.0, hold: rng.between(0.0, 1.0) };
        (Bus { bias, clocks: [rng.between(0.99, 1.01), rng.between(0.99, 1.01)], ..bus }, Some(12.0), Recording::EXACT)
    }),
    ("floats low, answers missing and bits flipped", |rng, bus| {
        let bias = Bias::Missing { lead: rng.pick(&[0.0, 1.0]), hold: 0.2 };
        exact(Bus { bias, missing: 0.1, damaged: 0.1, ..bus })
    }),
    ("dips when a driver lets go", |_, bus| exact(Bus { bias: Bias::Weak(0.6, 1.5), ..bus })),
    ("dips, sampled, answers missing and bits flipped", |rng, bus| {
        let bus = Bus { bias: Bias::Weak(0.6, 1.5), missing: 0.1, damaged: 0.1, ..bus };
        (bus, Some(rng.between(8.0, 20.0)), Recording::EXACT)
    }),
];

fn run(name: &str, condition: Condition, kind: Kind, seed: u64) -> Outcome {
    let mut rng = Rng::new(seed ^ 0x00b0_5000 ^ (name.len() as u64) << 32);
    let rates: &[f64] = match kind {
        Kind::Tformat => &[2.5e6, 5e6],
        Kind::Aformat => &[2.5e6, 4e6, 8e6],
    };
    let plain = Bus { kind, rate: rng.pick(rates), ..Bus::PLAIN };
    let (bus, samples, mut recording) = condition(&mut rng, plain);
    let bit = 1e12 / bus.rate;
    recording.period = samples.map(|samples| bit / samples);
    let (wire, said, end) = build(&bus, seed);
    let edges = record(&wire, recording, &mut rng);
    let (events, notes) = decode(&edges, end);
    let from = recording.from + if recording.from > 0.0 { 130.0 * bit } else { 0.0 };
    let mut outcome = judge(&events, &said, bit, |said, _| said.start > from);
    if notes.contains("swapped") != recording.inverted {
        outcome.wrong.push(notes.clone());
    }
    let told = [
        ("floats low, no bias", matches!(bus.bias, Bias::Missing { .. })),
        ("dips of", matches!(bus.bias, Bias::Weak(..))),
    ];
    for (what, is_so) in told {
        if notes.contains(what) != is_so {
            outcome.wrong.push(format!("{what}: {notes}"));
        }
    }
    outcome.notes = notes;
    outcome
}

#[test]
fn every_value_of_t_format_is_true() {
    hold(CONDITIONS, |name, condition, seed| run(name, condition, Kind::Tformat, seed));
}

#[test]
fn every_value_of_a_format_is_true() {
    hold(CONDITIONS, |name, condition, seed| run(name, condition, Kind::Aformat, seed));
}

#[test]
fn what_was_once_wrong_in_a_format_is_right() {
    let wrong_once = [
        // Requests alone were certain enough on a line whose drivers are on before them, and its polarity was doubted.
        ("floats low, answers missing and bits flipped", 52),
        // The edges of an answer after a dip looked like a request to which the answer was missing, and that was told.
        ("dips when a driver lets go", 54),
    ];
    hold_these(CONDITIONS, &wrong_once, |name, condition, seed| run(name, condition, Kind::Aformat, seed));
}

#[test]
fn what_was_once_wrong_in_t_format_is_right() {
    let floats = "floats low, answers missing and bits flipped";
    let dips = "dips, sampled, answers missing and bits flipped";
    let wrong_once = [
        // A request and the low of the change of direction, a field of zeros, passed for an answer: the check field does not see zeros.
        (floats, 23),
        (floats, 25),
        (floats, 34),
        (floats, 59),
        // And at the beginning, where it is not known how frames begin.
        (floats, 63),
        // The dip after a damaged answer was taken for a damaged request, and the next request for its answer.
        (dips, 8),
        (dips, 21),
        (dips, 50),
        // A piece of a damaged answer looked like a request.
        (dips, 3),
        (dips, 9),
        // A request, a dip and the beginning of the answer passed for an answer: the check field was that by chance.
        (dips, 16),
        // A request, a dip and a damaged answer were one frame: without the dip, two frames do not hold.
        (dips, 14),
        (dips, 20),
        (dips, 25),
        (dips, 31),
        (dips, 42),
        (dips, 57),
    ];
    hold_these(CONDITIONS, &wrong_once, |name, condition, seed| run(name, condition, Kind::Tformat, seed));
}
