//! A half-duplex RS-485 line with start-stop traffic of T-Format or A-format. No code of the crates.

use super::line::Wire;
use super::rng::Rng;
use super::{Said, Shown};

/// What is spoken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Tformat,
    Aformat,
}

/// How the line behaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bus {
    pub(crate) kind: Kind,
    /// Bits a second.
    pub(crate) rate: f64,
    pub(crate) exchanges: usize,
    /// Clocks of controller and encoder as shares of the nominal one.
    pub(crate) clocks: [f64; 2],
    /// Share of answers with a flipped bit, and of those that do not come.
    pub(crate) damaged: f64,
    pub(crate) missing: f64,
    /// Spikes of up to a fifth of a bit, anywhere.
    pub(crate) spikes: usize,
    pub(crate) begins_low: bool,
    /// What the line does where nobody drives it.
    pub(crate) bias: Bias,
}

/// What a line does that nobody drives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Bias {
    /// It rests high.
    Good,
    /// It falls low; the driver is on so many bits before its start bit, and so many after its last bit.
    Missing { lead: f64, hold: f64 },
    /// It dips for so many bits when a driver lets go, before it rests high: least and most.
    Weak(f64, f64),
}

impl Bus {
    pub(crate) const PLAIN: Self = Self {
        kind: Kind::Tformat,
        rate: 2.5e6,
        exchanges: 40,
        clocks: [1.0; 2],
        damaged: 0.0,
        missing: 0.0,
        spikes: 0,
        begins_low: false,
        bias: Bias::Good,
    };
}

