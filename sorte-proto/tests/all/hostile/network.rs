//! A network of devices in bytes, and a master that is judged by what they have sent.

use super::{
    CAPTURE_2, CAPTURE_4, CAPTURE_8, FIRST, HOP, Happened, REFLECTION, SLOT, TRIGGER, cables, crc8, flip, set_fcs,
    u16_at, u32_at,
};
use servowire_world::Draw;
use sorte_proto::master::{Action, Config, Heard, Master};
use sorte_proto::timing::Slots;
use sorte_proto::{Error, ErrorClass, Link};

/// A frame on its way to the master: when it is handed over, the capture of its start, and which it is.
#[derive(Clone, Copy)]
struct Arrival {
    at: u64,
    sof: u64,
    bytes: [u8; 6],
    device: usize,
    raster: u64,
}

pub(super) struct Bench {
    pub(super) master: Master,
    pub(super) happened: Happened,
    pub(super) cycles: u64,
    cycle_ns: u64,
    now: u64,
    /// Trigger of the first cycle; cycles as the network counts them, by their time.
    first: u64,
    /// What the devices' common clock is ahead of the master's, in ns, and each device's own error.
    drift: i64,
    own: Vec<i64>,
    arrivals: Vec<Arrival>,
    /// The master's number of each cycle of the network that it has begun, from `first` on.
    begun: Vec<Option<u64>>,
    /// For the cycle that was begun last: which devices' frames were taken; for each device, how many cycles had none.
    taken: Vec<bool>,
    missed: Vec<u32>,
    /// Something was refused since the last master frame.
    refused: bool,
}

impl Bench {
    pub(super) fn new(draw: &mut Draw, devices: usize, cycle_ns: u64) -> Self {
        let cables = cables(draw, devices);
        let config = Config::new()
            .with_cycle_ns(cycle_ns as u32)
            .with_sync_frames(20)
            .with_slots(Slots::Raster { first_ns: FIRST as u32, slot_ns: SLOT as u32 })
            .with_long_line(true)
            .with_retrain_crc_errors(0)
            .with_retrain_timing_errors(0);
        let mut bench = Self {
            master: Master::new(config),
            happened: Happened::default(),
            cycles: 0,
            cycle_ns,
            now: 0,
            first: 0,
            drift: 0,
            own: (0..devices).map(|k| -(draw.below(15 * k as u64 + 1) as i64)).collect(),
            arrivals: Vec::new(),
            begun: Vec::new(),
            taken: vec![true; devices],
            missed: vec![0; devices],
            refused: false,
        };
        bench.master.set_link(Link::Up);
        // The measurement of a cable loses up to 7 ns.
        let first = start(&mut bench.master, &mut bench.now, &cables, || draw.below(8)).unwrap();
        bench.first = first.0;
        bench.begin(draw, first.0, first.1, first.2);
        bench
    }

    /// The master begins a cycle: its frame is what the sources say, and what is missing so far has been counted.
    fn begin(&mut self, draw: &mut Draw, at: u64, time_stamp: u16, cycle: u64) {
        let raster = (at - self.first) / self.cycle_ns;
        assert_eq!((at - self.first) % self.cycle_ns, 0, "out of the raster");
        let lost = self.taken.iter().any(|taken| !taken);
        for (k, taken) in self.taken.iter().enumerate() {
            self.missed[k] += u32::from(!taken);
            let tally = self.master.tally(k as u8 + 1).unwrap();
            assert_eq!(tally.missed, self.missed[k], "device {} at cycle {cycle}: {tally}", k + 1);
        }
        self.happened.missed += self.taken.iter().filter(|taken| !**taken).count() as u64;
        let devices = self.taken.len();
        let output: Vec<u8> = (0..4 * devices).map(|_| draw.below(256) as u8).collect();
        let mut frame = vec![0; output.len() + 5];
        assert_eq!(self.master.emit_into(&output, time_stamp, &mut frame), Ok(frame.len()));
        let status = if lost || self.refused { 0x34 } else { 0x30 };
        let body = [&[0, status], &output[..]].concat();
        let stamp = ((at - self.master.epoch_ns()) as u16).to_le_bytes();
        assert_eq!(frame, [&body[..], &[crc8(&body)], &stamp].concat(), "cycle {cycle}");
        self.refused = false;
        assert_eq!(raster, self.begun.len() as u64, "the first that has not passed");
        self.send(draw, raster);
        self.begun.push(Some(cycle));
        // In the first one the devices are silent.
        self.taken.fill(raster == 0);
        self.cycles += 1;
    }

