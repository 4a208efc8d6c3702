//! A start-stop protocol on a line: fields from edges, frames from fields, and a second attempt if a frame fails.

use std::io;

use super::again::{Failed, MOST_AGAIN};
use super::blame::blame;
use super::evidence::{CERTAIN, Evidence, Weights};
use super::floating::Floating;
use super::lane::LineDecoder;
use super::receive::{EdgeReceiver, Rates};
use super::start_stop::StartStop;
use super::trial::is_failed;
use crate::capture::Hole;
use crate::capture::samples::Samples;
use crate::event::{Direction, Event, Place, Verdict};
use crate::sink::Sink;
use crate::time::Time;

/// Decodes a start-stop protocol.
pub(crate) struct StartStopLine<P> {
    receiver: EdgeReceiver,
    protocol: P,
    weights: Weights,
    bit: i64,
    /// The level at the beginning was given.
    begun: bool,
    /// The first changes, until it is known where the first field begins.
    opening: Vec<(Time, bool)>,
    /// Number of changes with which the opening was tried without success.
    tried: usize,
    /// The reader for a line without bias.
    floating: Option<Floating>,
    told: Told<P>,
    /// Whether failed frames are left as they are.
    once: bool,
    /// Buffer for the numbers of samples.
    room: Vec<u64>,
}

/// The edges since the line was last idle.
struct Told<P> {
    /// The state of the protocol at that time.
    before: P,
    /// Where the frames begin that were passed on.
    passed: Vec<Time>,
    /// Events from the first one onwards that failed or is in doubt.
    failed: Vec<Event>,
    /// Remaining second attempts, as long as none helps. Each sound exchange earns one.
    luck: u32,
    /// Failures since the last one that got a second attempt.
    untried: u32,
    dips: u64,
    dip_bits: f64,
}

/// Number of second attempts that may still fail to help.
const LUCK: u32 = 24;
/// If none are left, one failure in this many gets a second attempt, because the line may have changed.
const NOW_AND_THEN: u32 = 16;
/// Maximum number of changes used to find the first field.
const OPENING: usize = 256;
/// Bits of idle line after which the opening has ended.
const OPENED: i64 = 60;
/// Falling edges that may be the first start bit.
const STARTS: u32 = 18;

impl<P> Told<P> {
    fn new(before: P, luck: u32) -> Self {
        Self { before, passed: Vec::new(), failed: Vec::new(), luck, untried: 0, dips: 0, dip_bits: 0.0 }
    }
}

/// Returns whether an event is held back until the line rests. If a later frame fails, an answer that seems to be missing
/// may have come after all, and an answer that seems to have no request may be its request together with part of itself.
fn is_doubtful(event: &Event) -> bool {
    let alone = event.direction == Some(Direction::Answer) && event.delay.is_none() && event.verdict.is_ok();
    alone || event.verdict.is_silence()
}

/// Passes events on up to the first that failed or is in doubt.
struct Watch<'a> {
    out: &'a mut dyn Sink,
    passed: &'a mut Vec<Time>,
    failed: &'a mut Vec<Event>,
}

impl Sink for Watch<'_> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        if !self.failed.is_empty() || is_failed(event) || is_doubtful(event) {
            self.failed.push(event.clone());
            return Ok(());
        }
        if let Place::Time { start, .. } = event.place {
            self.passed.push(start);
        }
        self.out.event(event)
    }
}

/// Handles the end of a recording, where the last level is assumed to last. A frame that is not good under this assumption
/// was cut off.
struct Held<'a> {
    out: &'a mut dyn Sink,
    end: Time,
    /// The verdict on such a frame.
    cut: &'a Verdict,
}

impl Sink for Held<'_> {
    fn event(&mut self, event: &Event) -> io::Result<()> {
        let lasts = event.place.end().is_some_and(|end| end > self.end);
        let refused = !event.verdict.is_ok() && !event.verdict.is_silence();
        if event.verdict == Verdict::cut_off() || lasts && refused {
            return self.out.event(&Event { fields: Vec::new(), verdict: self.cut.clone(), ..event.clone() });
        }
        self.out.event(event)
    }
}

