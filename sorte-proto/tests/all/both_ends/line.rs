//! A line in simulated time: cables, devices with counters of their own, and what goes over them.

use crate::common::{EXCHANGE_CAPTURE_NS, capture_ns};
use sorte_proto::device::{self, Device, FrameTimes, Path, PortId, Reaction, Trigger};
use sorte_proto::master::{self, Action, Master};
use sorte_proto::{Correction, Discovery, Error, Link};

/// A device's counter: right after SYNC it should read the master's time.
#[derive(Clone, Copy)]
pub(super) struct Counter {
    /// What it is ahead of the simulation's time, in ns.
    pub(super) ahead: i64,
}

impl Counter {
    pub(super) fn at(self, now_ns: u64) -> u32 {
        now_ns.wrapping_add_signed(self.ahead) as u32
    }

    pub(super) fn correct(&mut self, correction: Correction, now_ns: u64) {
        match correction {
            Correction::None => {}
            // The write takes effect 135 ns later.
            Correction::Set { counter_ns } => self.ahead = i64::from(counter_ns) - i64::try_from(now_ns + 135).unwrap(),
            Correction::Rate { increment: 6, ticks } => self.ahead += i64::from(ticks),
            Correction::Rate { ticks, .. } => self.ahead -= i64::from(ticks),
        }
    }
}

pub(super) struct Line {
    pub(super) master: Master,
    pub(super) devices: Vec<Device>,
    pub(super) counters: Vec<Counter>,
    /// In front of each device, in ns.
    pub(super) cables: Vec<u64>,
    /// Devices that are reached.
    pub(super) plugged: usize,
    /// Counter of each device when it was asked last in the exchange.
    pub(super) polled: Vec<Option<u32>>,
    /// The next cycle.
    pub(super) next: (u64, u16),
    pub(super) cycle_ns: u32,
    /// Flips this bit of the next frame that goes over the first cable.
    pub(super) flip: Option<usize>,
    pub(super) now_ns: u64,
}

impl Line {
    pub(super) fn new(cables: Vec<u64>) -> Self {
        let n = cables.len();
        let config = device::Config::new();
        let mut line = Self {
            master: Master::new(master::Config::new().with_sync_frames(64)),
            devices: vec![Device::new(config); n],
            counters: (0..n).map(|k| Counter { ahead: 123_456_789 * i64::try_from(k).unwrap() }).collect(),
            cables,
            plugged: 0,
            polled: vec![None; n],
            cycle_ns: 4000,
            next: (0, 0),
            flip: None,
            now_ns: 0,
        };
        line.master.set_link(Link::Up);
        line.plug(n);
        line
    }

    pub(super) fn plug(&mut self, devices: usize) {
        self.plugged = devices;
        for (k, device) in self.devices.iter_mut().enumerate() {
            let link = |there: bool| if there { Link::Up } else { Link::Down };
            device.set_links(link(k < devices), link(k + 1 < devices));
        }
    }

    pub(super) fn wait(&mut self, until_ns: u64) {
        self.now_ns = until_ns;
        for device in &mut self.devices {
            // Nobody asks it in between: it gives up by the time.
            let _late = device.poll(0, until_ns);
        }
    }

    /// A start-up frame goes out to the end of the line and comes back.
    pub(super) fn carry(&mut self, frame: &[u8], at_ns: u64) -> Option<(Vec<u8>, u64)> {
        let mut frame = frame.to_vec();
        if let Some(bit) = self.flip.take() {
            let bit = bit % (frame.len() * 8);
            frame[bit / 8] ^= 1 << (bit % 8);
        }
        let mut sof_ns = at_ns;
        for k in 0..self.plugged {
            sof_ns += self.cables[k];
            // The capture is 280 ns after the trigger.
            let handled = self.pass(k, PortId::A, &mut frame, sof_ns + 280);
            if handled.trigger != Trigger::None && k + 1 < self.plugged {
                self.measure(k, handled.trigger, sof_ns);
            }
            match handled.path {
                Path::Forward => sof_ns += 355,
                Path::Absorb => return None,
                Path::Reflect => {
                    sof_ns += 320;
                    for back in (0..k).rev() {
                        sof_ns += self.cables[back + 1];
                        if self.pass(back, PortId::B, &mut frame, sof_ns).path != Path::Forward {
                            return None;
                        }
                        sof_ns += 355;
                    }
                    return Some((frame, sof_ns + self.cables[0]));
                }
            }
        }
        None
    }

    pub(super) fn pass(&mut self, k: usize, port: PortId, frame: &mut [u8], sof_ns: u64) -> Reaction {
        let counter_ns = self.counters[k].at(sof_ns + 700);
        let arrival = FrameTimes { sof_ns: self.counters[k].at(sof_ns), counter_ns, now_ns: sof_ns };
        let handled = self.devices[k].hear(port, frame, arrival);
        self.counters[k].correct(handled.correction, sof_ns + 700);
        handled
    }

    /// Device k measures the line to the next one, which does the same to its next.
    pub(super) fn measure(&mut self, k: usize, trigger: Trigger, at_ns: u64) {
        let mut frame = Device::delay_request(trigger).unwrap().emit();
        let handled = self.pass(k + 1, PortId::A, &mut frame, at_ns + self.cables[k + 1]);
        if handled.trigger != Trigger::None && k + 2 < self.plugged {
            self.measure(k + 1, handled.trigger, at_ns);
        }
        if handled.path == Path::Reflect {
            let rtt = 2 * self.cables[k + 1] as u32 + 360;
            assert_eq!(self.devices[k].hear_reflection(trigger, &frame, rtt), Ok(()));
        }
    }

