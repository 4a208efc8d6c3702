//! Codes of the fields. Times and currents are the data sheet's nominal ones.

use super::Register;
use crate::error::Error;

/// What a field may hold.
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

macro_rules! field_codes {
    ($($name:ident)+) => {
        $(
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

field_codes! {
    StepMode IsGain DeadTime SampleThreshold DecayMode StallCount StallDivider OcpThreshold OcpDeglitch DriveTime
    SinkCurrent SourceCurrent
}

servowire_core::codes! {
    /// MODE: micro-steps for each full step.
    pub enum StepMode: u8 {
        /// 1
        Full = 0 => "1",
        /// 2
        Div2 = 1 => "1/2",
        /// 4
        Div4 = 2 => "1/4",
        /// 8
        Div8 = 3 => "1/8",
        /// 16
        Div16 = 4 => "1/16",
        /// 32
        Div32 = 5 => "1/32",
        /// 64
        Div64 = 6 => "1/64",
        /// 128
        Div128 = 7 => "1/128",
        /// 256: 51 200 for a turn of a motor with 200 steps.
        Div256 = 8 => "1/256",
    }
}

servowire_core::codes! {
    /// ISGAIN: gain of the sense amplifier.
    pub enum IsGain: u8 {
        /// 5
        X5 = 0 => "5",
        /// 10
        X10 = 1 => "10",
        /// 20
        X20 = 2 => "20",
        /// 40
        X40 = 3 => "40",
    }
}

impl IsGain {
    /// 5, 10, 20 or 40.
    pub const fn factor(self) -> u8 {
        match self {
            Self::X5 => 5,
            Self::X10 => 10,
            Self::X20 => 20,
            Self::X40 => 40,
        }
    }
}

servowire_core::codes! {
    /// DTIME: dead time of the bridges.
    pub enum DeadTime: u8 {
        /// 400 ns
        Ns400 = 0 => "400 ns",
        /// 450 ns
        Ns450 = 1 => "450 ns",
        /// 650 ns
        Ns650 = 2 => "650 ns",
        /// 850 ns
        Ns850 = 3 => "850 ns",
    }
}

servowire_core::codes! {
    /// SMPLTH: sample time of the back EMF.
    pub enum SampleThreshold: u8 {
        /// 50 us
        Us50 = 0 => "50 us",
        /// 100 us
        Us100 = 1 => "100 us",
        /// 200 us
        Us200 = 2 => "200 us",
        /// 300 us
        Us300 = 3 => "300 us",
        /// 400 us
        Us400 = 4 => "400 us",
        /// 600 us
        Us600 = 5 => "600 us",
        /// 800 us
        Us800 = 6 => "800 us",
        /// 1000 us
        Us1000 = 7 => "1000 us",
    }
}

servowire_core::codes! {
    /// DECMOD: how the current decays.
    pub enum DecayMode: u8 {
        /// Slow.
        Slow = 0 => "slow",
        /// Slow while the current rises, mixed while it falls.
        SlowMixed = 1 => "slow/mixed",
        /// Fast.
        Fast = 2 => "fast",
        /// Mixed.
        Mixed = 3 => "mixed",
        /// Slow while the current rises, auto mixed while it falls.
        SlowAutoMixed = 4 => "slow/auto mixed",
        /// Auto mixed.
        AutoMixed = 5 => "auto mixed",
    }
}

servowire_core::codes! {
    /// SDCNT: steps without back EMF that make a stall.
    pub enum StallCount: u8 {
        /// 1
        Steps1 = 0 => "1",
        /// 2
        Steps2 = 1 => "2",
        /// 4
        Steps4 = 2 => "4",
        /// 8
        Steps8 = 3 => "8",
    }
}

servowire_core::codes! {
    /// VDIV: divider of the back EMF.
    pub enum StallDivider: u8 {
        /// 32
        Div32 = 0 => "32",
        /// 16
        Div16 = 1 => "16",
        /// 8
        Div8 = 2 => "8",
        /// 4
        Div4 = 3 => "4",
    }
}

servowire_core::codes! {
    /// OCPTH: threshold of the over-current protection.
    pub enum OcpThreshold: u8 {
        /// 250 mV
        Mv250 = 0 => "250 mV",
        /// 500 mV
        Mv500 = 1 => "500 mV",
        /// 750 mV
        Mv750 = 2 => "750 mV",
        /// 1000 mV
        Mv1000 = 3 => "1000 mV",
    }
}

servowire_core::codes! {
    /// OCPDEG: deglitch time of the over-current protection.
    pub enum OcpDeglitch: u8 {
        /// 1 us
        Us1 = 0 => "1 us",
        /// 2 us
        Us2 = 1 => "2 us",
        /// 4 us
        Us4 = 2 => "4 us",
        /// 8 us
        Us8 = 3 => "8 us",
    }
}

servowire_core::codes! {
    /// TDRIVEN, TDRIVEP: how long the gate drive is on.
    pub enum DriveTime: u8 {
        /// 250 ns
        Ns250 = 0 => "250 ns",
        /// 500 ns
        Ns500 = 1 => "500 ns",
        /// 1000 ns
        Ns1000 = 2 => "1000 ns",
        /// 2000 ns
        Ns2000 = 3 => "2000 ns",
    }
}

servowire_core::codes! {
    /// IDRIVEN: gate current of the low side.
    pub enum SinkCurrent: u8 {
        /// 100 mA
        Ma100 = 0 => "100 mA",
        /// 200 mA
        Ma200 = 1 => "200 mA",
        /// 300 mA
        Ma300 = 2 => "300 mA",
        /// 400 mA
        Ma400 = 3 => "400 mA",
    }
}

servowire_core::codes! {
    /// IDRIVEP: gate current of the high side.
    pub enum SourceCurrent: u8 {
        /// 50 mA
        Ma50 = 0 => "50 mA",
        /// 100 mA
        Ma100 = 1 => "100 mA",
        /// 150 mA
        Ma150 = 2 => "150 mA",
        /// 200 mA
        Ma200 = 3 => "200 mA",
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
}
