//! A master in bytes, and one device of its line that is judged by what that has sent.

use super::{
    CAPTURE_2, CAPTURE_4, CAPTURE_8, FIRST, HOP, Happened, SLOT, TRIGGER, cables, crc8, flip, set_fcs, start_up,
    u16_at, u32_at,
};
use servowire_world::Draw;
use sorte_proto::device::{Action, Config, Device, FrameTimes, Path, PortId, State, Trigger};
use sorte_proto::follow::Follower;
use sorte_proto::timing::Slots;
use sorte_proto::{Correction, Link, Slice};

/// Periods of SYNC frames, from the last of them to the first of the exchange.
const SYNC: u64 = 10_000;
const TO_EXCHANGE: u64 = 10_500;
const SYNC_FRAMES: u64 = 40;

/// A counter with a crystal of its own, on a grid of 5 ns.
struct Counter {
    ahead: f64,
    ppm: f64,
    since: u64,
}

impl Counter {
    fn exact(&self, now: u64) -> f64 {
        self.ahead + (now as f64 - self.since as f64) * self.ppm * 1e-6
    }

    fn at(&self, now: u64) -> u32 {
        let value = now.wrapping_add_signed(self.exact(now).floor() as i64);
        (value / 5 * 5) as u32
    }

    /// When the counter shows a value that is near.
    fn when(&self, value: u32, now: u64) -> u64 {
        now.saturating_add_signed(i64::from(value.wrapping_sub(self.at(now)) as i32))
    }

    fn correct(&mut self, correction: Correction, now: u64) {
        (self.ahead, self.since) = (self.exact(now), now);
        match correction {
            Correction::None => {}
            Correction::Set { counter_ns } => self.ahead = f64::from(counter_ns) - (now + 135) as f64,
            Correction::Rate { increment: 6, ticks } => self.ahead += f64::from(ticks),
            Correction::Rate { ticks, .. } => self.ahead -= f64::from(ticks),
        }
    }
}

/// A master frame on its way to the device.
struct Arrival {
    at: u64,
    sof: u64,
    bytes: Vec<u8>,
    cycle: u64,
    harmless: bool,
}

pub(super) struct Bench {
    pub(super) device: Device,
    pub(super) happened: Happened,
    address: usize,
    devices: usize,
    cycle_ns: u64,
    way: u64,
    /// Frames of a correction of its clock.
    average: u64,
    /// Trigger of the first master frame; cycles sent so far.
    first: u64,
    cycles: u64,
    counter: Counter,
    follower: Follower,
    arrivals: Vec<Arrival>,
    /// When the device wants to be asked.
    due: u64,
    now: u64,
    /// Steps asked for, and made; cycles in a row without a frame at its time.
    asked: i64,
    made: i64,
    silent: u32,
    /// By cycle: the master's data, whether a frame was there at its time, whether one was taken, whether anything was wrong.
    seen: Vec<Seen>,
    /// What the device has not reported yet; where its clock was worst, in ns.
    wrong: bool,
    worst: f64,
    closed: u64,
}

struct Seen {
    data: [u8; 4],
    there: bool,
    taken: bool,
    lost: bool,
}

impl Bench {
    pub(super) fn new(draw: &mut Draw, devices: usize, cycle_ns: u64, address: usize) -> Self {
        let cables = cables(draw, devices);
        let way = cables[..address].iter().sum::<u64>() + HOP * (address as u64 - 1);
        let average = if cycle_ns > 20_000 { 1 } else { 16 };
        let config = Config::new()
            .with_output_len(None)
            .with_slots(Slots::Raster { first_ns: FIRST as u32, slot_ns: SLOT as u32 })
            .with_clock_average(average as u8);
        let ppm = draw.below(100) as f64 - 50.0;
        let mut bench = Self {
            device: Device::new(config),
            happened: Happened::default(),
            address,
            devices,
            cycle_ns,
            way,
            average,
            first: 0,
            cycles: 0,
            counter: Counter { ahead: draw.below(4_000_000_000) as f64, ppm, since: 0 },
            follower: Follower::new(128),
            arrivals: Vec::new(),
            due: 0,
            now: 0,
            asked: 0,
            made: 0,
            silent: 0,
            seen: Vec::new(),
            wrong: false,
            worst: 0.0,
            closed: 0,
        };
        bench.device.set_links(Link::Up, if address < devices { Link::Up } else { Link::Down });
        bench.start(draw, cables.get(address).copied());
        bench
    }