/// A request and its answer as bits, with all that may be said of them.
struct Exchange {
    kind: &'static str,
    request: Vec<bool>,
    asked: Vec<(&'static str, Shown)>,
    answer: Vec<bool>,
    said: Vec<(&'static str, Shown)>,
    position: Option<(&'static str, i64)>,
}

fn least_first(value: u64, bits: u32) -> Vec<bool> {
    (0..bits).map(|k| value >> k & 1 == 1).collect()
}

/// Start bit, bits, delimiter.
fn framed(bits: &[bool]) -> Vec<bool> {
    [&[false], bits, &[true]].concat()
}

fn bytes(all: &[u8]) -> Vec<bool> {
    all.iter().flat_map(|byte| framed(&least_first((*byte).into(), 8))).collect()
}

/// With the exclusive or of all of them behind.
fn checked(all: &[u8]) -> Vec<u8> {
    [all, &[all.iter().fold(0, |sum, byte| sum ^ byte)]].concat()
}

fn number(value: impl Into<i64>) -> Shown {
    Shown::Number(value.into())
}

fn tformat(rng: &mut Rng) -> Exchange {
    let abs = rng.below(1 << 23) as u32;
    // Half of the turns: beyond it they may be meant with a sign.
    let turns = rng.below(1 << 15) as u32;
    let [a0, a1, a2, _] = abs.to_le_bytes();
    let [m0, m1, ..] = turns.to_le_bytes();
    // No alarm, or the battery's with the bit of SF that says so.
    let (sf, almc) = rng.pick(&[(0, 0), (0, 0), (0x20, 0x40)]);
    let (address, data) = (rng.below(127) as u8, rng.below(256) as u8);
    let status = ("SF", number(sf));
    let (kind, asked, answered) = match rng.below(8) {
        0 => ("ID 0", vec![0x02], vec![0x02, sf, a0, a1, a2]),
        1 => ("ID 1", vec![0x8a], vec![0x8a, sf, m0, m1, 0]),
        2 => ("ID 2", vec![0x92], vec![0x92, sf, 23]),
        3 => ("ID 6", checked(&[0x32, address, data]), vec![0x32, address, data]),
        4 => ("ID D", checked(&[0xea, address]), vec![0xea, address, data]),
        _ => ("ID 3", vec![0x1a], vec![0x1a, sf, a0, a1, a2, 23, m0, m1, 0, almc]),
    };
    let answered = checked(&answered);
    let crc = ("CRC", number(*answered.last().unwrap()));
    let memory = [("ADF", number(address)), ("EDF", number(data))];
    let all = ("ABS", number(abs));
    let (request_fields, said, position) = match kind {
        "ID 0" => (vec![], vec![status, all, crc], Some(("ABS", i64::from(abs)))),
        "ID 1" => (vec![], vec![status, ("ABM", number(turns)), crc], None),
        "ID 2" => (vec![], vec![status, ("ENID", number(23)), crc], None),
        "ID 6" => ([&memory[..], &[("CRC", Shown::Any)]].concat(), [&memory[..], &[crc]].concat(), None),
        "ID D" => (vec![memory[0].clone(), ("CRC", Shown::Any)], [&memory[..], &[crc]].concat(), None),
        _ => {
            let said = vec![status, all, ("ENID", number(23)), ("ABM", number(turns)), ("ALMC", number(almc)), crc];
            (vec![], said, Some(("ABM, ABS", i64::from(turns) << 23 | i64::from(abs))))
        }
    };
    Exchange { kind, request: bytes(&asked), asked: request_fields, answer: bytes(&answered), said, position }
}

/// A remainder in the order of the line, its highest bit first.
fn remainder(bits: &[bool], width: u32, polynomial: u32) -> Vec<bool> {
    let mut sum = 0_u32;
    for bit in bits {
        let carry = (sum >> (width - 1) & 1 == 1) != *bit;
        sum = sum << 1 & ((1 << width) - 1) ^ if carry { polynomial } else { 0 };
    }
    (0..width).rev().map(|k| sum >> k & 1 == 1).collect()
}

fn aformat(rng: &mut Rng) -> Exchange {
    let ea = rng.below(8);
    let abs = rng.below(1 << 40);
    let (es, alarms) = rng.pick(&[(0, 0), (0, 0), (2, 1)]);
    let id = rng.below(1 << 24);
    let (code, kind, data): (u64, _, Vec<bool>) = match rng.below(6) {
        0 => (3, "STATUS", least_first(alarms, 24)),
        1 => (16, "ID_READ_1", least_first(id, 24)),
        2 => (27, "ABS24_STATUS", [least_first(abs, 24), least_first(alarms, 16)].concat()),
        3 => (1, "ABS24_LOW", least_first(abs, 24)),
        _ => (0, "ABS40", least_first(abs, 40)),
    };
    let covered = [vec![false; 2], least_first(ea, 3), least_first(code, 5)].concat();
    let request = [&[false, true, false], &covered[..], &remainder(&covered, 3, 0b011)].concat();
    let information = [&[false, false, true], &least_first(ea, 3)[..], &least_first(code, 5), &[false]].concat();
    let covered = [information, least_first(es, 4), data].concat();
    let crc = remainder(&covered, 8, 0x1d);
    let value = crc.iter().fold(0, |value: i64, bit| value << 1 | i64::from(*bit));
    let answer: Vec<bool> = [covered, crc].concat().chunks(16).flat_map(framed).collect();
    let low = (abs & 0xff_ffff) as i64;
    let mut said = vec![("EA", number(ea as i64)), ("ES", number(es as i64)), ("CRC", number(value))];
    let position = match kind {
        "ABS40" => Some(abs as i64),
        "ABS24_LOW" | "ABS24_STATUS" => Some(low),
        _ => None,
    };
    said.extend(position.map(|counts| ("ABS", number(counts))));
    match kind {
        "STATUS" | "ABS24_STATUS" => said.push(("ALM", number(alarms as i64))),
        "ID_READ_1" => said.push(("ID", number(id as i64))),
        _ => {}
    }
    let asked = vec![("EA", number(ea as i64))];
    let position = position.map(|counts| ("ABS", counts));
    Exchange { kind, request: framed(&request), asked, answer, said, position }
}

/// Traffic on the wire, and all that may be said of it.
pub(crate) fn build(bus: &Bus, seed: u64) -> (Wire, Vec<Said>, f64) {
    let mut rng = Rng::new(seed);
    let nominal = 1e12 / bus.rate;
    let [asks, answers] = bus.clocks.map(|clock| nominal * clock);
    let floats = matches!(bus.bias, Bias::Missing { .. });
    let mut wire = Wire::new(!bus.begins_low && !floats);
    let mut said = Vec::new();
    let mut now = 30.0 * nominal;
    wire.drive(now / 2.0, !floats);
    for _ in 0..bus.exchanges {
        let it = match bus.kind {
            Kind::Tformat => tformat(&mut rng),
            Kind::Aformat => aformat(&mut rng),
        };
        let start = now;
        now = speak(&mut wire, now, asks, &it.request, bus.bias, &mut rng);
        let heard = |mut fields: Vec<(&'static str, Shown)>| {
            // Spikes beside a frame are counted with it.
            // Where the last bit was flipped, its driver holds a low line high for a moment.
            let rings = bus.spikes > 0 || bus.damaged > 0.0 && bus.bias != Bias::Good;
            fields.extend(rings.then_some(("spikes", Shown::Any)));
            // A dip that was passed over is told.
            fields.extend(matches!(bus.bias, Bias::Weak(..)).then_some(("note", Shown::Any)));
            fields
        };
        said.push(Said { kind: it.kind.into(), start, fields: heard(it.asked), position: None, damaged: false });
        let pause = match bus.kind {
            Kind::Tformat => rng.between(2.7e6, 4.0e6),
            Kind::Aformat => rng.between(8.0, 20.0) * nominal,
        };
        if rng.chance(bus.missing) {
            now += 1200.0 * nominal;
        } else {
            let mut bits = it.answer;
            let damaged = rng.chance(bus.damaged);
            if damaged {
                let at = rng.below(bits.len() as u64) as usize;
                bits[at] = !bits[at];
            }
            let start = now + pause;
            now = speak(&mut wire, start, answers, &bits, bus.bias, &mut rng);
            let mut fields = heard(it.said);
            fields.push(("delay", Shown::Within(pause, 0.7 * nominal)));
            said.push(Said { kind: it.kind.into(), start, fields, position: it.position, damaged });
        }
        now += rng.between(20.0e6, 80.0e6);
    }
    spikes(&mut wire, bus.spikes, nominal, now, &mut rng);
    (wire, said, now)
}

/// Someone drives the line for these bits and lets go of it.
fn speak(wire: &mut Wire, start: f64, bit: f64, bits: &[bool], bias: Bias, rng: &mut Rng) -> f64 {
    if let Bias::Missing { lead, .. } = bias {
        wire.drive(start - lead * bit, lead > 0.0);
    }
    let end = wire.send(start, bit, bits);
    match bias {
        Bias::Good => wire.drive(end, true),
        Bias::Missing { hold, .. } => {
            wire.drive(end, hold > 0.0);
            wire.drive(end + hold * bit, false);
        }
        Bias::Weak(least, most) => {
            wire.drive(end, false);
            wire.drive(end + rng.between(least, most) * bit, true);
        }
    }
    end
}

fn spikes(wire: &mut Wire, count: usize, bit: f64, end: f64, rng: &mut Rng) {
    let mut toggles: Vec<f64> = wire.edges.iter().map(|(time, _)| *time).collect();
    for _ in 0..count {
        let from = rng.between(0.0, end);
        toggles.extend([from, from + rng.between(0.05, 0.2) * bit]);
    }
    toggles.sort_by(f64::total_cmp);
    let mut level = wire.begins;
    wire.edges = toggles
        .into_iter()
        .map(|time| {
            level = !level;
            (time, level)
        })
        .collect();
}
