//! What comes back in the start-up, and what counts as an answer.

use super::config::State;
use super::cycle::{Cycle, Cycles, nearest};
use super::heard::Heard;
use super::machine::{AGREED, Master};
use crate::address::DeviceAddress;
use crate::delay_req::DelayReq;
use crate::discovery::DiscoveryView;
use crate::error::Error;
use crate::exchange::DeviceFrameView;
use crate::frame::LongFrame;
use crate::frame_type::FrameType;
use crate::param::ParamView;
use crate::preamble::Preamble;
use crate::status::Status;
use crate::sync::{Sync, TRANSIT_NS};
use crate::tally::Fault;
use crate::timing::{Limit, Misfit, TRIGGER_NS, Timing};

/// From the first bit of a device frame to the capture of its start.
const CAPTURE_NS: u32 = Preamble::Short.capture_ns();
/// The most that the published measurement of a line delay loses on a hop, there and back, in ns.
const LOST_NS: u64 = 16;

impl Master {
    /// Takes a frame whose start was captured at `sof_ns`, see [`Preamble::capture_ns`]: a start-up frame that has come
    /// back, or a device's frame of the IO exchange. Use its payload only if this function accepts it: its checks must be
    /// right, it must have begun at its device's time in a cycle that is open, and it must be the device's first in that cycle.
    ///
    /// # Errors
    /// The reason for the refusal: as [`LongFrame::parse`] and as [`DeviceFrameView::parse`]; [`Error::BeforeRequest`] if it
    /// began before the frame that it would answer; [`Error::OutsideWindow`], [`Error::CycleOver`] and [`Error::Doubled`], which
    /// [`tally`](Master::tally) counts for each device; [`Error::WrongState`] in IDLE and ERROR. A bad DISCOVERY answer,
    /// [`Error::TopologyChanged`], and an answer to the last SYNC which shows that the line does not fit or that a device is not
    /// in step take the master back to IDLE; any other refused frame is ignored.
    pub fn hear<'a>(&mut self, frame: &'a [u8], sof_ns: u64) -> Result<Heard<'a>, Error> {
        let result = match self.state {
            State::Idle | State::Error => return Err(Error::WrongState),
            State::Exchange => {
                let (frame, cycle) = self.device_frame(frame, sof_ns)?;
                return Ok(Heard::Device { frame, cycle, sof_ns });
            }
            State::Discovery => self.discovery_answer(frame, sof_ns),
            State::Param => self.param_answer(frame, sof_ns),
            State::LineDelay => self.delay_answer(frame, sof_ns),
            State::Sync => self.sync_answer(frame, sof_ns),
        };
        if let Err(error) = result {
            self.count(error);
            let stale = matches!(error, Error::BeforeRequest { .. });
            if self.state == State::Discovery && !stale && !self.config.patient_discovery || is_misfit(error) {
                self.fail(error);
            }
        }
        result.map(|()| Heard::StartUp)
    }

    fn device_frame<'a>(&mut self, frame: &'a [u8], sof_ns: u64) -> Result<(DeviceFrameView<'a>, Option<u64>), Error> {
        let view = match DeviceFrameView::parse(self.config.payload_len.into(), frame) {
            Ok(view) => view,
            Err(error) => {
                if let Some(present) = &mut self.cycles.present {
                    present.damaged = true;
                }
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
        let cycle = self.cycle_of(view.address(), sof_ns)?;
        if view.status().contains(Status::ERROR) {
            self.counters.device_errors = self.counters.device_errors.saturating_add(1);
        }
        Ok((view, cycle))
    }

    /// Returns the cycle to which a frame belongs by its time, whether or not it is open; `None` for a cycle that the host has
    /// skipped. Each cycle has one frame from each device.
    fn cycle_of(&mut self, address: DeviceAddress, sof_ns: u64) -> Result<Option<u64>, Error> {
        let Cycles { present, before, hop_ns, .. } = &mut self.cycles;
        let Some(present) = present else { return Err(Error::WrongState) };
        let (hops, first) = (u32::from(address.hops_before()), u32::from(self.line.measured().unwrap_or_default()));
        let path_ns = hop_ns.saturating_mul(hops).saturating_add(first);
        let arrives = self.config.slots.send_ns(address, path_ns).saturating_add(path_ns.into());
        let arrives = arrives.saturating_add(CAPTURE_NS.into()).saturating_sub(TRIGGER_NS.into());
        let cycle_ns = self.config.cycle_ns;
        let from = |cycle: &Cycle| nearest(sof_ns, cycle.trigger_ns.saturating_add_signed(arrives), cycle_ns);
        let window = u64::from(self.config.window_ns).saturating_add(u64::from(hops).saturating_mul(LOST_NS));
        let (ahead, off_ns) = from(present);
        let open = match ahead {
            0 => Some(&mut *present),
            1.. => None,
            _ => before.as_mut().filter(|before| from(before).0 == 0),
        };
        let (fault, error) = match open {
            _ if off_ns.unsigned_abs() > window => {
                (Fault::Late, Error::OutsideWindow { off_ns: i32::try_from(off_ns).unwrap_or(i32::MAX) })
            }
            _ if ahead > 0 => return Ok(None),
            None => (Fault::Stale, Error::CycleOver),
            Some(cycle) => {
                if cycle.mark(address.get()) {
                    return Ok(Some(cycle.number));
                }
                (Fault::Doubled, Error::Doubled { address: address.get() })
            }
        };
        present.disorderly = true;
        self.counters.frames.add(fault);
        if let Some(own) = self.tallies.get_mut(usize::from(address.hops_before())) {
            own.add(fault);
        }
        Err(error)
    }

    /// Refuses a frame that began before the request: it is not its answer.
    fn is_fresh(&self, sof_ns: u64) -> Result<(), Error> {
        match self.sent_ns.checked_sub(sof_ns) {
            None | Some(0) => Ok(()),
            Some(early) => Err(Error::BeforeRequest { early_ns: u32::try_from(early).unwrap_or(u32::MAX) }),
        }
    }

    fn discovery_answer(&mut self, frame: &[u8], sof_ns: u64) -> Result<(), Error> {
        let answer = DiscoveryView::parse(frame)?;
        self.is_fresh(sof_ns)?;
        if !answer.status().contains(Status::LAST) {
            return Ok(());
        }
        let same = self.network.is_told_by(answer);
        self.network.take(answer)?;
        if !self.config.patient_discovery {
            self.answered = true;
            return Ok(());
        }
        if self.agreed >= AGREED {
            // Whoever was counted before must be in the answer to the last one too.
            self.answered = answer.status().contains(Status::STATE_CHANGE) && same;
        } else {
            self.agreed = if same { self.agreed.saturating_add(1) } else { 1 };
        }
        Ok(())
    }

    /// A frame is answered once, and the answer to a frame with STATE_CHANGE has STATE_CHANGE too.
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

    /// The vendor defines DELAY_RESP but sends the request back instead: a response carries no information.
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

    /// Both times have grown by the same hops, so the answer shows how far away the last device is.
    fn sync_answer(&mut self, frame: &[u8], sof_ns: u64) -> Result<(), Error> {
        let answer = Sync::parse(frame)?;
        let last_sent = self.frame >= self.config.sync_frames;
        if !(last_sent && answer.status.contains(Status::LAST | Status::STATE_CHANGE)) {
            return Ok(());
        }
        self.is_fresh(sof_ns)?;
        let first = self.line.measured().unwrap_or_default();
        let gained = answer.time_stamp_ns.wrapping_sub(self.sync_stamp_ns);
        let devices = self.network.devices();
        // Each adds its transit and the cable behind it; the last one has none.
        let took_part = gained.checked_div(TRANSIT_NS.into()).unwrap_or_default();
        if let (Ok(got), true) = (u8::try_from(took_part), took_part < devices.into()) {
            return Err(Error::NotInSync { got, want: devices });
        }
        let hops = gained.saturating_sub(TRANSIT_NS.into());
        let delay_ns = hops.saturating_add(first.into());
        if delay_ns > u16::MAX.into() && !self.config.long_line {
            return Err(Error::LineTooLong { delay_ns });
        }
        let hop = hops.checked_div(u32::from(devices).saturating_sub(1)).unwrap_or_default();
        let cable = u16::try_from(hop.saturating_sub(TRANSIT_NS.into())).unwrap_or(u16::MAX);
        let line_delays_ns = [first, cable];
        let line = Timing::new(&line_delays_ns, devices)
            .with_output_len(self.output_len())
            .with_payload_len(self.config.payload_len.into())
            .with_slots(Some(self.config.slots))
            .with_jitter_ps(self.config.jitter_ps);
        if let Some(misfit) = line.misfit(self.config.cycle_ns) {
            return Err(refusal(misfit));
        }
        self.cycles.end_ns = line.budget().device_frames_at_master_ns.saturating_sub(TRIGGER_NS);
        self.cycles.hop_ns = u32::from(cable).saturating_add(TRANSIT_NS.into());
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

/// Returns the reason why the line must not be started.
const fn refusal(Misfit { device, limit, needs_ns, has_ns }: Misfit) -> Error {
    match limit {
        Limit::MasterFrame | Limit::DeviceFrames => Error::CycleTooShort { device, needs_ns },
        Limit::Gap => Error::GapTooShort { device, gap_ns: has_ns, needs_ns },
        Limit::SendTime => Error::SendBeforeCycle { device, early_ns: needs_ns },
    }
}

const fn is_misfit(error: Error) -> bool {
    matches!(
        error,
        Error::LineTooLong { .. }
            | Error::NotInSync { .. }
            | Error::CycleTooShort { .. }
            | Error::GapTooShort { .. }
            | Error::SendBeforeCycle { .. }
    )
}
