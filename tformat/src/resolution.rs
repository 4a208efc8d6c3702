use servowire_core::OutOfRange;

use crate::address::{Address, Page};
use crate::count::{Abm, Abs};
use crate::error::Error;

/// The widths of an encoder's data and the size of its memory, which are not transmitted.
///
/// ```text
///  ABS  |23 ... abs_bits| abs_bits-1 ... 0|      upper bits 0, position in the turn
///  ABM  |23 ... abm_bits| abm_bits-1 ... 0|      upper bits 0, turns, as two's complement if signed
/// ```
///
/// The check field does not protect against a wrong width; the upper bits do, so a value with one of them set is refused.
///
/// It is displayed as the widths: `23 + 16 bits`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "Widths", into = "Widths")
)]
pub struct Resolution {
    abs_bits: u8,
    abm_bits: u8,
    signed_turns: bool,
    checks_upper_bits: bool,
    pages: u8,
}

servowire_core::one_line!(Resolution { Self { abs_bits, abm_bits, .. } => "{} + {} bits", abs_bits, abm_bits; });

/// The widths that an encoder ID suggests.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Hint {
    /// The widths.
    pub resolution: Resolution,
    /// Whether a document or a log of a real encoder shows this ID with these widths; otherwise they are derived from the rule
    /// that all known IDs follow.
    pub documented: bool,
}

impl Resolution {
    /// Creates a resolution with the widths of ABS (1..=24) and ABM (0..=24). Turns are signed, upper bits are checked, the
    /// EEPROM has six pages.
    ///
    /// # Errors
    /// [`OutOfRange`] with the limit that a width exceeds.
    pub const fn new(abs_bits: u8, abm_bits: u8) -> Result<Self, OutOfRange> {
        match (within(abs_bits, 1, 24), within(abm_bits, 0, 24)) {
            (Ok(abs_bits), Ok(abm_bits)) => {
                Ok(Self { abs_bits, abm_bits, signed_turns: true, checks_upper_bits: true, pages: Page::COUNT })
            }
            (Err(error), _) | (_, Err(error)) => Err(error),
        }
    }

    /// Counts turns from 0 up, unsigned.
    #[must_use]
    pub const fn with_unsigned_turns(self) -> Self {
        Self { signed_turns: false, ..self }
    }

    /// Cuts off the upper bits unchecked, for an encoder that uses them for something else.
    #[must_use]
    pub const fn with_upper_bits_ignored(self) -> Self {
        Self { checks_upper_bits: false, ..self }
    }

    /// Sets the number of EEPROM pages, 1..=8: six in Tamagawa's encoders, eight in one compatible encoder.
    ///
    /// ```
    /// # use tformat::Resolution;
    /// let compatible = Resolution::new(17, 16)?.with_pages(8)?;
    /// assert_eq!(compatible.pages(), 8);
    /// # Ok::<(), tformat::OutOfRange>(())
    /// ```
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub const fn with_pages(self, pages: u8) -> Result<Self, OutOfRange> {
        match within(pages, 1, 8) {
            Ok(pages) => Ok(Self { pages, ..self }),
            Err(error) => Err(error),
        }
    }

    /// Returns the widths that ENID suggests. In all known cases ENID is the number of single-turn bits.
    ///
    /// | ENID | ABS | ABM | known from |
    /// |------|-----|-----|------------|
    /// | 0x0b | 11 | 13 | drive firmware |
    /// | 0x11 | 17 | 16 | drive firmware, descriptions of 17-bit types |
    /// | 0x15 | 21 | 0 | a compatible encoder |
    /// | 0x17 | 23 | 16 | drive firmware, log of a TS5700N8401 |
    /// | 0x14 | 20 | 16 | not documented: the same rule |
    /// | 0x18 | 24 | 16 | not documented: the same rule |
    ///
    /// `None` for all other IDs. A model name proves nothing: for the TS5700N8501, TIDM-1011 states 24 bits and a widely used
    /// motor controller 17.
    pub const fn from_enid(enid: u8) -> Option<Hint> {
        let (abm_bits, documented) = match enid {
            0x0b => (13, true),
            0x11 | 0x17 => (16, true),
            0x15 => (0, true),
            0x14 | 0x18 => (16, false),
            _ => return None,
        };
        match Self::new(enid, abm_bits) {
            Ok(resolution) => Some(Hint { resolution, documented }),
            Err(_) => None,
        }
    }

