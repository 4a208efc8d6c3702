//! The two checks of SORTE: CRC-8 for the IO exchange, the Ethernet FCS for everything else.

use crc::{CRC_8_SMBUS, CRC_32_ISO_HDLC, Crc, Table};

static CRC8: Crc<u8, Table<1>> = Crc::<u8, Table<1>>::new(&CRC_8_SMBUS);
static CRC32: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Returns the CRC-8 of `bytes`: polynomial 0x07, start value 0, nothing reflected, nothing inverted.
///
/// The start value 0 makes leading zero bytes invisible. Within 127 bits every single and double bit error is found;
/// of the 19 protected bytes of the stock master frame, the 25 bit pairs at a distance of 127 pass.
///
/// ```
/// assert_eq!(sorte_proto::crc8(b"123456789"), 0xf4);
/// ```
pub fn crc8(bytes: &[u8]) -> u8 {
    CRC8.checksum(bytes)
}

/// Continues a CRC-8 over more bytes: `crc8_update(crc8(a), b)` is the CRC-8 of `a` followed by `b`.
pub fn crc8_update(crc: u8, bytes: &[u8]) -> u8 {
    let mut digest = CRC8.digest_with_initial(crc);
    digest.update(bytes);
    digest.finalize()
}

/// Continues a CRC-8 over one more byte, for loops that also do something else.
#[inline]
pub(crate) fn crc8_step(crc: u8, byte: u8) -> u8 {
    let [table] = CRC8.table();
    table.get(usize::from(crc ^ byte)).copied().unwrap_or(0)
}

/// Returns the Ethernet frame check sequence over DA to the last payload byte: CRC-32, polynomial 0x04C11DB7, start value
/// all ones, reflected, inverted. Sent least significant byte first.
///
/// ```
/// assert_eq!(sorte_proto::fcs(b"123456789"), 0xcbf4_3926);
/// ```
pub fn fcs(bytes: &[u8]) -> u32 {
    CRC32.checksum(bytes)
}

/// The FCS of bytes that come one by one: four bytes of state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct RunningFcs(u32);

impl RunningFcs {
    pub(crate) const START: Self = Self(u32::MAX);

    #[inline]
    pub(crate) fn push(&mut self, byte: u8) {
        let [table] = CRC32.table();
        let [low, ..] = self.0.to_le_bytes();
        let entry = table.get(usize::from(low ^ byte)).copied().unwrap_or(0);
        self.0 = entry ^ self.0 >> 8;
    }

    pub(crate) const fn value(self) -> u32 {
        !self.0
    }

    /// Returns the FCS of all bytes except the last four, which were `trailer`. All of them have gone through
    /// [`push`](Self::push).
    ///
    /// No byte is held back; the last four steps are undone here.
    pub(crate) fn before(self, trailer: u32) -> u32 {
        const POLYNOMIAL: u32 = 0xedb8_8320;
        let undone = (0..32).fold(self.0, |register, _| {
            // A step shifts right and adds the polynomial, whose top bit is set, for each bit that falls out.
            if register & 1 << 31 == 0 { register << 1 } else { (register ^ POLYNOMIAL) << 1 | 1 }
        });
        !(undone ^ trailer)
    }

    /// Whether the bytes end with the FCS of the bytes before it; if so, the register always holds the same value.
    pub(crate) const fn is_whole(self) -> bool {
        self.0 == 0xdebb_20e3
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::collections::BTreeSet;
    use std::vec;
    use std::vec::Vec;

    use super::*;

    /// The definition of the polynomial, a bit at a time.
    fn bitwise(bytes: &[u8]) -> u8 {
        bytes
            .iter()
            .fold(0, |crc, byte| (0..8).fold(crc ^ byte, |c: u8, _| if c & 0x80 == 0 { c << 1 } else { c << 1 ^ 0x07 }))
    }

    #[test]
    fn every_byte_value_matches_the_polynomial() {
        for byte in 0..=u8::MAX {
            assert_eq!(crc8(&[byte]), bitwise(&[byte]));
        }
    }

    /// Every single and every double bit error of the 19 protected bytes; what passes is named.
    #[test]
    fn twenty_five_bit_pairs_of_the_stock_master_frame_pass() {
        let syndrome = |bit: usize| {
            let mut error = [0u8; 19];
            error[bit / 8] = 0x80 >> (bit % 8);
            crc8(&error[..18]) ^ error[18]
        };
        let syndromes: Vec<u8> = (0..152).map(syndrome).collect();
        assert!(syndromes.iter().all(|syndrome| *syndrome != 0));
        let stride = crate::stride(8);
        let pairs: BTreeSet<_> = (0..152)
            .step_by(stride)
            .flat_map(|a| (a + 1..152).map(move |b| (a, b)))
            .filter(|&(a, b)| syndromes[a] == syndromes[b])
            .collect();
        assert_eq!(pairs, (0..25).step_by(stride).map(|a| (a, a + 127)).collect());
    }

    proptest! {
        #[test]
        fn crc8_is_the_polynomial(bytes in proptest::collection::vec(any::<u8>(), 0..64)) {
            prop_assert_eq!(crc8(&bytes), bitwise(&bytes));
        }

        #[test]
        fn both_may_be_split_anywhere(bytes in proptest::collection::vec(any::<u8>(), 0..64), at: proptest::sample::Index) {
            let at = at.index(bytes.len() + 1);
            let (a, b) = bytes.split_at(at);
            prop_assert_eq!(crc8_update(crc8(a), b), crc8(&bytes));
            let mut running = RunningFcs::START;
            for &byte in &bytes {
                running.push(byte);
            }
            prop_assert_eq!(running.value(), fcs(&bytes));
            // Any four bytes after them: the FCS of what was before is still known.
            let trailer = at as u32 ^ fcs(&bytes);
            for byte in trailer.to_le_bytes() {
                running.push(byte);
            }
            prop_assert_eq!(running.before(trailer), fcs(&bytes));
            prop_assert_eq!(running.is_whole(), trailer == fcs(&bytes));
        }

        #[test]
        fn leading_zeros_do_not_show_in_crc8(bytes in proptest::collection::vec(any::<u8>(), 0..16), zeros in 0usize..16) {
            let mut longer = vec![0; zeros];
            longer.extend(&bytes);
            prop_assert_eq!(crc8(&longer), crc8(&bytes));
        }
    }
}
