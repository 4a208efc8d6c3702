//! Takes the changes of the channels as they come, and returns the line around the requested events.

use std::collections::{BTreeMap, VecDeque};
use std::io;

use servowire_decode::capture::Change;
use servowire_decode::event::{Event, Place, Verdict};
use servowire_decode::output::printer::{Origin, Printer};
use servowire_decode::time::Time;

use crate::clip::Clip;

/// Changes are kept for this long, in picoseconds: an event comes after them.
const KEPT: i64 = 4_000_000_000;
/// Fewer changes than these are always kept.
const MOST: usize = 1 << 17;

/// The events around which the line is kept.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Wanted {
    /// The first frame of each class of error.
    Errors,
    /// The frame at a time, or the nearest one.
    At(Time),
}

/// The most recent changes, and the clips made from them.
pub(crate) struct Scope {
    wanted: Wanted,
    names: Vec<String>,
    recent: VecDeque<Change>,
    /// The levels before these changes.
    before: BTreeMap<u16, bool>,
    /// Keyed by the class of the error.
    clips: BTreeMap<&'static str, Clip>,
}

impl Scope {
    pub(crate) fn new(wanted: Wanted) -> Self {
        Self { wanted, names: Vec::new(), recent: VecDeque::new(), before: BTreeMap::new(), clips: BTreeMap::new() }
    }

    /// Returns the wanted clips, keyed by the class of the error.
    pub(crate) fn clips(&self) -> impl Iterator<Item = &Clip> {
        self.clips.values()
    }

    /// Returns the distance of an event from the wanted time.
    fn distance(event: &Event, at: Time) -> i64 {
        match event.place {
            Place::Time { start, end } if at < end => (start - at).max(0),
            Place::Time { end, .. } => (at - end).max(1),
            Place::Line(_) => i64::MAX,
        }
    }

    /// Returns the key under which an event is kept, if it is better than the one there.
    fn key(&self, event: &Event) -> Option<&'static str> {
        match (self.wanted, &event.verdict) {
            (Wanted::Errors, Verdict::Refused(refusal)) if !self.clips.contains_key(refusal.class) => {
                Some(refusal.class)
            }
            (Wanted::Errors, _) => None,
            (Wanted::At(at), _) => {
                let known = self.clips.get("").map(|clip| Self::distance(&clip.event, at));
                (!event.remark && known.is_none_or(|known| Self::distance(event, at) < known)).then_some("")
            }
        }
    }
}

impl Printer for Scope {
    fn channels(&mut self, _: &Origin, channels: &[String]) -> io::Result<()> {
        self.names = channels.to_vec();
        Ok(())
    }

    fn wants_changes(&self) -> bool {
        true
    }

    fn change(&mut self, change: &Change) -> io::Result<()> {
        self.clips.values_mut().for_each(|clip| clip.change(change));
        self.recent.push_back(*change);
        while self.recent.len() > MOST || self.recent.front().is_some_and(|first| change.time - first.time > KEPT) {
            if let Some(first) = self.recent.pop_front() {
                self.before.insert(first.channel, first.level);
            }
        }
        Ok(())
    }

    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()> {
        let (Some(key), Some(lane)) = (self.key(event), origin.lane()) else { return Ok(()) };
        if let Some(mut clip) = Clip::new(event, lane, &self.names) {
            let first = self.recent.partition_point(|change| change.time <= clip.from);
            let last = |channel| self.recent.range(..first).rev().find(|change| change.channel == channel);
            clip.begin(|channel| last(channel).map(|c| c.level).or(self.before.get(&channel).copied()));
            self.recent.range(first..).for_each(|change| clip.change(change));
            self.clips.insert(key, clip);
        }
        Ok(())
    }
}
