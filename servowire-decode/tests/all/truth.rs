//! Truth in every shown value: generated captures, with the truth of all that may be shown of each frame beside them.
//!
//! `TRUTH_CAPTURES=1000 cargo test -p servowire-decode --release --test all truth:: -- --nocapture` draws more and prints the tally;
//! `TRUTH_ONLY` names a part of the condition that is wanted, `TRUTH_SEED` one seed.

mod bus;
mod buses;
mod causes;
mod dsl;
mod exports;
mod line;
mod links;
mod logs;
mod network;
mod packets;
mod ring;
mod rng;

use std::borrow::Cow;

use servowire_decode::capture::{Capture, Change, Memory};
use servowire_decode::codec::Codec;
use servowire_decode::event::{Event, Place, Value};
use servowire_decode::output::Output;
use servowire_decode::recognition::Note;
use servowire_decode::settings::Settings;
use servowire_decode::time::Time;

use crate::Keep;

/// A value as it may be shown.
#[derive(Debug, Clone, PartialEq)]
enum Shown {
    Number(i64),
    /// The next whole number up or down.
    Near(f64),
    /// Picoseconds, and by how many more or fewer.
    Within(f64, f64),
    Text(String),
    /// All bits, and the names of those that are set.
    Flags(u64, Vec<&'static str>),
    /// The truth, or what nobody can tell from it.
    Either(Box<[Shown; 2]>),
    /// Whatever it is.
    Any,
}

impl Shown {
    fn allows(&self, value: &Value) -> bool {
        let number = match value {
            Value::Number { value, .. } => Some(*value),
            Value::Hex { value, .. } | Value::Flags { raw: value, .. } => i64::try_from(*value).ok(),
            Value::Decimal { .. } | Value::Text(_) => None,
        };
        match self {
            Self::Number(due) => number == Some(*due),
            Self::Near(due) => number.is_some_and(|number| (number as f64 - due).abs() <= 1.0),
            Self::Within(due, near) => number.is_some_and(|number| (number as f64 - due).abs() <= *near),
            Self::Flags(due, names) => matches!(value, Value::Flags { raw, set, .. } if raw == due && set == names),
            Self::Text(due) => matches!(value, Value::Text(text) if text == due),
            Self::Either(both) => both.iter().any(|it| it.allows(value)),
            Self::Any => true,
        }
    }
}

/// What was said on the line, and every value that may be shown of it.
#[derive(Debug, Clone)]
struct Said {
    kind: Cow<'static, str>,
    /// Its first bit in picoseconds, or its line where there are no times.
    start: f64,
    fields: Vec<(&'static str, Shown)>,
    position: Option<(&'static str, i64)>,
    /// Bits of it were flipped on the way.
    damaged: bool,
}

/// How a capture came out.
#[derive(Debug, Default)]
struct Outcome {
    /// Values shown in frames that are `ok`, and those of them that are not the truth.
    shown: usize,
    wrong: Vec<String>,
    /// Frames that were said whole and are missing or refused.
    lost: Vec<String>,
    /// What was said by the decoder beside the events.
    notes: String,
}

impl Outcome {
    fn is_right(&self) -> bool {
        self.wrong.is_empty() && self.lost.is_empty()
    }

    /// What went wrong, the first of each.
    fn told(&self, name: &str, seed: u64) -> String {
        let few = |list: &[String]| list.iter().take(4).cloned().collect::<Vec<_>>().join("\n    ");
        format!("{name}, seed {seed}: {}\n    {}\n    lost {}\n", self.notes, few(&self.wrong), few(&self.lost))
    }
}

/// A recording of one line in memory.
fn memory(edges: &[(i64, bool)], end: f64) -> Capture {
    let change =
        |(time, level): &(i64, bool)| Change { time: Time::from_ps((*time).into()), channel: 0, level: *level };
    let changes = edges.iter().map(change).collect();
    Capture::Edges(Box::new(Memory::new(vec!["LINE".to_owned()], changes, Time::from_ps(end as i128))))
}

/// All events of a line, found without a hint.
fn decode(edges: &[(i64, bool)], end: f64) -> (Vec<Event>, String) {
    read(memory(edges, end), None, &Settings::default())
}

/// All events of a capture, and what was said beside them.
fn read(capture: Capture, protocol: Option<&'static dyn Codec>, settings: &Settings) -> (Vec<Event>, String) {
    let mut keep = Keep::default();
    let said = std::cell::RefCell::new(String::new());
    let notes = |note: &Note| said.borrow_mut().push_str(&note.to_string());
    let mut out = Output::new("x", &mut keep).with_notes(&notes);
    if let Err(stop) = servowire_decode::decode("x", capture, protocol, settings, &mut out) {
        said.borrow_mut().push_str(&stop.to_string());
    }
    (keep.0, said.into_inner())
}

/// When it begins, or in which line it is.
fn start(event: &Event) -> f64 {
    match event.place {
        Place::Time { start, .. } => start.ps() as f64,
        Place::Line(line) => line as f64,
    }
}

/// Holds what is shown against what was said; `near`: picoseconds by which a frame may be shown early or late.
fn judge(events: &[Event], said: &[Said], near: f64, due: impl Fn(&Said, usize) -> bool) -> Outcome {
    let mut outcome = Outcome::default();
    let mut met = vec![false; said.len()];
    for event in events.iter().filter(|event| event.verdict.is_ok() && !event.remark && event.kind != "cut") {
        let start = start(event);
        let same = |it: &Said| it.kind == event.kind && (it.start - start).abs() <= near;
        let Some(at) = (0..said.len()).find(|at| same(&said[*at]) && !met[*at]) else {
            outcome.wrong.push(format!("nothing like it was said: {event:?}"));
            continue;
        };
        met[at] = true;
        for field in &event.fields {
            outcome.shown += 1;
            // What is said of damage.
            let note = field.name == "note" && said[at].damaged;
            let allowed =
                note || said[at].fields.iter().any(|(name, due)| *name == field.name && due.allows(&field.value));
            if !allowed {
                let due = said[at].fields.iter().find(|(name, _)| *name == field.name);
                let at = start / 1e6;
                let (kind, name, value) = (&event.kind, field.name, &field.value);
                outcome.wrong.push(format!("{kind} at {at:.2} us: {name} is {value:?}, true is {due:?}"));
            }
        }
        if let Some(delay) = event.delay {
            outcome.shown += 1;
            let value = Value::Number { value: delay, unit: "ps" };
            let due = said[at].fields.iter().find(|(name, _)| *name == "delay");
            if !due.is_some_and(|(_, due)| due.allows(&value)) {
                outcome.wrong.push(format!("delay {delay}, true is {due:?}"));
            }
        }
        if let Some(position) = event.position {
            outcome.shown += 1;
            if said[at].position != Some((position.name, position.counts)) {
                let due = said[at].position;
                outcome.wrong.push(format!("at {:.2} us: {position:?}, true is {due:?}", start / 1e6));
            }
        }
    }
    for (at, it) in said.iter().enumerate() {
        if !met[at] && !it.damaged && due(it, at) {
            let instead = events.iter().find(|event| (start(event) - it.start).abs() <= near && !event.verdict.is_ok());
            outcome.lost.push(format!("{} at {:.2} us: {:?}", it.kind, it.start / 1e6, instead.map(|it| &it.verdict)));
        }
    }
    outcome
}

/// How many captures a condition gets: `TRUTH_CAPTURES` of all.
fn captures(few: u64, conditions: usize) -> u64 {
    let wanted = std::env::var("TRUTH_CAPTURES").ok().and_then(|text| text.parse::<u64>().ok());
    wanted.map_or(few, |wanted| wanted.div_ceil(conditions as u64))
}

/// Judges some captures of each condition and prints how many came out right; panics where one did not.
fn hold<C: Copy>(conditions: &[(&str, C)], run: impl Fn(&str, C, u64) -> Outcome) {
    let mut faults = String::new();
    let only = std::env::var("TRUTH_ONLY").unwrap_or_default();
    for (name, condition) in conditions.iter().filter(|it| it.0.contains(&only)) {
        let (mut right, mut shown, mut wrong, mut lost) = (0, 0, 0, 0);
        let count = captures(2, conditions.len());
        let one = std::env::var("TRUTH_SEED").ok().and_then(|seed| seed.parse::<u64>().ok());
        for seed in one.map_or(0..count, |one| one..one + 1) {
            let outcome = run(name, *condition, seed);
            right += u64::from(outcome.is_right());
            (shown, wrong, lost) = (shown + outcome.shown, wrong + outcome.wrong.len(), lost + outcome.lost.len());
            if !outcome.is_right() && faults.len() < 9000 {
                faults.push_str(&outcome.told(name, seed));
            }
        }
        println!("{name:<45} {right:>4} of {count} right; {shown:>7} values shown, {wrong} wrong, {lost} frames lost");
    }
    assert!(faults.is_empty(), "{faults}");
}

/// Judges single captures again that came out wrong once.
fn hold_these<C: Copy>(conditions: &[(&str, C)], seeds: &[(&str, u64)], run: impl Fn(&str, C, u64) -> Outcome) {
    let mut faults = String::new();
    for (name, seed) in seeds {
        let (_, condition) = conditions.iter().find(|it| it.0 == *name).unwrap();
        let outcome = run(name, *condition, *seed);
        if !outcome.is_right() {
            faults.push_str(&outcome.told(name, *seed));
        }
    }
    assert!(faults.is_empty(), "{faults}");
}
