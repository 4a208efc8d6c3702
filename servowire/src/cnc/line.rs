//! Master, cables and devices: the start-up, frame by frame.

use std::collections::VecDeque;

use sorte_proto::Link;
use sorte_proto::device::{self, Device, FrameTimes, Path, PortId, Reaction, State, Trigger};
use sorte_proto::master::{Action, Config, Master, Outgoing};
use sorte_proto::timing::{BYTE_NS, CNC_CYCLE_NS, Timing};
use sorte_proto::{DelayModel, Discovery, Parameters, TRANSIT_NS};

use super::axis::Build;
use super::clock::Clock;
use super::driver::Fault;
use super::host::Host;
use super::node::Node;
use super::noise::{Noise, SplitMix64};
use super::periods::Periods;
use super::record::Recorder;

/// From the end of the request to its reflection as the master and as a device see it.
const MASTER_REFLECTION_NS: f64 = 320.0;
const DEVICE_REFLECTION_NS: f64 = 360.0;
/// From the trigger of a SYNC frame to the capture of its start.
const CAPTURE_NS: f64 = 280.0;
/// From the capture to the correction of the counter.
const HANDLER_NS: f64 = 700.0;
/// Devices that a cycle of 4 us has room for: the published send times are theirs.
const PUBLISHED: usize = 4;
/// Lines for the user that are kept; the rest is counted.
const EVENTS: usize = 50;

/// What the machine is built of.
#[derive(Debug, Clone)]
pub(super) struct Setup {
    pub(super) cables_ns: Vec<u16>,
    /// Cycle of the IO exchange; `None`: the shortest that the line fits.
    pub(super) cycle_ns: Option<u32>,
    pub(super) build: Build,
    /// Crystals are up to so wrong, and gain up to so much in a second.
    pub(super) crystal_ppm: f64,
    pub(super) drift_ppm: f64,
    /// Captures of a frame's start are up to so wrong, in ns.
    pub(super) jitter_ns: f64,
    /// The way back over a cable takes so much longer than the way out, in ns.
    pub(super) asymmetry_ns: f64,
    pub(super) bit_error_rate: f64,
    /// The cable in front of this device (from 1) is pulled in this cycle.
    pub(super) unplug: Option<(usize, u64)>,
    /// This happens to the driver of this device (from 1) in this cycle.
    pub(super) driver_fault: Option<(usize, u64, Fault)>,
    /// Positions travel in the command words.
    pub(super) positions: bool,
    pub(super) max_lag: u16,
    pub(super) seed: u64,
}

impl Setup {
    /// The line as the time plan sees it.
    pub(super) fn timing(&self) -> Timing<'_> {
        let devices = self.cables_ns.len();
        let output_len = (devices * 4).max(16) as u16;
        Timing { line_delays_ns: &self.cables_ns, devices: devices as u8, output_len, payload_len: 3 }
    }

    /// Cycle of the IO exchange: whole periods of the generator, with room for clocks that are 2 ns a device off.
    pub(super) fn cycle_ns(&self) -> u32 {
        let needs = self.timing().budget().min_cycle_ns() + 2 * self.cables_ns.len() as u32;
        self.cycle_ns.unwrap_or(needs.div_ceil(CNC_CYCLE_NS) * CNC_CYCLE_NS)
    }

    /// Whether the delay field of SYNC is too short, so that this project's extension is needed.
    pub(super) fn is_long(&self) -> bool {
        let way: u64 = self.cables_ns.iter().map(|ns| u64::from(*ns) + u64::from(TRANSIT_NS)).sum();
        way > u64::from(u16::MAX)
    }

    fn master(&self) -> Config {
        let cycle_time_ns = self.cycle_ns();
        Config::new()
            .with_cycle_ns(cycle_time_ns)
            .with_parameters(Parameters { cycle_time_ns, ..Parameters::CNC })
            .with_long_line(self.is_long())
            .with_stop_cycles(25_000)
            .with_max_failures(20)
    }

    fn device(&self) -> device::Config {
        let timing = self.timing();
        let config = device::Config::new().with_output_len(Some(timing.output_len));
        if self.cables_ns.len() <= PUBLISHED && self.cycle_ns() == 4000 {
            return config;
        }
        // In a long line what the published measurement loses in each hop would add up to microseconds, and in a long cycle
        // sixteen frames are far apart.
        let frames = (64_000 / self.cycle_ns()).clamp(1, 16) as u8;
        config
            .with_clock_average(frames)
            .with_slot_ns(Some(timing.slot_ns()))
            .with_delay_model(DelayModel { shift_samples: false, ..DelayModel::DEVICE })
    }
}

