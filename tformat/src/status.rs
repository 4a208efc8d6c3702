use core::fmt;

/// The status field (SF) of every readout and reset response.
///
/// ```text
///  bit   7     6     5     4     3    2    1    0
///       ca1 | ca0 | ea1 | ea0 | dd3  dd2  dd1  dd0
///        |     |     |     |     information, fixed 0
///        |     |     |     counting error: the condition of ALMC bit CE
///        |     |     one of ALMC bits OH, ME, BE, BA
///        |     parity error in the request
///        delimiter error in the request
/// ```
///
/// EEPROM responses carry no status, so alarms are not reported there. Over-speed, full-absolute status and counter
/// overflow are not in ea1. Some compatible encoders leave the field at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct StatusField(u8);

impl StatusField {
    const EA0: u8 = 1 << 4;
    const EA1: u8 = 1 << 5;
    const CA0: u8 = 1 << 6;
    const CA1: u8 = 1 << 7;

    /// Any byte is a status field.
    pub const fn new(raw: u8) -> Self {
        Self(raw)
    }

    /// The byte.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// dd0..dd3, fixed 0.
    pub const fn information(self) -> u8 {
        self.0 & 0x0f
    }

    /// ea0: counting error.
    pub const fn counting_error(self) -> bool {
        self.0 & Self::EA0 != 0
    }

    /// ea1: over-heat, multi-turn error, battery error or battery alarm.
    pub const fn other_error(self) -> bool {
        self.0 & Self::EA1 != 0
    }

    /// ca0: the request had a parity error.
    pub const fn request_parity_error(self) -> bool {
        self.0 & Self::CA0 != 0
    }

    /// ca1: the request had a delimiter error.
    pub const fn request_delimiter_error(self) -> bool {
        self.0 & Self::CA1 != 0
    }

    /// Whether the encoder says that the request was damaged (ca0 or ca1).
    ///
    /// After a request for ID 3 this is the only sign of it: the answer to a damaged request is an ID 3 frame too.
    pub const fn request_damaged(self) -> bool {
        self.0 & (Self::CA0 | Self::CA1) != 0
    }

    /// Whether ea0 and ea1 say what `almc` says: ea0 = CE, ea1 = OH or ME or BE or BA.
    ///
    /// A difference is worth a note in a diagnosis, not an error: compatible encoders leave SF at 0.
    pub const fn agrees_with(self, almc: Almc) -> bool {
        self.counting_error() == almc.has(Alarm::CountingError) && self.other_error() == (almc.raw() & 0xf0 != 0)
    }

    /// The status that an encoder with these alarms reports, without ca0 and ca1.
    pub const fn of_alarms(almc: Almc) -> Self {
        let ea0 = if almc.has(Alarm::CountingError) { Self::EA0 } else { 0 };
        let ea1 = if almc.raw() & 0xf0 != 0 { Self::EA1 } else { 0 };
        Self(ea0 | ea1)
    }

    /// The same with ca0 and ca1 set as given.
    pub const fn with_request_errors(self, parity: bool, delimiter: bool) -> Self {
        let ca0 = if parity { Self::CA0 } else { 0 };
        let ca1 = if delimiter { Self::CA1 } else { 0 };
        Self(self.0 & !(Self::CA0 | Self::CA1) | ca0 | ca1)
    }
}

impl fmt::Display for StatusField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#04x}", self.0)?;
        let names = [
            (self.counting_error(), "counting error"),
            (self.other_error(), "alarm"),
            (self.request_parity_error(), "request parity error"),
            (self.request_delimiter_error(), "request delimiter error"),
        ];
        for (_, name) in names.iter().filter(|(set, _)| *set) {
            write!(f, ", {name}")?;
        }
        Ok(())
    }
}

/// One alarm of the error byte ALMC. The discriminant is its bit.
///
/// How severe an alarm is depends on the drive: some mask the counter overflow in multi-turn use, most treat the
/// battery alarm as a warning, and a single-turn drive ignores the battery and multi-turn bits. So none is decided
/// here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
#[repr(u8)]
pub enum Alarm {
    /// OS: over-speed. Latched.
    OverSpeed = 0,
    /// FS: full absolute status; the single-turn accuracy is not yet guaranteed. Clears by itself.
    FullAbsoluteStatus = 1,
    /// CE: counting error. Latched.
    CountingError = 2,
    /// OF: overflow of the multi-turn counter. Latched.
    CounterOverflow = 3,
    /// OH: over-heat. Latched.
    OverHeat = 4,
    /// ME: multi-turn error. Latched.
    MultiTurnError = 5,
    /// BE: battery error; the multi-turn count cannot be trusted. Latched.
    BatteryError = 6,
    /// BA: battery alarm, the voltage is low (3.1 V in one 17-bit type). Clears by itself.
    BatteryAlarm = 7,
}

