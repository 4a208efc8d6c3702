//! Codes of the fields. Times and currents are the nominal values of the data sheet.

use super::error::Error;
use super::word::Register;

/// The values that a field may hold.
pub(super) trait Code: Sized {
    fn to(self) -> u16;
    fn from(register: Register, code: u16) -> Result<Self, Error>;
}

impl Code for bool {
    fn to(self) -> u16 {
        self.into()
    }

    fn from(_: Register, code: u16) -> Result<Self, Error> {
        Ok(code != 0)
    }
}

impl Code for u8 {
    fn to(self) -> u16 {
        self.into()
    }

    fn from(_: Register, code: u16) -> Result<Self, Error> {
        let [_, code] = code.to_be_bytes();
        Ok(code)
    }
}

/// Fields of two to four bits. The name of each value says what it does and is its only documentation.
macro_rules! values {
    ($($(#[$doc:meta])* $name:ident { $($value:ident = $code:literal $text:literal),+ $(,)? })+) => {
        $(
            servowire_core::codes! {
                $(#[$doc])*
                pub enum $name: u8 { $(#[doc = $text] $value = $code => $text),+ }
            }

            impl Code for $name {
                fn to(self) -> u16 {
                    self.code().into()
                }

                fn from(register: Register, code: u16) -> Result<Self, Error> {
                    let [_, code] = code.to_be_bytes();
                    Self::from_code(code).ok_or(Error::ReservedCode { register: register.code(), code })
                }
            }
        )+
    };
}

values! {
    /// MODE: micro-steps per full step.
    StepMode {
        Full = 0 "1", Div2 = 1 "1/2", Div4 = 2 "1/4", Div8 = 3 "1/8", Div16 = 4 "1/16", Div32 = 5 "1/32",
        Div64 = 6 "1/64", Div128 = 7 "1/128", Div256 = 8 "1/256",
    }

    /// ISGAIN: gain of the sense amplifier.
    IsGain { X5 = 0 "5", X10 = 1 "10", X20 = 2 "20", X40 = 3 "40" }

    /// DTIME: dead time of the bridges.
    DeadTime { Ns400 = 0 "400 ns", Ns450 = 1 "450 ns", Ns650 = 2 "650 ns", Ns850 = 3 "850 ns" }

    /// SMPLTH: sample time of the back EMF.
    SampleThreshold {
        Us50 = 0 "50 us", Us100 = 1 "100 us", Us200 = 2 "200 us", Us300 = 3 "300 us", Us400 = 4 "400 us",
        Us600 = 5 "600 us", Us800 = 6 "800 us", Us1000 = 7 "1000 us",
    }

    /// DECMOD: how the current decays; if a name has two words, the first is for rising and the second for falling current.
    DecayMode {
        Slow = 0 "slow", SlowMixed = 1 "slow/mixed", Fast = 2 "fast", Mixed = 3 "mixed",
        SlowAutoMixed = 4 "slow/auto mixed", AutoMixed = 5 "auto mixed",
    }

    /// SDCNT: number of steps without back EMF that count as a stall.
    StallCount { Steps1 = 0 "1", Steps2 = 1 "2", Steps4 = 2 "4", Steps8 = 3 "8" }

    /// VDIV: divider of the back EMF.
    StallDivider { Div32 = 0 "32", Div16 = 1 "16", Div8 = 2 "8", Div4 = 3 "4" }

    /// OCPTH: threshold of the over-current protection.
    OcpThreshold { Mv250 = 0 "250 mV", Mv500 = 1 "500 mV", Mv750 = 2 "750 mV", Mv1000 = 3 "1000 mV" }

    /// OCPDEG: deglitch time of the over-current protection.
    OcpDeglitch { Us1 = 0 "1 us", Us2 = 1 "2 us", Us4 = 2 "4 us", Us8 = 3 "8 us" }

    /// TDRIVEN, TDRIVEP: how long the gate drive is on.
    DriveTime { Ns250 = 0 "250 ns", Ns500 = 1 "500 ns", Ns1000 = 2 "1000 ns", Ns2000 = 3 "2000 ns" }

    /// IDRIVEN: gate current of the low side.
    SinkCurrent { Ma100 = 0 "100 mA", Ma200 = 1 "200 mA", Ma300 = 2 "300 mA", Ma400 = 3 "400 mA" }

    /// IDRIVEP: gate current of the high side.
    SourceCurrent { Ma50 = 0 "50 mA", Ma100 = 1 "100 mA", Ma150 = 2 "150 mA", Ma200 = 3 "200 mA" }
}

impl IsGain {
    /// The gain: 5, 10, 20 or 40.
    pub const fn factor(self) -> u8 {
        match self {
            Self::X5 => 5,
            Self::X10 => 10,
            Self::X20 => 20,
            Self::X40 => 40,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nine_step_modes_and_six_decay_modes_exist() {
        for code in 0..=u8::MAX {
            assert_eq!(StepMode::from_code(code).map(StepMode::code), (code <= 8).then_some(code));
            assert_eq!(DecayMode::from_code(code).map(DecayMode::code), (code <= 5).then_some(code));
            assert_eq!(IsGain::from_code(code).map(IsGain::code), (code <= 3).then_some(code));
            assert_eq!(SampleThreshold::from_code(code).map(SampleThreshold::code), (code <= 7).then_some(code));
        }
    }

    /// The data sheet's tables, written down once more: a name is what its code does.
    #[test]
    fn every_name_has_the_code_of_the_data_sheet() {
        let dead_times = [DeadTime::Ns400, DeadTime::Ns450, DeadTime::Ns650, DeadTime::Ns850];
        assert_eq!(dead_times.map(DeadTime::code), [0, 1, 2, 3]);
        assert_eq!([0, 1, 2, 3].map(|code| IsGain::from_code(code).unwrap().factor()), [5, 10, 20, 40]);
        let drive = [DriveTime::Ns250, DriveTime::Ns500, DriveTime::Ns1000, DriveTime::Ns2000];
        assert_eq!(drive.map(DriveTime::code), [0, 1, 2, 3]);
        let sink = [SinkCurrent::Ma100, SinkCurrent::Ma200, SinkCurrent::Ma300, SinkCurrent::Ma400];
        assert_eq!(sink.map(SinkCurrent::code), [0, 1, 2, 3]);
        let source = [SourceCurrent::Ma50, SourceCurrent::Ma100, SourceCurrent::Ma150, SourceCurrent::Ma200];
        assert_eq!(source.map(SourceCurrent::code), [0, 1, 2, 3]);
        let ocp = [OcpThreshold::Mv250, OcpThreshold::Mv500, OcpThreshold::Mv750, OcpThreshold::Mv1000];
        assert_eq!(ocp.map(OcpThreshold::code), [0, 1, 2, 3]);
        let deglitch = [OcpDeglitch::Us1, OcpDeglitch::Us2, OcpDeglitch::Us4, OcpDeglitch::Us8];
        assert_eq!(deglitch.map(OcpDeglitch::code), [0, 1, 2, 3]);
        let stall = [StallCount::Steps1, StallCount::Steps2, StallCount::Steps4, StallCount::Steps8];
        assert_eq!(stall.map(StallCount::code), [0, 1, 2, 3]);
        let divider = [StallDivider::Div32, StallDivider::Div16, StallDivider::Div8, StallDivider::Div4];
        assert_eq!(divider.map(StallDivider::code), [0, 1, 2, 3]);
        assert_eq!((StepMode::Full.code(), StepMode::Div256.code()), (0, 8));
        assert_eq!((DecayMode::Slow.code(), DecayMode::AutoMixed.code()), (0, 5));
    }

    #[cfg(feature = "serde")]
    #[test]
    fn a_code_that_the_data_sheet_reserves_has_no_name() {
        assert!(serde_json::from_str::<DecayMode>("\"AutoMixed\"").is_ok());
        assert!(serde_json::from_str::<DecayMode>("6").is_err());
    }
}
