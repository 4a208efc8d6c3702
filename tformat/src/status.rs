/// The status field (SF) of every readout and reset response.
///
/// ```text
///  bit   7     6     5     4     3    2    1    0
///       CA1 | CA0 | EA1 | EA0 | DD3  DD2  DD1  DD0
///        |     |     |     |     information, fixed 0
///        |     |     |     counting error: the condition of ALMC bit CE
///        |     |     one of ALMC bits OH, ME, BE, BA
///        |     parity error in the request
///        delimiter error in the request
/// ```
///
/// EEPROM responses carry no status, so alarms are not reported there. Over-speed, full-absolute status and counter
/// overflow are not in EA1. Some compatible encoders leave the field at 0.
///
/// It is displayed as the names of the set bits: `EA1 CA0`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct StatusField(u8);

bitflags::bitflags! {
    impl StatusField: u8 {
        /// Information bit 0, fixed 0.
        const DD0 = 1 << 0;
        /// Information bit 1, fixed 0.
        const DD1 = 1 << 1;
        /// Information bit 2, fixed 0.
        const DD2 = 1 << 2;
        /// Information bit 3, fixed 0.
        const DD3 = 1 << 3;
        /// Counting error.
        const EA0 = 1 << 4;
        /// Over-heat, multi-turn error, battery error or battery alarm.
        const EA1 = 1 << 5;
        /// The request had a parity error.
        const CA0 = 1 << 6;
        /// The request had a delimiter error.
        const CA1 = 1 << 7;
    }
}

servowire_core::show_flags!(StatusField);

impl StatusField {
    /// What the encoder reports about a damaged request.
    ///
    /// After a request for ID 3, one of them is the only sign of damage: the response to a damaged request is an ID 3
    /// frame too.
    pub const REQUEST_DAMAGED: Self = Self::CA0.union(Self::CA1);

    /// Returns whether EA0 and EA1 agree with `almc`: EA0 = CE, EA1 = OH or ME or BE or BA.
    ///
    /// A difference is worth noting in a diagnosis but is not an error: some compatible encoders leave SF at 0.
    pub const fn agrees_with(self, almc: Almc) -> bool {
        let alarms = Self::EA0.union(Self::EA1);
        self.intersection(alarms).bits() == Self::of_alarms(almc).bits()
    }

    /// Returns the status that an encoder with these alarms reports, without CA0 and CA1.
    pub const fn of_alarms(almc: Almc) -> Self {
        let ea0 = if almc.contains(Almc::CE) { Self::EA0 } else { Self(0) };
        let ea1 = if almc.intersects(Almc::IN_EA1) { Self::EA1 } else { Self(0) };
        ea0.union(ea1)
    }

    /// All alarms that EA0 and EA1 may stand for.
    pub(crate) const fn alarms_behind(self) -> Almc {
        let ea0 = if self.contains(Self::EA0) { Almc::CE } else { Almc(0) };
        let ea1 = if self.contains(Self::EA1) { Almc::IN_EA1 } else { Almc(0) };
        ea0.union(ea1)
    }
}

/// The error byte (ALMC) of an ID 3 response.
///
/// ```text
///  bit   7    6    5    4    3    2    1    0
///       BA | BE | ME | OH | OF | CE | FS | OS
/// ```
///
/// How severe an alarm is depends on the drive: some mask the counter overflow in multi-turn use, most treat the battery
/// alarm as a warning, and a single-turn drive ignores the battery and multi-turn bits. So this crate does not decide it.
///
/// It is displayed as the names of the set bits: `OF BE BA`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Almc(u8);

bitflags::bitflags! {
    impl Almc: u8 {
        /// Over-speed. Latched.
        const OS = 1 << 0;
        /// Full absolute status: the single-turn accuracy is not yet guaranteed. Clears by itself.
        const FS = 1 << 1;
        /// Counting error. Latched.
        const CE = 1 << 2;
        /// Overflow of the multi-turn counter. Latched.
        const OF = 1 << 3;
        /// Over-heat. Latched.
        const OH = 1 << 4;
        /// Multi-turn error. Latched.
        const ME = 1 << 5;
        /// Battery error; the multi-turn count cannot be trusted. Latched.
        const BE = 1 << 6;
        /// Battery alarm: the voltage is low (3.1 V in one 17-bit type). Clears by itself.
        const BA = 1 << 7;
    }
}

servowire_core::show_flags!(Almc);

impl Almc {
    /// The alarms that stay until ID 7 or ID C clears them (mask 0x7d of one drive maker).
    pub const LATCHED: Self = Self(0x7d);
    /// The alarms that encoders without a multi-turn counter (SmartInc) also have; SmartAbs has all.
    pub const SMART_INC: Self = Self::FS.union(Self::CE);
    /// The alarms that [`StatusField::EA1`] sums up.
    pub const IN_EA1: Self = Self::OH.union(Self::ME).union(Self::BE).union(Self::BA);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[test]
    fn every_byte_is_a_status_and_an_error_byte() {
        for raw in 0..=255 {
            assert_eq!((StatusField::from_bits_retain(raw).bits(), Almc::from_bits_retain(raw).bits()), (raw, raw));
            let damaged = StatusField::from_bits_retain(raw).intersects(StatusField::REQUEST_DAMAGED);
            assert_eq!(damaged, raw >= 0x40);
        }
    }

    #[test]
    fn status_agrees_with_the_error_byte_by_its_rule() {
        for raw in 0..=255 {
            let almc = Almc::from_bits_retain(raw);
            let sf = StatusField::of_alarms(almc);
            assert_eq!(sf.bits(), (raw >> 2 & 1) << 4 | u8::from(raw & 0xf0 != 0) << 5);
            // Bits that do not speak of alarms make no difference.
            assert!(sf.agrees_with(almc) && StatusField::from_bits_retain(sf.bits() | 0xcf).agrees_with(almc));
            assert!(!StatusField::from_bits_retain(sf.bits() ^ 0x10).agrees_with(almc));
            assert!(!StatusField::from_bits_retain(sf.bits() ^ 0x20).agrees_with(almc));
        }
    }

    #[test]
    fn alarms_are_named_and_latched_as_documented() {
        let names: Vec<_> = Almc::all().iter_names().map(|(name, _)| name).collect();
        assert_eq!(names, ["OS", "FS", "CE", "OF", "OH", "ME", "BE", "BA"]);
        let latched: Vec<_> = Almc::LATCHED.iter_names().map(|(name, _)| name).collect();
        assert_eq!(latched, ["OS", "CE", "OF", "OH", "ME", "BE"]);
        // SmartInc encoders have the full absolute status and the counting error.
        assert_eq!(Almc::SMART_INC.to_string(), "FS CE");
        assert_eq!(Almc::from_bits_retain(0xc8).to_string(), "OF BE BA");
        assert_eq!(StatusField::from_bits_retain(0x51).to_string(), "DD0 EA0 CA0");
    }
}
