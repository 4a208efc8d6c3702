//! A device with its clock, its axis and what the master knows about it.

use std::rc::Rc;

use sorte_proto::device::{Action, Config, Device, FrameTimes, PortId, Reaction, State};
use sorte_proto::drv8711;
use sorte_proto::follow::{Asked, Follower, InputSlice};
use sorte_proto::{DeviceFrame, Pto, Slice};

use super::axis::{Axis, Build, Incoming};
use super::clock::Clock;
use super::periods::{Generator, PERIOD, Periods};
use super::record::Recorder;
use super::wires::Arrival;

/// Time from the capture of a frame's start to the correction of the counter.
const HANDLER_NS: f64 = 700.0;
/// 2^32.
const WRAP: f64 = 4_294_967_296.0;

pub(super) struct Node {
    pub(super) device: Device,
    build: Build,
    generator: Generator,
    pub(super) axis: Axis,
    pub(super) clock: Clock,
    /// What the master has commanded, and what the device has done so far.
    pub(super) asked: Asked,
    pub(super) follower: Follower,
    /// What was commanded before this cycle's word, which is all that the device's frame of this cycle can reflect.
    before: Asked,
    /// What the device's last frame reported: missing steps, faults of the driver.
    pub(super) lag: i16,
    pub(super) status: drv8711::Status,
    /// Whether the driver accepted its registers.
    pub(super) set_up: Result<(), servowire_drivers::drv8711::Error>,
    /// Whether the command words carry positions; otherwise this is the published device, which uses the last word again.
    positions: bool,
    cycle_ns: u64,
    /// The device's counter at the start of cycle 0; `None` outside the IO exchange.
    zero: Option<f64>,
    pub(super) truth: Truth,
    heard: bool,
    /// Largest clock error in the IO exchange, in ns.
    pub(super) clock_error_ns: f64,
    /// Frames accepted although a bit covered by the CRC-8 was wrong.
    pub(super) undetected: u64,
    /// Frames accepted with a wrong time stamp, which no check covers.
    pub(super) bad_stamps: u64,
    /// Calls planned before this one are ignored.
    pub(super) call: u64,
}

/// What really happened to the frames of the exchange between the master and a device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Truth {
    /// Master frames that never reached the device, and those that arrived again.
    pub(super) lost_out: u32,
    pub(super) again_out: u32,
    /// The same of the device's frames.
    pub(super) lost_back: u32,
    pub(super) again_back: u32,
    /// Frames accepted at either end although they are repeats or belong to another cycle.
    pub(super) stale: u64,
}

/// A master frame of the exchange.
pub(super) struct Sent {
    /// The frame as the master sent it.
    pub(super) bytes: Vec<u8>,
    /// The master's time at the start of its cycle.
    pub(super) begin: f64,
}

impl Node {
    pub(super) fn new(config: Config, build: Build, clock: Clock, positions: bool, max_lag: u16) -> Self {
        Self {
            device: Device::new(config),
            build,
            generator: build.generator(),
            axis: Axis::new(build),
            clock,
            asked: Asked::new(),
            follower: Follower::new(max_lag),
            before: Asked::new(),
            lag: 0,
            status: drv8711::Status::empty(),
            set_up: Ok(()),
            positions,
            cycle_ns: PERIOD,
            zero: None,
            truth: Truth::default(),
            heard: false,
            clock_error_ns: 0.0,
            undetected: 0,
            bad_stamps: 0,
            call: 0,
        }
    }

    /// Returns what the master sends to this device for `word`.
    pub(super) fn ask(&mut self, word: Pto) -> Slice {
        self.before = self.asked;
        self.axis.tally.asked += u64::from(word.start().is_some());
        let slice = self.asked.slice(word);
        if self.positions { slice } else { Slice::from(word) }
    }

    /// Returns the counter as the device uses it.
    fn counter(&self, now: f64) -> u32 {
        self.clock.at(now).rem_euclid(WRAP) as u32
    }

    /// Returns when the counter shows a value that is near.
    pub(super) fn when(&self, counter_ns: u32, now: f64) -> f64 {
        self.clock.when(self.unwrapped(counter_ns, now))
    }

    fn unwrapped(&self, counter_ns: u32, now: f64) -> f64 {
        let value = self.clock.at(now).floor();
        value + f64::from(counter_ns.wrapping_sub(value.rem_euclid(WRAP) as u32) as i32)
    }

    /// Does what the device needs at this time.
    pub(super) fn poll(&mut self, now: f64) -> Action {
        let action = self.device.poll(self.counter(now), now as u64);
        if let (Action::CycleStart { cycle, start_ns }, None) = (action, self.zero) {
            let parameters = self.device.parameters();
            self.cycle_ns = parameters.map_or(PERIOD, |parameters| parameters.cycle_time_ns.into());
            self.zero = Some(self.unwrapped(start_ns, now) - (cycle * self.cycle_ns) as f64);
            self.axis.start();
            self.generator = self.build.generator();
        }
        action
    }

    /// Takes a start-up frame at a port; its start is captured at `captured`, with an error of `jitter`.
    pub(super) fn start_up(&mut self, port: PortId, frame: &mut [u8], captured: f64, jitter: f64) -> Reaction {
        let times = FrameTimes {
            sof_ns: self.clock.read(captured + jitter),
            counter_ns: self.clock.read(captured + HANDLER_NS),
            now_ns: captured as u64,
        };
        let reaction = self.device.hear(port, frame, times);
        self.clock.correct(reaction.correction, captured + HANDLER_NS);
        reaction
    }

    pub(super) fn is_running(&self) -> bool {
        self.zero.is_some()
    }