pub(super) struct Line {
    pub(super) setup: Setup,
    pub(super) master: Master,
    pub(super) nodes: Vec<Node>,
    pub(super) periods: Periods,
    pub(super) noise: Noise,
    pub(super) random: SplitMix64,
    /// Devices that a cable leads to.
    pub(super) plugged: usize,
    pub(super) now_ns: u64,
    /// Start-up frames sent, by kind: DISCOVERY, PARAM, DELAY_REQ, SYNC.
    pub(super) sent: [u64; 4],
    /// When the first cycle began.
    pub(super) first_cycle_ns: Option<u64>,
    /// Device frames that ran into the one before, and those that came after the end of their cycle.
    pub(super) collisions: u64,
    pub(super) overruns: u64,
    /// Shortest gap between two device frames at the master, in ns.
    pub(super) gap_ns: f64,
    /// Lines for the user: what went wrong, and when; and how many there were.
    pub(super) events: Vec<String>,
    pub(super) event_count: u64,
    /// Start-up frames on their way back: when they begin and end at the master.
    returning: VecDeque<(f64, f64, Vec<u8>)>,
    /// A master frame as it is sent and as it travels.
    pub(super) buffers: [Vec<u8>; 2],
    pub(super) output: Vec<u8>,
}

/// What a call of [`Line::step`] has done.
pub(super) enum Progress {
    StartUp,
    Cycle,
}

impl Line {
    pub(super) fn new(setup: Setup) -> Self {
        let mut random = SplitMix64(setup.seed);
        let config = setup.device();
        let mut either = |most: f64| (random.unit() - 0.5) * 2.0 * most;
        let mut nodes = Vec::new();
        for _ in &setup.cables_ns {
            let clock = Clock::new(2e9 + either(2e9), either(setup.crystal_ppm), either(setup.drift_ppm));
            nodes.push(Node::new(config, setup.build, clock, setup.max_lag));
        }
        let mut line = Self {
            master: Master::new(setup.master()),
            periods: Periods::new(),
            noise: Noise::new(setup.bit_error_rate, setup.seed ^ 0x5eed),
            random,
            plugged: 0,
            now_ns: 0,
            sent: [0; 4],
            first_cycle_ns: None,
            collisions: 0,
            overruns: 0,
            gap_ns: f64::INFINITY,
            events: Vec::new(),
            event_count: 0,
            returning: VecDeque::new(),
            buffers: [Vec::new(), Vec::new()],
            output: Vec::new(),
            nodes,
            setup,
        };
        line.master.set_link(Link::Up);
        for (device, node) in (1..).zip(&mut line.nodes) {
            // A driver without supply from the beginning does not take its registers either.
            if let Some((_, _, fault)) =
                line.setup.driver_fault.filter(|(faulty, when, _)| (*faulty, *when) == (device, 0))
            {
                node.axis.driver.hit(fault);
            }
            node.set_up = node.axis.driver.set_up();
        }
        line.plug(line.nodes.len());
        line
    }

    pub(super) fn plug(&mut self, devices: usize) {
        self.plugged = devices;
        for (k, node) in self.nodes.iter_mut().enumerate() {
            let link = |there| if there { Link::Up } else { Link::Down };
            node.device.set_links(link(k < devices), link(k + 1 < devices));
        }
        if devices == 0 {
            self.master.set_link(Link::Down);
        }
    }

    pub(super) fn event(&mut self, text: String) {
        self.event_count += 1;
        if self.events.len() < EVENTS {
            self.events.push(text);
        }
    }

    pub(super) fn cable(&self, k: usize) -> f64 {
        self.setup.cables_ns.get(k).copied().unwrap_or_default().into()
    }

    /// The same cable on the way to the master.
    pub(super) fn cable_back(&self, k: usize) -> f64 {
        self.cable(k) + self.setup.asymmetry_ns
    }

    /// Error of a capture.
    pub(super) fn jitter(&mut self) -> f64 {
        if self.setup.jitter_ns == 0.0 { 0.0 } else { (self.random.unit() - 0.5) * 2.0 * self.setup.jitter_ns }
    }

