//! A HIPERFACE DSL link in free running: heads, answers with their V-frames, trailers.

use super::rng::Rng;
use super::speech::{Expect, Side, Speech};

/// abcdei of D.0 to D.31 in the column of running disparity -, then K28.
const SIX: [&str; 33] = [
    "100111", "011101", "101101", "110001", "110101", "101001", "011001", "111000", "111001", "100101", "010101",
    "110100", "001101", "101100", "011100", "010111", "011011", "100011", "010011", "110010", "001011", "101010",
    "011010", "111010", "110011", "100110", "010110", "110110", "001110", "101110", "011110", "101011", "001111",
];
/// fghj of y in the column -, for data and for K28.
const FOUR: [&str; 8] = ["1011", "1001", "0101", "1100", "1101", "1010", "0110", "1110"];
const FOUR_K28: [&str; 8] = ["1011", "0110", "1010", "1100", "1101", "0101", "1001", "0111"];

fn bits(text: &str) -> Vec<bool> {
    text.bytes().map(|bit| bit == b'1').collect()
}

fn inverse(bits: &[bool]) -> Vec<bool> {
    bits.iter().map(|bit| !bit).collect()
}

fn ones(bits: &[bool]) -> usize {
    bits.iter().filter(|bit| **bit).count()
}

/// A byte or control character by 8b/10b; `plus` is the running disparity.
pub fn encode(byte: u8, control: bool, plus: &mut bool) -> Vec<bool> {
    let (x, y) = (usize::from(byte & 31), usize::from(byte >> 5));
    let k28 = control && x == 28;
    let six = bits(SIX[if k28 { 32 } else { x }]);
    let neutral = ones(&six) == 3;
    let six = if *plus && (!neutral || x == 7) { inverse(&six) } else { six };
    *plus ^= !neutral;
    let seven = matches!((x, *plus), (17 | 18 | 20, false) | (11 | 13 | 14, true)) || control;
    let four = match (k28, y) {
        (true, _) => bits(FOUR_K28[y]),
        (false, 7) if seven => bits("0111"),
        (false, _) => bits(FOUR[y]),
    };
    let neutral = ones(&four) == 2;
    let four = if *plus && (!neutral || y == 3 || k28) { inverse(&four) } else { four };
    *plus ^= !neutral;
    [six, four].concat()
}

/// The parameter byte, each block in the version with more zeros where the line has sent no surplus of zeros.
fn parameter(byte: u8) -> Vec<bool> {
    let (x, y) = (usize::from(byte & 31), usize::from(byte >> 5));
    let six = bits(SIX[if x == 28 { 32 } else { x }]);
    let six = if x == 7 || ones(&six) > 3 { inverse(&six) } else { six };
    let four = bits(FOUR[y]);
    // After a surplus of zeros the block goes out the other way.
    let behind = ones(&six) < 3;
    let four = match ones(&four) {
        2 if y == 3 => bits("0011"),
        2 => four,
        _ if behind => four,
        _ => inverse(&four),
    };
    [six, four].concat()
}

fn crc16(bytes: &[u8]) -> [u8; 2] {
    let mut crc = 0_u16;
    for byte in bytes {
        crc ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            crc = if crc & 0x8000 == 0 { crc << 1 } else { crc << 1 ^ 0x90d9 };
        }
    }
    (crc ^ 0x00ff).to_be_bytes()
}

/// An acceleration of eleven bits with its CRC-5.
fn acceleration(value: i16) -> [u8; 2] {
    let value = (value as u16) & 0x7ff;
    let mut crc = 0_u16;
    for k in (0..11).rev() {
        let carry = (crc >> 4 & 1) ^ (value >> k & 1);
        crc = crc << 1 & 0x1f;
        if carry == 1 {
            crc ^= 0x05;
        }
    }
    (value << 5 | (crc ^ 0x1f)).to_be_bytes()
}

/// H-frames of a link that is running, `frames` of them, from the first of a V-frame on.
pub fn link(rng: &mut Rng, frames: usize, delay: f64, missing: &mut dyn FnMut(&mut Rng) -> bool) -> Vec<Speech> {
    let mut out = Vec::new();
    let mut plus = rng.chance(0.5);
    let mut position = rng.below(1 << 30);
    let mut v_frame = ([0; 8], [0; 8]);
    let mut msync = false;
    for k in 0..frames {
        let at = k % 8;
        if at == 0 {
            msync = !msync;
            position += rng.below(100);
            let other = (!position) & 0xff_ffff_ffff;
            let block = |first: u8, value: u64| {
                let [_, _, _, p @ ..] = value.to_be_bytes();
                let data = [first, p[0], p[1], p[2], p[3], p[4]];
                let [high, low] = crc16(&data);
                [data[0], data[1], data[2], data[3], data[4], data[5], high, low]
            };
            v_frame = (block(0, position), block(0x1c | if msync { 0x80 } else { 0 }, other));
        }
        let byte = 0x90 | if msync { 0x40 } else { 0 };
        let head = [bits("001011"), bits("110"), bits("110"), bits("0000"), parameter(byte)].concat();
        let expect = Expect::ok(false, "H-frame", vec![("FIRST", 1), ("MSYNC", i64::from(msync))]);
        // TRAILER of the frame before went out in one piece with the head.
        let trailer = if k == 0 { Vec::new() } else { bits("000011") };
        out.push(Speech { side: Side::Controller, pause: 0.0, bits: [trailer, head].concat(), expect });
        let dd = rng.below(41) as i16 - 20;
        let [high, low] = acceleration(dd);
        let (vertical, secondary) = (v_frame.0[at], v_frame.1[at]);
        let parameters = 0x10 | if at == 7 { 0x80 } else { 0 };
        let mut answer = encode(vertical, false, &mut plus);
        answer.extend(encode(parameters, false, &mut plus));
        answer.extend(encode(0xfe, true, &mut plus));
        answer.extend(encode(high, false, &mut plus));
        answer.extend(encode(low, false, &mut plus));
        answer.push(!answer.last().unwrap());
        answer.extend(encode(secondary, at == 0, &mut plus));
        let fields = vec![
            ("VERT", i64::from(vertical)),
            ("VSYNC", i64::from(at == 7)),
            ("PIPE", 0xfe),
            ("DD", i64::from(dd)),
            ("SEC", i64::from(secondary)),
        ];
        let silent = missing(rng);
        let expect = if silent { Expect::silence("answer") } else { Expect::ok(true, "answer", fields) };
        let bits = if silent { Vec::new() } else { answer };
        // One bit for the change of direction, then the cable.
        out.push(Speech { side: Side::Encoder, pause: 1.0 + delay, bits, expect });
    }
    out
}
