//! What comes back in the start-up, and what counts as an answer.

use super::config::State;
use super::heard::Heard;
use super::machine::Master;
use crate::delay_req::DelayReq;
use crate::discovery::DiscoveryView;
use crate::error::Error;
use crate::exchange::DeviceFrameView;
use crate::frame::LongFrame;
use crate::frame_type::FrameType;
use crate::param::ParamView;
use crate::status::Status;
use crate::sync::{Sync, TRANSIT_NS};
use crate::timing::Timing;

impl Master {
    /// A frame was heard that began at `sof_ns`: a start-up frame that has come back, or a device's frame of the IO exchange. Its
    /// payload may be used only if this accepts it.
    ///
    /// # Errors
    /// What the frame is refused for: as [`LongFrame::parse`] and as [`DeviceFrameView::parse`]; [`Error::BeforeRequest`] if it
    /// began before the frame that it would answer; [`Error::WrongState`] in IDLE and ERROR. A bad DISCOVERY answer and
    /// [`Error::TopologyChanged`] take the master back to IDLE, everything else just does not count.
    pub fn hear<'a>(&mut self, frame: &'a [u8], sof_ns: u64) -> Result<Heard<'a>, Error> {
        let result = match self.state {
            State::Idle | State::Error => return Err(Error::WrongState),
            State::Exchange => return self.device_frame(frame).map(|frame| Heard::Device { frame, sof_ns }),
            State::Discovery => self.discovery_answer(frame, sof_ns),
            State::Param => self.param_answer(frame, sof_ns),
            State::LineDelay => self.delay_answer(frame, sof_ns),
            State::Sync => self.sync_answer(frame, sof_ns),
        };
        if let Err(error) = result {
            self.count(error);
            let stale = matches!(error, Error::BeforeRequest { .. });
            if self.state == State::Discovery && !stale
                || matches!(error, Error::LineTooLong { .. } | Error::CycleTooShort { .. })
            {
                self.fail(error);
            }
        }
        result.map(|()| Heard::StartUp)
    }

    fn device_frame<'a>(&mut self, frame: &'a [u8]) -> Result<DeviceFrameView<'a>, Error> {
        let view = match DeviceFrameView::parse(self.config.payload_len.into(), frame) {
            Ok(view) => view,
            Err(error) => {
                self.cycle.damaged = true;
                self.count(error);
                return Err(error);
            }
        };
        let (address, last) = (view.address().get(), self.network.devices());
        if address > last || view.status().contains(Status::LAST) != (address == last) {
            let error = Error::TopologyChanged { address };
            self.give_up(error);
            return Err(error);
        }
        self.cycle.mark(address);
        if view.status().contains(Status::ERROR) {
            self.counters.device_errors = self.counters.device_errors.saturating_add(1);
        }
        Ok(view)
    }

    /// What began before the request is not its answer.
    fn is_fresh(&self, sof_ns: u64) -> Result<(), Error> {
        match self.sent_ns.checked_sub(sof_ns) {
            None | Some(0) => Ok(()),
            Some(early) => Err(Error::BeforeRequest { early_ns: u32::try_from(early).unwrap_or(u32::MAX) }),
        }
    }

    fn discovery_answer(&mut self, frame: &[u8], sof_ns: u64) -> Result<(), Error> {
        let answer = DiscoveryView::parse(frame)?;
        self.is_fresh(sof_ns)?;
        if answer.status().contains(Status::LAST) {
            self.network.take(answer)?;
            self.answered = true;
        }
        Ok(())
    }

    /// A frame is answered once, and the one with STATE_CHANGE by one that has it too.
    fn param_answer(&mut self, frame: &[u8], sof_ns: u64) -> Result<(), Error> {
        let answer = ParamView::parse(frame)?;
        self.is_fresh(sof_ns)?;
        let last = self.remaining == 1;
        if self.asking && answer.status().contains(Status::STATE_CHANGE) == last {
            self.asking = false;
            (self.remaining, self.unanswered) = (self.remaining.saturating_sub(1), 0);
        }
        Ok(())
    }

    /// The vendor defines DELAY_RESP and sends the request back instead: a response tells nothing.
    fn delay_answer(&mut self, frame: &[u8], sof_ns: u64) -> Result<(), Error> {
        let frame = LongFrame::parse(frame)?;
        if frame.frame_type() == FrameType::DelayResp {
            return Ok(());
        }
        DelayReq::of(frame)?;
        if self.asking {
            self.is_fresh(sof_ns)?;
            self.asking = false;
            self.line.add(u32::try_from(sof_ns.saturating_sub(self.sent_ns)).unwrap_or(u32::MAX));
        }
        Ok(())
    }

    /// Both times have grown by the same hops, so the answer tells how far the last device is.
    fn sync_answer(&mut self, frame: &[u8], sof_ns: u64) -> Result<(), Error> {
        let answer = Sync::parse(frame)?;
        let last_sent = self.frame >= self.config.sync_frames;
        if !(last_sent && answer.status.contains(Status::LAST | Status::STATE_CHANGE)) {
            return Ok(());
        }
        self.is_fresh(sof_ns)?;
        let first = self.line.checked().unwrap_or_default();
        let hops = answer.time_stamp_ns.wrapping_sub(self.sync_stamp_ns).saturating_sub(TRANSIT_NS.into());
        let delay_ns = hops.saturating_add(first.into());
        if delay_ns > u16::MAX.into() && !self.config.long_line {
            return Err(Error::LineTooLong { delay_ns });
        }
        let devices = self.network.devices();
        let hop = hops.checked_div(u32::from(devices).saturating_sub(1)).unwrap_or_default();
        let cable = u16::try_from(hop.saturating_sub(TRANSIT_NS.into())).unwrap_or(u16::MAX);
        let (line_delays_ns, payload_len) = ([first, cable], self.config.payload_len.into());
        let line = Timing { line_delays_ns: &line_delays_ns, devices, output_len: self.output_len(), payload_len };
        if let Some(misfit) = line.misfit(self.config.cycle_ns) {
            return Err(Error::CycleTooShort { device: misfit.device, needs_ns: misfit.needs_ns });
        }
        self.answered = true;
        Ok(())
    }

    pub(super) fn count(&mut self, error: Error) {
        let counter = match error {
            Error::BadFcs { .. } | Error::BadCrc8 { .. } => &mut self.counters.crc_errors,
            _ => &mut self.counters.format_errors,
        };
        *counter = counter.saturating_add(1);
    }
}
