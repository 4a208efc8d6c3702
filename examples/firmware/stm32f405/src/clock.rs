//! The clock tree, and time.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use servowire_drivers::{CounterClock, TickRate};
use stm32_metapac::flash::vals::Latency;
use stm32_metapac::rcc::vals::{Hpre, Pllm, Plln, Pllp, Pllsrc, Ppre, Sw};
use stm32_metapac::{FLASH, RCC};

/// The crystal of the board: 12 MHz on a Feather, 8 on many others, 25 on a Netduino Plus 2.
pub const CRYSTAL_HZ: u32 = 12_000_000;
/// The usual 168 MHz makes 2.5 Mbit/s 1.18 % slow; of 160 MHz it is exact.
pub const CORE_HZ: u32 = 160_000_000;
/// APB2, of USART1.
pub const APB2_HZ: u32 = CORE_HZ / 2;
/// APB1, of USART2.
pub const APB1_HZ: u32 = CORE_HZ / 4;

/// Looks at a ready bit before it is given up: some milliseconds.
const LOOKS: u32 = 100_000;

/// From what the core runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The crystal: the rates are exact.
    Crystal,
    /// The internal oscillator, 1 % off at room temperature: no crystal, or another one than [`CRYSTAL_HZ`].
    Internal,
    /// No oscillator and no PLL get ready, as in an emulator without a clock tree.
    None,
}

/// 160 MHz, APB1 40 MHz, APB2 80 MHz.
pub fn start() -> Source {
    RCC.cr().modify(|w| w.set_hseon(true));
    let crystal = ready(|| RCC.cr().read().hserdy());
    let (source, input_hz) = if crystal { (Pllsrc::HSE, CRYSTAL_HZ) } else { (Pllsrc::HSI, 16_000_000) };
    // 1 MHz into the PLL, 320 MHz in it.
    RCC.pllcfgr().modify(|w| {
        w.set_pllsrc(source);
        w.set_pllm(Pllm::from_bits((input_hz / 1_000_000) as u8));
        w.set_plln(Plln::from_bits(320));
        w.set_pllp(Pllp::DIV2);
    });
    RCC.cr().modify(|w| w.set_pllon(true));
    if !ready(|| RCC.cr().read().pllrdy()) {
        return Source::None;
    }
    FLASH.acr().modify(|w| {
        w.set_latency(Latency::WS5);
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(true);
    });
    RCC.cfgr().modify(|w| {
        w.set_hpre(Hpre::DIV1);
        w.set_ppre1(Ppre::DIV4);
        w.set_ppre2(Ppre::DIV2);
        w.set_sw(Sw::PLL1_P);
    });
    match (ready(|| RCC.cfgr().read().sws() == Sw::PLL1_P), crystal) {
        (false, _) => Source::None,
        (true, true) => Source::Crystal,
        (true, false) => Source::Internal,
    }
}

fn ready(mut look: impl FnMut() -> bool) -> bool {
    (0..LOOKS).any(|_| look())
}

/// Starts the SysTick, which counts 24 bits down with an eighth of the core clock. It has to be looked at every 0.4 s.
pub fn time(mut timer: SYST) -> CounterClock<impl FnMut() -> u32, 24> {
    timer.set_clock_source(SystClkSource::External);
    timer.set_reload(0x00ff_ffff);
    timer.clear_current();
    timer.enable_counter();
    CounterClock::new(TickRate::of::<{ CORE_HZ / 8 }>(), move || !timer.cvr.read())
}
