//! Master, cables and devices: one queue of events, in which the start-up and the exchange share the wires.

use std::rc::Rc;

use sorte_proto::device::{Action as Wish, Device, Path, PortId, Trigger};
use sorte_proto::follow::InputSlice;
use sorte_proto::master::{Action, Heard, Master, Outgoing};
use sorte_proto::{DeviceFrame, Discovery, Link, MasterFrameView, Preamble};

use super::clock::Clock;
use super::driver::Fault;
use super::host::Host;
use super::node::{Node, Sent};
use super::noise::SplitMix64;
use super::periods::Periods;
use super::queue::{Event, Place, Queue};
use super::record::Recorder;
use super::setup::Setup;
use super::wires::{Arrival, BYTE_NS, Hit, NEIGHBOUR_NS, REFLECTION_NS, Wires, capture_ns};

/// Trigger of the master frame in its cycle.
const TRIGGER_NS: u64 = 500;
/// Preamble of the frames of the exchange.
const PREAMBLE: usize = 2;
/// Time from the end of the master frame until the device has checked it and taken its slice: 119 instructions of the
/// published receive path, and its CRC table.
const RECEIVE_NS: f64 = 800.0;
const DEVICE_FRAME: usize = DeviceFrame::<{ InputSlice::LEN }>::LEN;
/// Maximum number of messages kept for the user; further ones are only counted.
const EVENTS: usize = 50;

pub(super) struct Line {
    pub(super) setup: Setup,
    pub(super) master: Master,
    pub(super) nodes: Vec<Node>,
    periods: Periods,
    pub(super) wires: Wires,
    queue: Queue,
    now: f64,
    /// When the master needs to be polled.
    asked: f64,
    /// Number of devices that a cable leads to.
    plugged: usize,
    /// Start-up frames sent, by kind: DISCOVERY, PARAM, DELAY_REQ, SYNC.
    pub(super) sent: [u64; 4],
    /// When the first cycle began.
    pub(super) first_cycle_ns: Option<u64>,
    /// Shortest gap between two device frames at the master, in ns; and when the last one ended.
    pub(super) gap_ns: f64,
    free: f64,
    /// The reason for the master's last restart, and the device that has left the line because its line delay is implausible.
    pub(super) why: Option<String>,
    pub(super) unmeasured: Option<String>,
    /// Messages for the user on what went wrong and when; and how many there were.
    pub(super) events: Vec<String>,
    pub(super) event_count: u64,
    output: Vec<u8>,
}

/// The result of a call to [`Line::step`].
pub(super) enum Progress {
    StartUp,
    Cycle,
}

