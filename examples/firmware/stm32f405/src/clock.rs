//! The clock tree, and time.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use servowire_boards::{Counter, Pll, PllLimits, Source, waited};
use servowire_core::TickRate;
use stm32_metapac::flash::vals::Latency;
use stm32_metapac::rcc::vals::{Hpre, Pllm, Plln, Pllp, Pllsrc, Ppre, Sw};
use stm32_metapac::{FLASH, RCC};

/// The crystal of the board: 12 MHz on a Feather, 8 on many others, 25 on a Netduino Plus 2.
pub const CRYSTAL_HZ: u32 = 12_000_000;
/// With the usual 168 MHz, 2.5 Mbit/s would be 1.18 % slow; with 160 MHz it is exact.
pub const CORE_HZ: u32 = 160_000_000;
/// APB2, of USART1.
pub const APB2_HZ: u32 = CORE_HZ / 2;
/// APB1, of USART2.
pub const APB1_HZ: u32 = CORE_HZ / 4;

/// How often a ready bit is polled before it is given up: some milliseconds.
const LOOKS: u32 = 100_000;
/// Frequency of the oscillator in the chip.
const INTERNAL_HZ: u32 = 16_000_000;

const OF_CRYSTAL: Pll = PllLimits::STM32F4.exact(CRYSTAL_HZ, CORE_HZ);
const OF_INTERNAL: Pll = PllLimits::STM32F4.exact(INTERNAL_HZ, CORE_HZ);

/// Sets 160 MHz, APB1 40 MHz, APB2 80 MHz, and returns the clock source; `None` if no PLL becomes ready, as in an emulator
/// without a clock tree.
pub fn start() -> Option<Source> {
    let source = servowire_boards::start(|on| RCC.cr().modify(|w| w.set_hseon(on)), || RCC.cr().read().hserdy(), LOOKS);
    let (input, pll) = match source {
        Source::Crystal => (Pllsrc::HSE, OF_CRYSTAL),
        Source::Internal => (Pllsrc::HSI, OF_INTERNAL),
    };
    RCC.pllcfgr().modify(|w| {
        w.set_pllsrc(input);
        w.set_pllm(Pllm::from_bits(pll.m as u8));
        w.set_plln(Plln::from_bits(pll.n as u16));
        w.set_pllp(Pllp::from_bits((pll.r / 2 - 1) as u8));
    });
    RCC.cr().modify(|w| w.set_pllon(true));
    if !waited(|| RCC.cr().read().pllrdy(), LOOKS) {
        return None;
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
    waited(|| RCC.cfgr().read().sws() == Sw::PLL1_P, LOOKS).then_some(source)
}

/// Time from the SysTick, which counts 24 bits down with an eighth of the core clock. It has to be read every 0.4 s.
pub fn ticks(mut timer: SYST) -> Counter<24> {
    timer.set_clock_source(SystClkSource::External);
    timer.set_reload(0x00ff_ffff);
    timer.clear_current();
    timer.enable_counter();
    Counter::new(TickRate::of::<{ CORE_HZ / 8 }>(), || !SYST::get_current())
}
