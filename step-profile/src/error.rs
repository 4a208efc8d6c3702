servowire_core::errors! {
    /// Why a parameter or a command is refused. A refusal changes nothing.
    ///
    /// [`Profile::new`](crate::Profile::new) checks in this order: ramp entry length zero, ramp entry length too long,
    /// speed too high, speed too low, initial sync_time.
    pub enum Error {
        /// A ramp entry has to last at least one step.
        #[error("0 steps per ramp entry, at least 1 needed")]
        ZeroSegmentLength = 1,
        /// 32 ramp entries of this length do not fit a 32-bit step count.
        #[error("{steps_per_entry} steps per ramp entry, at most {limit}")]
        SegmentTooLong = 2 {
            /// Steps per ramp entry, as requested.
            steps_per_entry: u32,
            /// The longest: 2^27 - 1.
            limit: u32,
        },
        /// Above 250 kHz two pulses would fall into one cycle.
        #[error("{} Hz is above 250 kHz: speed constant {speed}, at least {limit} needed", hertz(*speed))]
        StepRateTooHigh = 3 {
            /// Speed constant 2^16 / f\[MHz\], as requested.
            speed: u32,
            /// The smallest: 262144.
            limit: u32,
        },
        /// The first step of the ramp lasts 2^32 ns or longer.
        #[error("at {} Hz the first step of the ramp is longer than 2^32 ns: speed constant {speed}, at most {limit}", hertz(*speed))]
        StepTimeOverflow = 4 {
            /// Speed constant 2^16 / f\[MHz\], as requested.
            speed: u32,
            /// The largest for this ramp table.
            limit: u32,
        },
        /// A sync_time must be within a cycle.
        #[error("sync_time {sync_time} ns, at most {limit}")]
        SyncTimeOutOfRange = 5 {
            /// Start time of a pulse in ns, as requested.
            sync_time: u32,
            /// The latest: 3999 ns.
            limit: u32,
        },
        /// A ramp entry is below 1000 (faster than full speed) or above the previous entry.
        #[error("ramp entry {index} is {entry}, wanted 1000..={limit}")]
        InvalidRampTable = 6 {
            /// Which entry, 0..=31.
            index: u8,
            /// Its value.
            entry: u32,
            /// The previous entry, or the largest 32-bit number for the first.
            limit: u32,
        },
        /// The denominator of a frequency must be 1 or more.
        #[error("a frequency with denominator 0")]
        ZeroDenominator = 7,
        /// The speed constant of this frequency does not fit 32 bits.
        #[error("step frequency below 15.26 Hz: its speed constant does not fit 32 bits")]
        FrequencyTooLow = 8,
        /// A move (or the wait after it) is still in progress.
        #[error("the axis is still moving")]
        Moving = 9,
        /// No motor is selected to move.
        #[error("no motor is selected")]
        NoMotor = 10,
    }
}

/// The step frequency of a speed constant, 2^16 / f\[MHz\], in Hz.
fn hertz(speed: u32) -> u64 {
    65_536_000_000_u64.checked_div(speed.into()).unwrap_or(u64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn an_error_names_its_limit() {
        let error = Error::StepRateTooHigh { speed: 65_536, limit: 262_144 };
        assert_eq!(error.to_string(), "1000000 Hz is above 250 kHz: speed constant 65536, at least 262144 needed");
        assert_eq!((error.class(), error.class().name()), (ErrorClass::StepRateTooHigh, "step_rate_too_high"));
    }

    /// The order of the checks of a profile.
    #[test]
    fn the_first_classes_are_in_the_order_of_the_checks() {
        use ErrorClass::*;
        let order = [ZeroSegmentLength, SegmentTooLong, StepRateTooHigh, StepTimeOverflow, SyncTimeOutOfRange];
        assert_eq!(ErrorClass::ALL[..5], order);
    }
}