impl Line {
    pub(super) fn new(setup: Setup) -> Self {
        let mut random = SplitMix64(setup.seed);
        let config = setup.device();
        let mut nodes = Vec::new();
        for _ in &setup.cables_ns {
            let value = 2e9 + random.either(2e9);
            let clock = Clock::new(value, random.either(setup.crystal_ppm), random.either(setup.drift_ppm));
            nodes.push(Node::new(config, setup.build, clock, setup.positions, setup.max_lag));
        }
        let mut line = Self {
            master: Master::new(setup.master()),
            periods: Periods::new(),
            wires: Wires::new(&setup.cables_ns, setup.physics, setup.seed),
            queue: Queue::default(),
            now: 0.0,
            asked: 0.0,
            plugged: 0,
            sent: [0; 4],
            first_cycle_ns: None,
            gap_ns: f64::INFINITY,
            free: f64::NEG_INFINITY,
            why: None,
            unmeasured: None,
            events: Vec::new(),
            event_count: 0,
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
        line.queue.push(0.0, Event::Master);
        line
    }

    fn plug(&mut self, devices: usize) {
        self.plugged = devices;
        for (k, node) in self.nodes.iter_mut().enumerate() {
            let link = |there| if there { Link::Up } else { Link::Down };
            node.device.set_links(link(k < devices), link(k + 1 < devices));
        }
        if devices == 0 {
            self.master.set_link(Link::Down);
        }
        for k in 0..self.nodes.len() {
            self.ask(k, None);
        }
    }

    fn event(&mut self, text: String) {
        self.event_count += 1;
        if self.events.len() < EVENTS {
            self.events.push(text);
        }
    }

    /// Continues until the master has sent something; `None` if it waits for ever.
    pub(super) fn step(&mut self, host: &mut Host, record: &mut Recorder) -> Option<Progress> {
        while let Some((at, event)) = self.queue.pop() {
            self.now = at;
            match event {
                Event::Master if at < self.asked => {}
                Event::Master => match self.ask_master(host, record) {
                    Ok(Some(progress)) => return Some(progress),
                    Ok(None) => {}
                    Err(Stopped) => return None,
                },
                Event::Device { k, call } => {
                    if self.nodes.get(k).is_some_and(|node| node.call == call) {
                        self.ask(k, Some(record));
                    }
                }
                Event::StartUp { at: Place::Master { sof }, frame, preamble, hit, .. } => {
                    self.returned(frame, sof, preamble, &hit, record);
                }
                Event::StartUp { at: Place::Device(k), port, frame, preamble, hit } => {
                    self.passes(k, port, frame, preamble, hit, record);
                }
                Event::Dealt { k, arrival, sent } => self.dealt(k, &arrival, &sent, record),
                Event::Leaves { k } => self.leaves(k, record),
                Event::Answer { k, arrival, hit } => self.answer(k, &arrival, &hit),
            }
        }
        None
    }

    fn ask_master(&mut self, host: &mut Host, record: &mut Recorder) -> Result<Option<Progress>, Stopped> {
        let now_ns = self.now as u64;
        match self.master.poll(now_ns) {
            Action::Wait { until_ns: u64::MAX } => return Err(Stopped),
            Action::Wait { until_ns } => {
                self.asked = until_ns as f64;
                self.queue.push(self.asked, Event::Master);
                return Ok(None);
            }
            Action::Restart { error } => {
                let cycles = self.master.counters().cycles;
                let why = self.unmeasured.take().map_or(String::new(), |why| format!(" ({why})"));
                self.why = Some(format!("{error}{why}"));
                self.event(format!("cycle {cycles}: {error}{why}; the master starts again"));
                host.restarted();
                self.free = f64::NEG_INFINITY;
            }
            Action::Send { at_ns, frame } => {
                self.start_up(frame, at_ns, record);
                self.queue.push(self.now, Event::Master);
                return Ok(Some(Progress::StartUp));
            }
            Action::Exchange { at_ns, time_stamp, cycle, stop } => {
                self.first_cycle_ns.get_or_insert(at_ns);
                host.plan(stop, &self.nodes);
                self.cycle(at_ns, time_stamp, cycle, host, record);
                if stop && host.is_still() {
                    self.master.halted();
                }
                self.queue.push(self.now, Event::Master);
                return Ok(Some(Progress::Cycle));
            }
        }
        self.queue.push(self.now, Event::Master);
        Ok(None)
    }

    /// Does what a device needs now, and plans when to poll it again.
    fn ask(&mut self, k: usize, mut record: Option<&mut Recorder>) {
        let now = self.now;
        loop {
            let Some(node) = self.nodes.get_mut(k) else { return };
            node.leave(&mut self.periods);
            match node.poll(now) {
                Wish::Wait { until_ns } => {
                    node.call += 1;
                    let (at, call) = (node.when(until_ns, now).max(now) + 0.01, node.call);
                    return self.queue.push(at, Event::Device { k, call });
                }
                Wish::Send { at_ns, .. } => {
                    let at = node.when(at_ns, now).max(now);
                    self.queue.push(at, Event::Leaves { k });
                }
                Wish::Lost { cycle } => {
                    let axle = node.lost(cycle);
                    if let Some(record) = record.as_deref_mut() {
                        node.run(&axle, k, &mut self.periods, record);
                    }
                }
                Wish::Restart if node.is_heard() => {
                    let missed = node.device.counters().master;
                    self.event(format!("device {} starts again; master frames: {missed}", k + 1));
                }
                // A restart in the start-up: it has waited in vain, and the master says why.
                Wish::CycleStart { .. } | Wish::Restart => {}
            }
        }
    }

    /// Sends a start-up frame of the master.
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
        let bytes = buffer.get(..len).unwrap_or_default().to_vec();
        record.start_up(at_ns, frame.preamble(), &bytes, false);
        if self.plugged > 0 {
            let preamble = frame.preamble().bytes().len();
            let event =
                Event::StartUp { at: Place::Device(0), port: PortId::A, frame: bytes, preamble, hit: Hit::default() };
            self.queue.push(at_ns as f64 + self.wires.out(0), event);
        }
    }