impl<P: StartStop + Clone> StartStopLine<P> {
    /// `bit`: nominal length in picoseconds; `weights`: how much sound frames of the protocol prove.
    pub(crate) fn new(bit: f64, protocol: P, weights: Weights) -> Self {
        let receiver = EdgeReceiver::new(bit, P::CONTENT_BITS);
        Self::with(receiver, protocol, weights, bit as i64, LUCK)
    }

    fn with(receiver: EdgeReceiver, protocol: P, weights: Weights, bit: i64, luck: u32) -> Self {
        let told = Told::new(protocol.clone(), luck);
        let (opening, room) = (Vec::new(), Vec::new());
        Self {
            receiver,
            protocol,
            weights,
            bit,
            begun: false,
            opening,
            tried: 0,
            floating: None,
            told,
            once: false,
            room,
        }
    }

    /// Passes the complete fields to the protocol.
    fn give(&mut self, out: &mut dyn Sink) -> io::Result<()> {
        let Told { passed, failed, .. } = &mut self.told;
        let mut watch = Watch { out, passed, failed };
        for field in self.receiver.fields() {
            self.protocol.field(field, &mut watch)?;
        }
        self.receiver.take();
        if self.receiver.is_between() { self.settle(self.receiver.begun(), out) } else { Ok(()) }
    }

    /// The line is idle until `now`: failed frames are tried again; then all events are passed on.
    fn settle(&mut self, now: Option<Time>, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(now) = now {
            let Told { passed, failed, .. } = &mut self.told;
            self.protocol.rest(now, &mut Watch { out, passed, failed })?;
        }
        let far = self.receiver.past().len() > MOST_AGAIN;
        if !self.protocol.is_between() && !far {
            return Ok(());
        }
        if !self.told.failed.is_empty() {
            self.again(now, far, out)?;
        } else if self.told.passed.is_empty() && !far {
            return Ok(());
        } else if self.told.luck < LUCK {
            self.told.luck += 1;
        }
        self.receiver.forget();
        self.told.passed.clear();
        self.told.before.clone_from(&self.protocol);
        Ok(())
    }

    #[cold]
    fn again(&mut self, now: Option<Time>, far: bool, out: &mut dyn Sink) -> io::Result<()> {
        let mut failed = std::mem::take(&mut self.told.failed);
        if !failed.iter().any(is_failed) {
            return failed.iter().try_for_each(|event| out.event(event));
        }
        if self.once {
            self.receiver.unlearn();
            return failed.iter().try_for_each(|event| out.event(event));
        }
        let edges = self.receiver.past();
        let now = now.or(edges.last().map(|last| last.time)).unwrap_or_default();
        let bit = self.receiver.bit_heard();
        let Told { before, passed, luck, untried, .. } = &self.told;
        let trial = Failed { receiver: &self.receiver, before, weights: self.weights, edges, passed, now, bit };
        let tried = !far && (*luck > 0 || *untried + 1 >= NOW_AND_THEN);
        let better = if tried { trial.again() } else { None };
        self.told.untried = if tried { 0 } else { untried.saturating_add(1) };
        let Some(better) = better else {
            self.told.luck = self.told.luck.saturating_sub(1);
            blame(&mut failed, &self.receiver);
            self.receiver.unlearn();
            return failed.iter().try_for_each(|event| out.event(event));
        };
        self.told.luck = LUCK;
        self.told.dips += better.dips;
        self.told.dip_bits += better.dip_bits;
        self.receiver.learn(&better.receiver);
        self.protocol = better.protocol;
        better.events.iter().try_for_each(|event| out.event(event))
    }

    fn take(&mut self, time: Time, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        if let Some(floating) = &mut self.floating {
            let edges = floating.change(time, level);
            return self.float(edges, out);
        }
        if self.receiver.change(time, level) { self.give(out) } else { Ok(()) }
    }

