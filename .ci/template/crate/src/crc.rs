use crc::{CRC_8_SMBUS, Crc, NoTable};

/// CRC-8 with the polynomial x^8 + x^2 + x + 1, initial value 0, neither reflected nor inverted. It sees every error of one or two bits.
pub const fn crc8(bytes: &[u8]) -> u8 {
    Crc::<u8, NoTable>::new(&CRC_8_SMBUS).checksum(bytes)
}
