//! The registers as values.

use sorte_proto::drv8711::Status;

use super::codes::{
    Code, DeadTime, DecayMode, DriveTime, IsGain, OcpDeglitch, OcpThreshold, SampleThreshold, SinkCurrent,
    SourceCurrent, StallCount, StallDivider, StepMode,
};
use super::error::Error;
use super::word::Register;

macro_rules! register {
    (
        $(#[$doc:meta])* $name:ident { $($(#[$field_doc:meta])* $field:ident: $kind:ty = $index:literal),+ $(,)? }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "defmt", derive(defmt::Format))]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        #[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
        pub struct $name { $($(#[$field_doc])* pub $field: $kind),+ }

        #[expect(clippy::indexing_slicing, reason = "the indexes are checked when this is compiled")]
        impl $name {
            /// Which register this is.
            const REGISTER: Register = Register::$name;

            /// The value to write.
            pub fn value(self) -> u16 {
                let mut value = 0;
                $(value = const { Self::REGISTER.fields()[$index] }.set(value, self.$field.to());)+
                value
            }

            /// Decodes the register from its value; bits without a field are dropped.
            ///
            /// # Errors
            /// [`Error::ReservedCode`]
            pub fn parse(value: u16) -> Result<Self, Error> {
                Ok(Self { $($field: Code::from(Self::REGISTER, const { Self::REGISTER.fields()[$index] }.get(value))?),+ })
            }
        }
    };
}

register! {
    /// CTRL: enable, direction, micro-steps, gain.
    Ctrl {
        /// ENBL: the motor is driven.
        enable: bool = 0,
        /// RDIR: the DIR input is inverted.
        reverse_direction: bool = 1,
        /// RSTEP: makes one step and clears itself.
        step: bool = 2,
        /// MODE
        mode: StepMode = 3,
        /// EXSTALL: the stall is detected outside.
        external_stall: bool = 4,
        /// ISGAIN
        gain: IsGain = 5,
        /// DTIME
        dead_time: DeadTime = 6,
    }
}

register! {
    /// TORQUE: current limit and back-EMF sampling.
    Torque {
        /// TORQUE: full-scale current, see [`full_scale_microamps`](super::full_scale_microamps).
        torque: u8 = 0,
        /// SMPLTH. Its top bit reads back 0.
        sample_threshold: SampleThreshold = 1,
    }
}

register! {
    /// OFF: fixed off time.
    Off {
        /// TOFF in units of 500 ns, less one.
        off_time: u8 = 0,
        /// PWMMODE: the indexer is bypassed, the inputs drive the bridges.
        bypass_indexer: bool = 1,
    }
}

register! {
    /// BLANK: blanking of the current trip.
    Blank {
        /// TBLANK in units of 20 ns, 1 us at least.
        blank_time: u8 = 0,
        /// ABT: adaptive blanking.
        adaptive: bool = 1,
    }
}

register! {
    /// DECAY: current decay.
    Decay {
        /// TDECAY in units of 500 ns.
        decay_time: u8 = 0,
        /// DECMOD
        mode: DecayMode = 1,
    }
}

register! {
    /// STALL: stall detection.
    Stall {
        /// SDTHR in units of 1.8 V / 256.
        threshold: u8 = 0,
        /// SDCNT
        count: StallCount = 1,
        /// VDIV
        divider: StallDivider = 2,
    }
}

register! {
    /// DRIVE: gate drive and over-current protection.
    Drive {
        /// OCPTH
        ocp_threshold: OcpThreshold = 0,
        /// OCPDEG
        ocp_deglitch: OcpDeglitch = 1,
        /// TDRIVEN
        sink_time: DriveTime = 2,
        /// TDRIVEP
        source_time: DriveTime = 3,
        /// IDRIVEN
        sink_current: SinkCurrent = 4,
        /// IDRIVEP
        source_current: SourceCurrent = 5,
    }
}

/// All seven set-up registers; the default is what the chip holds after power-up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "arbitrary", derive(arbitrary::Arbitrary))]
pub struct Configuration {
    /// CTRL
    pub ctrl: Ctrl,
    /// TORQUE
    pub torque: Torque,
    /// OFF
    pub off: Off,
    /// BLANK
    pub blank: Blank,
    /// DECAY
    pub decay: Decay,
    /// STALL
    pub stall: Stall,
    /// DRIVE
    pub drive: Drive,
}

impl Configuration {
    /// Returns the value of a register; STATUS is 0.
    pub fn value(&self, register: Register) -> u16 {
        match register {
            Register::Ctrl => self.ctrl.value(),
            Register::Torque => self.torque.value(),
            Register::Off => self.off.value(),
            Register::Blank => self.blank.value(),
            Register::Decay => self.decay.value(),
            Register::Stall => self.stall.value(),
            Register::Drive => self.drive.value(),
            Register::Status => Status::CLEAR_ALL,
        }
    }
}

impl Default for Configuration {
    fn default() -> Self {
        Self {
            ctrl: Ctrl {
                enable: false,
                reverse_direction: false,
                step: false,
                mode: StepMode::Div4,
                external_stall: false,
                gain: IsGain::X5,
                dead_time: DeadTime::Ns850,
            },
            torque: Torque { torque: 0xff, sample_threshold: SampleThreshold::Us100 },
            off: Off { off_time: 0x30, bypass_indexer: false },
            blank: Blank { blank_time: 0x80, adaptive: false },
            decay: Decay { decay_time: 0x10, mode: DecayMode::SlowMixed },
            stall: Stall { threshold: 0x40, count: StallCount::Steps1, divider: StallDivider::Div32 },
            drive: Drive {
                ocp_threshold: OcpThreshold::Mv500,
                ocp_deglitch: OcpDeglitch::Us4,
                sink_time: DriveTime::Ns500,
                source_time: DriveTime::Ns500,
                sink_current: SinkCurrent::Ma300,
                source_current: SourceCurrent::Ma150,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_what_the_chip_holds_after_power_up() {
        for register in Register::ALL {
            assert_eq!(Configuration::default().value(register), register.reset_value(), "{}", register.name());
        }
    }

    /// All 4096 values of all registers: what is accepted gives itself back in the bits that have a field.
    #[test]
    fn every_value_comes_back() {
        fn check(register: Register, value: u16, back: Result<u16, Error>) {
            let known = register.fields().iter().fold(0, |mask, field| field.set(mask, u16::MAX));
            match back {
                Ok(back) => assert_eq!(back, value & known),
                Err(Error::ReservedCode { register: address, code }) => {
                    assert_eq!(address, register.code());
                    let (shift, first_reserved) = if register == Register::Ctrl { (3, 9) } else { (8, 6) };
                    assert!(code >= first_reserved);
                    assert_eq!(u16::from(code), value >> shift & if register == Register::Ctrl { 15 } else { 7 });
                }
                Err(other) => panic!("{other}"),
            }
        }
        for value in (0..0x1000).step_by(if cfg!(miri) { 61 } else { 1 }) {
            check(Register::Ctrl, value, Ctrl::parse(value).map(Ctrl::value));
            check(Register::Torque, value, Torque::parse(value).map(Torque::value));
            check(Register::Off, value, Off::parse(value).map(Off::value));
            check(Register::Blank, value, Blank::parse(value).map(Blank::value));
            check(Register::Decay, value, Decay::parse(value).map(Decay::value));
            check(Register::Stall, value, Stall::parse(value).map(Stall::value));
            check(Register::Drive, value, Drive::parse(value).map(Drive::value));
            check(Register::Status, value, Ok(Status::of_register(value).bits().into()));
        }
    }
}
