//! The two checks of the link: CRC-16 over safe positions and messages, CRC-5 over the acceleration word.

use crc::{Algorithm, Crc, Table};

/// The parameters of the CRC-16 (SICK manual, VPOSCRC; HDSL Protocol Design, C code): x^16 + x^15 + x^12 + x^7 + x^6 +
/// x^4 + x^3 + 1, which the manual calls C86Ch, initial value 0, no reflection, final XOR 00FFh.
pub const CRC_16: Algorithm<u16> = Algorithm {
    width: 16,
    poly: 0x90d9,
    init: 0x0000,
    refin: false,
    refout: false,
    xorout: 0x00ff,
    check: 0x91c5,
    residue: 0x1576,
};

static TABLE: Crc<u16, Table<1>> = Crc::<u16, Table<1>>::new(&CRC_16);

/// Computes the CRC-16 of `bytes`, which is sent high byte first.
///
/// Every error of up to five bits in a block of 4, 8 or 14 bytes including its CRC is detected.
///
/// ```
/// assert_eq!(hdsl::crc16(b"123456789"), 0x91c5);
/// // SUMMARY and VPOS4..VPOS0 of a safe position
/// assert_eq!(hdsl::crc16(&[0x00, 0x00, 0x12, 0x34, 0x56, 0x78]), 0x3227);
/// ```
pub fn crc16(bytes: &[u8]) -> u16 {
    TABLE.checksum(bytes)
}

/// The CRC-16 computed byte by byte, for data that arrive at one byte per H-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct RunningCrc16(u16);

impl RunningCrc16 {
    /// Creates the register before the first byte.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Takes one more byte.
    #[inline]
    pub fn update(&mut self, byte: u8) {
        let mut digest = TABLE.digest_with_initial(self.0);
        digest.update(&[byte]);
        self.0 = digest.finalize() ^ CRC_16.xorout;
    }

    /// Returns the CRC to send after the bytes so far.
    pub const fn finish(self) -> u16 {
        self.0 ^ CRC_16.xorout
    }

    /// Returns whether the bytes so far end with their correct CRC.
    pub const fn is_residue(self) -> bool {
        self.0 == CRC_16.residue
    }
}

/// Remainders of the 32 five-bit chunks times x^5 by x^5 + x^2 + 1.
#[expect(clippy::indexing_slicing, reason = "runs at compile time")]
static FIVE: [u8; 32] = {
    let mut table = [0; 32];
    let mut chunk: u8 = 0;
    while chunk < 32 {
        let mut rest = chunk;
        let mut step = 0;
        while step < 5 {
            rest = if rest & 0x10 != 0 { (rest << 1) ^ 0x25 } else { rest << 1 };
            step += 1;
        }
        table[chunk as usize] = rest & 0x1f;
        chunk += 1;
    }
    table
};

/// Computes the CRC-5 of the 11 low bits of `value`, most significant bit first: x^5 + x^2 + 1, initial value 0, final XOR 1Fh.
///
/// Every error of one or two bits in the 16-bit word is detected; 19 of the 560 errors of three bits pass.
#[expect(clippy::indexing_slicing, reason = "five bits are below 32")]
pub(crate) const fn crc5(value: u16) -> u8 {
    let top = FIVE[(value >> 10 & 1) as usize];
    let middle = FIVE[(top as u16 ^ value >> 5 & 31) as usize];
    FIVE[((middle as u16 ^ value) & 31) as usize] ^ 0x1f
}

/// What the bytes of an acceleration word contribute to its syndrome: first the values of the high byte, then those of the low
/// byte.
#[expect(clippy::indexing_slicing, reason = "runs at compile time")]
static SYNDROME: [[u8; 256]; 2] = {
    let mut tables = [[0; 256]; 2];
    let mut byte: u8 = 0;
    loop {
        let high = (byte as u16) << 3;
        tables[0][byte as usize] = crc5(high);
        tables[1][byte as usize] = crc5((byte >> 5) as u16) ^ 0x1f ^ byte & 0x1f;
        if byte == 255 {
            break;
        }
        byte += 1;
    }
    tables
};