    /// Takes the next edges of a line without bias.
    fn float(&mut self, edges: [Option<super::spikes::Edge>; 2], out: &mut dyn Sink) -> io::Result<()> {
        for edge in edges.into_iter().flatten() {
            self.float_until(edge.time, out)?;
            if let Some(floating) = &mut self.floating {
                floating.push(edge);
            }
        }
        Ok(())
    }

    /// Reads the edges before `time` on a line without bias, if the frame has ended by then.
    fn float_until(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        let Some(floating) = self.floating.as_mut().filter(|floating| floating.is_over(time)) else { return Ok(()) };
        floating.read(&mut self.receiver, &mut self.protocol, self.weights, out)
    }

    /// Ends the reading at `time`, after which nothing is known; `cut`: the verdict on an unfinished frame.
    fn end(&mut self, time: Time, cut: &Verdict, out: &mut dyn Sink) -> io::Result<()> {
        if !self.opening.is_empty() {
            self.open(true, out)?;
        }
        let mut out = Held { out, end: time + self.bit, cut };
        if let Some(floating) = &mut self.floating {
            let edges = floating.reach(time + 2 * self.bit);
            self.float(edges, &mut out)?;
            if let Some(floating) = &mut self.floating {
                floating.read(&mut self.receiver, &mut self.protocol, self.weights, &mut out)?;
            }
        }
        if self.receiver.finish(time) {
            self.give(&mut out)?;
        }
        self.settle(Some(time), &mut out)?;
        if !self.told.failed.is_empty() {
            self.again(Some(time), false, &mut out)?;
        }
        self.protocol.finish(time, &mut out)
    }

    /// Returns whether the line is busy when the recording begins, so that the first falling edge need not be a start bit.
    fn begins_inside(&self) -> bool {
        match self.opening.as_slice() {
            [(begin, true), (fall, _), ..] => *fall - *begin < i64::from(P::CONTENT_BITS + 3) * self.bit,
            _ => true,
        }
    }

    /// Tries a line on the opening.
    fn trial(&self, mut line: Self, evidence: &mut Evidence) -> io::Result<()> {
        for (time, level) in &self.opening {
            line.take(*time, *level, evidence)?;
        }
        let end = self.opening.last().map_or(Time::ZERO, |(time, _)| *time) + OPENED * self.bit;
        line.finish(end, evidence)
    }

    /// Creates a line at its beginning.
    fn fresh(&self, skipped: u32, luck: u32) -> Self {
        let receiver = EdgeReceiver::new(self.bit as f64, P::CONTENT_BITS).beginning_at(skipped);
        Self { once: self.once, ..Self::with(receiver, self.protocol.clone(), self.weights, self.bit, luck) }
    }

    /// Returns whether the line is low rather than high when idle.
    fn rests_low(&self) -> bool {
        let (mut high, mut low) = (0_i64, 0_i64);
        for pair in self.opening.windows(2) {
            let [(from, level), (to, _)] = pair else { continue };
            if *to - *from > i64::from(P::CONTENT_BITS + 4) * self.bit {
                let sum = if *level { &mut high } else { &mut low };
                *sum = sum.saturating_add(*to - *from);
            }
        }
        let ends_low = self.opening.last().is_some_and(|(_, level)| !level);
        low > high || high == 0 && ends_low
    }

    /// Ends the opening: finds the start bit from which most of it is good, and takes it. If the line idles low and hardly
    /// any frame is good, waits for more, unless it is the `last` chance.
    fn open(&mut self, last: bool, out: &mut dyn Sink) -> io::Result<()> {
        let whole = 2 * i64::from(P::CONTENT_BITS + 2) * self.bit;
        let falls = |(_, level): &&(Time, bool)| !level;
        let first = self.opening.iter().skip(1).find(falls).map_or(Time::ZERO, |(time, _)| *time);
        let starts = self.opening.iter().skip(1).filter(falls).filter(|(time, _)| *time - first < whole).count() as u32;
        let (mut best, mut most) = (0, i64::MIN);
        for skipped in 0..starts.min(STARTS) {
            let mut evidence = Evidence::new(self.weights);
            self.trial(self.fresh(skipped, 1), &mut evidence)?;
            if evidence.score > most {
                (best, most) = (skipped, evidence.score);
            }
            if skipped == 0 && evidence.score >= CERTAIN && evidence.tally.faults() == 0 {
                break;
            }
        }
        let mut floats = false;
        // Without a bias the requests are good too if their drivers are on before the start bits.
        if self.rests_low() {
            let mut evidence = Evidence::new(self.weights);
            let floating = Some(Floating::new(self.bit as f64));
            self.trial(Self { floating, ..self.fresh(0, 0) }, &mut evidence)?;
            floats = evidence.score > most && evidence.answers > 0;
            if !floats && !last && self.opening.len() < OPENING {
                self.tried = self.opening.len();
                return Ok(());
            }
        }
        self.receiver = self.fresh(best, 0).receiver;
        self.floating = floats.then(|| Floating::new(self.bit as f64));
        for (time, level) in std::mem::take(&mut self.opening) {
            self.take(time, level, out)?;
        }
        Ok(())
    }
}

