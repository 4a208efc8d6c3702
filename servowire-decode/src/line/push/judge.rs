//! Judges the undecided channels: surveys their first edges and decides what becomes of each.

use std::io;

use super::{ENOUGH, Found, Kept, MOST_KEPT, PushDecoder, Running, State, edges_of};
use crate::capture::Change;
use crate::line::lane::{Tap, Wires};
use crate::line::survey::{Candidates, FEWEST, SAMPLE, Speech};
use crate::output::Output;
use crate::output::printer::Lane;
use crate::recognition::Note;
use crate::settings::{Options, Settings};

/// Changes examined before decoding begins.
const PREVIEW: usize = 1 << 16;
/// The same of a single channel.
const PREVIEW_OF_ONE: usize = 1 << 12;
/// Score that a line needs at its last chance: a request whose answer came.
const LEAST: i64 = 4;
/// Maximum number of channels tried in one survey, the busiest first.
const MOST_TRIED: usize = 4096;
/// A channel in which nothing was found is examined again after this many times the edges that it was judged by.
const PATIENCE: u64 = 8;

impl PushDecoder {
    /// Returns whether it is time for a survey.
    pub(super) fn is_due(&self) -> bool {
        match &self.held {
            // Only the first edges of each channel are examined.
            Some(held) => held.len() >= PREVIEW.min(self.names.len() * PREVIEW_OF_ONE),
            None => self.due || self.kept >= MOST_KEPT,
        }
    }

    /// Judges the changes held back if there are twice as many as last time; if no line is certain, they stay held back.
    pub(super) fn early(&mut self, out: &mut Output<'_>) -> io::Result<()> {
        let held = self.held.as_ref().map_or(0, Vec::len);
        if held < FEWEST || held < 2 * self.tried {
            return Ok(());
        }
        self.tried = held;
        self.judge(false, true, out)
    }

    /// Judges the open channels; at the `end` also those that have hardly moved. A line that is recognised is decoded from
    /// its first edge onwards.
    pub(super) fn judge(&mut self, end: bool, early: bool, out: &mut Output<'_>) -> io::Result<()> {
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
        // The last chance of an uncertain line, or the only one if the user says that it is a line.
        let last = !early && self.found.is_empty() && (end || self.only.is_some() && self.candidates.is_asked_for());
        let (taken, passed) = self.choose(all, last);
        if early && taken.is_empty() {
            return Ok(());
        }
        if last && many > MOST_TRIED && taken.iter().all(|found| !found.is_certain()) {
            out.note(&Note::Channels { file: self.file.clone(), moving: many, tried: MOST_TRIED });
        }
        // A copy of a line that is already decoded is not a second line.
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

    /// Returns the open channels with enough edges to be judged (only the busiest if there are too many), and how many
    /// channels have edges.
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

    /// Stops keeping the edges of channels that were judged by enough of them, and of all channels if there are too many
    /// edges in total.
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

    /// Returns the pair of channels that the user named.
    fn said_pair(&self) -> Option<Found> {
        let channels = self.candidates.pair()?;
        let edges = |channel: u16| match self.states.get(usize::from(channel)) {
            Some(State::Open(edges)) => Some(edges_of(edges)),
            _ => None,
        };
        let [requests, answers] = channels;
        self.candidates.read_pair(channels, [&edges(requests)?, &edges(answers)?])
    }

    /// Returns the lines that are good enough; only the best line gets the last chance. The channels that only repeat a
    /// decoded line come second.
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

    /// Returns the number of edges kept of a channel.
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

    /// Decodes a line from now on, including the edges kept of its channels.
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

    /// Returns what a line really is, if it differs from what the user said.
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
}
