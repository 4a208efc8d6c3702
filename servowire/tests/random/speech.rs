//! What encoders and controllers say, as bits: written from the tables of the protocols, with no code of the crates.

use super::rng::Rng;

/// Who drives the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    Controller,
    Encoder,
}

/// Bits of one speaker, and the pause before them in nominal bits.
#[derive(Debug, Clone)]
pub struct Speech {
    pub side: Side,
    pub pause: f64,
    pub bits: Vec<bool>,
    /// What a decoder should say of it; none where it says nothing.
    pub expect: Option<Expect>,
}

/// An event that is due.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Expect {
    pub answer: bool,
    pub kind: String,
    /// Fields and their numbers; flags by their raw value.
    pub fields: Vec<(&'static str, i64)>,
    /// `ok`, or the class of the refusal.
    pub verdict: &'static str,
}

impl Expect {
    pub fn ok(answer: bool, kind: &str, fields: Vec<(&'static str, i64)>) -> Option<Self> {
        Some(Self { answer, kind: kind.to_owned(), fields, verdict: "ok" })
    }

    pub fn silence(kind: &str) -> Option<Self> {
        Some(Self { answer: true, kind: kind.to_owned(), fields: Vec::new(), verdict: "no_response" })
    }
}

/// A protocol of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Tformat,
    Aformat,
    Dsl,
}

impl Kind {
    pub const ALL: [Self; 3] = [Self::Tformat, Self::Aformat, Self::Dsl];

    pub fn rates(self) -> &'static [f64] {
        match self {
            Self::Tformat => &[2.5e6, 5e6],
            Self::Aformat => &[2.5e6, 4e6, 20e6 / 3.0, 8e6, 16e6],
            Self::Dsl => &[9.375e6],
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Tformat => "T-Format",
            Self::Aformat => "A-format",
            Self::Dsl => "HIPERFACE DSL",
        }
    }
}

/// A field of eight bits: start, data with the least significant bit first, delimiter.
fn field(byte: u8) -> impl Iterator<Item = bool> {
    [false].into_iter().chain((0..8).map(move |k| byte >> k & 1 == 1)).chain([true])
}

fn fields(bytes: &[u8]) -> Vec<bool> {
    bytes.iter().flat_map(|byte| field(*byte)).collect()
}

/// Bytes, followed by their XOR.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    [bytes, &[bytes.iter().fold(0, |crc, byte| crc ^ byte)]].concat()
}

/// A T-Format transaction; `answered`: whether the encoder answers. `delay` in bits.
pub fn tformat(rng: &mut Rng, answered: bool, delay: f64) -> Vec<Speech> {
    // Control field, name.
    const IDS: [(u8, &str); 9] = [
        (0x02, "ID 0"),
        (0x8a, "ID 1"),
        (0x92, "ID 2"),
        (0x1a, "ID 3"),
        (0xba, "ID 7"),
        (0xc2, "ID 8"),
        (0x62, "ID C"),
        (0x32, "ID 6"),
        (0xea, "ID D"),
    ];
    let pick = if rng.below(10) < 6 { 3 } else { rng.below(9) as usize };
    let (cf, name) = IDS[pick];
    let (abs, abm) = (rng.below(1 << 23) as u32, rng.below(1 << 16) as u32);
    let ([a0, a1, a2, _], [m0, m1, m2, _]) = (abs.to_le_bytes(), abm.to_le_bytes());
    let almc = if rng.below(4) == 0 { 0x40 } else { 0 };
    let sf = if almc == 0 { 0 } else { 0x20 };
    let (adf, edf) = (rng.below(127) as u8, rng.below(256) as u8);
    let (request, asked, answer, said): (Vec<u8>, _, Vec<u8>, _) = match name {
        "ID 1" => (vec![cf], vec![], sealed(&[cf, sf, m0, m1, m2]), vec![("SF", sf.into()), ("ABM", abm.into())]),
        "ID 2" => (vec![cf], vec![], sealed(&[cf, sf, 0x17]), vec![("ENID", 0x17)]),
        "ID 3" => (
            vec![cf],
            vec![],
            sealed(&[cf, sf, a0, a1, a2, 0x17, m0, m1, m2, almc]),
            vec![("ABS", abs.into()), ("ABM", abm.into()), ("ALMC", almc.into())],
        ),
        "ID 6" => (
            sealed(&[cf, adf, edf]),
            vec![("ADF", adf.into()), ("EDF", edf.into())],
            sealed(&[cf, adf, edf]),
            vec![("ADF", adf.into()), ("EDF", edf.into())],
        ),
        "ID D" => (
            sealed(&[cf, adf]),
            vec![("ADF", adf.into())],
            sealed(&[cf, adf, edf]),
            vec![("ADF", adf.into()), ("EDF", edf.into())],
        ),
        _ => (vec![cf], vec![], sealed(&[cf, sf, a0, a1, a2]), vec![("SF", sf.into()), ("ABS", abs.into())]),
    };
    exchange(fields(&request), fields(&answer), name, asked, said, answered, delay)
}

