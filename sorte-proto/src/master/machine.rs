//! The state machine: what the master sends, and when.

use super::action::{Action, Outgoing};
use super::config::{Config, Counters, State};
use super::cycle::{Cycle, Cycles, Tallies};
use crate::delay_req::DelayReq;
use crate::discovery::{MAX_DEVICES, Network};
use crate::error::Error;
use crate::exchange::write;
use crate::frame_type::FrameType;
use crate::line_delay::{LineDelay, SAMPLES};
use crate::link::Link;
use crate::param::{Param, Parameters};
use crate::place::Place;
use crate::preamble::Preamble;
use crate::status::Status;
use crate::sync::Sync;
use crate::tally::{Fault, Tally};
use crate::timing::TRIGGER_NS;

/// Time from the last SYNC frame to the first frame of the exchange, as in the published master: 10 us to cycle 0, plus 500 ns.
const SYNC_TO_EXCHANGE_NS: u64 = 10_500;
/// Number of answers to DISCOVERY that must report the same line before the last frame is sent: devices take part from the
/// second onwards.
pub(super) const AGREED: u8 = 2;
/// When the answer to the last SYNC frame is first checked.
const LOOK_NS: u64 = 5000;

/// A master with one port.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Master {
    pub(super) config: Config,
    pub(super) state: State,
    pub(super) link: Link,
    pub(super) enabled: bool,
    pub(super) counters: Counters,
    pub(super) network: Network,
    pub(super) line: LineDelay,
    /// Number of the next frame of this phase, and its time.
    pub(super) frame: u16,
    pub(super) next_ns: u64,
    /// PARAM: answers still needed, and frames without an answer.
    pub(super) remaining: u16,
    pub(super) unanswered: u16,
    /// When the start of the start-up frame sent last was captured.
    pub(super) sent_ns: u64,
    /// PARAM, LINE_DELAY: its answer is still to come.
    pub(super) asking: bool,
    /// DISCOVERY, SYNC: the answer that is needed has come.
    pub(super) answered: bool,
    /// Patient DISCOVERY: answers in a row that reported the same line.
    pub(super) agreed: u8,
    /// SYNC: time stamp of the frame sent last.
    pub(super) sync_stamp_ns: u32,
    /// The instant at which the master's time is 0.
    pub(super) epoch_ns: u64,
    pub(super) pending: Option<Error>,
    /// Why the axes are being stopped, and the number of cycles left for it.
    pub(super) stopping: Option<(Error, u32)>,
    pub(super) failures: u16,
    pub(super) good_cycles: u16,
    pub(super) cycles: Cycles,
    pub(super) tallies: Tallies,
}

impl Master {
    /// Creates an enabled master in IDLE, without a link.
    pub const fn new(config: Config) -> Self {
        Self {
            config,
            state: State::Idle,
            link: Link::Down,
            enabled: true,
            counters: Counters {
                cycles: 0,
                crc_errors: 0,
                timing_errors: 0,
                format_errors: 0,
                device_errors: 0,
                retrains: 0,
                skipped_cycles: 0,
                frames: Tally::ZERO,
            },
            network: Network::EMPTY,
            line: LineDelay::new(config.delay_model),
            frame: 0,
            next_ns: 0,
            remaining: 0,
            unanswered: 0,
            sent_ns: 0,
            asking: false,
            answered: false,
            agreed: 0,
            sync_stamp_ns: 0,
            epoch_ns: 0,
            pending: None,
            stopping: None,
            failures: 0,
            good_cycles: 0,
            cycles: Cycles::NEW,
            tallies: [Tally::ZERO; MAX_DEVICES],
        }
    }

    /// State.
    pub const fn state(&self) -> State {
        self.state
    }

    /// Returns the counters.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// The line as reported by the last DISCOVERY answer.
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// Round trips to the first device.
    pub const fn line_delay(&self) -> &LineDelay {
        &self.line
    }

    /// The instant at which the master's time, which SYNC distributes to the devices, is 0.
    pub const fn epoch_ns(&self) -> u64 {
        self.epoch_ns
    }

    /// Returns what became of the frames of the device `address` since the master was created; `None` for 0 and 255.
    pub fn tally(&self, address: u8) -> Option<Tally> {
        self.tallies.get(usize::from(address).checked_sub(1)?).copied()
    }

    /// Number of output bytes of the master frame.
    pub fn output_len(&self) -> u16 {
        self.network.output_total().max(self.config.min_output_len)
    }

    /// Takes the new state of the link. Losing it ends any start-up or exchange.
    pub fn set_link(&mut self, link: Link) {
        if link == Link::Down && !matches!(self.state, State::Idle | State::Error) {
            self.fail(Error::LinkDown);
        }
        self.link = link;
    }

