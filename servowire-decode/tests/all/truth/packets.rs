//! SORTE as it is on the network, and a capture file of it: start-up, then the exchange. No code of the crates.

use std::fmt::Write as _;

use super::rng::Rng;
use super::{Said, Shown};

/// A network, and how long it is listened to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Network {
    pub(crate) devices: usize,
    pub(crate) cycles: usize,
    /// Share of frames of which a bit is flipped, and of those that are not in the capture.
    pub(crate) damaged: f64,
    pub(crate) missing: f64,
    /// Share of packets of other protocols between them.
    pub(crate) foreign: f64,
    /// Frames that the capture cuts off.
    pub(crate) cut: f64,
}

impl Network {
    pub(crate) const PLAIN: Self = Self { devices: 4, cycles: 30, damaged: 0.0, missing: 0.0, foreign: 0.0, cut: 0.0 };
}

/// Which interface a packet is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Start-up, sent or received by the master; what its last four bytes are.
    Ethernet { inbound: bool },
    /// The exchange has no Ethernet header.
    Exchange,
}

/// A packet with what it says; of foreign traffic nothing.
#[derive(Debug, Clone)]
pub(crate) struct Packet {
    /// Nanoseconds from the first one on.
    pub(crate) ns: u64,
    pub(crate) side: Side,
    pub(crate) bytes: Vec<u8>,
    pub(crate) said: Option<Said>,
}

fn number(value: impl Into<i64>) -> Shown {
    Shown::Number(value.into())
}

fn status(raw: u8) -> (&'static str, Shown) {
    let names = [(1, "LAST"), (2, "DONE"), (4, "ERROR"), (8, "STATE_CHANGE")];
    let set = names.iter().filter(|(bit, _)| raw & bit != 0).map(|(_, name)| *name).collect();
    ("STATUS", Shown::Flags(raw.into(), set))
}

/// The check of Ethernet, a bit after the other.
fn fcs(bytes: &[u8]) -> [u8; 4] {
    let mut sum = !0_u32;
    for byte in bytes {
        sum ^= u32::from(*byte);
        for _ in 0..8 {
            sum = if sum & 1 == 1 { sum >> 1 ^ 0xedb8_8320 } else { sum >> 1 };
        }
    }
    (!sum).to_le_bytes()
}

/// x^8 + x^2 + x + 1, a bit after the other.
fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| {
        (0..8).fold(sum ^ byte, |sum: u8, _| if sum & 0x80 == 0 { sum << 1 } else { sum << 1 ^ 7 })
    })
}

