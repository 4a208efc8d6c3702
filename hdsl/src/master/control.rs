//! The application's side of the receiver: positions to use, messages, settings.

use super::{Fast, Master, Safe, State};
use crate::doubt::Doubt;
use crate::error::Error;
use crate::message::{Finished, LongRequest, ShortRequest};
use crate::sync::{Es, Synchroniser};

impl Master {
    /// The fast position, if it may be used: the truth as long as the real speed stays below a sixteenth of the range a
    /// frame.
    ///
    /// # Errors
    /// [`Doubt::NoLink`], [`Doubt::Estimated`], [`Doubt::Alignment`], [`Doubt::Speed`].
    pub fn fast(&self) -> Result<Fast, Doubt> {
        let (State::Running, Some(id)) = (self.state, self.encoder) else { return Err(Doubt::NoLink) };
        let (position, velocity) = self.link.fast()?;
        Ok(Fast { position: id.position(position), velocity })
    }

    /// The safe position of the last V-frame, if it may be used: words and CRC good, and no mark that the encoder has none.
    ///
    /// # Errors
    /// [`Doubt::NoLink`], [`Doubt::NoVFrame`], [`Doubt::Stale`], [`Doubt::Withheld`].
    pub fn safe(&self) -> Result<Safe, Doubt> {
        let (State::Running, Some(id)) = (self.state, self.encoder) else { return Err(Doubt::NoLink) };
        let (position, summary) = self.link.safe()?;
        Ok(Safe { position: id.position(position), age: self.link.at().saturating_add(8), summary })
    }

    /// Starts the link anew at the end of the present frame (PRST).
    pub const fn request_restart(&mut self) {
        self.restart = true;
    }

    /// Drops all messages and tells the encoder so (MRST). What was under way ends with [`Error::Dropped`].
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete.
    pub fn reset_messages(&mut self) -> Result<Finished, Error> {
        self.check_link()?;
        Ok(self.requester.reset())
    }

    /// Starts a short message; its end is in [`Report::finished`](super::Report::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_short(&mut self, request: ShortRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_short(request)
    }

    /// Starts a long message; its end is in [`Report::finished`](super::Report::finished).
    ///
    /// # Errors
    /// [`Error::NotLocked`] before the first V-frame is complete, [`Error::Busy`].
    pub fn start_long(&mut self, request: LongRequest) -> Result<(), Error> {
        self.check_link()?;
        self.requester.start_long(request)
    }

    fn check_link(&self) -> Result<(), Error> {
        if self.state == State::Running && self.link.is_settled() { Ok(()) } else { Err(Error::NotLocked) }
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
        Ok(())
    }
}
