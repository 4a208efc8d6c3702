use crc::{Algorithm, Crc, Table};

/// CRC-8 of the responses in mirrored form, which suits words whose first line bit is bit 0.
///
/// The check field travels most significant bit first, all other fields least significant bit first. With the register mirrored
/// (generator 0x1D reversed, 0xB8), both have their first line bit in bit 0.
const MIRRORED: Algorithm<u8> =
    Algorithm { width: 8, poly: 0x1d, init: 0, refin: true, refout: true, xorout: 0, check: 0x56, residue: 0 };

static TABLE: Crc<u8, Table<1>> = Crc::<u8, Table<1>>::new(&MIRRORED);

/// Computes the mirrored CRC-8 over bytes whose first line bit is bit 0.
pub(crate) fn mirrored(bytes: &[u8]) -> u8 {
    TABLE.checksum(bytes)
}

/// Returns the register after eight more bits.
#[inline(always)]
#[expect(clippy::indexing_slicing, reason = "a byte indexes 256 entries")]
pub(crate) fn next(register: u8) -> u8 {
    let [table] = TABLE.table();
    table[usize::from(register)]
}

/// Returns the register after 16 more content bits, the first line bit in bit 0.
#[inline(always)]
pub(crate) fn next_word(register: u8, content: u16) -> u8 {
    let [low, high] = content.to_le_bytes();
    next(next(register ^ low) ^ high)
}

/// The CRC-8 of a response, updated as the response arrives: bit by bit, byte by byte or word by word.
///
/// Generator x^8 + x^4 + x^3 + x^2 + 1 (0x1D), initial value 0, no final XOR; bits enter in the order of the line.
/// It covers all content bits of all frames, the information field with its sync code included, but neither start
/// bits nor delimiters, and is sent most significant bit first (AM243x Motor Control SDK, "Nikon Protocol Design").
///
/// The generator is primitive, of order 255. In responses of 32 to 96 content bits, every error of one or two bits and every
/// burst of up to eight content bits is detected. Of all errors of three bits 0.36 to 0.50 % pass, of four bits 0.39 %.
///
/// ```
/// use nikon_aformat::Crc8;
/// // a response to command 1 as a vendor manual prints it: 3E03 00EF DF35, the last byte is the CRC
/// let by_word = Crc8::new().word(0x3e03).word(0x00ef).byte(0xdf);
/// assert_eq!(by_word.get(), 0x35);
/// assert_eq!(by_word.byte(0x35).get(), 0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crc8(u8);

impl Crc8 {
    const GENERATOR: u8 = 0x1d;

    /// Creates the register before the first bit.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Takes one content bit.
    pub const fn bit(self, bit: bool) -> Self {
        let out = self.0 >> 7 == 1;
        Self((self.0 << 1) ^ if out == bit { 0 } else { Self::GENERATOR })
    }

    /// Takes eight content bits, the first on the line in bit 7.
    pub fn byte(self, byte: u8) -> Self {
        Self(mirrored(&[(self.0 ^ byte).reverse_bits()]).reverse_bits())
    }

    /// Takes the 16 content bits of a frame, the first on the line in bit 15.
    pub fn word(self, word: u16) -> Self {
        let [first, second] = word.to_be_bytes();
        self.byte(first).byte(second)
    }

    /// The check value. Over a whole response including its check field, it is 0.
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// Computes the CRC-8 over whole bytes, the first line bit in bit 7 of the first byte.
///
/// ```
/// assert_eq!(nikon_aformat::crc8(b"123456789"), 0x37);
/// ```
pub fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(Crc8::new(), |crc, byte| crc.byte(*byte)).get()
}

/// The CRC-3 of request frames, updated bit by bit.
///
/// Generator x^3 + x + 1 (0x3), initial value 0, no final XOR (CRC-3/GSM inverts its result and is a different check).
/// It covers the ten bits between sync code and check field and is sent most significant bit first.
///
/// A frame has 13 covered bits including the check, and the generator has order 7, so two wrong bits exactly seven positions
/// apart are not detected: six pairs. Single wrong bits and bursts of up to three are detected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Crc3(u8);

impl Crc3 {
    /// Creates the register before the first bit.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Takes one bit.
    pub const fn bit(self, bit: bool) -> Self {
        let out = self.0 >> 2 & 1 == 1;
        Self((self.0 << 1 & 7) ^ if out == bit { 0 } else { 3 })
    }

    /// The check value, 0..=7.
    pub const fn get(self) -> u8 {
        self.0
    }
}

/// Computes the CRC-3 over the ten covered bits of a request frame, the first on the line in bit 0; higher bits are ignored.
///
/// ```
/// // command 1 to encoder 0: FC 00, EA 000, CC 10000
/// assert_eq!(nikon_aformat::crc3(0b00001_000_00), 0b001);
/// ```
#[expect(clippy::indexing_slicing, reason = "five bits index a table of 32")]
pub const fn crc3(bits: u16) -> u8 {
    LOW[(bits & 31) as usize] ^ HIGH[(bits >> 5 & 31) as usize]
}