    /// Returns whether a master frame of this exchange has come.
    pub(super) fn is_heard(&self) -> bool {
        self.heard
    }

    /// Takes a master frame of the exchange, captured at `captured` with an error of `jitter`, and examines it now.
    pub(super) fn hear(
        &mut self,
        arrival: &Arrival,
        sent: &Sent,
        captured: f64,
        jitter: f64,
        now: f64,
    ) -> Option<Axle> {
        let zero = self.zero?;
        let times = FrameTimes {
            sof_ns: self.clock.read(captured + jitter),
            counter_ns: self.clock.read(now),
            now_ns: now as u64,
        };
        let output = self.device.hear_exchange(&arrival.bytes, times).ok()?;
        let (cycle, slice) = (output.cycle, output.data.first_chunk().map(|bytes| Slice::parse(*bytes)));
        self.clock.correct(output.correction, now);
        self.judge(arrival, sent);
        self.heard = true;
        // Which cycle is it, on the device's own clock?
        let own = ((self.clock.at(sent.begin) - zero) / self.cycle_ns as f64).round();
        self.truth.stale += u64::from(arrival.copy || (own - cycle as f64).abs() > 0.5);
        let word = match slice {
            slice if self.positions => {
                let word = self.follower.next(slice);
                let own = slice.is_some_and(|slice| slice.pto.start().is_some());
                self.axis.tally.caught_up += u64::from(word.start().is_some() && !own);
                Some(word)
            }
            slice => slice.map(|slice| slice.pto),
        };
        let acts = sent.begin + (self.cycle_ns + PERIOD) as f64;
        let at = (self.clock.at(now) - zero).max(0.0) as u64;
        let incoming = word.map(|word| Incoming {
            at,
            word,
            expected: acts + word.start().map_or(0.0, |start| f64::from(start.ns())),
        });
        Some(Axle { cycle, incoming })
    }

    /// No frame of this cycle has come: the follower knows this; the published device repeats its last word.
    pub(super) fn lost(&mut self, cycle: u64) -> Axle {
        if self.positions {
            let _rest = self.follower.next(None);
        }
        let word = Pto::default();
        // Later than the cycle before it, earlier than the data of the next one.
        let incoming = self.positions.then(|| Incoming { at: (cycle + 1) * self.cycle_ns, word, expected: 0.0 });
        Axle { cycle, incoming }
    }

    /// Runs the axis through the cycle after the one that has brought a word, or none.
    pub(super) fn run(&mut self, axle: &Axle, k: usize, periods: &mut Periods, record: &mut Recorder) {
        let Some(zero) = self.zero else { return };
        let (axis, clock, generator) = (&mut self.axis, &self.clock, &mut self.generator);
        let start = (axle.cycle + 1) * self.cycle_ns;
        let end = start + self.cycle_ns;
        // The word is held back until its cycle begins, so that it does not matter when in the cycle before it came.
        let word = axle.incoming.map(|word| Incoming { at: word.at.max(start), ..word });
        let taken = word.map_or(0, |word| word.at).max(start + PERIOD);
        record.axis(k, |mut seen| {
            let mut go = |until, word: Option<Incoming>, generator: &mut Generator| {
                generator.run(until, word.map(|word| (word.at, word.word)), periods, |ns, change| {
                    axis.take(change, || clock.when(zero + ns as f64), word, seen.as_deref_mut());
                });
            };
            go(taken, word, generator);
            if end > start + PERIOD {
                generator.rest();
                go(end, None, generator);
            }
        });
    }

    /// Returns the device's frame. Without positions the steps are 0, as the published device sends them.
    pub(super) fn answer(&mut self, now: f64) -> Option<DeviceFrame<{ InputSlice::LEN }>> {
        let ordered = if self.positions { self.follower.ordered() } else { Some(0) };
        self.device.answer_ordered(self.axis.driver.status(now as u64), ordered)
    }

    /// Notes that the master has received the device's frame.
    pub(super) fn reported(&mut self, input: InputSlice) {
        self.lag = if self.positions { self.before.lag(input.ordered) } else { 0 };
        self.status = input.driver;
    }

    /// Returns the error of the counter against the master's time.
    pub(super) fn look_at_clock(&mut self, now: f64, master_ns: f64) {
        let off = (self.clock.at(now) - master_ns + WRAP / 2.0).rem_euclid(WRAP) - WRAP / 2.0;
        self.clock_error_ns = self.clock_error_ns.max(off.abs());
    }

    /// Counts what was wrong with a frame that the device has accepted.
    fn judge(&mut self, arrival: &Arrival, sent: &Sent) {
        let (frame, sent) = (Rc::as_ref(&arrival.bytes), &sent.bytes);
        let stamp = frame.len().saturating_sub(2);
        if frame == sent {
            return;
        }
        if frame.get(..stamp) == sent.get(..stamp) {
            self.bad_stamps += 1;
        } else {
            self.undetected += 1;
        }
    }

    /// Handles that the device has left the IO exchange: pulses already programmed still come.
    pub(super) fn leave(&mut self, periods: &mut Periods) {
        if self.device.state() == State::Exchange {
            return;
        }
        let Some(zero) = self.zero.take() else { return };
        self.heard = false;
        self.generator.rest();
        let (axis, clock) = (&mut self.axis, &self.clock);
        let until = self.generator.now() + 3 * PERIOD;
        self.generator.run(until, None, periods, |ns, change| {
            axis.take(change, || clock.when(zero + ns as f64), None, None);
        });
    }
}

/// Notes the result of a cycle for the axis.
pub(super) struct Axle {
    cycle: u64,
    incoming: Option<Incoming>,
}
