/// The STATUS byte of every frame.
///
/// ```text
///  bit 7 6 5 4   3             2      1         0
///      type      STATE_CHANGE  ERROR  DONE      LAST
///      nibble                         (unused)
/// ```
///
/// The type nibble is sent as the published firmware sends it, which is not what its header file lists; no receiver evaluates
/// it, and neither does this crate. Every byte is a `Status` and converts back to itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Status(u8);

bitflags::bitflags! {
    impl Status: u8 {
        /// The frame has passed the last device; in a device frame, the sender is the last device.
        const LAST = 1 << 0;
        /// Defined by the vendor, never used.
        const DONE = 1 << 1;
        /// The device saw a wrong checksum since its previous STATUS byte.
        const ERROR = 1 << 2;
        /// The last frame of this phase.
        const STATE_CHANGE = 1 << 3;
        const _ = !0;
    }
}

servowire_core::show_flags!(Status);

impl Status {
    /// All DISCOVERY frames of the master but the last, and device frames of the IO exchange.
    pub const DISCOVERY: Self = Self(0x00);
    /// All PARAM frames of the master but the last.
    pub const PARAM: Self = Self(0x10);
    /// All DELAY_REQ frames but the last.
    pub const DELAY_REQ: Self = Self(0x20);
    /// DELAY_RESP frames; defined by the vendor, never sent.
    pub const DELAY_RESP: Self = Self(0x30);
    /// All SYNC frames of the master but the last.
    pub const SYNC: Self = Self(0x40);
    /// Master frames of the IO exchange.
    pub const EXCHANGE: Self = Self(0x30);

    /// The last DISCOVERY, DELAY_REQ or SYNC frame of the master: the type nibble is lost.
    pub const FINAL: Self = Self::STATE_CHANGE;
    /// The last PARAM frame of the master: the type nibble is kept.
    pub const FINAL_PARAM: Self = Self(0x18);
    /// The last DELAY_REQ frame of a device: the type nibble is kept.
    pub const FINAL_DEVICE_DELAY_REQ: Self = Self(0x28);

    /// Bits 7 to 4 as received.
    pub const fn type_nibble(self) -> u8 {
        self.0 >> 4
    }

    /// Returns the bits that a device adds to a STATUS byte that it writes or passes on.
    pub(crate) const fn of_device(last: bool, error: bool) -> Self {
        Self(last as u8 | (error as u8) << 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn each_bit_of_all_256_has_its_name() {
        for raw in 0..=u8::MAX {
            let status = Status::from_bits_retain(raw);
            assert_eq!(status.contains(Status::LAST), raw & 1 != 0);
            assert_eq!(status.contains(Status::DONE), raw & 2 != 0);
            assert_eq!(status.contains(Status::ERROR), raw & 4 != 0);
            assert_eq!(status.contains(Status::STATE_CHANGE), raw & 8 != 0);
            assert_eq!((status.type_nibble(), status.bits()), (raw >> 4, raw));
            assert_eq!(Status::from_bits(raw), Some(status));
        }
        assert_eq!(Status::of_device(true, false), Status::LAST);
        assert_eq!(Status::of_device(false, true), Status::ERROR);
        assert_eq!(Status::SYNC | Status::LAST, Status::from_bits_retain(0x41));
    }

    #[test]
    fn a_log_shows_names_and_the_rest() {
        for (raw, text) in
            [(0x00, "-"), (0x05, "LAST ERROR"), (0x30, "30h"), (0x41, "LAST 40h"), (0x18, "STATE_CHANGE 10h")]
        {
            assert_eq!(Status::from_bits_retain(raw).to_string(), text);
        }
    }
}