    /// Sets the enable bit, which is set initially.
    pub const fn enable(&mut self) {
        self.enabled = true;
    }

    /// Clears the enable bit: any start-up or exchange ends.
    pub const fn disable(&mut self) {
        (self.state, self.failures, self.stopping, self.enabled) = (State::Idle, 0, None, false);
    }

    /// Goes back to IDLE; [`poll`](Self::poll) reports why.
    pub(super) fn fail(&mut self, error: Error) {
        self.failures = self.failures.saturating_add(1);
        let most = self.config.max_failures;
        self.state = if most != 0 && self.failures >= most { State::Error } else { State::Idle };
        self.counters.retrains = self.counters.retrains.saturating_add(1);
        (self.pending, self.stopping, self.good_cycles) = (Some(error), None, 0);
    }

    /// Ends the IO exchange; the axes may come to rest first.
    pub(super) fn give_up(&mut self, error: Error) {
        match (self.config.stop_cycles, self.stopping) {
            (0, _) => self.fail(error),
            (cycles, None) => self.stopping = Some((error, cycles)),
            (_, Some(_)) => {}
        }
    }

    /// Reports that all axes are at rest after an [`Action::Exchange`] with `stop`: the master now restarts.
    pub fn halted(&mut self) {
        if let Some((error, _)) = self.stopping {
            self.fail(error);
        }
    }

    /// Returns what to do now. Call it again at once after any action but [`Action::Wait`], and when something has come.
    ///
    /// No time in an action is in the past: a master that is polled too late skips cycles but keeps to their raster. A frame is
    /// returned [`Config::lead_ns`] before its time.
    pub fn poll(&mut self, now_ns: u64) -> Action {
        let lead_ns = u64::from(self.config.lead_ns);
        match self.plan(now_ns.saturating_add(lead_ns)) {
            Action::Wait { until_ns } if until_ns != u64::MAX => {
                Action::Wait { until_ns: until_ns.saturating_sub(lead_ns) }
            }
            action => action,
        }
    }

    /// Returns what to do for a frame that can be sent at `now_ns` or later.
    fn plan(&mut self, now_ns: u64) -> Action {
        if let Some(error) = self.pending.take() {
            self.next_ns = now_ns.saturating_add(self.config.restart_pause_ns);
            return Action::Restart { error };
        }
        if self.state == State::Idle {
            if self.link == Link::Down || !self.enabled {
                return Action::Wait { until_ns: u64::MAX };
            }
            if now_ns >= self.next_ns {
                self.enter(State::Discovery, now_ns);
            }
        }
        if self.state == State::LineDelay && self.asking {
            return self.await_answer(now_ns, FrameType::DelayReq);
        }
        if now_ns < self.next_ns {
            return Action::Wait { until_ns: self.next_ns };
        }
        match self.state {
            State::Idle => Action::Wait { until_ns: self.next_ns },
            State::Error => Action::Wait { until_ns: u64::MAX },
            State::Discovery => self.discovery(now_ns),
            State::Param => self.param(now_ns),
            State::LineDelay => self.delay(now_ns),
            State::Sync => self.sync(now_ns),
            State::Exchange => self.exchange(now_ns),
        }
    }

    /// Reports that the request returned last began at `sof_ns`, as captured by the port. Round trips are measured from there.
    /// If a port does not report it, they are measured from the point at which a request triggered on time would have been
    /// captured.
    pub const fn sent(&mut self, sof_ns: u64) {
        if matches!(self.state, State::LineDelay) && self.asking {
            self.sent_ns = sof_ns;
        }
    }

    fn enter(&mut self, state: State, now_ns: u64) {
        self.state = state;
        self.frame = 0;
        self.next_ns = now_ns;
        self.answered = false;
        match state {
            State::Discovery => (self.network, self.agreed) = (Network::EMPTY, 0),
            State::Param => (self.remaining, self.unanswered) = (self.config.param_frames, 0),
            State::LineDelay => (self.line, self.asking) = (LineDelay::new(self.config.delay_model), false),
            State::Sync => {
                self.epoch_ns = now_ns;
                self.next_ns = now_ns.saturating_add(TRIGGER_NS.into());
            }
            // What SYNC has measured stays.
            State::Exchange => {
                let Cycles { end_ns, hop_ns, .. } = self.cycles;
                self.cycles = Cycles { end_ns, hop_ns, ..Cycles::NEW };
            }
            State::Idle | State::Error => {}
        }
    }

    /// Sends one start-up frame at `next_ns`, or now if that has passed, and sets the time of the next one.
    fn send(&mut self, now_ns: u64, frame: Outgoing, period_ns: u64) -> Action {
        let at_ns = self.next_ns.max(now_ns);
        self.frame = self.frame.saturating_add(1);
        self.sent_ns = at_ns.saturating_add(frame.preamble().capture_ns().into());
        self.asking = true;
        self.next_ns = at_ns.saturating_add(period_ns);
        Action::Send { at_ns, frame }
    }

