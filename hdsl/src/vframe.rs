//! The V-frame: eight H-frames carry the two safe channels, one byte of each in every answer.

use crate::answer::Answer;
use crate::crc::RunningCrc16;
use crate::error::Error;
use crate::symbol::{Control, Reading, Rule, Word};

/// The eight bytes of a safe channel.
///
/// ```text
///  H-frame     0          1 ... 5              6, 7
///  vertical    SUMMARY    VPOS4 ... VPOS0      CRC, high byte first
///  secondary   STATUS2    VPOS24 ... VPOS20    CRC2          STATUS2 goes as a K28 character
/// ```
///
/// VPOS of a V-frame is the position at the sampling instant of the last H-frame before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct SafeBlock {
    bytes: [u8; 8],
    /// Creates a block from the bytes before the CRC.
    #[cfg_attr(feature = "serde", serde(skip))]
    crc: RunningCrc16,
    /// Number of words taken in order.
    len: u8,
    bad: Option<Word>,
    top_is_mark: bool,
}

impl SafeBlock {
    /// Takes the word of H-frame `at`, 0..=7; they have to come in order.
    #[inline(always)]
    fn put(&mut self, rule: Rule, at: u8, reading: Reading, mark: Control) {
        if at == 0 {
            *self = Self::default();
        }
        if at != self.len {
            return;
        }
        self.len = self.len.saturating_add(1);
        if let Some(byte) = self.bytes.get_mut(usize::from(at)) {
            *byte = reading.raw();
        }
        if at < 6 {
            self.crc.update(reading.raw());
        }
        if at == 1 {
            // The vendor's receiver looks at the value only.
            self.top_is_mark = match rule {
                Rule::Strict => reading.is(mark),
                Rule::Reduced => reading.raw() == mark as u8,
            };
        }
        if reading.is_byte_error() {
            self.note_bad(reading.word());
        }
    }

    /// Keeps the first bad word.
    #[cold]
    const fn note_bad(&mut self, word: Word) {
        if self.bad.is_none() {
            self.bad = Some(word);
        }
    }

    /// The byte of H-frame 0 as received: SUMMARY of channel 1, STATUS2 of channel 2.
    pub const fn status(&self) -> u8 {
        let [status, ..] = self.bytes;
        status
    }

    /// VPOS or VPOS2 as received, good or not.
    pub const fn raw_vpos(&self) -> u64 {
        let [_, p4, p3, p2, p1, p0, ..] = self.bytes;
        u64::from_be_bytes([0, 0, 0, p4, p3, p2, p1, p0])
    }

    /// The CRC as received.
    pub const fn raw_crc(&self) -> u16 {
        let [.., high, low] = self.bytes;
        u16::from_be_bytes([high, low])
    }

    /// Returns whether a word of the block was bad.
    pub(crate) const fn has_byte_error(&self) -> bool {
        self.bad.is_some()
    }

    /// Returns whether the CRC of the bytes as received is correct.
    pub(crate) const fn crc_ok(&self) -> bool {
        self.crc.finish() == self.raw_crc()
    }

    /// Returns whether words and CRC are good; this does not say whether the encoder has a position.
    pub fn is_sound(&self) -> bool {
        matches!(self.vpos(), Ok(_) | Err(Error::PositionInvalid { .. }))
    }

    /// VPOS or VPOS2, 40 bits, as an unsigned number. For a position to use see [`Master::safe`](crate::master::Master::safe).
    ///
    /// # Errors
    /// In this order: [`Error::Truncated`] before all eight words are there, [`Error::InvalidWord`] for the first bad word,
    /// [`Error::Crc`], [`Error::PositionInvalid`] if the encoder has no position: five K29.7 in channel 1,
    /// K27.7 first in channel 2. With [`Rule::Reduced`] the value of the top byte alone decides this.
    pub const fn vpos(&self) -> Result<u64, Error> {
        if self.len != 8 {
            return Err(Error::Truncated { got: self.len as u16, want: 8 });
        }
        if let Some(word) = self.bad {
            return Err(Error::InvalidWord { word: word.get() });
        }
        let (got, want) = (self.raw_crc(), self.crc.finish());
        if got != want {
            return Err(Error::Crc { got, want });
        }
        if self.top_is_mark {
            let [_, mark, ..] = self.bytes;
            return Err(Error::PositionInvalid { mark });
        }
        Ok(self.raw_vpos())
    }
}

/// Both safe channels of a V-frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct VFrame {
    /// Vertical channel. Its status byte is SUMMARY: bit n summarises the encoder status register ENC_STn.
    pub safe1: SafeBlock,
    /// Secondary channel. Its status byte is STATUS2: TOG2, TEST2, ERR2, FIX2 = 11100b.
    pub safe2: SafeBlock,
}

