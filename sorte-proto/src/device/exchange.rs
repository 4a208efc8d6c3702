//! The IO exchange: which master frames are accepted, when the device sends its own frame, and when it gives up.

use super::heard::{Action, FrameTimes, Output};
use super::machine::Device;
use super::port::State;
use super::raster::{Due, Plan, Raster};
use crate::address::DeviceAddress;
use crate::drv8711;
use crate::error::Error;
use crate::exchange::{DeviceFrame, MasterFrameView};
use crate::payload::InputSlice;
use crate::status::Status;
use crate::tally::Fault;
use crate::timing::{BYTE_NS, TRIGGER_NS};

/// Bytes of a master frame on the wire in addition to its output bytes: preamble 2, header 2, CRC 1, time stamp 2.
const WIRE_BYTES: u32 = 7;
/// Longest time between two polls of a device during start-up, in ns.
const START_UP_POLL_NS: u32 = 1_000_000;
/// Maximum number of cycles closed in one call.
const AT_ONCE: u8 = 64;
/// The address used for the master in an error.
const MASTER: u8 = 0;

/// A cycle that has ended; `lost` if its data are missing although the device was running.
struct Closed {
    cycle: u64,
    lost: bool,
}

impl Device {
    /// Enters the exchange after the last SYNC frame: the first cycle begins 10 us after that frame was sent.
    pub(super) fn enter_exchange(&mut self) {
        let (Some(first_ns), Some(delay_ns)) = (self.first_cycle_ns(), self.way_ns) else { return };
        let told = self.parameters().map(|parameters| parameters.cycle_time_ns);
        let bytes = u32::from(self.output_len()).saturating_add(WIRE_BYTES);
        self.raster = Some(Raster::new(&Plan {
            first_ns,
            cycle_ns: self.config.cycle_ns.or(told).unwrap_or_default(),
            delay_ns,
            frame_ns: bytes.saturating_mul(BYTE_NS),
            hand_over_ns: self.config.hand_over_ns,
            sends_ns: self.send_time_ns(),
            lead_ns: self.config.lead_ns,
        }));
    }

    fn output_len(&self) -> u16 {
        self.config.output_len.or(self.output_total).unwrap_or_default()
    }

    /// Returns what to do now. Call it again at once after any action but [`Action::Wait`], and after each frame heard.
    ///
    /// `counter_ns` is the device's counter; `now_ns` is a free-running clock for the time-outs.
    pub fn poll(&mut self, counter_ns: u32, now_ns: u64) -> Action {
        let state = self.state();
        if matches!(state, State::Idle | State::Diag | State::Error) {
            return Action::Wait { until_ns: counter_ns.wrapping_add(START_UP_POLL_NS) };
        }
        let waited = now_ns.saturating_sub(self.alive_ns);
        let (State::Exchange, Some(raster)) = (state, &mut self.raster) else {
            return if waited > self.config.start_up_timeout_ns {
                self.restart();
                Action::Restart
            } else {
                Action::Wait { until_ns: counter_ns.wrapping_add(START_UP_POLL_NS) }
            };
        };
        // Until the first frame, and when nobody has asked for longer than the counter can tell.
        let cycles =
            u64::from(raster.cycle_ns()).saturating_mul(u64::from(self.config.missed_frames).saturating_add(2));
        if waited > self.config.start_up_timeout_ns.max(cycles) {
            self.restart();
            return Action::Restart;
        }
        for _ in 0..AT_ONCE {
            let Some(raster) = &mut self.raster else { break };
            return match raster.next(counter_ns) {
                Due::Nothing { until_ns } => Action::Wait { until_ns },
                Due::Begin(start) => Action::CycleStart { cycle: start.number, start_ns: start.ns },
                Due::Send(at) => Action::Send { cycle: at.number, at_ns: at.ns },
                Due::Close => match self.close_cycle() {
                    None => Action::Restart,
                    Some(Closed { cycle, lost: true }) => Action::Lost { cycle },
                    Some(_) => continue,
                },
            };
        }
        Action::Wait { until_ns: counter_ns }
    }

