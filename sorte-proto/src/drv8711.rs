//! The facts about the stepper driver DRV8711 that matter on the wire and at the pins: its STATUS byte in the device frame, and
//! its limits. The chip itself is set up by the feature `drv8711` of `servowire-drivers`.
//!
//! From the DRV8711 data sheet (SLVSC40), section 7.6, and the design guide of the 4-axis CNC router (TIDEP-0061),
//! section 2.1.

use crate::sync0::PULSE_NS;
use crate::timing::CNC_CYCLE_NS;

/// How long STEP must stay high, and low, in ns.
pub const STEP_NS: u32 = 1900;
/// From a change of DIR to a rising STEP, and from a rising STEP to a change of DIR, in ns.
pub const DIR_SETUP_HOLD_NS: u32 = 200;
/// Maximum number of steps per second.
pub const MAX_STEP_HZ: u32 = 250_000;
/// From waking the chip (nSLEEP high) to the first step, in ns.
pub const WAKE_NS: u32 = 1_000_000;

// A pulse of the reference design, and what it leaves of its cycle.
const _: () = assert!(PULSE_NS as u32 >= STEP_NS && CNC_CYCLE_NS - PULSE_NS as u32 >= STEP_NS);
const _: () = assert!(CNC_CYCLE_NS == 1_000_000_000 / MAX_STEP_HZ);

/// STATUS: faults, with the data sheet's names. It is payload byte 0 of the device frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Status(u8);

bitflags::bitflags! {
    impl Status: u8 {
        /// Overtemperature shutdown: too hot.
        const OTS = 1 << 0;
        /// Over-current in bridge A.
        const AOCP = 1 << 1;
        /// Over-current in bridge B.
        const BOCP = 1 << 2;
        /// Predriver fault in bridge A.
        const APDF = 1 << 3;
        /// Predriver fault in bridge B.
        const BPDF = 1 << 4;
        /// Undervoltage lockout: supply too low.
        const UVLO = 1 << 5;
        /// Stall.
        const STD = 1 << 6;
        /// Stall, latched.
        const STDLAT = 1 << 7;
    }
}

servowire_core::show_flags!(Status);

impl Status {
    /// The six faults; the stall bits are not faults.
    pub const FAULTS: Self = Self(0x3f);
    /// The value that clears the six fault bits and leaves the stall bits; writing 0 clears a bit.
    pub const CLEAR_FAULTS: u16 = 0xfc0;
    /// The value that clears all bits.
    pub const CLEAR_ALL: u16 = 0;

    /// Creates the status from the register's value; its upper four bits are reserved and dropped.
    pub const fn of_register(value: u16) -> Self {
        let [_, low] = value.to_be_bytes();
        Self(low)
    }

    /// Returns whether one of the six faults is set.
    pub const fn is_fault(self) -> bool {
        self.intersects(Self::FAULTS)
    }

    /// All ones: with the fault pin inactive, the chip has no supply. Reading back the OFF register reveals a dead bus.
    pub const fn looks_unpowered(self) -> bool {
        self.is_all()
    }

    /// The value that clears exactly the bits that are set here.
    pub const fn clear_these(self) -> u16 {
        !(self.0 as u16) & 0xfff
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_status_byte_has_its_bits() {
        for byte in 0..=u8::MAX {
            let status = Status::from_bits_retain(byte);
            for high in 0..16 {
                assert_eq!(Status::of_register(high << 8 | u16::from(byte)), status);
            }
            assert_eq!(status.is_fault(), byte & 0x3f != 0);
            assert_eq!(status.looks_unpowered(), byte == 0xff);
            // Writing 0 clears: what is left are the bits that were not set.
            assert_eq!(status.clear_these(), 0xfff - u16::from(byte));
        }
        assert_eq!(Status::CLEAR_FAULTS & 0x3f, 0);
        assert_eq!((Status::OTS | Status::UVLO | Status::STDLAT).to_string(), "OTS UVLO STDLAT");
    }
}