    /// Passes a start-up frame through a device.
    fn passes(&mut self, k: usize, port: PortId, mut frame: Vec<u8>, preamble: usize, hit: Hit, record: &mut Recorder) {
        let sof = self.now;
        if k >= self.plugged {
            return;
        }
        self.wires.noise.pass(&mut frame);
        if hit.get() {
            garble(&mut frame);
        }
        let jitter = self.wires.capture_jitter();
        let Some(node) = self.nodes.get_mut(k) else { return };
        let reaction = node.start_up(port, &mut frame, sof + capture_ns(preamble), jitter);
        let unmeasured = matches!(reaction.result, Err(sorte_proto::Error::ImplausibleRoundTrip { .. }));
        if let (true, Err(error)) = (unmeasured, reaction.result) {
            self.unmeasured.get_or_insert_with(|| format!("device {}: {error}", k + 1));
        }
        self.measure(k, reaction.trigger, sof);
        self.ask(k, Some(record));
        let length = (preamble + frame.len()) as f64 * BYTE_NS;
        let up = match (reaction.path, port) {
            // A frame that came from behind would be sent back to the end of the line, where nobody waits for it.
            (Path::Absorb, _) | (Path::Reflect, PortId::B) => return,
            (Path::Forward, PortId::A) => {
                if k + 1 < self.plugged {
                    let at = sof + self.wires.transit(k) + self.wires.out(k + 1);
                    self.queue.push(at, Event::StartUp { at: Place::Device(k + 1), port, frame, preamble, hit });
                }
                return;
            }
            (Path::Forward, PortId::B) => sof + self.wires.transit(k),
            (Path::Reflect, PortId::A) => sof + REFLECTION_NS,
        };
        self.wires.occupy(k, up, up + length, &hit);
        let at = up + self.wires.back(k);
        let (at, place) = match k.checked_sub(1) {
            Some(before) => (at, Place::Device(before)),
            None => (at + length, Place::Master { sof: at }),
        };
        self.queue.push(at, Event::StartUp { at: place, port: PortId::B, frame, preamble, hit });
    }

    /// Hands a start-up frame that has come back to the master.
    fn returned(&mut self, mut frame: Vec<u8>, sof: f64, preamble: usize, hit: &Hit, record: &mut Recorder) {
        self.wires.noise.pass(&mut frame);
        if hit.get() {
            garble(&mut frame);
        }
        let form = [Preamble::Long, Preamble::Middle].into_iter().find(|form| form.bytes().len() == preamble);
        record.start_up(sof as u64, form.unwrap_or(Preamble::Short), &frame, true);
        let captured = sof + capture_ns(preamble) + self.wires.capture_jitter();
        // What the master refuses, it counts.
        let _: Result<_, _> = self.master.hear(&frame, captured.max(0.0).round() as u64);
        self.asked = self.now;
        self.queue.push(self.now, Event::Master);
    }

    /// Lets device k measure the line to the next device, which then does the same. There is nothing else on that wire.
    fn measure(&mut self, k: usize, trigger: Trigger, at_ns: f64) {
        let (Some(request), true) = (Device::delay_request(trigger), k + 1 < self.plugged) else { return };
        let mut frame = request.emit();
        let (out, back) = (self.wires.out(k + 1), self.wires.back(k + 1));
        self.wires.noise.pass(&mut frame);
        let jitter = self.wires.capture_jitter();
        let Some(next) = self.nodes.get_mut(k + 1) else { return };
        let reaction = next.start_up(PortId::A, &mut frame, at_ns + out, jitter);
        self.measure(k + 1, reaction.trigger, at_ns);
        if reaction.path != Path::Reflect {
            return;
        }
        self.wires.noise.pass(&mut frame);
        let jitter = self.wires.capture_jitter();
        if let Some(node) = self.nodes.get_mut(k) {
            // Both captures are on the 5 ns grid, so the measured time varies by a tick.
            let sent = node.clock.read(at_ns);
            let rtt = node.clock.read(at_ns + out + back + NEIGHBOUR_NS + jitter).wrapping_sub(sent);
            // A damaged one is counted and not used.
            let _: Result<_, _> = node.device.hear_reflection(trigger, &frame, rtt);
        }
    }

    /// Begins a cycle: the master sends its frame to all devices.
    fn cycle(&mut self, at_ns: u64, time_stamp: u16, cycle: u64, host: &Host, record: &mut Recorder) {
        self.incidents(cycle);
        let mut output = core::mem::take(&mut self.output);
        output.clear();
        for (node, word) in self.nodes.iter_mut().zip(host.words()) {
            output.extend(node.ask(*word).emit());
        }
        output.resize(self.master.output_len().into(), 0);
        let mut bytes = vec![0; output.len() + MasterFrameView::OVERHEAD];
        // The length is the line's.
        let _: Result<_, _> = self.master.emit_into(&output, time_stamp, &mut bytes);
        self.output = output;
        record.exchange(at_ns, &bytes, false);
        let wire_ns = (PREAMBLE + bytes.len()) as f64 * BYTE_NS;
        let sent = Rc::new(Sent { bytes: bytes.clone(), begin: (at_ns - TRIGGER_NS) as f64 });
        let arrivals = self.wires.down(self.plugged, at_ns as f64, bytes);
        let reached = arrivals.last().map_or(0, |(k, _)| k + 1);
        // Before its first frame a device does not wait for one.
        for node in self.nodes.iter_mut().skip(reached).filter(|node| node.is_heard()) {
            node.truth.lost_out += 1;
        }
        for (k, arrival) in arrivals {
            if let (true, Some(node)) = (arrival.copy, self.nodes.get_mut(k)) {
                node.truth.again_out += 1;
            }
            let at = arrival.start + wire_ns + RECEIVE_NS;
            self.queue.push(at, Event::Dealt { k, arrival, sent: Rc::clone(&sent) });
        }
    }

