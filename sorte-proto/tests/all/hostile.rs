//! A master against a network, and a device against a master, that know nothing of this crate: bytes, checks and times are written
//! here as the sources give them. Frames are lost, come twice, late, damaged, by a clock that drifts.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p sorte-proto --test all hostile:: -- --nocapture` runs as many frames;
//! with `SEED=1` other ones.

mod device;
mod network;

use servowire_world::{Draw, Seed, first_seed};
use sorte_proto::Error;
use sorte_proto::master::Config;
use sorte_proto::timing::{Limit, Slots, Timing};

/// Numbers of devices, each with a cycle that carries them, in ns.
const LINES: [(usize, u64); 4] = [(4, 4_000), (16, 16_000), (64, 60_000), (254, 224_000)];
/// Trigger of a master frame in its cycle; from one device's frame to the next one's; from device to device; in the last device.
const TRIGGER: u64 = 500;
const SLOT: u64 = 880;
const HOP: u64 = 355;
const REFLECTION: u64 = 320;
/// When the first device's frame begins at the master, in its cycle.
const FIRST: u64 = 585;
/// From the first bit to the capture of the start, with preambles of 2, 4 and 8 bytes.
const CAPTURE_2: u64 = 120;
const CAPTURE_4: u64 = 280;
const CAPTURE_8: u64 = 600;

/// CRC-8, polynomial 07h, from 0.
fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc, byte| (0..8).fold(crc ^ byte, |crc, _| crc << 1 ^ if crc & 0x80 == 0 { 0 } else { 7 }))
}

/// The FCS of Ethernet, the last four bytes of a frame.
fn set_fcs(frame: &mut [u8]) {
    let (body, fcs) = frame.split_at_mut(frame.len() - 4);
    let crc = body.iter().fold(!0_u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| crc >> 1 ^ if crc & 1 == 0 { 0 } else { 0xedb8_8320 })
    });
    fcs.copy_from_slice(&(!crc).to_le_bytes());
}

