//! A position has an instant: the sampling edge as the encoder hears it.

use crate::cable::{Cable, Disturbance};
use hdsl::device::{Behaviour, Device, Heard};
use hdsl::frame::Extra;
use hdsl::master::Master;
use hdsl::sync::{Es, Synchroniser};
use hdsl::{Dialect, Doubt, EncoderId, Policy, Sample, Window};

/// Eighths of a bit, 40/3 ns each.
const fn ns(eighths: i64) -> u64 {
    (eighths * 40 / 3) as u64
}

/// A shaft that turns evenly, and the time, in eighths of a bit since the start.
struct Line {
    master: Master,
    device: Device,
    cable: Cable,
    /// Steps in an eighth of a bit.
    speed: i64,
    /// When the present frame begins at the master.
    now: i64,
    /// The sampling edge of the last frame at the master, and the instant of the encoder's position.
    edge: i64,
    instant: i64,
}

impl Line {
    fn new(dialect: Dialect, sync: Option<Synchroniser>, disturbance: Disturbance, lag: u8) -> Self {
        let master = sync.map_or_else(|| Master::new(dialect), |sync| Master::synchronised(dialect, sync));
        let mut device = Device::new(EncoderId::new(0x00153).unwrap());
        device.set_behaviour(Behaviour::new().with_sampling_lag(lag));
        Self { master, device, cable: Cable::new(disturbance, 7), speed: 1, now: 0, edge: 0, instant: 0 }
    }

    /// One H-frame.
    fn frame(&mut self) {
        let head = self.master.transmission().head;
        let extra = head.extra().map_or(0, |extra: Extra| i64::from(extra.get()));
        self.edge = self.now + 64 + extra;
        let samples = if let Some(heard) = Heard::on_line(&self.cable.down_samples(head)) {
            self.instant = self.now + i64::from(self.device.sampling_instant(&heard));
            let answer = self.device.set_position((self.speed * self.instant) as u64).hear(heard.bits);
            self.cable.up_heard(answer, &heard)
        } else {
            self.instant = self.edge;
            let answer = self.device.set_position((self.speed * self.instant) as u64).hear(Window::EMPTY);
            self.cable.up(answer)
        };
        // The head has 26 bits and those of the window; one bit later 72 bits are sampled.
        let window = (extra + 7) / 8 * 8;
        let end_ns = ns(self.now + 8 * (26 + 1 + 72) + window);
        let tail = self.master.hear(&samples, end_ns).unwrap().tail;
        // 108 bits, the bits of the window, and the stuffing.
        self.now += 864 + window + 48 * i64::from(tail.stuffing.get());
    }

    /// The fast position at the sampling edge: its instant is the edge, three roundings to a nanosecond aside.
    fn fast(&self) -> Result<Sample, Doubt> {
        let fast = self.master.fast().at(ns(self.edge), Policy::new(3))?;
        assert!(fast.sampled_ns() <= ns(self.edge));
        Ok(fast)
    }

    fn lock(&mut self) {
        for _ in 0..200 {
            self.frame();
        }
        assert!(self.fast().is_ok());
    }
}

/// What a drive must know: the position is that of the edge, later by 5 ns a metre and by what the encoder takes: 37 eighths
/// of a bit (13.333 ns) for 100 m (SICK manual, p. 37).
#[test]
fn the_position_of_the_edge() {
    for (metres, eighths) in [(0, 0), (10, 3), (50, 18), (100, 37)] {
        for lag in [0, 7] {
            let mut line = Line::new(Dialect::SICK, None, Disturbance::metres(metres), lag);
            line.lock();
            for _ in 0..50 {
                line.frame();
                assert_eq!(line.instant - line.edge, eighths + i64::from(lag));
                // A step an eighth: the position says the time.
                let fast = line.fast().unwrap();
                assert_eq!((fast.position(), fast.velocity()), (line.instant, 864));
                let safe = line.master.safe().at(ns(line.edge), Policy::new(16 * 11_520)).unwrap();
                let age = (ns(line.edge) + 100 - safe.sampled_ns()) / 11_520;
                assert_eq!(safe.position(), line.instant - 864 * age as i64);
            }
        }
    }
}

/// In sync mode the edge wanders within a bit, and the positions with it: they follow the pulse, not the bits.
#[test]
fn positions_follow_the_edge_within_a_bit() {
    // 12.093 us, 113 bits and three eighths.
    let sync = Synchroniser::new(907, Es::ONE).unwrap();
    let mut line = Line::new(Dialect::SICK, Some(sync), Disturbance::metres(20), 0);
    line.speed = 3;
    line.lock();
    let (mut parts, mut last) = ([0_u32; 8], line.instant);
    for _ in 0..400 {
        line.frame();
        assert_eq!(line.fast().map(|fast| fast.position()), Ok(3 * line.instant));
        // The pulse period, to the eighth.
        assert!((line.instant - last - 907).abs() <= 1, "{}", line.instant - last);
        last = line.instant;
        parts[(line.instant % 8) as usize] += 1;
    }
    assert!(parts.iter().all(|count| *count > 0), "{parts:?}");
}

/// Jitter moves the instant by a sample either way, and nothing else: no bad word, no restart, and the position is that of
/// the instant it was taken at.
#[test]
fn jitter_of_the_edge() {
    for dialect in [Dialect::SICK, Dialect::TI] {
        let disturbance = Disturbance::metres(50).with_jitter(1);
        let mut line = Line::new(dialect, None, disturbance, 3);
        line.speed = 100;
        line.lock();
        let mut seen = [0_u32; 3];
        for _ in 0..5000 {
            line.frame();
            assert_eq!(line.fast().map(|fast| fast.position()), Ok(100 * line.instant));
            let moved = line.instant - line.edge - 18 - 3;
            seen[usize::try_from(moved + 1).unwrap()] += 1;
        }
        let counters = line.master.counters();
        assert!(seen.iter().all(|count| *count > 1000), "{seen:?}");
        assert_eq!((counters.restarts, counters.words, counters.acceleration), (0, 0, 0));
    }
}

/// Glitches in both directions, one sample in five thousand: words are lost, and what is given is still the position of the
/// instant or nothing.
#[test]
fn glitches_both_ways() {
    let disturbance = Disturbance::metres(30).with_jitter(1).with_glitches(200);
    let mut line = Line::new(Dialect::SICK, None, disturbance, 0);
    line.speed = 2;
    let (mut good, mut wrong) = (0, 0);
    for _ in 0..20_000 {
        line.frame();
        if let Ok(fast) = line.fast() {
            good += 1;
            // A word that passed CRC-5 with two wrong bits is found out at the end of the next V-frame.
            wrong += u32::from(fast.position() != 2 * line.instant);
        }
    }
    let counters = line.master.counters();
    assert!(good > 10_000 && wrong <= 32 && counters.words > 100, "{good} {wrong} {counters:?}");
}
