//! What spoils a line is named where it is so, with its place, and nowhere else.

use super::bus::{Bias, Bus, Kind, build};
use super::line::{Recording, Wire, record};
use super::rng::Rng;
use super::{decode, judge};
use servowire_decode::event::Event;

/// After each edge of a kind the line is at the level before it again, for `bits`, `behind` bits later.
fn ringing(wire: &Wire, bit: f64, falling: bool, rising: bool, behind: f64, bits: f64) -> Wire {
    let mut out = Wire::new(wire.begins);
    for (at, (time, level)) in wire.edges.iter().enumerate() {
        out.drive(*time, *level);
        let lasts = wire.edges.get(at + 1).is_none_or(|next| next.0 > time + (behind + bits + 0.4) * bit);
        if lasts && if *level { rising } else { falling } {
            out.drive(time + behind * bit, !level);
            out.drive(time + (behind + bits) * bit, *level);
        }
    }
    out
}

#[test]
fn spikes_are_named_with_the_edges_that_they_are_on() {
    for seed in 0..2 {
        for kind in [Kind::Tformat, Kind::Aformat] {
            let (wire, mut said, end) = build(&Bus { kind, ..Bus::PLAIN }, seed);
            for it in &mut said {
                it.fields.push(("spikes", super::Shown::Any));
            }
            let bit = 400e3;
            for (falling, rising, name) in [
                (true, false, "spikes of 0.2 bit on falling edges beside "),
                (false, true, "spikes of 0.2 bit on rising edges beside "),
                (true, true, "spikes of 0.2 bit on all edges beside "),
                (false, false, ""),
            ] {
                // As part of the edge, and a little after it.
                for behind in [0.25, 0.45] {
                    let rings = ringing(&wire, bit, falling, rising, behind, 0.2);
                    let (events, notes) = decode(&record(&rings, Recording::EXACT, &mut Rng::new(seed)), end);
                    let is_named = if name.is_empty() { !notes.contains("spike") } else { notes.contains(name) };
                    assert!(is_named, "{kind:?}, seed {seed}, {behind}: {name:?} is due, {notes}");
                    let outcome = judge(&events, &said, bit, |_, _| true);
                    assert!(outcome.is_right(), "{}", outcome.told(name, seed));
                }
            }
        }
    }
}

/// However many frames were damaged beyond help, dips that come later are passed over.
#[test]
fn dips_after_many_damaged_frames_are_passed_over() {
    for kind in [Kind::Tformat, Kind::Aformat] {
        let plain = Bus { kind, ..Bus::PLAIN };
        let weak = Bias::Weak(0.6, 1.5);
        let parts = [
            plain,
            Bus { damaged: 1.0, exchanges: 100, ..plain },
            // The line changes at once, and after a while.
            Bus { bias: weak, exchanges: 60, ..plain },
            Bus { damaged: 1.0, exchanges: 100, ..plain },
            plain,
            Bus { bias: weak, ..plain },
        ];
        let mut wire = Wire::new(true);
        let (mut said, mut now, mut from) = (Vec::new(), 0.0, Vec::new());
        for (seed, bus) in (0..).zip(&parts) {
            let (part, mut own, end) = build(bus, seed);
            for (time, level) in &part.edges {
                wire.drive(now + time, *level);
            }
            for it in &mut own {
                it.start += now;
            }
            said.append(&mut own);
            from.push(now);
            now += end;
        }
        let (events, notes) = decode(&record(&wire, Recording::EXACT, &mut Rng::new(0)), now);
        // One failure in sixteen shows that the line has changed.
        let changed = |start: f64| start >= from[2] && start < from[2] + (from[3] - from[2]) / 3.0;
        let outcome = judge(&events, &said, 400e3, |said, _| !changed(said.start));
        assert!(outcome.is_right(), "{kind:?}: {notes}\n{}", outcome.told("", 0));
    }
}

#[test]
fn spikes_anywhere_are_on_no_edges() {
    for seed in 0..2 {
        let (wire, _, end) = build(&Bus { spikes: 400, ..Bus::PLAIN }, seed);
        let (_, notes) = decode(&record(&wire, Recording::EXACT, &mut Rng::new(seed)), end);
        assert!(notes.contains(" spikes beside "), "{notes}");
    }
}

/// A line that is low where one of two drives it low.
fn both(a: &Wire, b: &[(f64, bool)]) -> Wire {
    let mut edges: Vec<(f64, usize, bool)> = Vec::new();
    edges.extend(a.edges.iter().map(|(time, level)| (*time, 0, *level)));
    edges.extend(b.iter().map(|(time, level)| (*time, 1, *level)));
    edges.sort_by(|x, y| x.0.total_cmp(&y.0));
    let (mut levels, mut out) = ([a.begins, true], Wire::new(a.begins));
    for (time, who, level) in edges {
        levels[who] = level;
        out.drive(time, levels[0] && levels[1]);
    }
    out
}

