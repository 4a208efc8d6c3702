use bitflags::bitflags;
use servowire_core::OutOfRange;

use crate::command::Version;

/// ES, the four status bits of every information field except those of commands 21 and 22.
///
/// ```text
///  line, time →  ES0                ES1      ES2                        ES3
///                BUSY or MEMBUSY    BATT     OVSPD, MEMERR or OVTEMP    STERR, PSERR, MTERR or INCERR
/// ```
///
/// ES0 is sent first; release 9.2 of the AM243x Motor Control SDK shows the four bits in reverse order. It is not documented
/// which bit OVFLOW sets; here it sets none.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(try_from = "u8", into = "u8"))]
pub struct EncoderStatus(u8);

bitflags! {
    impl EncoderStatus: u8 {
        /// ES0: the position is being determined, or the EEPROM is busy.
        const BUSY = 1 << 0;
        /// ES1: the battery is low.
        const BATT = 1 << 1;
        /// ES2: over-speed, EEPROM fault or over-temperature.
        const WARNING = 1 << 2;
        /// ES3: the position or the turns cannot be trusted.
        const ERROR = 1 << 3;
    }
}

impl EncoderStatus {
    /// Returns the status that an encoder with these alarms shows.
    ///
    /// The alarms of a second sensor unit (version 3.0) set no bit; it is not documented whether they should.
    pub const fn of_alarms(alm: Alm) -> Self {
        const WARNING: Alm = Alm::OVSPD.union(Alm::MEMERR).union(Alm::OVTEMP);
        const ERROR: Alm = Alm::MTERR.union(Alm::STERR).union(Alm::PSERR).union(Alm::INCERR);
        let es0 = alm.intersects(Alm::BUSY.union(Alm::MEMBUSY)) as u8;
        let es1 = alm.intersects(Alm::BATT) as u8;
        let es2 = alm.intersects(WARNING) as u8;
        let es3 = alm.intersects(ERROR) as u8;
        Self(es0 | es1 << 1 | es2 << 2 | es3 << 3)
    }
}

impl TryFrom<u8> for EncoderStatus {
    type Error = OutOfRange;

    fn try_from(bits: u8) -> Result<Self, OutOfRange> {
        Self::from_bits(bits).ok_or(OutOfRange::above(bits.into(), 15))
    }
}

impl From<EncoderStatus> for u8 {
    fn from(status: EncoderStatus) -> Self {
        status.bits()
    }
}

/// ALM, the alarm field. Bit i is the (i + 1)-th on the line.
///
/// ```text
///  bit  15       14     13      12      11      10     9      8       7    6     5     4      3     2      1     0
///       INCERR_S BUSY_S PSERR_S STERR_S OVSPD_S INCERR OVTEMP MEMBUSY BUSY PSERR STERR MEMERR OVSPD OVFLOW MTERR BATT
///       version 3.0, second unit; else reserved
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Alm(u16);

bitflags! {
    impl Alm: u16 {
        /// The battery is below its limit.
        const BATT = 1 << 0;
        /// Back-up capacitor or battery at or below 2.45 V; the turns cannot be trusted.
        const MTERR = 1 << 1;
        /// The turns, read as a signed number, exceeded -32768..=32767.
        const OVFLOW = 1 << 2;
        /// Over-speed of the optical or the multi-turn part.
        const OVSPD = 1 << 3;
        /// An access to the EEPROM failed.
        const MEMERR = 1 << 4;
        /// The absolute and the incremental part disagree.
        const STERR = 1 << 5;
        /// The single-turn and the multi-turn calculation disagree by a turn or more.
        const PSERR = 1 << 6;
        /// The single-turn position is being determined.
        const BUSY = 1 << 7;
        /// The EEPROM is busy.
        const MEMBUSY = 1 << 8;
        /// The temperature sensor is above its limit.
        const OVTEMP = 1 << 9;
        /// The amplitude or level of the incremental signals is bad.
        const INCERR = 1 << 10;
        /// OVSPD of the second unit. Version 3.0.
        const OVSPD_S = 1 << 11;
        /// STERR of the second unit. Version 3.0.
        const STERR_S = 1 << 12;
        /// PSERR of the second unit. Version 3.0.
        const PSERR_S = 1 << 13;
        /// BUSY of the second unit. Version 3.0.
        const BUSY_S = 1 << 14;
        /// INCERR of the second unit. Version 3.0.
        const INCERR_S = 1 << 15;
    }
}

impl Alm {
    /// The alarms that encoders of `version` have: bits 11 to 15 are reserved in version 2.1.
    pub const fn known(version: Version) -> Self {
        match version {
            Version::V2_1 => Self(0x07ff),
            Version::V3_0 => Self::all(),
        }
    }
}

/// PM-ALM, the predictive maintenance field of version 3.0; zero in version 2.1.
///
/// ```text
///  bit   7 6   5    4   3 2   1     0
///        -    IFW2 IFW1  -  INCW2 INCW1
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct PmAlm(u8);

bitflags! {
    impl PmAlm: u8 {
        /// The incremental signals of unit 1 have become weak.
        const INCW1 = 1 << 0;
        /// The incremental signals of unit 2 have become weak.
        const INCW2 = 1 << 1;
        /// The LED current of unit 1.
        const IFW1 = 1 << 4;
        /// The LED current of unit 2.
        const IFW2 = 1 << 5;

        const _ = !0;
    }
}

servowire_core::show_flags!(EncoderStatus, Alm, PmAlm);

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for EncoderStatus {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        from.arbitrary().map(Self::from_bits_truncate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[test]
    fn the_summary_of_every_alarm() {
        let es = |alarm| EncoderStatus::of_alarms(alarm).bits();
        let want = [2, 8, 0, 4, 4, 8, 8, 1, 1, 4, 8, 0, 0, 0, 0, 0];
        assert_eq!(core::array::from_fn(|bit| es(Alm::from_bits_retain(1 << bit))), want);
        for raw in (0..=u16::MAX).step_by(crate::STRIDE) {
            let alm = Alm::from_bits_retain(raw);
            assert_eq!(es(alm), alm.iter().fold(0, |sum, alarm| sum | es(alarm)));
        }
    }

    #[test]
    fn versions_differ_in_the_upper_bits() {
        let alm = Alm::all();
        assert_eq!((alm & Alm::known(Version::V2_1)).iter().count(), 11);
        assert_eq!(alm.difference(Alm::known(Version::V2_1)).bits() >> 11, 31);
        assert_eq!(Alm::known(Version::V3_0), alm);
        let pm_alm = PmAlm::from_bits_retain(0xf4);
        assert_eq!(pm_alm.iter_names().map(|(name, _)| name).collect::<Vec<_>>(), ["IFW1", "IFW2"]);
    }

    #[test]
    fn text() {
        assert_eq!(Alm::from_bits_retain(0x0301).to_string(), "BATT MEMBUSY OVTEMP");
        assert_eq!(EncoderStatus::from_bits_retain(0xa).to_string(), "BATT ERROR");
        assert_eq!((EncoderStatus::empty().to_string(), PmAlm::empty().to_string()), ("-".into(), "-".into()));
        assert_eq!(PmAlm::from_bits_retain(0xc1).to_string(), "INCW1 C0h");
        assert_eq!(PmAlm::from_bits_retain(0x04).to_string(), "04h");
    }
}
