//! A master against a network, and a device against a master, that know nothing of this crate: bytes, checks and times are written
//! here as the sources give them. Frames are lost, come twice, late, damaged, by a clock that drifts.
//!
//! `HOSTILE_EVENTS=10000000 cargo test --release -p sorte-proto --test all hostile:: -- --nocapture` runs as many frames.

mod device;
mod network;

use servowire_world::Draw;

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

/// The share of a test in all frames wanted; each line gets a quarter.
fn frames_of_a_line() -> u64 {
    servowire_world::wanted_events(400_000) / 8
}

#[test]
fn hostile_a_master_takes_no_stale_value_and_counts_every_loss() {
    let mut draw = Draw::default();
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
    let mut draw = Draw::default();
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
