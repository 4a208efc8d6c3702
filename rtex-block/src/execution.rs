//! The flags in byte 9 of a response, and in byte 16 of a sub block.

use crate::flags::flag_set;

flag_set! {
    /// The progress of a non-cyclic command: bits 7, 6 and 4 of byte 9 of a response.
    ///
    /// SX-DSV02310, "Response of non-cyclic commands".
    pub struct Execution(u8) {
        /// The command was accepted but failed during execution.
        ERR = 1 << 7;
        /// Executed with a restriction.
        WNG = 1 << 6;
        /// Still executing.
        BUSY = 1 << 4;
    }
}

flag_set! {
    /// Latches of a homing response: bits 1 and 0 of its byte 9.
    ///
    /// LPOS1 and LPOS2 are undefined until their latch is complete. SX-DSV02310, "Homing command".
    pub struct LatchFlags(u8) {
        /// Latch_Comp2: latch 2 has caught a position.
        LATCH_COMP2 = 1 << 1;
        /// Latch_Comp1: latch 1 has caught a position.
        LATCH_COMP1 = 1 << 0;
    }
}

flag_set! {
    /// Bits 3-0 of byte 9 of a profile response. SX-DSV02310, "Profile command".
    pub struct ProfileFlags(u8) {
        /// Positive software limit (exchangeable with NSL by parameter).
        PSL = 1 << 3;
        /// Negative software limit (exchangeable with PSL by parameter).
        NSL = 1 << 2;
        /// Inside the near window.
        NEAR = 1 << 1;
        /// Latch_Comp1: latch 1 has caught a position.
        LATCH_COMP1 = 1 << 0;
    }
}

impl Execution {
    /// Returns the bits in their places in byte 9, without those that have no name.
    pub(crate) const fn to_byte(self) -> u8 {
        self.bits() & Self::all().bits()
    }

    /// Reads byte 16 of a response, where ERR and WNG are one place lower.
    pub(crate) const fn from_sub(byte16: u8) -> Self {
        Self::from_bits_truncate((byte16 & 0x60) << 1 | byte16 & 0x10)
    }

    /// Returns the bits in their places in byte 16 of a response.
    pub(crate) const fn to_sub(self) -> u8 {
        (self.bits() & 0xc0) >> 1 | self.bits() & 0x10
    }
}

impl LatchFlags {
    /// Returns the bits in their places in byte 9, without those that have no name.
    pub(crate) const fn to_byte(self) -> u8 {
        self.bits() & Self::all().bits()
    }
}

impl ProfileFlags {
    /// Returns the bits in their places in byte 9, without those that have no name.
    pub(crate) const fn to_byte(self) -> u8 {
        self.bits() & Self::all().bits()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_in_the_sub_block() {
        for (flag, bit) in [(Execution::ERR, 0x40), (Execution::WNG, 0x20), (Execution::BUSY, 0x10)] {
            assert_eq!((flag.to_sub(), Execution::from_sub(bit)), (bit, flag));
        }
        assert!((0..=255).all(|byte| Execution::from_sub(byte).to_sub() == byte & 0x70));
    }
}