    fn dealt(&mut self, k: usize, arrival: &Arrival, sent: &Sent, record: &mut Recorder) {
        let (now, jitter) = (self.now, self.wires.capture_jitter());
        let Some(node) = self.nodes.get_mut(k) else { return };
        // What is due before is done before: the frame may belong to a cycle whose start was not yet asked for.
        if let Some(axle) = node.hear(arrival, sent, arrival.start + capture_ns(PREAMBLE), jitter, now) {
            node.look_at_clock(now, now - self.master.epoch_ns() as f64);
            node.run(&axle, k, &mut self.periods, record);
        }
        node.leave(&mut self.periods);
        self.ask(k, Some(record));
    }

    /// Sends a device's frame through all devices before it.
    fn leaves(&mut self, k: usize, record: &mut Recorder) {
        let now = self.now;
        if k >= self.plugged {
            return;
        }
        let Some(node) = self.nodes.get_mut(k) else { return };
        let Some(answer) = node.answer(now) else { return };
        let mut bytes = vec![0; DEVICE_FRAME];
        if answer.emit_into(&mut bytes).is_err() {
            return;
        }
        let length = (PREAMBLE + bytes.len()) as f64 * BYTE_NS;
        let (arrivals, hit) = self.wires.up(k, now, PREAMBLE, bytes);
        let [lost, again] = [arrivals.is_empty(), arrivals.len() > 1].map(u32::from);
        if let Some(node) = self.nodes.get_mut(k) {
            node.truth.lost_back += lost;
            node.truth.again_back += again;
        }
        for arrival in arrivals {
            record.exchange(arrival.start as u64, &arrival.bytes, true);
            let at = arrival.start + length;
            self.queue.push(at, Event::Answer { k, arrival, hit: Rc::clone(&hit) });
        }
    }

    fn answer(&mut self, k: usize, arrival: &Arrival, hit: &Hit) {
        let mut bytes = Rc::as_ref(&arrival.bytes).clone();
        if hit.get() {
            garble(&mut bytes);
        }
        if self.free.is_finite() && !arrival.copy {
            self.gap_ns = self.gap_ns.min(arrival.start - self.free);
        }
        self.free = self.now;
        let captured = arrival.start + capture_ns(PREAMBLE) + self.wires.capture_jitter();
        // What the master refuses, it counts.
        let Ok(Heard::Device { frame, .. }) = self.master.hear(&bytes, captured.round() as u64) else { return };
        let Some(node) = self.nodes.get_mut(k) else { return };
        node.truth.stale += u64::from(arrival.copy);
        if let Some(payload) = frame.payload().first_chunk() {
            node.reported(InputSlice::parse(*payload));
        }
    }

    /// Returns the event planned for a cycle that never came.
    pub(super) fn still_to_come(&self) -> Option<String> {
        let cycles = self.master.counters().cycles;
        let unplug = self.setup.unplug.filter(|(_, when)| *when >= cycles);
        let fault = self.setup.driver_fault.filter(|(_, when, _)| *when >= cycles);
        unplug
            .map(|(device, when)| {
                format!("cycle {when}, in which the cable in front of device {device} was to be pulled")
            })
            .or(fault
                .map(|(device, when, _)| format!("cycle {when}, in which the driver of device {device} was to fail")))
    }

    /// Performs the event planned for this cycle.
    fn incidents(&mut self, cycle: u64) {
        if let Some((device, _)) = self.setup.unplug.filter(|(_, when)| *when == cycle) {
            self.event(format!("cycle {cycle}: the cable in front of device {device} is pulled"));
            self.plug(device - 1);
        }
        let fault: Option<(usize, u64, Fault)> = self.setup.driver_fault.filter(|(_, when, _)| *when == cycle);
        if let Some((device, _, fault)) = fault {
            self.event(format!("cycle {cycle}: the driver of device {device} {fault}"));
            if let Some(node) = self.nodes.get_mut(device - 1) {
                node.axis.driver.hit(fault);
            }
        }
    }
}

/// The master waits for ever.
struct Stopped;

/// Two frames on one wire destroy each other.
fn garble(frame: &mut [u8]) {
    for byte in frame {
        *byte ^= 0x55;
    }
}
