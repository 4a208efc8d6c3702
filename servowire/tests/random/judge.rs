//! Decodes a random capture without options and holds what comes out against what is due.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::io;

use servowire_decode::capture::{Capture as Opened, Change, Memory};
use servowire_decode::event::{Direction, Event, Value, Verdict};
use servowire_decode::output::Output;
use servowire_decode::output::printer::{Lane, Origin, Printer};
use servowire_decode::recognition::Note;
use servowire_decode::settings::Settings;
use servowire_decode::time::Time;

use super::speech::Expect;
use super::wire::Capture;

/// Keeps all events by their line.
#[derive(Default)]
struct Keep {
    lanes: Vec<(Lane, Vec<Event>)>,
}

impl Keep {
    fn lanes(&mut self, origin: &Origin) {
        self.lanes.extend(origin.lanes.iter().skip(self.lanes.len()).map(|lane| (lane.clone(), Vec::new())));
    }
}

impl Printer for Keep {
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        self.lanes(origin);
        self.lanes[origin.speaks].1.push(event.clone());
        Ok(())
    }

    fn end(&mut self, origin: &Origin) -> io::Result<()> {
        self.lanes(origin);
        Ok(())
    }
}

/// How a capture came out.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Every line found, every event as it is due, nothing else.
    pub right: bool,
    /// Values shown as good that were never sent.
    pub wrong: usize,
    pub why: String,
    pub notes: String,
}

/// Decodes with no option.
pub fn decode(capture: &Capture) -> (Vec<(Lane, Vec<Event>)>, String) {
    let mut changes: Vec<Change> = Vec::new();
    for (channel, line) in (0_u16..).zip(&capture.channels) {
        changes.extend(line.edges.iter().map(|(time, level)| Change {
            time: Time::from_ps((*time).into()),
            channel,
            level: *level,
        }));
    }
    changes.sort_by_key(|change| change.time);
    let names = capture.channels.iter().map(|channel| channel.name.clone()).collect();
    let memory = Memory::new(names, changes, Time::from_ps(capture.end.into()));
    let mut keep = Keep::default();
    let said = RefCell::new(String::new());
    let notes = |note: &Note| {
        let _ = writeln!(said.borrow_mut(), "{note}");
    };
    let mut out = Output::new("x", &mut keep).with_notes(&notes);
    let opened = Opened::Edges(Box::new(memory));
    if let Err(stop) = servowire_decode::decode("x", opened, None, &Settings::default(), &mut out) {
        said.borrow_mut().push_str(&stop.to_string());
    }
    out.end().unwrap();
    (keep.lanes, said.into_inner())
}

/// Holds a capture against what is due. `inside`: it begins inside a frame, so something may be said of the piece.
pub fn judge(capture: &Capture, inside: bool) -> Outcome {
    let (lanes, notes) = decode(capture);
    let mut outcome = Outcome { right: true, notes, ..Outcome::default() };
    let blame = |why: String, outcome: &mut Outcome| {
        outcome.right = false;
        if outcome.why.is_empty() {
            outcome.why = why;
        }
    };
    if lanes.len() != capture.due.len() {
        let found: Vec<_> = lanes.iter().map(|(lane, _)| format!("{} {:?}", lane.channel, lane.protocol)).collect();
        blame(format!("{} lines found ({}) of {}", lanes.len(), found.join(", "), capture.due.len()), &mut outcome);
    }
    for due in &capture.due {
        let name = due.channels.join(" + ");
        let Some((_, events)) =
            lanes.iter().find(|(lane, _)| lane.channel == name && lane.protocol.title == due.kind.name())
        else {
            blame(format!("{name} is not found as {}", due.kind.name()), &mut outcome);
            continue;
        };
        // What is put together from several frames is not compared.
        let said: Vec<&Event> = events
            .iter()
            .filter(|event| event.kind != "cut" && event.kind != "V-frame" && event.kind != "message")
            .collect();
        outcome.wrong += said
            .iter()
            .filter(|event| {
                event.verdict == Verdict::Ok && !due.before.iter().chain(&due.events).any(|expect| fits(event, expect))
            })
            .count();
        let mut said = said.as_slice();
        if inside {
            // Pieces of what was cut come first.
            let all = |skip: &usize| said[*skip..].iter().zip(&due.events).all(|(event, expect)| fits(event, expect));
            let first = due.events.first();
            let skip = (0..said.len().min(3)).find(all);
            let skip =
                skip.or(said.iter().position(|event| first.is_some_and(|expect| fits(event, expect)))).unwrap_or(0);
            if skip > 2 {
                blame(format!("{skip} events before the first whole one"), &mut outcome);
            }
            said = &said[skip..];
        }
        for (k, expect) in due.events.iter().enumerate() {
            let got = said.get(k).map(|event| show(event));
            if !said.get(k).is_some_and(|event| fits(event, expect)) {
                blame(format!("{name}: event {k} of {} is {got:?}, due is {expect:?}", due.events.len()), &mut outcome);
                break;
            }
        }
        if said.len() > due.events.len() {
            blame(format!("{name}: more than due: {}", show(said[due.events.len()])), &mut outcome);
        }
    }
    outcome
}

fn show(event: &Event) -> String {
    let fields: Vec<_> = event.fields.iter().map(|field| format!("{} {:?}", field.name, field.value)).collect();
    format!("{:?} {} {:?} [{}] {:?}", event.direction, event.kind, event.place, fields.join(", "), event.verdict)
}

fn fits(event: &Event, expect: &Expect) -> bool {
    let verdict = match &event.verdict {
        Verdict::Ok => "ok",
        Verdict::Refused(refusal) => refusal.class,
    };
    verdict == expect.verdict
        && (event.direction == Some(Direction::Answer)) == expect.answer
        && event.kind == expect.kind
        && expect.fields.iter().all(|(name, value)| {
            event.fields.iter().any(|field| field.name == *name && number(&field.value) == Some(*value))
        })
}

fn number(value: &Value) -> Option<i64> {
    match value {
        Value::Number { value, .. } => Some(*value),
        Value::Hex { value, .. } => i64::try_from(*value).ok(),
        Value::Flags { raw, .. } => i64::try_from(*raw).ok(),
        Value::Decimal { .. } | Value::Text(_) => None,
    }
}
