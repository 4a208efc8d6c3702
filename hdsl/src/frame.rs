//! The H-frame: what the master sends, as bits and as oversampled bytes.
//!
//! ```text
//!  bit    0      6    9             9+E    12+E  16+E    26+E 27+E      88+E    100+E    108+E
//!         | SYNC | 11 | EXTRA | 0 | 110 | EQUAL | PARA |  | answer | reserve | TRAILER | STUFFING
//!         001011       1...10                             released   for the   00000011   N x 001011
//!                          ^ the encoder samples          1 bit      cable
//! ```
//!
//! The encoder reports its position at the instant of the falling edge inside SAMPLE. A free-running frame has no
//! EXTRA window and no stuffing, and takes 108 bits or 11.52 us; in sync mode the window of 4..=9 bits and 0..=26 stuffing
//! blocks stretch it (HDSL Protocol Design; SICK manual, p. 31).

use nrz_line::Window;

use crate::error::Error;
use crate::line_code::LineDisparity;
use crate::parameter::ParameterByte;
use crate::ranged::ranged;
use crate::symbol::Word;

/// Line rate in bits per second.
pub const BIT_RATE: u32 = 9_375_000;
/// Samples per bit at 75 MHz.
pub const SAMPLES_PER_BIT: u32 = 8;
/// Bits of a free-running H-frame.
pub const H_FRAME_BITS: u32 = 108;
/// Number of H-frames in a V-frame.
pub const V_FRAME: u8 = 8;
/// Bits of the encoder's answer.
pub const ANSWER_BITS: u32 = 61;
/// Bits kept free after the answer for the delay of the cable.
pub const DELAY_RESERVE_BITS: u32 = 12;
/// Bits of TRAILER; the first two are left to the idle line.
pub const TRAILER_BITS: u32 = 8;
/// Bits of a stuffing block.
pub const STUFFING_BITS: u32 = 6;

/// SYNC and a stuffing block, first line bit in bit 0: 0 0 1 0 1 1.
const SYNC: u128 = 0b11_0100;
/// SYNC and the two ones of SAMPLE.
const FIXED: u32 = 0b1111_0100;
/// TRAILER: 0 0 0 0 0 0 1 1.
const TRAILER: u8 = 0b1100_0000;

ranged! {
    /// The EXTRA window of sync mode: the level is high for 24..=72 eighths of a bit, then low to the end of the bit. The number
    /// is the place of the falling edge, in eighths from the start of the window.
    pub struct Extra(24..=72);
}

ranged! {
    /// Number of stuffing blocks after a frame, 0..=26.
    pub struct Stuffing(0..=26);
}

impl Extra {
    /// Number of bits that the window occupies, 3..=9.
    pub const fn bits(self) -> u8 {
        self.0.div_ceil(8)
    }

    /// EXTRA_EDGE: the samples of the last bit, the first one in bit 7. 00h means a whole bit of ones.
    ///
    /// ```
    /// # use hdsl::frame::Extra;
    /// assert_eq!(Extra::new(60).map(Extra::edge_register), Some(0xf0));
    /// assert_eq!(Extra::new(64).map(Extra::edge_register), Some(0x00));
    /// ```
    pub const fn edge_register(self) -> u8 {
        edge_register(self.0 % 8)
    }

    /// Time from the falling edge to the end of the window, in ns rounded up.
    pub(crate) const fn low_ns(self) -> u8 {
        let eighths = self.0.wrapping_neg() % 8;
        // 13 1/3 ns each.
        eighths.wrapping_mul(13).wrapping_add(eighths.div_ceil(3))
    }

    /// The samples of the last bit, as on the line.
    const fn last_bit(self) -> u8 {
        if self.0 % 8 == 0 { 0xff } else { self.edge_register() }
    }
}

/// Returns EXTRA_EDGE for TIME_REST (0..=7): that many ones from bit 7 down.
pub(crate) const fn edge_register(time_rest: u8) -> u8 {
    match 0xff_u8.checked_shr(time_rest as u32) {
        Some(zeros) => !zeros,
        None => 0xff,
    }
}

