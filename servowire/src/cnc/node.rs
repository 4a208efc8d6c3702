//! A device with its clock, its axis and what the master knows of it.

use sorte_proto::device::{Config, Device, State};
use sorte_proto::drv8711;
use sorte_proto::follow::{Asked, Follower, InputSlice};
use sorte_proto::{Pto, Slice};

use super::axis::{Axis, Build, Incoming, Seen};
use super::clock::Clock;
use super::periods::{Generator, PERIOD, Periods};

pub(super) struct Node {
    pub(super) device: Device,
    build: Build,
    generator: Generator,
    pub(super) axis: Axis,
    pub(super) clock: Clock,
    /// What the master has asked for, and what the device has made of it.
    pub(super) asked: Asked,
    pub(super) follower: Follower,
    /// Asked for before this cycle's word: what the device's frame of this cycle can know of.
    before: Asked,
    /// As the device's last frame told: steps missing, faults of the driver.
    pub(super) lag: i16,
    pub(super) status: drv8711::Status,
    /// Whether the driver took its registers.
    pub(super) set_up: Result<(), servowire_drivers::drv8711::Error>,
    incoming: Option<Incoming>,
    /// Own counter and master's time at the start of the first cycle; `None` outside the IO exchange.
    zero: Option<(f64, f64)>,
    /// Start of the own frame in its cycle, in ns.
    slot: f64,
    cycle: u64,
    /// Largest clock error in the IO exchange, in ns.
    pub(super) clock_error_ns: f64,
    /// Frames that were accepted although a bit of what the CRC-8 covers was wrong.
    pub(super) undetected: u64,
    /// Frames accepted with a wrong time stamp, which nothing covers.
    pub(super) bad_stamps: u64,
}

/// A master frame at a device.
pub(super) struct Received<'a> {
    pub(super) frame: &'a [u8],
    /// As the master sent it.
    pub(super) sent: &'a [u8],
    /// Start of the frame here, as it is captured, and when the device has dealt with it.
    pub(super) sof: f64,
    pub(super) done: f64,
    /// The master's time at the start of the cycle after next in which the step is made.
    pub(super) acts: f64,
    pub(super) cycle_ns: u64,
    /// Positions are in the command words; else the published device, which uses the last word again.
    pub(super) positions: bool,
}

