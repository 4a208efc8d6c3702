use servowire_core::OutOfRange;

use crate::drv8711;
use crate::pto::{Direction, Pto};

/// A device's share of the master frame in the CNC application: four bytes.
///
/// ```text
///  byte  0      1       2          3
///        PTO (LSB first) command (LSB first; reserved, 0)
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Slice {
    /// What the axis does in the next cycle.
    pub pto: Pto,
    /// Reserved; the reference design sends 0.
    pub command: u16,
}

impl Slice {
    /// Length in bytes.
    pub const LEN: usize = 4;

    /// Reads the slice; any four bytes are valid.
    pub const fn parse([p0, p1, c0, c1]: [u8; Self::LEN]) -> Self {
        Self { pto: Pto::from_word(u16::from_le_bytes([p0, p1])), command: u16::from_le_bytes([c0, c1]) }
    }

    /// The bytes in wire order.
    pub const fn emit(self) -> [u8; Self::LEN] {
        let ([p0, p1], [c0, c1]) = (self.pto.word().to_le_bytes(), self.command.to_le_bytes());
        [p0, p1, c0, c1]
    }
}

impl From<Pto> for Slice {
    fn from(pto: Pto) -> Self {
        Self { pto, command: 0 }
    }
}

/// Which of the four motors take part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "u8", into = "u8"))]
pub struct MotorMask(u8);

bitflags::bitflags! {
    impl MotorMask: u8 {
        /// Motor of device 1.
        const M1 = 1 << 0;
        /// Motor of device 2.
        const M2 = 1 << 1;
        /// Motor of device 3.
        const M3 = 1 << 2;
        /// Motor of device 4.
        const M4 = 1 << 3;
    }
}

servowire_core::show_flags!(MotorMask);

impl TryFrom<u8> for MotorMask {
    type Error = OutOfRange;

    /// `mask` is 0..=15.
    fn try_from(mask: u8) -> Result<Self, OutOfRange> {
        Self::from_bits(mask).ok_or_else(|| OutOfRange::above(mask.into(), Self::all().bits().into()))
    }
}

impl From<MotorMask> for u8 {
    fn from(mask: MotorMask) -> Self {
        mask.bits()
    }
}

#[cfg(feature = "arbitrary")]
impl arbitrary::Arbitrary<'_> for MotorMask {
    fn arbitrary(u: &mut arbitrary::Unstructured<'_>) -> arbitrary::Result<Self> {
        u8::arbitrary(u).map(Self::from_bits_truncate)
    }
}

/// The 16 output bytes of the reference machine, device 1 first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Payload(pub [Slice; 4]);

impl Payload {
    /// Length in bytes.
    pub const LEN: usize = 16;

    /// Creates the payload of four axes with a word each and commands 0.
    pub const fn independent(words: [Pto; 4]) -> Self {
        let [a, b, c, d] = words;
        Self([
            Slice { pto: a, command: 0 },
            Slice { pto: b, command: 0 },
            Slice { pto: c, command: 0 },
            Slice { pto: d, command: 0 },
        ])
    }

    /// Creates the payload with the same word for every motor of `motors`. The others get a no-pulse word with the same DIR
    /// level, so that their drivers stay on; without any motor, all four get driver off (TIDEP-0061 section 2.3.3).
    pub const fn shared(pto: Pto, motors: MotorMask) -> Self {
        let rest = match pto.direction() {
            _ if !motors.intersects(MotorMask::all()) => Pto::DriverOff,
            Some(direction) => Pto::NoPulse { direction },
            None => Pto::NoPulse { direction: Direction::Low },
        };
        Self::independent([
            if motors.contains(MotorMask::M1) { pto } else { rest },
            if motors.contains(MotorMask::M2) { pto } else { rest },
            if motors.contains(MotorMask::M3) { pto } else { rest },
            if motors.contains(MotorMask::M4) { pto } else { rest },
        ])
    }

    /// Reads the payload; any 16 bytes are valid.
    pub const fn parse(bytes: [u8; Self::LEN]) -> Self {
        let [a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3] = bytes;
        Self([
            Slice::parse([a0, a1, a2, a3]),
            Slice::parse([b0, b1, b2, b3]),
            Slice::parse([c0, c1, c2, c3]),
            Slice::parse([d0, d1, d2, d3]),
        ])
    }

    /// The bytes in wire order.
    pub const fn emit(self) -> [u8; Self::LEN] {
        let [a, b, c, d] = self.0;
        let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (a.emit(), b.emit());
        let ([c0, c1, c2, c3], [d0, d1, d2, d3]) = (c.emit(), d.emit());
        [a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3, d0, d1, d2, d3]
    }
}

servowire_core::one_line!(Slice {
    Self { pto, command: 0 } => "{}", pto;
    Self { pto, command } => "{} command {:04X}h", pto, command;
});
servowire_core::one_line!(Payload { Self([a, b, c, d]) => "{}, {}, {}, {}", a, b, c, d; });

/// A device's payload in its frame: status of the driver, and the steps that it has ordered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct InputSlice {
    /// The driver's STATUS.
    pub driver: drv8711::Status,
    /// [`Follower::ordered`](crate::follow::Follower::ordered). The reference design sends 0, and nothing in the frame
    /// distinguishes the two.
    pub ordered: u16,
}

impl InputSlice {
    /// Length in bytes.
    pub const LEN: usize = 3;

    /// Reads the payload; any three bytes are valid.
    pub const fn parse([driver, low, high]: [u8; Self::LEN]) -> Self {
        Self { driver: drv8711::Status::from_bits_retain(driver), ordered: u16::from_le_bytes([low, high]) }
    }

    /// The bytes in wire order.
    pub const fn emit(self) -> [u8; Self::LEN] {
        let [low, high] = self.ordered.to_le_bytes();
        [self.driver.bits(), low, high]
    }
}

servowire_core::one_line!(InputSlice { Self { driver, ordered } => "{} steps ordered, DRV8711 {}", ordered, driver; });

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn masks_are_four_bits() {
        for mask in 0..=u8::MAX {
            let want = if mask < 16 { Ok(mask) } else { Err(OutOfRange { got: mask.into(), max: 15 }) };
            assert_eq!(MotorMask::try_from(mask).map(u8::from), want);
        }
    }

    #[test]
    fn each_motor_of_the_mask_gets_the_word() {
        let pto = Pto::from_word(0x89ab);
        for mask in 0..16 {
            let Payload(slices) = Payload::shared(pto, MotorMask::from_bits(mask).unwrap());
            for (index, slice) in slices.iter().enumerate() {
                let want = match (mask, mask >> index & 1) {
                    (0, _) => 0x7fff,
                    (_, 1) => 0x89ab,
                    _ => 0x8000,
                };
                assert_eq!((slice.pto.word(), slice.command), (want, 0));
            }
        }
    }

    proptest! {
        #[test]
        fn bytes_give_themselves_back(bytes: [u8; 16]) {
            prop_assert_eq!(Payload::parse(bytes).emit(), bytes);
        }

        #[test]
        fn a_slice_is_two_little_endian_words(bytes: [u8; 4]) {
            let slice = Slice::parse(bytes);
            prop_assert_eq!(slice.pto.word(), u16::from(bytes[0]) | u16::from(bytes[1]) << 8);
            prop_assert_eq!(slice.command, u16::from(bytes[2]) | u16::from(bytes[3]) << 8);
            prop_assert_eq!(slice.emit(), bytes);
        }
    }
}