/// The first part of an H-frame, from SYNC to PARA.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Head {
    byte: ParameterByte,
    extra: Option<Extra>,
    equalisation: u8,
    para: Word,
}

impl Head {
    /// Bits without an EXTRA window.
    pub const BITS: u32 = 26;

    /// Creates the head for a parameter byte. `before` is the disparity before EQUALISATION, including the ones of the EXTRA
    /// window if there is one (the partly high last bit counts as a one).
    #[inline]
    pub const fn new(byte: ParameterByte, extra: Option<Extra>, before: LineDisparity) -> Self {
        Self::coded(byte, extra, before).0
    }

    /// Creates the head, and returns it with the line disparity after it.
    #[inline]
    pub(crate) const fn coded(
        byte: ParameterByte,
        extra: Option<Extra>,
        before: LineDisparity,
    ) -> (Self, LineDisparity) {
        let equalised = before.equalisation();
        let coded = equalised.disparity.encode(byte);
        (Self { byte, extra, equalisation: equalised.bits, para: coded.word }, coded.disparity)
    }

    /// The parameter byte.
    pub const fn byte(self) -> ParameterByte {
        self.byte
    }

    /// The EXTRA window; `None` when free running.
    pub const fn extra(self) -> Option<Extra> {
        self.extra
    }

    /// The four EQUALISATION bits, first line bit in bit 0.
    pub const fn equalisation(self) -> u8 {
        self.equalisation
    }

    /// The word of the parameter byte.
    pub const fn para(self) -> Word {
        self.para
    }

    const fn extra_bits(self) -> u32 {
        match self.extra {
            Some(extra) => extra.bits() as u32,
            None => 0,
        }
    }

    /// The line bits; the last bit of an EXTRA window is a one even if its edge lies inside.
    #[inline]
    pub fn bits(self) -> Window {
        // SYNC, the two ones of SAMPLE and those of the window: at most 17 bits, then 18 more.
        let rest = 0b0110 | u32::from(self.equalisation) << 4 | u32::from(self.para.get()) << 8;
        match self.extra {
            None => Window::from_bits((FIXED | rest << 8).into(), Self::BITS).unwrap_or(Window::EMPTY),
            Some(extra) => {
                let extra = u32::from(extra.bits());
                // Ones up to the end of the window, over those of FIXED.
                let ones = FIXED | (1_u32 << extra.wrapping_add(8)).wrapping_sub(1) & !0xff;
                let bits = u64::from(ones) | u64::from(rest) << extra.wrapping_add(8);
                Window::from_bits(bits.into(), Self::BITS.wrapping_add(extra)).unwrap_or(Window::EMPTY)
            }
        }
    }

    /// The line at eight samples per bit: one byte per bit, its first sample in bit 7.
    pub fn samples(self) -> impl Iterator<Item = u8> {
        let bits = self.bits();
        let edge = self.extra.map(|extra| (self.extra_bits().wrapping_add(7), extra.last_bit()));
        (0..bits.len()).map(move |at| match (edge, bits.get(at)) {
            (Some((last, samples)), _) if last == at => samples,
            (_, Some(true)) => 0xff,
            _ => 0x00,
        })
    }

    /// Reads the line bits of a head as an encoder does. The EQUALISATION bits are ignored.
    ///
    /// # Errors
    /// [`Error::Truncated`], [`Error::Framing`], and [`Error::InvalidWord`] for a parameter word that is in no table.
    pub fn parse(line: Window) -> Result<ParsedHead, Error> {
        let bits = line.bits();
        let truncated = |want: u32| Error::Truncated { got: low16(line.len()), want: low16(want) };
        if line.len() < Self::BITS {
            return Err(truncated(Self::BITS));
        }
        // Ones after SYNC: two of SAMPLE and those of the window.
        let extra = (bits >> 8).trailing_ones();
        if bits & 0xff != SYNC | 0xc0 || extra > 10 || bits >> extra.wrapping_add(8) & 0b1111 != 0b0110 {
            return Err(Error::Framing);
        }
        let len = Self::BITS.wrapping_add(extra);
        if line.len() < len {
            return Err(truncated(len));
        }
        let (at, [low, high, ..]) = (extra.wrapping_add(16), (bits >> extra.wrapping_add(16)).to_le_bytes());
        let word = Word::truncate(u16::from_le_bytes([low, high]));
        let byte = ParameterByte::decode(word).ok_or(Error::InvalidWord { word: word.get() })?;
        Ok(ParsedHead { byte, extra_bits: extra, len: at.wrapping_add(Word::BITS) })
    }
}

