//! Keeps track of all channels of a recording as it arrives: which are decoded, which carry nothing, and which have had
//! hardly any edges yet.

mod judge;

use std::io;

use super::lane::{LineDecoder, Wires};
use super::nothing::nothing;
use super::survey::{Candidates, Found};
use crate::capture::samples::Samples;
use crate::capture::{Change, Hole};
use crate::codec::Codec;
use crate::fault::{At, Fault, Stop};
use crate::output::Output;
use crate::settings::{Options, Settings};
use crate::time::Time;

/// Changes of one channel that are enough to judge it later on.
const ENOUGH: usize = 1 << 9;
/// Maximum number of changes kept of all undecided channels together.
const MOST_KEPT: usize = 1 << 20;

/// An edge of an undecided channel: its time, and the level in the lowest bit. There may be very many of these.
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

/// The state of a channel.
#[derive(Debug, Clone)]
enum State {
    /// Not judged yet.
    Open(Vec<Kept>),
    /// Part of a line that is decoded.
    Taken(usize),
    /// Nothing, or a repetition of what is decoded already; examined again after this many edges, if at all.
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
    /// The channels that the user named; all others are ignored.
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
    /// Number of changes held back when they were last judged early.
    tried: usize,
    /// Channels with enough edges to be judged.
    due: bool,
    /// For messages when nothing was found: the busiest channel's first edges.
    busiest: Option<(u16, Vec<(Time, bool)>)>,
    /// Edges by channel.
    moves: Vec<u64>,
}

impl PushDecoder {
    /// Creates a decoder for a recording called `file` with channels of these names; without `protocol`, all protocols are
    /// tried.
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

    /// Takes the next changes, in the order of time; the first of a channel is its level at the beginning.
    pub fn changes(&mut self, changes: &[Change], out: &mut Output<'_>) -> io::Result<()> {
        for change in changes {
            self.change(*change, out)?;
        }
        if let Some(held) = &mut self.held {
            held.extend_from_slice(changes);
        }
        Ok(())
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

    /// Returns whether the first survey has ended and has found something.
    pub(super) fn is_settled(&self) -> bool {
        self.held.is_none() && !self.lines.is_empty()
    }

    /// Returns the only decoded channel, if nothing else needs its changes.
    pub(super) fn takes_samples(&self, out: &Output<'_>) -> Option<u16> {
        let ([_], [Found { taps, .. }], None) = (self.lines.as_slice(), self.found.as_slice(), &self.held) else {
            return None;
        };
        if let ([tap], false) = (taps.as_slice(), out.wants_changes()) { Some(tap.channel) } else { None }
    }

    /// Takes the next samples of that channel; no other channel moves meanwhile.
    pub(super) fn samples(&mut self, samples: Samples<'_>, out: &mut Output<'_>) -> io::Result<()> {
        let ([running], [Found { taps, .. }]) = (self.lines.as_mut_slice(), self.found.as_slice()) else {
            return Ok(());
        };
        let [tap] = taps.as_slice() else { return Ok(()) };
        out.lane(0);
        let samples = if tap.inverted { samples.inverted() } else { samples };
        running.wires.keep(samples.last());
        running.decoder.samples(samples, out)
    }

    /// Reports that nothing else has changed until `time`. Call it after each piece: it judges the changes held back so far.
    pub fn reach(&mut self, time: Time, out: &mut Output<'_>) -> io::Result<()> {
        if self.is_due() {
            self.judge(false, false, out)?;
        }
        self.reach_lines(time, out)
    }

    /// Reports that nothing arrives for a while: whatever is certain so far is decoded and shown.
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

    /// Reports a gap in the recording before the next changes.
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

    /// Ends the recording at `time`. It is a fault if nothing was found on the lines, or if they were inverted.
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

    /// Returns what is wrong with the recording as a whole.
    pub(super) fn verdict(&self, out: &Output<'_>) -> Result<(), Fault> {
        if self.found.is_empty() {
            let busiest = self.busiest.as_ref().map(|(channel, edges)| (*channel, edges.as_slice()));
            let what = nothing(busiest, &self.moves, &self.names, self.protocol, self.only.as_deref());
            return Err(Fault::new(&self.file, At::File, what));
        }
        // An inverted line is decoded, but it is a fault: somebody has to check the wires. If hardly anything could be
        // decoded, the polarity was only a guess and means nothing.
        let inverted = self.found.iter().any(Found::is_inverted);
        if !inverted || self.candidates.inverted.is_some() || out.tally.ok <= out.tally.faults() {
            return Ok(());
        }
        let what = "the line is inverted: exchange A and B, or confirm it with --polarity inverted";
        Err(Fault::new(&self.file, At::File, what))
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

/// Finds the channels that the user named.
fn wanted(options: &Options, names: &[String]) -> Result<Option<Vec<u16>>, String> {
    match (&options.pair, &options.channel) {
        (Some((requests, answers)), _) => {
            let pair = vec![find(requests, names)?, find(answers, names)?];
            if pair.first() == pair.last() {
                return Err(format!("--tx and --rx are one channel: if it has both, say --channel {requests}"));
            }
            Ok(Some(pair))
        }
        (None, Some(channel)) => Ok(Some(vec![find(channel, names)?])),
        (None, None) => Ok(None),
    }
}

/// Finds a channel by its name, or by its number from 0.
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
