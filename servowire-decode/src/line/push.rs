//! All channels of a recording while it comes: which are decoded, which are nothing, which have hardly moved yet.

use std::io;

use super::lane::{LineDecoder, Tap, Wires};
use super::nothing::nothing;
use super::survey::{Candidates, FEWEST, Found, SAMPLE, Speech};
use crate::capture::samples::Samples;
use crate::capture::{Change, Hole};
use crate::codec::Codec;
use crate::fault::{At, Fault, Stop};
use crate::output::Output;
use crate::output::printer::Lane;
use crate::recognition::Note;
use crate::settings::{Options, Settings};
use crate::time::Time;

/// Changes looked at before decoding begins.
const PREVIEW: usize = 1 << 16;
/// The same of a single channel.
const PREVIEW_OF_ONE: usize = 1 << 12;
/// Changes of one channel by which it is judged later on.
const ENOUGH: usize = 1 << 9;
/// Changes of undecided channels that are kept together.
const MOST_KEPT: usize = 1 << 20;
/// What the last chance of a line asks for: a request whose answer came.
const LEAST: i64 = 4;
/// Channels that are tried in one survey, the busiest first.
const MOST_TRIED: usize = 4096;
/// A channel in which nothing was found is looked at again after this many times the edges it was judged by.
const PATIENCE: u64 = 8;

/// An edge of a channel that is not judged yet: its time, and in the lowest bit the level. There may be very many of them.
#[derive(Debug, Clone, Copy)]
struct Kept(i128);

impl Kept {
    fn new(time: Time, level: bool) -> Self {
        Self(time.ps() << 1 | i128::from(level))
    }

    fn edge(self) -> (Time, bool) {
        (Time::from_ps(self.0 >> 1), self.0 & 1 == 1)
    }
}

fn edges_of(kept: &[Kept]) -> Vec<(Time, bool)> {
    kept.iter().map(|kept| kept.edge()).collect()
}

/// What a channel is.
#[derive(Debug, Clone)]
enum State {
    /// Not judged yet.
    Open(Vec<Kept>),
    /// Part of a line that is decoded.
    Taken(usize),
    /// Nothing, or more of what is decoded already; looked at again after this many edges, if at all.
    Passed(Option<u64>),
}

/// A line being decoded.
struct Running {
    wires: Wires,
    decoder: Box<dyn LineDecoder>,
}

/// Decodes a recording of lines that is pushed in piece by piece: edges in, events out.
pub struct PushDecoder {
    file: String,
    names: Vec<String>,
    protocol: Option<&'static dyn Codec>,
    /// The channels that the user named; everything else is of no interest.
    only: Option<Vec<u16>>,
    candidates: Candidates,
    states: Vec<State>,
    lines: Vec<Running>,
    found: Vec<Found>,
    /// Changes before the first survey, in their order.
    held: Option<Vec<Change>>,
    /// Holes between them, each with the number of changes before it.
    holes: Vec<(usize, Hole)>,
    kept: usize,
    /// Changes held back when they were judged early.
    tried: usize,
    /// Channels that have enough edges to be judged.
    due: bool,
    /// For messages when nothing was found: the busiest channel's first edges.
    busiest: Option<(u16, Vec<(Time, bool)>)>,
    /// Edges by channel.
    moves: Vec<u64>,
}

impl PushDecoder {
    /// Of a recording called `file` with channels of these names; `protocol`: otherwise all are tried.
    pub fn new(
        file: &str,
        names: &[String],
        protocol: Option<&'static dyn Codec>,
        settings: &Settings,
    ) -> Result<Self, Fault> {
        let only = wanted(&settings.line, names).map_err(|what| Fault::new(file, At::File, what))?;
        let pair = match only.as_deref() {
            Some([requests, answers]) => Some([*requests, *answers]),
            _ => None,
        };
        let state = |channel: u16| match &only {
            Some(only) if !only.contains(&channel) => State::Passed(None),
            _ => State::Open(Vec::new()),
        };
        Ok(Self {
            file: file.to_owned(),
            names: names.to_vec(),
            protocol,
            states: (0..u16::try_from(names.len()).unwrap_or(u16::MAX)).map(state).collect(),
            only,
            candidates: Candidates::new(protocol, settings.clone(), pair),
            lines: Vec::new(),
            found: Vec::new(),
            held: Some(Vec::new()),
            holes: Vec::new(),
            kept: 0,
            tried: 0,
            due: false,
            busiest: None,
            moves: vec![0; names.len()],
        })
    }

