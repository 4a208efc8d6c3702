//! The application's side of the receiver: usable positions, messages, settings.

use super::{FREE_RUNNING_NS, Master, State};
use crate::doubt::Doubt;
use crate::encoder_id::EncoderId;
use crate::error::Error;
use crate::evidence::{Evidence, SafeEvidence};
use crate::frame::Stuffing;
use crate::message::{Finished, LongRequest, ShortRequest};
use crate::sync::{Es, Synchroniser};

impl Master {
    /// Returns what is known about the fast position after the last H-frame, to be judged where it is used.
    pub fn fast(&self) -> Evidence {
        if self.linked().is_none() {
            return Evidence::doubtful(Doubt::NoLink);
        }
        let mut evidence = self.link.fast(self.number(), self.sampled_ns());
        evidence.sample.steps_per_turn = self.steps_per_turn;
        evidence
    }

    /// Returns what is known about the safe position of the last V-frame, to be judged where it is used.
    pub fn safe(&self) -> SafeEvidence {
        self.linked().map_or(SafeEvidence(Err(Doubt::NoLink)), |id| self.link.safe(id))
    }

    /// Returns the encoder of a running link.
    const fn linked(&self) -> Option<EncoderId> {
        match (self.state, self.lost) {
            (State::Running, None) => self.encoder,
            _ => None,
        }
    }

    /// Number of the last H-frame.
    #[expect(clippy::cast_possible_truncation, reason = "modulo 2^32")]
    const fn number(&self) -> u32 {
        self.counters.frames.wrapping_sub(1) as u32
    }

    /// Sets the steps per turn, RESOLUTN (resource 081h) of a rotary encoder, for [`Sample::angle`](crate::Sample::angle); 0 for
    /// none.
    pub const fn set_steps_per_turn(&mut self, steps: u32) {
        self.steps_per_turn = steps;
    }

    /// Sets the number of stuffing blocks after each H-frame of a free-running link that is up; initially 0. A frame lasts 11.52
    /// µs plus 0.64 µs per block, which helps a processor that needs more time, or sets another rate of positions.
    /// [`ahead`](Self::ahead) can be used with it. On a running link it takes effect from the end of the next frame.
    pub const fn set_stuffing(&mut self, stuffing: Stuffing) {
        self.stuffing = stuffing;
        self.usual_ns = FREE_RUNNING_NS.wrapping_add((stuffing.get() as u32).wrapping_mul(640));
        self.detour = true;
    }

    /// Sets how long after the edge has left the master the encoder samples: 5 ns per metre of cable, plus up to 100 ns in the
    /// encoder (SICK manual, p. 12). It is included in the instants of positions; initially 0.
    pub const fn set_latency_ns(&mut self, latency_ns: u16) {
        self.latency_ns = latency_ns;
    }

    /// Reports that this many H-frames went over the line whose answers will not be heard, before the next one that is heard,
    /// for example because a block of samples was overwritten or a head was repeated. Their words are missing, their V-frames
    /// have no safe position, and the frame numbers include them. This takes some 60 instructions per frame.
    ///
    /// A lost frame that is not reported is recognised by its time, if the reported end is half a frame too late. Then no
    /// fast position is returned until three safe positions have come, no safe position is returned from that V-frame, and
    /// the number of the frame is not known.
    pub fn skip(&mut self, frames: u8) {
        self.counters.frames = self.counters.frames.wrapping_add(frames.into());
        let frame_ns = self.frame_ns();
        for _ in 0..frames {
            self.end_ns = self.end_ns.saturating_add(frame_ns.into());
            self.note_gap();
            if self.state == State::Running && self.link.skip() {
                self.latch();
            }
        }
    }

    /// Restarts the link at the end of the present frame (PRST).
    pub const fn request_restart(&mut self) {
        (self.restart, self.detour) = (true, true);
    }

    /// Drops all messages and tells the encoder to do the same (MRST). Messages under way end with [`Error::Dropped`].
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete.
    pub fn reset_messages(&mut self) -> Result<Finished, Error> {
        self.check_link()?;
        Ok(self.requester.reset())
    }

    /// Starts a short message; its result appears in [`HFrame::finished`](super::HFrame::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_short(request)
    }

    /// Starts a long message; its result appears in [`HFrame::finished`](super::HFrame::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_long(&mut self, request: LongRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_long(request)
    }

    fn check_link(&self) -> Result<(), Error> {
        if self.state == State::Running && self.lost.is_none() && self.link.is_settled() {
            Ok(())
        } else {
            Err(Error::NotLocked)
        }
    }

    /// Sets ACC_ERR_CNT_THRESH: the number of unusable acceleration words in a row after which the link restarts, in a dialect
    /// that has this rule.
    pub const fn set_acceleration_threshold(&mut self, words: u8) {
        self.threshold = words;
    }

    /// Sets the period of the external pulse in eighths of a bit (13.333 ns each), for
    /// [`set_frames_per_pulse`](Self::set_frames_per_pulse).
    ///
    /// ```
    /// use hdsl::master::Master;
    /// use hdsl::sync::Es;
    /// use hdsl::{Dialect, Error};
    /// let mut master = Master::new(Dialect::SICK);
    /// assert_eq!(master.set_frames_per_pulse(Es::new(4)), Err(Error::NoPulse));
    /// // 62.5 us at 75 MHz
    /// master.set_pulse_period(4687);
    /// assert_eq!(master.set_frames_per_pulse(Es::new(4)), Ok(()));
    /// assert!(master.is_on_pulse());
    /// ```
    pub const fn set_pulse_period(&mut self, period: u32) {
        self.pulse = Some(period);
    }

    /// Sets SYNC_CTRL: how many H-frames there are per pulse, starting with the next frame; `None` for free running. The link
    /// continues.
    ///
    /// # Errors
    /// [`Error::NoPulse`] if no period is known, [`Error::PeriodTooShort`], [`Error::ExtraOutOfRange`]; the frames then stay as
    /// they were.
    pub fn set_frames_per_pulse(&mut self, frames: Option<Es>) -> Result<(), Error> {
        self.sync = match frames {
            Some(es) => Some(Synchroniser::new(self.pulse.ok_or(Error::NoPulse)?, es)?),
            None => None,
        };
        self.detour = true;
        Ok(())
    }
}
