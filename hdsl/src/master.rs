//! The receiver as a machine without I/O.
//!
//! Every H-frame has two halves. [`Master::transmission`] says what to send from SYNC to PARA and whether an encoder
//! answers; [`Master::finish`] takes the samples of the answer and says how the frame ends. What it brought is in the
//! [`Report`], from which [`Registers::apply`](crate::registers::Registers::apply) makes the register map.
//!
//! A position to control with comes from [`Master::fast`], the safe one from [`Master::safe`]; both give a number only
//! when it may be used.
//!
//! ```text
//!  RESET -> SYNC -> START -> LEARN -> CHECK -> IDREQ -> WAIT VSYNC -> RX0 ... RX7
//!    2       16       9        9       16        1      until VSYNC     ^       |
//!  ^         no answer | test pattern  |                                +-------+
//!  +---- restart: pattern missing or wrong, identifier wrong, link lost, reset asked for
//! ```
//!
//! The firmware loads of the vendor's state diagram have no place here: they are particular to its processor.
//!
//! ```
//! use hdsl::device::Device;
//! use hdsl::master::{Master, State};
//! use hdsl::sampling::line;
//! use hdsl::{Dialect, EncoderId};
//!
//! let mut master = Master::new(Dialect::SICK);
//! let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
//! for frame in 0..150_u64 {
//!     let answer = encoder.answer(master.transmission().head.bits(), 7 * frame);
//!     // a cable that delays the answer by 11 eighths of a bit
//!     let samples = answer.map_or([0xff; 72], |bits| line(bits, 11));
//!     master.finish(&samples, None)?;
//! }
//! assert_eq!(master.state(), State::Running);
//! let fast = master.fast()?;
//! assert_eq!((fast.velocity, fast.position), (7, 7 * 149));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod control;
mod link;
mod report;
mod state;

pub use report::{Counters, Fast, Report, Safe, Signal};
pub use state::{Cause, State};

use crate::answer::Answer;
use crate::dialect::Dialect;
use crate::encoder_id::{EncoderId, PositionBits};
use crate::error::Error;
use crate::frame::{Extra, Head, Stuffing, Tail, Trailer};
use crate::line_code::LineDisparity;
use crate::message::{Finished, Requester};
use crate::parameter::{EncoderByte, MasterSymbol, ParameterByte};
use crate::position::Phase;
use crate::rssi::EdgeWatch;
use crate::sampling::{Alignment, TEST_PATTERN, WINDOW};
use crate::sync::Synchroniser;
use link::Link;

/// What to send from the start of an H-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmission {
    /// Zeros before the frame: 16 after a restart, no need of the protocol.
    pub lead_in: u8,
    /// SYNC to PARA.
    pub head: Head,
    /// Whether an encoder answers: then the line is released after PARA, reception begins one bit later and takes
    /// [`WINDOW`] bits. Otherwise [`FILLER`](crate::frame::FILLER) is sent.
    pub answered: bool,
}

/// The receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Master {
    dialect: Dialect,
    sync: Option<Synchroniser>,
    /// Eighths from pulse to pulse, once known.
    pulse: Option<u32>,
    state: State,
    /// Frames of the state that are done.
    done: u8,
    disparity: LineDisparity,
    present: Transmission,
    alignment: Option<Alignment>,
    /// Sample periods with edges of the test pattern, since LEARN.
    edges: u8,
    encoder: Option<EncoderId>,
    link: Link,
    requester: Requester,
    report: Report,
    counters: Counters,
    /// ACC_ERR_CNT_THRESH.
    threshold: u8,
    restart: bool,
}

impl Master {
    /// A free-running receiver at the beginning of the start-up.
    pub fn new(dialect: Dialect) -> Self {
        Self::start(dialect, None)
    }

    /// A receiver that keeps its frames on an external pulse.
    pub fn synchronised(dialect: Dialect, sync: Synchroniser) -> Self {
        Self::start(dialect, Some(sync))
    }

    fn start(dialect: Dialect, sync: Option<Synchroniser>) -> Self {
        let extra = sync.map(|sync| sync.extra());
        let (present, disparity) = transmission(State::Reset, MasterSymbol::Reset, false, extra, LineDisparity::ZERO);
        Self {
            dialect,
            sync,
            pulse: sync.map(|sync| sync.period()),
            state: State::Reset,
            done: 0,
            disparity,
            present,
            alignment: None,
            edges: 0,
            encoder: None,
            link: Link::new(&dialect, PositionBits::MAX),
            requester: Requester::new(dialect.messages),
            report: Report::START,
            counters: Counters::default(),
            threshold: 0x1f,
            restart: false,
        }
    }

