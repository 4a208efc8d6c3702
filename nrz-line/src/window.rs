use crate::BitOrder;

/// Up to 128 consecutive bits of a line, the first one in bit 0.
///
/// One bounds check and one load turn a whole frame into an integer; a protocol crate then tests its framing with constant
/// masks and takes every field with a constant shift.
///
/// ```text
/// bytes (LsbFirst)   |7 6 5 4 3 2 1 0|7 6 5 4 3 2 1 0|7 6 ...
///                           ^ offset 3      ...
/// window                    bit 0, then upwards
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Window {
    bits: u128,
    len: u32,
}

/// The buffer ends before the window does, or the window is longer than 128 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[error("window of {len} bits at bit {offset} does not fit: {available} bits there, 128 at most")]
pub struct OutOfBounds {
    /// The first requested bit, counted from the start of the buffer.
    pub offset: usize,
    /// Number of requested bits.
    pub len: u32,
    /// Number of bits that the buffer holds from `offset`.
    pub available: usize,
}

impl Window {
    /// Longest window, in bits.
    pub const MAX_LEN: u32 = 128;

    /// The empty window.
    pub const EMPTY: Self = Self { bits: 0, len: 0 };

    /// Takes the `len` bits of `bytes` that begin at line bit `offset`.
    ///
    /// # Errors
    /// [`OutOfBounds`] if `bytes` ends earlier or `len` exceeds [`Self::MAX_LEN`].
    #[expect(clippy::cast_possible_truncation, reason = "an offset in a byte is below 8")]
    pub fn read(bytes: &[u8], offset: usize, len: u32, order: BitOrder) -> Result<Self, OutOfBounds> {
        let whole = bytes.len().saturating_mul(8);
        let available = whole.saturating_sub(offset);
        let refuse = OutOfBounds { offset, len, available };
        if len > Self::MAX_LEN || offset > whole || (len as usize) > available {
            return Err(refuse);
        }
        let Some(tail) = bytes.get(offset / 8..) else { return Err(refuse) };
        let mut word = [0; 16];
        for (to, from) in word.iter_mut().zip(tail) {
            *to = *from;
        }
        let ahead = (offset & 7) as u32;
        let next = tail.get(16).copied().unwrap_or(0);
        let (low, high) = match order {
            BitOrder::LsbFirst => (u128::from_le_bytes(word), next),
            BitOrder::MsbFirst => (u128::from_be_bytes(word).reverse_bits(), next.reverse_bits()),
        };
        let bits = match ahead {
            0 => low,
            _ => low >> ahead | u128::from(high) << 128_u32.saturating_sub(ahead),
        };
        Ok(Self { bits: bits & Self::mask(len), len })
    }

    /// Creates a window of the `len` lowest bits of `bits`; `None` if `len` exceeds [`Self::MAX_LEN`].
    pub const fn from_bits(bits: u128, len: u32) -> Option<Self> {
        if len > Self::MAX_LEN {
            return None;
        }
        Some(Self { bits: bits & Self::mask(len), len })
    }

    /// The bits, the first on the line in bit 0; bits at and above [`len`](Self::len) are 0.
    pub const fn bits(self) -> u128 {
        self.bits
    }

    /// Length in bits, 0..=128.
    pub const fn len(self) -> u32 {
        self.len
    }

    /// Returns whether the window holds no bit.
    pub const fn is_empty(self) -> bool {
        self.len == 0
    }

    /// Returns the level of line bit `at`; `None` after the end.
    pub const fn get(self, at: u32) -> Option<bool> {
        if at < self.len { Some(self.bits >> at & 1 == 1) } else { None }
    }

    /// Returns the same line with every level inverted, as if the two wires of the pair were swapped.
    pub const fn inverted(self) -> Self {
        Self { bits: !self.bits & Self::mask(self.len), len: self.len }
    }

    /// Returns the same line with the bits of each byte in the other order, as if it had been packed in one order and read
    /// in the other. Bits after the last whole byte become what the other order finds there, which is padding, read as 0.
    pub const fn reordered(self) -> Self {
        Self { bits: self.bits.swap_bytes().reverse_bits() & Self::mask(self.len), len: self.len }
    }