impl<P: StartStop + Clone> LineDecoder for StartStopLine<P> {
    fn change(&mut self, time: Time, level: bool, out: &mut dyn Sink) -> io::Result<()> {
        if !self.begun {
            self.begun = true;
            self.protocol.begin(time);
            self.told.before.clone_from(&self.protocol);
            self.opening.push((time, level));
            return Ok(());
        }
        let Some((last, _)) = self.opening.last() else { return self.take(time, level, out) };
        let pause = self.opening.len() > 1.max(2 * self.tried) && time - *last > OPENED * self.bit;
        if pause || self.opening.len() >= OPENING {
            self.open(false, out)?;
        }
        if self.opening.is_empty() {
            return self.take(time, level, out);
        }
        self.opening.push((time, level));
        if self.begins_inside() {
            return Ok(());
        }
        for (time, level) in std::mem::take(&mut self.opening) {
            self.take(time, level, out)?;
        }
        Ok(())
    }

    fn samples(&mut self, samples: Samples<'_>, out: &mut dyn Sink) -> io::Result<()> {
        let mut room = std::mem::take(&mut self.room);
        for piece in samples.pieces() {
            let [least, most] = self.receiver.runs();
            let mut turns = piece.turns(&mut room, least, most);
            while !self.begun || !self.opening.is_empty() || self.floating.is_some() {
                let Some((time, level)) = turns.next() else { break };
                self.change(time, level, out)?;
            }
            // This state stays, so only the receiver takes changes.
            while self.receiver.turns(&mut turns) {
                self.give(out)?;
            }
        }
        self.room = room;
        Ok(())
    }

    fn reach(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        if let [_, .., (last, _)] = self.opening.as_slice() {
            if time - *last <= OPENED * self.bit || self.opening.len() <= 2 * self.tried {
                return Ok(());
            }
            self.open(false, out)?;
        }
        if !self.opening.is_empty() {
            return Ok(());
        }
        if let Some(floating) = &mut self.floating {
            let edges = floating.reach(time);
            self.float(edges, out)?;
            return self.float_until(time, out);
        }
        if self.receiver.reach(time) {
            self.give(out)?;
        }
        let rests = self.receiver.begun().is_none();
        if rests && !self.told.failed.is_empty() { self.settle(Some(time), out) } else { Ok(()) }
    }

    fn hole(&mut self, hole: Hole, out: &mut dyn Sink) -> io::Result<()> {
        self.end(hole.from, &Verdict::in_a_hole(), out)?;
        let floating = self.floating.as_ref().map(|_| Floating::new(self.bit as f64));
        self.receiver = self.receiver.emptied();
        (self.floating, self.begun) = (floating, false);
        Ok(())
    }

    fn finish(&mut self, time: Time, out: &mut dyn Sink) -> io::Result<()> {
        self.end(time, &Verdict::cut_off(), out)
    }

    fn look_once(&mut self) {
        self.once = true;
    }

    fn rates(&self) -> Rates {
        let mut rates = self.receiver.rates();
        (rates.dips, rates.dip_bits) = (self.told.dips, self.told.dip_bits);
        rates.floats_low = self.floating.is_some();
        rates
    }
}
