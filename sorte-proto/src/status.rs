use core::ops::{BitOr, BitOrAssign};

/// The STATUS byte of every frame.
///
/// ```text
///  bit 7 6 5 4   3             2      1         0
///      type      STATE_CHANGE  ERROR  DONE      LAST
///      nibble                         (unused)
/// ```
///
/// The nibble is sent as the published firmware sends it, which is not what its header file lists; no receiver looks
/// at it, and neither does this crate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Status(pub u8);

impl Status {
    /// The frame has passed the last device; in a device frame: the sender is the last device.
    pub const LAST: Self = Self(0x01);
    /// Defined by the vendor, never used.
    pub const DONE: Self = Self(0x02);
    /// The device saw a wrong checksum since its previous STATUS byte.
    pub const ERROR: Self = Self(0x04);
    /// The last frame of this phase.
    pub const STATE_CHANGE: Self = Self(0x08);

    /// DISCOVERY frames of the master but the last, and device frames of the IO exchange.
    pub const DISCOVERY: Self = Self(0x00);
    /// PARAM frames of the master but the last.
    pub const PARAM: Self = Self(0x10);
    /// DELAY_REQ frames but the last.
    pub const DELAY_REQ: Self = Self(0x20);
    /// DELAY_RESP frames; defined by the vendor, never sent.
    pub const DELAY_RESP: Self = Self(0x30);
    /// SYNC frames of the master but the last.
    pub const SYNC: Self = Self(0x40);
    /// Master frames of the IO exchange.
    pub const EXCHANGE: Self = Self(0x30);

    /// The last DISCOVERY, DELAY_REQ or SYNC frame of the master: the type nibble is lost.
    pub const FINAL: Self = Self::STATE_CHANGE;
    /// The last PARAM frame of the master: the type nibble is kept.
    pub const FINAL_PARAM: Self = Self(0x18);
    /// The last DELAY_REQ frame of a device: the type nibble is kept.
    pub const FINAL_DEVICE_DELAY_REQ: Self = Self(0x28);

    /// Whether all bits of `flags` are set.
    pub const fn has(self, flags: Self) -> bool {
        self.0 & flags.0 == flags.0
    }

    /// [`LAST`](Self::LAST)
    pub const fn is_last(self) -> bool {
        self.has(Self::LAST)
    }

    /// [`ERROR`](Self::ERROR)
    pub const fn is_error(self) -> bool {
        self.has(Self::ERROR)
    }

    /// [`STATE_CHANGE`](Self::STATE_CHANGE)
    pub const fn is_state_change(self) -> bool {
        self.has(Self::STATE_CHANGE)
    }

    /// Bits 7 to 4 as they came.
    pub const fn type_nibble(self) -> u8 {
        self.0 >> 4
    }

    /// What a device adds to the STATUS byte that it writes or passes on.
    pub const fn of_device(last: bool, error: bool) -> Self {
        Self(last as u8 | (error as u8) << 2)
    }
}

impl BitOr for Status {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for Status {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_bit_of_all_256_has_its_name() {
        for raw in 0..=u8::MAX {
            let status = Status(raw);
            assert_eq!(status.is_last(), raw & 1 != 0);
            assert_eq!(status.has(Status::DONE), raw & 2 != 0);
            assert_eq!(status.is_error(), raw & 4 != 0);
            assert_eq!(status.is_state_change(), raw & 8 != 0);
            assert_eq!(status.type_nibble(), raw >> 4);
        }
        assert_eq!(Status::of_device(true, false), Status::LAST);
        assert_eq!(Status::of_device(false, true), Status::ERROR);
        assert_eq!(Status::SYNC | Status::LAST, Status(0x41));
    }
}