    /// What to send at the beginning of the present H-frame.
    pub const fn transmission(&self) -> Transmission {
        self.present
    }

    /// Where the receiver is.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Number of the present frame in its state; in [`State::Running`] 0..=7 for RX0..RX7.
    pub const fn frame(&self) -> u8 {
        match self.state {
            State::Running => self.link.at(),
            _ => self.done,
        }
    }

    /// What the last H-frame brought.
    pub const fn report(&self) -> &Report {
        &self.report
    }

    /// What was counted.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Sampling index and delay, once learned.
    pub const fn alignment(&self) -> Option<Alignment> {
        self.alignment
    }

    /// The encoder identifier, once received.
    pub const fn encoder_id(&self) -> Option<EncoderId> {
        self.encoder
    }

    /// How far the fast position is aligned with the safe one.
    pub const fn phase(&self) -> Phase {
        self.link.phase()
    }

    /// Whether the edge of the present frame belongs to the external pulse; `false` when free running.
    pub fn is_on_pulse(&self) -> bool {
        self.sync.is_some_and(|sync| sync.is_on_pulse())
    }

    /// Takes the samples of the answer, a byte a bit time with the first sample in bit 7, and ends the H-frame.
    ///
    /// For a frame without an answer the samples are not looked at. `late` is time(pulse) - time(edge) in eighths of a
    /// bit if the frame is on a pulse, see [`Synchroniser::next`].
    ///
    /// # Errors
    /// [`Error::Truncated`] for fewer than [`WINDOW`] bytes of samples of an answer; nothing has changed then.
    pub fn finish(&mut self, samples: &[u8], late: Option<i16>) -> Result<&Report, Error> {
        if self.present.answered && samples.len() < WINDOW {
            let got = u16::try_from(samples.len()).unwrap_or(u16::MAX);
            return Err(Error::Truncated { got, want: 72 });
        }
        Ok(match (self.state, self.alignment, samples.first_chunk()) {
            (State::Start, ..) => self.learn(samples, late),
            (_, Some(alignment), Some(window)) if self.present.answered => {
                let (bits, watch) = alignment.read_window(window);
                self.end_sampled(alignment, bits, watch, late)
            }
            _ => self.end(u64::MAX, None, late),
        })
    }

    /// The same with four bytes of samples a word, the first of them in the low bits: what a DMA leaves in the memory of a
    /// little-endian processor, and fast on one that cannot load words from any address.
    ///
    /// ```
    /// use hdsl::Dialect;
    /// use hdsl::master::{Cause, Master, State};
    /// # use hdsl::Error;
    /// let mut master = Master::new(Dialect::SICK);
    /// // No encoder: after RESET and SYNC, 18 frames without an answer, the line stays high.
    /// for _ in 0..18 {
    ///     assert_eq!(master.finish_words(&[u32::MAX; 18], None).restarted, None);
    /// }
    /// assert_eq!(master.finish_words(&[u32::MAX; 18], None).restarted, Some(Cause::Learn(Error::NoEdge)));
    /// assert_eq!(master.state(), State::Reset);
    /// ```
    pub fn finish_words(&mut self, samples: &[u32; WINDOW / 4], late: Option<i16>) -> &Report {
        match (self.state, self.alignment) {
            (State::Start, _) => {
                let mut bytes = [0; WINDOW];
                for (to, from) in bytes.chunks_exact_mut(4).zip(samples) {
                    to.copy_from_slice(&from.to_le_bytes());
                }
                self.learn(&bytes, late)
            }
            (_, Some(alignment)) if self.present.answered => {
                let (bits, watch) = alignment.read_words(samples);
                self.end_sampled(alignment, bits, watch, late)
            }
            _ => self.end(u64::MAX, None, late),
        }
    }

    /// A START frame.
    fn learn(&mut self, samples: &[u8], late: Option<i16>) -> &Report {
        self.edges = 0;
        match Alignment::learn(self.dialect.edge, samples) {
            Ok(found) => {
                self.alignment = Some(found);
                self.end(TEST_PATTERN, None, late)
            }
            Err(error) => {
                self.report.begin(self.state, None);
                self.end_with(Err(Cause::Learn(error)), late)
            }
        }
    }