    /// `next`: the cable to the device after this one.
    fn start(&mut self, draw: &mut Draw, next: Option<u64>) {
        let last = next.is_none();
        let before = self.address as u16 - 1;
        for status in [0, 0, 8] {
            self.now += 1_000_000;
            let mut body = [0; 1022];
            for (at, number) in [(0, before), (2, 4 * before), (4, 4 * before)] {
                body[at..at + 2].copy_from_slice(&number.to_le_bytes());
            }
            let mut frame = start_up(1, status, &body);
            let path = self.hear(PortId::A, &mut frame, CAPTURE_8).0;
            assert_eq!(path, if last { Path::Reflect } else { Path::Forward });
            // A device that is not the last one takes part from the second on.
            if status == 8 {
                let entry = 10 + 4 * usize::from(before);
                let (count, total) = (before + 1, 4 * (before + 1));
                assert_eq!([u16_at(&frame, 4), u16_at(&frame, 6), u16_at(&frame, 8)], [count, total, total]);
                assert_eq!((&frame[entry..entry + 4], frame[3]), (&[4, 0, 4, 0][..], 8 | u8::from(last)));
                let mut again = frame.clone();
                set_fcs(&mut again);
                assert_eq!(again, frame);
            }
            if !last {
                // Back from the end of the line.
                let devices = self.devices as u16;
                let totals = [devices, 4 * devices, 4 * devices];
                totals.iter().zip([0, 2, 4]).for_each(|(n, at)| body[at..at + 2].copy_from_slice(&n.to_le_bytes()));
                let mut frame = start_up(1, status | 1, &body);
                self.hear(PortId::B, &mut frame, CAPTURE_8);
            }
        }
        self.now += 1_000_000;
        let mut body = [0; 32];
        body[..4].copy_from_slice(&(self.cycle_ns as u32).to_le_bytes());
        // SYNC frames every 10 us, in ticks of 5 ns: what a line needs whose way does not fit the delay field.
        body[4..8].copy_from_slice(&2_000_u32.to_le_bytes());
        body[31] = 0x33;
        let mut frame = start_up(2, 0x18, &body);
        self.hear(PortId::A, &mut frame, CAPTURE_8);
        if !last {
            self.hear(PortId::B, &mut frame, CAPTURE_8);
        }
        for k in 0..16 {
            self.now += 1_000_000;
            let (status, own) = if k == 15 { (8, 0x28) } else { (0x20, 0x20) };
            let mut frame = start_up(3, status, &[]);
            let trigger = self.hear(PortId::A, &mut frame, CAPTURE_8).1;
            if let Some(cable) = next {
                assert_eq!(trigger, if k == 15 { Trigger::Last } else { Trigger::Normal });
                let request = start_up(3, own, &[]);
                assert_eq!(Device::delay_request(trigger).unwrap().emit()[..], request[..]);
                let rtt = 2 * cable as u32 + 360 + draw.below(5) as u32;
                assert_eq!(self.device.hear_reflection(trigger, &request, rtt), Ok(()));
            }
        }
        // The master's time is that of this bench, from 0 on a multiple of the SYNC period.
        let begin = (self.now / SYNC + 100) * SYNC + TRIGGER;
        for k in 0..SYNC_FRAMES {
            let trigger = begin + k * SYNC;
            self.now = trigger + self.way;
            let mut body = [0; 6];
            body[..4].copy_from_slice(&((self.now + CAPTURE_4) as u32).to_le_bytes());
            body[4..].copy_from_slice(&(self.way as u16).to_le_bytes());
            let mut frame = start_up(5, if k + 1 == SYNC_FRAMES { 8 } else { 0x40 }, &body);
            self.hear(PortId::A, &mut frame, CAPTURE_4);
            let hop = u32_at(&frame, 4).wrapping_sub((self.now + CAPTURE_4) as u32);
            // The measurement of a cable loses up to 8 ns.
            let want = HOP + next.unwrap_or(0);
            assert!((want - 8..=want + 2).contains(&hop.into()), "{hop} for {want} ns");
            if !last {
                frame[3] |= 1;
                set_fcs(&mut frame);
                self.hear(PortId::B, &mut frame, CAPTURE_4);
            }
        }
        self.first = begin + (SYNC_FRAMES - 1) * SYNC + TO_EXCHANGE;
        assert_eq!(self.device.state(), State::Exchange);
        self.due = self.now;
    }

    /// A start-up frame at a port, `capture` after its first bit.
    fn hear(&mut self, port: PortId, frame: &mut [u8], capture: u64) -> (Path, Trigger) {
        let now = self.now + capture;
        let counter_ns = self.counter.at(now + 700);
        let times = FrameTimes { sof_ns: self.counter.at(now), counter_ns, now_ns: now };
        let reaction = self.device.hear(port, frame, times);
        assert_eq!(reaction.result, Ok(()));
        self.counter.correct(reaction.correction, now + 700);
        (reaction.path, reaction.trigger)
    }