    /// The next changes, in the order of time; the first of a channel is its level at the beginning.
    pub fn changes(&mut self, changes: &[Change], out: &mut Output<'_>) -> io::Result<()> {
        for change in changes {
            self.change(*change, out)?;
        }
        if let Some(held) = &mut self.held {
            held.extend_from_slice(changes);
        }
        Ok(())
    }

    /// Whether it is time for a survey.
    fn is_due(&self) -> bool {
        match &self.held {
            // Of each channel only the first edges are looked at.
            Some(held) => held.len() >= PREVIEW.min(self.names.len() * PREVIEW_OF_ONE),
            None => self.due || self.kept >= MOST_KEPT,
        }
    }

    fn change(&mut self, change: Change, out: &mut Output<'_>) -> io::Result<()> {
        if self.held.is_none() && out.wants_changes() {
            out.change(&change)?;
        }
        if let Some(moves) = self.moves.get_mut(usize::from(change.channel)) {
            *moves += 1;
        }
        let Some(state) = self.states.get_mut(usize::from(change.channel)) else { return Ok(()) };
        match state {
            State::Taken(line) => {
                let line = *line;
                self.give(line, change, out)?;
            }
            State::Open(edges) => {
                edges.push(Kept::new(change.time, change.level));
                self.kept += 1;
                self.due |= self.held.is_none() && edges.len() == ENOUGH;
            }
            State::Passed(Some(left)) => {
                *left -= 1;
                if *left == 0 {
                    *state = State::Open(Vec::new());
                }
            }
            State::Passed(None) => {}
        }
        Ok(())
    }

    /// Whether all there is is one channel whose line is decoded, so that nobody else needs its changes.
    pub(super) fn takes_samples(&self, out: &Output<'_>) -> bool {
        self.held.is_none() && matches!(self.states.as_slice(), [State::Taken(_)]) && !out.wants_changes()
    }

    /// The next samples of the only channel.
    pub(super) fn samples(&mut self, samples: Samples<'_>, out: &mut Output<'_>) -> io::Result<()> {
        let ([running], [Found { taps, .. }]) = (self.lines.as_mut_slice(), self.found.as_slice()) else {
            return Ok(());
        };
        out.lane(0);
        let samples = if taps.iter().any(|tap| tap.inverted) { samples.inverted() } else { samples };
        running.decoder.samples(samples, out)
    }

    /// Nothing else has changed until `time`. To be called after each piece: what was held back to see what it is, is
    /// judged here.
    pub fn reach(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        if self.is_due() {
            self.judge(false, false, out)?;
        }
        self.reach_lines(time, out)
    }

    /// Nothing comes for a while: what is certain so far is decoded and shown.
    pub fn pause(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        self.early(out)?;
        self.reach_lines(time, out)?;
        out.flush()
    }

    fn reach_lines(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        for (line, running) in self.lines.iter_mut().enumerate() {
            out.lane(line);
            running.decoder.reach(time, out)?;
        }
        Ok(())
    }

    /// A hole in the recording before the next changes.
    pub fn hole(&mut self, hole: Hole, out: &mut Output<'_>) -> io::Result<()> {
        if let Some(held) = &self.held {
            self.holes.push((held.len(), hole));
        }
        for (line, running) in self.lines.iter_mut().enumerate() {
            out.lane(line);
            running.decoder.hole(hole, out)?;
            running.wires.forget();
        }
        Ok(())
    }

