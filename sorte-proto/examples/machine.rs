//! A master and three devices on a simulated line, from link-up to steps: what a firmware does around both state machines.
//!
//! The line is ideal: cables of 50 ns, counters that run alike. `servowire cnc` has the one that is not.
//!
//! `cargo run -p sorte-proto --example machine`

#![allow(
    clippy::arithmetic_side_effects,
    clippy::cast_possible_truncation,
    clippy::indexing_slicing,
    reason = "a simulation on a host"
)]

use sorte_proto::device::{self, Device, FrameTimes, Path, PortId, State, Trigger};
use sorte_proto::follow::{Asked, Follower};
use sorte_proto::master::{self, Action, Master};
use sorte_proto::{
    Correction, Direction, Discovery, Error, Evidence, Link, Policy, Positions, Pto, Slice, TRANSIT_NS, drv8711,
};

const CABLE_NS: u64 = 50;
const DEVICES: usize = 3;
const CYCLES: u32 = 1000;

/// A device: its port, its counter, its axis. This is the whole firmware beside the hardware's registers.
struct Node {
    device: Device,
    /// What the counter is ahead of the line's time, and the line's time at which the device is asked next.
    ahead_ns: u64,
    due_ns: u64,
    follower: Follower,
}

impl Node {
    fn times(&self, captured_ns: u64) -> FrameTimes {
        let counter = |ns: u64| (ns.wrapping_add(self.ahead_ns) & 0xffff_ffff) as u32;
        FrameTimes { sof_ns: counter(captured_ns), counter_ns: counter(captured_ns + 700), now_ns: captured_ns }
    }

    /// A start-up frame at a port.
    fn pass(&mut self, port: PortId, frame: &mut [u8], captured_ns: u64) -> device::Reaction {
        let reaction = self.device.hear(port, frame, self.times(captured_ns));
        if let Correction::Set { counter_ns } = reaction.correction {
            // The write takes effect 135 ns later.
            self.ahead_ns = u64::from(counter_ns).wrapping_sub(captured_ns + 700 + 135);
        }
        reaction
    }

    /// A master frame of the exchange: the word for the SYNC0 generator.
    fn exchange(&mut self, frame: &[u8], captured_ns: u64) -> Result<Pto, Error> {
        let output = self.device.hear_exchange(frame, self.times(captured_ns))?;
        Ok(self.follower.next(output.data.first_chunk().map(|bytes| Slice::parse(*bytes))))
    }

    /// Does what is due until then, or until a frame leaves: the frame, with its time.
    fn run(&mut self, until_ns: u64) -> Option<(u64, [u8; 6])> {
        while self.due_ns < until_ns {
            let counter_ns = self.times(self.due_ns).sof_ns;
            match self.device.poll(counter_ns, self.due_ns) {
                device::Action::Wait { until_ns } => self.due_ns += u64::from(until_ns.wrapping_sub(counter_ns).max(1)),
                device::Action::CycleStart { .. } | device::Action::Restart => {}
                device::Action::Lost { .. } => drop(self.follower.next(None)),
                device::Action::Send { at_ns, .. } => {
                    let mut bytes = [0; 6];
                    let answer = self.device.answer_ordered(drv8711::Status::default(), self.follower.ordered())?;
                    answer.emit_into(&mut bytes).ok()?;
                    return Some((self.due_ns + u64::from(at_ns.wrapping_sub(counter_ns)), bytes));
                }
            }
        }
        None
    }
}

/// Out to the last device and back; what comes to the master, and when its start is captured. `capture_ns`: from the first bit to
/// there.
fn carry(nodes: &mut [Node], frame: &[u8], at_ns: u64, capture_ns: u64) -> Option<(Vec<u8>, u64)> {
    let (mut frame, mut sof_ns) = (frame.to_vec(), at_ns + capture_ns);
    for k in 0..nodes.len() {
        sof_ns += CABLE_NS;
        let reaction = nodes.get_mut(k)?.pass(PortId::A, &mut frame, sof_ns);
        measure(nodes.get_mut(k..)?, reaction.trigger, sof_ns);
        match reaction.path {
            Path::Forward => sof_ns += u64::from(TRANSIT_NS),
            Path::Absorb => return None,
            Path::Reflect => {
                sof_ns += 320 + CABLE_NS;
                for node in nodes.get_mut(..k)?.iter_mut().rev() {
                    let _neither_corrects_nor_measures = node.pass(PortId::B, &mut frame, sof_ns);
                    sof_ns += u64::from(TRANSIT_NS) + CABLE_NS;
                }
                return Some((frame, sof_ns));
            }
        }
    }
    None
}

/// The first of `nodes` measures the cable to the second, which does the same to the third.
fn measure(nodes: &mut [Node], trigger: Trigger, at_ns: u64) {
    let (Some(request), [first, rest @ ..]) = (Device::delay_request(trigger), nodes) else { return };
    let mut frame = request.emit();
    let Some(next) = rest.first_mut() else { return };
    let reaction = next.pass(PortId::A, &mut frame, at_ns + CABLE_NS);
    measure(rest, reaction.trigger, at_ns);
    // There and back, and 360 ns in the neighbour; 15 ns are what the published rounding loses.
    let result = first.device.hear_reflection(trigger, &frame, 2 * CABLE_NS as u32 + 375);
    assert_eq!(result, Ok(()));
}

