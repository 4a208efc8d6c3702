//! What spoils a line is named where it is so, with its place, and nowhere else.

use super::bus::{Bias, Bus, Kind, build};
use super::line::{Recording, Wire, record};
use super::rng::Rng;
use super::{decode, judge};

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
                // As part of the edge, and a little behind it.
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
            part.edges.iter().for_each(|(time, level)| wire.drive(now + time, *level));
            own.iter_mut().for_each(|it| it.start += now);
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

#[test]
fn a_clock_that_is_off_is_named_by_how_much() {
    for seed in 0..2 {
        for kind in [Kind::Tformat, Kind::Aformat] {
            for (rates, name) in [
                ([1.0, 1.0], "Mbit/s (+0.00 % on the line)"),
                ([1.018, 1.018], "Mbit/s (+1.80 % on the line)"),
                ([0.982, 0.982], "Mbit/s (-1.80 % on the line)"),
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