    /// The next master frame, and what becomes of it.
    pub(super) fn cycle(&mut self, draw: &mut Draw) {
        // A device bears five cycles without a frame.
        let fault = if self.silent < 4 && self.cycles > 20 { draw.below(40) } else { 40 };
        let step = draw.below(3) as i64 - 1;
        self.send(draw, fault, step);
    }

    fn send(&mut self, draw: &mut Draw, fault: u64, step: i64) {
        let cycle = self.cycles;
        let trigger = self.first + cycle * self.cycle_ns;
        self.asked += step;
        // 1000 ns into the next cycle, DIR in bit 15; the position after it.
        let word: u16 = [0x83e8, 0, 0x03e8][(step + 1) as usize];
        let [low, high, ..] = (self.asked as u16).to_le_bytes();
        let data = [word.to_le_bytes()[0], word.to_le_bytes()[1], low, high];
        let mut bytes = vec![0, 0x30];
        (0..self.devices).for_each(|k| bytes.extend(if k + 1 == self.address { data } else { [k as u8; 4] }));
        bytes.push(crc8(&bytes));
        bytes.extend((trigger as u16).to_le_bytes());
        let sof = trigger + self.way + CAPTURE_2 + draw.below(31) - 15;
        let length = 80 * bytes.len() as u64;
        let mut arrival = Arrival { at: sof + length + draw.below(700), sof, bytes, cycle, harmless: true };
        let (mut there, mut good) = (true, true);
        self.happened.sent += 1;
        match fault {
            0 => {
                self.happened.lost += 1;
                (there, good) = (false, false);
            }
            1 => {
                self.happened.doubled += 1;
                let later = [6_000, 640 + draw.below(3 * self.cycle_ns)][draw.below(2) as usize];
                // On the wire two frames cannot be at one time; but the host may hand one over twice.
                let phase = (later + 1_000) % self.cycle_ns;
                let later = if phase < 2_000 { later + 2_000 - phase } else { later };
                let later = if draw.below(4) == 0 { 0 } else { later };
                let (at, sof, bytes) = (arrival.at + later + 50, sof + later, arrival.bytes.clone());
                self.arrivals.push(Arrival { at, sof, bytes, ..arrival });
            }
            2 => {
                self.happened.off += 1;
                let by = 350 + draw.below(1_000);
                let late = draw.below(2) == 0;
                (arrival.sof, arrival.at) =
                    if late { (sof + by, arrival.at + by) } else { (sof - by, arrival.at - by) };
                (there, good) = (false, false);
            }
            3 => {
                self.happened.held += 1;
                arrival.at += self.cycle_ns + draw.below(self.cycle_ns);
                (there, good) = (false, false);
            }
            4 => {
                self.happened.damaged += 1;
                let checked = arrival.bytes.len() - 2;
                // In the bytes that the CRC-8 has, or in the high byte of the time stamp; or the end is missing.
                match draw.below(4) {
                    0 => arrival.bytes[checked + 1] ^= 2 << draw.below(7),
                    1 => arrival.bytes.truncate(draw.below(checked as u64 + 2) as usize),
                    _ => flip(draw, &mut arrival.bytes[..checked]),
                }
                good = false;
            }
            _ => {}
        }
        if fault != 0 {
            arrival.harmless = good;
            self.arrivals.push(arrival);
        }
        self.silent = if there { 0 } else { self.silent + 1 };
        self.arrivals.sort_by_key(|arrival| std::cmp::Reverse(arrival.at));
        self.seen.push(Seen { data, there, taken: false, lost: !good });
        self.cycles += 1;
        self.run(trigger - TRIGGER + self.cycle_ns);
    }

    /// Cycles in which all goes well: in the end each step has been made, once.
    pub(super) fn rest(&mut self, draw: &mut Draw) {
        for _ in 0..300 {
            self.send(draw, 40, 0);
        }
        assert_eq!((self.made, self.follower.lag(), self.follower.is_stopped()), (self.asked, 0, false));
    }

    pub(super) fn worst(&self) -> String {
        format!("clock at most {:.0} ns off", self.worst)
    }