// The check is linear, so that of ten bits is two table entries of five bits each.
static LOW: [u8; 32] = half(0);
static HIGH: [u8; 32] = half(5);

#[expect(clippy::indexing_slicing, clippy::arithmetic_side_effects, reason = "evaluated by the compiler")]
const fn half(shift: u32) -> [u8; 32] {
    let mut table = [0; 32];
    let mut value = 0;
    while value < table.len() {
        let mut crc = Crc3::new();
        let mut at = 0;
        while at < 10 {
            crc = crc.bit(value << shift >> at & 1 == 1);
            at += 1;
        }
        table[value] = crc.get();
        value += 1;
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Long division by `poly` (without its top term) of `width` bits, as the definition has it.
    fn division(bits: impl Iterator<Item = bool>, poly: u32, width: u32) -> u32 {
        bits.fold(0, |rest, bit| {
            let out = (rest >> (width - 1) & 1 == 1) != bit;
            (rest << 1 ^ if out { poly } else { 0 }) & ((1 << width) - 1)
        })
    }

    fn msb_first(bytes: &[u8]) -> impl Iterator<Item = bool> {
        bytes.iter().flat_map(|byte| (0..8).rev().map(move |k| byte >> k & 1 == 1))
    }

    #[test]
    fn check_values() {
        assert_eq!(crc8(b"123456789"), 0x37);
        assert_eq!(mirrored(b"123456789"), 0x56);
        assert_eq!(msb_first(b"123456789").fold(Crc3::new(), Crc3::bit).get(), 3);
        let lsb_first = b"123456789".map(u8::reverse_bits);
        assert_eq!(crc8(&lsb_first), 0x6a);
        assert_eq!(msb_first(&lsb_first).fold(Crc3::new(), Crc3::bit).get(), 2);
    }

    #[test]
    fn crc3_of_all_1024_inputs() {
        for bits in 0..1024_u16 {
            let line = (0..10).map(|k| bits >> k & 1 == 1);
            assert_eq!(u32::from(crc3(bits)), division(line, 3, 3));
            assert_eq!(crc3(bits | 0xfc00), crc3(bits));
        }
    }

    /// Two wrong bits of a request frame pass exactly when they are seven positions apart.
    #[test]
    fn crc3_is_blind_at_distance_seven() {
        let syndrome = |at: u32| if at < 10 { crc3(1 << at) } else { 1 << (12 - at) };
        let blind =
            (0..13).flat_map(|a| (a + 1..13).map(move |b| (a, b))).filter(|(a, b)| syndrome(*a) == syndrome(*b));
        assert_eq!(blind.collect::<std::vec::Vec<_>>(), (0..6).map(|a| (a, a + 7)).collect::<std::vec::Vec<_>>());
        assert!((0..13).all(|at| syndrome(at) != 0));
    }

    /// The undetected shares that the documentation states, counted.
    #[test]
    fn crc8_strength() {
        let sizes = [(32, 0.36), (48, 0.50), (64, 0.48), (96, 0.41)];
        for (bits, missed3) in sizes.into_iter().take(if cfg!(miri) { 1 } else { 4 }) {
            let syndrome: std::vec::Vec<u8> =
                (0..bits).map(|at| (0..bits).fold(Crc8::new(), |crc, k| crc.bit(k == at)).get()).collect();
            let (mut two, mut three, mut triples) = (0, 0, 0);
            for a in 0..bits {
                assert_ne!(syndrome[a], 0);
                for b in a + 1..bits {
                    two += usize::from(syndrome[a] == syndrome[b]);
                    for c in b + 1..bits {
                        three += usize::from(syndrome[a] ^ syndrome[b] == syndrome[c]);
                        triples += 1;
                    }
                }
            }
            assert_eq!(two, 0);
            let share = f64::from(three as u32) * 100.0 / f64::from(triples);
            assert!((share - missed3).abs() < 0.006, "{bits} bits: {share} %");
        }
    }

    proptest! {
        #[test]
        fn bit_byte_word_and_whole_agree(words in prop::collection::vec(any::<u16>(), 0..7)) {
            let bytes: std::vec::Vec<u8> = words.iter().flat_map(|word| word.to_be_bytes()).collect();
            let whole = crc8(&bytes);
            prop_assert_eq!(u32::from(whole), division(msb_first(&bytes), 0x1d, 8));
            prop_assert_eq!(msb_first(&bytes).fold(Crc8::new(), Crc8::bit).get(), whole);
            prop_assert_eq!(bytes.iter().fold(Crc8::new(), |crc, byte| crc.byte(*byte)).get(), whole);
            prop_assert_eq!(words.iter().fold(Crc8::new(), |crc, word| crc.word(*word)).get(), whole);
            let by_words = words.iter().fold(0, |register, word| next_word(register, word.reverse_bits()));
            prop_assert_eq!(by_words.reverse_bits(), whole);
            let mirror: std::vec::Vec<u8> = bytes.iter().map(|byte| byte.reverse_bits()).collect();
            prop_assert_eq!(mirrored(&mirror).reverse_bits(), whole);
        }
    }
}