/// What an encoder reads from the head of an H-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct ParsedHead {
    /// The parameter byte.
    pub byte: ParameterByte,
    /// Number of bits of the EXTRA window; 0 if free running.
    pub extra_bits: u32,
    /// Number of bits of the whole head.
    pub len: u32,
}

servowire_core::one_line!(ParsedHead {
    Self { byte, extra_bits: 0, .. } => "{}", byte;
    Self { byte, extra_bits, .. } => "{}, EXTRA of {} bits", byte, extra_bits;
});

#[expect(clippy::cast_possible_truncation, reason = "lengths of a window are below 129")]
const fn low16(len: u32) -> u16 {
    len as u16
}

/// What the master sends instead of an answer in frames that have none (frames with RESET and SYNC): a 0 for the
/// switch bit, then 1 0 1 0 ... 1 over the 73 bits of the answer and its reserve.
pub const FILLER: Window = {
    let len = 1 + ANSWER_BITS + DELAY_RESERVE_BITS;
    match Window::from_bits(0xaaaa_aaaa_aaaa_aaaa_aaaa, len) {
        Some(window) => window,
        None => Window::EMPTY,
    }
};

/// How much of TRAILER the master drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub enum Trailer {
    /// All eight bits, in frames without an answer.
    Whole,
    /// The last six bits, after an answer. The line idles during the first two (the specification speaks of five driven
    /// zeros, the vendor's receiver drives four).
    AfterAnswer,
    /// The four zeros only: the vendor's receiver breaks off there when a LEARN frame has failed.
    Cut,
}

/// The last part of an H-frame: TRAILER and STUFFING.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Tail {
    /// How much of TRAILER is driven.
    pub trailer: Trailer,
    /// Blocks of stuffing.
    pub stuffing: Stuffing,
}

impl Tail {
    /// Number of bit times that the tail takes.
    pub const fn time(self) -> u32 {
        let trailer = match self.trailer {
            Trailer::Whole | Trailer::AfterAnswer => TRAILER_BITS,
            Trailer::Cut => 6,
        };
        STUFFING_BITS.wrapping_mul(self.stuffing.0 as u32).wrapping_add(trailer)
    }