impl Alarm {
    /// All eight, from bit 0 up.
    pub const ALL: [Self; 8] = [
        Self::OverSpeed,
        Self::FullAbsoluteStatus,
        Self::CountingError,
        Self::CounterOverflow,
        Self::OverHeat,
        Self::MultiTurnError,
        Self::BatteryError,
        Self::BatteryAlarm,
    ];

    /// The two letters of the vendor's tables.
    pub const fn short(self) -> &'static str {
        match self {
            Self::OverSpeed => "OS",
            Self::FullAbsoluteStatus => "FS",
            Self::CountingError => "CE",
            Self::CounterOverflow => "OF",
            Self::OverHeat => "OH",
            Self::MultiTurnError => "ME",
            Self::BatteryError => "BE",
            Self::BatteryAlarm => "BA",
        }
    }

    /// The name in words.
    pub const fn name(self) -> &'static str {
        match self {
            Self::OverSpeed => "over-speed",
            Self::FullAbsoluteStatus => "full absolute status",
            Self::CountingError => "counting error",
            Self::CounterOverflow => "counter overflow",
            Self::OverHeat => "over-heat",
            Self::MultiTurnError => "multi-turn error",
            Self::BatteryError => "battery error",
            Self::BatteryAlarm => "battery alarm",
        }
    }

    /// Whether the alarm stays until ID 7 or ID C clears it (mask 0x7d of one drive maker).
    pub const fn is_latched(self) -> bool {
        Almc::LATCHED.has(self)
    }

    /// Whether encoders without a multi-turn counter (SmartInc) have this alarm too; SmartAbs has all.
    pub const fn is_in_smart_inc(self) -> bool {
        matches!(self, Self::FullAbsoluteStatus | Self::CountingError)
    }
}

impl fmt::Display for Alarm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The error byte (ALMC) of an ID 3 response.
///
/// ```text
///  bit   7    6    5    4    3    2    1    0
///       BA | BE | ME | OH | OF | CE | FS | OS
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Almc(u8);

impl Almc {
    /// No alarm.
    pub const NONE: Self = Self(0);
    /// The alarms that stay until they are reset.
    pub const LATCHED: Self = Self(0x7d);

    /// Any byte is an error byte.
    pub const fn new(raw: u8) -> Self {
        Self(raw)
    }

    /// The byte.
    pub const fn raw(self) -> u8 {
        self.0
    }

    /// Whether this alarm is set.
    pub const fn has(self, alarm: Alarm) -> bool {
        self.0 & Self::of(alarm).0 != 0
    }

    /// Only this alarm.
    pub const fn of(alarm: Alarm) -> Self {
        Self(1 << alarm as u8)
    }

    /// The alarms of both.
    pub const fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The alarms that are not in `other`.
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The alarms that are set, from bit 0 up.
    pub fn alarms(self) -> impl Iterator<Item = Alarm> {
        Alarm::ALL.into_iter().filter(move |alarm| self.has(*alarm))
    }
}

impl fmt::Display for Almc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#04x}", self.0)?;
        for alarm in self.alarms() {
            write!(f, " {}", alarm.short())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn every_status_byte() {
        for raw in 0..=255 {
            let sf = StatusField::new(raw);
            assert_eq!(sf.information(), raw % 16);
            let bits = [sf.counting_error(), sf.other_error(), sf.request_parity_error(), sf.request_delimiter_error()];
            assert_eq!(bits.iter().rev().fold(0, |b, &set| b << 1 | u8::from(set)), raw / 16);
            assert_eq!(sf.request_damaged(), raw >= 0x40);
        }
    }

    #[test]
    fn status_agrees_with_the_error_byte_by_its_rule() {
        for raw in 0..=255 {
            let almc = Almc::new(raw);
            let sf = StatusField::of_alarms(almc);
            assert_eq!(sf.counting_error(), raw & 4 != 0);
            assert_eq!(sf.other_error(), raw & 0xf0 != 0);
            assert!(sf.agrees_with(almc));
            assert!(!StatusField::new(sf.raw() ^ 0x10).agrees_with(almc));
            assert!(!StatusField::new(sf.raw() ^ 0x20).agrees_with(almc));
        }
    }

    #[test]
    fn alarms_are_named_and_latched_as_documented() {
        let short = Alarm::ALL.map(Alarm::short);
        assert_eq!(short, ["OS", "FS", "CE", "OF", "OH", "ME", "BE", "BA"]);
        let latched = Alarm::ALL.map(Alarm::is_latched);
        assert_eq!(latched, [true, false, true, true, true, true, true, false]);
        assert_eq!(Almc::new(0xc8).to_string(), "0xc8 OF BE BA");
        assert_eq!(StatusField::new(0x50).to_string(), "0x50, counting error, request parity error");
    }
}