    #[inline]
    fn end_sampled(&mut self, alignment: Alignment, bits: u64, watch: EdgeWatch, late: Option<i16>) -> &Report {
        if matches!(self.state, State::Learn | State::Check) {
            self.edges |= watch.edges();
        }
        let signal = Signal { rssi: watch.rssi(), delay: alignment.delay, edges: self.edges };
        self.end(bits, Some(signal), late)
    }

    /// Takes the 61 bits of the answer, the first in bit 0, from a front end that finds them itself (an FPGA, a PRU), and
    /// ends the H-frame. `signal` is what that front end knows about the quality of the line; without it RSSI does not
    /// count. In START frames too the bits have to be the test pattern.
    ///
    /// For a frame without an answer the bits are not looked at.
    ///
    /// ```
    /// use hdsl::device::Device;
    /// use hdsl::master::{Master, State};
    /// use hdsl::{Dialect, EncoderId};
    ///
    /// let mut master = Master::new(Dialect::SICK);
    /// let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
    /// while master.state() != State::Running {
    ///     // A line that stays high is all ones.
    ///     let bits = encoder.answer(master.transmission().head.bits(), 1000).unwrap_or(u64::MAX);
    ///     master.finish_bits(bits, None, None);
    /// }
    /// assert_eq!(master.encoder_id().map(|id| id.position_bits()), Some(32));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn finish_bits(&mut self, bits: u64, signal: Option<Signal>, late: Option<i16>) -> &Report {
        self.end(bits, signal, late)
    }

    fn end(&mut self, bits: u64, signal: Option<Signal>, late: Option<i16>) -> &Report {
        let bits = bits & (u64::MAX >> 3);
        self.report.begin(self.state, signal);
        let outcome = self.receive(bits);
        if self.report.was != State::Running || outcome.is_err() || self.sync.is_some() || self.restart {
            return self.end_with(outcome, late);
        }
        self.go_on()
    }

    /// What [`end_with`](Self::end_with) comes to on a running link that is free running: the usual end.
    fn go_on(&mut self) -> &Report {
        self.counters.frames = self.counters.frames.wrapping_add(1);
        let symbol = if self.link.is_settled() { self.requester.transmit() } else { MasterSymbol::Idle };
        (self.present, self.disparity) =
            transmission(State::Running, symbol, self.link.msync(), None, LineDisparity::ZERO);
        self.report.restarted = None;
        self.report.state = State::Running;
        self.report.tail = Tail { trailer: Trailer::AfterAnswer, stuffing: Stuffing::MIN };
        self.report.long_free = self.requester.is_long_free();
        self.report.short_free = self.requester.is_short_free();
        &self.report
    }

    fn end_with(&mut self, mut outcome: Result<(), Cause>, late: Option<i16>) -> &Report {
        self.counters.frames = self.counters.frames.wrapping_add(1);
        if core::mem::take(&mut self.restart) {
            outcome = Err(Cause::Requested);
        }
        let restarted = outcome.err();
        let was = self.report.was;
        if restarted.is_some() {
            self.begin_again();
        }
        let next = self.sync.as_mut().map(|sync| sync.next(late));
        self.report.tail = Tail {
            trailer: trailer(was, restarted),
            stuffing: next.map_or_else(|| self.search_time(was, restarted), |next| next.stuffing),
        };
        self.prepare(was, next.map(|next| next.extra), restarted.is_some());
        self.report.restarted = restarted;
        self.report.state = self.state;
        self.report.long_free = self.state == State::Running && self.requester.is_long_free();
        self.report.short_free = self.state == State::Running && self.requester.is_short_free();
        &self.report
    }

    /// Stuffing after a START frame: time for the search.
    fn search_time(&self, was: State, restarted: Option<Cause>) -> Stuffing {
        let blocks = match (was, restarted, self.alignment) {
            (State::Start, Some(_), _) => 16,
            (State::Start, None, Some(found)) => found.delay.get().saturating_sub(1).saturating_add(4),
            _ => 0,
        };
        Stuffing::new(blocks).unwrap_or(Stuffing::MAX)
    }

    /// The head of the next frame.
    fn prepare(&mut self, was: State, extra: Option<Extra>, restarted: bool) {
        let symbol = match self.state {
            State::Reset => MasterSymbol::Reset,
            State::Sync => MasterSymbol::Sync,
            State::Start => MasterSymbol::Start,
            State::Learn => MasterSymbol::Learn,
            State::Check => MasterSymbol::Check,
            State::IdReq => MasterSymbol::IdReq,
            State::WaitVsync => MasterSymbol::Init,
            State::Running if self.link.is_settled() => self.requester.transmit(),
            State::Running => MasterSymbol::Idle,
        };
        // The disparity goes on only from frames without an answer.
        let carried = matches!(was, State::Reset | State::Sync) && !restarted;
        let disparity = if carried { self.disparity } else { LineDisparity::ZERO };
        let msync = self.state == State::Running && self.link.msync();
        (self.present, self.disparity) = transmission(self.state, symbol, msync, extra, disparity);
        if restarted {
            self.present.lead_in = 16;
        }
    }

    fn receive(&mut self, bits: u64) -> Result<(), Cause> {
        match self.state {
            State::Start if bits != TEST_PATTERN => {
                return Err(Cause::Learn(if bits == u64::MAX >> 3 { Error::NoEdge } else { Error::Pattern }));
            }
            State::Learn | State::Check if bits != TEST_PATTERN => return Err(Cause::Pattern),
            State::Reset | State::Sync | State::Start | State::Learn | State::Check => {}
            State::IdReq => self.identify(bits).map_err(Cause::Identifier)?,
            State::WaitVsync => return self.wait_for_vsync(bits),
            State::Running => return self.run(bits),
        }
        self.done = self.done.saturating_add(1);
        if self.state.frames() == Some(self.done) {
            (self.state, self.done) = (self.state.next(), 0);
        }
        Ok(())
    }

    fn identify(&mut self, bits: u64) -> Result<(), Error> {
        let answer = Answer::from_bits(self.dialect.rule, bits);
        let id = EncoderId::from_answer(answer)?;
        let bits = id.check()?;
        self.encoder = Some(id);
        self.link = Link::new(&self.dialect, bits);
        self.report.encoder = Some(id);
        Ok(())
    }

    fn wait_for_vsync(&mut self, bits: u64) -> Result<(), Cause> {
        let answer = Answer::from_bits(self.dialect.rule, bits);
        self.done = self.done.saturating_add(1);
        if answer.parameter().is_ok_and(EncoderByte::vsync) {
            (self.state, self.done) = (State::Running, 0);
            self.report.doubtful = self.dialect.doubt_at_lock;
        } else if self.dialect.vsync_frames != 0 && self.done >= self.dialect.vsync_frames {
            return Err(Cause::NoVsync);
        }
        Ok(())
    }

    /// Begins the start-up again. Messages under way end.
    fn begin_again(&mut self) {
        let was = self.report.was;
        self.counters.restarts = self.counters.restarts.wrapping_add(1);
        (self.state, self.done) = (State::Reset, 0);
        self.link = Link::new(&self.dialect, PositionBits::MAX);
        self.encoder = None;
        let finished = self.report.finished;
        let dropped = self.requester.drop_all();
        self.report = Report {
            was,
            signal: self.report.signal,
            finished: Finished { short: finished.short.or(dropped.short), long: finished.long.or(dropped.long) },
            ..Report::START
        };
    }
}

#[inline]
fn transmission(
    state: State,
    symbol: MasterSymbol,
    msync: bool,
    extra: Option<Extra>,
    disparity: LineDisparity,
) -> (Transmission, LineDisparity) {
    let byte = ParameterByte::of(symbol, matches!(state, State::WaitVsync | State::Running), msync);
    let (head, after) = match extra {
        // Every answered frame of a free-running link; what is constant here costs nothing.
        None if disparity == LineDisparity::ZERO => Head::new(byte, None, LineDisparity::ZERO),
        None => Head::new(byte, None, disparity),
        Some(extra) => Head::new(byte, Some(extra), disparity.with_ones(extra.bits())),
    };
    (Transmission { lead_in: 0, head, answered: !matches!(state, State::Reset | State::Sync) }, after)
}

const fn trailer(before: State, restarted: Option<Cause>) -> Trailer {
    match (before, restarted) {
        (State::Reset | State::Sync, _) => Trailer::Whole,
        (State::Learn, Some(Cause::Pattern)) => Trailer::Cut,
        _ => Trailer::AfterAnswer,
    }
}
