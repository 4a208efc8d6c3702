//! Master, cables and devices, frame by frame.

use sorte_proto::device::{self, Arrival, Device, Handled, Path, PortId, State, Trigger};
use sorte_proto::master::{Action, Config, Master, Outgoing};
use sorte_proto::sync0::Variant;
use sorte_proto::{Correction, DeviceFrame, Discovery, Error, MasterFrameView, Pto, Slice, TRANSIT_NS};

use super::axis::Axis;
use super::noise::{Noise, SplitMix64};
use super::record::Recorder;

/// From the end of the request to its reflection as the master and as a device see it.
const MASTER_REFLECTION_NS: u64 = 320;
const DEVICE_REFLECTION_NS: u64 = 360;
/// From the trigger of a SYNC frame to the capture of its start.
const CAPTURE_NS: u64 = 280;
/// From the capture to the correction of the counter, and until that takes effect.
const HANDLER_NS: u64 = 700;
const WRITE_NS: u64 = 135;

/// What the machine is built of.
#[derive(Debug, Clone)]
pub(super) struct Setup {
    /// In front of each device, in ns.
    pub(super) cables_ns: Vec<u16>,
    pub(super) variant: Variant,
    pub(super) latency_ns: u16,
    pub(super) bit_error_rate: f64,
    /// The cable in front of this device (from 1) is pulled in this cycle.
    pub(super) unplug: Option<(usize, u64)>,
    pub(super) seed: u64,
}

/// A counter of 5 ns ticks on its own crystal.
#[derive(Debug, Clone, Copy)]
struct Counter {
    /// How far it is ahead of the simulation's time, in ns, at `at_ns`.
    ahead: f64,
    at_ns: u64,
    /// Parts per billion.
    drift_ppb: f64,
}

impl Counter {
    fn ahead_at(&self, ns: u64) -> f64 {
        self.ahead + (ns as f64 - self.at_ns as f64) * self.drift_ppb * 1e-9
    }

    /// What the register reads.
    fn read(&self, ns: u64) -> u32 {
        let ticks = ((ns as f64 + self.ahead_at(ns)) / 5.0).floor();
        (ticks as i64 * 5) as u32
    }

    fn correct(&mut self, correction: Correction, ns: u64) {
        let step = match correction {
            Correction::None => return,
            Correction::Set { counter_ns } => {
                (self.ahead, self.at_ns) = (f64::from(counter_ns) - (ns + WRITE_NS) as f64, ns);
                return;
            }
            Correction::Rate { increment, ticks } => f64::from(ticks) * (f64::from(increment) - 5.0),
        };
        (self.ahead, self.at_ns) = (self.ahead_at(ns) + step, ns);
    }
}

/// A device with its axis.
pub(super) struct Node {
    pub(super) device: Device,
    pub(super) axis: Axis,
    counter: Counter,
    /// The word for the next cycle, if a good frame has brought one.
    word: Option<Pto>,
    in_exchange: bool,
    /// Largest clock error in the IO exchange, in ns.
    pub(super) clock_error_ns: f64,
    /// Frames that were accepted although a bit of what the CRC-8 covers was wrong.
    pub(super) undetected: u64,
    /// Frames accepted with a wrong time stamp, which nothing covers.
    pub(super) bad_stamps: u64,
}

pub(super) struct Line {
    setup: Setup,
    pub(super) master: Master,
    pub(super) nodes: Vec<Node>,
    pub(super) noise: Noise,
    /// Devices that a cable leads to.
    plugged: usize,
    now_ns: u64,
    /// Start-up frames sent, by kind: DISCOVERY, PARAM, DELAY_REQ, SYNC.
    pub(super) sent: [u64; 4],
    /// When the first cycle began.
    pub(super) first_cycle_ns: Option<u64>,
    /// Lines for the user: what went wrong, and when.
    pub(super) events: Vec<String>,
}

/// What a call of [`Line::step`] has done.
pub(super) enum Progress {
    StartUp,
    Cycle,
}

impl Line {
    pub(super) fn new(setup: Setup) -> Self {
        let mut random = SplitMix64(setup.seed);
        let config = device::Config::default();
        let node = |_| Node {
            device: Device::new(config),
            axis: Axis::new(setup.variant, setup.latency_ns),
            counter: Counter {
                ahead: random.unit() * 4e9,
                at_ns: 0,
                // Crystals of 50 ppm.
                drift_ppb: (random.unit() - 0.5) * 100_000.0,
            },
            word: None,
            in_exchange: false,
            clock_error_ns: 0.0,
            undetected: 0,
            bad_stamps: 0,
        };
        let nodes: Vec<Node> = setup.cables_ns.iter().map(node).collect();
        let mut line = Self {
            master: Master::new(Config::default()),
            noise: Noise::new(setup.bit_error_rate, setup.seed ^ 0x5eed),
            plugged: 0,
            now_ns: 0,
            sent: [0; 4],
            first_cycle_ns: None,
            events: Vec::new(),
            nodes,
            setup,
        };
        line.master.link(true);
        line.plug(line.nodes.len());
        line
    }

