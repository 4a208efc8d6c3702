//! The receiver as a machine without I/O.
//!
//! Every H-frame has two halves. [`Master::transmission`] says what to send from SYNC to PARA and whether an encoder
//! answers; [`Master::finish`] takes the samples of the answer and says how the frame ends. Everything that was
//! learned is in the [`Registers`] and in the [`Report`].
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
//! use hdsl::{EncoderId, Profile};
//!
//! let mut master = Master::new(Profile::SICK);
//! let mut encoder = Device::new(EncoderId::new(0x00153).ok_or("20 bits")?);
//! for frame in 0..150_u64 {
//!     let answer = encoder.answer(master.transmission().head.bits(), 7 * frame);
//!     // a cable that delays the answer by 11 eighths of a bit
//!     let samples = answer.map_or([0xff; 72], |bits| line(bits, 11));
//!     master.finish(&samples, None)?;
//! }
//! assert_eq!(master.state(), State::Running);
//! assert_eq!((master.registers().velocity(), master.registers().position()), (7, 7 * 149));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod control;
mod link;

use crate::frame::{Extra, Head, MAX_STUFFING, Tail, Trailer};
use crate::message::{Finished, Requester};
use crate::registers::{Event, EventS, Interrupts, Online1, Online2, OnlineD, Register, Registers};
use crate::sampling::{Alignment, TEST_PATTERN, WINDOW};
use crate::sync::Synchroniser;
use crate::{Answer, EncoderByte, EncoderId, Error, LineDisparity, MasterSymbol, ParameterByte, Phase, Profile};
use link::Link;

/// Where the receiver is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum State {
    /// Two frames without an answer.
    Reset,
    /// Sixteen frames without an answer: the encoder synchronises.
    Sync,
    /// Nine frames: sampling index and delay are searched in the test pattern.
    Start,
    /// Nine frames: the test pattern has to come at the learned place.
    Learn,
    /// Sixteen frames more of the same: line check.
    Check,
    /// One frame: the encoder identifier.
    IdReq,
    /// Frames with INIT until VSYNC comes.
    WaitVsync,
    /// RX0..RX7, V-frame after V-frame.
    Running,
}

impl State {
    /// How many frames the state lasts; `None` if that depends on the encoder.
    pub const fn frames(self) -> Option<u8> {
        match self {
            Self::Reset => Some(2),
            Self::Sync | Self::Check => Some(16),
            Self::Start | Self::Learn => Some(9),
            Self::IdReq => Some(1),
            Self::WaitVsync | Self::Running => None,
        }
    }

    const fn next(self) -> Self {
        match self {
            Self::Reset => Self::Sync,
            Self::Sync => Self::Start,
            Self::Start => Self::Learn,
            Self::Learn => Self::Check,
            Self::Check => Self::IdReq,
            Self::IdReq => Self::WaitVsync,
            Self::WaitVsync | Self::Running => Self::Running,
        }
    }
}

/// Why the link was started anew.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// The application asked for it (PRST).
    Requested,
    /// A START frame: no encoder, or the test pattern is not there.
    Learn(Error),
    /// A LEARN or CHECK frame: the test pattern came with a wrong bit.
    Pattern,
    /// The identifier was damaged or is of an encoder that this receiver does not support.
    Identifier(Error),
    /// No VSYNC within the frames that [`Profile::vsync_frames`] allows.
    NoVsync,
    /// The quality monitor has run out.
    Quality,
    /// Too many acceleration words in a row could not be used.
    AccelerationErrors,
}

/// What to send from the start of an H-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Transmission {
    /// Zeros in front of the frame: 16 after a restart, no need of the protocol.
    pub lead_in: u8,
    /// SYNC to PARA.
    pub head: Head,
    /// Whether an encoder answers: then the line is released behind PARA, reception begins one bit later and takes
    /// [`WINDOW`] bits. Otherwise [`FILLER`](crate::frame::FILLER) is sent.
    pub answered: bool,
}

/// How an H-frame ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use]
pub struct Report {
    /// What to send behind the answer.
    pub tail: Tail,
    /// Messages that came to their end.
    pub finished: Finished,
    /// Set if the next frame begins a new start-up.
    pub restarted: Option<Cause>,
    /// Interrupt lines that became or are active.
    pub interrupts: Interrupts,
}

