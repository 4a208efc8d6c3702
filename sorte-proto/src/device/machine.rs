//! The state machine: what a device learns from the frames that pass.

use super::config::{Config, Counters};
use super::heard::{FrameTimes, HeardSync, Path, PortId, Reaction};
use super::passage::Passage;
use super::port::{Port, PortFlags, State, Trigger};
use super::raster::Raster;
use crate::clock::{Clock, Correction};
use crate::cut_through::{Passed, Rewriter};
use crate::delay_req::DelayReq;
use crate::discovery::Assignment;
use crate::error::Error;
use crate::frame::LongFrame;
use crate::frame_type::FrameType;
use crate::line_delay::LineDelay;
use crate::link::Link;
use crate::param::Parameters;
use crate::place::Place;
use crate::status::Status;

/// A device with two ports.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Device {
    pub(super) config: Config,
    pub(super) a: Port,
    pub(super) b: Port,
    pub(super) counters: Counters,
    /// Bits to add to the next STATUS byte that the device writes.
    pub(super) error: bool,
    pub(super) assignment: Option<Assignment>,
    pub(super) output_total: Option<u16>,
    parameters: Option<[u8; Parameters::LEN]>,
    line: LineDelay,
    pub(super) clock: Clock,
    pub(super) last_sync: Option<HeardSync>,
    /// Delay from the master in ns.
    pub(super) way_ns: Option<u32>,
    /// The cycles of the IO exchange, while the device is in it.
    pub(super) raster: Option<Raster>,
    pub(super) missed: u8,
    /// When the last frame of the present state came.
    pub(super) alive_ns: u64,
}

impl Device {
    /// Creates a device without links.
    pub const fn new(config: Config) -> Self {
        const PORT: Port = Port { state: State::Idle, flags: PortFlags::empty() };
        Self {
            config,
            a: PORT,
            b: PORT,
            counters: Counters::ZERO,
            error: false,
            assignment: None,
            output_total: None,
            parameters: None,
            line: LineDelay::new(config.delay_model),
            clock: Clock::averaging(config.clock_average),
            last_sync: None,
            way_ns: None,
            raster: None,
            missed: 0,
            alive_ns: 0,
        }
    }

    /// The counters.
    pub const fn counters(&self) -> Counters {
        self.counters
    }

    /// Returns the handler of a port.
    pub const fn port(&self, port: PortId) -> &Port {
        match port {
            PortId::A => &self.a,
            PortId::B => &self.b,
        }
    }

    pub(super) const fn port_mut(&mut self, port: PortId) -> &mut Port {
        match port {
            PortId::A => &mut self.a,
            PortId::B => &mut self.b,
        }
    }

    /// The port that faces the master, once it is known.
    pub const fn master_port(&self) -> Option<PortId> {
        if self.a.flags.contains(PortFlags::MASTER_PORT) {
            Some(PortId::A)
        } else if self.b.flags.contains(PortFlags::MASTER_PORT) {
            Some(PortId::B)
        } else {
            None
        }
    }

    /// The port that does not face the master; B while it is not known which one does.
    pub(super) fn reverse_port(&self) -> PortId {
        self.master_port().map_or(PortId::B, PortId::other)
    }

    /// State of the port that faces the master.
    pub fn state(&self) -> State {
        self.master_port().map_or(State::Idle, |port| self.port(port).state)
    }

    /// Returns whether only one port is linked.
    pub const fn is_last(&self) -> bool {
        self.a.flags.contains(PortFlags::LAST_DEVICE) || self.b.flags.contains(PortFlags::LAST_DEVICE)
    }

    /// Whether the host has taken it out of service.
    fn is_out(&self) -> bool {
        self.a.state == State::Error
    }

    /// Address and offsets, from the last DISCOVERY.
    pub const fn assignment(&self) -> Option<Assignment> {
        self.assignment
    }

    /// The parameters that the master sent to all devices.
    pub fn parameters(&self) -> Option<Parameters> {
        self.parameters.as_ref().map(Parameters::parse)
    }

    /// The line to the next device in ns, once it is measured; 0 for a last device.
    ///
    /// # Errors
    /// [`Error::ImplausibleRoundTrip`], which carries 0 ns if round trips are missing.
    pub const fn line_delay_next_ns(&self) -> Result<u16, Error> {
        if self.is_last() {
            return Ok(0);
        }
        if self.line.is_complete() { self.line.measured() } else { Err(Error::ImplausibleRoundTrip { rtt_ns: 0 }) }
    }

    /// The SYNC frame heard last.
    pub const fn last_sync(&self) -> Option<HeardSync> {
        self.last_sync
    }

