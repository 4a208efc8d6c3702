//! Where events go: text, JSON Lines, a VCD beside, statistics.

pub mod filter;
pub mod json;
pub mod picture;
pub mod stats;
pub mod table;
pub mod text;
pub mod vcd;

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Write};

use crate::capture::Change;
use crate::event::{Event, NO_RESPONSE, Verdict};
use crate::protocols::Protocol;

/// Writes to the standard output at once; somebody who does not read on is no fault.
pub fn say(text: fmt::Arguments) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_fmt(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e),
        _ => Ok(()),
    }
}

/// Takes events in the order of the line.
pub trait Sink {
    /// The next event.
    fn event(&mut self, event: &Event) -> io::Result<()>;
}

/// A line of a capture that is decoded.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lane {
    /// The name of its channel, or of its two.
    pub channel: String,
    /// Its channels by index.
    pub channels: Vec<u16>,
    /// What is spoken on it.
    pub protocol: Protocol,
    /// Bits a second, as the protocol has it.
    pub rate: u32,
}

/// Where events come from: the file, its lines that are decoded, and the one that speaks.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origin {
    /// The name of the file.
    pub file: String,
    /// The lines found so far.
    pub lanes: Vec<Lane>,
    /// The number of the line that speaks, from 0; a log of bytes has none.
    pub speaks: usize,
}

impl Origin {
    /// The line that speaks; none in a log of bytes.
    pub fn lane(&self) -> Option<&Lane> {
        self.lanes.get(self.speaks)
    }
}

/// A form of output that is written file by file.
pub trait Printer {
    /// A file begins.
    fn begin(&mut self, _origin: &Origin) -> io::Result<()> {
        Ok(())
    }

    /// The next event.
    fn event(&mut self, origin: &Origin, event: &Event) -> io::Result<()>;

    /// Nothing comes for a while: what is complete is shown.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// The file is at its end.
    fn end(&mut self, _origin: &Origin) -> io::Result<()> {
        Ok(())
    }
}

/// Counts frames by their verdict.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// Events that hold.
    pub ok: u64,
    /// Frames refused.
    pub refused: u64,
    /// Answers that did not come.
    pub missing: u64,
}

impl Tally {
    /// What is wrong: refused frames and missing answers.
    pub fn faults(self) -> u64 {
        self.refused + self.missing
    }
}

impl Sink for Tally {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        match event.verdict {
            _ if event.remark => {}
            Verdict::Ok => self.ok += 1,
            Verdict::Refused(_) if event.verdict.is_silence() => self.missing += 1,
            Verdict::Refused(_) => self.refused += 1,
        }
        Ok(())
    }
}

/// All outputs of one file together.
pub struct Output<'a> {
    printer: &'a mut dyn Printer,
    vcd: Option<&'a mut vcd::VcdOut>,
    picture: Option<&'a mut picture::Picture>,
    filter: Option<&'a mut filter::Filter>,
    /// Called after every block that was read.
    progress: &'a dyn Fn(),
    /// Takes what the user should know but did not ask for.
    notes: &'a dyn Fn(&str),
    /// Frames so far.
    pub tally: Tally,
    /// Those of them that were asked for.
    pub chosen: Tally,
    /// Refused frames by class, with the first cause that was given.
    refused: BTreeMap<&'static str, (u64, Option<String>)>,
    origin: Origin,
}

impl<'a> Output<'a> {
    /// `printer` gets all events of the file called `file`.
    pub fn new(file: &str, printer: &'a mut dyn Printer, progress: &'a dyn Fn(), notes: &'a dyn Fn(&str)) -> Self {
        Self {
            printer,
            vcd: None,
            picture: None,
            filter: None,
            progress,
            notes,
            tally: Tally::default(),
            chosen: Tally::default(),
            refused: BTreeMap::new(),
            origin: Origin { file: file.to_owned(), ..Origin::default() },
        }
    }

    /// Writes events and changes beside each other.
    #[must_use]
    pub fn with_vcd(self, vcd: Option<&'a mut vcd::VcdOut>) -> Self {
        Self { vcd, ..self }
    }

    /// Draws the events too.
    #[must_use]
    pub fn with_picture(self, picture: Option<&'a mut picture::Picture>) -> Self {
        Self { picture, ..self }
    }

    /// Only what passes is shown.
    #[must_use]
    pub fn with_filter(self, filter: &'a mut filter::Filter) -> Self {
        Self { filter: Some(filter), ..self }
    }

    /// Whether the changes of the line have a taker.
    pub fn wants_changes(&self) -> bool {
        self.vcd.is_some()
    }

    /// The file begins.
    pub fn begin(&mut self) -> io::Result<()> {
        self.printer.begin(&self.origin)
    }

    /// The file is at its end.
    pub fn end(&mut self) -> io::Result<()> {
        self.printer.end(&self.origin)?;
        self.vcd.as_mut().map_or(Ok(()), |vcd| vcd.finish())
    }

    /// The channels of the capture. The lines found so far are decoded.
    pub fn channels(&mut self, channels: &[String]) -> io::Result<()> {
        self.vcd.as_mut().map_or(Ok(()), |vcd| vcd.channels(channels, &self.origin.lanes))
    }

    /// A further line is decoded; it has the next number, from 0.
    pub fn begin_lane(&mut self, lane: Lane) {
        self.origin.lanes.push(lane);
    }

    /// The events that follow are of this line.
    pub fn lane(&mut self, lane: usize) {
        self.origin.speaks = lane;
    }

    /// A change of any channel.
    pub fn change(&mut self, change: &Change) -> io::Result<()> {
        self.vcd.as_mut().map_or(Ok(()), |vcd| vcd.change(change))
    }

    /// A block was read.
    pub fn tick(&self) {
        (self.progress)();
    }

    /// The refused frames and the missing answers in a sentence; none where all hold.
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

    /// Whether nothing that was asked for can come any more once a recording was read up to `time`.
    pub fn is_over(&self, time: i64) -> bool {
        self.filter.as_ref().is_some_and(|filter| filter.is_over(time))
    }

    /// Nothing comes for a while: what is complete is shown.
    pub fn flush(&mut self) -> io::Result<()> {
        self.printer.flush()
    }

    /// Something the user should know.
    pub fn note(&self, text: &str) {
        (self.notes)(text);
    }
}

impl Sink for Output<'_> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        self.tally.event(event)?;
        let mut errors = false;
        if let Some(filter) = &mut self.filter {
            if !filter.takes(self.origin.speaks, event) {
                return Ok(());
            }
            errors = filter.errors;
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
        if let Some(vcd) = &mut self.vcd {
            vcd.event(self.origin.speaks, event);
        }
        if let Some(picture) = &mut self.picture {
            picture.event(&self.origin, event);
        }
        self.printer.event(&self.origin, event)
    }
}
