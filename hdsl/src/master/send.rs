//! What the receiver sends: the head of the next H-frame, before or after the answer of the present one is processed, and the
//! end of a frame.

use super::{Master, RestartReason, State};
use crate::frame::{Extra, H_FRAME_BITS, Head, STUFFING_BITS, Stuffing, Tail, Trailer};
use crate::line_code::LineDisparity;
use crate::parameter::{MasterSymbol, ParameterByte};
use crate::sync::Next;

/// What to send from the start of an H-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Transmission {
    /// Zeros before the frame: 16 after a restart, which the protocol does not require.
    pub lead_in: u8,
    /// SYNC to PARA.
    pub head: Head,
    /// Whether an encoder answers. If so, the line is released after PARA, and reception begins one bit later and takes
    /// [`WINDOW`](crate::sampling::WINDOW) bits; otherwise [`FILLER`](crate::frame::FILLER) is sent.
    pub answered: bool,
}

impl Master {
    /// Returns the next head before the answer of the present frame has been processed, for a processor that has not finished an
    /// answer when the next head has to begin. Call this while the answer is being received, send the head, and pass the samples
    /// to [`hear`](Self::hear) while the head is on the line.
    ///
    /// Whatever an answer changes appears on the line one frame later. If it ends the link, the frame already begun is sent to
    /// its end; [`fast`](Self::fast) and [`safe`](Self::safe) return nothing after the loss, and what [`hear`](Self::hear)
    /// returns for that frame says why the link restarts.
    ///
    /// `None` while the next head depends on the answer: before the link runs, in sync mode, and before a restart.
    ///
    /// ```
    /// use hdsl::device::Device;
    /// use hdsl::master::{Master, State};
    /// use hdsl::{Dialect, EncoderId, Policy};
    ///
    /// let mut master = Master::new(Dialect::SICK);
    /// let mut encoder = Device::new(EncoderId::try_from(0x00153)?);
    /// let mut head = master.transmission().head;
    /// for frame in 0..200 {
    ///     let bits = encoder.set_position(7 * frame).hear(head.bits()).map_or(u64::MAX, |answer| answer.bits);
    ///     let next = master.ahead();
    ///     // From here on the next head may be on the line.
    ///     master.hear_bits(bits, None, 11_520 * frame + 10_560);
    ///     head = next.map_or(master.transmission().head, |next| next.head);
    /// }
    /// let now_ns = 11_520 * 200;
    /// let fast = master.fast().at(now_ns, Policy::new(50_000))?;
    /// assert_eq!((master.state(), fast.position()), (State::Running, 7 * 199));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn ahead(&mut self) -> Option<Transmission> {
        if self.ahead.is_none() {
            if self.state != State::Running || self.sync.is_some() || self.detour && self.waits_for_answer() {
                return None;
            }
            // What the end of this frame will change: after RX7 another V-frame begins.
            let last = self.link.at() == 7;
            let msync = self.link.msync() != last;
            let (next, _) = transmission(State::Running, self.requester.transmit(), msync, None, LineDisparity::ZERO);
            (self.ahead, self.detour) = (Some(next), true);
        }
        self.ahead
    }

    /// Returns whether the next head depends on the answer of a running link.
    #[cold]
    const fn waits_for_answer(&self) -> bool {
        self.restart || self.lost.is_some()
    }

    /// Returns the head after a frame of a free-running link that is up.
    #[inline]
    pub(super) fn following(&mut self) -> Transmission {
        transmission(State::Running, self.requester.transmit(), self.link.msync(), None, LineDisparity::ZERO).0
    }

    /// Prepares the next head and the stuffing before it, for a link that is up in sync mode.
    #[inline]
    pub(super) fn follow_pulse(&mut self, next: Next) {
        self.edge_ns = self.present.head.extra().map_or(0, Extra::low_ns);
        self.h_frame.tail = Tail { trailer: Trailer::AfterAnswer, stuffing: next.stuffing };
        let (symbol, msync) = (self.requester.transmit(), self.link.msync());
        (self.present, _) = transmission(State::Running, symbol, msync, Some(next.extra), LineDisparity::ZERO);
        self.longest_ns = self.present_ns();
    }

    /// Returns the time from the end of one window to that of the next, which is that of `present`, plus half a free-running
    /// frame, in ns.
    pub(super) fn present_ns(&self) -> u32 {
        let extra = self.present.head.extra().map_or(0, |extra| extra.bits().into());
        let bits = H_FRAME_BITS
            .wrapping_add(extra)
            .wrapping_add(STUFFING_BITS.wrapping_mul(self.h_frame.tail.stuffing.get().into()));
        // 106.67 ns each.
        bits.wrapping_add(H_FRAME_BITS / 2).wrapping_mul(320) / 3
    }

    /// Number of stuffing blocks after a START frame, to give time for the search.
    pub(super) fn search_time(&self, was: State, restarted: Option<RestartReason>) -> Stuffing {
        let blocks = match (was, restarted, self.alignment) {
            (State::Start, Some(_), _) => 16,
            (State::Start, None, Some(found)) => found.delay.get().saturating_sub(1).saturating_add(4),
            _ => 0,
        };
        Stuffing::new(blocks).unwrap_or(Stuffing::MAX)
    }

    /// Returns the head of the next frame.
    pub(super) fn prepare(&mut self, was: State, extra: Option<Extra>, restarted: bool) {
        let symbol = match self.state {
            State::Reset => MasterSymbol::Reset,
            State::Sync => MasterSymbol::Sync,
            State::Start => MasterSymbol::Start,
            State::Learn => MasterSymbol::Learn,
            State::Check => MasterSymbol::Check,
            State::IdReq => MasterSymbol::IdReq,
            State::WaitVsync => MasterSymbol::Init,
            // IDLE up to the first message, which is not taken before a V-frame is complete.
            State::Running => self.requester.transmit(),
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
}

/// Returns what to send in a frame, and the line disparity after it.
#[inline]
pub(super) fn transmission(
    state: State,
    symbol: MasterSymbol,
    msync: bool,
    extra: Option<Extra>,
    disparity: LineDisparity,
) -> (Transmission, LineDisparity) {
    let byte = ParameterByte::of(symbol);
    let byte = if matches!(state, State::WaitVsync | State::Running) { byte.with_first() } else { byte };
    let byte = if msync { byte.with_msync() } else { byte };
    let (head, after) = match extra {
        // Every answered frame of a free-running link; what is constant here costs nothing.
        None if disparity == LineDisparity::ZERO => Head::coded(byte, None, LineDisparity::ZERO),
        None => Head::coded(byte, None, disparity),
        Some(extra) => Head::coded(byte, Some(extra), disparity.with_ones(extra.bits())),
    };
    (Transmission { lead_in: 0, head, answered: !matches!(state, State::Reset | State::Sync) }, after)
}

/// Returns the end of a frame that was sent in this state.
pub(super) const fn trailer(before: State, restarted: Option<RestartReason>) -> Trailer {
    match (before, restarted) {
        (State::Reset | State::Sync, _) => Trailer::Whole,
        (State::Learn, Some(RestartReason::Pattern)) => Trailer::Cut,
        _ => Trailer::AfterAnswer,
    }
}
