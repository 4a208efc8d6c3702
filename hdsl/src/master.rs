//! The receiver as a state machine without I/O.
//!
//! Every H-frame has two halves. [`Master::transmission`] returns what to send from SYNC to PARA and whether an encoder answers;
//! [`Master::hear`] takes the samples of the answer and returns how the frame ends. The data of the frame are in the [`HFrame`],
//! from which [`Registers::apply`](crate::registers::Registers::apply) builds the register map.
//!
//! The position for control comes from [`Master::fast`], the safe one from [`Master::safe`]; both are evidence, which yields a
//! number only if it may be used.
//!
//! ```text
//!  RESET -> SYNC -> START -> LEARN -> CHECK -> IDREQ -> WAIT VSYNC -> RX0 ... RX7
//!    2       16       9        9       16        1      until VSYNC     ^       |
//!  ^         no answer | test pattern  |                                +-------+
//!  +---- restart: pattern missing or wrong, identifier wrong, link lost, reset asked for
//! ```
//!
//! The firmware loads of the vendor's state diagram are left out, because they are specific to its processor.
//!
//! ```
//! use hdsl::device::Device;
//! use hdsl::master::{Master, State};
//! use hdsl::sampling::line;
//! use hdsl::{Dialect, EncoderId, Policy};
//!
//! let mut master = Master::new(Dialect::SICK);
//! let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
//! for frame in 0..150_u64 {
//!     let answer = encoder.set_position(7 * frame).hear(master.transmission().head.bits());
//!     // a cable that delays the answer by 11 eighths of a bit
//!     let samples = answer.map_or([0xff; 72], |answer| line(answer.bits, 11));
//!     // The window of the answer ends 99 bits after the frame began.
//!     master.hear(&samples, 11_520 * frame + 10_560)?;
//! }
//! assert_eq!(master.state(), State::Running);
//! // At the end of the last frame, for a control loop that lives with positions of the last 20 µs.
//! let fast = master.fast().at(11_520 * 150, Policy::new(20_000))?;
//! assert_eq!((fast.velocity(), fast.position()), (7, 7 * 149));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod control;
mod h_frame;
mod link;
mod send;
mod start_up;
mod state;

pub use h_frame::{Counters, HFrame, SignalQuality};
pub use send::Transmission;
pub use state::{RestartReason, State};

use crate::dialect::Dialect;
use crate::encoder_id::{EncoderId, PositionBits};
use crate::error::Error;
use crate::frame::{BIT_RATE, Extra, Stuffing, Tail, Trailer};
use crate::line_code::LineDisparity;
use crate::message::Requester;
use crate::parameter::MasterSymbol;
use crate::rssi::Rssi;
use crate::sampling::{Alignment, TEST_PATTERN, WINDOW};
use crate::sync::Synchroniser;
use link::Link;
use send::{trailer, transmission};

/// Number of bits from the sampling edge to the end of the window of the answer, in a frame without an EXTRA window: the
/// rest of the head, the direction switch, the answer and its reserve.
const SINCE_EDGE_BITS: u64 = 18 + 1 + WINDOW as u64;
/// Half and one and a half free-running frames, in ns.
const HALF_FRAME_NS: u32 = 5_760;
const FREE_RUNNING_NS: u32 = 3 * HALF_FRAME_NS;
/// The same time in ns, rounded up.
const SINCE_EDGE_NS: u64 = (SINCE_EDGE_BITS * 1_000_000_000).div_ceil(BIT_RATE as u64);