fn exchange(
    request: Vec<bool>,
    answer: Vec<bool>,
    name: &str,
    asked: Vec<(&'static str, i64)>,
    said: Vec<(&'static str, i64)>,
    answered: bool,
    delay: f64,
) -> Vec<Speech> {
    let expect = Expect::ok(false, name, asked);
    let mut out = vec![Speech { side: Side::Controller, pause: 0.0, bits: request, expect }];
    let (bits, expect) =
        if answered { (answer, Expect::ok(true, name, said)) } else { (Vec::new(), Expect::silence(name)) };
    out.push(Speech { side: Side::Encoder, pause: delay, bits, expect });
    out
}

/// Bits of a value, least significant first.
fn lsb(value: u64, bits: u32) -> Vec<bool> {
    (0..bits).map(|k| value >> k & 1 == 1).collect()
}

/// The remainder of a polynomial division in line order, most significant bit first.
fn remainder(bits: &[bool], width: u32, polynomial: u32) -> Vec<bool> {
    let top = 1 << (width - 1);
    let mut crc = 0_u32;
    for bit in bits {
        let carry = (crc & top != 0) != *bit;
        crc = crc << 1 & ((1 << width) - 1);
        if carry {
            crc ^= polynomial;
        }
    }
    (0..width).rev().map(|k| crc >> k & 1 == 1).collect()
}

/// A frame of eighteen bits.
fn frame(content: &[bool]) -> Vec<bool> {
    assert_eq!(content.len(), 16);
    [&[false], content, &[true]].concat()
}

/// An A-format transaction.
pub fn aformat(rng: &mut Rng, answered: bool, delay: f64) -> Vec<Speech> {
    let ea = rng.below(8);
    let abs = rng.below(1 << 33);
    let es = if rng.below(4) == 0 { 2 } else { 0 };
    let temperature = rng.below(400);
    let id = rng.below(1 << 24);
    let (data, address) = (rng.below(1 << 16), rng.below(0xf0));
    // Code, name, data bits after the information field, expected fields.
    let (code, name, body, said): (u64, _, Vec<bool>, Vec<(&'static str, i64)>) = match rng.below(9) {
        0 => (1, "ABS24_LOW", lsb(abs, 24), vec![("ABS", (abs & 0xff_ffff) as i64)]),
        1 => (3, "STATUS", [lsb(0x40, 16), lsb(0, 8)].concat(), vec![("ALM", 0x40)]),
        2 => (15, "TEMPERATURE", [lsb(temperature, 10), lsb(0, 14)].concat(), vec![]),
        3 => (16, "ID_READ_1", lsb(id, 24), vec![("ID", id as i64)]),
        4 => (
            13,
            "EEPROM_READ",
            [lsb(data, 16), lsb(address, 8)].concat(),
            vec![("address", address as i64), ("data", data as i64)],
        ),
        5 => (
            27,
            "ABS24_STATUS",
            [lsb(abs, 24), lsb(1, 16)].concat(),
            vec![("ABS", (abs & 0xff_ffff) as i64), ("ALM", 1)],
        ),
        6 => (21, "ABS17", lsb(abs >> 9, 8), vec![("ABS", (abs & 0x1_ffff) as i64)]),
        _ => (0, "ABS40", lsb(abs, 40), vec![("ABS", abs as i64)]),
    };
    let es = if code == 13 { 0 } else { es };
    let sync = [false, true, false];
    let cdf = |frame_code: u64, content: Vec<bool>| {
        let covered = [lsb(frame_code, 2), content].concat();
        frame(&[&sync[..], &covered, &remainder(&covered, 3, 0b011)].concat())
    };
    let mut request = cdf(0, [lsb(ea, 3), lsb(code, 5)].concat());
    let mut asked = vec![("EA", ea as i64)];
    if code == 13 {
        // MDF2 with the address, a microsecond later: an idle line of whole bits.
        request.extend([true; 4]);
        request.extend(cdf(3, lsb(address, 8)));
        asked.push(("address", address as i64));
    }
    let head = [false, false, true];
    let information = if code == 21 {
        [&head[..], &lsb(ea, 3), &[es != 0], &lsb(abs, 9)].concat()
    } else {
        [&head[..], &lsb(ea, 3), &lsb(code, 5), &[false], &lsb(es, 4)].concat()
    };
    let covered = [information, body].concat();
    let content = [&covered[..], &remainder(&covered, 8, 0x1d)].concat();
    let answer = content.chunks(16).flat_map(frame).collect();
    let said = [vec![("EA", ea as i64)], said].concat();
    exchange(request, answer, name, asked, said, answered, delay)
}