    /// The frames of all devices in a cycle of the network, and what becomes of them.
    fn send(&mut self, draw: &mut Draw, raster: u64) {
        self.drift = (self.drift + draw.below(11) as i64 - 5).clamp(-60, 60);
        if raster == 0 {
            return;
        }
        let (devices, share) = (self.own.len(), 40 + 20 * self.own.len() as u64);
        let start = self.first - TRIGGER + raster * self.cycle_ns;
        for device in 0..devices {
            self.happened.sent += 1;
            let off = self.drift + self.own[device] + draw.below(41) as i64 - 20;
            let sof = (start + FIRST + SLOT * device as u64 + CAPTURE_2).wrapping_add_signed(off);
            let (last, [low, middle, high, ..]) = (u8::from(device + 1 == devices), raster.to_le_bytes());
            let mut bytes = [device as u8 + 1, last, low, middle, high, 0];
            bytes[5] = crc8(&bytes[..5]);
            let mut arrival = Arrival { at: sof + 520 + draw.below(100), sof, bytes, device, raster };
            match draw.below(share) {
                0 => {
                    self.happened.lost += 1;
                    continue;
                }
                1 => {
                    self.happened.doubled += 1;
                    // One that begins at the time of the next cycle's frame nobody could tell from that.
                    let later = 640 + draw.below(self.cycle_ns - 1_340 - 500 - 16 * device as u64);
                    // Or the host hands it over twice.
                    let later = if draw.below(4) == 0 { 0 } else { later };
                    let copy = Arrival { at: arrival.at + later + 50, sof: sof + later, ..arrival };
                    self.arrivals.push(copy);
                }
                2 => {
                    self.happened.off += 1;
                    let window = 500 + 16 * device as u64;
                    let by = window + 200 + draw.below(1_000);
                    let late = draw.below(2) == 0 && 2 * by < self.cycle_ns;
                    (arrival.sof, arrival.at) =
                        if late { (sof + by, arrival.at + by) } else { (sof - by, arrival.at - by) };
                }
                3 => {
                    self.happened.held += 1;
                    arrival.at += (1 + draw.below(3)) * self.cycle_ns;
                }
                4 => {
                    self.happened.damaged += 1;
                    flip(draw, &mut arrival.bytes);
                }
                _ => {}
            }
            self.arrivals.push(arrival);
        }
        self.arrivals.sort_by_key(|arrival| std::cmp::Reverse(arrival.at));
    }

    /// On to the next master frame; now and then the master is late for it by up to three cycles.
    pub(super) fn cycle(&mut self, draw: &mut Draw) {
        loop {
            let late = if draw.below(200) == 0 { draw.below(3 * self.cycle_ns) } else { 0 };
            match self.master.poll(self.now) {
                Action::Wait { until_ns } => {
                    // What is there is taken before the clock is asked.
                    self.now = until_ns + late;
                    // The devices go on though the master does not.
                    while self.first + self.begun.len() as u64 * self.cycle_ns < self.now {
                        self.send(draw, self.begun.len() as u64);
                        self.begun.push(None);
                    }
                    while self.arrivals.last().is_some_and(|arrival| arrival.at <= self.now) {
                        let arrival = self.arrivals.pop().unwrap();
                        self.hear(&arrival);
                    }
                }
                Action::Exchange { at_ns, time_stamp, cycle, .. } => return self.begin(draw, at_ns, time_stamp, cycle),
                other => panic!("{other:?}"),
            }
        }
    }