/// What was counted since the machine was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Counters {
    /// H-frames.
    pub frames: u64,
    /// Restarts.
    pub restarts: u32,
    /// Bad words in answers, all channels.
    pub words: u32,
    /// Acceleration words that could not be used.
    pub acceleration: u32,
    /// V-frames without a good safe channel 1.
    pub safe1: u32,
    /// V-frames without a good safe channel 2.
    pub safe2: u32,
    /// Answers with a wrong switch bit.
    pub switch_bits: u32,
}

/// The receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Master {
    profile: Profile,
    sync: Option<Synchroniser>,
    state: State,
    /// Frames of the state that are done.
    done: u8,
    disparity: LineDisparity,
    present: Transmission,
    alignment: Option<Alignment>,
    encoder: Option<EncoderId>,
    link: Link,
    requester: Requester,
    registers: Registers,
    counters: Counters,
    restart: bool,
}

impl Master {
    /// A free-running receiver at the beginning of the start-up.
    pub fn new(profile: Profile) -> Self {
        Self::start(profile, None)
    }

    /// A receiver that keeps its frames on an external pulse.
    pub fn synchronised(profile: Profile, sync: Synchroniser) -> Self {
        Self::start(profile, Some(sync))
    }

    fn start(profile: Profile, sync: Option<Synchroniser>) -> Self {
        let extra = sync.map(|sync| sync.extra());
        let (present, disparity) = transmission(State::Reset, MasterSymbol::Reset, false, extra, LineDisparity::ZERO);
        let mut registers = Registers::new();
        registers.raise(Event::PRST.with(Event::QMLW));
        registers.raise_s(EventS::PRST.with(EventS::QMLW));
        Self {
            profile,
            sync,
            state: State::Reset,
            done: 0,
            disparity,
            present,
            alignment: None,
            encoder: None,
            link: Link::new(&profile, crate::PositionBits::MAX),
            requester: Requester::new(profile.messages),
            registers,
            counters: Counters::default(),
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

    /// The register map.
    pub const fn registers(&self) -> &Registers {
        &self.registers
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
    pub fn finish(&mut self, samples: &[u8], late: Option<i16>) -> Result<Report, Error> {
        if self.present.answered && samples.len() < WINDOW {
            let got = u16::try_from(samples.len()).unwrap_or(u16::MAX);
            return Err(Error::Truncated { got, want: 72 });
        }
        let before = self.state;
        self.counters.frames = self.counters.frames.wrapping_add(1);
        let mut finished = Finished::default();
        let mut outcome = self.receive(samples, &mut finished);
        if core::mem::take(&mut self.restart) {
            outcome = Err(Cause::Requested);
        }
        let restarted = outcome.err();
        if restarted.is_some() {
            let dropped = self.restart();
            finished.short = finished.short.or(dropped.short);
            finished.long = finished.long.or(dropped.long);
        }
        let next = self.sync.as_mut().map(|sync| sync.next(late));
        let tail = Tail {
            trailer: trailer(before, restarted),
            stuffing: next.map_or_else(|| self.search_time(before, restarted), |next| next.stuffing),
        };
        self.prepare(before, next.map(|next| next.extra), restarted.is_some());
        let mut interrupts = self.registers.masked_events();
        if before == State::Running {
            interrupts = interrupts.with(Interrupts::H_FRAME).with(self.link.news());
        }
        Ok(Report { tail, finished, restarted, interrupts })
    }

    /// Stuffing behind a START frame: time for the search.
    fn search_time(&self, before: State, restarted: Option<Cause>) -> u8 {
        match (before, restarted, self.alignment) {
            (State::Start, Some(_), _) => 16,
            (State::Start, None, Some(found)) => found.delay.saturating_sub(1).saturating_add(4).min(MAX_STUFFING),
            _ => 0,
        }
    }

    /// The head of the next frame.
    fn prepare(&mut self, before: State, extra: Option<Extra>, restarted: bool) {
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
        let carried = matches!(before, State::Reset | State::Sync) && !restarted;
        let disparity = if carried { self.disparity } else { LineDisparity::ZERO };
        let msync = self.state == State::Running && self.link.msync();
        (self.present, self.disparity) = transmission(self.state, symbol, msync, extra, disparity);
        if restarted {
            self.present.lead_in = 16;
        }
    }

    fn receive(&mut self, samples: &[u8], finished: &mut Finished) -> Result<(), Cause> {
        match self.state {
            State::Reset | State::Sync => {}
            State::Start => self.alignment = Some(Alignment::learn(samples, self.profile.edge).map_err(Cause::Learn)?),
            State::Learn => {
                self.expect_pattern(samples)?;
                self.show_delay(samples);
            }
            State::Check => {
                self.expect_pattern(samples)?;
                if self.done == 15 {
                    self.registers.set_d(OnlineD::PRST, false);
                    self.registers.set_1(Online1::PRST, false);
                    self.registers.set_2(Online2::PRST, false);
                }
            }
            State::IdReq => self.identify(samples).map_err(Cause::Identifier)?,
            State::WaitVsync => return self.wait_for_vsync(samples),
            State::Running => return self.run(samples, finished),
        }
        self.done = self.done.saturating_add(1);
        if self.state.frames() == Some(self.done) {
            (self.state, self.done) = (self.state.next(), 0);
        }
        Ok(())
    }

    /// The 61 bits of the answer.
    fn bits(&self, samples: &[u8]) -> u64 {
        // Without an alignment no answer is expected.
        self.alignment.and_then(|alignment| alignment.bits(samples).ok()).unwrap_or(u64::MAX)
    }

    fn expect_pattern(&self, samples: &[u8]) -> Result<(), Cause> {
        if self.bits(samples) == TEST_PATTERN { Ok(()) } else { Err(Cause::Pattern) }
    }

    fn show_delay(&mut self, samples: &[u8]) {
        if let Some(alignment) = self.alignment {
            let edges = alignment.edges(samples);
            self.registers.put(Register::Delay, [edges.rssi().get() << 4 | alignment.delay]);
            self.registers.put(Register::Edges, [edges.edges()]);
        }
    }

    fn identify(&mut self, samples: &[u8]) -> Result<(), Error> {
        let answer = Answer::from_bits(self.bits(samples), self.profile.rule);
        let id = EncoderId::from_answer(answer)?;
        let bits = id.check()?;
        self.encoder = Some(id);
        self.link = Link::new(&self.profile, bits);
        let [_, high, middle, low] = id.raw().to_be_bytes();
        self.registers.put(Register::EncId, [high << 4 | high, middle, low]);
        self.registers.put(Register::MasterQm, [0x88]);
        Ok(())
    }

    fn wait_for_vsync(&mut self, samples: &[u8]) -> Result<(), Cause> {
        let answer = Answer::from_bits(self.bits(samples), self.profile.rule);
        self.done = self.done.saturating_add(1);
        if answer.parameter().is_ok_and(EncoderByte::vsync) {
            (self.state, self.done) = (State::Running, 0);
            self.registers.set_d(OnlineD::FREL, true);
            self.registers.set_1(Online1::FRES, true);
            self.registers.raise(Event::FREL);
            self.registers.raise_s(EventS::FRES);
            self.registers.set_d(OnlineD::POS, self.profile.doubt_at_lock);
        } else if self.profile.vsync_frames != 0 && self.done >= self.profile.vsync_frames {
            return Err(Cause::NoVsync);
        }
        Ok(())
    }

    /// Begins the start-up again. Messages under way end.
    fn restart(&mut self) -> Finished {
        self.counters.restarts = self.counters.restarts.wrapping_add(1);
        (self.state, self.done) = (State::Reset, 0);
        self.link = Link::new(&self.profile, crate::PositionBits::MAX);
        self.encoder = None;
        self.registers.restarted();
        self.registers.raise(Event::PRST.with(Event::QMLW));
        self.registers.raise_s(EventS::PRST.with(EventS::QMLW));
        for control in [Register::SysCtrl, Register::SafeCtrl] {
            self.registers.put(control, [0]);
        }
        self.registers.put(Register::PcCtrl, [0]);
        self.requester.drop_all()
    }
}

fn transmission(
    state: State,
    symbol: MasterSymbol,
    msync: bool,
    extra: Option<Extra>,
    disparity: LineDisparity,
) -> (Transmission, LineDisparity) {
    let byte = ParameterByte::of(symbol, matches!(state, State::WaitVsync | State::Running), msync);
    let before = extra.map_or(disparity, |extra| disparity.with_ones(extra.bits()));
    let (head, after) = Head::new(byte, extra, before);
    (Transmission { lead_in: 0, head, answered: !matches!(state, State::Reset | State::Sync) }, after)
}

const fn trailer(before: State, restarted: Option<Cause>) -> Trailer {
    match (before, restarted) {
        (State::Reset | State::Sync, _) => Trailer::Whole,
        (State::Learn, Some(Cause::Pattern)) => Trailer::Cut,
        _ => Trailer::AfterAnswer,
    }
}