    /// The recording ends at `time`. Lines of which nothing was found, or that were upside down, are a fault.
    pub fn finish(mut self, time: Time, out: &mut Output<'_>) -> Result<(), Stop> {
        self.end(time, out)?;
        Ok(self.verdict(out)?)
    }

    pub(super) fn end(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        self.judge(true, false, out)?;
        for (line, running) in self.lines.iter_mut().enumerate() {
            out.lane(line);
            running.decoder.finish(time, out)?;
        }
        Ok(())
    }

    /// What there is to say against the recording as a whole.
    pub(super) fn verdict(&self, out: &Output<'_>) -> Result<(), Fault> {
        if self.found.is_empty() {
            let busiest = self.busiest.as_ref().map(|(channel, edges)| (*channel, edges.as_slice()));
            let what = nothing(busiest, &self.moves, &self.names, self.protocol, self.only.as_deref());
            return Err(Fault::new(&self.file, At::File, what));
        }
        // A line that was found upside down is decoded, but it is not good: somebody has to look at the wires. Where
        // hardly anything could be decoded, the polarity was only a guess and says nothing.
        let inverted = self.found.iter().any(Found::is_inverted);
        if !inverted || self.candidates.inverted.is_some() || out.tally.ok <= out.tally.faults() {
            return Ok(());
        }
        let what = "the line is inverted: exchange A and B, or say that it is meant so with --polarity inverted";
        Err(Fault::new(&self.file, At::File, what))
    }

    /// What was held back may already do: judges it if it is twice as much as the last time, and goes on holding it back
    /// if no line is certain.
    fn early(&mut self, out: &mut Output<'_>) -> io::Result<()> {
        let held = self.held.as_ref().map_or(0, Vec::len);
        if held < FEWEST || held < 2 * self.tried {
            return Ok(());
        }
        self.tried = held;
        self.judge(false, true, out)
    }

    /// Judges the open channels; at the `end` also those that have hardly moved. What holds is decoded from its
    /// first edge on.
    fn judge(&mut self, end: bool, early: bool, out: &mut Output<'_>) -> io::Result<()> {
        let first = self.held.is_some();
        let (judged, many) = self.moving();
        let mut readings = Vec::new();
        for channel in &judged {
            let Some(State::Open(edges)) = self.states.get(usize::from(*channel)) else { continue };
            if self.busiest.as_ref().is_none_or(|(_, busiest)| busiest.len() < edges.len()) {
                self.busiest = Some((*channel, edges.iter().take(3000).map(|kept| kept.edge()).collect()));
            }
            if self.candidates.pair().is_none() {
                readings.extend(self.candidates.read(*channel, &edges_of(edges)));
            }
        }
        readings.extend(self.said_pair());
        let states = &self.states;
        let edges = |channel: u16| match states.get(usize::from(channel)) {
            Some(State::Open(edges)) => edges_of(edges),
            _ => Vec::new(),
        };
        let all = self.candidates.lines(readings, &judged, &edges);
        // The last chance of what is not certain, or the only one where the user says that it is a line.
        let last = !early && self.found.is_empty() && (end || self.only.is_some() && self.candidates.is_asked_for());
        let (taken, passed) = self.choose(all, last);
        if early && taken.is_empty() {
            return Ok(());
        }
        if last && many > MOST_TRIED && taken.iter().all(|found| !found.is_certain()) {
            out.note(&Note::Channels { file: self.file.clone(), moving: many, tried: MOST_TRIED });
        }
        // What sounds in a line that is decoded already is no second one.
        for found in passed {
            for tap in &found.taps {
                self.pass(tap.channel, None);
            }
        }
        for mut found in taken {
            found.whole = end && found.taps.iter().all(|tap| self.edges_of(tap.channel) <= SAMPLE);
            self.take(found, out)?;
        }
        self.let_go(&judged);
        if first { self.replay(out) } else { Ok(()) }
    }