/// The receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Master {
    dialect: Dialect,
    sync: Option<Synchroniser>,
    /// Eighths of a bit from pulse to pulse, once known.
    pulse: Option<u32>,
    state: State,
    /// Number of completed frames of the state.
    done: u8,
    disparity: LineDisparity,
    present: Transmission,
    alignment: Option<Alignment>,
    /// Sample periods with edges of the test pattern, since LEARN.
    edges: u8,
    encoder: Option<EncoderId>,
    link: Link,
    requester: Requester,
    h_frame: HFrame,
    counters: Counters,
    /// ACC_ERR_CNT_THRESH.
    threshold: u8,
    restart: bool,
    /// When the window of the last answer ended, and whether frames after it were lost.
    end_ns: u64,
    gap: bool,
    /// Time from the end of one window to the end of the next, plus half a frame; if more time passes, a frame was lost.
    longest_ns: u32,
    /// Number of stuffing blocks after a frame of a free-running link that is up, and the corresponding `longest_ns`.
    stuffing: Stuffing,
    usual_ns: u32,
    /// Steps per turn for the angle in a sample; 0 if not known.
    steps_per_turn: u32,
    /// Time from the sampling edge at the master to the sampling in the encoder.
    latency_ns: u16,
    /// How long before the end of an EXTRA window its sampling edge was, in ns.
    edge_ns: u8,
    /// How late the external pulse of the present frame was, in eighths of a bit.
    late: Option<i16>,
    /// The next head, if it was sent before this frame's answer was processed.
    ahead: Option<Transmission>,
    /// Why the link was lost, if the frame after the loss is already on the line.
    lost: Option<RestartReason>,
    /// The frame does not end in the usual way: because of another mode, a requested restart, frames lost before it, or one of the
    /// two fields above.
    detour: bool,
}

impl Master {
    /// Creates a free-running receiver at the beginning of the start-up.
    pub fn new(dialect: Dialect) -> Self {
        Self::start(dialect, None)
    }

