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

/// An enum over all codes of a two- or three-bit field.
macro_rules! codes {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $code:literal),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        #[repr(u8)]
        pub enum $name { $($(#[$variant_doc])* $variant = $code),+ }

        impl $name {
            /// The code in the register.
            pub const fn code(self) -> u8 {
                self as u8
            }

            /// The value of a code; `None` if the data sheet reserves it.
            pub const fn from_code(code: u8) -> Option<Self> {
                match code {
                    $($code => Some(Self::$variant),)+
                    _ => None,
                }
            }
        }

        impl Code for $name {
            fn to(self) -> u16 {
                self.code().into()
            }

            fn from(register: Register, code: u16) -> Result<Self, Error> {
                let [_, code] = code.to_be_bytes();
                Self::from_code(code).ok_or(Error::ReservedCode { register: register.address(), code })
            }
        }
    };
}

codes! {
    /// MODE: micro-steps for each full step.
    StepMode {
        /// 1
        Full = 0,
        /// 2
        Div2 = 1,
        /// 4
        Div4 = 2,
        /// 8
        Div8 = 3,
        /// 16
        Div16 = 4,
        /// 32
        Div32 = 5,
        /// 64
        Div64 = 6,
        /// 128
        Div128 = 7,
        /// 256: 51 200 for a turn of a motor with 200 steps.
        Div256 = 8,
    }
}

codes! {
    /// ISGAIN: gain of the sense amplifier.
    IsGain {
        /// 5
        X5 = 0,
        /// 10
        X10 = 1,
        /// 20
        X20 = 2,
        /// 40
        X40 = 3,
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

codes! {
    /// DTIME: dead time of the bridges.
    DeadTime {
        /// 400 ns
        Ns400 = 0,
        /// 450 ns
        Ns450 = 1,
        /// 650 ns
        Ns650 = 2,
        /// 850 ns
        Ns850 = 3,
    }
}

codes! {
    /// SMPLTH: sample time of the back EMF.
    SampleThreshold {
        /// 50 us
        Us50 = 0,
        /// 100 us
        Us100 = 1,
        /// 200 us
        Us200 = 2,
        /// 300 us
        Us300 = 3,
        /// 400 us
        Us400 = 4,
        /// 600 us
        Us600 = 5,
        /// 800 us
        Us800 = 6,
        /// 1000 us
        Us1000 = 7,
    }
}

codes! {
    /// DECMOD: how the current decays.
    DecayMode {
        /// Slow.
        Slow = 0,
        /// Slow while the current rises, mixed while it falls.
        SlowMixed = 1,
        /// Fast.
        Fast = 2,
        /// Mixed.
        Mixed = 3,
        /// Slow while the current rises, auto mixed while it falls.
        SlowAutoMixed = 4,
        /// Auto mixed.
        AutoMixed = 5,
    }
}

codes! {
    /// SDCNT: steps without back EMF that make a stall.
    StallCount {
        /// 1
        Steps1 = 0,
        /// 2
        Steps2 = 1,
        /// 4
        Steps4 = 2,
        /// 8
        Steps8 = 3,
    }
}

codes! {
    /// VDIV: divider of the back EMF.
    StallDivider {
        /// 32
        Div32 = 0,
        /// 16
        Div16 = 1,
        /// 8
        Div8 = 2,
        /// 4
        Div4 = 3,
    }
}

codes! {
    /// OCPTH: threshold of the over-current protection.
    OcpThreshold {
        /// 250 mV
        Mv250 = 0,
        /// 500 mV
        Mv500 = 1,
        /// 750 mV
        Mv750 = 2,
        /// 1000 mV
        Mv1000 = 3,
    }
}

codes! {
    /// OCPDEG: deglitch time of the over-current protection.
    OcpDeglitch {
        /// 1 us
        Us1 = 0,
        /// 2 us
        Us2 = 1,
        /// 4 us
        Us4 = 2,
        /// 8 us
        Us8 = 3,
    }
}

codes! {
    /// TDRIVEN, TDRIVEP: how long the gate drive is on.
    DriveTime {
        /// 250 ns
        Ns250 = 0,
        /// 500 ns
        Ns500 = 1,
        /// 1000 ns
        Ns1000 = 2,
        /// 2000 ns
        Ns2000 = 3,
    }
}

codes! {
    /// IDRIVEN: gate current of the low side.
    SinkCurrent {
        /// 100 mA
        Ma100 = 0,
        /// 200 mA
        Ma200 = 1,
        /// 300 mA
        Ma300 = 2,
        /// 400 mA
        Ma400 = 3,
    }
}

codes! {
    /// IDRIVEP: gate current of the high side.
    SourceCurrent {
        /// 50 mA
        Ma50 = 0,
        /// 100 mA
        Ma100 = 1,
        /// 150 mA
        Ma150 = 2,
        /// 200 mA
        Ma200 = 3,
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
}
