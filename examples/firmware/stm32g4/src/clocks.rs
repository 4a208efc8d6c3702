//! The clock tree, made from the crystal of the board; time.

use cortex_m::peripheral::DWT;
use embassy_stm32::pac::RCC;
use embassy_stm32::rcc::{Hse, HseMode, Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk};
use embassy_stm32::time::Hertz;
use servowire_boards::{PllLimits, Source, start};
use servowire_core::{ClockError, TickRate, TimeBase};
use servowire_drivers::Clock;

use crate::board::{self, BOARD, Parts};

/// 2.5 Mbit/s are 64 clocks of it, exactly.
pub const CORE_HZ: u32 = 160_000_000;
/// Frequency of the oscillator in the chip.
const INTERNAL_HZ: u32 = 16_000_000;
/// How often the crystal is polled before it is given up: about 50 ms; the data sheet says 2 ms.
const LOOKS: u32 = 100_000;

/// Time from the cycle counter, which has to be read every 13 s. Copies have the same origin.
#[derive(Clone, Copy)]
pub struct Cycles(TimeBase<32>);

impl Clock for Cycles {
    #[inline]
    fn now_ns(&mut self) -> Result<u64, ClockError> {
        self.0.now_ns(DWT::cycle_count())
    }
}

/// The PLL that makes [`CORE_HZ`]: without one this does not compile.
const fn pll(source: PllSource, hz: u32) -> Pll {
    let pll = PllLimits::STM32G4.exact(hz, CORE_HZ);
    let divr = match pll.r {
        2 => PllRDiv::DIV2,
        4 => PllRDiv::DIV4,
        6 => PllRDiv::DIV6,
        _ => PllRDiv::DIV8,
    };
    // The field for the divider begins at 1.
    let (prediv, mul) = (PllPreDiv::from_bits(pll.m as u8 - 1), PllMul::from_bits(pll.n as u8));
    Pll { source, prediv, mul, divp: None, divq: None, divr: Some(divr) }
}

const OF_CRYSTAL: Pll = pll(PllSource::HSE, board::CRYSTAL_HZ);
const OF_INTERNAL: Pll = pll(PllSource::HSI, INTERNAL_HZ);

/// What an image starts with.
pub struct Start {
    /// Its part of the chip.
    pub parts: Parts,
    /// Clock source of the core.
    pub source: Source,
    /// Time.
    pub clock: Cycles,
}

impl Start {
    /// Clocks and time.
    ///
    /// # Panics
    /// If called twice.
    pub fn new() -> Self {
        let source = start(|on| RCC.cr().modify(|w| w.set_hseon(on)), || RCC.cr().read().hserdy(), LOOKS);
        let mut config = embassy_stm32::Config::default();
        (config.rcc.hse, config.rcc.pll) = match source {
            Source::Crystal => {
                (Some(Hse { freq: Hertz(BOARD.crystal_hz), mode: HseMode::Oscillator }), Some(OF_CRYSTAL))
            }
            Source::Internal => (None, Some(OF_INTERNAL)),
        };
        config.rcc.sys = Sysclk::PLL1_R;
        config.rcc.boost = true;
        let parts = board::take(embassy_stm32::init(config));
        let mut core = cortex_m::Peripherals::take().expect("called once");
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
        let clock = Cycles(TimeBase::new(TickRate::of::<CORE_HZ>(), DWT::cycle_count()));
        Self { parts, source, clock }
    }
}

impl Default for Start {
    fn default() -> Self {
        Self::new()
    }
}