    /// Closes the awaited cycle. `None` if the device has waited for too many frames and starts again.
    fn close_cycle(&mut self) -> Option<Closed> {
        let raster = self.raster.as_mut()?;
        let (cycle, received, good, running) = (raster.awaited().number, raster.received, raster.good, raster.running);
        raster.close();
        if running {
            self.missed = if received { 0 } else { self.missed.saturating_add(1) };
            if !received {
                self.counters.master.add(Fault::Missed);
                self.error = true;
            }
        }
        if self.missed > self.config.missed_frames {
            self.restart();
            return None;
        }
        Some(Closed { cycle, lost: running && !good })
    }

    /// Takes a frame of the IO exchange from the port that faces the master; frames at the other port just pass through. A
    /// frame belongs to this cycle, and is accepted, only if its checks are right, it began at the expected time, and its time
    /// stamp is that of this cycle. Each cycle has one such frame.
    ///
    /// # Errors
    /// As [`MasterFrameView::parse`] and [`MasterFrameView::slice`]; [`Error::OutsideWindow`], [`Error::CycleOver`],
    /// [`Error::ImplausibleTimeStamp`] and [`Error::Doubled`], which [`Counters::master`](super::Counters::master) counts.
    /// The device's next frame reports each of these with ERROR. [`Error::WrongState`] if the device is not in IO exchange.
    pub fn hear_exchange<'a>(&mut self, frame: &'a [u8], times: FrameTimes) -> Result<Output<'a>, Error> {
        let (State::Exchange, Some(place), Some(delay_ns), Some(_)) =
            (self.state(), self.assignment, self.way_ns, self.raster)
        else {
            return Err(Error::WrongState);
        };
        let taken = MasterFrameView::parse(self.output_len().into(), frame)
            .and_then(|view| Ok((view, view.slice(place.out_offset, self.config.lengths.output)?)));
        let port = self.reverse_port().other();
        self.count(port, taken.map(|_| ()));
        // Whatever is wrong with it, its data are lost.
        self.error |= taken.is_err();
        let in_time = self.arrive(times, taken.ok().map(|(view, _)| view));
        let (view, data) = taken?;
        if let Err(error) = in_time {
            self.error = true;
            return Err(error);
        }
        let Some(raster) = &mut self.raster else { return Err(Error::WrongState) };
        raster.good = true;
        raster.run();
        let (cycle, trigger_ns) = (raster.awaited().number, raster.trigger_ns());
        let correction = self.clock.frame(raster.expected_ns(), times.sof_ns, times.counter_ns);
        Ok(Output { data, cycle, trigger_ns, reference_ns: view.reference_ns(delay_ns), correction })
    }

    /// Finds the cycle of a frame by its time, and by its time stamp, which nothing else checks. `view` is `None` for a damaged
    /// frame, of which only the time can be judged.
    fn arrive(&mut self, times: FrameTimes, view: Option<MasterFrameView<'_>>) -> Result<(), Error> {
        let Some(raster) = &mut self.raster else { return Err(Error::WrongState) };
        let (ahead, off_ns) = raster.place(times.sof_ns);
        let stamp = view.map(MasterFrameView::time_stamp);
        let window = self.config.window_ns;
        let tally = &mut self.counters.master;
        if off_ns.unsigned_abs() > window.into() {
            // Held up on its way: of this cycle, or of one before?
            let trigger = low(raster.trigger_ns());
            if let Some(stamp) = stamp {
                tally.add(if near(stamp, trigger, window) { Fault::Late } else { Fault::Stale });
            }
            return Err(Error::OutsideWindow { off_ns });
        }
        if ahead < 0 {
            if stamp.is_some() {
                tally.add(Fault::Stale);
            }
            return Err(Error::CycleOver);
        }
        // What is there is taken before the clock is asked: the cycles between have had none.
        for _ in 0..ahead.unsigned_abs().min(u32::from(u8::MAX)) {
            if self.close_cycle().is_none() {
                return Err(Error::WrongState);
            }
        }
        let Some(raster) = &mut self.raster else { return Err(Error::WrongState) };
        if raster.place(times.sof_ns).0 != 0 {
            return Err(Error::CycleOver);
        }
        let (trigger, doubled) = (low(raster.trigger_ns()), raster.good);
        raster.received = true;
        self.alive_ns = times.now_ns;
        let tally = &mut self.counters.master;
        match stamp {
            Some(got) if !near(got, trigger, window) => {
                tally.add(Fault::Stale);
                Err(Error::ImplausibleTimeStamp { got, want: trigger })
            }
            Some(_) if doubled => {
                tally.add(Fault::Doubled);
                Err(Error::Doubled { address: MASTER })
            }
            // Nothing more is known of a damaged one.
            _ => Ok(()),
        }
    }

    /// Number of cycles since the last frame.
    pub const fn missed_frames(&self) -> u8 {
        self.missed
    }

    /// Makes the next STATUS byte that the device writes carry ERROR, as after a wrong checksum: for firmware that does not
    /// know where its axis is, see [`follow`](crate::follow).
    pub const fn flag_error(&mut self) {
        self.error = true;
    }

    /// Returns the device's frame of the IO exchange for an [`Action::Send`]; each error is reported in one frame only.
    /// `None` before the first master frame of the exchange: on a long line the answer to the last SYNC is still on its way.
    pub fn answer<const P: usize>(&mut self, payload: [u8; P]) -> Option<DeviceFrame<P>> {
        let (State::Exchange, Some(place)) = (self.state(), self.assignment) else { return None };
        if !self.raster?.running {
            return None;
        }
        let status = Status::of_device(self.is_last(), core::mem::take(&mut self.error));
        Some(DeviceFrame { address: place.address, status, payload })
    }

    /// Returns the frame with the payload of the published application: STATUS of the driver, and the steps ordered, see
    /// [`Follower::ordered`](crate::follow::Follower::ordered). A position that the device does not know must not look
    /// like one: it is sent as 0, with ERROR. Otherwise as [`answer`](Self::answer).
    pub fn answer_ordered(
        &mut self,
        driver: drv8711::Status,
        ordered: Option<u16>,
    ) -> Option<DeviceFrame<{ InputSlice::LEN }>> {
        let mut answer = self.answer(InputSlice { driver, ordered: ordered.unwrap_or_default() }.emit())?;
        if ordered.is_none() {
            answer.status |= Status::ERROR;
        }
        Some(answer)
    }

    /// When to send the device's own frame, in ns of its cycle, as [`Config::slots`](super::Config::slots) says; `None`
    /// without an address, or if that would be before the cycle.
    pub fn send_time_ns(&self) -> Option<u32> {
        let address: DeviceAddress = self.assignment?.address;
        let at_ns = self.config.slots.send_ns(address, self.delay_ns().unwrap_or_default());
        u32::try_from(at_ns).ok()
    }

    /// The device's counter at the start of the first cycle of the IO exchange, in the common time: the master begins it 10
    /// us after the trigger of its last SYNC frame, and triggers the first frame 500 ns later.
    pub fn first_cycle_ns(&self) -> Option<u32> {
        let (sync, delay_ns) = (self.last_sync?.sync, self.way_ns?);
        Some(sync.trigger_ns(delay_ns).wrapping_add(10_000))
    }
}

/// Returns the low half of a time, as time stamps of the exchange carry it.
const fn low(ns: u32) -> u16 {
    let [low, high, ..] = ns.to_le_bytes();
    u16::from_le_bytes([low, high])
}

fn near(stamp: u16, trigger: u16, window_ns: u16) -> bool {
    stamp.wrapping_sub(trigger).min(trigger.wrapping_sub(stamp)) <= window_ns
}

const _: () = assert!(TRIGGER_NS == 500);
