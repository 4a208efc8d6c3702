use core::fmt;

use crate::Version;

/// ES, the four status bits of every information field but those of commands 21 and 22.
///
/// ```text
///  line, time →  ES0                ES1      ES2                        ES3
///                BUSY or MEMBUSY    BATT     OVSPD, MEMERR or OVTEMP    STERR, PSERR, MTERR or INCERR
/// ```
///
/// ES0 is sent first; release 9.2 of the AM243x Motor Control SDK shows the four bits in reverse.
/// Where OVFLOW goes is not documented: no bit follows it here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(from = "u8", into = "u8"))]
pub struct EncoderStatus(u8);

impl EncoderStatus {
    /// No bit set.
    pub const NONE: Self = Self(0);

    /// The four low bits of `raw`, ES0 in bit 0.
    pub const fn new(raw: u8) -> Self {
        Self(raw & 0xf)
    }

    /// The four bits, ES0 in bit 0.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// ES0: the position is being determined, or the EEPROM is at work.
    pub const fn busy(self) -> bool {
        self.0 & 1 != 0
    }

    /// ES1: the battery is low.
    pub const fn battery(self) -> bool {
        self.0 & 2 != 0
    }

    /// ES2: over-speed, EEPROM fault or over-temperature.
    pub const fn warning(self) -> bool {
        self.0 & 4 != 0
    }

    /// ES3: the position or the turns cannot be trusted.
    pub const fn error(self) -> bool {
        self.0 & 8 != 0
    }

    /// Whether any bit is set: the one status bit of commands 21 and 22.
    pub const fn any(self) -> bool {
        self.0 != 0
    }

    /// What an encoder with these alarms shows.
    ///
    /// The alarms of a second sensor unit (version 3.0) feed no bit: whether they should is not documented.
    pub const fn of_alarms(alm: Alm) -> Self {
        let es0 = alm.any_of(Alm::BUSY.0 | Alm::MEMBUSY.0) as u8;
        let es1 = alm.any_of(Alm::BATT.0) as u8;
        let es2 = alm.any_of(Alm::OVSPD.0 | Alm::MEMERR.0 | Alm::OVTEMP.0) as u8;
        let es3 = alm.any_of(Alm::MTERR.0 | Alm::STERR.0 | Alm::PSERR.0 | Alm::INCERR.0) as u8;
        Self(es0 | es1 << 1 | es2 << 2 | es3 << 3)
    }
}

impl From<u8> for EncoderStatus {
    fn from(raw: u8) -> Self {
        Self::new(raw)
    }
}

impl From<EncoderStatus> for u8 {
    fn from(status: EncoderStatus) -> Self {
        status.raw()
    }
}

impl fmt::Display for EncoderStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bits =
            [(self.busy(), "busy"), (self.battery(), "battery"), (self.warning(), "warning"), (self.error(), "error")];
        list(f, bits.into_iter().filter(|(set, _)| *set).map(|(_, name)| name))
    }
}

/// One alarm of the alarm field. The discriminant is its bit.
///
/// The last five are those of a second sensor unit and exist in version 3.0 only.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum Alarm {
    /// BATT: the battery is below its limit.
    Batt = 0,
    /// MTERR: back-up capacitor or battery at or below 2.45 V; the turns cannot be trusted.
    MtErr = 1,
    /// OVFLOW: the turns, read as a signed number, left -32768..=32767.
    OvFlow = 2,
    /// OVSPD: over-speed of the optical or the multi-turn part.
    OvSpd = 3,
    /// MEMERR: an access to the EEPROM failed.
    MemErr = 4,
    /// STERR: absolute and incremental part disagree.
    StErr = 5,
    /// PSERR: single-turn and multi-turn calculation disagree by a turn or more.
    PsErr = 6,
    /// BUSY: the single-turn position is being determined.
    Busy = 7,
    /// MEMBUSY: the EEPROM is at work.
    MemBusy = 8,
    /// OVTEMP: the temperature sensor is over its limit.
    OvTemp = 9,
    /// INCERR: amplitude or level of the incremental signals is bad.
    IncErr = 10,
    /// OVSPD of the second unit.
    OvSpdS = 11,
    /// STERR of the second unit.
    StErrS = 12,
    /// PSERR of the second unit.
    PsErrS = 13,
    /// BUSY of the second unit.
    BusyS = 14,
    /// INCERR of the second unit.
    IncErrS = 15,
}

