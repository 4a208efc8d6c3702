//! Outputs for events: text, JSON Lines, CSV, a VCD, statistics.

pub mod filter;
pub mod json;
pub mod printer;
pub mod stats;
pub mod table;
pub mod text;
pub mod vcd;

use std::collections::BTreeMap;
use std::io;

use printer::{Lane, Origin, Printer};

use crate::capture::Change;
use crate::event::{Event, NO_RESPONSE, Verdict};
use crate::recognition::Note;
use crate::sink::{Sink, Tally};
use crate::time::Time;

/// All outputs of one file together.
pub struct Output<'a> {
    /// Every printer gets all events, the first printer first.
    printers: Vec<&'a mut dyn Printer>,
    filter: Option<&'a mut filter::Filter>,
    /// Called after every block read.
    progress: Option<&'a dyn Fn()>,
    /// Receives what the user should know but did not ask for.
    notes: Option<&'a dyn Fn(&Note)>,
    /// Returns whether the user has seen enough.
    enough: Option<&'a dyn Fn() -> bool>,
    /// Reading ends this many picoseconds after the first refused frame.
    until_error: Option<i64>,
    /// The time at which reading ends.
    last: Option<Time>,
    done: bool,
    /// Frames so far.
    pub tally: Tally,
    /// Frames that were requested.
    pub chosen: Tally,
    /// Refused frames by class, with the first cause that was given.
    refused: BTreeMap<&'static str, (u64, Option<String>)>,
    origin: Origin,
}

impl<'a> Output<'a> {
    /// Creates an output in which `printer` gets all events of the file called `file`.
    pub fn new(file: &str, printer: &'a mut dyn Printer) -> Self {
        Self {
            printers: vec![printer],
            filter: None,
            progress: None,
            notes: None,
            enough: None,
            until_error: None,
            last: None,
            done: false,
            tally: Tally::default(),
            chosen: Tally::default(),
            refused: BTreeMap::new(),
            origin: Origin { file: file.to_owned(), ..Origin::default() },
        }
    }

    /// Adds a second printer that gets the events too, if there is one.
    #[must_use]
    pub fn with_beside(mut self, printer: Option<&'a mut dyn Printer>) -> Self {
        self.printers.extend(printer);
        self
    }

    /// Stops reading and showing as soon as `enough` says so.
    #[must_use]
    pub fn with_enough(self, enough: &'a dyn Fn() -> bool) -> Self {
        Self { enough: Some(enough), ..self }
    }

    /// Stops this many picoseconds after the first refused frame that is shown; 0: at that frame.
    #[must_use]
    pub fn until_error(self, after: i64) -> Self {
        Self { until_error: Some(after.max(0)), ..self }
    }

    /// Calls `progress` after every block read.
    #[must_use]
    pub fn with_progress(self, progress: &'a dyn Fn()) -> Self {
        Self { progress: Some(progress), ..self }
    }

    /// Takes notes: what the user should know but did not ask for.
    #[must_use]
    pub fn with_notes(self, notes: &'a dyn Fn(&Note)) -> Self {
        Self { notes: Some(notes), ..self }
    }

    /// Shows only frames that pass the filter.
    #[must_use]
    pub fn with_filter(self, filter: &'a mut filter::Filter) -> Self {
        Self { filter: Some(filter), ..self }
    }

    /// Returns whether any printer takes the changes of the line.
    pub fn wants_changes(&self) -> bool {
        self.printers.iter().any(|printer| printer.wants_changes())
    }

    /// Begins the file.
    pub fn begin(&mut self) -> io::Result<()> {
        let Self { printers, origin, .. } = self;
        printers.iter_mut().try_for_each(|printer| printer.begin(origin))
    }

    /// Ends the file.
    pub fn end(&mut self) -> io::Result<()> {
        let Self { printers, origin, .. } = self;
        printers.iter_mut().try_for_each(|printer| printer.end(origin))
    }

    /// Passes on the channels of the capture. The lines found so far are decoded.
    pub fn channels(&mut self, channels: &[String]) -> io::Result<()> {
        let Self { printers, origin, .. } = self;
        printers.iter_mut().try_for_each(|printer| printer.channels(origin, channels))
    }

