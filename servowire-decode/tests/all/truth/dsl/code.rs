//! The line code and the checks, from the published tables.

/// abcdei of D.0 to D.31 in the column of running disparity -, then K28.
const SIX: &str = "100111 011101 101101 110001 110101 101001 011001 111000 111001 100101 010101 110100 001101 101100 \
    011100 010111 011011 100011 010011 110010 001011 101010 011010 111010 110011 100110 010110 110110 001110 101110 \
    011110 101011 001111";
/// fghj of y in the column -: of data, of K28.
const FOUR: &str = "1011 1001 0101 1100 1101 1010 0110 1110";
const FOUR_K28: &str = "1011 0110 1010 1100 1101 0101 1001 0111";
/// START, LEARN and CHECK are answered with it.
pub(super) const PATTERN: &str = "0100110011001000000100010101110111111011001100110100010011001";

pub(super) fn bits(text: &str) -> Vec<bool> {
    text.bytes().filter(|bit| matches!(bit, b'0' | b'1')).map(|bit| bit == b'1').collect()
}

fn word(table: &str, at: usize) -> Vec<bool> {
    bits(table.split_whitespace().nth(at).unwrap())
}

fn flipped(bits: &[bool]) -> Vec<bool> {
    bits.iter().map(|bit| !bit).collect()
}

/// Ones less zeros.
fn surplus(bits: &[bool]) -> i64 {
    bits.iter().map(|bit| if *bit { 1 } else { -1 }).sum()
}

/// 8b/10b with the running disparity `plus`.
pub(super) fn coded(byte: u8, control: bool, plus: &mut bool) -> Vec<bool> {
    let (x, y) = (usize::from(byte & 31), usize::from(byte >> 5));
    let k28 = control && x == 28;
    let mut six = word(SIX, if k28 { 32 } else { x });
    let even = surplus(&six) == 0;
    if *plus && (!even || x == 7) {
        six = flipped(&six);
    }
    *plus ^= !even;
    let other_seven = control || matches!((x, *plus), (17 | 18 | 20, false) | (11 | 13 | 14, true));
    let mut four = match (k28, y, other_seven) {
        (true, ..) => word(FOUR_K28, y),
        (_, 7, true) => bits("0111"),
        _ => word(FOUR, y),
    };
    let even = surplus(&four) == 0;
    if *plus && (!even || y == 3 || k28) {
        four = flipped(&four);
    }
    *plus ^= !even;
    [six, four].concat()
}

/// EQUALISATION and the parameter byte; `disparity`: ones less zeros that the master has sent.
pub(super) fn parameter(byte: u8, disparity: i64) -> Vec<bool> {
    let (equal, mut d) = match disparity {
        -1..=1 => ("0000", disparity),
        2 | 3 => ("0010", disparity - 2),
        4.. => ("0000", disparity - 4),
        -3 | -2 => ("1101", disparity + 2),
        _ => ("1111", disparity + 4),
    };
    let (x, y) = (usize::from(byte & 31), usize::from(byte >> 5));
    let mut six = word(SIX, if x == 28 { 32 } else { x });
    if x == 7 {
        six = bits("000111");
    }
    if surplus(&six) != 0 {
        let more_zeros = if surplus(&six) > 0 { flipped(&six) } else { six };
        six = if d >= 0 { more_zeros } else { flipped(&more_zeros) };
    }
    d += surplus(&six);
    let mut four = word(FOUR, y);
    if y == 3 {
        four = bits("0011");
    }
    if surplus(&four) != 0 {
        let more_zeros = if surplus(&four) > 0 { flipped(&four) } else { four };
        four = if d >= 0 { more_zeros } else { flipped(&more_zeros) };
    }
    [bits(equal), six, four].concat()
}

/// The byte of ten bits, and whether it is a special character, if they are in a table.
pub(super) fn decoded(line: &[bool]) -> Option<(u8, bool)> {
    let all = (0..=255).map(|byte| (byte, false));
    let special = [0x1c, 0x3c, 0x5c, 0x7c, 0x9c, 0xbc, 0xdc, 0xfc, 0xf7, 0xfb, 0xfd, 0xfe].map(|byte| (byte, true));
    all.chain(special)
        .find(|(byte, control)| [false, true].iter().any(|plus| coded(*byte, *control, &mut plus.clone()) == line))
}

/// Whether a word is another one in each column, so that it tells the running disparity.
pub(super) fn tells(byte: u8, control: bool) -> bool {
    coded(byte, control, &mut false) != coded(byte, control, &mut true)
}

/// x^16 + x^15 + x^12 + x^7 + x^6 + x^4 + x^3 + 1, inverted in its low byte, after the bytes.
pub(super) fn sealed(bytes: &[u8]) -> Vec<u8> {
    let mut crc = 0_u32;
    for byte in bytes {
        for k in (0..8).rev() {
            let carry = (crc >> 15 ^ u32::from(*byte) >> k) & 1;
            crc = crc << 1 & 0xffff ^ if carry == 1 { 0x90d9 } else { 0 };
        }
    }
    [bytes, &[(crc >> 8) as u8, crc as u8 ^ 0xff]].concat()
}

/// Eleven bits and x^5 + x^2 + 1 over them, inverted.
pub(super) fn acceleration(value: i64) -> [u8; 2] {
    let value = (value & 0x7ff) as u16;
    let mut crc = 0_u16;
    for k in (0..11).rev() {
        let carry = (crc >> 4 ^ value >> k) & 1;
        crc = crc << 1 & 31 ^ if carry == 1 { 5 } else { 0 };
    }
    (value << 5 | crc ^ 31).to_be_bytes()
}