    /// Returns every second bit, starting with the first: undoes sampling twice per bit. The result is half as long, rounded up.
    pub(crate) const fn decimated(self) -> Self {
        // Pairs of bits move together, then fours, eights ...
        let mut bits = self.bits & (u128::MAX / 3);
        bits = (bits | bits >> 1) & (u128::MAX / 5);
        bits = (bits | bits >> 2) & (u128::MAX / 17);
        bits = (bits | bits >> 4) & (u128::MAX / 257);
        bits = (bits | bits >> 8) & (u128::MAX / 65_537);
        bits = (bits | bits >> 16) & (u128::MAX / ((1 << 32) + 1));
        bits = (bits | bits >> 32) & u64::MAX as u128;
        Self { bits, len: self.len.div_ceil(2) }
    }

    /// Returns the window extended to `len` bits with idle line (1); unchanged if it is already that long. `None` if `len`
    /// exceeds [`Self::MAX_LEN`].
    pub const fn padded(self, len: u32) -> Option<Self> {
        if self.len >= len {
            return Some(self);
        }
        Self::from_bits(self.bits | !Self::mask(self.len), len)
    }

    /// Returns the window without its first `count` bits; `None` if it has fewer.
    pub const fn skip(self, count: u32) -> Option<Self> {
        match self.len.checked_sub(count) {
            Some(0) => Some(Self::EMPTY),
            Some(len) => Some(Self { bits: self.bits >> count, len }),
            None => None,
        }
    }

    /// Returns the bits as bytes, the first line bit in the first byte; bits after the end are 0.
    pub const fn to_bytes(self, order: BitOrder) -> [u8; 16] {
        match order {
            BitOrder::LsbFirst => self.bits.to_le_bytes(),
            BitOrder::MsbFirst => self.bits.reverse_bits().to_be_bytes(),
        }
    }

    /// Overwrites the bits of `bytes` that begin at line bit `offset`; other bits are left unchanged.
    ///
    /// # Errors
    /// [`OutOfBounds`] if `bytes` ends earlier; nothing is written then.
    #[expect(clippy::cast_possible_truncation, reason = "an offset in a byte is below 8")]
    pub fn write(self, bytes: &mut [u8], offset: usize, order: BitOrder) -> Result<(), OutOfBounds> {
        let whole = bytes.len().saturating_mul(8);
        let available = whole.saturating_sub(offset);
        let refuse = OutOfBounds { offset, len: self.len, available };
        if offset > whole || (self.len as usize) > available {
            return Err(refuse);
        }
        let Some(tail) = bytes.get_mut(offset / 8..) else { return Err(refuse) };
        let ahead = (offset & 7) as u32;
        let mut bits = self.bits.wrapping_shl(ahead);
        let mut mask = Self::mask(self.len).wrapping_shl(ahead);
        // Bits pushed out at the top belong to a seventeenth byte.
        let spill = 128_u32.saturating_sub(ahead);
        let carry = self.bits.checked_shr(spill).unwrap_or(0);
        let carry_mask = Self::mask(self.len).checked_shr(spill).unwrap_or(0);
        for (at, byte) in tail.iter_mut().take(17).enumerate() {
            if at == 16 {
                (bits, mask) = (carry, carry_mask);
            }
            let [value, _, ..] = bits.to_le_bytes();
            let [select, _, ..] = mask.to_le_bytes();
            *byte = match order {
                BitOrder::LsbFirst => *byte & !select | value,
                BitOrder::MsbFirst => *byte & !select.reverse_bits() | value.reverse_bits(),
            };
            bits >>= 8;
            mask >>= 8;
        }
        Ok(())
    }

    const fn mask(len: u32) -> u128 {
        match 1_u128.checked_shl(len) {
            Some(one) => one.wrapping_sub(1),
            None => u128::MAX,
        }
    }
}

#[cfg(feature = "bitvec")]
#[cfg_attr(docsrs, doc(cfg(feature = "bitvec")))]
impl<O: bitvec::order::BitOrder> TryFrom<&bitvec::slice::BitSlice<u8, O>> for Window {
    type Error = OutOfBounds;

    /// Takes the bits of a slice in its own order, for host tools that keep captures in `bitvec`.
    fn try_from(slice: &bitvec::slice::BitSlice<u8, O>) -> Result<Self, OutOfBounds> {
        let len = u32::try_from(slice.len()).unwrap_or(u32::MAX);
        if len > Self::MAX_LEN {
            return Err(OutOfBounds { offset: 0, len, available: slice.len() });
        }
        let bits = slice.iter().by_vals().rev().fold(0, |bits, bit| bits << 1 | u128::from(bit));
        Ok(Self { bits, len })
    }
}

