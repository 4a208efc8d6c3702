//! The timing of an image, and its console output once a second.

use core::fmt::Display;

use defmt::{Display2Format, info, warn};
use embassy_stm32::Peri;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::{Duration, Ticker};
use servowire_boards::{FirstLine, Source};

use crate::board::BOARD;
use crate::clocks::CORE_HZ;
use crate::control;

/// Readings per second.
pub const READ_HZ: u32 = 5_000;

/// The first line.
pub fn first_line(image: &'static str, source: Source, bits_per_second: u32) {
    let version = env!("CARGO_PKG_VERSION");
    let line = FirstLine { image, version, board: &BOARD, core_hz: CORE_HZ, source, bits_per_second };
    info!("{}", Display2Format(&line));
}

/// Longer than any wait here.
const WATCHDOG_US: u32 = 100_000;

/// When to read, and the readings since the last report.
pub struct Report {
    ticker: Ticker,
    watchdog: IndependentWatchdog<'static, IWDG>,
    good: u32,
    bad: u32,
}

impl Report {
    /// Starts the watchdog.
    pub fn new(watchdog: Peri<'static, IWDG>) -> Self {
        let mut watchdog = IndependentWatchdog::new(watchdog, WATCHDOG_US);
        watchdog.unleash();
        Self { ticker: Ticker::every(Duration::from_hz(READ_HZ.into())), watchdog, good: 0, bad: 0 }
    }

    /// Waits for the instant of the next reading, and feeds the watchdog.
    pub async fn next(&mut self) {
        self.ticker.next().await;
        self.watchdog.pet();
    }

    /// Counts a reading; prints the result of the last one every second.
    pub fn reading<S: Display, E: Display>(&mut self, position: &Result<S, E>) {
        match position {
            Ok(_) => self.good += 1,
            Err(_) => self.bad += 1,
        }
        let Self { good, bad, .. } = *self;
        if good + bad < READ_HZ {
            return;
        }
        match position {
            Ok(sample) => info!("{}, {} good, {} bad", Display2Format(sample), good, bad),
            Err(error) => warn!("no position: {}, {} good, {} bad", Display2Format(error), good, bad),
        }
        match control::field() {
            Some(field) => info!("ENABLE on, field at {} millidegrees", field.millidegrees()),
            None => info!("ENABLE off"),
        }
        (self.good, self.bad) = (0, 0);
    }
}