/// Returns whether the five low bits of a 16-bit word are the [`crc5`] of the eleven bits above them.
#[inline]
#[expect(clippy::indexing_slicing, reason = "a byte is below 256")]
pub(crate) const fn is_crc5_right([high, low]: [u8; 2]) -> bool {
    SYNDROME[0][high as usize] == SYNDROME[1][low as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn division(bits: impl Iterator<Item = bool>, width: u32, poly: u32) -> u32 {
        bits.fold(0, |r, bit| {
            let out = r >> (width - 1) & 1 == 1;
            (r << 1 & ((1 << width) - 1)) ^ if out ^ bit { poly } else { 0 }
        })
    }

    #[test]
    fn check_values() {
        assert_eq!(crc16(b"123456789"), CRC_16.check);
        assert_eq!(crc16(b""), 0x00ff);
        assert_eq!(crc16(&[0x1c, 0xff, 0xed, 0xcb, 0xa9, 0x87]), 0x7bd1);
    }

    #[test]
    fn crc5_equals_long_division() {
        for value in (0..2048_u16).step_by(crate::thin(89)) {
            let bits = (0..11).rev().map(|k| value >> k & 1 == 1);
            assert_eq!(u32::from(crc5(value)), division(bits, 5, 0x05) ^ 0x1f, "{value}");
            for check in 0..32 {
                let word = value << 5 | check;
                assert_eq!(is_crc5_right(word.to_be_bytes()), check == u16::from(crc5(value)), "{word:04x}");
            }
        }
    }

    proptest! {
        #[test]
        fn crc16_equals_long_division(bytes in prop::collection::vec(any::<u8>(), 0..16)) {
            let bits = bytes.iter().flat_map(|b| (0..8).rev().map(move |k| b >> k & 1 == 1));
            prop_assert_eq!(u32::from(crc16(&bytes)), division(bits, 16, 0x90d9) ^ 0xff);
            let mut running = RunningCrc16::new();
            for byte in &bytes {
                running.update(*byte);
            }
            prop_assert_eq!(running.finish(), crc16(&bytes));
            for byte in crc16(&bytes).to_be_bytes() {
                running.update(byte);
            }
            prop_assert!(running.is_residue());
        }
    }

    /// Of the 65,536 values that could stand after a message one is its check: both bytes count.
    #[test]
    fn one_check_value_is_right() {
        let mut message = RunningCrc16::new();
        for byte in b"123456789" {
            message.update(*byte);
        }
        for check in (0x91c5 % crate::thin(4099) as u16..=u16::MAX).step_by(crate::thin(4099)) {
            let mut running = message;
            for byte in check.to_be_bytes() {
                running.update(byte);
            }
            assert_eq!(running.is_residue(), check == 0x91c5, "{check:04x}");
        }
    }

    /// All errors of up to five bits in a block of four bytes are seen.
    #[test]
    fn five_bit_errors_in_four_bytes_are_seen() {
        let syndrome = |bit: u32| u32::from(crc16(&(1_u32 << bit).to_be_bytes()[..2]) ^ 0xff) ^ (1 << bit & 0xffff);
        let all: [u32; 32] = core::array::from_fn(|k| syndrome(k as u32));
        // An error of up to five bits is seen if no two different sets of at most two or three bits agree.
        for a in (0..32).rev().step_by(crate::thin(17)) {
            assert_ne!(all[a], 0);
            for b in a + 1..32 {
                assert_ne!(all[a] ^ all[b], 0);
                for c in b + 1..32 {
                    let three = all[a] ^ all[b] ^ all[c];
                    assert_ne!(three, 0);
                    for d in c + 1..32 {
                        assert_ne!(three ^ all[d], 0);
                        for e in d + 1..32 {
                            assert_ne!(three ^ all[d] ^ all[e], 0);
                        }
                    }
                }
            }
        }
    }
}
