//! Support for a line without a suitable UART: an SPI or PIO that takes several samples per bit, and sends them.
//!
//! If MISO is connected to the receiver's output, the SPI clock is a multiple of the bit rate, and DMA fills a buffer, every
//! SPI bit is a sample. MOSI, connected to the driver's input, sends in the same way. Where each sample lies in the buffer
//! depends on the peripheral:
//!
//! ```text
//!  line, time ->        s0 s1 s2 s3 s4 s5 s6 s7 | s8 ...
//!
//!  LsbFirst8            byte 0 = s0 in bit 0 ... s7 in bit 7       the order of nrz-line and of the protocol crates
//!  MsbFirst8            byte 0 = s0 in bit 7 ... s7 in bit 0
//!  LsbFirst16           u16    = s0 in bit 0 ... s15 in bit 15     little-endian bytes are in order again
//!  MsbFirst16           u16    = s0 in bit 15 ... s15 in bit 0     in memory byte 0 holds s8 ... s15
//!  ShiftRight32 (PIO)   u32    = s0 in bit 0 ... s31 in bit 31     in order again
//!  ShiftLeft32 (PIO)    u32    = s0 in bit 31 ... s31 in bit 0
//! ```

/// How a peripheral of a little-endian processor puts samples into memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Order {
    /// SPI, 8 bits, least significant bit first.
    LsbFirst8,
    /// SPI, 8 bits, most significant bit first: the usual setting, and the only one of the RP2040's SPI.
    MsbFirst8,
    /// SPI, 16 bits, least significant bit first.
    LsbFirst16,
    /// SPI, 16 bits, most significant bit first.
    MsbFirst16,
    /// PIO, shift right, 32 bits.
    ShiftRight32,
    /// PIO, shift left, 32 bits.
    ShiftLeft32,
}

impl Order {
    /// Number of bytes per word.
    const fn word(self) -> usize {
        match self {
            Self::LsbFirst8 | Self::MsbFirst8 => 1,
            Self::LsbFirst16 | Self::MsbFirst16 => 2,
            Self::ShiftRight32 | Self::ShiftLeft32 => 4,
        }
    }

    const fn is_reversed(self) -> bool {
        matches!(self, Self::MsbFirst8 | Self::MsbFirst16 | Self::ShiftLeft32)
    }
}

/// Converts samples between the order of a peripheral and that of the line (sample n in bit n % 8 of byte n / 8); the conversion
/// is the same in both directions. Bytes after the last whole word are left unchanged.
pub(crate) fn reorder(samples: &mut [u8], order: Order) {
    if !order.is_reversed() {
        return;
    }
    for word in samples.chunks_exact_mut(order.word()) {
        word.reverse();
        for byte in word {
            *byte = byte.reverse_bits();
        }
    }
}

/// Writes line bits as `per_bit` samples each, for a peripheral of this order. They are preceded by ones, for at least one bit
/// and up to whole bytes, and followed by at least a byte of ones up to the end of a word, because the state of a data line
/// between transfers is undefined. Switch the line driver on and off during these ones. Returns the number of bytes written.
///
/// # Errors
/// [`TooShort`] if `out` ends earlier; its contents are then undefined.
pub fn write(
    bits: impl IntoIterator<Item = bool>,
    per_bit: u8,
    order: Order,
    out: &mut [u8],
) -> Result<usize, TooShort> {
    let lead = usize::from(per_bit).div_ceil(8).max(1);
    out.get_mut(..lead).ok_or(TooShort)?.fill(0xff);
    let mut at = lead.saturating_mul(8);
    for bit in bits {
        for _ in 0..per_bit {
            let place = out.get_mut(at / 8).ok_or(TooShort)?;
            let mask = 1 << (at % 8);
            // A new byte begins with ones, so that what is left of it is idle.
            *place = if at % 8 == 0 { 0xff } else { *place };
            *place = if bit { *place | mask } else { *place & !mask };
            at = at.saturating_add(1);
        }
    }
    let idle = at.div_ceil(8);
    let len = idle.saturating_add(1).next_multiple_of(order.word());
    out.get_mut(idle..len).ok_or(TooShort)?.fill(0xff);
    reorder(out.get_mut(..len).ok_or(TooShort)?, order);
    Ok(len)
}

/// The buffer ends before the samples do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[error("the buffer is too short for the samples")]
pub struct TooShort;

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const ALL: [Order; 6] = [
        Order::LsbFirst8,
        Order::MsbFirst8,
        Order::LsbFirst16,
        Order::MsbFirst16,
        Order::ShiftRight32,
        Order::ShiftLeft32,
    ];

    /// s0 is the first sample: 0000 0001 0100 1100 0111 0000 1111 0101, which is no palindrome in any order.
    const LINE: u32 = 0b0000_0001_0100_1100_0111_0000_1111_0101;

    /// What a peripheral makes of those samples, by the drawing above.
    fn memory(order: Order) -> [u8; 4] {
        let sample = |n: u32| LINE >> (31 - n) & 1;
        let word = |from: u32, len: u32, msb: bool| {
            (0..len).fold(0, |word, n| word | sample(from + n) << if msb { len - 1 - n } else { n })
        };
        let [a, b, c, d] = [0, 8, 16, 24];
        match order {
            Order::LsbFirst8 => [a, b, c, d].map(|at| word(at, 8, false) as u8),
            Order::MsbFirst8 => [a, b, c, d].map(|at| word(at, 8, true) as u8),
            Order::LsbFirst16 | Order::MsbFirst16 => {
                let [one, two] = [a, c].map(|at| (word(at, 16, order == Order::MsbFirst16) as u16).to_le_bytes());
                [one[0], one[1], two[0], two[1]]
            }
            Order::ShiftRight32 | Order::ShiftLeft32 => word(a, 32, order == Order::ShiftLeft32).to_le_bytes(),
        }
    }

    #[test]
    fn every_order_becomes_the_order_of_the_line() {
        for order in ALL {
            let mut samples = memory(order);
            reorder(&mut samples, order);
            assert_eq!(samples, LINE.reverse_bits().to_le_bytes(), "{order:?}");
            reorder(&mut samples, order);
            assert_eq!(samples, memory(order), "{order:?}");
        }
    }

    #[test]
    fn bits_become_samples_between_ones() {
        let bits = [false, true, true, false, false, true, false, true, false, true];
        for order in ALL {
            for per_bit in [4, 5, 8] {
                let mut out = [0; 24];
                let len = write(bits, per_bit, order, &mut out).unwrap();
                assert_eq!(len % order.word(), 0);
                let samples = out.get_mut(..len).unwrap();
                reorder(samples, order);
                let line: Vec<_> = samples.iter().flat_map(|byte| (0..8).map(move |k| byte >> k & 1 == 1)).collect();
                let want = bits.iter().flat_map(|bit| core::iter::repeat_n(*bit, per_bit.into()));
                let want: Vec<_> = core::iter::repeat_n(true, 8).chain(want).collect();
                assert_eq!(line.get(..want.len()), Some(want.as_slice()), "{order:?} {per_bit}");
                let rest = line.get(want.len()..).unwrap();
                assert!(rest.len() >= 8 && rest.iter().all(|sample| *sample));
                for short in 0..len {
                    let mut out = [0; 24];
                    assert_eq!(write(bits, per_bit, order, out.get_mut(..short).unwrap()), Err(TooShort));
                }
            }
        }
    }
}