impl VFrame {
    /// Takes the answer of H-frame `at`, 0..=7, in order; 0 starts over.
    #[inline(always)]
    pub fn put(&mut self, rule: Rule, at: u8, answer: Answer) {
        self.safe1.put(rule, at, answer.vertical(), Control::K29_7);
        self.safe2.put(rule, at, answer.secondary(), Control::K27_7);
    }

    /// Creates the V-frame from eight answers.
    pub fn of(rule: Rule, answers: &[Answer; 8]) -> Self {
        let mut frame = Self::default();
        for (at, answer) in (0..).zip(answers) {
            frame.put(rule, at, *answer);
        }
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::acceleration::DeltaDelta;
    use crate::answer::Content;
    use crate::crc::crc16;
    use crate::parameter::{EncoderByte, EncoderSymbol};
    use crate::symbol::{Character, RunningDisparity};
    use proptest::prelude::*;

    fn answers(block1: [Character; 8], block2: [Character; 8]) -> [u64; 8] {
        let mut rd = RunningDisparity::Minus;
        let idle = EncoderByte::of(EncoderSymbol::Idle);
        core::array::from_fn(|at| {
            let content = Content {
                vertical: block1[at],
                parameter: if at == 7 { idle.with_vsync() } else { idle },
                pipe: Character::control(Control::K30_7),
                acceleration: Some(DeltaDelta::ZERO),
                secondary: block2[at],
            };
            let coded = content.emit(rd);
            let (bits, after) = (coded.bits, coded.disparity);
            rd = after;
            bits
        })
    }

    fn block(first: Character, position: [Character; 5]) -> [Character; 8] {
        let mut all = [first; 8];
        all[1..6].copy_from_slice(&position);
        let bytes: [u8; 6] = core::array::from_fn(|k| all[k].byte());
        let [high, low] = crc16(&bytes).to_be_bytes().map(Character::data);
        all[6..].copy_from_slice(&[high, low]);
        all
    }

    fn data(position: u64) -> [Character; 5] {
        let [_, _, _, bytes @ ..] = position.to_be_bytes();
        bytes.map(Character::data)
    }

    proptest! {
        #[test]
        fn positions_come_back_and_every_flip_is_seen(p1 in 0..1_u64 << 40, p2 in 0..1_u64 << 40, summary: u8, frame in 0..8usize, bit in 0..10_u32, second: bool) {
            let b1 = block(Character::data(summary), data(p1));
            let b2 = block(Character::control(Control::K28_4), data(p2));
            let mut bits = answers(b1, b2);
            let read = |bits: &[u64; 8]| VFrame::of(Rule::Strict, &bits.map(|b| Answer::from_bits(Rule::Strict, b)));
            let good = read(&bits);
            prop_assert_eq!((good.safe1.vpos(), good.safe1.status()), (Ok(p1), summary));
            prop_assert_eq!((good.safe2.vpos(), good.safe2.status()), (Ok(p2), 0x9c));
            bits[frame] ^= 1 << (bit + if second { 51 } else { 0 });
            let bad = read(&bits);
            let (hit, other) = if second { (bad.safe2, bad.safe1) } else { (bad.safe1, bad.safe2) };
            prop_assert!(other.vpos().is_ok());
            // A flip of one line bit changes up to five bits of one byte: in the covered bytes the CRC sees it, and
            // a changed kind (data or special) of the same value changes nothing.
            if let Ok(position) = hit.vpos() {
                prop_assert_eq!(position, if second { p2 } else { p1 });
            }
        }
    }

    #[test]
    fn marks_for_no_position() {
        let b1 = block(Character::data(1), [Character::control(Control::K29_7); 5]);
        let mut none2 = data(0);
        none2[0] = Character::control(Control::K27_7);
        let b2 = block(Character::control(Control::K28_0), none2);
        let bits = answers(b1, b2);
        for rule in [Rule::Strict, Rule::Reduced] {
            let frame = VFrame::of(rule, &bits.map(|b| Answer::from_bits(rule, b)));
            assert_eq!(frame.safe1.vpos(), Err(Error::PositionInvalid { mark: 0xfd }));
            assert_eq!(frame.safe2.vpos(), Err(Error::PositionInvalid { mark: 0xfb }));
        }
        // A signed position may begin with FDh: by the tables that is no mark.
        let bits = answers(block(Character::data(0), data(0xfd_0000_0001)), b2);
        let frame = |rule| VFrame::of(rule, &bits.map(|b| Answer::from_bits(rule, b))).safe1.vpos();
        assert_eq!(frame(Rule::Strict), Ok(0xfd_0000_0001));
        assert_eq!(frame(Rule::Reduced), Err(Error::PositionInvalid { mark: 0xfd }));
    }
}