impl Alarm {
    /// All sixteen, from bit 0 up.
    pub const ALL: [Self; 16] = [
        Self::Batt,
        Self::MtErr,
        Self::OvFlow,
        Self::OvSpd,
        Self::MemErr,
        Self::StErr,
        Self::PsErr,
        Self::Busy,
        Self::MemBusy,
        Self::OvTemp,
        Self::IncErr,
        Self::OvSpdS,
        Self::StErrS,
        Self::PsErrS,
        Self::BusyS,
        Self::IncErrS,
    ];

    /// The first version that has this alarm.
    pub const fn min_version(self) -> Version {
        if self as u8 > 10 { Version::V3_0 } else { Version::V2_1 }
    }

    /// The name in capitals, as vendor tools print it.
    pub const fn short(self) -> &'static str {
        match self {
            Self::Batt => "BATT",
            Self::MtErr => "MTERR",
            Self::OvFlow => "OVFLOW",
            Self::OvSpd => "OVSPD",
            Self::MemErr => "MEMERR",
            Self::StErr => "STERR",
            Self::PsErr => "PSERR",
            Self::Busy => "BUSY",
            Self::MemBusy => "MEMBUSY",
            Self::OvTemp => "OVTEMP",
            Self::IncErr => "INCERR",
            Self::OvSpdS => "OVSPD_S",
            Self::StErrS => "STERR_S",
            Self::PsErrS => "PSERR_S",
            Self::BusyS => "BUSY_S",
            Self::IncErrS => "INCERR_S",
        }
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.short())
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
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Alm(u16);

impl Alm {
    /// No alarm.
    pub const NONE: Self = Self(0);
    const BATT: Self = Self::of(Alarm::Batt);
    const MTERR: Self = Self::of(Alarm::MtErr);
    const OVSPD: Self = Self::of(Alarm::OvSpd);
    const MEMERR: Self = Self::of(Alarm::MemErr);
    const STERR: Self = Self::of(Alarm::StErr);
    const PSERR: Self = Self::of(Alarm::PsErr);
    const BUSY: Self = Self::of(Alarm::Busy);
    const MEMBUSY: Self = Self::of(Alarm::MemBusy);
    const OVTEMP: Self = Self::of(Alarm::OvTemp);
    const INCERR: Self = Self::of(Alarm::IncErr);

    /// Any 16 bits are an alarm field.
    pub const fn new(raw: u16) -> Self {
        Self(raw)
    }

    /// Only this alarm.
    pub const fn of(alarm: Alarm) -> Self {
        Self(1_u16.wrapping_shl(alarm as u32))
    }

    /// The 16 bits.
    pub const fn raw(self) -> u16 {
        self.0
    }

    /// Whether this alarm is set.
    pub const fn has(self, alarm: Alarm) -> bool {
        self.any_of(Self::of(alarm).0)
    }

    /// With this alarm set or cleared.
    pub const fn with(self, alarm: Alarm, set: bool) -> Self {
        let bit = Self::of(alarm).0;
        Self(if set { self.0 | bit } else { self.0 & !bit })
    }

    /// The alarms that are set and that encoders of `version` have, from bit 0 up.
    pub fn alarms(self, version: Version) -> impl Iterator<Item = Alarm> {
        Alarm::ALL.into_iter().filter(move |alarm| self.has(*alarm) && alarm.min_version() <= version)
    }

    /// The bits that encoders of `version` do not use: 11 to 15 in version 2.1, none in 3.0.
    pub const fn reserved(self, version: Version) -> u16 {
        match version {
            Version::V2_1 => self.0 >> 11,
            Version::V3_0 => 0,
        }
    }

    const fn any_of(self, mask: u16) -> bool {
        self.0 & mask != 0
    }
}

impl fmt::Display for Alm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        list(f, self.alarms(Version::V3_0).map(Alarm::short))
    }
}