    /// Creates a receiver that keeps its frames on an external pulse.
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
            link: Link::new(&dialect, EncoderId::truncate(0), PositionBits::MAX),
            requester: Requester::new(dialect.messages),
            h_frame: HFrame::START,
            counters: Counters::default(),
            threshold: 0x1f,
            restart: false,
            end_ns: 0,
            gap: false,
            longest_ns: u32::MAX,
            stuffing: Stuffing::MIN,
            usual_ns: FREE_RUNNING_NS,
            steps_per_turn: 0,
            latency_ns: 0,
            edge_ns: 0,
            late: None,
            ahead: None,
            lost: None,
            detour: false,
        }
    }

    /// Returns what to send at the beginning of the present H-frame.
    pub const fn transmission(&self) -> Transmission {
        self.present
    }

    /// The state of the receiver.
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

    /// The data of the last H-frame.
    pub const fn h_frame(&self) -> &HFrame {
        &self.h_frame
    }

    /// The counts.
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

    /// Returns whether the edge of the present frame belongs to the external pulse; `false` when free running.
    pub fn is_on_pulse(&self) -> bool {
        self.sync.is_some_and(|sync| sync.is_on_pulse())
    }

    /// Returns whether the frames are in step with the external pulse, see [`Synchroniser::is_in_step`]; `false` when free running.
    pub fn is_in_step(&self) -> bool {
        self.sync.is_some_and(|sync| sync.is_in_step())
    }

    /// Takes the samples of the answer, one byte per bit time with the first sample in bit 7, and ends the H-frame.
    ///
    /// For a frame without an answer the samples are ignored. `end_ns` is when the [`WINDOW`] bit times had ended, on the clock
    /// of the application: [`fast`](Self::fast) and [`safe`](Self::safe) derive the instants of sampling from it.
    ///
    /// # Errors
    /// [`Error::Truncated`] for fewer than [`WINDOW`] bytes of samples of an answer; then nothing has changed.
    pub fn hear(&mut self, samples: &[u8], end_ns: u64) -> Result<&HFrame, Error> {
        let Some(window) = samples.first_chunk() else { return self.hear_less(samples.len(), end_ns) };
        self.frame_ends(end_ns);
        Ok(match (self.state, self.alignment) {
            (State::Start | State::Learn | State::Check, _) => self.hear_window(window),
            (_, Some(alignment)) if self.present.answered => {
                let (bits, rssi) = alignment.read_quarter(window, self.link.at() & 3);
                self.end_measured(alignment, bits, rssi)
            }
            _ => self.end(u64::MAX, None),
        })
    }

    /// Handles a frame with fewer samples than an answer has.
    #[cold]
    fn hear_less(&mut self, samples: usize, end_ns: u64) -> Result<&HFrame, Error> {
        if self.present.answered {
            return Err(Error::Truncated { got: u16::try_from(samples).unwrap_or(u16::MAX), want: 72 });
        }
        self.frame_ends(end_ns);
        Ok(self.end(u64::MAX, None))
    }

    /// Does the same with four bytes of samples per word, the first one in the low bits, as DMA leaves them in the memory of a
    /// little-endian processor. It is fast even on one that cannot load words from any address.
    ///
    /// ```
    /// use hdsl::Dialect;
    /// use hdsl::master::{Master, RestartReason, State};
    /// # use hdsl::Error;
    /// let mut master = Master::new(Dialect::SICK);
    /// // No encoder: after RESET and SYNC, 18 frames without an answer, the line stays high.
    /// for _ in 0..18 {
    ///     assert_eq!(master.hear_words(&[u32::MAX; 18], 0).restarted, None);
    /// }
    /// assert_eq!(master.hear_words(&[u32::MAX; 18], 0).restarted, Some(RestartReason::Learn(Error::NoEdge)));
    /// assert_eq!(master.state(), State::Reset);
    /// ```
    pub fn hear_words(&mut self, samples: &[u32; WINDOW / 4], end_ns: u64) -> &HFrame {
        self.frame_ends(end_ns);
        match (self.state, self.alignment) {
            // The start-up has time.
            (State::Start | State::Learn | State::Check, _) => {
                let mut bytes = [0; WINDOW];
                for (to, from) in bytes.chunks_exact_mut(4).zip(samples) {
                    to.copy_from_slice(&from.to_le_bytes());
                }
                self.hear_window(&bytes)
            }
            (_, Some(alignment)) if self.present.answered => {
                let (bits, rssi) = alignment.read_quarter_words(samples, self.link.at() & 3);
                self.end_measured(alignment, bits, rssi)
            }
            _ => self.end(u64::MAX, None),
        }
    }

    #[inline]
    fn end_measured(&mut self, alignment: Alignment, bits: u64, rssi: Rssi) -> &HFrame {
        self.end(bits, Some(SignalQuality { rssi, delay: alignment.delay, edges: self.edges }))
    }

    /// Takes the 61 bits of the answer, the first in bit 0, from a front end that finds them itself (an FPGA, a PRU), and
    /// ends the H-frame. `signal` is what that front end knows about the quality of the line; without it, RSSI is not
    /// evaluated. In START frames, too, the bits have to be the test pattern.
    ///
    /// For a frame without an answer the bits are ignored. `end_ns` is when the [`WINDOW`] bit times had ended in which an
    /// answer can come, regardless of the delay of the cable.
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
    ///     let answer = encoder.set_position(1000).hear(master.transmission().head.bits());
    ///     let bits = answer.map_or(u64::MAX, |answer| answer.bits);
    ///     master.hear_bits(bits, None, 0);
    /// }
    /// assert_eq!(master.encoder_id().map(|id| id.position_bits()), Some(32));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn hear_bits(&mut self, bits: u64, signal: Option<SignalQuality>, end_ns: u64) -> &HFrame {
        self.frame_ends(end_ns);
        self.end(bits, signal)
    }

    /// Takes how many eighths of a bit after its sampling edge the external pulse of the present frame came (negative: before
    /// it). Call this before the answer is heard, in frames that are [on a pulse](Self::is_on_pulse). See [`Synchroniser::next`].
    pub const fn hear_pulse(&mut self, late: i16) {
        self.late = Some(late);
    }

    /// Notes that another H-frame was heard. If it ended too late, an unreported frame was lost, and with it the position.
    #[inline]
    fn frame_ends(&mut self, end_ns: u64) {
        let is_late = end_ns.saturating_sub(self.end_ns) > self.longest_ns.into();
        self.end_ns = end_ns;
        if is_late {
            self.interrupt();
        }
    }

    /// Handles unreported lost frames.
    #[cold]
    fn interrupt(&mut self) {
        self.note_gap();
        self.edge_ns = self.present.head.extra().map_or(0, Extra::low_ns);
        let before_ns = self.sampled_ns().saturating_sub(self.frame_ns().into());
        self.link.interrupt(before_ns);
    }

    /// Notes that frames before the next one are not heard.
    const fn note_gap(&mut self) {
        if matches!(self.state, State::Running) {
            (self.gap, self.detour) = (true, true);
        }
    }

    /// Time from the end of the last window to that of the next one.
    const fn frame_ns(&self) -> u32 {
        self.longest_ns.saturating_sub(HALF_FRAME_NS)
    }

    /// Returns when the encoder took its sample in the last H-frame.
    const fn sampled_ns(&self) -> u64 {
        let since_edge_ns = SINCE_EDGE_NS.wrapping_add(self.edge_ns as u64).saturating_sub(self.latency_ns as u64);
        self.end_ns.saturating_sub(since_edge_ns)
    }

    /// Notes that a V-frame begins after the present H-frame.
    fn latch(&mut self) {
        self.edge_ns = self.present.head.extra().map_or(0, Extra::low_ns);
        self.link.latch(self.sampled_ns());
    }

    fn end(&mut self, bits: u64, signal: Option<SignalQuality>) -> &HFrame {
        self.h_frame.begin(self.state, signal);
        let outcome = self.receive(bits);
        if self.h_frame.was != State::Running || outcome.is_err() || self.detour {
            return self.end_with(outcome);
        }
        if let Some(sync) = &mut self.sync {
            let next = sync.next(self.late.take());
            self.follow_pulse(next);
        } else {
            self.edge_ns = 0;
            self.present = self.following();
        }
        self.go_on()
    }

    /// Ends a frame in the usual way: does what [`end_with`](Self::end_with) amounts to on a link that is up.
    fn go_on(&mut self) -> &HFrame {
        self.count_frame();
        self.h_frame.restarted = None;
        self.h_frame.state = State::Running;
        self.h_frame.long_free = self.requester.is_long_free();
        self.h_frame.short_free = self.requester.is_short_free();
        &self.h_frame
    }

    #[expect(clippy::cast_possible_truncation, reason = "modulo 2^32")]
    const fn count_frame(&mut self) {
        self.h_frame.number = self.counters.frames as u32;
        self.counters.frames = self.counters.frames.wrapping_add(1);
    }

    fn end_with(&mut self, outcome: Result<(), RestartReason>) -> &HFrame {
        self.h_frame.gap = core::mem::take(&mut self.gap);
        let late = self.late.take();
        let asked = core::mem::take(&mut self.restart).then_some(RestartReason::Requested);
        let restarted = self.lost.take().or(asked).or(outcome.err());
        self.edge_ns = self.present.head.extra().map_or(0, Extra::low_ns);
        // Once more, to say that there is none.
        self.detour = self.h_frame.gap;
        if let Some(next) = self.ahead.take() {
            // The next head is out: a restart comes after its frame.
            self.present = next;
            self.lost = restarted;
            self.detour |= restarted.is_some();
            self.usual();
            return self.go_on();
        }
        self.count_frame();
        let was = self.h_frame.was;
        if restarted.is_some() {
            self.begin_again();
        }
        let next = self.sync.as_mut().map(|sync| sync.next(late));
        self.h_frame.tail = Tail {
            trailer: trailer(was, restarted),
            stuffing: next.map_or_else(|| self.search_time(was, restarted), |next| next.stuffing),
        };
        self.prepare(was, next.map(|next| next.extra), restarted.is_some());
        match (self.state, self.sync) {
            (State::Running, None) => self.usual(),
            _ => self.longest_ns = self.present_ns(),
        }
        self.h_frame.restarted = restarted;
        self.h_frame.state = self.state;
        self.h_frame.long_free = self.state == State::Running && self.requester.is_long_free();
        self.h_frame.short_free = self.state == State::Running && self.requester.is_short_free();
        &self.h_frame
    }

    /// Sets how frames end on a free-running link that is up, and how long they are.
    const fn usual(&mut self) {
        self.longest_ns = self.usual_ns;
        self.h_frame.tail = Tail { trailer: Trailer::AfterAnswer, stuffing: self.stuffing };
    }

    #[inline]
    fn receive(&mut self, bits: u64) -> Result<(), RestartReason> {
        if self.state == State::Running {
            return self.run(bits);
        }
        let bits = bits & (u64::MAX >> 3);
        match self.state {
            State::Start if bits != TEST_PATTERN => {
                return Err(RestartReason::Learn(if bits == u64::MAX >> 3 { Error::NoEdge } else { Error::Pattern }));
            }
            State::Learn | State::Check if bits != TEST_PATTERN => return Err(RestartReason::Pattern),
            State::Reset | State::Sync | State::Start | State::Learn | State::Check => {}
            State::IdReq => self.identify(bits).map_err(RestartReason::Identifier)?,
            State::WaitVsync => return self.wait_for_vsync(bits),
            State::Running => return Ok(()),
        }
        self.done = self.done.saturating_add(1);
        if self.state.frames() == Some(self.done) {
            (self.state, self.done) = (self.state.next(), 0);
        }
        Ok(())
    }
}