    /// The open channels that move enough to be judged, the busiest of them where they are too many; and how many move.
    fn moving(&self) -> (Vec<u16>, usize) {
        let mut moving: Vec<(u16, usize)> = Vec::new();
        for (channel, state) in (0_u16..).zip(&self.states) {
            if let State::Open(edges) = state {
                moving.extend((edges.len() >= FEWEST).then_some((channel, edges.len())));
            }
        }
        let many = moving.len();
        if many > MOST_TRIED {
            moving.sort_by_key(|(_, edges)| std::cmp::Reverse(*edges));
            moving.truncate(MOST_TRIED);
        }
        (moving.into_iter().map(|(channel, _)| channel).collect(), many)
    }

    /// Keeps the edges of those channels no longer that are judged by enough, and of none where all together are too many.
    fn let_go(&mut self, judged: &[u16]) {
        for &channel in judged {
            if let Some(State::Open(edges)) = self.states.get(usize::from(channel)) {
                let enough = edges.len() >= ENOUGH;
                let after = edges.len() as u64 * PATIENCE;
                if enough {
                    self.pass(channel, Some(after));
                }
            }
        }
        self.due = false;
        self.kept = self.states.iter().map(|state| if let State::Open(edges) = state { edges.len() } else { 0 }).sum();
        if self.kept >= MOST_KEPT {
            for channel in 0..self.states.len() {
                self.pass(channel as u16, Some(PATIENCE));
            }
            self.kept = 0;
        }
    }

    /// The pair of channels that the user named.
    fn said_pair(&self) -> Option<Found> {
        let channels = self.candidates.pair()?;
        let edges = |channel: u16| match self.states.get(usize::from(channel)) {
            Some(State::Open(edges)) => Some(edges_of(edges)),
            _ => None,
        };
        let [requests, answers] = channels;
        self.candidates.read_pair(channels, [&edges(requests)?, &edges(answers)?])
    }

    /// Lines that are good enough; the last chance is that of the best one. Behind them the channels that only repeat
    /// what is decoded.
    fn choose(&self, all: Vec<Found>, last: bool) -> (Vec<Found>, Vec<Found>) {
        let bit = |found: &Found| 1_000_000_000_000 / i64::from(found.speech.rate.max(1));
        let again = |found: &Found| {
            self.found.iter().any(|known| {
                known.speech.protocol == found.speech.protocol
                    && found.evidence.is_part_of(&known.evidence, 3 * bit(known))
            })
        };
        let (passed, fresh): (Vec<Found>, Vec<Found>) = all.into_iter().partition(again);
        let mut taken: Vec<Found> = fresh.iter().filter(|found| found.is_certain()).cloned().collect();
        if taken.is_empty() && last {
            let sure = self.candidates.is_asked_for();
            taken.extend(fresh.into_iter().next().filter(|best| best.evidence.score >= LEAST || sure));
        }
        // The user named one channel: whatever it is, it is one line.
        if self.only.is_some() {
            taken.truncate(1);
        }
        (taken, passed)
    }

    /// Edges that are kept of a channel.
    fn edges_of(&self, channel: u16) -> usize {
        self.states
            .get(usize::from(channel))
            .map_or(0, |state| if let State::Open(edges) = state { edges.len() } else { 0 })
    }

    fn pass(&mut self, channel: u16, until: Option<u64>) {
        if let Some(state) = self.states.get_mut(usize::from(channel)) {
            if matches!(state, State::Open(_)) {
                *state = State::Passed(until);
            }
        }
    }

    fn names(&self, taps: &[Tap]) -> Vec<String> {
        taps.iter().map(|tap| self.names.get(usize::from(tap.channel)).cloned().unwrap_or_default()).collect()
    }