    /// Single-turn bits, 1..=24.
    pub const fn abs_bits(self) -> u8 {
        self.abs_bits
    }

    /// Multi-turn bits, 0..=24.
    pub const fn abm_bits(self) -> u8 {
        self.abm_bits
    }

    /// Returns whether turns are two's complement.
    pub const fn has_signed_turns(self) -> bool {
        self.signed_turns
    }

    /// Pages of the EEPROM, 1..=8.
    pub const fn pages(self) -> u8 {
        self.pages
    }

    /// Returns the page with this number; `None` if the encoder does not have it.
    pub const fn page(self, number: u8) -> Option<Page> {
        if number < self.pages { Page::new(number) } else { None }
    }

    /// Returns page and address of the byte `index` of the whole EEPROM; `None` after its end.
    pub const fn locate(self, index: u16) -> Option<(Page, Address)> {
        Page::locate(index, self.pages)
    }

    /// Counts per turn.
    pub const fn counts_per_turn(self) -> u32 {
        1_u32.wrapping_shl(self.abs_bits as u32)
    }

    /// Returns the single-turn position in counts.
    pub(crate) const fn single_turn(self, abs: Abs) -> Result<u32, Error> {
        self.cut(abs.get(), self.abs_bits)
    }

    /// Returns the number of turns.
    #[expect(clippy::cast_possible_wrap, reason = "24 bits fit")]
    pub(crate) const fn turns(self, abm: Abm) -> Result<i32, Error> {
        match self.cut(abm.get(), self.abm_bits) {
            Ok(turns) if self.signed_turns => Ok(sign_extend(turns, self.abm_bits)),
            Ok(turns) => Ok(turns as i32),
            Err(error) => Err(error),
        }
    }

    /// Returns whether the ID says that the encoder has another number of single-turn bits.
    pub(crate) const fn contradicts(self, enid: u8) -> bool {
        match Self::from_enid(enid) {
            Some(hint) => self.checks_upper_bits && hint.resolution.abs_bits != self.abs_bits,
            None => false,
        }
    }

    /// Returns the shorter path from one single-turn position to another in counts, across the zero point if necessary:
    /// -2^(abs_bits-1)..2^(abs_bits-1).
    pub const fn difference(self, from: u32, to: u32) -> i32 {
        sign_extend(to.wrapping_sub(from), self.abs_bits)
    }

    /// Returns the shorter path from one number of turns to another, across the overflow if necessary.
    pub(crate) const fn turns_between(self, from: u32, to: u32) -> i32 {
        sign_extend(to.wrapping_sub(from), self.abm_bits)
    }

    const fn cut(self, value: u32, bits: u8) -> Result<u32, Error> {
        let mask = 1_u32.wrapping_shl(bits as u32).wrapping_sub(1);
        let excess = value & !mask;
        if excess != 0 && self.checks_upper_bits {
            return Err(Error::UpperBits { value, excess });
        }
        Ok(value & mask)
    }
}

/// Returns a setting if it lies in its range.
const fn within(value: u8, min: u8, max: u8) -> Result<u8, OutOfRange> {
    if value < min || value > max {
        let limit = if value < min { min } else { max };
        return Err(OutOfRange { got: value as i64, max: limit as i64 });
    }
    Ok(value)
}

/// Returns the low `bits` (0..=24) of `value` as two's complement.
#[expect(clippy::cast_possible_wrap, reason = "the wrap is the sign")]
const fn sign_extend(value: u32, bits: u8) -> i32 {
    if bits == 0 {
        return 0;
    }
    let unused = 32_u32.wrapping_sub(bits as u32);
    (value.wrapping_shl(unused) as i32).wrapping_shr(unused)
}

/// The serialised form of a resolution. The number of pages may be missing, in which case it is six.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Widths {
    abs_bits: u8,
    abm_bits: u8,
    signed_turns: bool,
    checks_upper_bits: bool,
    #[serde(default = "six")]
    pages: u8,
}

#[cfg(feature = "serde")]
const fn six() -> u8 {
    Page::COUNT
}

#[cfg(feature = "serde")]
impl TryFrom<Widths> for Resolution {
    type Error = OutOfRange;

