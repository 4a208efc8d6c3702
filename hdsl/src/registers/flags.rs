//! The flags in the registers.

/// Declares a set of flags in a register.
macro_rules! flags {
    ($(#[$doc:meta])* $name:ident($raw:ty) { $($(#[$($bit_doc:tt)*])* $bit:ident = $at:expr,)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        pub struct $name($raw);

        bitflags::bitflags! {
            impl $name: $raw {
                $($(#[$($bit_doc)*])* const $bit = 1 << $at;)*
                // What has no name here stays as it is.
                const _ = !0;
            }
        }

        servowire_core::show_flags!($name);
    };
}

flags! {
    /// EVENT_H and EVENT_L: what happened since the application wrote 0 to the flag. MASK_H and MASK_L have the same
    /// places.
    Event(u16) {
        /// A bit of SUMMARY that MASK_SUM lets through is set.
        SUM = 14,
        /// The fast position is not reliable.
        POS = 11,
        /// The link was restarted.
        PRST = 8,
        /// The encoder answered INIT.
        MIN = 5,
        /// A long message was not answered properly: LNAK, a wrong CRC, or no answer.
        ANS = 4,
        /// The quality monitor is below 14.
        QMLW = 2,
        /// A long message is done or was dropped; also at lock.
        FREL = 1,
    }
}

flags! {
    /// EVENT_S: safe events. MASK_S has the same places.
    EventS(u8) {
        /// SUMMARY is not 0.
        SSUM = 6,
        /// Wrong CRC of safe channel 1.
        SCE = 5,
        /// No safe position.
        VPOS = 4,
        /// The quality monitor is below 14.
        QMLW = 3,
        /// The link was restarted.
        PRST = 2,
        /// The encoder answered INIT.
        MIN = 1,
        /// A short message is done or was dropped; also at lock.
        FRES = 0,
    }
}

flags! {
    /// ONLINE_STATUS_D: the present status, for the drive.
    OnlineD(u16) {
        /// SUMMARY is not 0.
        SUM = 14,
        /// Always 1.
        FIX1 = 12,
        /// The fast position is not reliable.
        POS = 11,
        /// From a restart until the line check has passed.
        PRST = 8,
        /// The encoder answers INIT.
        MIN = 5,
        /// The last long message was not answered properly.
        ANS = 4,
        /// The quality monitor is below 14.
        QMLW = 2,
        /// No long message is under way.
        FREL = 1,
    }
}

flags! {
    /// ONLINE_STATUS_1: the present status, for safe channel 1.
    Online1(u16) {
        /// SUMMARY is not 0.
        SSUM = 14,
        /// Wrong CRC; cleared by the next correct one.
        SCE = 13,
        /// Always 1.
        FIX1 = 12,
        /// No safe position; cleared by the next good one.
        VPOS = 10,
        /// From a restart until the line check has passed.
        PRST = 8,
        /// The encoder answers INIT.
        MIN = 5,
        /// The quality monitor is below 14.
        QMLW = 2,
        /// No short message is under way.
        FRES = 0,
    }
}

flags! {
    /// ONLINE_STATUS_2: the present status, for safe channel 2.
    Online2(u16) {
        /// TEST2 or ERR2 of STATUS2 is set.
        SUM2 = 14,
        /// Wrong CRC.
        SCE2 = 13,
        /// Always 1.
        FIX1 = 12,
        /// No safe position.
        VPOS2 = 10,
        /// From a restart until the line check has passed.
        PRST = 8,
        /// The quality monitor is below 14.
        QMLW = 2,
    }
}

flags! {
    /// The interrupt lines of the SDK, in the order of their numbers.
    Interrupts(u8) {
        /// 0: an event that MASK_H and MASK_L let through.
        EVENT = 0,
        /// 1: a new safe position 1.
        VPOS = 1,
        /// 2: a new safe position 2.
        VPOS2 = 2,
        /// 3: an H-frame was received.
        H_FRAME = 3,
        /// 4: a safe event that MASK_S lets through.
        SAFE_EVENT = 4,
    }
}

flags! {
    /// STATUS2, the first byte of safe channel 2.
    Status2(u8) {
        /// Alternates from V-frame to V-frame.
        TOG2 = 7,
        /// A test runs.
        TEST2 = 6,
        /// An error in channel 2.
        ERR2 = 5,
    }
}

/// What has happened since the last query.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Events {
    /// EVENT_H and EVENT_L, of the drive.
    pub drive: Event,
    /// EVENT_S, of the safe channels.
    pub safe: EventS,
}

impl Status2 {
    /// FIX2, bits 4:0: 11100b.
    pub const fn is_fixed_part_right(self) -> bool {
        self.bits() & 0b1_1111 == 0b1_1100
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    /// The places of all flags, as the register list prints them.
    #[test]
    fn places() {
        let online =
            [OnlineD::SUM, OnlineD::FIX1, OnlineD::POS, OnlineD::PRST, OnlineD::MIN, OnlineD::ANS, OnlineD::QMLW];
        assert_eq!(online.map(|flag| flag.bits()), [0x4000, 0x1000, 0x0800, 0x0100, 0x20, 0x10, 4]);
        assert_eq!((Online1::SCE.bits(), Online1::VPOS.bits(), Online1::FRES.bits()), (0x2000, 0x0400, 1));
        assert_eq!((Online2::SUM2.bits(), Online2::SCE2.bits(), Online2::VPOS2.bits()), (0x4000, 0x2000, 0x0400));
        assert_eq!((Event::PRST.bits(), EventS::SSUM.bits(), OnlineD::FREL.bits()), (0x0100, 0x40, 2));
    }

    #[test]
    fn as_a_log_shows_them() {
        assert_eq!((Event::SUM | Event::PRST | Event::FREL).to_string(), "SUM PRST FREL");
        assert_eq!(EventS::from_bits_retain(0x81).to_string(), "FRES 80h");
        assert_eq!(
            (EventS::default().to_string(), EventS::from_bits_retain(0x80).to_string()),
            ("-".into(), "80h".into())
        );
        assert_eq!(Status2::from_bits_retain(0x9c).to_string(), "TOG2 1Ch");
        assert!(Status2::from_bits_retain(0x9c).is_fixed_part_right());
    }
}