/// What a frame of the start-up holds after its four bytes, and its fields.
type Body = (Vec<u8>, Vec<(&'static str, Shown)>);

fn discovery(found: usize, rng: &mut Rng) -> Body {
    let lengths: Vec<[u16; 2]> = (0..found).map(|_| [rng.below(5) as u16, rng.below(5) as u16]).collect();
    let sum = |at: usize| lengths.iter().map(|it| it[at]).sum::<u16>();
    let words = [found as u16, sum(0), sum(1)].into_iter().chain(lengths.iter().flatten().copied());
    let mut bytes: Vec<u8> = words.flat_map(u16::to_le_bytes).collect();
    // After the entries is a pattern that nobody reads.
    while bytes.len() < 1022 {
        bytes.push(rng.next() as u8);
    }
    (bytes, vec![("devices", number(found as i64)), ("in", number(sum(0))), ("out", number(sum(1)))])
}

fn param(rng: &mut Rng) -> Body {
    let cycle = rng.pick(&[4_000_u32, 10_000, 31_250, 62_500, 1_000_000]);
    let (burst, ipg) = (rng.below(256) as u8, rng.pick(&[40_u32, 52, 100, 192]));
    let mut bytes = cycle.to_le_bytes().to_vec();
    bytes.extend([0; 4]);
    bytes.extend(1000_u16.to_le_bytes());
    bytes.extend([burst, 1]);
    bytes.extend(320_u32.to_le_bytes());
    bytes.extend(ipg.to_le_bytes());
    bytes.extend([0; 8]);
    bytes.extend([0, 0, 0, 0x33]);
    let fields = vec![
        ("cycle_time", number(cycle)),
        ("delay_burst", number(burst)),
        ("ipg", number(i64::from(ipg) * 5)),
        ("crc_mode", number(0x33)),
    ];
    (bytes, fields)
}

fn sync(rng: &mut Rng) -> Body {
    let (stamp, delay) = (rng.next() as u32, rng.next() as u16);
    let bytes = [&stamp.to_le_bytes()[..], &delay.to_le_bytes()].concat();
    (bytes, vec![("time stamp", number(stamp)), ("delay", number(delay))])
}

/// A word of the machine and how it is read: which way, and when the step is.
fn word(rng: &mut Rng) -> (u16, String) {
    let (bit, sign) = rng.pick(&[(0, '+'), (0x8000, '-')]);
    match rng.below(6) {
        0 => (0x7fff, "off".to_owned()),
        1 | 2 => (bit, format!("{sign}.")),
        3 => {
            let low = 3991 + rng.below(0x7ffe - 3990) as u16;
            (bit | low, format!("{:04X}h?", bit | low))
        }
        _ => {
            let time = 1 + rng.below(3990) as u16;
            (bit | time, format!("{sign}{time}"))
        }
    }
}

fn master(devices: usize, rng: &mut Rng) -> Body {
    const NAMES: [&str; 4] = ["PTO 1", "PTO 2", "PTO 3", "PTO 4"];
    let (mut bytes, mut fields) = (vec![0, 0x30], vec![status(0x30)]);
    let mut digits = String::new();
    for at in 0..devices {
        let (word, text) = word(rng);
        let [low, high] = word.to_le_bytes();
        bytes.extend([low, high, 0, 0]);
        let _ = write!(digits, "{low:02X}{high:02X}0000");
        // The machine has four motors; a longer network is shown as it is.
        fields.extend(NAMES.get(at).filter(|_| devices <= 4).map(|name| (*name, Shown::Text(text))));
    }
    if devices > 4 {
        fields.push(("data", Shown::Text(digits)));
    }
    bytes.push(crc8(&bytes));
    let stamp = rng.next() as u16;
    bytes.extend(stamp.to_le_bytes());
    fields.push(("time stamp", number(stamp)));
    (bytes, fields)
}

fn device(address: u8, last: bool, rng: &mut Rng) -> Body {
    const DRIVER: [&str; 8] = ["OTS", "AOCP", "BOCP", "APDF", "BPDF", "UVLO", "STD", "STDLAT"];
    let bits = u8::from(last) | rng.pick(&[0, 0, 4]);
    let (driver, steps) = (rng.pick(&[0, 0, 0x40, 0xc1]), rng.next() as u16);
    let [low, high] = steps.to_le_bytes();
    let mut bytes = vec![address, bits, driver, low, high];
    bytes.push(crc8(&bytes));
    let set = (0..8).filter(|bit| driver >> bit & 1 == 1).map(|bit| DRIVER[bit]).collect();
    let fields = vec![
        ("SA", number(address)),
        status(bits),
        ("DRV8711", Shown::Flags(driver.into(), set)),
        ("reserved or steps ordered", number(steps)),
    ];
    (bytes, fields)
}

/// What a network card hears of others.
fn foreign(rng: &mut Rng) -> Vec<u8> {
    let kind = rng.pick(&[[0x08, 0x00], [0x08, 0x06], [0x86, 0xdd], [0x88, 0xcc]]);
    let mut bytes: Vec<u8> = (0..12).map(|_| rng.next() as u8).collect();
    bytes.extend(kind);
    bytes.extend((0..46 + rng.below(400)).map(|_| rng.next() as u8));
    bytes
}

/// All packets, in their order.
pub(crate) fn build(network: &Network, seed: u64) -> Vec<Packet> {
    let mut rng = Rng::new(seed);
    let mut out: Vec<Packet> = Vec::new();
    let mut now = 0;
    // What is said four bytes long, and how often; the last of each says that the state changes.
    for (kind, name, times, first) in
        [(1, "DISCOVERY", 10, 0x00_u8), (2, "PARAM", 10, 0x10), (3, "DELAY_REQ", 16, 0x20), (5, "SYNC", 40, 0x40)]
    {
        for k in 0..times {
            let change = if k + 1 == times { 8 } else { 0 };
            let mut request = Vec::new();
            for inbound in [false, true] {
                let bits = first | change | u8::from(inbound && kind != 2);
                let (body, fields) = match kind {
                    1 => discovery(if inbound { network.devices } else { 0 }, &mut rng),
                    // It comes back as it was sent.
                    2 if inbound => std::mem::take(&mut request).pop().unwrap(),
                    2 => param(&mut rng),
                    3 => (Vec::new(), Vec::new()),
                    _ => sync(&mut rng),
                };
                if kind == 2 && !inbound {
                    request.push((body.clone(), fields.clone()));
                }
                let mut bytes = [&[0xff, 0x00, kind, bits], &body[..]].concat();
                bytes.extend(fcs(&bytes));
                let fields = [&[status(bits)][..], &fields].concat();
                now += 1000 + rng.below(90_000);
                let said = Said { kind: name.into(), start: now as f64 * 1e3, fields, position: None, damaged: false };
                out.push(Packet { ns: now, side: Side::Ethernet { inbound }, bytes, said: Some(said) });
            }
        }
    }
    for _ in 0..network.cycles {
        now += 1000;
        let mut heard = vec![("master", master(network.devices, &mut rng))];
        for at in 1..=network.devices {
            heard.push(("device", device(at as u8, at == network.devices, &mut rng)));
        }
        for (kind, (bytes, fields)) in heard {
            // No two in the same microsecond, in which a file may count.
            now += 1000 + rng.below(500);
            let said = Said { kind: kind.into(), start: now as f64 * 1e3, fields, position: None, damaged: false };
            out.push(Packet { ns: now, side: Side::Exchange, bytes, said: Some(said) });
        }
    }
    spoilt(network, out, &mut rng)
}

/// With what a capture makes of it: flipped bits, lost and cut packets, foreign ones.
fn spoilt(network: &Network, all: Vec<Packet>, rng: &mut Rng) -> Vec<Packet> {
    let mut out = Vec::new();
    for mut packet in all {
        if rng.chance(network.foreign) {
            let side = Side::Ethernet { inbound: true };
            out.push(Packet { ns: packet.ns - 100, side, bytes: foreign(rng), said: None });
        }
        if rng.chance(network.missing) {
            continue;
        }
        let said = packet.said.as_mut().unwrap();
        if rng.chance(network.damaged) {
            // The time stamp of the exchange is not covered by its check.
            let covered = packet.bytes.len() - if said.kind == "master" { 2 } else { 0 };
            packet.bytes[rng.below(covered as u64) as usize] ^= 1 << rng.below(8);
            said.damaged = true;
        } else if rng.chance(network.cut) {
            packet.bytes.truncate(1 + rng.below(packet.bytes.len() as u64 - 1) as usize);
            // Once in 256 times eight bits fit by chance.
            let fits = |at: usize| packet.bytes.get(at).is_some_and(|check| crc8(&packet.bytes[..at]) == *check);
            let size = packet.bytes.len();
            if packet.side == Side::Exchange && (fits(size - 1) || size > 2 && fits(size - 3)) {
                continue;
            }
            said.damaged = true;
        }
        out.push(packet);
    }
    out
}

/// How a file is written.
#[derive(Debug, Clone, Copy)]
pub(crate) struct File {
    /// The frames end with their check: the file says so, says nothing, or it was stripped (and the frames padded to 60 bytes).
    pub(crate) check: Check,
    /// Nanoseconds since 1970 of the first packet.
    pub(crate) epoch: u64,
    /// Time stamps: units in a second as a power of ten, or of two where the highest bit is set.
    pub(crate) units: u8,
    /// Bytes of numbers in the other order.
    pub(crate) big: bool,
}

/// What becomes of the check of Ethernet in a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Check {
    Told,
    Untold,
    Stripped,
    Padded,
}

impl File {
    /// A number of the file.
    fn put<const N: usize>(&self, out: &mut Vec<u8>, mut little: [u8; N]) {
        if self.big {
            little.reverse();
        }
        out.extend(little);
    }

    fn word(&self, out: &mut Vec<u8>, value: u32) {
        self.put(out, value.to_le_bytes());
    }

    fn half(&self, out: &mut Vec<u8>, value: u16) {
        self.put(out, value.to_le_bytes());
    }

    fn option(&self, out: &mut Vec<u8>, code: u16, value: &[u8]) {
        self.half(out, code);
        self.half(out, value.len() as u16);
        out.extend(value);
        out.resize(out.len().next_multiple_of(4), 0);
    }

    fn block(&self, out: &mut Vec<u8>, kind: u32, body: &[u8]) {
        self.word(out, kind);
        self.word(out, body.len() as u32 + 12);
        out.extend(body);
        self.word(out, body.len() as u32 + 12);
    }

    fn interface(&self, out: &mut Vec<u8>, link: u16) {
        let mut body = Vec::new();
        self.half(&mut body, link);
        self.half(&mut body, 0);
        self.word(&mut body, 0);
        self.option(&mut body, 9, &[self.units]);
        if self.check == Check::Told {
            self.option(&mut body, 13, &[4]);
        }
        self.option(&mut body, 0, &[]);
        self.block(out, 1, &body);
    }

    /// A stamp, and the picoseconds that it says.
    pub(crate) fn stamp(&self, ns: u64) -> (u64, f64) {
        let ns = u128::from(self.epoch + ns);
        let per_second = if self.units & 0x80 == 0 { 10_u128.pow(self.units.into()) } else { 1 << (self.units & 0x7f) };
        let stamp = ns * per_second / 1_000_000_000;
        (stamp as u64, (stamp * 1_000_000_000_000 / per_second) as f64)
    }

    /// What is in the file of a packet.
    pub(crate) fn bytes(&self, packet: &Packet) -> Vec<u8> {
        let mut bytes = packet.bytes.clone();
        let startup = matches!(packet.side, Side::Ethernet { .. }) && packet.said.is_some();
        if startup && matches!(self.check, Check::Stripped | Check::Padded) {
            bytes.truncate(bytes.len().saturating_sub(4));
            if self.check == Check::Padded {
                bytes.resize(bytes.len().max(60), 0);
            }
        }
        bytes
    }

    /// The file, as pcapng.
    pub(crate) fn pcapng(&self, packets: &[Packet]) -> Vec<u8> {
        let (mut out, mut body) = (Vec::new(), Vec::new());
        self.word(&mut body, 0x1a2b_3c4d);
        self.half(&mut body, 1);
        self.half(&mut body, 0);
        body.extend([0xff; 8]);
        self.block(&mut out, 0x0a0d_0d0a, &body);
        self.interface(&mut out, 1);
        self.interface(&mut out, 147);
        for packet in packets {
            let (stamp, bytes) = (self.stamp(packet.ns).0, self.bytes(packet));
            let mut body = Vec::new();
            self.word(&mut body, u32::from(packet.side == Side::Exchange));
            self.word(&mut body, (stamp >> 32) as u32);
            self.word(&mut body, stamp as u32);
            self.word(&mut body, bytes.len() as u32);
            self.word(&mut body, bytes.len() as u32);
            body.extend(&bytes);
            body.resize(body.len().next_multiple_of(4), 0);
            if let Side::Ethernet { inbound } = packet.side {
                let mut flags = Vec::new();
                self.word(&mut flags, if inbound { 1 } else { 2 });
                self.option(&mut body, 2, &flags);
                self.option(&mut body, 0, &[]);
            }
            self.block(&mut out, 6, &body);
        }
        out
    }

    /// The start-up as pcap of one interface, with stamps in nanoseconds.
    pub(crate) fn pcap(&self, packets: &[Packet]) -> Vec<u8> {
        let mut out = Vec::new();
        self.word(&mut out, 0xa1b2_3c4d);
        self.half(&mut out, 2);
        self.half(&mut out, 4);
        for value in [0, 0, 65535, 1] {
            self.word(&mut out, value);
        }
        for packet in packets {
            let (ns, bytes) = (self.epoch + packet.ns, self.bytes(packet));
            let size = bytes.len() as u32;
            let head = [(ns / 1_000_000_000) as u32, (ns % 1_000_000_000) as u32, size, size];
            for value in head {
                self.word(&mut out, value);
            }
            out.extend(bytes);
        }
        out
    }
}