    /// The device's counter at the start of the first cycle of the IO exchange, as the published device sets it: 10 us
    /// after the last SYNC frame.
    pub fn cycle_zero_ns(&self) -> Option<u32> {
        self.last_sync.map(|last| last.sof_ns.wrapping_add(10_000))
    }

    /// Delay from the master in ns, from the last SYNC frame; beyond 65,535 ns only if the master announces the period of its
    /// SYNC frames, see [`Sync::long_delay_ns`](crate::Sync::long_delay_ns).
    pub fn delay_ns(&self) -> Option<u32> {
        let HeardSync { sync, .. } = self.last_sync?;
        // PARAM: a period of its own, in ticks of 5 ns.
        let ticks = self.parameters().map(|parameters| parameters.sync_cycle).filter(|ticks| *ticks > 1000);
        let long = ticks.and_then(|ticks| sync.long_delay_ns(ticks.saturating_mul(5)));
        Some(long.unwrap_or(sync.delay_ns.into()))
    }

    /// Takes the new state of both links. With one link the device is the last one, and that port faces the master. A
    /// device that loses the link to the master starts again.
    pub fn set_links(&mut self, a: Link, b: Link) {
        let master_lost = match self.master_port() {
            Some(PortId::A) => a == Link::Down,
            Some(PortId::B) => b == Link::Down,
            None => false,
        };
        if master_lost && !self.is_out() {
            self.restart();
        }
        let only = match (a, b) {
            (Link::Up, Link::Down) => Some(PortId::A),
            (Link::Down, Link::Up) => Some(PortId::B),
            _ => None,
        };
        for port in [PortId::A, PortId::B] {
            let handler = self.port_mut(port);
            handler.flags.remove(PortFlags::LAST_DEVICE);
            if only == Some(port) {
                handler.flags |= PortFlags::LAST_DEVICE | PortFlags::MASTER_PORT;
            } else if handler.state == State::Idle {
                handler.flags = PortFlags::empty();
            }
        }
    }

    /// Goes back to IDLE: address, clock and line delay are forgotten.
    pub(super) fn restart(&mut self) {
        let last_device = |port: Port| {
            let last = port.flags.contains(PortFlags::LAST_DEVICE);
            if last { PortFlags::LAST_DEVICE | PortFlags::MASTER_PORT } else { PortFlags::empty() }
        };
        let (a, b) = (last_device(self.a), last_device(self.b));
        let retrains = self.counters.retrains.saturating_add(1);
        let counters = Counters { retrains, ..self.counters };
        *self = Self { counters, error: self.error, ..Self::new(self.config) };
        (self.a.flags, self.b.flags) = (a, b);
    }

    /// Begins a start-up frame at `port`. Pass its bytes through the [`Passage`], then hand that to
    /// [`hear_passed`](Self::hear_passed).
    pub fn passage(&self, port: PortId) -> Passage {
        let handler = self.port(port);
        let master = handler.flags.contains(PortFlags::MASTER_PORT);
        let idle_last = handler.state == State::Idle && handler.flags.contains(PortFlags::LAST_DEVICE);
        let rewriter = match (handler.state, self.line_delay_next_ns()) {
            _ if idle_last => self.discovery(),
            (State::Discovery, _) if master => self.discovery(),
            // It may be sent again.
            (State::Param, _) if master && self.is_patient() => self.discovery(),
            (State::Sync, Ok(line)) if master => Rewriter::sync(line, self.adds()),
            _ => Rewriter::unchanged(),
        };
        Passage::new(rewriter, self.path(port), handler.state, idle_last)
    }

    /// Returns the bits that the device sets in a STATUS byte written now.
    const fn adds(&self) -> Status {
        Status::of_device(self.is_last(), self.error)
    }

    /// DISCOVERY may still be repeated, see [`Config::patient_discovery`](super::Config::patient_discovery).
    const fn is_patient(&self) -> bool {
        self.config.patient_discovery && self.parameters.is_none()
    }

    const fn discovery(&self) -> Rewriter {
        Rewriter::discovery(self.config.lengths, self.adds())
    }