    /// The driven bits in line order.
    pub fn bits(self) -> impl Iterator<Item = bool> {
        let driven = match self.trailer {
            Trailer::Whole => 0..TRAILER_BITS,
            Trailer::AfterAnswer => 2..TRAILER_BITS,
            Trailer::Cut => 2..6,
        };
        let trailer = driven.map(|at| TRAILER >> at & 1 == 1);
        let block = (0..STUFFING_BITS).map(|at| SYNC >> at & 1 == 1);
        trailer.chain((0..self.stuffing.0).flat_map(move |_| block.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MasterSymbol;
    use std::string::String;

    fn text(bits: impl Iterator<Item = bool>) -> String {
        bits.map(|b| if b { '1' } else { '0' }).collect()
    }

    fn window(w: Window) -> impl Iterator<Item = bool> {
        (0..w.len()).map(move |at| w.get(at).unwrap())
    }

    #[test]
    fn the_frame_adds_up() {
        assert_eq!(Head::BITS + FILLER.len() + TRAILER_BITS, H_FRAME_BITS);
        let byte = ParameterByte::of(MasterSymbol::Reset);
        let (head, d) = Head::coded(byte, None, LineDisparity::ZERO);
        assert_eq!(text(window(head.bits())), "00101111011000000101001011");
        let head = Head::new(byte, None, d);
        assert_eq!(text(window(head.bits()).skip(12).take(4)), "1101");
        assert!(text(window(FILLER)).starts_with("0101") && text(window(FILLER)).ends_with("01"));
        assert_eq!(text(Tail { trailer: Trailer::Whole, stuffing: Stuffing(2) }.bits()), "00000011001011001011");
        assert_eq!(text(Tail { trailer: Trailer::AfterAnswer, stuffing: Stuffing::MIN }.bits()), "000011");
        assert_eq!(text(Tail { trailer: Trailer::Cut, stuffing: Stuffing::MIN }.bits()), "0000");
        assert_eq!(Tail { trailer: Trailer::AfterAnswer, stuffing: Stuffing::MAX }.time(), 164);
    }

    /// Every byte with every window at every disparity is read back by the encoder's side.
    #[test]
    fn heads_come_back() {
        for raw in (0..=255).step_by(crate::thin(51)) {
            for edge in (23..=72).step_by(crate::thin(7)) {
                for d in -5..=5 {
                    let (byte, extra) = (ParameterByte::new(raw), Extra::new(edge));
                    let head = Head::new(byte, extra, LineDisparity::new(d));
                    let got = Head::parse(head.bits()).unwrap();
                    assert_eq!((got.byte, got.len), (byte, head.bits().len()));
                    assert_eq!(got.extra_bits, extra.map_or(0, |e| u32::from(e.bits())));
                    if let Some(extra) = extra {
                        let high: u32 = head
                            .samples()
                            .skip(8)
                            .take(9)
                            .map(u8::leading_ones)
                            .scan(true, |go, n| {
                                let take = go.then_some(n);
                                *go = n == 8;
                                take
                            })
                            .sum();
                        assert_eq!(high, u32::from(extra.get()));
                    }
                }
            }
        }
    }

    /// Every wrong bit of the fixed pattern is refused, every shorter line too.
    #[test]
    fn flips_and_truncations() {
        let head = Head::new(ParameterByte::new(0xd0), None, LineDisparity::ZERO);
        let good = head.bits();
        for at in 0..12 {
            let bad = Window::from_bits(good.bits() ^ 1 << at, 26).unwrap();
            assert!(matches!(Head::parse(bad), Err(Error::Framing | Error::Truncated { .. })), "{at}");
        }
        for len in 0..26 {
            let cut = Window::from_bits(good.bits(), len).unwrap();
            assert_eq!(Head::parse(cut), Err(Error::Truncated { got: len as u16, want: 26 }));
        }
        // A stuffing block is no beginning of a frame: it is followed by zeros.
        assert_eq!(
            Head::parse(Window::from_bits(SYNC | SYNC << 6 | good.bits() << 12, 38).unwrap()),
            Err(Error::Framing)
        );
    }

    /// Up to ten ones between SAMPLE and its edge, one more than the longest window has.
    #[test]
    fn the_longest_window() {
        for (ones, found) in [(4_u32, true), (9, true), (10, true), (11, false)] {
            let good = Head::new(ParameterByte::new(0xd0), None, LineDisparity::ZERO).bits().bits();
            let line = good & 0xff | ((1 << ones) - 1) << 8 | good >> 8 << (ones + 8);
            let head = Head::parse(Window::from_bits(line, 26 + ones).unwrap());
            let want = ParsedHead { byte: ParameterByte::new(0xd0), extra_bits: ones, len: 26 + ones };
            assert_eq!(head, if found { Ok(want) } else { Err(Error::Framing) }, "{ones}");
        }
    }

    #[test]
    fn the_edge_register() {
        let all: [u8; 8] = core::array::from_fn(|t| edge_register(t as u8));
        assert_eq!(all, [0x00, 0x80, 0xc0, 0xe0, 0xf0, 0xf8, 0xfc, 0xfe]);
        assert_eq!((Extra::new(23), Extra::new(73)), (None, None));
        assert_eq!((Extra::MIN.bits(), Extra::MAX.bits(), Extra::new(25).unwrap().bits()), (3, 9, 4));
    }
}