    fn run(&mut self, until: u64) {
        while self.now < until {
            let frame = self.arrivals.last().map_or(u64::MAX, |arrival| arrival.at);
            if self.due.min(frame) >= until {
                self.now = until;
            } else if frame <= self.due {
                let arrival = self.arrivals.pop().unwrap();
                self.now = arrival.at.max(self.now);
                self.exchange(&arrival);
                self.due = self.now;
            } else {
                self.now = self.due.max(self.now);
                self.ask();
            }
        }
    }

    fn word(&mut self, slice: Option<Slice>) {
        let word = self.follower.next(slice);
        if word.start().is_some() {
            self.made += if word.direction() == Some(sorte_proto::Direction::High) { -1 } else { 1 };
        }
    }

    fn ask(&mut self) {
        match self.device.poll(self.counter.at(self.now), self.now) {
            Action::Wait { until_ns } => self.due = self.counter.when(until_ns, self.now).max(self.now + 5),
            Action::CycleStart { .. } => {}
            Action::Lost { cycle } => {
                let seen = &self.seen[cycle as usize];
                assert!(!seen.taken && seen.lost, "cycle {cycle} was there");
                self.wrong = true;
                self.word(None);
            }
            Action::Send { cycle, at_ns } => self.sent(cycle, at_ns),
            Action::Restart => panic!("a restart in cycle {}", self.cycles),
        }
    }

    /// The own frame: in its slot, as the sources have it, and with ERROR if anything was wrong in the cycle before.
    fn sent(&mut self, cycle: u64, at_ns: u32) {
        let mut bytes = [0; 6];
        self.device.answer([7, 8, 9]).unwrap().emit_into(&mut bytes).unwrap();
        let last = u8::from(self.address == self.devices);
        let status = last | if self.wrong { 4 } else { 0 };
        assert_eq!(bytes[..5], [self.address as u8, status, 7, 8, 9], "in cycle {cycle}");
        assert_eq!(bytes[5], crc8(&bytes[..5]));
        // What was lost in the cycle before is told now.
        let before = &self.seen[cycle as usize - 1];
        assert!(!before.lost || status & 4 != 0, "cycle {cycle}: nobody says that the one before was lost");
        self.wrong = false;
        let start = (self.first - TRIGGER + cycle * self.cycle_ns) as i64;
        let want = start + FIRST as i64 + SLOT as i64 * (self.address as i64 - 1) - self.way as i64;
        let off = self.counter.when(at_ns, self.now) as i64 - want;
        self.worst = self.worst.max((off as f64).abs());
        // Jitter and grids, and 50 ppm over the frames of a correction and five that may be missing.
        let drift = self.cycle_ns * (self.average + 5) / 20_000;
        assert!(off.unsigned_abs() <= 30 + drift, "cycle {cycle}: {off} ns off its slot");
    }

    fn exchange(&mut self, arrival: &Arrival) {
        let before = self.device.counters();
        let sof_ns = self.counter.at(arrival.sof);
        let times = FrameTimes { sof_ns, counter_ns: self.counter.at(self.now), now_ns: self.now };
        let heard = self.device.hear_exchange(&arrival.bytes, times);
        let cycle = arrival.cycle as usize;
        match heard {
            Ok(output) => {
                assert_eq!((output.cycle, output.data), (arrival.cycle, &self.seen[cycle].data[..]));
                assert!(!self.seen[cycle].taken, "cycle {cycle} twice");
                assert!(arrival.harmless, "cycle {cycle} was lost");
                self.seen[cycle].taken = true;
                self.happened.taken += 1;
                let (correction, slice) = (output.correction, Slice::parse(self.seen[cycle].data));
                self.counter.correct(correction, self.now);
                self.word(Some(slice));
            }
            Err(error) => {
                self.happened.refused += 1;
                self.wrong = true;
                let count = |counters: sorte_proto::device::Counters| {
                    let master = counters.master;
                    let damaged = counters.crc_errors + counters.format_errors;
                    damaged + u64::from(master.doubled + master.late + master.stale)
                };
                assert_eq!(count(self.device.counters()), count(before) + 1, "{error}");
            }
        }
        self.count();
    }

    /// Cycles that nothing can come for any more: those without a frame have been counted.
    fn count(&mut self) {
        while self.closed + 2 < self.cycles {
            let seen = &self.seen[self.closed as usize];
            assert!(seen.taken != seen.lost, "cycle {}: taken {}", self.closed, seen.taken);
            self.happened.missed += u64::from(!seen.there);
            self.closed += 1;
        }
        let open = self.seen.iter().rev().take(2).filter(|seen| !seen.there).count() as u64;
        let missed = u64::from(self.device.counters().master.missed);
        assert!((self.happened.missed..=self.happened.missed + open).contains(&missed), "{missed} missed");
    }
}