    /// Goes on until something has been sent; `None`: the master waits for ever.
    pub(super) fn step(&mut self, host: &mut Host, record: &mut Recorder) -> Option<Progress> {
        loop {
            match self.master.poll(self.now_ns) {
                Action::Wait { until_ns } if self.hear(until_ns) => {}
                Action::Wait { until_ns: u64::MAX } => return None,
                Action::Wait { until_ns } => self.wait(until_ns),
                Action::Send { at_ns, frame } => {
                    self.start_up(frame, at_ns, record);
                    return Some(Progress::StartUp);
                }
                Action::Exchange { at_ns, time_stamp, cycle, stop } => {
                    self.first_cycle_ns.get_or_insert(at_ns);
                    host.plan(stop, &self.nodes);
                    self.cycle(at_ns, time_stamp, cycle, host.words(), record);
                    if stop && host.is_still() {
                        self.master.halted();
                    }
                    return Some(Progress::Cycle);
                }
                Action::Restart { error } => {
                    let cycles = self.master.counters().cycles;
                    self.event(format!("cycle {cycles}: {error}; the master starts again"));
                    host.restarted();
                }
            }
        }
    }

    /// Time passes; devices that wait for a frame in vain give up.
    fn wait(&mut self, until_ns: u64) {
        let cycle_ns = u64::from(self.setup.cycle_ns());
        // The first of them begins when its frame is sent, or not at all.
        let cycles = (until_ns.saturating_sub(self.now_ns) / cycle_ns).saturating_sub(1);
        self.now_ns = until_ns;
        for node in &mut self.nodes {
            if node.device.state() != State::Exchange {
                node.device.poll(until_ns);
            }
            for _ in 0..cycles.min(8) {
                if node.device.state() == State::Exchange {
                    node.device.cycle_start();
                }
            }
            node.leave(cycle_ns, &mut self.periods);
        }
    }

    /// The next start-up frame that has come back by `until_ns`, if there is one.
    fn hear(&mut self, until_ns: u64) -> bool {
        let due = self.returning.front().is_some_and(|(_, end, _)| *end <= until_ns as f64);
        if !due {
            return false;
        }
        let Some((sof, end, answer)) = self.returning.pop_front() else { return false };
        self.now_ns = self.now_ns.max(end as u64);
        // What the master refuses, it counts.
        let _: Result<_, _> = self.master.hear(&answer, sof as u64);
        true
    }

    fn start_up(&mut self, frame: Outgoing, at_ns: u64, record: &mut Recorder) {
        let kind = match frame {
            Outgoing::Discovery { .. } => 0,
            Outgoing::Param(_) => 1,
            Outgoing::DelayReq(_) => 2,
            Outgoing::Sync(_) => 3,
        };
        if let Some(sent) = self.sent.get_mut(kind) {
            *sent += 1;
        }
        let mut buffer = [0; Discovery::LEN];
        let len = frame.emit_into(&mut buffer).unwrap_or_default();
        let bytes = buffer.get(..len).unwrap_or_default();
        record.start_up(at_ns, frame.preamble(), bytes, false);
        if let Some((answer, sof)) = self.carry(bytes, at_ns as f64) {
            let sof_ns = sof as u64;
            record.start_up(sof_ns, frame.preamble(), &answer, true);
            let captured = (sof + self.jitter()).max(at_ns as f64);
            let end = sof + answer.len() as f64 * f64::from(BYTE_NS);
            self.returning.push_back((captured, end, answer));
        }
    }

    /// A start-up frame goes to the end of the line and comes back.
    fn carry(&mut self, frame: &[u8], at_ns: f64) -> Option<(Vec<u8>, f64)> {
        let mut frame = frame.to_vec();
        let mut sof_ns = at_ns;
        for k in 0..self.plugged {
            sof_ns += self.cable(k);
            self.noise.pass(&mut frame);
            let reaction = self.pass(k, PortId::A, &mut frame, sof_ns)?;
            self.measure(k, reaction.trigger, sof_ns);
            match reaction.path {
                Path::Forward => sof_ns += f64::from(TRANSIT_NS),
                Path::Absorb => return None,
                Path::Reflect => {
                    sof_ns += MASTER_REFLECTION_NS;
                    return self.carry_back(k, frame, sof_ns);
                }
            }
        }
        None
    }