    const fn place(&self, frames: u16) -> Place {
        Place::of(self.frame, frames)
    }

    fn discovery(&mut self, now_ns: u64) -> Action {
        let (patient, frames) = (self.config.patient_discovery, self.config.discovery_frames);
        // The patient one: until the last has come back whole, and not for ever.
        let more =
            if patient { !self.answered && self.frame < self.config.discovery_tries } else { self.frame < frames };
        if more {
            let place = match patient {
                true if self.agreed >= AGREED => Place::Last,
                true => Place::Inner,
                false => self.place(frames),
            };
            return self.send(now_ns, Outgoing::Discovery { place }, self.config.frame_period_ns);
        }
        let (got, want) = (self.network.devices(), self.config.min_devices.max(1));
        if !self.answered {
            self.fail(Error::NoAnswer { sent: FrameType::Discovery, frame: self.frame.saturating_sub(1) });
        } else if got < want {
            self.fail(Error::TooFewDevices { got, want });
        } else {
            self.enter(State::Param, now_ns);
        }
        self.plan(now_ns)
    }

    fn param(&mut self, now_ns: u64) -> Action {
        if self.remaining == 0 {
            self.enter(State::LineDelay, now_ns);
        } else if self.unanswered < self.config.param_tries {
            self.unanswered = self.unanswered.saturating_add(1);
            let place = if self.remaining == 1 { Place::Last } else { Place::Inner };
            let frame = Param::request(self.parameters(), place);
            return self.send(now_ns, Outgoing::Param(frame), self.config.frame_period_ns);
        } else {
            self.fail(Error::NoAnswer { sent: FrameType::Param, frame: self.frame.saturating_sub(1) });
        }
        self.plan(now_ns)
    }

    /// The parameters sent to the devices; on a long line they include the period of the SYNC frames in ticks of 5 ns.
    const fn parameters(&self) -> Parameters {
        let told = self.config.parameters;
        if self.config.long_line { Parameters { sync_cycle: self.config.sync_period_ns / 5, ..told } } else { told }
    }

    fn delay(&mut self, now_ns: u64) -> Action {
        if !self.line.is_complete() {
            let request = Outgoing::DelayReq(DelayReq::of_master(self.place(SAMPLES.into())));
            return self.send(now_ns, request, self.config.frame_period_ns);
        }
        match self.line.measured() {
            Ok(_) => self.enter(State::Sync, now_ns),
            Err(error) => self.fail(error),
        }
        self.plan(now_ns)
    }

    /// Waits for the answer to the frame sent last.
    fn await_answer(&mut self, now_ns: u64, sent: FrameType) -> Action {
        let until_ns = self.sent_ns.saturating_add(self.config.answer_timeout_ns);
        if now_ns < until_ns {
            return Action::Wait { until_ns };
        }
        self.fail(Error::NoAnswer { sent, frame: self.frame.saturating_sub(1) });
        self.plan(now_ns)
    }

    /// Advances to the first point of the raster of `period_ns` that has not passed; returns how many points have passed.
    fn catch_up(&mut self, now_ns: u64, period_ns: u32) -> u64 {
        let period = u64::from(period_ns.max(1));
        let late = now_ns.saturating_sub(self.next_ns).div_ceil(period);
        self.next_ns = self.next_ns.saturating_add(late.saturating_mul(period));
        late
    }

    fn sync(&mut self, now_ns: u64) -> Action {
        let frames = self.config.sync_frames;
        if self.frame < frames {
            self.catch_up(now_ns, self.config.sync_period_ns);
            let (line, place) = (self.line.measured().unwrap_or_default(), self.place(frames));
            let frame = Sync::of_master(self.time_ns(self.next_ns), line, place);
            self.sync_stamp_ns = frame.time_stamp_ns;
            let gap = if place == Place::Last { LOOK_NS } else { self.config.sync_period_ns.into() };
            return self.send(now_ns, Outgoing::Sync(frame), gap);
        }
        if !self.answered {
            // A long line takes longer.
            return self.await_answer(now_ns, FrameType::Sync);
        }
        let capture_ns = u64::from(Preamble::Middle.capture_ns());
        self.enter(State::Exchange, self.sent_ns.saturating_sub(capture_ns).saturating_add(SYNC_TO_EXCHANGE_NS));
        self.catch_up(now_ns, self.config.cycle_ns);
        self.plan(now_ns)
    }

    /// The master's time, modulo 2^32.
    fn time_ns(&self, at_ns: u64) -> u32 {
        let [a, b, c, d, ..] = at_ns.wrapping_sub(self.epoch_ns).to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }

    fn exchange(&mut self, now_ns: u64) -> Action {
        if let Err(error) = self.close_cycles(now_ns) {
            self.give_up(error);
        }
        match &mut self.stopping {
            Some((error, 0)) => {
                let error = *error;
                self.fail(error);
            }
            Some((_, left)) => *left = left.saturating_sub(1),
            None => {}
        }
        if self.state != State::Exchange {
            return self.plan(now_ns);
        }
        let skipped = self.catch_up(now_ns, self.config.cycle_ns);
        self.counters.skipped_cycles = self.counters.skipped_cycles.saturating_add(skipped);
        let (at_ns, cycle) = (self.next_ns, self.counters.cycles);
        self.counters.cycles = cycle.saturating_add(1);
        self.next_ns = at_ns.saturating_add(self.config.cycle_ns.into());
        self.cycles.first.get_or_insert(cycle);
        self.cycles.present = Some(Cycle::new(cycle, at_ns));
        let [low, high, ..] = self.time_ns(at_ns).to_le_bytes();
        Action::Exchange { at_ns, time_stamp: u16::from_le_bytes([low, high]), cycle, stop: self.stopping.is_some() }
    }

    /// The next cycle is about to begin: the frames of the previous one have all come, or are on their way if the host asks
    /// early. Those of the cycle before that can no longer come.
    fn close_cycles(&mut self, now_ns: u64) -> Result<(), Error> {
        let asked_ns = now_ns.saturating_sub(self.config.lead_ns.into());
        let mut result = Ok(());
        if let Some(before) = self.cycles.before.take() {
            result = self.close(&before);
        }
        match self.cycles.present.take() {
            Some(present) if asked_ns >= present.trigger_ns.saturating_add(self.cycles.end_ns.into()) => {
                result.and(self.close(&present))
            }
            present => {
                self.cycles.before = present;
                result
            }
        }
    }

    /// Closes a cycle and counts the devices that have not answered.
    fn close(&mut self, cycle: &Cycle) -> Result<(), Error> {
        let devices = self.network.devices();
        let first = self.cycles.first == Some(cycle.number);
        let missing = if first { 0 } else { u32::from(devices).saturating_sub(cycle.count()) };
        let (silent, damaged) = (missing > 0, cycle.damaged);
        let run = |bad: bool, before: u8| if bad { before.saturating_add(1) } else { 0 };
        let Cycles { damaged_in_a_row, silent_in_a_row, .. } = self.cycles;
        let (damaged_in_a_row, silent_in_a_row) = (run(damaged, damaged_in_a_row), run(silent, silent_in_a_row));
        (self.cycles.damaged_in_a_row, self.cycles.silent_in_a_row) = (damaged_in_a_row, silent_in_a_row);
        self.cycles.fault = silent || damaged || cycle.disorderly;
        self.good_cycles = if silent || damaged { 0 } else { self.good_cycles.saturating_add(1) };
        if self.good_cycles >= 1000 {
            self.failures = 0;
        }
        if silent {
            self.counters.timing_errors = self.counters.timing_errors.saturating_add(1);
            self.counters.frames.missed = self.counters.frames.missed.saturating_add(missing);
            for (_, tally) in (1..=devices).zip(&mut self.tallies).filter(|(address, _)| !cycle.has(*address)) {
                tally.add(Fault::Missed);
            }
        }
        let limit = self.config.retrain_crc_errors;
        if limit != 0 && damaged_in_a_row >= limit {
            return Err(Error::TooManyCrcErrors { cycles: damaged_in_a_row });
        }
        let limit = self.config.retrain_timing_errors;
        if limit != 0 && silent_in_a_row >= limit {
            let first = (1..=devices).find(|address| !cycle.has(*address)).unwrap_or_default();
            let count = u8::try_from(missing).unwrap_or(u8::MAX);
            return Err(Error::DevicesMissing { first, count, cycles: silent_in_a_row });
        }
        Ok(())
    }

    /// Writes the master frame for an [`Action::Exchange`] and returns its length. Its STATUS has ERROR if the last closed
    /// cycle had a device frame that was damaged or missing, or that came twice or at the wrong time. This is an addition
    /// of this crate; published devices ignore it.
    ///
    /// # Errors
    /// [`Error::OutputLength`] if `output` does not have [`output_len`](Self::output_len) bytes; [`Error::BufferTooSmall`].
    pub fn emit_into(&self, output: &[u8], time_stamp: u16, into: &mut [u8]) -> Result<usize, Error> {
        let (got, want) = (u16::try_from(output.len()).unwrap_or(u16::MAX), self.output_len());
        if got != want {
            return Err(Error::OutputLength { got, want });
        }
        let status = if self.cycles.fault { Status::EXCHANGE.union(Status::ERROR) } else { Status::EXCHANGE };
        write(status, output, time_stamp, into)
    }
}