/// A predictive maintenance notice of version 3.0. The discriminant is its bit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum PmAlarm {
    /// INCW1: the incremental signals of unit 1 have become weak.
    IncW1 = 0,
    /// INCW2: the incremental signals of unit 2 have become weak.
    IncW2 = 1,
    /// IFW1: the LED current of unit 1.
    IfW1 = 4,
    /// IFW2: the LED current of unit 2.
    IfW2 = 5,
}

impl PmAlarm {
    /// All four, from the lowest bit up.
    pub const ALL: [Self; 4] = [Self::IncW1, Self::IncW2, Self::IfW1, Self::IfW2];

    /// The name in capitals, as vendor tools print it.
    pub const fn short(self) -> &'static str {
        match self {
            Self::IncW1 => "INCW1",
            Self::IncW2 => "INCW2",
            Self::IfW1 => "IFW1",
            Self::IfW2 => "IFW2",
        }
    }
}

impl fmt::Display for PmAlarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.short())
    }
}

/// PM-ALM, the predictive maintenance field of version 3.0; zero in version 2.1.
///
/// ```text
///  bit   7 6   5    4   3 2   1     0
///        -    IFW2 IFW1  -  INCW2 INCW1
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct PmAlm(u8);

impl PmAlm {
    /// Any byte is a field.
    pub const fn new(raw: u8) -> Self {
        Self(raw)
    }

    /// The byte.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// Whether this notice is set.
    pub const fn has(self, alarm: PmAlarm) -> bool {
        self.0 & 1_u8.wrapping_shl(alarm as u32) != 0
    }

    /// The notices that are set, from the lowest bit up.
    pub fn alarms(self) -> impl Iterator<Item = PmAlarm> {
        PmAlarm::ALL.into_iter().filter(move |alarm| self.has(*alarm))
    }
}

impl fmt::Display for PmAlm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        list(f, self.alarms().map(PmAlarm::short))
    }
}

/// Names separated by blanks, or a dash.
fn list(f: &mut fmt::Formatter<'_>, names: impl Iterator<Item = &'static str>) -> fmt::Result {
    let mut any = false;
    for name in names {
        if any {
            f.write_str(" ")?;
        }
        f.write_str(name)?;
        any = true;
    }
    if any { Ok(()) } else { f.write_str("-") }
}

#[cfg(feature = "arbitrary")]
impl<'a> arbitrary::Arbitrary<'a> for EncoderStatus {
    fn arbitrary(from: &mut arbitrary::Unstructured<'a>) -> arbitrary::Result<Self> {
        Ok(Self::new(from.arbitrary()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;
    use std::vec::Vec;

    #[test]
    fn the_summary_of_every_alarm() {
        let es = |alarm| EncoderStatus::of_alarms(Alm::of(alarm)).raw();
        let want = [2, 8, 0, 4, 4, 8, 8, 1, 1, 4, 8, 0, 0, 0, 0, 0];
        assert_eq!(Alarm::ALL.map(es), want);
        for raw in 0..=u16::MAX {
            let alm = Alm::new(raw);
            let parts = alm.alarms(Version::V3_0).fold(0, |sum, alarm| sum | es(alarm));
            assert_eq!(EncoderStatus::of_alarms(alm).raw(), parts);
            assert_eq!(alm.alarms(Version::V3_0).fold(Alm::NONE, |sum, alarm| sum.with(alarm, true)), alm);
        }
    }

    #[test]
    fn versions_differ_in_the_upper_bits() {
        let alm = Alm::new(0xffff);
        assert_eq!(alm.alarms(Version::V2_1).count(), 11);
        assert_eq!((alm.reserved(Version::V2_1), alm.reserved(Version::V3_0)), (31, 0));
        assert_eq!(PmAlm::new(0xf4).alarms().collect::<Vec<_>>(), [PmAlarm::IfW1, PmAlarm::IfW2]);
    }

    #[test]
    fn text() {
        assert_eq!(Alm::new(0x0301).to_string(), "BATT MEMBUSY OVTEMP");
        assert_eq!(EncoderStatus::new(0xa).to_string(), "battery error");
        assert_eq!(EncoderStatus::NONE.to_string(), "-");
    }
}