    fn try_from(w: Widths) -> Result<Self, OutOfRange> {
        let resolution = Self::new(w.abs_bits, w.abm_bits)?.with_pages(w.pages)?;
        Ok(Self { signed_turns: w.signed_turns, checks_upper_bits: w.checks_upper_bits, ..resolution })
    }
}

#[cfg(feature = "serde")]
impl From<Resolution> for Widths {
    fn from(p: Resolution) -> Self {
        let Resolution { abs_bits, abm_bits, signed_turns, checks_upper_bits, pages } = p;
        Self { abs_bits, abm_bits, signed_turns, checks_upper_bits, pages }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::string::ToString;

    const P17: Resolution = match Resolution::new(17, 16) {
        Ok(resolution) => resolution,
        Err(_) => panic!(),
    };

    fn abs(value: u32) -> Abs {
        Abs::new(value).unwrap()
    }

    fn abm(value: u32) -> Abm {
        Abm::new(value).unwrap()
    }

    #[test]
    fn upper_bits_are_refused_or_cut_off() {
        assert_eq!(P17.single_turn(abs(0x2_0001)), Err(Error::UpperBits { value: 0x2_0001, excess: 0x2_0000 }));
        assert_eq!(P17.turns(abm(0x1_0000)), Err(Error::UpperBits { value: 0x1_0000, excess: 0x1_0000 }));
        assert_eq!(P17.with_upper_bits_ignored().single_turn(abs(0x2_0001)), Ok(1));
        let single = Resolution::new(21, 0).unwrap();
        assert_eq!(single.turns(abm(0)), Ok(0));
        assert!(single.turns(abm(1)).is_err());
    }

    #[test]
    fn every_width_is_taken_or_refused() {
        // Interpreted, some of the pairs have to do.
        let stride = if cfg!(miri) { 5 } else { 1 };
        for abs_bits in (0..=255).step_by(stride) {
            for abm_bits in (0..=255).step_by(stride) {
                let possible = (1..=24).contains(&abs_bits) && abm_bits <= 24;
                assert_eq!(Resolution::new(abs_bits, abm_bits).is_ok(), possible);
            }
        }
        assert_eq!(Resolution::new(0, 16), Err(OutOfRange { got: 0, max: 1 }));
        assert_eq!(Resolution::new(25, 16), Err(OutOfRange { got: 25, max: 24 }));
        assert_eq!(Resolution::new(17, 25), Err(OutOfRange { got: 25, max: 24 }));
        assert_eq!(P17.to_string(), "17 + 16 bits");
    }

    /// Six pages unless told otherwise, and no page that the encoder does not have.
    #[test]
    fn pages() {
        assert_eq!((P17.pages(), P17.page(5), P17.page(6)), (6, Page::new(5), None));
        let eight = P17.with_pages(8).unwrap();
        assert_eq!((eight.page(7), eight.page(8), eight.pages()), (Page::new(7), None, 8));
        assert_eq!((P17.locate(761).is_some(), P17.locate(762), eight.locate(1015).is_some()), (true, None, true));
        assert_eq!(P17.with_pages(9), Err(OutOfRange { got: 9, max: 8 }));
        assert_eq!(P17.with_pages(0), Err(OutOfRange { got: 0, max: 1 }));
    }

    #[test]
    fn hints_follow_the_number_of_bits() {
        for enid in 0..=255 {
            let hint = Resolution::from_enid(enid);
            assert_eq!(hint.is_some(), [11, 17, 20, 21, 23, 24].contains(&enid));
            if let Some(hint) = hint {
                assert_eq!(hint.resolution.abs_bits(), enid);
                assert_eq!(hint.documented, enid != 20 && enid != 24);
            }
        }
    }

    proptest! {
        #[test]
        fn difference_wraps(abs_bits in 1..=24_u8, from: u32, to: u32) {
            let resolution = Resolution::new(abs_bits, 0).unwrap();
            let turn = 1_i64 << abs_bits;
            let d = i64::from(resolution.difference(from, to));
            prop_assert!(-turn / 2 <= d && d < (turn + 1) / 2);
            prop_assert_eq!((i64::from(to) - i64::from(from) - d).rem_euclid(turn), 0);
        }
    }
}