#[cfg(feature = "bitvec")]
#[cfg_attr(docsrs, doc(cfg(feature = "bitvec")))]
impl Window {
    /// Returns the bits as a `bitvec` array of 128 bits in the order `O`; take the first [`len`](Self::len) of them.
    ///
    /// ```
    /// use bitvec::prelude::*;
    /// let window = nrz_line::Window::from_bits(0b0101, 4).unwrap();
    /// let bits = window.to_bitarray::<Msb0>();
    /// assert_eq!(bits[..4], bits![1, 0, 1, 0]);
    /// ```
    pub fn to_bitarray<O: bitvec::order::BitOrder>(self) -> bitvec::array::BitArray<[u8; 16], O> {
        let mut out = bitvec::array::BitArray::ZERO;
        for at in 0..self.len {
            out.set(at as usize, self.bits >> at & 1 == 1);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    /// Line bit `k` of `bytes`, by definition of the order.
    fn bit(bytes: &[u8], k: usize, order: BitOrder) -> bool {
        let in_byte = match order {
            BitOrder::LsbFirst => k % 8,
            BitOrder::MsbFirst => 7 - k % 8,
        };
        bytes[k / 8] >> in_byte & 1 == 1
    }

    fn orders() -> impl Strategy<Value = BitOrder> {
        prop_oneof![Just(BitOrder::LsbFirst), Just(BitOrder::MsbFirst)]
    }

    /// Every offset and every length over a buffer that is longer than the widest window.
    #[test]
    fn reads_every_offset_and_length() {
        let bytes: Vec<u8> = (0..20u8).map(|k| k.wrapping_mul(157).wrapping_add(91)).collect();
        for order in [BitOrder::LsbFirst, BitOrder::MsbFirst] {
            for offset in (0..=161usize).step_by(if cfg!(miri) { 23 } else { 1 }) {
                for len in (0..=129u32).step_by(if cfg!(miri) { 16 } else { 1 }) {
                    let got = Window::read(&bytes, offset, len, order);
                    if len > 128 || offset + len as usize > 160 {
                        assert_eq!(got, Err(OutOfBounds { offset, len, available: 160usize.saturating_sub(offset) }));
                        continue;
                    }
                    let want = (0..len).fold(0, |w, k| w | u128::from(bit(&bytes, offset + k as usize, order)) << k);
                    let got = got.unwrap();
                    assert_eq!((got.bits(), got.len()), (want, len), "{order:?} {offset} {len}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn write_then_read(bytes in any::<[u8; 20]>(), bits: u128, len in 0..=128u32, at in 0..=32usize, order in orders()) {
            let window = Window::from_bits(bits, len).unwrap();
            let mut out = bytes;
            window.write(&mut out, at, order).unwrap();
            prop_assert_eq!(Window::read(&out, at, len, order), Ok(window));
            for k in (0..at).chain(at + len as usize..160) {
                prop_assert_eq!(bit(&out, k, order), bit(&bytes, k, order), "bit {} changed", k);
            }
        }

        #[test]
        fn bytes_round_trip(bits: u128, len in 0..=128u32, order in orders()) {
            let window = Window::from_bits(bits, len).unwrap();
            prop_assert_eq!(Window::read(&window.to_bytes(order), 0, len, order), Ok(window));
        }
    }

    #[test]
    fn a_refused_write_changes_nothing() {
        let mut bytes = [0x5a; 3];
        let window = Window::from_bits(u128::MAX, 20).unwrap();
        assert_eq!(window.write(&mut bytes, 5, BitOrder::LsbFirst).unwrap_err().available, 19);
        assert_eq!(bytes, [0x5a; 3]);
    }

    #[test]
    fn offsets_at_the_end_of_the_address_space_are_refused() {
        assert!(Window::read(&[0; 4], usize::MAX, 1, BitOrder::LsbFirst).is_err());
        assert_eq!(Window::read(&[0; 4], 32, 0, BitOrder::LsbFirst).map(Window::len), Ok(0));
    }

    #[test]
    fn skip_get_and_invert() {
        let window = Window::from_bits(0b1101, 4).unwrap();
        assert_eq!(window.skip(2).unwrap(), Window::from_bits(0b11, 2).unwrap());
        assert_eq!(window.skip(5), None);
        let levels = [0, 1, 2, 3, 4].map(|at| window.get(at));
        assert_eq!(levels, [Some(true), Some(false), Some(true), Some(true), None]);
        assert_eq!(window.inverted().bits(), 0b0010);
    }

    #[test]
    fn a_line_read_in_the_wrong_order() {
        let line = Window::from_bits(0b0000_0001_1101_0011, 16).unwrap();
        assert_eq!(line.reordered(), Window::from_bits(0b1000_0000_1100_1011, 16).unwrap());
        // Five bits are the low end of one byte; the other order finds them at its high end.
        assert_eq!(
            Window::from_bits(0b1_0011, 5).unwrap().reordered(),
            Window::from_bits(0b0_1000, 5).unwrap_or(Window::EMPTY)
        );
        assert_eq!(line.reordered().reordered(), line);
    }

    #[test]
    fn a_line_sampled_twice_a_bit() {
        let twice = Window::from_bits(0b11_00_11_11_00, 10).unwrap();
        assert_eq!(twice.decimated(), Window::from_bits(0b1_0110, 5).unwrap());
        assert_eq!(Window::from_bits(0b101, 3).unwrap().decimated(), Window::from_bits(0b11, 2).unwrap());
        assert_eq!(
            Window::from_bits(u128::MAX, 128).unwrap().decimated(),
            Window::from_bits(u64::MAX.into(), 64).unwrap()
        );
    }

    /// Bit k of the half line is bit 2k of the whole one, whatever stands between.
    #[test]
    fn every_second_bit_of_any_line() {
        let bits = 0x0123_4567_89ab_cdef_fedc_ba98_7654_3210_u128;
        for bits in [bits, !bits, bits ^ (u128::MAX / 3), bits.rotate_left(9)] {
            for len in 0..=128 {
                let whole = Window::from_bits(bits, len).unwrap();
                let half = whole.decimated();
                assert_eq!(half.len(), len.div_ceil(2));
                assert!((0..half.len()).all(|at| half.get(at) == whole.get(2 * at)), "{len} bits of {bits:x}");
                assert_eq!(half.bits() >> half.len(), 0);
            }
        }
    }

    /// A window fits up to the last bit of a buffer, and nothing fits after it.
    #[test]
    fn the_end_of_a_buffer() {
        let mut bytes = [0; 3];
        let ones = Window::from_bits(0xff, 8).unwrap();
        assert_eq!(ones.write(&mut bytes, 16, BitOrder::LsbFirst), Ok(()));
        assert_eq!(bytes, [0, 0, 0xff]);
        assert_eq!(ones.write(&mut bytes, 17, BitOrder::LsbFirst).map_err(|error| error.available), Err(7));
        assert_eq!(Window::EMPTY.write(&mut bytes, 24, BitOrder::LsbFirst), Ok(()));
        assert_eq!(Window::EMPTY.write(&mut bytes, 25, BitOrder::LsbFirst).map_err(|error| error.available), Err(0));
        assert!(Window::EMPTY.is_empty() && !ones.is_empty());
    }

    #[test]
    fn a_line_that_goes_idle() {
        let line = Window::from_bits(0b01, 2).unwrap();
        assert_eq!(line.padded(5), Window::from_bits(0b1_1101, 5));
        assert_eq!((line.padded(1), line.padded(129)), (Some(line), None));
        assert_eq!(Window::EMPTY.padded(128), Window::from_bits(u128::MAX, 128));
    }

    #[cfg(feature = "bitvec")]
    #[test]
    fn bitvec_in_both_orders() {
        use bitvec::order::{Lsb0, Msb0};
        let window = Window::from_bits(0x2_9c41_77d3, 37).unwrap();
        let lsb = window.to_bitarray::<Lsb0>();
        let msb = window.to_bitarray::<Msb0>();
        assert_eq!(Window::try_from(&lsb[..37]), Ok(window));
        assert_eq!(Window::try_from(&msb[..37]), Ok(window));
        assert_eq!(lsb.into_inner(), window.to_bytes(BitOrder::LsbFirst));
        assert_eq!(msb.into_inner(), window.to_bytes(BitOrder::MsbFirst));
        let long = bitvec::array::BitArray::<[u8; 17], Lsb0>::new([0xff; 17]);
        assert_eq!(Window::try_from(&long[..128]).map(Window::bits), Ok(u128::MAX));
        assert_eq!(Window::try_from(&long[..129]), Err(OutOfBounds { offset: 0, len: 129, available: 129 }));
    }
}
