/// Why a parameter or a command is refused. A refusal leaves everything as it was.
///
/// [`Profile::new`](crate::Profile::new) checks in this order: ramp entry length zero, ramp entry length too long,
/// speed too high, speed too low, initial sync_time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Error {
    /// A ramp entry has to last one step at least.
    #[error("0 steps a ramp entry, at least 1 needed")]
    ZeroSegmentLength,
    /// 32 ramp entries of this length do not fit a 32-bit step count.
    #[error("{steps_per_entry} steps a ramp entry, at most {limit}")]
    SegmentTooLong {
        /// Steps a ramp entry, as asked for.
        steps_per_entry: u32,
        /// The longest: 2^27 - 1.
        limit: u32,
    },
    /// Above 250 kHz two pulses would fall into one cycle.
    #[error("speed constant {speed} is above 250 kHz, at least {limit} needed")]
    StepRateTooHigh {
        /// Speed constant 2^16 / f\[MHz\], as asked for.
        speed: u32,
        /// The smallest: 262144.
        limit: u32,
    },
    /// The first step of the ramp lasts 2^32 ns or longer.
    #[error("speed constant {speed} makes the first step of the ramp longer than 2^32 ns, at most {limit}")]
    StepTimeOverflow {
        /// Speed constant 2^16 / f\[MHz\], as asked for.
        speed: u32,
        /// The largest for this ramp table.
        limit: u32,
    },
    /// A sync_time lies within a cycle.
    #[error("sync_time {sync_time} ns, at most {limit}")]
    SyncTimeOutOfRange {
        /// Start time of a pulse in ns, as asked for.
        sync_time: u32,
        /// The latest: 3999 ns.
        limit: u32,
    },
    /// A ramp entry is below 1000 (faster than full speed) or above the entry before it.
    #[error("ramp entry {index} is {entry}, wanted 1000..={limit}")]
    InvalidRampTable {
        /// Which entry, 0..=31.
        index: u8,
        /// Its value.
        entry: u32,
        /// The entry before it, or the largest 32-bit number for the first.
        limit: u32,
    },
    /// A motor selection has bits for four motors.
    #[error("motor mask {mask:#x}, at most {limit:#x}")]
    InvalidMotorMask {
        /// The mask, as asked for.
        mask: u32,
        /// All motors: 0xf.
        limit: u32,
    },
    /// Micro-step profiles are numbered 0 (full step) to 8 (1/256).
    #[error("micro-step profile {code}, at most {limit}")]
    InvalidMicrostep {
        /// The profile code, as asked for.
        code: u32,
        /// The finest: 8.
        limit: u32,
    },
    /// The operating mode is not one of 0..=4.
    #[error("operating mode {code}, at most {limit}")]
    InvalidMode {
        /// The mode, as asked for.
        code: u32,
        /// The last: 4.
        limit: u32,
    },
    /// A frequency is a fraction with a denominator of 1 or more.
    #[error("a frequency with denominator 0")]
    ZeroDenominator,
    /// The speed constant of this frequency does not fit 32 bits.
    #[error("step frequency below 15.26 Hz: its speed constant does not fit 32 bits")]
    FrequencyTooLow,
    /// A move (or the wait after it) is still under way.
    #[error("the axis is still moving")]
    Moving,
    /// No motor is selected to move.
    #[error("no motor is selected")]
    NoMotor,
}

/// The kind of an [`Error`], for counters and statistics.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
#[allow(missing_docs, reason = "each stands for the error of the same name")]
pub enum ErrorClass {
    ZeroSegmentLength,
    SegmentTooLong,
    StepRateTooHigh,
    StepTimeOverflow,
    SyncTimeOutOfRange,
    InvalidRampTable,
    InvalidMotorMask,
    InvalidMicrostep,
    InvalidMode,
    ZeroDenominator,
    FrequencyTooLow,
    Moving,
    NoMotor,
}

impl ErrorClass {
    /// All classes; the first five in the order of [`Profile::new`](crate::Profile::new).
    pub const ALL: [Self; 13] = [
        Self::ZeroSegmentLength,
        Self::SegmentTooLong,
        Self::StepRateTooHigh,
        Self::StepTimeOverflow,
        Self::SyncTimeOutOfRange,
        Self::InvalidRampTable,
        Self::InvalidMotorMask,
        Self::InvalidMicrostep,
        Self::InvalidMode,
        Self::ZeroDenominator,
        Self::FrequencyTooLow,
        Self::Moving,
        Self::NoMotor,
    ];

    /// The name as logs and test vectors spell it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ZeroSegmentLength => "ZeroSegmentLength",
            Self::SegmentTooLong => "SegmentTooLong",
            Self::StepRateTooHigh => "StepRateTooHigh",
            Self::StepTimeOverflow => "StepTimeOverflow",
            Self::SyncTimeOutOfRange => "SyncTimeOutOfRange",
            Self::InvalidRampTable => "InvalidRampTable",
            Self::InvalidMotorMask => "InvalidMotorMask",
            Self::InvalidMicrostep => "InvalidMicrostep",
            Self::InvalidMode => "InvalidMode",
            Self::ZeroDenominator => "ZeroDenominator",
            Self::FrequencyTooLow => "FrequencyTooLow",
            Self::Moving => "Moving",
            Self::NoMotor => "NoMotor",
        }
    }
}

impl Error {
    /// The kind of this error.
    pub const fn class(self) -> ErrorClass {
        match self {
            Self::ZeroSegmentLength => ErrorClass::ZeroSegmentLength,
            Self::SegmentTooLong { .. } => ErrorClass::SegmentTooLong,
            Self::StepRateTooHigh { .. } => ErrorClass::StepRateTooHigh,
            Self::StepTimeOverflow { .. } => ErrorClass::StepTimeOverflow,
            Self::SyncTimeOutOfRange { .. } => ErrorClass::SyncTimeOutOfRange,
            Self::InvalidRampTable { .. } => ErrorClass::InvalidRampTable,
            Self::InvalidMotorMask { .. } => ErrorClass::InvalidMotorMask,
            Self::InvalidMicrostep { .. } => ErrorClass::InvalidMicrostep,
            Self::InvalidMode { .. } => ErrorClass::InvalidMode,
            Self::ZeroDenominator => ErrorClass::ZeroDenominator,
            Self::FrequencyTooLow => ErrorClass::FrequencyTooLow,
            Self::Moving => ErrorClass::Moving,
            Self::NoMotor => ErrorClass::NoMotor,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::format;
    use std::string::ToString;

    #[test]
    fn an_error_is_at_most_two_words_and_names_its_limit() {
        assert!(size_of::<Error>() <= 16);
        let error = Error::StepRateTooHigh { speed: 1, limit: 262_144 };
        assert_eq!(error.to_string(), "speed constant 1 is above 250 kHz, at least 262144 needed");
        assert_eq!(error.class(), ErrorClass::StepRateTooHigh);
    }

    #[test]
    fn classes_are_called_what_they_are() {
        for (at, class) in ErrorClass::ALL.into_iter().enumerate() {
            assert_eq!(class.name(), format!("{class:?}"));
            assert_eq!(class as usize, at);
        }
    }
}