    fn plug(&mut self, devices: usize) {
        self.plugged = devices;
        for (k, node) in self.nodes.iter_mut().enumerate() {
            node.device.links(k < devices, k + 1 < devices);
        }
        if devices == 0 {
            self.master.link(false);
        }
    }

    fn cable(&self, k: usize) -> u64 {
        self.setup.cables_ns.get(k).copied().unwrap_or_default().into()
    }

    /// Goes on until something has been sent. `words`: gives what the axes are to do in the next cycle.
    pub(super) fn step(&mut self, words: &mut dyn FnMut() -> [Pto; 4], record: &mut Recorder) -> Option<Progress> {
        loop {
            match self.master.poll(self.now_ns) {
                Action::Wait { until_ns: u64::MAX } => return None,
                Action::Wait { until_ns } => self.wait(until_ns),
                Action::Send { at_ns, frame } => {
                    self.start_up(frame, at_ns, record);
                    return Some(Progress::StartUp);
                }
                Action::Exchange { at_ns, time_stamp, cycle, .. } => {
                    self.first_cycle_ns.get_or_insert(at_ns);
                    self.cycle(at_ns, time_stamp, cycle, words(), record);
                    return Some(Progress::Cycle);
                }
                Action::Restart { error } => {
                    let cycles = self.master.counters().cycles;
                    self.events.push(format!("cycle {cycles}: {error}; the master starts again"));
                }
            }
        }
    }

