//! The application's side of the receiver: positions to use, messages, settings.

use super::{FREE_RUNNING_NS, Master, State};
use crate::doubt::Doubt;
use crate::encoder_id::EncoderId;
use crate::error::Error;
use crate::evidence::{Evidence, SafeEvidence};
use crate::frame::Stuffing;
use crate::message::{Finished, LongRequest, ShortRequest};
use crate::sync::{Es, Synchroniser};

impl Master {
    /// What is known about the fast position after the last H-frame, to be judged where it is used.
    pub fn fast(&self) -> Evidence {
        if self.linked().is_none() {
            return Evidence::doubtful(Doubt::NoLink);
        }
        let mut evidence = self.link.fast(self.number(), self.sampled_ns());
        evidence.sample.steps_per_turn = self.steps_per_turn;
        evidence
    }

    /// What is known about the safe position of the last V-frame, to be judged where it is used.
    pub fn safe(&self) -> SafeEvidence {
        self.linked().map_or(SafeEvidence(Err(Doubt::NoLink)), |id| self.link.safe(id))
    }

    /// The encoder of a link that runs.
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

    /// Steps per turn, RESOLUTN (resource 081h) of a rotary encoder: for [`Sample::angle`](crate::Sample::angle). 0 for none.
    pub const fn set_steps_per_turn(&mut self, steps: u32) {
        self.steps_per_turn = steps;
    }

    /// Blocks of stuffing after each H-frame of a running link that is free running, 0 at first. A frame lasts 11.52 µs and 0.64 µs a
    /// block: for a processor that needs more time, or another rate of positions. [`ahead`](Self::ahead) goes with it. On a link that runs it counts from the
    /// end of the next frame on.
    pub const fn set_stuffing(&mut self, stuffing: Stuffing) {
        self.stuffing = stuffing;
        self.usual_ns = FREE_RUNNING_NS.wrapping_add((stuffing.get() as u32).wrapping_mul(640));
        self.detour = true;
    }

    /// How long after its edge has left the master an encoder samples: 5 ns per metre of cable, and up to 100 ns of its own (SICK
    /// manual, p. 12). It counts in the instants of positions; 0 at first.
    pub const fn set_latency_ns(&mut self, latency_ns: u16) {
        self.latency_ns = latency_ns;
    }

    /// So many H-frames went over the line whose answers will not be heard, before the one that is heard next: a block of samples was
    /// overwritten, a head was repeated. Their words are missing, their V-frames have no safe position, and the numbers of frames go
    /// on. Some 60 instructions each.
    ///
    /// A frame of which nobody tells is known by its time, if its end is told half a frame too late; then no fast position is given until
    /// three safe positions have come, no safe one of that V-frame, and the number of the frame is not known.
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

    /// Drops all messages and tells the encoder so (MRST). What was under way ends with [`Error::Dropped`].
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete.
    pub fn reset_messages(&mut self) -> Result<Finished, Error> {
        self.check_link()?;
        Ok(self.requester.reset())
    }

    /// Starts a short message; its end is in [`HFrame::finished`](super::HFrame::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_short(request)
    }

    /// Starts a long message; its end is in [`HFrame::finished`](super::HFrame::finished).
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

    /// ACC_ERR_CNT_THRESH: unusable acceleration words in a row after which a dialect that does so restarts the link.
    pub const fn set_acceleration_threshold(&mut self, words: u8) {
        self.threshold = words;
    }

    /// The period of the external pulse in eighths of a bit (13.333 ns each), for
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

    /// SYNC_CTRL: how many H-frames there are for a pulse from the next frame on, `None` free running. The link goes on.
    ///
    /// # Errors
    /// [`Error::NoPulse`] if no period is known, [`Error::PeriodTooShort`], [`Error::ExtraOutOfRange`]; the frames stay as
    /// they were.
    pub fn set_frames_per_pulse(&mut self, frames: Option<Es>) -> Result<(), Error> {
        self.sync = match frames {
            Some(es) => Some(Synchroniser::new(self.pulse.ok_or(Error::NoPulse)?, es)?),
            None => None,
        };
        self.detour |= self.sync.is_some();
        Ok(())
    }
}
