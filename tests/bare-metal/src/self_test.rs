//! Vector rows, decoded again on the target. A protocol is one file here and one line in [`ALL`].

use cortex_m_semihosting::hprintln;

#[cfg(feature = "servowire-core")]
mod core_time;
#[cfg(feature = "servowire-drivers")]
pub(crate) mod drivers;
#[cfg(feature = "hdsl")]
pub(crate) mod hdsl;
#[cfg(feature = "nikon-aformat")]
pub(crate) mod nikon;
#[cfg(feature = "nrz-line")]
mod nrz_line;
#[cfg(feature = "rtex-block")]
pub(crate) mod rtex;
#[cfg(feature = "sorte-proto")]
pub(crate) mod sorte;
#[cfg(feature = "step-motion")]
mod step_motion;
#[cfg(feature = "step-profile")]
pub(crate) mod step_profile;
#[cfg(feature = "tformat")]
pub(crate) mod tformat;

/// How the rows of a topic fared.
#[derive(Default)]
pub(crate) struct Tally {
    pub(crate) passed: u32,
    pub(crate) failed: u32,
}

/// A topic's name and what runs its rows.
pub(crate) type Topic = (&'static str, fn() -> Tally);

pub(crate) const ALL: &[&[Topic]] = &[
    #[cfg(feature = "servowire-core")]
    core_time::TOPICS,
    #[cfg(feature = "nrz-line")]
    nrz_line::TOPICS,
    #[cfg(feature = "hdsl")]
    hdsl::TOPICS,
    #[cfg(feature = "nikon-aformat")]
    nikon::TOPICS,
    #[cfg(feature = "rtex-block")]
    rtex::TOPICS,
    #[cfg(feature = "sorte-proto")]
    sorte::TOPICS,
    #[cfg(feature = "step-motion")]
    step_motion::TOPICS,
    #[cfg(feature = "step-profile")]
    step_profile::TOPICS,
    #[cfg(feature = "tformat")]
    tformat::TOPICS,
    #[cfg(feature = "servowire-drivers")]
    drivers::TOPICS,
];

/// Runs every row; a row that fails is named.
fn each<T>(rows: &[T], name: impl Fn(&T) -> &str, good: impl Fn(&T) -> bool) -> Tally {
    let mut tally = Tally::default();
    for row in rows {
        if good(row) {
            tally.passed += 1;
        } else {
            tally.failed += 1;
            hprintln!("row {} differs", name(row));
        }
    }
    tally
}