    /// Adds a decoded line; it has the next number, from 0.
    pub(crate) fn begin_lane(&mut self, lane: Lane) {
        self.origin.lanes.push(lane);
    }

    /// Sets the line of the events that follow.
    pub fn lane(&mut self, lane: usize) {
        self.origin.speaks = lane;
    }

    /// Passes on a change of any channel.
    pub fn change(&mut self, change: &Change) -> io::Result<()> {
        self.printers.iter_mut().try_for_each(|printer| printer.change(change))
    }

    /// Reports that a block was read.
    pub fn tick(&self) {
        if let Some(progress) = self.progress {
            progress();
        }
    }

    /// Returns the refused frames and the missing answers in a sentence; `None` if all are good.
    pub fn refusals(&self) -> Option<String> {
        let Tally { ok, refused, missing } = self.chosen;
        let said = |cause: &Option<String>| cause.as_ref().map_or(String::new(), |cause| format!(" ({cause})"));
        let one = |(class, (count, cause)): (&&str, &(u64, Option<String>))| format!("{class} {count}{}", said(cause));
        let classes = self.refused.iter().filter(|(class, _)| **class != NO_RESPONSE).map(one).collect::<Vec<_>>();
        let frames = format!("{refused} of {} frames refused: {}", ok + refused, classes.join("; "));
        let cause = self.refused.get(NO_RESPONSE).map_or(String::new(), |(_, cause)| said(cause));
        let requests = if missing == 1 { "request" } else { "requests" };
        let silence = format!("{missing} {requests} without an answer: {NO_RESPONSE}{cause}");
        let both = [(refused > 0).then_some(frames), (missing > 0).then_some(silence)];
        let both = both.into_iter().flatten().collect::<Vec<_>>().join("; ");
        (!both.is_empty()).then_some(both)
    }

    /// The first instant of interest.
    pub(crate) fn from(&self) -> Option<Time> {
        self.filter.as_ref().and_then(|filter| filter.from())
    }

    /// Returns whether nothing that was requested can follow once a recording was read up to `time`.
    pub fn is_over(&self, time: Time) -> bool {
        self.is_done()
            || self.last.is_some_and(|last| time >= last)
            || self.filter.as_ref().is_some_and(|filter| filter.is_over(time))
    }

    /// Returns whether the user has seen enough: everything that follows is dropped.
    pub fn is_done(&self) -> bool {
        self.done || self.enough.is_some_and(|enough| enough())
    }

    /// Reports that nothing arrives for a while: whatever is complete is shown.
    pub fn flush(&mut self) -> io::Result<()> {
        self.printers.iter_mut().try_for_each(|printer| printer.flush())
    }

    /// Passes on something that the user should know.
    pub fn note(&self, note: &Note) {
        if let Some(notes) = self.notes {
            notes(note);
        }
    }
}

impl Sink for Output<'_> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        // What begins before the end and is not over by then is cut off by nobody but the user.
        self.done |= self.last.is_some_and(|last| event.place.end().is_none_or(|end| end >= last));
        if self.is_done() {
            return Ok(());
        }
        self.tally.event(event)?;
        let mut errors = false;
        if let Some(filter) = &mut self.filter {
            if !filter.takes(&self.origin, event) {
                return Ok(());
            }
            errors = filter.wants_errors_only();
        }
        self.chosen.event(event)?;
        if errors && event.verdict.is_ok() {
            return Ok(());
        }
        if let Verdict::Refused(refusal) = &event.verdict {
            let (count, cause) = self.refused.entry(refusal.class).or_default();
            *count += 1;
            if cause.is_none() {
                cause.clone_from(&refusal.cause);
            }
        }
        if let Some(after) = self.until_error.filter(|_| !event.verdict.is_ok() && self.last.is_none()) {
            self.last = event.place.end().filter(|_| after > 0).map(|end| end + after);
            self.done = self.last.is_none();
        }
        let Self { printers, origin, .. } = self;
        printers.iter_mut().try_for_each(|printer| printer.event(origin, event))
    }
}