    fn hear(&mut self, arrival: &Arrival) {
        let (before, Arrival { device, raster, .. }) = (self.master.counters(), *arrival);
        let heard = self.master.hear(&arrival.bytes, arrival.sof);
        let after = self.master.counters();
        let refused = |counters: sorte_proto::master::Counters| {
            let frames = counters.frames;
            u64::from(frames.doubled + frames.late + frames.stale) + counters.crc_errors
        };
        match heard {
            Ok(Heard::Device { frame, cycle, .. }) => {
                self.happened.taken += 1;
                let [low, middle, high, ..] = raster.to_le_bytes();
                assert_eq!((frame.address().get(), frame.payload()), (device as u8 + 1, &[low, middle, high][..]));
                // Of the cycle that it was sent in, or of one that the master has left out.
                assert_eq!(cycle, self.begun[raster as usize], "device {} of cycle {raster}", device + 1);
                if cycle.is_some_and(|cycle| cycle + 1 == self.cycles) {
                    assert!(!self.taken[device], "device {} twice in {raster}", device + 1);
                    self.taken[device] = true;
                } else {
                    assert_eq!(cycle, None, "device {} of cycle {raster}, which is over", device + 1);
                }
                assert_eq!(refused(before), refused(after));
            }
            Ok(Heard::StartUp) => panic!("a start-up frame in the exchange"),
            Err(error) => {
                self.happened.refused += 1;
                self.refused = true;
                assert_eq!(refused(after), refused(before) + 1, "{error}");
                let known =
                    [ErrorClass::BadCrc8, ErrorClass::OutsideWindow, ErrorClass::CycleOver, ErrorClass::Doubled];
                assert!(known.contains(&error.class()), "{error}");
            }
        }
    }
}

/// The start-up, up to the first cycle: its trigger, time stamp and number. `lost`: what the measurement of each cable loses, in ns.
fn start(
    master: &mut Master,
    now: &mut u64,
    cables: &[u64],
    mut lost: impl FnMut() -> u64,
) -> Result<(u64, u16, u64), Error> {
    let devices = cables.len();
    let way = cables.iter().sum::<u64>() + HOP * (devices as u64 - 1);
    let hops: u64 = cables[1..].iter().map(|cable| cable + HOP - lost()).sum::<u64>() + HOP;
    loop {
        let (at, frame) = match master.poll(*now) {
            Action::Wait { until_ns } => {
                *now = until_ns;
                continue;
            }
            Action::Send { at_ns, frame } => (at_ns, frame),
            Action::Exchange { at_ns, time_stamp, cycle, .. } => return Ok((at_ns, time_stamp, cycle)),
            Action::Restart { error } => return Err(error),
        };
        let mut buffer = [0; 1030];
        let len = frame.emit_into(&mut buffer).unwrap();
        let mut bytes = buffer[..len].to_vec();
        let again = bytes.clone();
        set_fcs(&mut bytes);
        assert_eq!((bytes == again, &bytes[..2]), (true, &[0xff, 0][..]));
        let (there_and_back, capture) = match (bytes[2], len) {
            (1, 1030) => {
                bytes[3] |= 1;
                for (at, number) in [(4, devices), (6, 4 * devices), (8, 4 * devices)] {
                    bytes[at..at + 2].copy_from_slice(&(number as u16).to_le_bytes());
                }
                (10..10 + 4 * devices).for_each(|at| bytes[at] = if at % 2 == 0 { 4 } else { 0 });
                (2 * way + REFLECTION, CAPTURE_8)
            }
            (2, 40) => (2 * way + REFLECTION, CAPTURE_8),
            (3, 8) => (2 * cables[0] + REFLECTION, CAPTURE_8),
            (5, 14) => {
                bytes[3] |= 1;
                let (stamp, delay) = (u32_at(&bytes, 4), u16_at(&bytes, 8));
                bytes[4..8].copy_from_slice(&stamp.wrapping_add(hops as u32).to_le_bytes());
                bytes[8..10].copy_from_slice(&delay.wrapping_add(hops as u16).to_le_bytes());
                (2 * way + REFLECTION, CAPTURE_4)
            }
            other => panic!("a start-up frame of type and length {other:?}"),
        };
        set_fcs(&mut bytes);
        // A line that does not fit is refused by its last SYNC; the next call says why.
        let refused = master.hear(&bytes, at + capture + there_and_back).is_err();
        assert!(!refused || bytes[2] == 5);
    }
}

/// Why the master does not start a line of these cables, all measured exactly.
pub(super) fn refusal(config: Config, cables: &[u64]) -> Option<Error> {
    let mut master = Master::new(config.with_sync_frames(2).with_discovery_frames(2).with_param_frames(1));
    master.set_link(Link::Up);
    start(&mut master, &mut 0, cables, || 0).err()
}