    /// Time passes; devices that wait for a frame in vain give up.
    fn wait(&mut self, until_ns: u64) {
        let cycles = until_ns.saturating_sub(self.now_ns) / 4000;
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
            if node.in_exchange && node.device.state() != State::Exchange {
                node.in_exchange = false;
                node.axis.restart(self.setup.variant);
            }
        }
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
        if let Some((answer, sof_ns)) = self.carry(bytes, at_ns) {
            record.start_up(sof_ns, frame.preamble(), &answer, true);
            // What the master refuses, it counts.
            let _: Result<_, _> = self.master.receive(&answer, sof_ns);
        }
    }

    /// A start-up frame goes to the end of the line and comes back.
    fn carry(&mut self, frame: &[u8], at_ns: u64) -> Option<(Vec<u8>, u64)> {
        let mut frame = frame.to_vec();
        let mut sof_ns = at_ns;
        for k in 0..self.plugged {
            sof_ns += self.cable(k);
            self.noise.pass(&mut frame);
            let handled = self.pass(k, PortId::A, &mut frame, sof_ns)?;
            self.measure(k, handled.trigger, sof_ns);
            match handled.path {
                Path::Forward => sof_ns += u64::from(TRANSIT_NS),
                Path::Absorb => return None,
                Path::Reflect => {
                    sof_ns += MASTER_REFLECTION_NS;
                    return self.carry_back(k, frame, sof_ns);
                }
            }
        }
        None
    }

    fn carry_back(&mut self, from: usize, mut frame: Vec<u8>, mut sof_ns: u64) -> Option<(Vec<u8>, u64)> {
        for k in (0..from).rev() {
            sof_ns += self.cable(k + 1);
            self.noise.pass(&mut frame);
            if self.pass(k, PortId::B, &mut frame, sof_ns)?.path != Path::Forward {
                return None;
            }
            sof_ns += u64::from(TRANSIT_NS);
        }
        self.noise.pass(&mut frame);
        Some((frame, sof_ns + self.cable(0)))
    }

    fn pass(&mut self, k: usize, port: PortId, frame: &mut [u8], sof_ns: u64) -> Option<Handled> {
        let node = self.nodes.get_mut(k)?;
        let captured = sof_ns + CAPTURE_NS;
        let arrival = Arrival {
            sof_ns: node.counter.read(captured),
            counter_ns: node.counter.read(captured + HANDLER_NS),
            now_ns: sof_ns,
        };
        let handled = node.device.frame(port, frame, arrival);
        node.counter.correct(handled.correction, captured + HANDLER_NS);
        Some(handled)
    }

    /// Device k measures the line to the next one, which then does the same.
    fn measure(&mut self, k: usize, trigger: Trigger, at_ns: u64) {
        let (Some(request), true) = (Device::delay_request(trigger), k + 1 < self.plugged) else { return };
        let mut frame = request.emit();
        let cable = self.cable(k + 1);
        self.noise.pass(&mut frame);
        let Some(handled) = self.pass(k + 1, PortId::A, &mut frame, at_ns + cable) else { return };
        self.measure(k + 1, handled.trigger, at_ns);
        if handled.path != Path::Reflect {
            return;
        }
        self.noise.pass(&mut frame);
        if let Some(node) = self.nodes.get_mut(k) {
            // Both captures are on the 5 ns grid, so the measured time varies by a tick.
            let sent = node.counter.read(at_ns);
            let rtt = node.counter.read(at_ns + 2 * cable + DEVICE_REFLECTION_NS).wrapping_sub(sent);
            let _: Result<_, _> = node.device.delay_reflection(trigger, &frame, rtt);
        }
    }

    /// One cycle of the IO exchange.
    fn cycle(&mut self, at_ns: u64, time_stamp: u16, cycle: u64, words: [Pto; 4], record: &mut Recorder) {
        if let Some((device, _)) = self.setup.unplug.filter(|(_, when)| *when == cycle) {
            self.events.push(format!("cycle {cycle}: the cable in front of device {device} is pulled"));
            self.plug(device - 1);
        }
        self.now_ns = at_ns;
        let begin_ns = at_ns - 500;
        let mut frame = [0; 64 + MasterFrameView::OVERHEAD];
        let mut output = [0; 64];
        for (bytes, word) in output.chunks_exact_mut(4).zip(words) {
            bytes.copy_from_slice(&Slice::from(word).emit());
        }
        let output = output.get(..usize::from(self.master.output_len())).unwrap_or_default();
        let len = self.master.write_frame(output, time_stamp, &mut frame).unwrap_or_default();
        let sent = frame;
        let (sent, frame) = (sent.get(..len).unwrap_or_default(), frame.get_mut(..len).unwrap_or_default());
        record.exchange(at_ns, sent, false);

        let master_ns = begin_ns.wrapping_sub(self.master.epoch_ns());
        let mut way_ns = 0;
        for (k, (node, word)) in self.nodes.iter_mut().zip(words).enumerate() {
            if word.start().is_some() {
                node.axis.tally.asked += 1;
            }
            // The axis takes what the frame before has brought.
            let before = node.word.take();
            if node.device.state() == State::Exchange {
                node.in_exchange = true;
                record.axis(k, begin_ns, |seen| node.axis.run_cycle(before, seen));
            }
            if k >= self.plugged {
                continue;
            }
            way_ns += u64::from(self.setup.cables_ns.get(k).copied().unwrap_or_default());
            self.noise.pass(frame);
            let sof_ns = at_ns + way_ns;
            node.receive(frame, sent, sof_ns, master_ns, sof_ns.wrapping_sub(self.master.epoch_ns()));
            way_ns += u64::from(TRANSIT_NS);
        }
        self.answers(at_ns, begin_ns, record);
        for node in &mut self.nodes {
            if node.device.state() == State::Exchange {
                node.device.cycle_start();
            } else if node.in_exchange {
                node.in_exchange = false;
                node.axis.restart(self.setup.variant);
            }
        }
    }

    /// The devices' frames travel back, each over the cables before it.
    fn answers(&mut self, at_ns: u64, begin_ns: u64, record: &mut Recorder) {
        let mut way_ns = 0;
        for k in 0..self.plugged {
            way_ns += self.cable(k) + if k > 0 { u64::from(TRANSIT_NS) } else { 0 };
            let Some(node) = self.nodes.get_mut(k) else { return };
            let (Some(answer), Some(send_ns)) = (node.device.answer([0; 3]), node.device.send_time_ns()) else {
                continue;
            };
            let mut frame = [0; DeviceFrame::<3>::LEN];
            if answer.emit_into(&mut frame).is_err() {
                continue;
            }
            for _ in 0..=k {
                self.noise.pass(&mut frame);
            }
            record.exchange(begin_ns.max(at_ns - 500) + u64::from(send_ns) + way_ns, &frame, true);
            // What the master refuses, it counts.
            let _: Result<_, Error> = self.master.device_frame(&frame).map(|_| ());
        }
    }
}

impl Node {
    /// The master frame at this device. `cycle_ns`, `sof_master_ns`: the master's time at the start of the cycle and at
    /// the start of the frame here.
    fn receive(&mut self, frame: &[u8], sent: &[u8], sof_ns: u64, cycle_ns: u64, sof_master_ns: u64) {
        let counter = self.counter.read(sof_ns);
        let in_cycle = counter.wrapping_sub(cycle_ns as u32);
        let Ok(output) = self.device.exchange(frame, in_cycle, in_cycle) else { return };
        self.word = output.data.first_chunk().map(|bytes| Slice::parse(*bytes).pto);
        self.counter.correct(output.correction, sof_ns);
        if frame != sent {
            let stamp = frame.len().saturating_sub(2);
            if frame.get(..stamp) == sent.get(..stamp) {
                self.bad_stamps += 1;
            } else {
                self.undetected += 1;
            }
        }
        let error = f64::from(counter.wrapping_sub(sof_master_ns as u32) as i32);
        self.clock_error_ns = self.clock_error_ns.max(error.abs());
    }
}