/// A start-up frame: DA, SA, TYPE, STATUS, body, FCS.
fn start_up(kind: u8, status: u8, body: &[u8]) -> Vec<u8> {
    let mut frame = [&[0xff, 0, kind, status], body, &[0; 4]].concat();
    set_fcs(&mut frame);
    frame
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// Flips one bit or two: CRC-8, which begins with the highest bit of each byte, finds both if they are less than 127 bits apart.
fn flip(draw: &mut Draw, bytes: &mut [u8]) {
    let bits = bytes.len() as u64 * 8;
    let first = draw.below(bits);
    let second = if draw.below(2) == 0 { first } else { (first + 1 + draw.below(bits.min(127) - 1)) % bits };
    let distance = first.abs_diff(second);
    for bit in if (1..127).contains(&distance) { vec![first, second] } else { vec![first] } {
        bytes[bit as usize / 8] ^= 0x80 >> (bit % 8);
    }
}

/// Cables in front of each device, in ns.
fn cables(draw: &mut Draw, devices: usize) -> Vec<u64> {
    (0..devices).map(|k| if k == 0 { 60 } else { 20 + draw.below(101) }).collect()
}

/// What has really happened, in frames.
#[derive(Debug, Default)]
struct Happened {
    sent: u64,
    lost: u64,
    doubled: u64,
    off: u64,
    held: u64,
    damaged: u64,
    /// Accepted, and what the machine counted.
    taken: u64,
    missed: u64,
    refused: u64,
}

impl Happened {
    fn every_kind(&self) {
        assert!(
            [self.lost, self.doubled, self.off, self.held, self.damaged].iter().all(|count| *count > 0),
            "{self:?}"
        );
    }
}

/// The numbers of this run, and a guard that names their seed in a panic.
fn seeded() -> (Seed, Draw) {
    let seed = first_seed();
    (Seed(seed), Draw::seeded(seed))
}

/// The share of a test in all frames wanted; each line gets a quarter.
fn frames_of_a_line() -> u64 {
    servowire_world::wanted_events(1_000_000) / 8
}

#[test]
fn hostile_a_master_takes_no_stale_value_and_counts_every_loss() {
    let (_said, mut draw) = seeded();
    for (devices, cycle_ns) in LINES {
        let mut bench = network::Bench::new(&mut draw, devices, cycle_ns);
        while bench.happened.sent < frames_of_a_line() || bench.cycles < 60 {
            bench.cycle(&mut draw);
        }
        bench.happened.every_kind();
        println!("master, {devices} devices: {:?}, {}", bench.happened, bench.master.counters());
    }
}

#[test]
fn hostile_a_device_takes_no_stale_value_and_counts_every_loss() {
    let (_said, mut draw) = seeded();
    for (devices, cycle_ns) in LINES {
        for address in [1, devices / 2, devices] {
            let mut bench = device::Bench::new(&mut draw, devices, cycle_ns, address);
            while bench.happened.sent < frames_of_a_line() / 3 {
                bench.cycle(&mut draw);
            }
            bench.rest(&mut draw);
            bench.happened.every_kind();
            println!(
                "device {address} of {devices}: {:?}, {}, {}",
                bench.happened,
                bench.device.counters(),
                bench.worst()
            );
        }
    }
}

/// Which device does not fit, and why: by arithmetic on the published times.
fn misfit(cables: &[u64], published: bool, cycle_ns: u64) -> Option<(u8, Limit)> {
    let (mut way, mut free) = (0, None);
    let output = (4 * cables.len() as u64).max(16);
    for (k, cable) in (0_u64..).zip(cables) {
        way += cable + if k == 0 { 0 } else { HOP };
        let send = match k {
            _ if !published => 500 + cables[0] as i64 + 880 * k as i64 - way as i64,
            0 => 500,
            1 => 900,
            2 => 1_360,
            _ => 1_800,
        };
        let (start, device) = (send + way as i64, k as u8 + 1);
        // Six sigma of two frames that pass k ports with 5 ns / sqrt(12) each.
        let least = (6.0 * 1.443 * (2.0 * k as f64).sqrt()).ceil() as i64;
        let (out, back) = (500 + 80 * (7 + output) + way, start + 640);
        let limit = match free {
            _ if send < 0 => Limit::SendTime,
            Some(free) if start - free < least => Limit::Gap,
            _ if out as i64 > back && out > cycle_ns => Limit::MasterFrame,
            _ if back > cycle_ns as i64 => Limit::DeviceFrames,
            _ => {
                free = Some(back);
                continue;
            }
        };
        return Some((device, limit));
    }
    None
}

/// Cables by chance: planner and master say the same, and it is what the times of the sources make.
#[test]
fn hostile_planner_and_master_refuse_the_same_lines() {
    let (_said, mut draw) = seeded();
    let mut seen = [0_u32; 5];
    for _ in 0..3_000 {
        let (devices, published) = (1 + draw.below(12) as usize, draw.below(2) == 0);
        let (longest, cycle_ns) =
            ([30, 150, 600, 1_800][draw.below(4) as usize], [4_000, 8_000, 12_000][draw.below(3) as usize]);
        // The first cable and those after it: the master knows the mean of these.
        let (first, others) = (draw.below(longest + 1), draw.below(longest + 1));
        let cables: Vec<u64> = (0..devices).map(|k| if k == 0 { first } else { others }).collect();
        let want = misfit(&cables, published, cycle_ns);
        let slots = if published { Slots::Published } else { Slots::rule(first as u16) };
        let delays: Vec<u16> = cables.iter().map(|cable| *cable as u16).collect();
        let output = (4 * devices as u16).max(16);
        let line = Timing::new(&delays, devices as u8).with_output_len(output).with_slots(Some(slots));
        let planned = line.misfit(cycle_ns as u32).map(|misfit| (misfit.device, misfit.limit));
        let place = format!("{devices} devices, {first} and {others} ns, {slots}, {cycle_ns} ns");
        assert_eq!(planned, want, "{place}");
        let refusal = network::refusal(Config::new().with_cycle_ns(cycle_ns as u32).with_slots(slots), &cables);
        let refused = refusal.map(|error| match error {
            Error::CycleTooShort { device, .. } => (device, [Limit::MasterFrame, Limit::DeviceFrames]),
            Error::GapTooShort { device, .. } => (device, [Limit::Gap; 2]),
            Error::SendBeforeCycle { device, .. } => (device, [Limit::SendTime; 2]),
            other => panic!("{place}: {other}"),
        });
        assert_eq!(refused.map(|(device, _)| device), want.map(|(device, _)| device), "{place}: {refusal:?}");
        assert!(refused.is_none_or(|(_, limits)| limits.contains(&want.unwrap().1)), "{place}: {refusal:?}");
        seen[want.map_or(4, |(_, limit)| limit as usize)] += 1;
    }
    assert!(seen.iter().all(|count| *count > 20), "{seen:?}");
}