impl Node {
    pub(super) fn new(config: Config, build: Build, clock: Clock, max_lag: u16) -> Self {
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
            incoming: None,
            zero: None,
            slot: 0.0,
            cycle: 0,
            clock_error_ns: 0.0,
            undetected: 0,
            bad_stamps: 0,
        }
    }

    /// What the master sends this device for `word`.
    pub(super) fn ask(&mut self, word: Pto, positions: bool) -> Slice {
        self.before = self.asked;
        self.axis.tally.asked += u64::from(word.start().is_some());
        let slice = self.asked.slice(word);
        if positions { slice } else { Slice::from(word) }
    }

    /// A cycle begins at `begin` of the master's time.
    pub(super) fn enter(&mut self, begin: f64, cycle_ns: u64) {
        if self.zero.is_some() || self.device.state() != State::Exchange {
            return;
        }
        let (Some(first), Some(slot)) = (self.device.first_cycle_ns(), self.device.send_time_ns()) else { return };
        // The counter has 32 bits; the time meant is the one nearby.
        let now = self.clock.at(begin);
        let ahead = first.wrapping_sub(now as i64 as u32) as i32;
        let first = now.floor() + f64::from(ahead);
        // On a long line the master waits for the answer to the last SYNC, and the device's first cycles pass without a frame.
        let passed = ((now - first) / cycle_ns as f64).round().max(0.0);
        let zero = first + passed * cycle_ns as f64;
        (self.zero, self.slot) = (Some((zero, begin)), slot.into());
        (self.cycle, self.incoming) = (0, None);
        self.axis.start();
        self.generator = self.build.generator();
    }

    pub(super) fn is_running(&self) -> bool {
        self.zero.is_some()
    }

    /// The axis runs through this cycle of the device.
    pub(super) fn run(&mut self, cycle_ns: u64, periods: &mut Periods, mut seen: Option<&mut Vec<(u64, Seen)>>) {
        let start = self.cycle * cycle_ns;
        // The word is held back until its cycle begins, so that it does not matter when in the cycle before it came.
        let word = self.incoming.take().map(|word| Incoming { at: word.at.max(start), ..word });
        let taken = word.map_or(0, |word| word.at).max(start + PERIOD);
        self.go(taken, word, periods, seen.as_deref_mut());
        if cycle_ns > PERIOD {
            self.generator.rest();
            self.go(start + cycle_ns, None, periods, seen);
        }
        self.cycle += 1;
    }

    /// Goes on until the own counter is `until` ns after the start of the generator. `word` gets into the device's buffer on
    /// the way.
    fn go(
        &mut self,
        until: u64,
        word: Option<Incoming>,
        periods: &mut Periods,
        mut seen: Option<&mut Vec<(u64, Seen)>>,
    ) {
        let Self { generator, axis, clock, zero: Some((zero, _)), .. } = self else { return };
        generator.run(until, word.map(|word| (word.at, word.word)), periods, |ns, change| {
            axis.take(change, || clock.when(*zero + ns as f64), word, seen.as_deref_mut());
        });
    }

    /// When the own frame of this cycle leaves, and the frame's payload.
    pub(super) fn answer(&mut self, cycle_ns: u64, positions: bool) -> Option<(f64, InputSlice)> {
        let (zero, _) = self.zero?;
        let ordered = if positions { self.follower.ordered().unwrap_or_default() } else { 0 };
        let at = self.clock.when(zero + (self.cycle * cycle_ns) as f64 + self.slot);
        let driver = self.axis.driver.status(self.cycle * cycle_ns);
        Some((at, InputSlice { driver, ordered }))
    }

    /// The master has got the device's frame.
    pub(super) fn reported(&mut self, input: InputSlice, positions: bool) {
        self.lag = if positions { self.before.lag(input.ordered) } else { 0 };
        self.status = input.driver;
    }

    /// The master frame of the cycle that [`run`](Self::run) has just gone through.
    pub(super) fn receive(&mut self, received: &Received<'_>) {
        let Some((zero, begin)) = self.zero else { return };
        let own = (zero as i64 as u32).wrapping_add(((self.cycle - 1) * received.cycle_ns) as u32);
        let in_cycle = |ns: f64| self.clock.read(ns).wrapping_sub(own);
        let (sof_ns, now_ns) = (in_cycle(received.sof), in_cycle(received.done));
        let output = self.device.hear_exchange(received.frame, sof_ns, now_ns);
        let slice = output.ok().and_then(|output| output.data.first_chunk()).map(|bytes| Slice::parse(*bytes));
        if let Ok(output) = output {
            self.clock.correct(output.correction, received.done);
            self.judge(received);
            let error = (self.clock.at(received.done) - zero) - (received.done - begin);
            self.clock_error_ns = self.clock_error_ns.max(error.abs());
        }
        let word = match slice {
            slice if received.positions => {
                let word = self.follower.next(slice);
                let own = slice.is_some_and(|slice| slice.pto.start().is_some());
                self.axis.tally.caught_up += u64::from(word.start().is_some() && !own);
                word
            }
            Some(slice) => slice.pto,
            // The published device keeps the word and makes its step once more.
            None => return,
        };
        let expected = received.acts + word.start().map_or(0.0, |start| f64::from(start.ns()));
        let at = (self.clock.at(received.done) - zero).max(0.0) as u64;
        self.incoming = Some(Incoming { at, word, expected });
    }

    /// What was wrong with a frame that the device has accepted.
    fn judge(&mut self, received: &Received<'_>) {
        let (frame, sent) = (received.frame, received.sent);
        if frame == sent {
            return;
        }
        let stamp = frame.len().saturating_sub(2);
        if frame.get(..stamp) == sent.get(..stamp) {
            self.bad_stamps += 1;
        } else {
            self.undetected += 1;
        }
    }

    /// The device has left the IO exchange: pulses that are programmed still come.
    pub(super) fn leave(&mut self, cycle_ns: u64, periods: &mut Periods) {
        if self.device.state() == State::Exchange || self.zero.is_none() {
            return;
        }
        self.incoming = None;
        self.generator.rest();
        self.go(self.cycle * cycle_ns + 3 * PERIOD, None, periods, None);
        self.zero = None;
    }
}