    /// Decodes a line from now on, and what was kept of its channels.
    fn take(&mut self, found: Found, out: &mut Output<'_>) -> io::Result<()> {
        let Speech { protocol, rate } = found.speech;
        let Some(decoder) = protocol.line(rate, &self.candidates.settings) else { return Ok(()) };
        let index = self.lines.len();
        let names = self.names(&found.taps);
        let lane = Lane {
            channel: names.join(" + "),
            channels: found.taps.iter().map(|tap| tap.channel).collect(),
            protocol,
            rate,
        };
        out.note(&Note::Line { file: self.file.clone(), line: found.recognition(names) });
        if let Some(other) = self.rather(&found) {
            out.note(&Note::LineRather { file: self.file.clone(), line: other.recognition(self.names(&other.taps)) });
        }
        out.begin_lane(lane);
        self.lines.push(Running { wires: Wires::new(&found.taps), decoder });
        let mut edges = Vec::new();
        for tap in &found.taps {
            if let Some(state) = self.states.get_mut(usize::from(tap.channel)) {
                if let State::Open(kept) = std::mem::replace(state, State::Taken(index)) {
                    edges.extend(kept.into_iter().map(Kept::edge).map(|(time, level)| Change {
                        time,
                        channel: tap.channel,
                        level,
                    }));
                }
            }
        }
        self.found.push(found);
        if self.held.is_none() {
            edges.sort_by_key(|change| change.time);
            for change in edges {
                self.give(index, change, out)?;
            }
        }
        Ok(())
    }

    /// What a line is rather than what the user said it is.
    fn rather(&self, found: &Found) -> Option<Found> {
        let [tap] = *found.taps.as_slice() else { return None };
        let Some(State::Open(edges)) = self.states.get(usize::from(tap.channel)) else { return None };
        if found.is_certain() || !self.candidates.is_asked_for() {
            return None;
        }
        let settings = Settings { line: Options::default(), ..self.candidates.settings.clone() };
        let other = Candidates::new(None, settings, None).read(tap.channel, &edges_of(edges))?;
        (other.is_certain() && other.evidence.score > 2 * found.evidence.score).then_some(other)
    }

    fn give(&mut self, line: usize, change: Change, out: &mut Output<'_>) -> io::Result<()> {
        let Some(running) = self.lines.get_mut(line) else { return Ok(()) };
        if let Some(level) = running.wires.change(change.channel, change.level) {
            out.lane(line);
            running.decoder.change(change.time, level, out)?;
        }
        Ok(())
    }

    /// Decodes what was held back for the first survey.
    fn replay(&mut self, out: &mut Output<'_>) -> io::Result<()> {
        let Some(held) = self.held.take() else { return Ok(()) };
        out.channels(&self.names)?;
        let mut holes = std::mem::take(&mut self.holes).into_iter().peekable();
        for (at, change) in held.into_iter().enumerate() {
            while let Some((_, hole)) = holes.next_if(|(before, _)| *before <= at) {
                self.hole(hole, out)?;
            }
            if out.wants_changes() {
                out.change(&change)?;
            }
            if let Some(State::Taken(line)) = self.states.get(usize::from(change.channel)) {
                self.give(*line, change, out)?;
            }
        }
        Ok(())
    }
}

/// The channels that the user named.
fn wanted(options: &Options, names: &[String]) -> Result<Option<Vec<u16>>, String> {
    match (&options.pair, &options.channel) {
        (Some((requests, answers)), _) => Ok(Some(vec![find(requests, names)?, find(answers, names)?])),
        (None, Some(channel)) => Ok(Some(vec![find(channel, names)?])),
        (None, None) => Ok(None),
    }
}

/// A channel by its name, or by its number from 0.
fn find(name: &str, channels: &[String]) -> Result<u16, String> {
    let by_name = channels.iter().position(|c| c == name).or_else(|| {
        let last = |c: &String| c.rsplit('.').next().is_some_and(|end| end == name);
        channels.iter().position(last)
    });
    let by_number = || name.parse().ok().filter(|&n: &usize| n < channels.len());
    by_name.or_else(by_number).and_then(|index| u16::try_from(index).ok()).ok_or_else(|| {
        let shown = channels.iter().take(20).map(|c| format!("\"{c}\"")).collect::<Vec<_>>().join(", ");
        let more = if channels.len() > 20 { ", ..." } else { "" };
        format!("no channel \"{name}\"; the file has {shown}{more}")
    })
}