    /// One cycle: what each device took, and what the master took of each device.
    pub(super) fn exchange(&mut self, output: &[u8], at_ns: u64, time_stamp: u16) -> Vec<Result<Vec<u8>, Error>> {
        let mut frame = vec![0; output.len() + 5];
        self.master.emit_into(output, time_stamp, &mut frame).unwrap();
        if let Some(bit) = self.flip.take() {
            let bit = bit % (frame.len() * 8);
            frame[bit / 8] ^= 1 << (bit % 8);
        }
        let mut sof_ns = at_ns;
        let (mut taken, mut answers) = (Vec::new(), Vec::new());
        for k in 0..self.plugged {
            sof_ns += self.cables[k] + if k > 0 { 355 } else { 0 };
            let captured_ns = sof_ns + EXCHANGE_CAPTURE_NS;
            self.poll_until(k, captured_ns, &mut answers);
            let sof = self.counters[k].at(captured_ns);
            let times = FrameTimes { sof_ns: sof, counter_ns: sof, now_ns: captured_ns };
            let output = self.devices[k].hear_exchange(&frame, times);
            taken.push(output.map(|o| o.data.to_vec()));
            if let Ok(output) = output {
                self.counters[k].correct(output.correction, captured_ns);
            }
        }
        for k in 0..self.plugged {
            self.poll_until(k, at_ns - 500 + u64::from(self.cycle_ns), &mut answers);
        }
        answers.sort_by_key(|(sof_ns, _)| *sof_ns);
        for (sof_ns, bytes) in answers {
            let _: Result<_, _> = self.master.hear(&bytes, sof_ns);
        }
        taken
    }

    /// Device k does what there is to do before `until_ns`; its frames, with the capture of their start at the master.
    pub(super) fn poll_until(&mut self, k: usize, until_ns: u64, answers: &mut Vec<(u64, Vec<u8>)>) {
        let way: u64 = self.cables[..=k].iter().sum::<u64>() + 355 * k as u64;
        let until = self.counters[k].at(until_ns);
        let mut now = self.polled[k].unwrap_or(until.wrapping_sub(4000));
        for _ in 0..20 {
            match self.devices[k].poll(now, until_ns) {
                device::Action::Wait { until_ns: next } if (next.wrapping_sub(until) as i32) < 0 => now = next,
                device::Action::Wait { .. } => break,
                device::Action::Send { at_ns, .. } => {
                    let sent_ns = until_ns.wrapping_add_signed(i64::from(at_ns.wrapping_sub(until) as i32));
                    if let Some(answer) = self.devices[k].answer([k as u8, 0, 0]) {
                        let mut bytes = [0; 6];
                        answer.emit_into(&mut bytes).unwrap();
                        answers.push((sent_ns + way + EXCHANGE_CAPTURE_NS, bytes.to_vec()));
                    }
                }
                _ => {}
            }
        }
        self.polled[k] = Some(now);
    }

    /// Runs until the first cycle, or until the master gives up.
    pub(super) fn start_up(&mut self) -> Result<(u64, u16), Error> {
        self.polled.fill(None);
        loop {
            match self.master.poll(self.now_ns) {
                Action::Wait { until_ns } => self.wait(until_ns),
                Action::Restart { error } => return Err(error),
                Action::Exchange { at_ns, time_stamp, .. } => return Ok((at_ns, time_stamp)),
                Action::Send { at_ns, frame } => {
                    let mut buffer = [0; Discovery::LEN];
                    let len = frame.emit_into(&mut buffer).unwrap();
                    if let Some((answer, sof_ns)) = self.carry(&buffer[..len], at_ns) {
                        let _: Result<_, _> = self.master.hear(&answer, sof_ns + capture_ns(&frame));
                    }
                }
            }
        }
    }

    /// Cycles until the master gives up, `most` at most.
    pub(super) fn cycles(&mut self, first: (u64, u16), most: u32) -> Option<Error> {
        let (mut at_ns, mut time_stamp) = first;
        for n in 0..most {
            let output: Vec<u8> = (0..self.master.output_len()).map(|k| k as u8 ^ n as u8).collect();
            let taken = self.exchange(&output, at_ns, time_stamp);
            for (k, data) in taken.into_iter().enumerate() {
                // A device that was plugged in just now is not in the exchange.
                let entry = self.master.network().entries().get(k).map_or(4, |entry| usize::from(entry.output));
                let own = output[entry * k..entry * (k + 1)].to_vec();
                assert_eq!(data, if self.devices[k].assignment().is_some() { Ok(own) } else { Err(Error::WrongState) });
            }
            loop {
                match self.master.poll(self.now_ns) {
                    Action::Wait { until_ns } => self.now_ns = until_ns,
                    Action::Exchange { at_ns: at, time_stamp: stamp, .. } => {
                        (at_ns, time_stamp) = (at, stamp);
                        self.next = (at, stamp);
                        break;
                    }
                    Action::Restart { error } => return Some(error),
                    Action::Send { .. } => panic!("start-up in the exchange"),
                }
            }
        }
        None
    }
}