/// A second encoder answers each request too, `late` bits after the first one.
fn answered_twice(kind: Kind, seed: u64, late: f64, clock: f64) -> (Wire, Vec<f64>, f64) {
    let bus = Bus { kind, ..Bus::PLAIN };
    let (wire, said, end) = build(&bus, seed);
    let (other, others, _) = build(&Bus { clocks: [clock; 2], ..bus }, seed + 1000);
    let mut more = Vec::new();
    let answers = |said: &[super::Said]| said.iter().skip(1).step_by(2).map(|it| it.start).collect::<Vec<f64>>();
    let (own, others) = (answers(&said), answers(&others));
    for (to, from) in own.iter().zip(&others) {
        let edges = other.edges.iter().filter(|(time, _)| *time >= from - 1.0 && *time < from + 52e6);
        more.extend(edges.map(|(time, level)| (time - from + to + late * 400e3, *level)));
        more.push((to + late * 400e3 + 52e6, true));
    }
    (both(&wire, &more), own, end)
}

#[test]
fn two_drivers_at_once_are_named() {
    let (mut named, mut wanted) = (0, 0);
    for seed in 0..3 {
        for kind in [Kind::Tformat, Kind::Aformat] {
            for (late, clock) in
                [(0.25, 1.0), (0.4, 0.9999), (0.5, 1.0), (0.7, 1.0), (0.75, 1.0001), (1.3, 1.0), (2.5, 1.001)]
            {
                for samples in [None, Some(20.0)] {
                    let (wire, answers, end) = answered_twice(kind, seed, late, clock);
                    let recording = Recording { period: samples.map(|samples| 400e3 / samples), ..Recording::EXACT };
                    let (events, _) = decode(&record(&wire, recording, &mut Rng::new(seed)), end);
                    let is_told = |event: &Event| format!("{:?}", event.verdict).contains("two drive at once");
                    let told: Vec<f64> = events.iter().filter(|event| is_told(event)).map(super::start).collect();
                    let near = |from: &&f64| told.iter().any(|at| (**from - 1e6..**from + 60e6).contains(at));
                    let (told, answers) = (answers.iter().filter(near).count(), answers.len());
                    println!("{kind:?} {late} {clock} {samples:?}: {told} of {answers}");
                    (named, wanted) = (named + told, wanted + answers);
                }
            }
        }
    }
    // Where both say the same, they look like one that is slow.
    assert!(2 * named >= wanted, "{named} of {wanted} are named");
}

#[test]
fn nobody_else_drives_where_a_line_is_only_bad() {
    for seed in 0..6 {
        for kind in [Kind::Tformat, Kind::Aformat] {
            let plain = Bus { kind, damaged: 0.5, ..Bus::PLAIN };
            for (bus, samples, jitter) in [
                (plain, None, 0.0),
                (plain, Some(4.0), 0.0),
                (plain, Some(6.3), 0.0),
                (plain, Some(12.0), 0.1),
                (plain, None, 0.15),
                (Bus { bias: Bias::Weak(0.6, 1.7), ..plain }, None, 0.0),
                (Bus { bias: Bias::Weak(0.6, 1.7), clocks: [1.0, 1.01], ..plain }, Some(9.0), 0.0),
                (Bus { bias: Bias::Missing { lead: 1.0, hold: 0.4 }, ..plain }, Some(12.0), 0.0),
                (Bus { spikes: 60, ..plain }, None, 0.0),
            ] {
                let (wire, _, end) = build(&bus, seed);
                let recording = Recording {
                    period: samples.map(|samples| 400e3 / samples),
                    jitter: jitter * 400e3,
                    ..Recording::EXACT
                };
                let (events, _) = decode(&record(&wire, recording, &mut Rng::new(seed)), end);
                let told = events.iter().find(|event| format!("{:?}", event.verdict).contains("two drive at once"));
                assert!(told.is_none(), "{kind:?}, seed {seed}, {bus:?}, {samples:?}, {jitter}: {told:?}");
            }
        }
    }
}

#[test]
fn a_clock_that_is_off_is_named_by_how_much() {
    for seed in 0..2 {
        for kind in [Kind::Tformat, Kind::Aformat] {
            for (rates, name) in [
                ([1.0, 1.0], "Mbit/s (+0.00 % on the line)"),
                ([1.018, 1.018], "Mbit/s (+1.80 % on the line)"),
                ([0.982, 0.982], "Mbit/s (-1.80 % on the line)"),
                ([1.0, 1.018], "Mbit/s (+0.0 to +1.8 % on the line)"),
                ([1.018, 1.0], "Mbit/s (+0.0 to +1.8 % on the line)"),
                ([1.0, 0.982], "Mbit/s (-1.8 to +0.0 % on the line)"),
                ([0.996, 1.004], "Mbit/s (-0.4 to +0.4 % on the line)"),
            ] {
                let clocks = rates.map(|rate: f64| 1.0 / rate);
                let (wire, said, end) = build(&Bus { kind, clocks, ..Bus::PLAIN }, seed);
                let (events, notes) = decode(&record(&wire, Recording::EXACT, &mut Rng::new(seed)), end);
                assert!(notes.contains(name), "{kind:?}, seed {seed}: {name} is due, {notes}");
                let outcome = judge(&events, &said, 400e3, |_, _| true);
                assert!(outcome.is_right(), "{}", outcome.told(name, seed));
            }
        }
    }
}