    /// Takes a start-up frame whose bytes went through a [`passage`](Self::passage) and which has ended at `port`.
    pub fn hear_passed(&mut self, port: PortId, passage: Passage, times: FrameTimes) -> Reaction {
        let state = self.port(port).state;
        let (path, rewriter) = (passage.path().unwrap_or(Path::Absorb), passage.rewriter);
        let mut reaction = Reaction { path, result: Ok(()), trigger: Trigger::None, correction: Correction::None };
        if state != passage.began_in {
            // The device has started again meanwhile.
            reaction.result = Err(Error::WrongState);
            return reaction;
        }
        if matches!(state, State::Exchange | State::Diag | State::Error) {
            return reaction;
        }
        // A STATUS byte has been written, so the error has been reported.
        self.error &= !rewriter.has_written_status();
        let learnt = rewriter.finish();
        reaction.result = learnt.map(|_| ());
        self.count(port, reaction.result);
        let Ok(learnt) = learnt else { return reaction };
        let head = rewriter.transit().head();
        reaction.trigger = self.port_mut(port).head(head).trigger;
        if self.port(port.other()).flags.contains(PortFlags::MASTER_PORT) {
            // What a neighbour sends back without LAST.
            self.port_mut(port).flags.remove(PortFlags::MASTER_PORT);
        }
        let master = self.port(port).flags.contains(PortFlags::MASTER_PORT);
        let repeated = self.is_patient() && state == State::Param && State::Discovery.waits_for(head);
        if master && (state.waits_for(head) || repeated) {
            self.alive_ns = times.now_ns;
        }
        match learnt {
            Passed::Discovery { assignment, .. } => self.assignment = Some(assignment),
            Passed::Sync(sync) => {
                self.last_sync = Some(HeardSync { sync, sof_ns: times.sof_ns });
                self.way_ns = self.delay_ns();
                reaction.correction = self.clock.frame(sync.time_stamp_ns, times.sof_ns, times.counter_ns);
            }
            Passed::Param(bytes) if master && state == State::Param => {
                self.parameters = Some(bytes);
                self.line = LineDelay::new(self.config.delay_model);
            }
            Passed::Param(_) | Passed::Unchanged(_) => {}
        }
        if self.is_last() || rewriter.transit().status().contains(Status::LAST) {
            self.output_total = rewriter.output_total().or(self.output_total);
        }
        self.port_mut(port).end_of_frame();
        if master && state == State::Sync && self.port(port).state == State::Exchange {
            self.enter_exchange();
        }
        // A device that cannot rewrite SYNC must not take part: its line delay was never measured.
        let unmeasured = master && state == State::Sync && rewriter.transit().is_for_all(FrameType::Sync);
        if let (true, Err(error)) = (unmeasured, self.line_delay_next_ns()) {
            reaction.result = Err(error);
            self.restart();
        }
        reaction
    }

    /// Takes a whole start-up frame heard at `port` and rewrites it for forwarding.
    pub fn hear(&mut self, port: PortId, frame: &mut [u8], times: FrameTimes) -> Reaction {
        let mut passage = self.passage(port);
        for byte in frame.iter_mut() {
            *byte = passage.byte(*byte);
        }
        self.hear_passed(port, passage, times)
    }

    pub(super) fn count(&mut self, port: PortId, result: Result<(), Error>) {
        self.counters.count(port, result);
        self.error |= matches!(result, Err(Error::BadFcs { .. } | Error::BadCrc8 { .. }));
    }

    fn path(&self, port: PortId) -> Path {
        let handler = self.port(port);
        let master = handler.flags.contains(PortFlags::MASTER_PORT);
        match handler.state {
            State::LineDelay if master => Path::Reflect,
            State::LineDelay => Path::Absorb,
            State::Exchange if self.is_last() => Path::Absorb,
            _ if self.is_last() => Path::Reflect,
            _ => Path::Forward,
        }
    }

    /// Returns the delay request to send for a trigger.
    pub const fn delay_request(trigger: Trigger) -> Option<DelayReq> {
        match trigger {
            Trigger::None => None,
            Trigger::Normal => Some(DelayReq::of_device(Place::Inner)),
            Trigger::Last => Some(DelayReq::of_device(Place::Last)),
        }
    }

    /// Takes the device's own request, started by `trigger`, which has come back to the reverse port after `rtt_ns`.
    ///
    /// # Errors
    /// As [`LongFrame::parse`] and [`DelayReq::of`]; the round trip is then not used.
    pub fn hear_reflection(&mut self, trigger: Trigger, frame: &[u8], rtt_ns: u32) -> Result<(), Error> {
        let result = LongFrame::parse(frame).and_then(|frame| match frame.frame_type() {
            // Defined by the vendor, and sent by nobody: it tells nothing.
            FrameType::DelayResp => Ok(false),
            _ => DelayReq::of(frame).map(|_| true),
        });
        let port = self.reverse_port();
        self.count(port, result.map(|_| ()));
        if !result? {
            return Ok(());
        }
        self.line.add(rtt_ns);
        if trigger == Trigger::Last && self.master_port().is_some() {
            self.port_mut(port).enter(State::Sync);
            self.port_mut(port).end_of_frame();
        }
        Ok(())
    }
}