/// An axis at the master: what it was asked for, and what its device has told.
struct Axis {
    asked: Asked,
    evidence: Evidence,
    /// Pulses that its device was to make.
    pulses: u64,
}

/// One cycle at `at_ns`: the master's frame to every device, and a frame of each back. Each axis steps, the second one
/// backwards.
fn exchange(
    master: &mut Master,
    axes: &mut [Axis],
    nodes: &mut [Node],
    at_ns: u64,
    time_stamp: u16,
) -> Result<(), Error> {
    let mut output = vec![0; master.output_len().into()];
    for ((k, axis), bytes) in axes.iter_mut().enumerate().zip(output.chunks_exact_mut(4)) {
        let step = Pto::from_step(1000, if k == 1 { Direction::High } else { Direction::Low }).unwrap_or_default();
        bytes.copy_from_slice(&axis.asked.slice(step).emit());
    }
    let mut frame = [0; 64];
    let len = master.emit_into(&output, time_stamp, &mut frame)?;
    let mut way_ns = 0;
    for (node, axis) in nodes.iter_mut().zip(axes) {
        way_ns += CABLE_NS;
        // From the first bit of a preamble of two bytes to the capture of the start.
        let captured_ns = at_ns + way_ns + 120;
        let before = node.run(captured_ns);
        axis.pulses += u64::from(node.exchange(&frame[..len], captured_ns)?.start().is_some());
        if let Some((sent_ns, bytes)) = before.or(node.run(at_ns - 500 + 4000)) {
            let heard = master.hear(&bytes, sent_ns + way_ns + 120)?;
            // These devices send positions, and take them in the cycle of their frame.
            axis.evidence = heard.evidence(Positions::taken_before_ns(4000));
        }
        way_ns += u64::from(TRANSIT_NS);
    }
    Ok(())
}

/// Start-up and this many cycles of the exchange; the time of the last one.
fn run(master: &mut Master, axes: &mut [Axis], nodes: &mut [Node], mut cycles: u32) -> Result<u64, Error> {
    let mut now_ns = 0;
    while cycles > 0 {
        match master.poll(now_ns) {
            Action::Wait { until_ns } => now_ns = until_ns,
            Action::Restart { error } => return Err(error),
            Action::Send { at_ns, frame } => {
                let mut buffer = [0; Discovery::LEN];
                let len = frame.emit_into(&mut buffer)?;
                let capture_ns = frame.preamble().capture_ns().into();
                if let Some((answer, sof_ns)) = carry(nodes, &buffer[..len], at_ns, capture_ns) {
                    master.hear(&answer, sof_ns)?;
                }
                for node in nodes.iter_mut() {
                    node.due_ns = at_ns + 5000;
                }
            }
            Action::Exchange { at_ns, time_stamp, .. } => {
                exchange(master, axes, nodes, at_ns, time_stamp)?;
                now_ns = at_ns;
                cycles -= 1;
            }
        }
    }
    Ok(now_ns)
}

fn main() -> Result<(), Box<dyn core::error::Error>> {
    let mut nodes: Vec<Node> = (0..DEVICES as u64)
        .map(|k| Node {
            device: Device::new(device::Config::new()),
            ahead_ns: k * 123_456_789,
            due_ns: 0,
            follower: Follower::new(128),
        })
        .collect();
    for (k, node) in nodes.iter_mut().enumerate() {
        let next = if k + 1 < DEVICES { Link::Up } else { Link::Down };
        node.device.set_links(Link::Up, next);
    }
    let mut master = Master::new(master::Config::new());
    master.set_link(Link::Up);
    let mut axes = [(); DEVICES].map(|()| Axis { asked: Asked::new(), evidence: Evidence::NEVER, pulses: 0 });
    let end_ns = run(&mut master, &mut axes, &mut nodes, CYCLES)?;
    println!("{}; {CYCLES} cycles from {} ns of the master's time on", master.network(), end_ns - master.epoch_ns());
    println!("{}", master.counters());
    if let Some(trips) = master.line_delay().extremes() {
        println!("round trips to the first device: {} to {} ns", trips.shortest_ns, trips.longest_ns);
    }
    for (axis, node) in axes.iter().zip(&nodes) {
        show(node);
        // What control may use: of this cycle or the one before, and from a driver without a fault.
        let sample = axis.evidence.at(end_ns + 4000, Policy::new(8000))?;
        let (asked, position) = (axis.asked.asked(), axis.asked.position(sample));
        println!("  asked to {asked}, its frame of this cycle says {position}, {} steps ordered", axis.pulses);
        assert!(node.device.state() == State::Exchange && asked.abs_diff(position) <= 1);
    }
    // The host of the last device wants its motor driver off the line, and takes the device out.
    if let Some(last) = nodes.last_mut() {
        last.device.enter_error();
        println!("taken out: {}, its port: {}", last.device.state(), last.device.forwarding(PortId::A));
        last.device.reset();
        println!("and back: {}", last.device.state());
    }
    Ok(())
}

fn show(node: &Node) {
    let device = &node.device;
    let address = device.assignment().map_or(0, |place| place.address.get());
    println!("device {address}: {}", device.state());
    println!(
        "  first cycle at {:?} ns of its counter, {:?} as the published device has it",
        device.first_cycle_ns(),
        device.cycle_zero_ns()
    );
    println!("  {}", device.counters());
    let ports = [PortId::A, PortId::B].map(|port| device.forwarding(port));
    println!("  its ports: {ports:?}");
}