    fn carry_back(&mut self, from: usize, mut frame: Vec<u8>, mut sof_ns: f64) -> Option<(Vec<u8>, f64)> {
        for k in (0..from).rev() {
            sof_ns += self.cable_back(k + 1);
            self.noise.pass(&mut frame);
            if self.pass(k, PortId::B, &mut frame, sof_ns)?.path != Path::Forward {
                return None;
            }
            sof_ns += f64::from(TRANSIT_NS);
        }
        self.noise.pass(&mut frame);
        Some((frame, sof_ns + self.cable_back(0)))
    }

    fn pass(&mut self, k: usize, port: PortId, frame: &mut [u8], sof_ns: f64) -> Option<Reaction> {
        let jitter = self.jitter();
        let node = self.nodes.get_mut(k)?;
        let captured = sof_ns + CAPTURE_NS;
        let times = FrameTimes {
            sof_ns: node.clock.read(captured + jitter),
            counter_ns: node.clock.read(captured + HANDLER_NS),
            now_ns: sof_ns as u64,
        };
        let reaction = node.device.hear(port, frame, times);
        node.clock.correct(reaction.correction, captured + HANDLER_NS);
        Some(reaction)
    }

    /// Device k measures the line to the next one, which then does the same.
    fn measure(&mut self, k: usize, trigger: Trigger, at_ns: f64) {
        let (Some(request), true) = (Device::delay_request(trigger), k + 1 < self.plugged) else { return };
        let mut frame = request.emit();
        let (out, back) = (self.cable(k + 1), self.cable_back(k + 1));
        self.noise.pass(&mut frame);
        let Some(reaction) = self.pass(k + 1, PortId::A, &mut frame, at_ns + out) else { return };
        self.measure(k + 1, reaction.trigger, at_ns);
        if reaction.path != Path::Reflect {
            return;
        }
        self.noise.pass(&mut frame);
        let jitter = self.jitter();
        if let Some(node) = self.nodes.get_mut(k) {
            // Both captures are on the 5 ns grid, so the measured time varies by a tick.
            let sent = node.clock.read(at_ns);
            let rtt = node.clock.read(at_ns + out + back + DEVICE_REFLECTION_NS + jitter).wrapping_sub(sent);
            let _: Result<_, _> = node.device.hear_reflection(trigger, &frame, rtt);
        }
    }
}

#[cfg(test)]
mod tests {
    use sorte_proto::sync0::Variant;
    use step_profile::{Motors, Parameters as Ramp, Profile, Speed};

    use super::super::power::Power;
    use super::super::program::Program;
    use super::*;

    /// A cycle without a frame counts once; the device gives up with the sixth.
    #[test]
    fn a_device_waits_for_five_missing_frames() {
        for (cycles, missed, state) in [(1, 0, State::Exchange), (2, 1, State::Exchange), (6, 5, State::Exchange)] {
            let mut line = running();
            line.wait(line.now_ns + cycles * 4000);
            let device = &line.nodes[1].device;
            assert_eq!((device.missed_frames(), device.state()), (missed, state), "{cycles} cycles");
        }
        let mut line = running();
        line.wait(line.now_ns + 7 * 4000);
        assert_ne!(line.nodes[1].device.state(), State::Exchange);
    }

    /// Two devices that have had a hundred frames.
    fn running() -> Line {
        let build = Build { variant: Variant::Lossless, latency_ns: 300, write_ns: 20, tolerance_ns: 100.0 };
        let mut line = Line::new(Setup {
            cables_ns: vec![85; 2],
            cycle_ns: None,
            build,
            crystal_ppm: 50.0,
            drift_ppm: 0.0,
            jitter_ns: 0.0,
            asymmetry_ns: 0.0,
            bit_error_rate: 0.0,
            unplug: None,
            driver_fault: None,
            positions: true,
            max_lag: 128,
            seed: 1,
        });
        let ramp = Profile::new(Ramp::at(Speed::KHZ_100)).unwrap();
        let program = Program::turns(Motors::new(3).unwrap(), vec![ramp], 50_000, 1);
        let mut host = Host::new(Power::new(program, 2, None, 4000), 2, None, 128);
        let mut record = Recorder::new(2, None, None, 0).unwrap();
        let mut cycles = 0;
        while cycles < 100 {
            cycles += u64::from(matches!(line.step(&mut host, &mut record).unwrap(), Progress::Cycle));
            assert_eq!(line.nodes[1].device.missed_frames(), 0);
        }
        line
    }
}
