//! What the protocol crates refuse at the moment of use, for the drivers to refuse too.

/// T-Format: an encoder with 23 bits a turn, in turn 3.
#[cfg(feature = "tformat")]
pub mod tformat {
    use tformat::{Almc, Doubt, Policy, Resolution};

    /// Any age, no alarm.
    pub const STRICT: Policy = Policy::new(u64::MAX);

    pub struct Row {
        pub what: &'static str,
        pub resolution: Resolution,
        pub alarms: Almc,
        pub policy: Policy,
        pub is: fn(Doubt) -> bool,
    }

    pub fn widths(abs_bits: u8, abm_bits: u8) -> Resolution {
        Resolution::new(abs_bits, abm_bits).unwrap()
    }

    pub fn rows() -> [Row; 4] {
        let good = Row {
            what: "older than a nanosecond",
            resolution: widths(23, 16),
            alarms: Almc::empty(),
            policy: Policy::new(1),
            // Eleven fields of 4 us at the least.
            is: |doubt| matches!(doubt, Doubt::Old { age_ns: 44_000..=60_000 }),
        };
        [
            Row {
                what: "alarms",
                alarms: Almc::BE,
                policy: STRICT,
                is: |doubt| doubt == Doubt::Alarms { alarms: Almc::BE },
                ..good
            },
            Row {
                what: "17 bits a turn",
                resolution: widths(17, 16),
                policy: STRICT,
                is: |doubt| doubt == Doubt::OtherEncoder { enid: 0x17, abs_bits: 17 },
                ..good
            },
            Row {
                what: "one bit of turns",
                resolution: widths(23, 1),
                policy: STRICT,
                is: |doubt| doubt == Doubt::UpperBits { value: 3, excess: 2 },
                ..good
            },
            good,
        ]
    }
}

/// A-format: an encoder with 20 bits a turn and 16 of turns, in turn 3.
#[cfg(feature = "nikon")]
pub mod nikon {
    use nikon_aformat::{Alm, Doubt, EncoderStatus, Policy, Resolution};

    /// Any age, no alarm.
    pub const STRICT: Policy = Policy::new(u64::MAX);

    pub struct Row {
        pub what: &'static str,
        pub resolution: Resolution,
        pub alarms: Alm,
        pub policy: Policy,
        pub is: fn(Doubt) -> bool,
    }

    pub fn widths(st_bits: u8, mt_bits: u8) -> Resolution {
        Resolution::new(st_bits, mt_bits).unwrap()
    }

    pub fn rows() -> [Row; 4] {
        let good = Row {
            what: "older than a nanosecond",
            resolution: widths(20, 16),
            alarms: Alm::empty(),
            policy: Policy::new(1),
            // Four frames of 7.2 us at the least.
            is: |doubt| matches!(doubt, Doubt::Old { age_ns: 28_800..=60_000 }),
        };
        [
            Row {
                what: "no battery",
                alarms: Alm::BATT,
                policy: STRICT,
                is: |doubt| matches!(doubt, Doubt::Status { es } if es.contains(EncoderStatus::BATT)),
                ..good
            },
            Row {
                what: "5 bits a turn",
                resolution: widths(5, 16),
                policy: STRICT,
                is: |doubt| doubt == Doubt::UpperBits { width: 21 },
                ..good
            },
            Row {
                what: "one bit of turns",
                resolution: widths(20, 1),
                policy: STRICT,
                is: |doubt| doubt == Doubt::UpperBits { width: 21 },
                ..good
            },
            good,
        ]
    }
}
